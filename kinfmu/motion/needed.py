"""What measures need of a motion: the quantities that they read, the coordinates behind these, and derivatives."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.checks import coordinate_orders
from kinfmu.mechanism.measures import LowestMargin, PressureAngle, Reading, TransmissionAngle
from kinfmu.mechanism.members import COORDINATES
from kinfmu.mechanism.quantities import PoseQuantity
from kinfmu.mechanism.quantities.arithmetic import Value, sqrt
from kinfmu.mechanism.quantities.placement import Placement, PointPair, body_of
from kinfmu.units import CoordinateName


class PathCoordinate(NamedTuple):
    """A world coordinate of a point 'body.point'."""

    point: str
    axis: str  # 'x' or 'y'


class Cosine(NamedTuple):
    """The cosine of the angle between two lines, each from a point to another."""

    first: PointPair
    second: PointPair


QuantityRead = CoordinateName | PoseQuantity | PathCoordinate | Cosine


class Needed(NamedTuple):
    """What measures read.

    quantities: Each once. coordinates: Of bodies and points of interest, of which the quantities are made. derivatives:
    Highest derivative: 2 because extremes lie between samples where accelerations place them; 0 without quantities.
    margin: The margins are read too.
    """

    quantities: tuple[QuantityRead, ...]
    coordinates: tuple[CoordinateName, ...]
    derivatives: int
    margin: bool


def needed(mechanism: Mechanism, readings: Iterable[Reading]) -> Needed:
    """Return what measures of a mechanism read.

    Args:
        mechanism: The mechanism, of which the measures are valid.
        readings: The measures.

    """
    readings = tuple(readings)
    known = {name: coordinate for name, (coordinate, _) in coordinate_orders(mechanism).items()}
    quantities = dict.fromkeys(one for reading in readings for one in _quantities(mechanism, known, reading))
    coordinates = dict.fromkeys(name for one in quantities for name in _coordinates(known, one))
    has_margin = any(isinstance(reading, LowestMargin) for reading in readings)
    return Needed(tuple(quantities), tuple(coordinates), 2 if quantities else 0, has_margin)


def _quantities(mechanism: Mechanism, known: dict[str, CoordinateName], reading: Reading) -> list[QuantityRead]:
    """Return the quantities that a measure reads; of a pressure angle the coordinates of its bodies."""
    if isinstance(reading, TransmissionAngle):
        return [Cosine(reading.coupler, reading.output)]
    if isinstance(reading, PressureAngle):
        points = [reading.follower] if reading.pivot is None else [reading.follower, reading.pivot]
        return [*_poses(known, [reading.cam, *map(body_of, points)])]
    found: list[QuantityRead] = []
    for value in (getattr(reading, "of", None), getattr(reading, "to", None)):
        if isinstance(value, PoseQuantity):
            found.append(value)
        elif value in known:
            found.append(known[value])
        elif value in mechanism.body_points:
            found += [PathCoordinate(value, axis) for axis in ("x", "y")]
    return found


def _coordinates(known: dict[str, CoordinateName], quantity: QuantityRead) -> list[CoordinateName]:
    """Return the coordinates of which a quantity is made."""
    if isinstance(quantity, CoordinateName):
        return [quantity]
    if isinstance(quantity, PoseQuantity):
        return _poses(known, quantity.bodies())
    points = [quantity.point] if isinstance(quantity, PathCoordinate) else [*quantity.first, *quantity.second]
    return _poses(known, map(body_of, points))


def _poses(known: dict[str, CoordinateName], bodies: Iterable[str]) -> list[CoordinateName]:
    """Return the coordinates of bodies, each body once."""
    moving = [body for body in dict.fromkeys(bodies) if body != GROUND_NAME]
    return [known[f"{body}.{axis}"] for body in moving for axis in COORDINATES]


def cosine_between(a: tuple[Value, Value], b: tuple[Value, Value]) -> Value:
    """Return the cosine of the angle between two vectors, in any arithmetic."""
    (a_x, a_y), (b_x, b_y) = a, b
    return (a_x * b_x + a_y * b_y) / sqrt((a_x * a_x + a_y * a_y) * (b_x * b_x + b_y * b_y))


def value_of(
    quantity: PoseQuantity | PathCoordinate | Cosine, placement: Callable[[Sequence[str]], Placement]
) -> Value:
    """Return a quantity that is made of coordinates, in any arithmetic; placement: of bodies by their names."""
    if isinstance(quantity, PoseQuantity):
        return quantity.value(placement(quantity.bodies()))
    if isinstance(quantity, PathCoordinate):
        return placement((body_of(quantity.point),)).point(quantity.point)["xy".index(quantity.axis)]
    at = placement(tuple(map(body_of, (*quantity.first, *quantity.second))))
    return cosine_between(at.vector(quantity.first), at.vector(quantity.second))


def is_angle(quantity: QuantityRead) -> bool:
    """Return True for a quantity that is an angle."""
    return quantity.is_angle if isinstance(quantity, CoordinateName) else getattr(quantity, "kind", "") == "angle"
