"""Targets and constraints: what a mechanism shall do and keep, as fit files and calls declare it.

Numbers are bare, in the units used inside (the mechanism's unit of length, rad, s), or text with a unit. A pair
[low, high] in place of `start` or `offset` makes it an unknown of the fit within these bounds.

Constraints are penalties on what violates them. A violation v adds weight * S * (v / limit)**2 to the sum that is
minimised, where S is the sum of squares of the targets of a typical design, so that the units of targets and limits do
not matter. At the end of a search the limits are shifted, and weights raised where that is slow, until the violation
vanishes (method of multipliers; Nocedal and Wright 2006, chapter 17). Every result states the value of each constraint,
its limit and whether it holds.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import MechanismError
from kinfmu.mechanism.measures import Reading
from kinfmu.mechanism.number import read_constant
from kinfmu.mechanism.valid import is_number, quoted
from kinfmu.units import Quantity

Numeral = float | str  # bare or with a unit
Free = Numeral | Sequence[Numeral]
Row = Sequence[Numeral] | FloatArray
Rows = Sequence[Sequence[Numeral]] | FloatArray
WEIGHT = 100.0  # of constraints by default


@dataclass(frozen=True, kw_only=True)
class PathTarget:
    """A point of a body passes through given points.

    With `at` or `step` the path is timed: point k belongs to the driver value start + at[k], or start + k step. Without
    them every point is compared with the nearest point of the path.

    Args:
        name: Name of the target.
        of: The point that traces the path: 'body.point', or the name of a point of interest.
        points: Target points [x, y] in the world.
        at: Driver values of the points, counted from `start`.
        step: Equal steps of the driver from point to point, in place of `at`.
        start: Driver value at which `at` and `step` begin, or its bounds. Default: 0.
        begin: Driver value where the path begins that untimed points are compared with. Default: a whole turn, or the
            run of the file.
        end: Driver value of the end of that path.
        weight: Weight of the squares of the errors, for all points or one for each.

    """

    type: ClassVar[str] = "path"

    name: str
    of: str
    points: Rows
    at: Row | None = None
    step: Numeral | None = None
    start: Free | None = None
    begin: Numeral | None = None
    end: Numeral | None = None
    weight: float | Sequence[float] | FloatArray = 1.0


@dataclass(frozen=True, kw_only=True)
class FunctionTarget:
    """An output is a function of the driver, or of another output, through given points (function generation).

    Point k [x, y] requires that of = offset + y where the driver, or the output `over`, has the value start + x. Angles
    may differ by whole turns.

    Args:
        name: Name of the target.
        of: The output, such as 'rocker.phi'.
        points: Pairs [x, y].
        over: The output that x is a value of. Default: the driver.
        start: Value of the driver or of `over` where x is 0, or its bounds. Default: 0.
        offset: Value of the output where y is 0, or its bounds. Default: 0.
        begin: Driver value where the motion begins in which x of another output is looked for.
        end: Driver value of the end of that motion.
        weight: Weight of the squares of the errors, for all points or one for each.

    """

    type: ClassVar[str] = "function"

    name: str
    of: str
    points: Rows
    over: str | None = None
    start: Free | None = None
    offset: Free | None = None
    begin: Numeral | None = None
    end: Numeral | None = None
    weight: float | Sequence[float] | FloatArray = 1.0


@dataclass(frozen=True, kw_only=True)
class PoseTarget:
    """A body passes through given poses (motion generation).

    The error of a pose is that of x and y and, times `length`, that of the angle, which may differ by whole turns.

    Args:
        name: Name of the target.
        of: The body.
        poses: Poses [x, y, phi] of the body's frame in the world.
        length: Length by which errors of the angle [rad] are multiplied.
        at: As in `PathTarget`; without `at` and `step` the nearest pose of the motion counts.
        step: As in `PathTarget`.
        start: As in `PathTarget`.
        begin: As in `PathTarget`.
        end: As in `PathTarget`.
        weight: Weight of the squares of the errors, for all poses or one for each.

    """

    type: ClassVar[str] = "poses"

    name: str
    of: str
    poses: Rows
    length: Numeral
    at: Row | None = None
    step: Numeral | None = None
    start: Free | None = None
    begin: Numeral | None = None
    end: Numeral | None = None
    weight: float | Sequence[float] | FloatArray = 1.0


@dataclass(frozen=True, kw_only=True)
class MeasureTarget:
    """A measure of the motion has a given value.

    Derivatives of measures with respect to parameters are central differences.

    Args:
        name: Name of the target.
        of: Name of a measure of the mechanism, or a measure such as `kinfmu.measures.Range`.
        value: The value it shall have.
        weight: Weight of the square of the error.

    """

    type: ClassVar[str] = "measure"

    name: str
    of: str | Reading
    value: Numeral
    weight: float = 1.0


Target = PathTarget | FunctionTarget | PoseTarget | MeasureTarget
TARGETS = (PathTarget, FunctionTarget, PoseTarget, MeasureTarget)


@dataclass(frozen=True, kw_only=True)
class GrashofConstraint:
    """The shortest and longest link of a four-bar together are at most as long as the other two.

        s + l <= p + q

    Args:
        name: Name of the constraint.
        links: Lengths of the four links: parameters, or expressions of them.
        shortest: The link that shall be the shortest one, such as the crank, which then turns all the way round; as
            written in `links`. Default: any.
        gap: By how much p + q exceeds s + l at least, a length. Default: 0.
        weight: Weight of the square of the violation, as a part of the mean of the lengths.

    """

    type: ClassVar[str] = "grashof"

    name: str
    links: Sequence[str]
    shortest: str | None = None
    gap: Numeral = 0.0
    weight: float = WEIGHT


@dataclass(frozen=True, kw_only=True)
class MarginConstraint:
    """The motion stays away from singular points: its lowest margin, 1 / condition, is at least a value.

    Args:
        name: Name of the constraint.
        minimum: Lowest margin.
        weight: Weight of the square of the violation, as a part of the limit.

    """

    type: ClassVar[str] = "margin"

    name: str
    minimum: float
    weight: float = WEIGHT


@dataclass(frozen=True, kw_only=True)
class MeasureConstraint:
    """A measure of the motion, such as a range or a transmission angle, stays within limits.

    Args:
        name: Name of the constraint.
        of: Name of a measure of the mechanism, or a measure such as `kinfmu.measures.Range`.
        minimum: Lowest valid value. Default: none.
        maximum: Highest valid value. Default: none.
        weight: Weight of the square of the violation, as a part of the limit.

    """

    type: ClassVar[str] = "measure"

    name: str
    of: str | Reading
    minimum: Numeral | None = None
    maximum: Numeral | None = None
    weight: float = WEIGHT


Constraint = GrashofConstraint | MarginConstraint | MeasureConstraint
CONSTRAINTS = (GrashofConstraint, MarginConstraint, MeasureConstraint)


class Bounds(NamedTuple):
    """Bounds of an unknown."""

    low: float
    high: float


def read_bounds(where: str, value: object, quantity: Quantity, unit: str) -> Bounds:
    """Return bounds [low, high], low below high.

    Raise a MechanismError if the value is not two numbers in ascending order.
    """
    if isinstance(value, str) or not isinstance(value, Sequence) or len(value) != 2:
        raise MechanismError(f"{where} = {quoted(value)} must be bounds [low, high]")
    low, high = (read_constant(where, one, quantity, unit) for one in value)
    if not low < high:
        raise MechanismError(f"{where} = {quoted(value)}: the low bound must be below the high one")
    return Bounds(low, high)


def read_free(where: str, value: Any, quantity: Quantity, unit: str) -> float | Bounds:
    """Return a number, or the bounds of an unknown; None is 0."""
    if value is None:
        return 0.0
    if isinstance(value, str) or not isinstance(value, Sequence):
        return read_constant(where, value, quantity, unit)
    return read_bounds(where, value, quantity, unit)


def flat(value: Any) -> Iterable[object]:
    """Return the numbers of a number, of bounds or of a list."""
    return value if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str) else (value,)


def read_rows(where: str, rows: Any, quantities: Sequence[Quantity], unit: str, example: str) -> FloatArray:
    """Return rows of numbers (m, d), one of each quantity.

    Raise a MechanismError if there are no rows, or a row has other than d numbers.
    """
    valid = f"{where} must be a list {example}"
    if isinstance(rows, str) or not isinstance(rows, Sequence | np.ndarray) or not len(rows):
        raise MechanismError(f"{where} = {quoted(rows)} must be a list {example}")
    found = []
    for k, row in enumerate(rows, start=1):
        if isinstance(row, str) or not isinstance(row, Sequence | np.ndarray) or len(row) != len(quantities):
            raise MechanismError(f"{valid}; number {k} is {quoted(row)}")
        found.append([read_constant(f"{where}, number {k},", n, q, unit) for n, q in zip(row, quantities, strict=True)])
    return np.array(found)


def read_weights(where: str, value: Any, count: int) -> FloatArray:
    """Return weights (count,), each at least 0 and not all 0.

    Raise a MechanismError if a weight is no such number, or there are other than `count`.
    """
    weights = [value] * count if is_number(value) else value
    if isinstance(weights, str) or not isinstance(weights, Sequence | np.ndarray) or not all(map(is_number, weights)):
        raise MechanismError(f"{where} = {quoted(value)} must be a number, or a list of one for each point")
    if len(weights) != count:
        raise MechanismError(f"{where} has {len(weights)} numbers for {count} points")
    found = np.array(weights, dtype=float)
    if not (np.isfinite(found).all() and (found >= 0.0).all() and found.any()):
        raise MechanismError(f"{where} = {quoted(value)}: weights must be 0 or more, and one of them above 0")
    return found
