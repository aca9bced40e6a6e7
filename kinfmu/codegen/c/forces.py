"""The force stage of a native FMU: forces.c, a function of one sample. See kinfmu/codegen/python/forces.py."""

from __future__ import annotations

from kinfmu.codegen.c.model import curve_tables
from kinfmu.codegen.c.text import FUNCTIONS, function
from kinfmu.codegen.forces import ARGUMENTS, places_of_symbols
from kinfmu.codegen.python.stage import given_symbols, stage_curves, stage_lines
from kinfmu.codegen.writer import identifier
from kinfmu.plan import SolvePlan
from kinfmu.plan.forces import ForceSteps

SIGNATURE = (
    "void kf_forces(double time, const double *u, const double *ud, const double *udd, const double *z,\n"
    "               const double *zd, const double *zdd, const double *slopes, const double *efforts,\n"
    "               const double *parameters, double *forces)"
)


def emit_forces(plan: SolvePlan, steps: ForceSteps) -> str:
    """Return the text of forces.c; steps: of coefficients that are given, so that there is nothing to solve."""
    places, given = places_of_symbols(plan), given_symbols(steps)
    curves = {data: f"&{name.lower()}" for data, name in stage_curves(steps).items()}
    lines, found = stage_lines(steps, given, curves, _no_solve, FUNCTIONS)
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
            f"/* Forces of {plan.mechanism.name}: generated from its mechanism, not to be edited. */",
            '#include "instance.h"',
            '#include "sincos.h"',
            "",
            "#include <math.h>",
            "",
            *curve_tables(curves),
            *function(SIGNATURE, body, ARGUMENTS),
        ]
    )


def _no_solve(*_: object) -> list[str]:
    raise AssertionError("a force stage with given coefficients solves nothing")
