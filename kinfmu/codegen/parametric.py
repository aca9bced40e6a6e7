"""What a plan computes of its parameters alone: once, when they are bound."""

from __future__ import annotations

from kinfmu.equations.graph import Node
from kinfmu.plan import SolvePlan
from kinfmu.plan.trace import is_parameter


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
