"""The head of every emitted module: imports, constants that the solver and the FMU read, the laws of motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import accumulate

from kinfmu.codegen.distances import distance_rows
from kinfmu.codegen.python.block_code import indented, tupled, unpacking
from kinfmu.codegen.python.differences import angle_places
from kinfmu.codegen.writer import Names, Writer, identifier
from kinfmu.plan import Block, SolvePlan
from kinfmu.solver.python.curve import CurveData

_RAISING = {"sin", "cos", "sqrt", "floor", "curve", "/"}  # operations that have no value for some numbers


def header(plan: SolvePlan, curves: Mapping[CurveData, str], extra: Sequence[str] = ()) -> list[str]:
    """Return docstring, imports and constants of the module.

    curves: names of the constants that hold the data of curves; extra: more imports of the standard library.
    """
    solved = [block for block in plan.blocks if block.unknowns]
    anchor_u, anchor_z = plan.anchor_values
    large = [block for block in solved if len(block.unknowns) > 2 or len(block.residuals) > len(block.unknowns)]
    rare = {node.op for node in plan.nodes} & {"atan2", "floor"}
    if _may_raise(plan):
        rare.add("nan")
    imports = [f"from math import {', '.join(sorted({'cos', 'inf', 'sin', 'sqrt', *rare}))}"]
    imports += extra
    if plan.parameters:
        imports.append("from types import SimpleNamespace")
    if curves:
        imports += ["", "from .curve import curve"]
    if large:
        imports += ["", "from .linear import column_part, factor, lu_solve, qr_factor, qr_solve, row_part"]
    kinds = tuple(driver.quantity.kind for driver in plan.drivers)
    rows, scales = tuple(b.row_names for b in solved), tuple(b.row_scales for b in solved)
    distances = tuple(map(tuple, distance_rows(plan, solved)))
    reach = tuple(1.0 if kind == "angle" else plan.size for kind in kinds)
    return [
        f'"""Kinematics of {plan.mechanism.name}: generated from its mechanism, not to be edited."""',
        "",
        *imports,
        "",
        f"NAME = {plan.mechanism.name!r}",
        f"SIZE = {plan.size!r}",
        f"OFFSET = {max(map(abs, plan.origin)) / plan.size!r}  # from the world's origin, in sizes",
        f"LENGTH_UNIT = {plan.mechanism.length_unit!r}",
        f"DRIVERS = {tuple(driver.name for driver in plan.drivers)!r}",
        f"DRIVER_KINDS = {kinds!r}",
        f"REACH = {reach!r}  # what counts as a step of one, by driver",
        f"OUTPUTS = {plan.outputs!r}",
        f"ANGLES = {angle_places(plan)!r}  # their places among the outputs",
        f"COORDINATE_COUNT = {plan.coordinate_count!r}",
        f"FIXED = {dict(plan.fixed)!r}",
        f"LAW_CONSTANTS = {tuple((constant.name, constant.value) for constant in plan.law_constants)!r}",
        f"POSITIVE = {tuple(k for k, constant in enumerate(plan.law_constants) if constant.is_positive)!r}",
        f"PARAMETERS = {tuple((parameter.name, parameter.value) for parameter in plan.parameters)!r}",
        f"WATCHES = {plan.watch_names!r}",
        f"UNKNOWNS = {plan.unknowns!r}",
        f"UNKNOWN_SCALES = {tuple(1.0 if n.endswith('.phi') else plan.size for n in plan.unknowns)!r}",
        f"BLOCKS = {tuple(places(solved))!r}",
        *([f"BLOCK_DRIVERS = {plan.block_drivers!r}"] if len(plan.drivers) > 1 else []),
        f"ANCHOR = {(anchor_u, anchor_z)!r}",
        f"ROW_SCALES = {scales!r}",
        f"TALL = {tuple(k for k, b in enumerate(solved) if len(b.residuals) > len(b.unknowns))!r}",
        *([f"ROWS = {rows!r}"] if plan.parameters else []),
        f"DISTANCES = {distances!r}  # drivers of distances; block, row and scale of each",
        *(f"{name} = {data!r}" for data, name in curves.items()),
        "",
    ]


def places(solved: Sequence[Block]) -> list[tuple[int, int]]:
    """Return first and last + 1 of each solved block's unknowns among all of them."""
    ends = list(accumulate(len(block.unknowns) for block in solved))
    return list(zip([0, *ends], ends, strict=False))


def curve_names(plan: SolvePlan) -> dict[CurveData, str]:
    """Return the names of the constants that hold the data of the plan's curves."""
    data = dict.fromkeys(node.curve[0] for node in plan.nodes if node.op == "curve")
    return {one: f"CURVE_{k}" for k, one in enumerate(data, start=1)}


def drive(plan: SolvePlan, curves: Mapping[CurveData, str]) -> list[str]:
    """Return the function of the laws of motion."""
    writer = Writer(Names(curves=curves), ())
    orders = [[getattr(law, order) for law in plan.laws] for order in ("position", "rate", "acceleration")]
    flat = [node for nodes in orders for node in nodes]
    body = writer.statements(flat)
    constants = [identifier(constant.name) for constant in plan.law_constants]
    returned = ", ".join(tupled(writer.expression(node) for node in nodes) for nodes in orders)
    lines = [*body, f"return {returned}"]
    if _may_raise(plan):
        nothing = tupled(["nan"] * len(plan.laws))
        caught = "except (OverflowError, ValueError, ZeroDivisionError):  # a time for which a law has no value"
        lines = ["try:", *indented(lines), caught, f"    return {tupled([nothing] * 3)}"]
    return [
        "",
        "def drive(time, constants):",
        '    """Driver values, speeds and accelerations at a time, by the laws."""',
        *unpacking(constants, "constants"),
        *indented(lines),
        "",
    ]


def _may_raise(plan: SolvePlan) -> bool:
    """Return True if an operation of the laws has no value for some numbers, such as the sine of infinity."""
    found: set[int] = set()
    stack = [node for law in plan.laws for node in (law.position, law.rate, law.acceleration)]
    while stack:
        node = stack.pop()
        if node.id not in found:
            found.add(node.id)
            stack.extend(node.args)
            if node.op in _RAISING:
                return True
    return False
