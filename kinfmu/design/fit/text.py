"""The report of a fit as text: errors of the targets, constraints, parameters and optima; notes on angles."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from kinfmu.design.fit.outcome import FitOutcome, TargetErrors, argument_unit, unit_of_unknown
from kinfmu.design.fit.problem import FitProblem
from kinfmu.design.fit.sampled import Sampled
from kinfmu.design.fit.targets import Bounds, flat
from kinfmu.display import aligned
from kinfmu.errors import listed
from kinfmu.mechanism.measures import counted_from
from kinfmu.mechanism.number import DisplayUnit
from kinfmu.mechanism.valid import is_number
from kinfmu.units import PLAUSIBLE_TURN, looks_like_degrees

MOST_OPTIMA = 10
_MOST_POINTS = 40  # of a target in the table


def report(result: FitOutcome) -> list[str]:
    """Return the lines of the report."""
    lines = [
        f"{result.mechanism.name}: sum of squares {result.squares:.9g}{_unit_of_errors(result)}, "
        f"{result.tried} designs tried"
    ]
    if result.refused:
        count, reason = sum(result.refused.values()), max(result.refused, key=lambda one: result.refused[one])
        lines.append(f"  {count} of them refused, for example: {reason}")
    lines += [f"  note: {text}" for text in angle_notes(result.problem)]
    unit = argument_unit(result.problem)
    kinds = {aim.owner: aim.reading.type for aim in (result.problem.measuring.aims if result.problem.measuring else ())}
    for one in result.errors:
        lines += ["", *_target(one, unit, counted_from(kinds.get(one.name, "")) if one.type == "measure" else "")]
    if result.constraints:
        lines += ["", "constraints"]
        for met in result.constraints:
            excess = f"{met.violation / met.display.factor:.3g}{met.display.suffix}"
            verdict = "holds" if met.holds else f"VIOLATED by {excess}"
            lines.append(f"  {met.name}: {verdict}; {met.text}")
        lines += [f"  note: {text}" for text in constraint_notes(result)]
    lines += ["", "parameters", *aligned([("", "value", "unit", "bounds", ""), *parameter_rows(result)])]
    lines += [f"  note: {text}" for text in parameter_notes(result)]
    lines += ["", "local optima"]
    units = {name: unit_of_unknown(result.problem, name) for name in result.parameters}
    titles = [name if one.unit == "1" else f"{name} [{one.unit}]" for name, one in units.items()]
    rows = [
        (
            f"{k}",
            f"{one.squares:.9g}",
            *(("hold" if one.holds else "violated",) if result.constraints else ()),
            f"{one.searches}",
            *(f"{value / units[name].factor:.6g}" for name, value in one.parameters.items()),
        )
        for k, one in enumerate(result.optima[:MOST_OPTIMA], start=1)
    ]
    constraints = ["constraints"] if result.constraints else []
    lines += aligned([("", "sum of squares", *constraints, "searches", *titles), *rows])
    if len(result.optima) > MOST_OPTIMA:
        lines.append(f"  and {len(result.optima) - MOST_OPTIMA} more")
    return lines


def _unit_of_errors(result: FitOutcome) -> str:
    """Return the unit of the errors whose squares are summed, and the rms residual in the unit of the targets."""
    units = list(dict.fromkeys(one.units[0] for one in result.errors))
    shown = {one.display[0] for one in result.errors}
    if len(units) > 1:
        return f" (errors in {listed(units)}), rms residual {result.rms:.6g}"
    display = shown.pop() if len(shown) == 1 else DisplayUnit(units[0])
    return f" (errors in {units[0]}), rms residual {result.rms / display.factor:.6g}{display.suffix}"


def _target(one: TargetErrors, unit: str, datum: str) -> Iterable[str]:
    """Yield the table of a target; datum: ' from 90 deg' after a measure that is a deviation."""
    if one.type == "measure":
        shown, factor = one.display[0].suffix, one.display[0].factor
        yield (
            f"{one.name} (measure): {one.reached[0, 0] / factor:.9g}{shown}, wanted {one.wanted[0, 0] / factor:.9g}"
            f"{shown}{datum}, error {one.errors[0, 0] / factor:.3g}{shown}"
        )
        return
    first, factors = one.display[0], np.array([column.factor for column in one.display])
    rms, largest = one.rms / first.factor, one.largest / first.factor
    yield f"{one.name} ({one.type}): rms error {rms:.6g} {first.unit}, largest error {largest:.6g} {first.unit}"
    degrees = unit == "rad"
    columns = [f"{name} [{unit}]" for name, (unit, _) in zip(one.names, one.display, strict=True)]
    titles = (
        "point",
        f"{one.argument} [{'deg' if degrees else unit}]",
        *(f"{name}, wanted" for name in columns),
        *(f"{name}, reached" for name in columns),
        f"error [{first.unit}]",
    )
    at = np.degrees(one.at) if degrees else one.at
    rows = []
    tables = (at, one.wanted / factors, one.reached / factors, one.sizes / first.factor)
    for k, (u, wanted, reached, size) in enumerate(zip(*tables, strict=True), start=1):
        rows.append((f"{k}", f"{u:.4f}", *(f"{n:.6g}" for n in wanted), *(f"{n:.6g}" for n in reached), f"{size:.3g}"))
    yield from aligned([titles, *rows[:_MOST_POINTS]])
    if len(rows) > _MOST_POINTS:
        yield f"  and {len(rows) - _MOST_POINTS} more points"


def parameter_rows(result: FitOutcome) -> list[tuple[str, ...]]:
    """Return the unknowns with their values, units and bounds, and at which bound they are."""
    problem = result.problem
    rows: list[tuple[str, ...]] = []
    for name, value in result.parameters.items():
        unit, factor = unit_of_unknown(problem, name)
        low, high = problem.bounds[name]
        at = _at_bound(value, problem.bounds[name])
        bounds = f"[{low / factor:.6g}, {high / factor:.6g}]"
        rows.append((name, f"{value / factor:.12g}", unit.removeprefix("1"), bounds, at))
    return rows


def _at_bound(value: float, bounds: Bounds) -> str:
    near = 1e-6 * (bounds.high - bounds.low)
    low, high = value - bounds.low < near, bounds.high - value < near
    return "at its lower bound" if low else "at its upper bound" if high else ""


def constraint_notes(result: FitOutcome) -> list[str]:
    """Return what to try where constraints are violated."""
    violated = [one.name for one in result.constraints if not one.holds]
    if not violated:
        return []
    bounds = result.problem.bounds
    at_bound = [name for name, value in result.parameters.items() if _at_bound(value, bounds[name])]
    wider = f"widen the bounds of {listed(at_bound)}" if at_bound else "add unknowns"
    limits = f"the limit{'s' if len(violated) > 1 else ''} of {listed(violated)}"
    return [f"no design that was found meets all constraints: {wider}, loosen {limits}, or raise --starts"]


def parameter_notes(result: FitOutcome) -> list[str]:
    """Return a line for each unknown with no effect on the targets, and for each with bare bounds in another unit.

    Also one for unknowns that the targets do not determine.
    """
    problem = result.problem
    lines = [f"{name} has no effect on the targets: any value between its bounds is as good" for name in result.idle]
    if result.undetermined:
        lines.append(f"the targets do not determine {listed(result.undetermined)}: others fit as well")
    lines += [problem.mechanism.settable.note_on_bare(name, bounds) for name, bounds in problem.unknowns.items()]
    return [line for line in lines if line]


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
