"""Bodies, their points and masses, also of uniform rods and plates, gravity, and the settings of a run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import combinations, pairwise
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple

from kinfmu.errors import MechanismError, valid_names
from kinfmu.mechanism.expression import Computed, Expression
from kinfmu.mechanism.quantities.arithmetic import Value, sqrt
from kinfmu.mechanism.valid import check_number, is_number, quoted
from kinfmu.units import METRES, Quantity

FLAT = 1e-12  # area of corners on a line, of the square of their distance


class MassProperties(NamedTuple):
    """Mass [kg], centre of mass (x, y) in the body's frame [length], moment of inertia about it [kg m2]."""

    mass: Value
    x: Value
    y: Value
    inertia: Value


Place = Sequence[Value]  # (x, y) in the body's frame [length]


def bar(ends: Sequence[Place], width: Value, mass: Value, per_area: Value, metre: float) -> MassProperties:
    """Return a uniform bar, a rectangle around the line between two points that ends at them; a rod has no width.

        m = mass + per_area L w,   I = m (L^2 + w^2) / 12

    Args:
        ends: The two points.
        width: Its width w [length].
        mass: Its mass [kg], or 0 with a mass by area.
        per_area: Mass by area [kg/m2], or 0 with a mass.
        metre: Unit of length [m].

    """
    (a_x, a_y), (b_x, b_y) = ends
    d_x, d_y, square_metre = b_x - a_x, b_y - a_y, metre * metre
    square = d_x * d_x + d_y * d_y
    total = mass + per_area * width * sqrt(square) * square_metre
    inertia = total * (square + width * width) * (square_metre / 12.0)
    return MassProperties(total, 0.5 * (a_x + b_x), 0.5 * (a_y + b_y), inertia)


def plate(corners: Sequence[Place], mass: Value, per_area: Value, metre: float) -> MassProperties:
    """Return a uniform plate with straight edges, by Green's theorem, seen from its first corner:

        2 A = sum c_k,   c_k = x_k y_k+1 - x_k+1 y_k,   6 A x_C = sum c_k (x_k + x_k+1)
        12 A I / m = sum c_k (x_k^2 + x_k x_k+1 + x_k+1^2 + y_k^2 + y_k y_k+1 + y_k+1^2) - 12 A |r_C|^2

    Args:
        corners: Its corners, in either direction.
        mass: Its mass [kg], or 0 with a mass by area.
        per_area: Mass by area [kg/m2], or 0 with a mass.
        metre: Unit of length [m].

    """
    (x_0, y_0), *others = corners
    seen = [(x - x_0, y - y_0) for x, y in others]  # edges at the first corner add nothing
    area = moment_x = moment_y = turning = 0.0  # type: Value
    for (a_x, a_y), (b_x, b_y) in pairwise(seen):
        cross = a_x * b_y - b_x * a_y
        area = area + cross
        moment_x, moment_y = moment_x + cross * (a_x + b_x), moment_y + cross * (a_y + b_y)
        turning = turning + cross * (a_x * a_x + a_x * b_x + b_x * b_x + a_y * a_y + a_y * b_y + b_y * b_y)
    c_x, c_y = moment_x / (3.0 * area), moment_y / (3.0 * area)
    total = mass + per_area * sqrt(area * area) * (0.5 * metre * metre)
    inertia = total * (turning / (6.0 * area) - (c_x * c_x + c_y * c_y)) * (metre * metre)
    return MassProperties(total, x_0 + c_x, y_0 + c_y, inertia)


def has_area(corners: Sequence[tuple[float, float]]) -> bool:
    """Return True if corners do not lie on one line, to round-off."""
    (x_0, y_0), *others = corners
    seen = [(x - x_0, y - y_0) for x, y in others]
    area = sum(a_x * b_y - b_x * a_y for (a_x, a_y), (b_x, b_y) in pairwise(seen))
    return abs(area) > FLAT * max(x * x + y * y for x, y in seen)


def crossing(corners: Sequence[tuple[float, float]]) -> tuple[int, int] | None:
    """Return the first corners of two edges of a plate that cross or touch; None if there are none."""
    count = len(corners)
    edges = [(corners[k], corners[(k + 1) % count]) for k in range(count)]

    def side(a: tuple[float, float], b: tuple[float, float], p: tuple[float, float]) -> float:
        return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])

    for i, j in combinations(range(count), 2):
        if j - i in (1, count - 1):
            continue  # neighbours share a corner
        (a, b), (c, d) = edges[i], edges[j]
        if side(a, b, c) * side(a, b, d) <= 0.0 and side(c, d, a) * side(c, d, b) <= 0.0:
            return i, j
    return None


GROUND_NAME = "ground"
_POSITIVE = ("density", "areal_density", "thickness", "width")  # where they are given


class Point(NamedTuple):
    """A point fixed in a body: its coordinates s = (s_x, s_y) in the body's frame [length]."""

    x: float
    y: float


class Start(NamedTuple):
    """A rough pose from which assembly starts; None: found by assembly."""

    x: Annotated[float | None, Quantity("length"), "Of the frame's origin, in the world"] = None
    y: Annotated[float | None, Quantity("length"), "Of the frame's origin, in the world"] = None
    phi: Annotated[float | None, Quantity("angle"), "Angle of the frame; bare numbers are radians"] = None


class Gravity(NamedTuple):
    """The acceleration of free fall in the world (x, y) [length/s2], such as (0, -9.81)."""

    x: Annotated[float, Quantity("length", 2), "Acceleration of free fall along x, in the world"]
    y: Annotated[float, Quantity("length", 2), "Acceleration of free fall along y, in the world"]


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
        rod: Names of two of its points between which its mass is a uniform rod; centre of mass and moment of inertia
            follow from it. Default: none.
        plate: Names of three or more of its points, the corners of a uniform plate in order, in place of a rod.
        density: Of the rod or plate [kg/m3], with a thickness, in place of a mass.
        areal_density: Mass by area of the rod or plate [kg/m2], in place of a density with a thickness.
        thickness: Of the rod or plate, across the plane [length].
        width: Of the rod [length]. Default: 0, a slender rod.

    Raises:
        MechanismError: A point is not a pair.

    """

    name: str
    points: Mapping[str, Point] = field(default_factory=dict, metadata={"internal": True})  # a table of its own
    start: Start = field(default=Start(), metadata={"internal": True})  # the same
    mass: Annotated[float, Quantity("mass"), "Mass [kg]; default: 0"] = 0.0
    center_of_mass: Annotated[Point, "Centre of mass [x, y] in the body's own frame; default: its origin"] = Point(
        0.0, 0.0
    )
    inertia: Annotated[float, Quantity("inertia"), "Moment of inertia about the centre of mass [kg m2]; default: 0"] = (
        0.0
    )
    rod: Annotated[tuple[str, str] | None, "Two points of the body between which its mass is a uniform rod"] = None
    plate: Annotated[tuple[str, ...] | None, "Points of the body: the corners of a uniform plate, in order"] = None
    density: Annotated[
        float, Quantity("density"), "Of the rod or plate [kg/m3], with its thickness, in place of a mass"
    ] = 0.0
    areal_density: Annotated[float, Quantity("areal_density"), "Mass by area of the rod or plate [kg/m2]"] = 0.0
    thickness: Annotated[float, Quantity("length"), "Of the rod or plate, across the plane"] = 0.0
    width: Annotated[float, Quantity("length"), "Of the rod; default: 0, a slender rod"] = 0.0

    def __post_init__(self) -> None:
        points = {name: self._point(f"points.{name}", point) for name, point in self.points.items()}
        object.__setattr__(self, "points", MappingProxyType(points))
        object.__setattr__(self, "start", Start(*self.start))
        object.__setattr__(self, "center_of_mass", self._point("center_of_mass", self.center_of_mass))
        for key, valid in (
            ("rod", "two points of the body, such as ['A', 'B']"),
            ("plate", "three or more points of the body, such as ['A', 'B', 'C']"),
        ):
            if getattr(self, key) is not None:
                object.__setattr__(self, key, self._names(key, getattr(self, key), valid))

    def _point(self, key: str, point: Iterable[float]) -> Point:
        try:
            x, y = () if isinstance(point, str | Mapping) else point
            return Point(x, y)
        except (TypeError, ValueError):
            raise MechanismError(f"[bodies.{self.name}] {key} = {quoted(point)} must be two numbers [x, y]") from None

    def _names(self, key: str, names: Any, valid: str) -> tuple[str, ...]:
        """Return the points of a rod, two, or of a plate, three or more; valid: what they must be, in messages."""
        found = () if isinstance(names, str | Mapping) or not isinstance(names, Iterable) else tuple(names)
        is_enough = len(found) == 2 if key == "rod" else len(found) >= 3
        if not is_enough or not all(isinstance(name, str) for name in found):
            raise MechanismError(f"[bodies.{self.name}] {key} = {quoted(names)} must be {valid}")
        return found

    @property
    def given_masses(self) -> dict[str, Any]:
        """The values of mass, centre of mass, inertia, shape and density that are not the default, by key."""
        values = {key: getattr(self, key) for key in MASS_KEYS}
        return {key: value for key, value in values.items() if value != getattr(Body, key) or _is_computed(value)}

    @property
    def has_mass(self) -> bool:
        """True if a mass or a density is given, as a number other than 0 or as an expression."""
        given = (self.mass, self.density, self.areal_density)
        return any(not is_number(value) or _is_computed(value) or value != 0.0 for value in given)

    def mass_properties(self, length_unit: str) -> MassProperties:
        """Return mass, centre of mass and moment of inertia, in the arithmetic of the body's numbers.

        Args:
            length_unit: Unit of length of the mechanism.

        """
        metre = METRES[length_unit]
        shape = [self.points[name] for name in self.rod or self.plate or ()]
        if not shape:
            return MassProperties(self.mass, *self.center_of_mass, self.inertia)
        per_area = self.density * (self.thickness * metre) + self.areal_density
        if self.rod:
            return bar(shape, self.width, self.mass, per_area, metre)
        return plate(shape, self.mass, per_area, metre)

    def with_mass_properties(self, length_unit: str) -> Body:
        """Return the body with mass, centre of mass and moment of inertia in place of a shape, in any arithmetic.

        Args:
            length_unit: Unit of length of the mechanism, such as 'mm'.

        Returns:
            The body itself if it has no shape.

        """
        if self.rod is None and self.plate is None:
            return self
        mass, x, y, inertia = self.mass_properties(length_unit)
        plain = {key: getattr(Body, key) for key in ("rod", "plate", *_POSITIVE)}
        return replace(self, mass=mass, center_of_mass=Point(x, y), inertia=inertia, **plain)

    def check_mass(self) -> None:
        """Raise a MechanismError for an invalid mass; all are numbers by then."""
        where = f"[bodies.{self.name}]"
        if self.is_ground and self.given_masses:
            key = next(iter(self.given_masses))
            raise MechanismError(f"{where} {key}: the ground does not move, so its mass has no effect; remove the key")
        for key in ("mass", "inertia"):
            if getattr(self, key) < 0.0:
                raise MechanismError(f"{where} {key} = {float(getattr(self, key))!r} must be 0 or more")
        self._check_uniform(where)
        if self.given_masses and not self.has_mass:
            raise MechanismError(f"{where} {next(iter(self.given_masses))} needs a mass, such as mass = '1.2 kg'")
        for key, names in (("rod", self.rod), ("plate", self.plate)):
            if names is not None:
                self._check_shape(where, key, names)

    def _check_uniform(self, where: str) -> None:
        """Raise a MechanismError for keys of uniform bodies that are invalid, or contradict or need each other."""
        given = self.given_masses
        for key in _POSITIVE:
            if key in given and not getattr(self, key) > 0.0:
                raise MechanismError(f"{where} {key} = {float(getattr(self, key))!r} must be positive")
        for key, other in (
            ("plate", "rod"),
            ("density", "mass"),
            ("areal_density", "mass"),
            ("areal_density", "density"),
            ("areal_density", "thickness"),
        ):
            if key in given and other in given:
                raise MechanismError(f"{where}: '{key}' and '{other}' exclude each other; remove one of the two keys")
        by_area = next((key for key in ("density", "areal_density") if key in given), "")
        if by_area and not given.keys() & {"rod", "plate"}:
            raise MechanismError(
                f"{where} {by_area} needs a shape: plate = ['A', 'B', 'C'], or rod = ['A', 'B'] with a width"
            )
        for key, needed, example in (
            ("density", "thickness", "'10 mm'"),
            ("thickness", "density", "'7850 kg/m3'"),
            ("width", "rod", "['A', 'B']"),
        ):
            if key in given and needed not in given:
                raise MechanismError(f"{where} {key} needs a {needed}, such as {needed} = {example}")
        if by_area and "rod" in given and "width" not in given:
            raise MechanismError(f"{where} {by_area}: a rod needs a width, such as width = '30 mm'")

    def _check_shape(self, where: str, key: str, names: tuple[str, ...]) -> None:
        for other in ("center_of_mass", "inertia"):
            if other in self.given_masses:
                raise MechanismError(f"{where} {key}: '{other}' follows from the {key}; remove one of the two keys")
        for name in names:
            if name not in self.points:
                raise MechanismError(
                    f"{where} {key}: body '{self.name}' has no point {quoted(name)}"
                    f"{valid_names(name, self.points, 'its points')}"
                )
        places = [self.points[name] for name in names]
        what = f"{where} {key} = {quoted(list(names))}"
        if key == "rod" and places[0] == places[1]:
            raise MechanismError(f"{what} has length 0; its ends must be two places of the body")
        if key == "plate":
            touching = crossing(places)
            if touching is not None:
                first, second = (f"{names[k]}-{names[(k + 1) % len(names)]}" for k in touching)
                raise MechanismError(
                    f"{what}: its edges {first} and {second} meet; list its corners in order around it"
                )
            if not has_area(places):
                raise MechanismError(f"{what} has no area; its corners must not lie on one line")

    @property
    def is_ground(self) -> bool:
        return self.name == GROUND_NAME

    def __hash__(self) -> int:
        masses = (getattr(self, key) for key in MASS_KEYS)
        return hash((self.name, tuple(self.points.items()), self.start, *masses))


MASS_KEYS = tuple(entry.name for entry in fields(Body) if entry.name != "name" and not entry.metadata)


def _is_computed(value: Any) -> bool:
    """Return True for the number of an expression, or a point with one."""
    return isinstance(value, Computed) or (isinstance(value, tuple) and any(isinstance(one, Computed) for one in value))


MEASURED_OVER = ("run", "turn")


@dataclass(frozen=True)
class RunSettings:
    """Start, stop and communication step of the intended run, all [s].

    over: The motion of which `check` reports measures and forces: 'run', 'turn' of the driver, '' for the default.
    """

    start: Annotated[float, Quantity("time"), "First sample [s]; default: 0"] = 0.0
    stop: Annotated[float, Quantity("time"), "Last sample [s]; default: one cycle of a single driver, else 1"] = 1.0
    step: Annotated[float, Quantity("time"), "Communication step [s]; default: a 360th of it, else 0.01"] = 0.01
    over: str = field(default="", metadata={"internal": True})

    def __post_init__(self) -> None:
        if self.over not in ("", *MEASURED_OVER):
            raise MechanismError(f"[run] over = {quoted(self.over)} must be 'run' or 'turn'")
        values = [getattr(self, key) for key in RUN_TIMES]
        if any(isinstance(value, str | Expression) for value in values):
            return  # checked when the mechanism has resolved them
        for key, value in zip(RUN_TIMES, values, strict=True):
            check_number(f"[run] {key}", value)
        if self.step <= 0.0:
            raise MechanismError(f"[run] step = {float(self.step)!r} must be positive")
        if self.stop < self.start:
            raise MechanismError(f"[run] stop = {float(self.stop)!r} lies before start = {float(self.start)!r}")


RUN_TIMES = tuple(entry.name for entry in fields(RunSettings) if not entry.metadata)
