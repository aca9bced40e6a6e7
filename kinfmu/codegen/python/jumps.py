"""The times at which laws of loads jump as Python source: a module of an FMU, next to the model of a Solver."""

from __future__ import annotations

from kinfmu.codegen.forces import places_of_symbols
from kinfmu.codegen.python.block_code import indented, tupled
from kinfmu.codegen.writer import Names, Writer, identifier
from kinfmu.plan import SolvePlan


def emit_jumps(plan: SolvePlan) -> str:
    """Return the source text of `jumps(efforts, parameters)`: pairs of a time and its period, or 0."""
    writer = Writer(Names(), ())
    body = writer.statements([node for jump in plan.jumps for node in jump])
    pairs = [tupled([writer.expression(at), writer.expression(period)]) for at, period in plan.jumps]
    places = places_of_symbols(plan)
    given = [f"{identifier(node.name)} = {places[node.name]}" for node in writer.used if node.op == "symbol"]
    return "\n".join(
        [
            f'"""Jumps of the laws of {plan.mechanism.name}: generated from its mechanism, not to be edited."""',
            "",
            "from math import atan2, cos, floor, sin, sqrt",
            "",
            "",
            "def jumps(efforts, parameters):",
            '    """Times [s] at which laws of loads jump, each with its period, or 0."""',
            *indented([*given, *body]),
            f"    return {tupled(pairs)}",
            "",
        ]
    )
