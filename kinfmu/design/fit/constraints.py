"""Constraints: conditions that a fitted mechanism shall meet, as penalties on what violates them.

A violation v adds weight * S * (v / limit)**2 to the sum that is minimised, where S is the sum of squares of the
targets of a typical design, so that the units of targets and limits do not matter. At the end of a search the limits
are shifted, and weights raised where that is slow, until the violation vanishes (method of multipliers; Nocedal and
Wright 2006, chapter 17). Every result states the value of each constraint, its limit and whether it holds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from kinfmu.design.fit.numbers import Numeral
from kinfmu.mechanism.measures import Reading

WEIGHT = 100.0


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
