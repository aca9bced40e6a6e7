"""The units in which the report of a fit shows unknowns, points and measures: those in which they were written."""

from __future__ import annotations

from typing import Any

from kinfmu.design.fit.numbers import flat
from kinfmu.design.fit.problem import FitProblem
from kinfmu.design.fit.sampled import Sampled
from kinfmu.mechanism.display_unit import DisplayUnit, display_unit, written_unit
from kinfmu.units import Quantity, quantity_in

_LENGTH, _ANGLE = Quantity("length"), Quantity("angle")


def of_unknown(problem: FitProblem, name: str) -> DisplayUnit:
    """Return the unit of an unknown: of its bounds, else of the mechanism file."""
    if name in problem.unknowns:
        return problem.mechanism.settable.display_unit(name, flat(problem.unknowns[name]))
    own, _, key = name.rpartition(".")
    target: Any = next(one for one in problem.targets if one.name == own)
    length = problem.mechanism.length_unit
    return display_unit(problem.quantity(name), length, written_unit(flat(getattr(target, key)), length))


def of_columns(problem: FitProblem, sampled: Sampled) -> tuple[DisplayUnit, ...]:
    """Return the units of the columns of a path, function or poses: of its points, all lengths in the first one."""
    target: Any = next(one for one in problem.targets if one.name == sampled.name)
    rows = [list(row) for row in (target.poses if sampled.type == "poses" else target.points)]
    length, found = problem.mechanism.length_unit, []
    for is_angle in sampled.angles:
        places = [k for k, angle in enumerate(sampled.angles) if angle is is_angle]
        places = [1] if sampled.type == "function" else places
        written = written_unit([row[k] for row in rows for k in places], length)
        if not written and sampled.type == "function":
            written = written_unit(flat(target.offset), length)
        found.append(display_unit(_ANGLE if is_angle else _LENGTH, length, written))
    return tuple(found)


def of_measure(problem: FitProblem, name: str, unit: str) -> DisplayUnit:
    """Return the unit of a measure: of its value or limits; `unit`: that used inside."""
    if unit == "1":
        return DisplayUnit()
    one: Any = next(one for one in (*problem.targets, *problem.constraints) if one.name == name)
    length = problem.mechanism.length_unit
    written = written_unit((getattr(one, key, None) for key in ("value", "minimum", "maximum")), length)
    return display_unit(quantity_in(unit, length), length, written)
