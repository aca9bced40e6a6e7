"""Continuation: from the anchor with the parameters of the mechanism to the same pose with other parameters.

    Phi(q, u, p0 + s (p1 - p0)) = 0,   s from 0 to 1

The drivers rest; steps in s are predicted by the last step's slope, corrected by Newton and trusted as on a path
of the drivers. A step turns no parameter by more than a radian: nearly a whole turn leaves almost the same residuals,
and what follows that angle would end one turn off. The rank is not determined again: the watches show whether the
redundant rows still hold.
"""

from __future__ import annotations

from functools import lru_cache
from math import hypot
from typing import Any, NamedTuple

from .linear import factor, lu_solve
from .pose import Model, Pose, Status, Vector, evaluated, failed, position
from .solver import TOLERANCE, Solver
from .trusted_step import FALL, MOST_OFF, TRUST

_SHORTEST = 1e-7  # step in s; where steps get shorter the path ends
_LONGEST_TURN = 1.0  # [rad] of a parameter in one step
_MOST_CONTINUED = 10_000
_MOST_ITERATIONS = 60
NO_NUMBER = "they lead to numbers that are not finite"


class Reached(NamedTuple):
    """A model with its parameters bound, its anchor, and an empty message.

    If the parameters have no solution: the last model and anchor on the path to them, and the reason.
    """

    model: Model
    anchor: Pose
    message: str


class UnsolvableModel(Solver):
    """A solver of a mechanism whose parameters have no solution: every pose fails with the reason."""

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
    """Follow the anchor from the parameters of the mechanism to `values`."""
    written, angles, model, pose = _at_anchor(module)
    u = pose.u
    slope = at_rest = (0.0,) * len(pose.z)
    turn = max([_LONGEST_TURN, *[abs(values[k] - written[k]) for k in angles]])
    longest = _LONGEST_TURN / turn
    s, step, block = 0.0, longest, -1
    for _ in range(_MOST_CONTINUED):
        if values == written:
            break
        there = min(s + step, 1.0)
        p = values if there == 1.0 else tuple([a + there * (b - a) for a, b in zip(written, values, strict=True)])
        try:
            ahead = module.bound(p)
            trial = Pose(u, position(ahead, u, pose.z, slope, at_rest, there - s))
        except (ArithmeticError, ValueError) as error:  # diverged, or a root of something negative
            block = error.args[0] if len(error.args) == 2 else block
        else:
            if _is_trusted(pose, trial) and not (model.LAW_UNITS and _leads_far(model, ahead, pose, trial)):
                if there == 1.0:
                    pose, model = trial, ahead
                    break
                slope = tuple([(b - a) / (there - s) for a, b in zip(pose.z, trial.z, strict=True)])
                s, pose, model, step = there, trial, ahead, min(2.0 * step, longest)
                continue
        step *= 0.5
        if step < _SHORTEST:
            return Reached(model, pose, _failure(module, values, u, pose, block))
    else:
        return Reached(model, pose, f"{_changed(module, values)}: too far from the parameters as written")
    if not pose.watch <= tolerance:
        name, value = max(zip(model.WATCHES, model.watches(pose.values), strict=True), key=lambda row: abs(row[1]))
        gap = f"{abs(value) * model.SIZE:.4g} {model.LENGTH_UNIT}"
        return Reached(model, pose, f"{_changed(module, values)}: redundant row {name} does not close: gap about {gap}")
    return Reached(model, pose, "")


@lru_cache(maxsize=8)
def _at_anchor(module: Any) -> tuple[Vector, tuple[int, ...], Model, Pose]:
    """Return the parameters of the mechanism, which are angles, the model with them and its anchor: always equal."""
    u, z = module.ANCHOR
    written = tuple([value for _, value in module.PARAMETERS])
    angles = tuple([k for k, is_angle in enumerate(module.PARAMETER_IS_ANGLE) if is_angle])
    model = module.bound(written)
    return written, angles, model, Pose(u, evaluated(model, u, z, held=0))


def _is_trusted(pose: Pose, trial: Pose) -> bool:
    """Return whether corrections are small compared with the determinants and no determinant falls steeply."""
    if TRUST * trial.moved > min(trial.margin, pose.margin) or trial.margin == 0.0:
        return False
    pairs = zip(pose.determinants, trial.determinants, strict=True)
    return all(after >= FALL * before if before > 0.0 else after <= FALL * before for before, after in pairs)


def _leads_far(model: Model, ahead: Model, pose: Pose, trial: Pose) -> bool:
    """Return whether what laws give outright moves by so much that what follows from it may be a whole turn off."""
    first = len(model.LAW_TURNS) + model.LAW_LENGTHS
    here, there = model.law_positions(pose.values)[first:], ahead.law_positions(trial.values)[first:]
    return not all(abs(b - a) <= MOST_OFF * c for a, b, c in zip(here, there, model.LAW_UNITS[first:], strict=True))


def _changed(module: Any, values: Vector) -> str:
    """Return 'parameters coupler = 9': those that differ from the mechanism's."""
    pairs = zip(module.PARAMETERS, values, strict=True)
    return "parameters " + ", ".join(f"{name} = {value:.12g}" for (name, old), value in pairs if value != old)


def _failure(module: Any, values: Vector, u: Vector, pose: Pose, block: int) -> str:
    """Return why the path ends: the rows that do not close with these parameters, and their smallest gap."""
    try:
        model = module.bound(values)
    except (ArithmeticError, ValueError) as error:
        why = str(error)  # a length that is not positive; or a division by zero, the root of something negative
        return f"{_changed(module, values)}: {why if ' must be ' in why else NO_NUMBER}"
    if block < 0:
        sizes = [abs(determinant) for determinant in pose.determinants]
        block = sizes.index(min(sizes)) if sizes else -1
    if block < 0:
        return f"{_changed(module, values)}: the mechanism does not close"
    rows = ", ".join(module.ROWS[block])
    try:
        gap = _gap(model, u, pose.z, block)
    except (ArithmeticError, ValueError):  # for example a length of zero, with which another block has no solution
        gap = 0.0
    if gap > 1e-9:
        left = f"{gap * module.SIZE:.4g} {module.LENGTH_UNIT}"
        return f"{_changed(module, values)}: the mechanism does not close: rows {rows} leave a gap of {left}"
    return f"{_changed(module, values)}: beyond a singular point, where rows {rows} are dependent"


def _gap(model: Model, u: Vector, z: Vector, block: int) -> float:
    """Return the smallest length of a block's residuals near z, relative to the size (Levenberg-Marquardt)."""
    first, last = model.BLOCKS[block]
    damping, best, left = 1e-3, list(z), None
    for _ in range(_MOST_ITERATIONS):
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
