"""The report of a fit as text: errors of the targets, constraints, parameters and optima."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from kinfmu.display import aligned
from kinfmu.synthesis.outcome import FitOutcome, TargetErrors, argument_unit
from kinfmu.synthesis.problem import FitProblem
from kinfmu.units import Quantity, unit_of

MOST_OPTIMA = 10
_MOST_POINTS = 40  # of a target in the table


def report(result: FitOutcome) -> list[str]:
    """Return the lines of the report."""
    lines = [
        f"{result.mechanism.name}: sum of squares {result.squares:.9g}, rms {result.rms:.6g}, "
        f"{result.tried} designs tried"
    ]
    if result.refused:
        count, reason = sum(result.refused.values()), max(result.refused, key=lambda one: result.refused[one])
        lines.append(f"  {count} of them refused, for example: {reason}")
    unit = argument_unit(result.problem)
    for one in result.errors:
        lines += ["", *_target(one, unit)]
    if result.constraints:
        lines += ["", "constraints"]
        for met in result.constraints:
            verdict = "holds" if met.holds else f"VIOLATED by {met.violation:.3g}"
            lines.append(f"  {met.name}: {verdict}; {met.text}")
    lines += ["", "parameters", *aligned([("", "value", "unit", "bounds", ""), *parameter_rows(result)])]
    lines += [f"  note: {text}" for text in parameter_notes(result)]
    lines += ["", "local optima"]
    rows = [
        (f"{k}", f"{one.total:.9g}", f"{one.searches}", *(f"{value:.6g}" for value in one.parameters.values()))
        for k, one in enumerate(result.optima[:MOST_OPTIMA], start=1)
    ]
    lines += aligned([("", "sum of squares", "searches", *result.parameters), *rows])
    if len(result.optima) > MOST_OPTIMA:
        lines.append(f"  and {len(result.optima) - MOST_OPTIMA} more")
    return lines


def _target(one: TargetErrors, unit: str) -> Iterable[str]:
    """Yield the table of a target."""
    if one.type == "measure":
        shown = "" if one.units[0] == "1" else f" {one.units[0]}"
        yield (
            f"{one.name} (measure): {one.reached[0, 0]:.9g}{shown}, wanted {one.wanted[0, 0]:.9g}{shown}, "
            f"error {one.errors[0, 0]:.3g}"
        )
        return
    length = one.units[0]
    yield f"{one.name} ({one.type}): rms {one.rms:.6g} {length}, largest error {one.largest:.6g} {length}"
    degrees = unit == "rad"
    columns = [f"{name} [{unit}]" for name, unit in zip(one.names, one.units, strict=True)]
    titles = (
        "point",
        f"{one.argument} [{'deg' if degrees else unit}]",
        *(f"{name}, wanted" for name in columns),
        *(f"{name}, reached" for name in columns),
        "error",
    )
    at = np.degrees(one.at) if degrees else one.at
    rows = []
    for k, row in enumerate(zip(at, one.wanted, one.reached, one.errors, strict=True), start=1):
        u, wanted, reached, error = row
        size = math.sqrt(float(error @ error)) if len(set(one.units)) == 1 else float(np.abs(error).max())
        rows.append((f"{k}", f"{u:.4f}", *(f"{n:.6g}" for n in wanted), *(f"{n:.6g}" for n in reached), f"{size:.3g}"))
    yield from aligned([titles, *rows[:_MOST_POINTS]])
    if len(rows) > _MOST_POINTS:
        yield f"  and {len(rows) - _MOST_POINTS} more points"


def parameter_rows(result: FitOutcome) -> list[tuple[str, ...]]:
    """Return the unknowns with their values, units and bounds, and at which bound they are."""
    problem = result.problem
    settable = problem.mechanism.settable
    rows: list[tuple[str, ...]] = []
    own = _own_quantities(problem)
    for name, value in result.parameters.items():
        setting = settable.constants.get(name) or problem.mechanism.parameters.get(name)
        quantity = setting.quantity if setting is not None else own.get(name)
        unit = "" if quantity is None or quantity.kind == "number" else unit_of(quantity, problem.mechanism.length_unit)
        low, high = problem.bounds[name]
        near = 1e-6 * (high - low)
        at = "at its lower bound" if value - low < near else "at its upper bound" if high - value < near else ""
        rows.append((name, f"{value:.12g}", unit, f"[{low:.6g}, {high:.6g}]", at))
    return rows


def parameter_notes(result: FitOutcome) -> list[str]:
    """Return a line for each unknown with no effect on the targets, and for each with bare bounds in another unit."""
    problem = result.problem
    lines = [f"{name} has no effect on the targets: any value between its bounds is as good" for name in result.idle]
    lines += [problem.mechanism.settable.note_on_bare(name, bounds) for name, bounds in problem.unknowns.items()]
    return [line for line in lines if line]


def _own_quantities(problem: FitProblem) -> dict[str, Quantity]:
    """Return the quantities of the starts and offsets of the targets, by the name of the unknown."""
    is_angle = {str(name): name.is_angle for name in problem.mechanism.coordinate_names}
    found = {}
    for target in problem.sampled:
        over, of = (Quantity("angle" if angle else "length") for angle in (is_angle.get(target.over), target.angles[0]))
        found[f"{target.name}.start"] = over if target.over else problem.argument.quantity
        found[f"{target.name}.offset"] = of
    return found
