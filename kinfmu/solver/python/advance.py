"""Advance: from a good pose to other driver values, along one continuous branch."""

from __future__ import annotations

from .bridge import Bridge
from .limit import MOST_STEPS, NO_BLOCK, TOO_FAR, Limit, is_beyond, limit_beyond
from .pose import ALONE, Model, Pose, Vector, with_map
from .singularity_map import SingularityMap
from .span import REGULAR
from .status import Status
from .survey import surveyed
from .trusted_step import LONGEST_STEP, keeps_branch, straight_path, trusted_step

SHORTEST_STEP = 5e-9  # of the longest; where steps get shorter, a limit is near and its place is extrapolated
NEAR_SINGULAR = 0.0125  # determinant below which qdd keeps less than nine digits
CLOSE = 0.1  # determinant below which branches may lie as close as a correction
GIVE_UP = 5e-15  # of the longest; nothing lies between such steps


def advance(model: Model, start: Pose, target: Vector, singularities: SingularityMap | None = None) -> Pose | Limit:
    """Follow the branch in a straight line of the driver values.

    Each step predicts with velocity and acceleration (the prediction decides the branch), corrects by Newton on the
    residual, and is trusted if the correction is small compared with the determinant and no determinant changes its
    sign. With one driver, singular points on the path are bridged.

    Args:
        model: Generated module, or a track.
        start: A good pose.
        target: Driver values.
        singularities: Singular points known on the path; default: those that the start knows.

    Returns:
        The pose at the target, or the limit of the path before it.

    """
    one = len(target) == 1
    direction, distance = (ALONE, 0.0) if one else straight_path(model, start.u, target)
    longest: float = LONGEST_STEP * model.REACH[0] if one else LONGEST_STEP
    pose = start if singularities is None or singularities is start.singularities else with_map(start, singularities)
    step, iterations = longest, 0
    before, regular, limit = start, start, None
    if abs(target[0] - start.u[0] if one else distance) > MOST_STEPS * longest:
        return Limit(start.u, TOO_FAR)
    for _ in range(MOST_STEPS):
        if one:
            singularities = pose.singularities
            if singularities is not None and not singularities.low <= target[0] <= singularities.high:
                bridge: Bridge = pose.bridge or singularities.next_bridge(pose.u[0], target[0])
                if bridge.covers(target[0]):
                    try:
                        inside = bridge.pose(target)
                    except (ArithmeticError, ValueError):  # a block that is not interpolated ends there
                        return Limit(pose.u, NO_BLOCK)
                    inside.singularities = singularities if pose.bridge is bridge else singularities.around(target[0])
                    return inside
                pose = bridge.exit(target[0])
                pose = with_map(pose, singularities.around(pose.u[0]))
                continue
            distance = target[0] - pose.u[0]
            if distance == 0.0:  # a node, or a step that ended there by rounding
                return _arrived(pose, regular, iterations)
        whole = -step <= distance <= step
        s = distance if whole else step if distance > 0.0 else -step
        u = target if whole else tuple([a + s * d for a, d in zip(pose.u, direction)])  # noqa: B905
        trial = trusted_step(model, pose, direction, s, u)
        if trial is not None:
            iterations += trial.iterations
            if trial.margin < (CLOSE if one else REGULAR) and not keeps_branch(model, pose, trial, direction, s):
                trial = None
        if trial is not None:
            if trial.margin < REGULAR and one:
                singularities = surveyed(model, pose, trial)
                if singularities is not trial.singularities:
                    pose = with_map(pose, singularities)
                    continue
            if whole:
                return _arrived(trial, regular, iterations)
            before, pose = pose, trial
            if pose.margin >= NEAR_SINGULAR:
                regular = pose
            distance -= s
            step = min(2.0 * step, longest)
            continue
        step = 0.5 * abs(s)
        if step < SHORTEST_STEP * longest:
            limit = limit or limit_beyond(model, before, pose, direction)
            if step < GIVE_UP * longest or is_beyond(target, limit.u, direction, s):
                return limit
    return Limit(pose.u, TOO_FAR)


def _arrived(pose: Pose, regular: Pose, iterations: int) -> Pose:
    """Return the pose at the end of a path, with the iterations of the whole path.

    A dead centre has no tangent that the next path could start with: that starts from the last regular pose.
    """
    pose.iterations = iterations
    if pose.margin < NEAR_SINGULAR:
        pose.status = Status.NEAR_SINGULAR
        pose.base = regular
    return pose
