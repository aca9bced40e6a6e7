"""How far the constraints are met by a design."""

from __future__ import annotations

from kinfmu.design.fit import display_units
from kinfmu.design.fit.equations import Evaluation
from kinfmu.design.fit.measuring import Aim
from kinfmu.design.fit.outcome import ConstraintResult
from kinfmu.design.fit.problem import FitProblem
from kinfmu.mechanism.display_unit import DisplayUnit
from kinfmu.mechanism.measures import counted_from

HOLDS = 1e-6  # violation relative to the limit, or to 1, up to which a constraint holds


def constraint_results(problem: FitProblem, found: Evaluation) -> list[ConstraintResult]:
    """Return how far the constraints of a problem are met by a design, Grashof's conditions first."""
    unit, constraints = problem.mechanism.length_unit, []
    for one, met in zip(problem.lengths, found.excess, strict=True):
        gap = float(met[: one.gaps].min()) + one.gap
        text = f"p + q - s - l = {gap:.6g} {unit}, at least {one.gap:.6g} {unit}"
        if one.shortest is not None:
            others = float(met[one.gaps :].min())
            text += f"; the other links exceed {one.links[one.shortest].text} by {others:.6g} {unit} or more"
        violation = max(0.0, -float(met.min()))
        holds = violation <= HOLDS * max(1.0, abs(one.gap))
        constraints.append(ConstraintResult(one.name, text, violation, holds, DisplayUnit(unit)))
    limited: dict[str, list[tuple[Aim, float]]] = {}
    for aim, value in zip(problem.measuring.aims if problem.measuring else (), found.measured.tolist(), strict=True):
        if aim.value is None:
            limited.setdefault(aim.owner, []).append((aim, value))
    for name, parts in limited.items():
        aim, value = max(parts, key=lambda part: part[0].excess(part[1])[0])
        display = display_units.of_measure(problem, name, aim.unit)
        limits = [f"at least {aim.minimum / display.factor:.6g}"] if aim.minimum is not None else []
        limits += [f"at most {aim.maximum / display.factor:.6g}"] if aim.maximum is not None else []
        violation = max(0.0, aim.excess(value)[0])
        size = max(1.0, *(abs(limit) for limit in (aim.minimum, aim.maximum) if limit is not None))
        shown = display.suffix
        datum = counted_from(aim.reading.type)
        number = f"{value / display.factor:.6g}{shown}{datum}"
        text = f"{aim.reading.type} = {number}, {' and '.join(limits)}{shown}"
        constraints.append(ConstraintResult(name, text, violation, violation <= HOLDS * size, display))
    return constraints
