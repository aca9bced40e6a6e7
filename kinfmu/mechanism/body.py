"""Bodies, their points, and the settings of a run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

from kinfmu.errors import MechanismError
from kinfmu.mechanism.expression import Expression
from kinfmu.mechanism.valid import check_number, quoted

GROUND_NAME = "ground"


class Point(NamedTuple):
    """A point fixed in a body: its coordinates s = (s_x, s_y) in the body's frame [length]."""

    x: float
    y: float


class Start(NamedTuple):
    """A rough pose from which assembly starts; None: found by assembly."""

    x: float | None = None
    y: float | None = None
    phi: float | None = None  # [rad]


@dataclass(frozen=True)
class Body:
    """A rigid body with named points in its own frame.

    The body named `ground` does not move: its frame is the world's. Numbers can be text with a unit or an expression of
    the mechanism's parameters ("a/2", "60 deg"), which the mechanism resolves.

    Args:
        name: Name of the body.
        points: Name -> (s_x, s_y) [length]. Default: none.
        start: Rough pose (x, y, phi) of the frame [length, rad], each may be None. Default: all None.

    Raises:
        MechanismError: A point is not a pair.

    """

    name: str
    points: Mapping[str, Point] = field(default_factory=dict)
    start: Start = Start()

    def __post_init__(self) -> None:
        points = {name: self._point(name, point) for name, point in self.points.items()}
        object.__setattr__(self, "points", MappingProxyType(points))
        object.__setattr__(self, "start", Start(*self.start))

    def _point(self, name: str, point: Iterable[float]) -> Point:
        try:
            x, y = () if isinstance(point, str | Mapping) else point
            return Point(x, y)
        except (TypeError, ValueError):
            raise MechanismError(
                f"[bodies.{self.name}] points.{name} = {quoted(point)} must be two numbers [x, y]"
            ) from None

    @property
    def is_ground(self) -> bool:
        return self.name == GROUND_NAME

    def __hash__(self) -> int:
        return hash((self.name, tuple(self.points.items()), self.start))


@dataclass(frozen=True)
class RunSettings:
    """Start, stop and communication step of the intended run, all [s]."""

    start: float = 0.0
    stop: float = 1.0
    step: float = 0.01

    def __post_init__(self) -> None:
        values = [getattr(self, key) for key in ("start", "stop", "step")]
        if any(isinstance(value, str | Expression) for value in values):
            return  # checked when the mechanism has resolved them
        for key, value in zip(("start", "stop", "step"), values, strict=True):
            check_number(f"[run] {key}", value)
        if self.step <= 0.0:
            raise MechanismError(f"[run] step = {float(self.step)!r} must be positive")
        if self.stop < self.start:
            raise MechanismError(f"[run] stop = {float(self.stop)!r} lies before start = {float(self.start)!r}")
