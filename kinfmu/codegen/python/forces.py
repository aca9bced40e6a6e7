"""A force stage of an FMU as Python source: a module of the standard library, next to the model of a Solver.

It holds one function, which gives efforts, inertias and energies of one sample, or reactions:

    forces(time, u, ud, udd, z, zd, zdd, slopes, efforts, parameters)

z are the unknowns of all blocks, zd and zdd their derivatives in time; slopes are dz/du for one driver after another.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from kinfmu.codegen.forces import ARGUMENTS, places_of_symbols
from kinfmu.codegen.python.block_code import indented, matrix, tupled
from kinfmu.codegen.python.stage import OF_NUMBERS, given_symbols, has_roots, stage_curves, stage_lines
from kinfmu.codegen.writer import identifier
from kinfmu.plan import SolvePlan
from kinfmu.plan.forces import ForceSteps
from kinfmu.plan.steps import LinearSolve
from kinfmu.solver.python.curve import CurveData


def emit_forces(plan: SolvePlan, steps: ForceSteps) -> str:
    """Return the source text; linear systems of three and more unknowns are left to the module `solutions`."""
    curves = stage_curves(steps)
    return "\n".join(
        [
            f'"""Forces of {plan.mechanism.name}: generated from its mechanism, not to be edited."""',
            "",
            "from math import atan2, cos, floor, sin",
            *(["", "from .curve import curve"] if curves else []),
            *(["", "from .roots import sqrt"] if has_roots(steps) else []),
            *(["", "from .solutions import solutions"] if solves(steps) else []),
            "",
            f"FORCES = {tuple(map(str, steps.names))!r}",
            *(f"{name} = {data!r}" for data, name in curves.items()),
            "",
            "",
            *_function(plan, steps, curves),
            "",
        ]
    )


def load_forces(plan: SolvePlan, steps: ForceSteps) -> Callable[..., tuple[float, ...]]:
    """Return the function of the source, compiled."""
    curves = stage_curves(steps)
    namespace = OF_NUMBERS | {name: data for data, name in curves.items()}
    exec("\n".join(_function(plan, steps, curves)), namespace)  # noqa: S102  our own generated source
    forces: Callable[..., tuple[float, ...]] = namespace["forces"]
    return forces


def _function(plan: SolvePlan, steps: ForceSteps, curves: Mapping[CurveData, str]) -> list[str]:
    places, given = places_of_symbols(plan), given_symbols(steps)
    lines, expressions = stage_lines(steps, given, curves, _solve)
    values = iter(expressions)
    results = ["0.0" if node.constant == 0.0 else next(values) for node in steps.results]
    return [
        f"def forces({', '.join(ARGUMENTS)}):",
        '    """FORCES of one sample, in SI units."""',
        *(f"    {identifier(name)} = {places[name]}" for name in given if identifier(name) != places[name]),
        *indented(lines),
        f"    return {tupled(results)}",
    ]


def solves(steps: ForceSteps) -> bool:
    """Return True for a stage with linear systems of three and more unknowns."""
    return any(isinstance(step, LinearSolve) for step in steps.steps)


def _solve(rows: Sequence[Sequence[Any]], columns: Sequence[Sequence[Any]], names: Sequence[str]) -> list[str]:
    return [f"{tupled(names)} = solutions({matrix(rows)}, {matrix(columns)})"]
