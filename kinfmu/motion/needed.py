"""What measures need of a motion: the coordinates that they read, and how many derivatives."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

from kinfmu.measures import Measure
from kinfmu.measures.placement import body_of
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.checks import coordinate_orders
from kinfmu.mechanism.declared import keys_of
from kinfmu.mechanism.members import COORDINATES
from kinfmu.readings import LowestMargin, Reading
from kinfmu.units import CoordinateName


class Needed(NamedTuple):
    """What measures read.

    coordinates: Of bodies and points of interest, each once. derivatives: Highest derivative: 2 because extremes lie
    between samples where accelerations place them; 0 without coordinates. margin: The margins are read too.
    """

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
    known = coordinate_orders(mechanism)
    names = (name for reading in readings for name in _coordinates(mechanism, known, reading))
    found = tuple(dict.fromkeys(names))
    return Needed(found, 2 if found else 0, any(isinstance(reading, LowestMargin) for reading in readings))


def _coordinates(
    mechanism: Mechanism, known: dict[str, tuple[CoordinateName, int]], reading: Any
) -> Iterator[CoordinateName]:
    """Yield the coordinates in the fields of a measure: named ones, and the poses of bodies and of their points."""
    cls: object = type(reading)  # object: mypy does not take type[Any] for hashable
    for key in keys_of(cls):
        value = getattr(reading, key.name)
        refers = key.refers.kind if key.refers else ""
        if isinstance(value, Measure):
            yield from _poses(known, value.bodies())
        elif value is None:
            continue
        elif refers == "body":
            yield from _poses(known, (value,))
        elif refers == "point" or (isinstance(value, str) and value in mechanism.body_points):
            yield from _poses(known, map(body_of, (value,) if isinstance(value, str) else value))
        elif isinstance(value, str) and value in known:
            yield known[value][0]


def _poses(known: dict[str, tuple[CoordinateName, int]], bodies: Iterable[str]) -> Iterator[CoordinateName]:
    for body in bodies:
        if body != GROUND_NAME:
            yield from (known[f"{body}.{axis}"][0] for axis in COORDINATES)
