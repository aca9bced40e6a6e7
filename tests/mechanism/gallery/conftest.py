"""Fixtures for the gallery's mechanisms: each is read and compiled once."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, cached_property
from pathlib import Path

import pytest

import kinfmu
from kinfmu import Mechanism
from kinfmu.fmu.interface import Drive
from kinfmu.plan import SolvePlan, compile_plan
from tests.mechanism.gallery.reference_file import read


class Member:
    """A mechanism of the gallery, its reference, and kinfmu's results, computed on first use."""

    def __init__(self, name: str, folder: Path) -> None:
        self.name = name
        self.mechanism: Mechanism = kinfmu.load(name)
        self.reference = read(name)
        self._folder = folder

    @property
    def times(self) -> list[float]:
        """Times of the reference's samples."""
        return [float(row["time"]) for row in self.reference]

    @property
    def has_forces(self) -> bool:
        """Whether it has masses or loads."""
        return self.mechanism.has_masses or bool(self.mechanism.loads)

    @cached_property
    def plan(self) -> SolvePlan:
        """How it is solved."""
        return compile_plan(self.mechanism)

    def fmu(self, drive: Drive) -> Path:
        """Its FMU, built anew."""
        return kinfmu.build(self.mechanism, self._folder / f"{self.name}_{drive}.fmu", drive=drive)


@pytest.fixture(scope="session")
def member(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Member]:
    """`member(name)`: a mechanism of the gallery."""
    folder = tmp_path_factory.mktemp("gallery")
    return cache(lambda name: Member(name, folder))
