"""Targets: what a mechanism shall do, as a fit file or a call declares it.

Numbers are bare, in the units used inside (the mechanism's unit of length, rad, s), or text with a unit. A pair
[low, high] in place of `start` or `offset` makes it an unknown of the fit within these bounds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from kinfmu.arrays import FloatArray
from kinfmu.design.fit.numbers import Numeral
from kinfmu.mechanism.measures import Reading

Free = Numeral | Sequence[Numeral]
Row = Sequence[Numeral] | FloatArray
Rows = Sequence[Sequence[Numeral]] | FloatArray


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
