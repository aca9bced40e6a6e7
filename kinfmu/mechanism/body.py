"""Bodies, their points and masses, gravity, and the settings of a run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, NamedTuple

from kinfmu.errors import MechanismError, listed, suggestion
from kinfmu.measures.arithmetic import Value
from kinfmu.mechanism.expression import Computed, Expression
from kinfmu.mechanism.valid import check_number, is_number, quoted
from kinfmu.units import METRES

GROUND_NAME = "ground"
MASS_KEYS = ("mass", "center_of_mass", "inertia", "rod")  # of a body's table


class Point(NamedTuple):
    """A point fixed in a body: its coordinates s = (s_x, s_y) in the body's frame [length]."""

    x: float
    y: float


class Start(NamedTuple):
    """A rough pose from which assembly starts; None: found by assembly."""

    x: float | None = None
    y: float | None = None
    phi: float | None = None  # [rad]


class MassProperties(NamedTuple):
    """Mass [kg], centre of mass (x, y) in the body's frame [length], moment of inertia about it [kg m2]."""

    mass: Value
    x: Value
    y: Value
    inertia: Value


class Gravity(NamedTuple):
    """The acceleration of free fall in the world (x, y) [length/s2], such as (0, -9.81)."""

    x: float
    y: float


def read_gravity(given: Iterable[float] | None) -> Gravity | None:
    """Return the acceleration of free fall from two numbers (x, y), or raise a MechanismError."""
    try:
        return None if given is None else Gravity(*(() if isinstance(given, str | Mapping) else given))
    except TypeError:
        raise MechanismError(f"[gravity] = {quoted(given)} must be two numbers (x, y), such as (0, -9.81)") from None


@dataclass(frozen=True)
class Body:
    """A rigid body with named points in its own frame.

    The body named `ground` does not move: its frame is the world's. Numbers can be text with a unit or an expression of
    the mechanism's parameters ("a/2", "60 deg"), which the mechanism resolves.

    Args:
        name: Name of the body.
        points: Name -> (s_x, s_y) [length]. Default: none.
        start: Rough pose (x, y, phi) of the frame [length, rad], each may be None. Default: all None.
        mass: Mass [kg]. Default: 0.
        center_of_mass: Its centre of mass in its frame (s_x, s_y) [length]. Default: the origin of the frame.
        inertia: Moment of inertia about the centre of mass [kg m2]. Default: 0.
        rod: Names of two of its points between which its mass is a uniform slender rod; centre of mass and moment of
            inertia follow from it. Default: none.

    Raises:
        MechanismError: A point is not a pair.

    """

    name: str
    points: Mapping[str, Point] = field(default_factory=dict)
    start: Start = Start()
    mass: float = 0.0
    center_of_mass: Point = Point(0.0, 0.0)
    inertia: float = 0.0
    rod: tuple[str, str] | None = None

    def __post_init__(self) -> None:
        points = {name: self._point(f"points.{name}", point) for name, point in self.points.items()}
        object.__setattr__(self, "points", MappingProxyType(points))
        object.__setattr__(self, "start", Start(*self.start))
        object.__setattr__(self, "center_of_mass", self._point("center_of_mass", self.center_of_mass))
        if self.rod is not None:
            object.__setattr__(self, "rod", self._rod(self.rod))

    def _point(self, key: str, point: Iterable[float]) -> Point:
        try:
            x, y = () if isinstance(point, str | Mapping) else point
            return Point(x, y)
        except (TypeError, ValueError):
            raise MechanismError(f"[bodies.{self.name}] {key} = {quoted(point)} must be two numbers [x, y]") from None

    def _rod(self, rod: Iterable[str]) -> tuple[str, str]:
        ends = () if isinstance(rod, str | Mapping) or not isinstance(rod, Iterable) else tuple(rod)
        if len(ends) != 2 or not all(isinstance(end, str) for end in ends):
            raise MechanismError(
                f"[bodies.{self.name}] rod = {quoted(rod)} must be two points of the body, such as ['A', 'B']"
            )
        return ends

    @property
    def given_masses(self) -> dict[str, Any]:
        """The values of mass, centre of mass, inertia and rod that are not the default, by key."""
        values = {key: getattr(self, key) for key in MASS_KEYS}
        return {key: value for key, value in values.items() if value != getattr(Body, key) or _is_computed(value)}

    @property
    def has_mass(self) -> bool:
        """True if a mass is given, as a number other than 0 or as an expression."""
        return not is_number(self.mass) or _is_computed(self.mass) or self.mass != 0.0

    def mass_properties(self, length_unit: str) -> MassProperties:
        """Return mass, centre of mass and moment of inertia, in the arithmetic of the body's numbers.

            rod from a to b: centre (s_a + s_b) / 2, moment of inertia m |s_b - s_a|^2 / 12

        Args:
            length_unit: Unit of length of the mechanism.

        """
        if self.rod is None:
            return MassProperties(self.mass, *self.center_of_mass, self.inertia)
        (a_x, a_y), (b_x, b_y) = (self.points[name] for name in self.rod)
        d_x, d_y, metre = b_x - a_x, b_y - a_y, METRES[length_unit]
        inertia = self.mass * (d_x * d_x + d_y * d_y) * (metre * metre / 12.0)
        return MassProperties(self.mass, 0.5 * (a_x + b_x), 0.5 * (a_y + b_y), inertia)

    def with_mass_properties(self, length_unit: str) -> Body:
        """Return the body with centre of mass and moment of inertia in place of a rod, in any arithmetic."""
        if self.rod is None:
            return self
        mass, x, y, inertia = self.mass_properties(length_unit)
        return replace(self, mass=mass, center_of_mass=Point(x, y), inertia=inertia, rod=None)

    def check_mass(self) -> None:
        """Raise a MechanismError for an invalid mass; all are numbers by then."""
        where = f"[bodies.{self.name}]"
        if self.is_ground and self.given_masses:
            key = next(iter(self.given_masses))
            raise MechanismError(f"{where} {key}: the ground does not move, so its mass has no effect; remove the key")
        for key in ("mass", "inertia"):
            if getattr(self, key) < 0.0:
                raise MechanismError(f"{where} {key} = {float(getattr(self, key))!r} must be 0 or more")
        if self.given_masses and not self.has_mass:
            raise MechanismError(f"{where} {next(iter(self.given_masses))} needs a mass, such as mass = '1.2 kg'")
        if self.rod is not None:
            self._check_rod(f"{where} rod", self.rod)

    def _check_rod(self, where: str, rod: tuple[str, str]) -> None:
        for key in ("center_of_mass", "inertia"):
            if key in self.given_masses:
                raise MechanismError(f"{where}: '{key}' follows from the rod; remove one of the two keys")
        for end in rod:
            if end not in self.points:
                raise MechanismError(
                    f"{where}: body '{self.name}' has no point {quoted(end)}{suggestion(end, self.points)}; "
                    f"its points: {listed(self.points)}"
                )
        if self.points[rod[0]] == self.points[rod[1]]:
            raise MechanismError(f"{where} = {quoted(list(rod))} has length 0; its ends must be two places of the body")

    @property
    def is_ground(self) -> bool:
        return self.name == GROUND_NAME

    def __hash__(self) -> int:
        masses = (self.mass, self.center_of_mass, self.inertia, self.rod)
        return hash((self.name, tuple(self.points.items()), self.start, masses))


def _is_computed(value: Any) -> bool:
    """Return True for the number of an expression, or a point with one."""
    return isinstance(value, Computed) or (isinstance(value, tuple) and any(isinstance(one, Computed) for one in value))


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
