"""Parameters bound once: what depends on them alone is computed before the functions of the module."""

from __future__ import annotations

from collections.abc import Sequence

from kinfmu.backends.python.block_code import indented, unpacking
from kinfmu.backends.python.writer import Names, Writer, identifier
from kinfmu.equations.graph import Node
from kinfmu.plan import SolvePlan
from kinfmu.plan.trace import is_parameter, parameter_symbol


def parametric(plan: SolvePlan) -> tuple[set[Node], list[Node]]:
    """Operations that depend on parameters alone, and those of them that others are made of, or outputs."""
    depends: dict[Node, bool] = {}  # on parameters alone
    for node in plan.nodes:
        if node.op == "symbol":
            depends[node] = is_parameter(node)
        elif node.op != "constant":
            on = [arg for arg in node.args if arg.op != "constant"]
            depends[node] = bool(on) and all(depends[arg] for arg in on)
    alone = {node for node, is_alone in depends.items() if is_alone and node.args}
    used = [arg for node in plan.nodes if node not in alone for arg in node.args]
    used += [*plan.fixed_nodes.values(), *(motion.position for motion in plan.outputs_motion)]
    return alone, list(dict.fromkeys(node for node in used if node in alone))


_HOLDS = {"positive": "({}) > 0.0", "other than 0": "({}) != 0.0", "0": "abs({}) <= 1e-9"}


def bound(plan: SolvePlan, names: Names, prolog: Sequence[Node], functions: Sequence[str]) -> list[str]:
    """The functions inside one that binds the parameters: what depends on nothing else is computed there, once."""
    values = [identifier(parameter_symbol(parameter.name)) for parameter in plan.parameters]
    writer = Writer(names, (), prolog)
    known = writer.statements([*prolog, *(condition.node for condition in plan.conditions)])
    for name, node, meant in plan.conditions:
        number = writer.expression(node)
        known += [
            f"if not {_HOLDS[meant].format(number)}:",
            f"    raise ValueError({name + ' = %r must be ' + meant!r} % ({number},))",
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
