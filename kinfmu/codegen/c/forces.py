"""A force stage of a native FMU as a C file: a function of one sample. See kinfmu/codegen/python/forces.py."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from kinfmu.codegen.c.model import curve_tables
from kinfmu.codegen.c.text import FUNCTIONS, function
from kinfmu.codegen.forces import ARGUMENTS, places_of_symbols
from kinfmu.codegen.python.stage import given_symbols, stage_curves, stage_lines
from kinfmu.codegen.writer import identifier
from kinfmu.plan import SolvePlan
from kinfmu.plan.forces import ForceSteps

SIGNATURE = (
    "void kf_{stage}(double time, const double *u, const double *ud, const double *udd, const double *z,\n"
    "         const double *zd, const double *zdd, const double *slopes, const double *efforts,\n"
    "         const double *parameters, double *forces)"
)


def emit_forces(plan: SolvePlan, steps: ForceSteps, stage: str = "forces", *, are_loads_open: bool = True) -> str:
    """Return the text of a stage; linear systems of three and more unknowns are left to `kf_solutions`.

    Args:
        plan: The plan.
        steps: Of the stage.
        stage: Its name.
        are_loads_open: Constants of the laws of loads can be set: they follow the efforts of external loads.

    """
    places, given = places_of_symbols(plan, are_loads_open=are_loads_open), given_symbols(steps)
    curves = {data: f"&{name.lower()}" for data, name in stage_curves(steps).items()}
    buffers: list[str] = []

    def solve(rows: Sequence[Sequence[Any]], columns: Sequence[Sequence[Any]], names: Sequence[str]) -> list[str]:
        m, k, count, at = len(rows), len(rows[0]), len(columns), len(buffers)
        sizes = {"a": m * k, "b": m * count, "x": k * count, "factors": 3 * m * k + 2 * (m + k)}
        buffers.append(f"double {', '.join(f'{name}{at}[{size}]' for name, size in sizes.items())};")
        filled = [f"a{at}[{n}] = {entry}" for n, entry in enumerate(entry for row in rows for entry in row)]
        filled += [f"b{at}[{n}] = -({entry})" for n, entry in enumerate(entry for one in columns for entry in one)]
        call = f"kf_solutions({m}, {k}, {count}, a{at}, b{at}, factors{at}, x{at})"
        return [*filled, call, *(f"{name} = x{at}[{n}]" for n, name in enumerate(names))]

    lines, found = stage_lines(steps, given, curves, solve, FUNCTIONS)
    values = iter(found)
    results = ["0.0" if node.constant == 0.0 else next(values) for node in steps.results]
    body = [f"{identifier(name)} = {places[name]};" for name in given if identifier(name) != places[name]]
    body += [line if line.endswith(";") else f"{line};" for line in lines]
    body += [
        f"forces[{k}] = {result}; /* {name} */"
        for k, (name, result) in enumerate(zip(steps.names, results, strict=True))
    ]
    return "\n".join(
        [
            f"/* {stage.capitalize()} of {plan.mechanism.name}: generated from its mechanism, not to be edited. */",
            '#include "instance.h"',
            '#include "sincos.h"',
            "",
            "#include <math.h>",
            "",
            *curve_tables(curves),
            *function(SIGNATURE.format(stage=stage), body, ARGUMENTS, buffers),
        ]
    )
