"""Parameters bound once: nodes that depend on them alone are computed before the functions of the module."""

from __future__ import annotations

from collections.abc import Sequence

from kinfmu.codegen.python.block_code import indented, unpacking
from kinfmu.codegen.writer import Names, Writer, identifier
from kinfmu.equations.graph import Node
from kinfmu.plan import SolvePlan
from kinfmu.plan.trace import parameter_symbol

_HOLDS = {"positive": "({}) > 0.0", "other than 0": "({}) != 0.0", "0": "abs({}) <= 1e-9"}


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
        *unpacking(values, "parameters"),
        *indented(known),
        f"    FIXED = {{{fixed}}}",
        *(f"    {line}" if line else "" for text in functions for line in text.split("\n")),
        "    constants = {name: value for name, value in globals().items() if name.isupper()}",
        f"    functions = {{{', '.join(f'{name!r}: {name}' for name in defined)}}}",
        "    return SimpleNamespace(**constants | functions | {'FIXED': FIXED})",
        "",
    ]
