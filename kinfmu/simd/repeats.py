"""Whether a plan's motion repeats itself turn by turn: then a sweep needs one turn's samples only once."""

from __future__ import annotations

from kinfmu.equations.graph import Node
from kinfmu.plan import SolvePlan


def repeats(plan: SolvePlan) -> bool:
    """True if a whole turn of any angle changes nothing: all stand in sines and cosines, but where one is another.

    A gear or a coupling of angles tells how often they have turned: such a plan is not taken to repeat.
    """
    angles = {name for block in plan.blocks for name in block.coordinates if name.endswith(".phi")}
    angles |= {driver.inputs[0] for driver in plan.drivers if driver.quantity.kind == "angle"}

    def is_turned(node: Node) -> bool:
        """An angle, and no more than constants added to it."""
        while node.op in ("+", "-") and node.args[1].constant is not None:
            node = node.args[0]
        while node.op == "+" and node.args[0].constant is not None:
            node = node.args[1]
        return node.op == "symbol" and node.name in angles

    rows = [node for block in plan.blocks for node in block.residuals]
    rows += [m[0] for block in plan.blocks for name, m in block.assigned if not (name in angles and is_turned(m[0]))]
    found: set[Node] = set()
    stack = list(rows)
    while stack:
        node = stack.pop()
        if node in found or (node.op in ("sin", "cos") and is_turned(node.args[0])):
            continue
        if node.op == "symbol" and node.name in angles:
            return False
        found.add(node)
        stack += node.args
    return True
