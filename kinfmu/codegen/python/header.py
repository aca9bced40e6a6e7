"""What every emitted module has: imports and constants, laws of motion, the binding of parameters, `differences`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import accumulate

from kinfmu.codegen.lists import distance_rows
from kinfmu.codegen.newton import ROUND_OFF
from kinfmu.codegen.python.block_code import defined, extreme, indented, tupled, unpacking
from kinfmu.codegen.writer import Names, Writer, identifier
from kinfmu.plan import Block, SolvePlan
from kinfmu.plan.equations.graph import Node, reachable
from kinfmu.plan.path_laws import argument_symbol
from kinfmu.plan.trace import parameter_symbol
from kinfmu.solver.python.curve import CurveData

# The functions of a model, with their arguments and docstrings.
_FUNCTIONS = {
    "position": (
        f"u, z, zd, zdd, s, held=0, enough={ROUND_OFF**2}",
        "Unknowns by Newton from a prediction, block by block; or ArithmeticError(block, residual).",
    ),
    "velocity": ("values, ud, given=(), held=0", "Rates of the unknowns: J zd = -rate of the rows with z at rest."),
    "acceleration": (
        "values, ud, udd, zd, given=(), held=0",
        "Accelerations of the unknowns: J zdd = -second rate of the rows with zdd = 0.",
    ),
    "tangent": ("values", "First and second derivative of the unknowns with respect to the driver."),
    "first_motion": ("values, ud, udd", "Tangent and motion in one go, for the first reading of a pose."),
    "outputs": ("values", "Positions of the outputs."),
    "rates": ("values, ud, first", "Rates of the outputs."),
    "accelerations": ("values, ud, udd, first, second", "Accelerations of the outputs."),
    "motion": ("values, ud, udd, first, second", "Positions, rates and accelerations of the outputs in one row."),
    "law_motion": ("values, ud, udd, first, second", "Motions that steps monitor, with rates and accelerations."),
    "law_positions": ("values", "Positions that steps monitor."),
    "law_steps": ("arguments", "The fewest steps of a path through each law up to its argument."),
    "law_slopes": ("", "Bounds of the slopes of `law_steps`."),
    "law_added": ("", "Bounds of the numbers that each law adds to its argument."),
    "watches": ("values", "Rows set aside as redundant, relative to the size: zero as long as they hold."),
    "jacobians": ("values", "Jacobian of each block."),
    "residuals": ("values", "Residuals of each block, relative to the size."),
    "differences": (
        "there, here",
        "Largest differences of positions, of rates and of accelerations, in radians and sizes; all finite.",
    ),
}
ORDERS = {"outputs": (0,), "rates": (1,), "accelerations": (2,), "motion": (0, 1, 2)}  # of derivatives that these give
_RAISING = {"sin", "cos", "sqrt", "floor", "curve", "/"}  # operations that have no value for some numbers


def stage(name: str, lines: Iterable[str], returned: str) -> list[str]:
    """Return one of the functions of a model."""
    arguments, about = _FUNCTIONS[name]
    return defined(f"{name}({arguments})", about, lines, returned)


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
    angles = tuple(one.quantity.kind == "angle" for one in plan.parameters)
    reach = tuple(1.0 if kind == "angle" else plan.size for kind in kinds)
    return [
        f'"""Kinematics of {plan.mechanism.name}: generated from its mechanism, not to be edited."""',
        "",
        *imports,
        "",
        f"NAME = {plan.mechanism.name!r}",
        f"SIZE = {plan.size!r}",
        f"OFFSET = {plan.offset!r}  # from the world's origin, in sizes",
        f"ROW_OFFSET = {plan.row_offset!r}  # of numbers in rows, in sizes",
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
        *([f"PARAMETER_IS_ANGLE = {angles!r}"] if plan.parameters else []),
        f"WATCHES = {plan.watch_names!r}",
        f"UNKNOWNS = {plan.unknowns!r}",
        f"UNKNOWN_SCALES = {tuple(1.0 if n.is_angle else plan.size for n in plan.unknowns)!r}",
        f"UNKNOWN_IS_ANGLE = {tuple(name.is_angle for name in plan.unknowns)!r}",
        f"BLOCKS = {tuple(places(solved))!r}",
        *([f"BLOCK_DRIVERS = {plan.block_drivers!r}"] if len(plan.drivers) > 1 else []),
        f"ANCHOR = {(anchor_u, anchor_z)!r}",
        f"ROW_SCALES = {scales!r}",
        f"TALL = {tuple(k for k, b in enumerate(solved) if len(b.residuals) > len(b.unknowns))!r}",
        *([f"ROWS = {rows!r}"] if plan.parameters else []),
        f"DISTANCES = {distances!r}  # drivers of distances; block, row and scale of each",
        f"LAW_UNITS = {plan.path_laws.units!r}  # of motions that steps monitor, first arguments of laws, then lengths",
        f"LAW_TURNS = {plan.path_laws.turns!r}  # of the arguments: 0 if they do not jump back",
        f"LAW_LENGTHS = {plan.path_laws.lengths!r}",
        *(f"{name} = {data!r}" for data, name in curves.items()),
        "",
    ]


def law_steps(plan: SolvePlan, names: Names, prolog: Sequence[Node]) -> list[str]:
    """Return the functions of the fewest steps through laws, of bounds of their slopes and of what laws add."""
    laws = plan.path_laws
    arguments = unpacking([identifier(argument_symbol(k)) for k in range(len(laws.steps))], "arguments")
    body, steps = Writer(names, (), prolog).formulas(laws.steps)
    bounds, slopes = Writer(names, (), prolog).formulas(laws.slopes)
    sums, added = Writer(names, (), prolog).formulas(laws.added)
    return [
        *stage("law_steps", [*arguments, *body], tupled(steps)),
        *stage("law_slopes", bounds, tupled(slopes)),
        *stage("law_added", sums, tupled(added)),
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
        *indented([*unpacking(constants, "constants"), *lines]),
        "",
    ]


def _may_raise(plan: SolvePlan) -> bool:
    """Return True if an operation of the laws has no value for some numbers, such as the sine of infinity."""
    laws = (node for law in plan.laws for node in (law.position, law.rate, law.acceleration))
    return any(node.op in _RAISING for node in reachable(laws))


_HOLDS = {
    "positive": "({}) > 0.0",
    "0 or more": "({}) >= 0.0",
    "other than 0": "({}) != 0.0",
    "0": "abs({}) <= 1e-9",
}


def bound(plan: SolvePlan, names: Names, prolog: Sequence[Node], functions: Sequence[str]) -> list[str]:
    """Return the functions inside one that binds the parameters and computes once what depends on these alone."""
    values = [identifier(parameter_symbol(parameter.name)) for parameter in plan.parameters]
    writer = Writer(names, (), prolog)
    known = writer.statements([*prolog, *(condition.node for condition in plan.conditions)])
    for name, node, required in plan.conditions:
        number = writer.expression(node)
        known += [
            f"if not {_HOLDS[required].format(number)}:",
            f"    raise ValueError({name + ' = %.15g must be ' + required!r} % ({number},))",
        ]
    fixed = ", ".join(f"{name!r}: {writer.expression(node)}" for name, node in plan.fixed_nodes.items())
    defined = [line.split("(")[0].removeprefix("def ") for line in functions if line.startswith("def ")]
    return [
        "",
        "def bound(parameters):",
        '    """The model for these values of PARAMETERS."""',
        *indented([*unpacking(values, "parameters"), *known]),
        f"    FIXED = {{{fixed}}}",
        *(f"    {line}" if line else "" for text in functions for line in text.split("\n")),
        f"    bound = {{'FIXED': FIXED, {', '.join(f'{name!r}: {name}' for name in defined)}}}",
        "    return SimpleNamespace(**constants | bound)",
        "",
        "",
        "constants = {name: value for name, value in globals().items() if name.isupper()}",
        "",
    ]


MANY = 100  # outputs; beyond that, loops are shorter


def angle_places(plan: SolvePlan) -> tuple[int, ...]:
    """Return the places of the angles among the outputs."""
    return tuple(k for k, name in enumerate(plan.outputs) if name.is_angle)


def differences(plan: SolvePlan) -> list[str]:
    """Return the lines of the function `differences`."""
    n = len(plan.outputs)
    angles = angle_places(plan)
    lengths = [k for k in range(n) if k not in set(angles)]
    if n > MANY:
        lines = [
            "gaps = [abs(a - b) for a, b in zip(there, here)]",
            f"rows = [gaps[k : k + {n}] for k in range(0, {3 * n}, {n})]",
            "of_angles = [max([row[k] for k in ANGLES], default=0.0) for row in rows]",
            f"lengths = {tupled(map(str, lengths))}",
            "of_lengths = [max([row[k] for k in lengths], default=0.0) / SIZE for row in rows]",
        ]
        return stage("differences", lines, "tuple(map(max, of_angles, of_lengths))")
    largest = [_largest([k + order * n for k in angles], [k + order * n for k in lengths]) for order in range(3)]
    lines = unpacking([f"a{k}" for k in range(3 * n)], "there") + unpacking([f"b{k}" for k in range(3 * n)], "here")
    return stage("differences", lines, tupled(largest))


def _largest(angles: Sequence[int], lengths: Sequence[int]) -> str:
    """Return the expression of the largest difference; a length counts relative to the size."""
    terms = [f"abs(a{k} - b{k})" for k in angles]
    if lengths:
        terms.append(f"{extreme('max', [f'abs(a{k} - b{k})' for k in lengths])} / SIZE")
    return extreme("max", terms)
