"""The base class of marks: one mark is one thing that a figure shows."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from kinfmu.draw.names import Name
from kinfmu.draw.sheet import Sheet
from kinfmu.run import FloatArray


@dataclass(frozen=True, eq=False)
class Mark(ABC):
    """A thing to draw; subclasses are frozen dataclasses in world coordinates, and the sheet sets sizes of details."""

    @abstractmethod
    def extent(self) -> FloatArray:
        """Return world coordinates (k, 2) that must be on the sheet."""

    @abstractmethod
    def draw(self, sheet: Sheet) -> list[Name]:
        """Draw it over what is on the sheet, and return its names, which are placed when everything is drawn."""
