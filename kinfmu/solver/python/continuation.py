"""Continuation: from the anchor of a mechanism as it is written to the same pose with other parameters.

    Phi(q, u, p0 + s (p1 - p0)) = 0,   s from 0 to 1

The drivers stand still; steps in s are predicted by the last step's slope, corrected by Newton and trusted as on a way
of the drivers. Rank is not decided again: the rows set aside as redundant tell whether they still hold.
"""

from __future__ import annotations

from math import hypot
from typing import Any, NamedTuple

from .linear import factor, lu_solve
from .pose import Model, Pose, Vector, evaluated, failed, position
from .solver import TOLERANCE, Solver
from .status import Status
from .trusted_step import FALL, TRUST

_SHORTEST = 1e-7  # step in s; where steps get shorter the way ends
_MOST_STEPS = 10_000
_ITERATIONS = 60
NO_NUMBER = "what follows from them is no finite number"


class Reached(NamedTuple):
    """A model with its parameters bound, its anchor, and why it could not be had (empty if it could).

    If it could not, the last on the way there.
    """

    model: Model
    anchor: Pose
    message: str


class UnsolvableModel(Solver):
    """Stands for a mechanism whose parameters cannot be had: every pose fails, and says why."""

    def __init__(self, model: Model, tolerance: float, anchor: Pose, message: str) -> None:
        super().__init__(model, tolerance, anchor)
        self.message = message

    def solve(self, start: Pose, u: Vector) -> Pose:
        return failed(start, u, Status.INCONSISTENT, self.message)


def with_parameters(module: Any, values: Vector, tolerance: float = TOLERANCE) -> Solver:
    """Return a Solver of a generated module with parameter values.

    Args:
        module: Generated module with PARAMETERS.
        values: One for each of them, in the units of the mechanism.
        tolerance: Residual relative to the size above which a sample is not ok.

    Returns:
        The Solver; an UnsolvableModel with the reason if the parameters have no solution.

    """
    if not module.PARAMETERS:
        return Solver(module, tolerance)
    model, anchor, message = reach(module, values, tolerance)
    if message:
        return UnsolvableModel(model, tolerance, anchor, message)
    return Solver(model, tolerance, anchor)


def reach(module: Any, values: Vector, tolerance: float = TOLERANCE) -> Reached:
    """The anchor followed from the parameters as written to `values`."""
    written = tuple([value for _, value in module.PARAMETERS])
    u, z = module.ANCHOR
    model = module.bound(written)
    pose = Pose(u, evaluated(model, u, z, held=0))
    slope = at_rest = (0.0,) * len(z)
    s, step, block = 0.0, 1.0, -1
    for _ in range(_MOST_STEPS):
        if s == 1.0 or values == written:
            break
        there = min(s + step, 1.0)
        p = values if there == 1.0 else tuple([a + there * (b - a) for a, b in zip(written, values, strict=True)])
        try:
            ahead = module.bound(p)
            trial = Pose(u, position(ahead, u, pose.z, slope, at_rest, there - s))
        except (ArithmeticError, ValueError) as error:  # diverged, or a root of something negative
            block = error.args[0] if len(error.args) == 2 else block
        else:
            if _is_trusted(pose, trial):
                slope = tuple([(b - a) / (there - s) for a, b in zip(pose.z, trial.z, strict=True)])
                s, pose, model, step = there, trial, ahead, 2.0 * step
                continue
        step *= 0.5
        if step < _SHORTEST:
            return Reached(model, pose, _opens(module, values, u, pose, block))
    else:
        return Reached(model, pose, f"{_said(module, values)}: too far from the parameters as written")
    if not pose.watch <= tolerance:
        name, value = max(zip(model.WATCHES, model.watches(pose.values), strict=True), key=lambda row: abs(row[1]))
        gap = f"{abs(value) * model.SIZE:.4g} {model.LENGTH_UNIT}"
        return Reached(model, pose, f"{_said(module, values)}: the redundant row {name} is open by about {gap}")
    return Reached(model, pose, "")


def _is_trusted(pose: Pose, trial: Pose) -> bool:
    """As on a way of the drivers: corrections small against the determinants, none of which falls steeply."""
    if TRUST * trial.moved > min(trial.margin, pose.margin) or trial.margin == 0.0:
        return False
    pairs = zip(pose.determinants, trial.determinants, strict=True)
    return all(after >= FALL * before if before > 0.0 else after <= FALL * before for before, after in pairs)


def _said(module: Any, values: Vector) -> str:
    """'parameters coupler = 9': those that differ from what is written."""
    pairs = zip(module.PARAMETERS, values, strict=True)
    return "parameters " + ", ".join(f"{name} = {value:.12g}" for (name, old), value in pairs if value != old)


def _opens(module: Any, values: Vector, u: Vector, pose: Pose, block: int) -> str:
    """Why the way ends: the rows that do not close with these parameters, and the smallest gap that they leave."""
    try:
        model = module.bound(values)
    except (ArithmeticError, ValueError) as error:
        told = str(error)  # a length that is not positive; or a division by zero, the root of something negative
        return f"{_said(module, values)}: {told if ' must be ' in told else NO_NUMBER}"
    if block < 0:
        sizes = [abs(determinant) for determinant in pose.determinants]
        block = sizes.index(min(sizes)) if sizes else -1
    if block < 0:
        return f"{_said(module, values)}: the mechanism does not close"
    rows = ", ".join(module.ROWS[block])
    try:
        gap = _gap(model, u, pose.z, block)
    except (ArithmeticError, ValueError):  # a length of zero, say, with which another block has no solution at all
        gap = 0.0
    if gap > 1e-9:
        left = f"{gap * module.SIZE:.4g} {module.LENGTH_UNIT}"
        return f"{_said(module, values)}: the mechanism does not close: rows {rows} stay open by {left}"
    return f"{_said(module, values)}: lie behind a singular point, where rows {rows} are dependent"


def _gap(model: Model, u: Vector, z: Vector, block: int) -> float:
    """Smallest length of a block's residuals near z, relative to the size (Levenberg-Marquardt)."""
    first, last = model.BLOCKS[block]
    damping, best, left = 1e-3, list(z), None
    for _ in range(_ITERATIONS):
        if left is None:
            values = evaluated(model, u, tuple(best))[-1]
            left = model.residuals(values)[block]
            scaled = zip(model.jacobians(values)[block], model.ROW_SCALES[block], strict=True)
            jacobian = [[entry / scale for entry in row] for row, scale in scaled]
        n = last - first
        columns = list(zip(*jacobian, strict=True))
        normal = [[sum(a * b for a, b in zip(columns[i], columns[k], strict=True)) for k in range(n)] for i in range(n)]
        right = [-sum(a * r for a, r in zip(column, left, strict=True)) for column in columns]
        for k in range(n):
            normal[k][k] += damping * (normal[k][k] + 1e-12)
        try:
            step = lu_solve(factor(normal), right)
        except ArithmeticError:
            break
        trial = best[:first] + [a + d for a, d in zip(best[first:last], step, strict=True)] + best[last:]
        residual = model.residuals(evaluated(model, u, tuple(trial))[-1])[block]
        if hypot(*residual) < hypot(*left):
            best, left, damping = trial, None, max(0.2 * damping, 1e-12)
        else:
            damping *= 8.0
            if damping > 1e8:
                break
    return hypot(*model.residuals(evaluated(model, u, tuple(best))[-1])[block])
