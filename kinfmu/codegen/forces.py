"""The force stages of an FMU: where their numbers are, and their source as Python and as C.

Numbers come in lists of the pose, the drivers and the host. In Python a stage is a module of the standard library, next
to the model of a Solver; in C it is a function:

    forces(time, u, ud, udd, z, zd, zdd, slopes, efforts, parameters)

It gives efforts, inertias and energies of one sample, or reactions. z are the unknowns of all blocks, zd and zdd their
derivatives in time; slopes are dz/du for one driver after another.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from kinfmu.codegen.c.model import curve_tables
from kinfmu.codegen.c.text import FUNCTIONS, filled, function
from kinfmu.codegen.python.block_code import defined, matrix, tupled
from kinfmu.codegen.python.stage import OF_NUMBERS, given_symbols, has_roots, stage_curves, stage_lines
from kinfmu.codegen.writer import Names, Writer, identifier
from kinfmu.plan import SolvePlan
from kinfmu.plan.efforts import load_inputs
from kinfmu.plan.forces import ForceSteps
from kinfmu.plan.steps import LinearSolve, derivative_name, law_symbol
from kinfmu.plan.trace import parameter_symbol
from kinfmu.solver.python.curve import CurveData

STAGES = ("forces", "reactions", "shaking")  # each is a part of the FMU's variables and a function of its own
ARGUMENTS = ("time", "u", "ud", "udd", "z", "zd", "zdd", "slopes", "efforts", "parameters")
SIGNATURE = (
    "void kf_{stage}(double time, const double *u, const double *ud, const double *udd, const double *z,\n"
    "         const double *zd, const double *zdd, const double *slopes, const double *efforts,\n"
    "         const double *parameters, double *forces)"
)


def places_of_symbols(plan: SolvePlan, *, are_loads_open: bool = True) -> dict[str, str]:
    """Return, for each symbol that a force stage may read, an expression such as 'zd[2]'.

    z: unknowns of all blocks, with zd and zdd in time; slopes: dz/du, for one driver after another; efforts: of
    external loads, then constants of the laws of loads.

    are_loads_open: Constants of the laws of loads can be set; else they are numbers.
    """
    places = {"time": "time"}
    count = len(plan.unknowns)
    for place, name in enumerate(plan.unknowns):
        places |= {name.derivative(order): f"{z}[{place}]" for order, z in enumerate(("z", "zd", "zdd"))}
        for k in range(len(plan.drivers)):
            places[derivative_name(name, k)] = f"slopes[{k * count + place}]"
    for k, driver in enumerate(plan.drivers):
        places |= {name: f"{u}[{k}]" for name, u in zip(driver.inputs, ("u", "ud", "udd"), strict=True)}
    external = load_inputs(plan)
    places |= {name: f"efforts[{k}]" for k, name in enumerate(external)}
    places |= {
        law_symbol(constant.name): f"efforts[{k}]" if are_loads_open else repr(constant.value)
        for k, constant in enumerate(plan.load_constants, start=len(external))
    }
    return places | {
        parameter_symbol(parameter.name): f"parameters[{k}]" for k, parameter in enumerate(plan.parameters)
    }


def emit_python_forces(plan: SolvePlan, steps: ForceSteps) -> str:
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
            *_python_function(plan, steps, curves),
        ]
    )


def load_forces(plan: SolvePlan, steps: ForceSteps) -> Callable[..., tuple[float, ...]]:
    """Return the function of the source, compiled."""
    curves = stage_curves(steps)
    namespace = OF_NUMBERS | {name: data for data, name in curves.items()}
    exec("\n".join(_python_function(plan, steps, curves)), namespace)  # noqa: S102  our own generated source
    forces: Callable[..., tuple[float, ...]] = namespace["forces"]
    return forces


def _python_function(plan: SolvePlan, steps: ForceSteps, curves: Mapping[CurveData, str]) -> list[str]:
    places, symbols = places_of_symbols(plan), given_symbols(steps)
    lines, expressions = stage_lines(steps, symbols, curves, _solve)
    read = [f"{identifier(name)} = {places[name]}" for name in symbols if identifier(name) != places[name]]
    head, about = f"forces({', '.join(ARGUMENTS)})", "FORCES of one sample, in SI units."
    return defined(head, about, [*read, *lines], tupled(_results(steps, expressions)))


def _results(steps: ForceSteps, expressions: Iterable[str]) -> list[str]:
    """Return all results of a stage as text; those that are always 0 have no expression."""
    values = iter(expressions)
    return ["0.0" if node.constant == 0.0 else next(values) for node in steps.results]


def solves(steps: ForceSteps) -> bool:
    """Return True for a stage with linear systems of three and more unknowns."""
    return any(isinstance(step, LinearSolve) for step in steps.steps)


def _solve(rows: Sequence[Sequence[Any]], columns: Sequence[Sequence[Any]], names: Sequence[str]) -> list[str]:
    return [f"{tupled(names)} = solutions({matrix(rows)}, {matrix(columns)})"]


def emit_jumps(plan: SolvePlan) -> str:
    """Return the source text of `jumps(efforts, parameters)`: pairs of a time and its period, or 0."""
    writer = Writer(Names(), ())
    body = writer.statements([node for jump in plan.jumps for node in jump])
    pairs = [tupled([writer.expression(at), writer.expression(period)]) for at, period in plan.jumps]
    places = places_of_symbols(plan)
    given = [f"{identifier(node.name)} = {places[node.name]}" for node in writer.used if node.op == "symbol"]
    about = "Times [s] at which laws of loads jump, each with its period, or 0."
    return "\n".join(
        [
            f'"""Jumps of the laws of {plan.mechanism.name}: generated from its mechanism, not to be edited."""',
            "",
            "from math import atan2, cos, floor, sin, sqrt",
            "",
            *defined("jumps(efforts, parameters)", about, [*given, *body], tupled(pairs)),
        ]
    )


def emit_c_forces(plan: SolvePlan, steps: ForceSteps, stage: str = "forces", *, are_loads_open: bool = True) -> str:
    """Return the text of a stage; linear systems of three and more unknowns are left to `kf_solutions`.

    steps: Of the stage. are_loads_open: Constants of the laws of loads can be set: they follow the efforts of external
    loads.
    """
    places, symbols = places_of_symbols(plan, are_loads_open=are_loads_open), given_symbols(steps)
    curves = {data: f"&{name.lower()}" for data, name in stage_curves(steps).items()}
    buffers: list[str] = []

    def solve(rows: Sequence[Sequence[Any]], columns: Sequence[Sequence[Any]], names: Sequence[str]) -> list[str]:
        m, k, count, at = len(rows), len(rows[0]), len(columns), len(buffers)
        sizes = {"a": m * k, "b": m * count, "x": k * count, "factors": 3 * m * k + 2 * (m + k)}
        buffers.append(f"double {', '.join(f'{name}{at}[{size}]' for name, size in sizes.items())};")
        lines = filled(f"a{at}", (entry for row in rows for entry in row))
        lines += filled(f"b{at}", (f"-({entry})" for column in columns for entry in column))
        call = f"kf_solutions({m}, {k}, {count}, a{at}, b{at}, factors{at}, x{at})"
        return [*lines, call, *(f"{name} = x{at}[{n}]" for n, name in enumerate(names))]

    lines, expressions = stage_lines(steps, symbols, curves, solve, FUNCTIONS)
    results = _results(steps, expressions)
    body = [f"{identifier(name)} = {places[name]}" for name in symbols if identifier(name) != places[name]]
    body += lines
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
            *function(SIGNATURE.format(stage=stage), body, buffers),
        ]
    )
