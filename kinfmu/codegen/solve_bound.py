"""The most that a pose solve of C takes: corrections by Newton, operations and calls of functions, from the plan."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from kinfmu.codegen.newton import ITERATIONS, is_small
from kinfmu.plan import Block, SolvePlan
from kinfmu.plan.equations.graph import Node, reachable

RUNS = 2  # of Newton: from the prediction, and near a singular pose until the residual no longer falls
NODES = 12  # of a polynomial across a singular point: four, each three times


class SolveBound(NamedTuple):
    """Bounds of a pose solve: one prediction, corrected and judged, and the derivatives of the pose.

    Attributes:
        corrections: Corrections by Newton, of all blocks.
        operations: Floating-point operations: + - * / and square roots.
        functions: Calls of sin, cos, atan2, floor and of curves.

    """

    corrections: int
    operations: int
    functions: int


class _Count:
    """Operations and calls of functions, counted over groups of formulas; each group may compute its terms anew."""

    def __init__(self) -> None:
        self.operations = self.functions = 0

    def formulas(self, targets: Iterable[Node], times: int = 1) -> None:
        for node in reachable(targets):
            if node.op in ("+", "-", "*", "/", "neg", "sqrt"):
                self.operations += times
            elif node.args:
                self.functions += times

    def each(self, targets: Iterable[Node], times: int = 1) -> None:
        for target in targets:
            self.formulas([target], times)


def solve_bound(plan: SolvePlan) -> SolveBound:
    """Return the bounds of a pose solve of a plan's mechanism."""
    count, corrections = _Count(), 0
    for block in plan.blocks:
        passes = RUNS * ITERATIONS if block.unknowns else RUNS
        count.each([motion[0] for _, motion in block.assigned], passes)
        for order in (1, 2):
            count.each([motion[order] for _, motion in block.assigned])
        if block.unknowns:
            corrections += passes
            count.formulas([*block.residuals, *block.entries], passes)
            count.formulas(block.residuals, RUNS)  # of blocks that depend on several drivers, once more
            count.formulas([*block.velocity, *block.entries])
            count.formulas([*block.acceleration, *block.entries])
            count.operations += _linear(block, passes) + _judged(block)
    watches = [node for _, node in plan.watches]
    count.formulas(watches)
    count.operations += 3 * len(watches)
    for nodes in plan.path_laws.nodes:
        count.formulas(nodes, 2)
    count.operations += 30 * len(plan.path_laws.units) + _across(plan.unknowns)
    return SolveBound(corrections, count.operations, count.functions)


def _linear(block: Block, passes: int) -> int:
    """Return the operations of linear algebra: in each pass residual, factors and correction; two more solves."""
    m, k = len(block.residuals), len(block.unknowns)
    residual = 3 * m + 4 * k + 4
    if is_small(block):
        factors, solve = 3, 4 * k + 1
    elif m == k:
        factors, solve = k**3 + 8 * k**2 + 8 * k, 2 * k**2 + 4 * k
    else:
        factors, solve = 4 * m * k**2 + 12 * m * k + 10 * k, 6 * m * k + k**2 + 6 * k
    return passes * (residual + factors + solve + k) + 2 * (solve + m)


def _judged(block: Block) -> int:
    """Return the operations by which a step is trusted: determinants, tangents, and orientations of tall blocks."""
    m, k = len(block.residuals), len(block.unknowns)
    oriented = 2 * m * k**2 + k**3 + 8 * k**2 if m > k else 0
    return 12 + 30 * k + oriented


def _across(unknowns: Sequence[object]) -> int:
    """Return the operations of a polynomial across a singular point for each unknown: coefficients and value."""
    return len(unknowns) * (3 * NODES * (NODES - 1) // 2 + 7 * NODES + 20) + 40
