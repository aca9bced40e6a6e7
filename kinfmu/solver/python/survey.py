"""Survey: find the singular points near a pose and bridge them."""

from __future__ import annotations

from .bridge import moved
from .build import HALF_WIDTH, build, secant_zero
from .pose import Model, Pose
from .singularity_map import Interval, SingularityMap
from .span import REGULAR
from .trusted_step import follow_path

NEXT_TO = 1e-3  # [rad, sizes] up to which the secant through two poses is too rough to find a zero by
FAR_OFF = 4.0  # times as far as zeros are bridged: one that the rough secant has beyond is not searched for


def surveyed(model: Model, pose: Pose, trial: Pose) -> SingularityMap | None:
    """Return the singularity map with what a trial pose shows: the map itself if that is nothing new.

    New is a bridge, where the trial comes near a singular point, or a searched interval, where no bridge holds.
    """
    singularities: SingularityMap | None = trial.singularities
    here, known = trial.u[0], singularities or SingularityMap()
    low = [k for k, d in enumerate(trial.determinants) if -REGULAR < d < REGULAR and not known.knows(here, k)]
    if not low:
        return singularities
    if model.DRIVER_KINDS[0] == "angle":
        for old in known.bridges:
            again = moved(model, old, pose, here)
            if again is not None:
                return known.with_bridge(again, pose.u[0])
    reach: float = model.REACH[0]
    before: Pose | None = pose
    if abs(here - pose.u[0]) <= NEXT_TO * reach:
        rough = [secant_zero(pose, trial, block) for block in low]
        if all(zero is not None and abs(zero - here) > FAR_OFF * HALF_WIDTH * reach for zero in rough):
            return singularities
        before = _nearby(model, trial, low[0], 0.02 * reach)
    if before is None:
        return singularities
    for block in low:  # upstream first
        zero = secant_zero(before, trial, block)
        if zero is None or abs(zero - here) > 1.05 * HALF_WIDTH * reach or known.knows(zero, block):
            continue
        bridge = build(model, before, block, zero)
        if bridge is None:
            width = 2.0 * HALF_WIDTH * reach
            interval = Interval(zero - width, zero + width, block)
        elif known.knows(bridge.centre, block):
            interval = Interval(min(here, bridge.centre), max(here, bridge.centre), block)
        else:
            return known.with_bridge(bridge, pose.u[0])
        singularities = known = known.with_interval(interval, len(trial.determinants))
    return singularities


def _nearby(model: Model, pose: Pose, block: int, distance: float) -> Pose | None:
    """Return a pose at a distance from another, on the side where a block's determinant grows, if any."""
    for offset in (distance, -distance):
        other = follow_path(model, pose, pose.u[0] + offset)
        if other is not None and abs(other.determinants[block]) > abs(pose.determinants[block]):
            return other
    return None
