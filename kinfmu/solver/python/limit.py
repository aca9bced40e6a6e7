"""Limits: driver values where a path ends, and why."""

from __future__ import annotations

from typing import NamedTuple

from .message import LOCATED, ROUGHLY, differs, place
from .pose import STEEP, Model, Pose, Vector, directed

MOST_STEPS = 1_000_000  # of a path: seconds, and more than any intended motion
NO_BLOCK, TOO_FAR, NEGATIVE = -1, -2, -3  # in place of a block: no determinant vanishes; too many steps; see VANISHING
VANISHING = 1e-6  # [sizes] of a length that a law gives: where steps end there, it would be negative beyond


class Limit(NamedTuple):
    """Driver values where a path ends, and the block whose determinant vanishes there (or NO_BLOCK, TOO_FAR, NEGATIVE).

    crosses: another branch crosses there and no bridge holds, so that the motion does not turn back.
    """

    u: Vector
    block: int
    crosses: bool = False


def limit_beyond(model: Model, before: Pose, pose: Pose, direction: Vector) -> Limit:
    """Return where the path ends, just beyond a pose that steps cannot leave.

    Near a dead centre the tangent grows without bound, and determinant^2 falls linearly along the path: the secant rule
    on the last two poses gives its zero. Where branches cross the determinant itself falls linearly.
    """
    for k in range(len(model.LAW_TURNS), len(model.LAW_TURNS) + model.LAW_LENGTHS):
        near, far = (model.law_positions(at.values)[k] for at in (pose, before))
        if near < VANISHING * model.SIZE:
            return Limit(_extrapolated(before, pose, near, far), NEGATIVE)
    if not pose.determinants:
        return Limit(pose.u, NO_BLOCK)
    block = min(range(len(pose.determinants)), key=lambda k: abs(pose.determinants[k]))
    unit = model.REACH[0] if len(direction) == 1 else 1.0
    slopes = directed(model, pose, direction)[0]
    crosses = max([abs(slopes[k]) / model.UNKNOWN_SCALES[k] for k in range(*model.BLOCKS[block])]) * unit < STEEP
    near, far = abs(pose.determinants[block]), abs(before.determinants[block])
    if not crosses:
        near, far = near * near, far * far
    return Limit(_extrapolated(before, pose, near, far), block, crosses)


def _extrapolated(before: Pose, pose: Pose, near: float, far: float) -> Vector:
    """Return the driver values where a number vanishes that is `far` at one pose and `near` at the next."""
    if far <= near:
        return pose.u
    beyond = near / (far - near)
    return tuple(b + (b - a) * beyond for a, b in zip(before.u, pose.u, strict=True))


def is_beyond(target: Vector, limit: Vector, direction: Vector, s: float) -> bool:
    """Return whether the target lies past the limit in the direction of `s`."""
    return sum((a - b) * d * s for a, b, d in zip(target, limit, direction, strict=True)) > 0.0


def limit_message(model: Model, limit: Limit, target: Vector) -> str:
    """Return why a target cannot be reached, in one line."""
    if limit.block == TOO_FAR:
        return (
            f"{place(model, target)} is too far from {place(model, limit.u)}: more than {MOST_STEPS} steps on one path"
        )
    names = ", ".join(model.UNKNOWNS[slice(*model.BLOCKS[limit.block])]) if limit.block >= 0 else "the joints"
    loop = f"the loop of {names}" if limit.block >= 0 else names
    why = f", where branches of {names} cross" if limit.crosses else f"; beyond it {loop} cannot close"
    if limit.block == NEGATIVE:
        why = "; beyond it a distance would be negative"
    if limit.crosses and len(target) > 1:
        why += "; the crossing depends on several drivers, so no bridge is built"
    if not differs(model, target, limit.u, LOCATED):
        return f"{place(model, target, LOCATED)} cannot be reached: to these digits it is the limit{why}"
    asked = place(model, target, ROUGHLY if differs(model, target, limit.u, ROUGHLY) else LOCATED)
    return f"{asked} cannot be reached: the limit is {place(model, limit.u, LOCATED)}{why}"
