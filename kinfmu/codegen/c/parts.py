"""The parts of a model in C: the units of each kind, names, curves and the stage cache."""

from __future__ import annotations

from kinfmu.codegen.c.stage_cache import StageCache
from kinfmu.codegen.c.text import FUNCTIONS
from kinfmu.codegen.c.units import Units
from kinfmu.codegen.lists import Lists
from kinfmu.codegen.writer import Names
from kinfmu.plan import SolvePlan
from kinfmu.solver.python.curve import CurveData


class Parts(Lists):
    """The parts of a plan's model in C, from which its functions are written.

    curves: names of the constants that hold the data of curves; solved: the blocks that need Newton; units: by the
    label of their kind.
    """

    def __init__(self, plan: SolvePlan) -> None:
        super().__init__(plan)
        data = dict.fromkeys(node.curve[0] for node in plan.nodes if node.op == "curve")
        self.curves: dict[CurveData, str] = {one: f"&curve_{k}" for k, one in enumerate(data, start=1)}
        self.names = Names((name for block in plan.blocks for name in block.coordinates), self.curves, FUNCTIONS)
        self.solved = [block for block in plan.blocks if block.unknowns]
        self.units = {k: Units(kind, self.curves, self.parameters, self.derived) for k, kind in self.kinds.items()}
        self.stage_cache = StageCache(self, self.units)
