"""Notes on bare angles in targets and constraints that are probably degrees."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

from kinfmu.design.fit.numbers import flat
from kinfmu.design.fit.problem import FitProblem
from kinfmu.design.fit.sampled import Sampled
from kinfmu.mechanism.valid import is_number
from kinfmu.units import PLAUSIBLE_TURN, looks_like_degrees


def angle_notes(problem: FitProblem) -> list[str]:
    """Return a line for each key whose bare angles are more than a turn, the first of them stated.

    Values of the driver may be many turns: only multiples of 15 from 30 on, which are probably degrees, are noted.
    """
    lines = []
    for where, numbers, is_of_driver in _angles(problem):
        bare = (float(one) for one in numbers if is_number(one))
        value = next((n for n in bare if abs(n) > PLAUSIBLE_TURN and (not is_of_driver or looks_like_degrees(n))), None)
        if value is not None:
            lines.append(
                f"{where}: {value:.6g} rad is {math.degrees(value):.6g} deg, more than a turn: a bare number is in "
                f'radians; write "{value:.6g} deg" for degrees'
            )
    return lines


def _angles(problem: FitProblem) -> Iterator[tuple[str, Iterable[Any], bool]]:
    """Yield where angles are written, their numbers, and whether they are values of the driver."""
    sampled = {one.name: one for one in problem.sampled}
    is_turned = problem.argument.is_turn
    for target in problem.targets:
        if target.name in sampled:
            yield from _of_sampled(target, sampled[target.name], problem, is_turned)
    members = {one.name: ("targets", one) for one in problem.targets}
    members |= {one.name: ("constraints", one) for one in problem.constraints}  # type: ignore[misc]
    units = {aim.owner: aim.unit for aim in (problem.measuring.aims if problem.measuring else ())}
    for name in (name for name, unit in units.items() if unit == "rad"):
        table, one = members[name]
        for key in ("value", "minimum", "maximum"):
            yield f"[{table}.{name}] {key}", (getattr(one, key, None),), False


def _of_sampled(
    target: Any, one: Sampled, problem: FitProblem, is_turned: bool
) -> Iterator[tuple[str, Iterable[Any], bool]]:
    """Yield the same of a path, a function or poses."""
    where = f"[targets.{one.name}]"
    key = "poses" if one.type == "poses" else "points"
    rows = [list(row) for row in getattr(target, key)]
    angle_of = {str(name): name.is_angle for name in problem.mechanism.coordinate_names}
    is_angle = angle_of.get(one.over, False) if one.over else is_turned
    if one.type == "function":
        if is_angle:
            yield f"{where} points, x", [row[0] for row in rows], True
        if one.angles[0]:
            yield f"{where} points, y", [row[1] for row in rows], False
            yield f"{where} offset", flat(target.offset), False
    elif one.type == "poses":
        yield f"{where} poses, phi", [row[2] for row in rows], False
    for name in ("at", "step", "start") if is_angle else ():
        yield f"{where} {name}", flat(getattr(target, name, None)), True
    for name in ("begin", "end") if is_turned else ():
        yield f"{where} {name}", (getattr(target, name),), True
