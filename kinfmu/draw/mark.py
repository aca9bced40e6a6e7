"""The contract of a mark: one thing that a figure shows."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from kinfmu.draw.names import Name
from kinfmu.draw.sheet import Sheet
from kinfmu.run import FloatArray


@dataclass(frozen=True, eq=False)
class Mark(ABC):
    """A leaf is a frozen dataclass in world coordinates; its ornaments are sized on the sheet."""

    @abstractmethod
    def extent(self) -> FloatArray:
        """World coordinates (k, 2) that the sheet must hold."""

    @abstractmethod
    def draw(self, sheet: Sheet) -> list[Name]:
        """Put it on the sheet, over what is there already; its names, to be placed once everything is drawn."""
