"""Advance: from a good pose to other driver values, along one continuous branch."""

from __future__ import annotations

from collections.abc import Callable

from .bridge import Bridge
from .limit import MOST_STEPS, NO_BLOCK, TOO_FAR, Limit, is_beyond, limit_beyond, pole_before
from .pose import UNIT_SPEED, Model, Pose, Status, Vector, with_map
from .singularity_map import SingularityMap, surveyed
from .span import REGULAR
from .trusted_step import LONGEST_STEP, keeps_branch, straight_path, trusted_step

SHORTEST_STEP = 5e-9  # of the longest; where shorter ones are needed, a limit is near and is extrapolated
NEAR = 0.0125  # determinant below which qdd keeps less than nine digits
CLOSE = 0.1  # determinant below which another branch may be as near as a correction is long
STRIDE = 0.02  # of the longest; where steps become as short, an unknown may run to infinity
GIVE_UP = 5e-15  # of the longest; shorter steps are lost in rounding


class Path:
    """A straight path of the driver values, as far as it has been followed in trusted steps.

    pose: the last trusted one, before: the one before it, regular: the last one away from singular points; distance:
    what is left to the target; length: of the next step; most_steps: 0 where the target is too far; iterations: of
    Newton, of all steps; trial: the pose after the next step, if known; end: the pose at the target or the limit before
    it, None while the path goes on.
    """

    __slots__ = (
        "before",
        "direction",
        "distance",
        "end",
        "iterations",
        "length",
        "limit",
        "longest",
        "margin",
        "most_steps",
        "pose",
        "regular",
        "shortest",
        "target",
        "trial",
    )

    def __init__(self, model: Model, start: Pose, target: Vector) -> None:
        self.target = target
        self.pose = self.before = self.regular = start
        self.margin = start.margin
        if len(target) == 1:
            self.direction, self.distance = UNIT_SPEED, target[0] - start.u[0]
            self.longest: float = LONGEST_STEP * model.REACH[0]
        else:
            self.direction, self.distance = straight_path(model, start.u, target)
            self.longest = LONGEST_STEP
        self.length = self.longest
        self.shortest = (GIVE_UP if model.LAW_TURNS else SHORTEST_STEP) * self.longest  # rises are short, too
        self.most_steps = 0 if abs(self.distance) > MOST_STEPS * self.longest else MOST_STEPS
        self.iterations = 0
        self.trial: Pose | None = None
        self.limit: Limit | None = None
        self.end: Pose | Limit | None = None

    def ahead(self) -> tuple[float, Vector]:
        """Return the next step and the driver values at its end, which are the target's to the bit in the last one."""
        if -self.length <= self.distance <= self.length:
            return self.distance, self.target
        s = self.length if self.distance > 0.0 else -self.length
        if len(self.target) == 1:
            return s, (self.pose.u[0] + s,)
        return s, tuple([a + s * d for a, d in zip(self.pose.u, self.direction)])  # noqa: B905  one item per driver

    def accept(self, trial: Pose, s: float, margin: float) -> None:
        """Go on from a trusted pose with longer steps, or end there if it is at the target."""
        self.margin = margin
        if s == self.distance:
            self.end = trial
            return
        self.before, self.pose = self.pose, trial
        if margin >= NEAR:
            self.regular = trial
        self.distance -= s
        self.length = min(2.0 * self.length, self.longest)

    def shorten(self, s: float, limit_here: Callable[[], Limit]) -> None:
        """Go on with shorter steps; end at the limit if no step is left or if the target lies beyond it."""
        self.length = 0.5 * abs(s)
        is_lost = self.ahead()[1] == self.pose.u  # in the rounding of the driver values
        if self.length < self.shortest or is_lost:
            self.limit = self.limit or limit_here()
            is_last = is_lost or self.length < GIVE_UP * self.longest
            if is_last or is_beyond(self.target, self.limit.u, self.direction, s):
                self.end = self.limit

    def terminate(self) -> Pose | Limit:
        """Return the pose at the target, with the iterations of the whole path, or the limit before it.

        A dead centre has no tangent, so a path that goes on from there starts at the last regular pose.
        """
        end = Limit(self.pose.u, TOO_FAR) if self.end is None else self.end
        if isinstance(end, Pose) and end.bridge is None:
            end.iterations = self.iterations
            if self.margin < NEAR:
                end.status = Status.NEAR_SINGULAR
                end.base = self.regular
        return end


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
    path = Path(model, start, target)
    if singularities is not None and singularities is not start.singularities:
        path.pose = with_map(start, singularities)
    if len(target) == 1:
        _follow_regular(model, path)
    for _ in range(path.most_steps):
        if path.end is not None:
            break
        _step(model, path)
    return path.terminate()


def _follow_regular(model: Model, path: Path) -> None:
    """Go the first steps along the path of a single driver, each the longest and to a regular pose, as `_step` does.

    They end before a bridge, before a step that is not trusted, and before a pose that is not regular.
    """
    target, longest, pose = path.target, path.longest, path.pose
    here = target[0]
    for _ in range(path.most_steps):
        singularities = pose.singularities
        if singularities is not None and not singularities.low <= here <= singularities.high:
            break
        distance = here - pose.u[0]
        is_last = -longest <= distance <= longest
        s = distance if is_last else longest if distance > 0.0 else -longest
        trial = trusted_step(model, pose, UNIT_SPEED, s, target if is_last else (pose.u[0] + s,)) if s else None
        if trial is None or trial.margin < REGULAR:
            path.trial = trial
            break
        path.iterations += trial.iterations
        path.margin = trial.margin
        if is_last:
            path.end = trial
            break
        path.before, pose = pose, trial
        path.pose = path.regular = trial
        path.distance = distance - s
        path.most_steps -= 1


def _step(model: Model, path: Path) -> None:
    """Go one step along the path, or over a bridge; or try a shorter step, or find a singular point."""
    has_one_driver = len(path.target) == 1
    if has_one_driver and _cross_bridge(path):
        return
    pose, direction = path.pose, path.direction
    s, u = path.ahead()
    trial, path.trial = path.trial or trusted_step(model, pose, direction, s, u), None
    if trial is not None:
        path.iterations += trial.iterations
        if trial.margin >= (CLOSE if has_one_driver else REGULAR) or keeps_branch(model, pose, trial, direction, s):
            if has_one_driver and trial.margin < REGULAR:
                singularities = surveyed(model, pose, trial)
                if singularities is not trial.singularities:
                    path.pose = with_map(pose, singularities)
                    return
            path.accept(trial, s, trial.margin)
            if path.end is None and path.length < STRIDE * path.longest:
                path.end = pole_before(model, pose, trial, direction, path.distance)
            return
    path.shorten(
        s,
        lambda: (
            pole_before(model, path.before, pose, direction, path.distance, least=0.0)
            or limit_beyond(model, path.before, pose, direction)
        ),
    )


def _cross_bridge(path: Path) -> bool:
    """Go on at the far side of a bridge ahead, or end on it; return False where there is none: a step is needed."""
    pose, target = path.pose, path.target
    singularities = pose.singularities
    if singularities is not None and not singularities.low <= target[0] <= singularities.high:
        bridge: Bridge = pose.bridge or singularities.next_bridge(pose.u[0], target[0])
        if not bridge.covers(target[0]):
            pose = bridge.exit(target[0])
            path.pose = with_map(pose, singularities.around(pose.u[0]))
            return True
        try:
            inside = bridge.pose(target)
        except (ArithmeticError, ValueError):  # a block that is not interpolated ends there
            path.end = Limit(pose.u, NO_BLOCK)
            return True
        inside.singularities = singularities if pose.bridge is bridge else singularities.around(target[0])
        path.end = inside
        return True
    path.distance = target[0] - pose.u[0]
    if path.distance == 0.0:  # a node, or a step that ended there by rounding
        path.end, path.margin = pose, pose.margin
        return True
    return False
