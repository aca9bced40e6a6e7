"""Readings of the path of a point: how straight, how round, and how close to a target path it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.errors import MechanismError
from kinfmu.mechanism.measures.reading import Begin, End, Finding, Motion, Reading
from kinfmu.mechanism.quantities.placement import PointName
from kinfmu.units import Quantity

PathPoint = Annotated[PointName, "the point that traces the path"]
LENGTH = Quantity("length")


@dataclass(frozen=True)
class _OfPath(Reading):
    """A deviation of the path of a point."""

    name: str
    of: PathPoint
    begin: Begin = None
    end: End = None


@dataclass(frozen=True)
class Straightness(_OfPath):
    """Deviation of a path from a straight line: the largest distance from the line for which it is smallest."""

    type: ClassVar[str] = "straightness"

    def read(self, motion: Motion) -> Finding:
        return Finding(motion.deviation(self.of, "line"), LENGTH)


@dataclass(frozen=True)
class Roundness(_OfPath):
    """Deviation of a path from a circle: the largest distance from the circle for which it is smallest."""

    type: ClassVar[str] = "roundness"

    def read(self, motion: Motion) -> Finding:
        return Finding(motion.deviation(self.of, "circle"), LENGTH)


@dataclass(frozen=True)
class PathDistance(Reading):
    """The largest distance of target points from a path; 0 if the path passes through all of them."""

    type: ClassVar[str] = "path_distance"

    name: str
    of: PathPoint
    targets: Annotated[tuple[tuple[float, float], ...], "target points [[x, y], ...] in the world"]
    begin: Begin = None
    end: End = None

    def __post_init__(self) -> None:
        try:
            points = tuple((x, y) for x, y in self.targets)
        except (TypeError, ValueError):
            raise MechanismError(
                f"[measures.{self.name}] targets = {self.targets!r} must be a list of points [[x, y], ...]"
            ) from None
        object.__setattr__(self, "targets", points)

    def check(self) -> None:
        if not self.targets:
            raise MechanismError(f"[measures.{self.name}] targets must hold one point or more")

    def read(self, motion: Motion) -> Finding:
        distance, x = motion.path_distance(self.of, self.targets)
        return Finding(distance, LENGTH, (x,))
