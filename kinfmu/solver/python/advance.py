"""Advance: from a good pose to other driver values, along one continuous branch."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

from .bridge import HALF_WIDTH, Bridge, Walk, build, moved, secant_zero
from .linear import orientation
from .message import LOCATED, ROUGHLY, differs, place
from .pose import ALONE, POLISHED, STEEP, UNDECIDED, Model, Pose, Vector, directed, on_road, polished
from .road import Road, Searched
from .span import REGULAR
from .status import Status

LONGEST_STEP = 0.2  # [rad, sizes]; longer predictions may land on another branch by accident
TRUST = 10.0  # a correction of the prediction must be this much smaller than the determinants: so far off lie branches
FALL = 0.3  # a step may not bring a determinant below this part of what it was
SHORTEST_STEP = 5e-9  # of the longest; where steps get shorter, a limit is near and its place is extrapolated
NEAR_SINGULAR = 0.0125  # determinant below which qdd keeps less than nine digits
MOST_STEPS = 1_000_000  # of a way: seconds, and more than any motion that is meant
NO_BLOCK, TOO_FAR = -1, -2  # in place of a limit's block: no determinant is to blame; the way has too many steps
BENT = 1.0  # [rad, sizes]; a prediction whose quadratic term is larger may land whole turns away by accident
UNDOUBTED = 1e-5  # [rad, sizes]; a prediction that was corrected by less did not land by accident
CLOSE = 0.1  # determinant below which branches may lie as close as a correction
SMOOTH = 0.5  # change of the tangent beside the predicted one, as a part of it: more is another branch
GIVE_UP = 5e-15  # of the longest; nothing lies between such steps
_MOST_WALKED = 10_000  # steps between a pose and a node; a few, as a rule
_ROUGHEST = 5e-4  # of the longest step; where even that cannot be trusted there is no plain way


class Limit(NamedTuple):
    """Driver values where a way ends, and the block whose determinant vanishes there (or NO_BLOCK, TOO_FAR).

    crosses: the motion does not turn back there, but another branch crosses it, and no bridge holds.
    """

    u: Vector
    block: int
    crosses: bool = False


def advance(model: Model, start: Pose, target: Vector, road: Road | None = None) -> Pose | Limit:
    """The pose at `target`, or the limit on the way to it; road: what is known of that way, if not the start's.

    Each step predicts with velocity and acceleration (the prediction decides the branch), corrects by Newton on the
    residual, and is trusted if the correction is small against the determinant and no determinant changes its sign.
    With one driver, singular points on the way are bridged.
    """
    one = len(target) == 1
    direction, distance = (ALONE, 0.0) if one else course(model, start.u, target)
    longest: float = LONGEST_STEP * model.REACH[0] if one else LONGEST_STEP
    pose = start if road is None or road is start.road else on_road(start, road)
    step, iterations = longest, 0
    before, regular, limit = start, start, None
    if abs(target[0] - start.u[0] if one else distance) > MOST_STEPS * longest:
        return Limit(start.u, TOO_FAR)
    for _ in range(MOST_STEPS):
        if one:
            road = pose.road
            if road is not None and not road.low <= target[0] <= road.high:
                bridge: Bridge = pose.bridge or road.next_bridge(pose.u[0], target[0])
                if bridge.covers(target[0]):
                    try:
                        inside = bridge.pose(target)
                    except (ArithmeticError, ValueError):  # a block that is not interpolated ends there
                        return Limit(pose.u, NO_BLOCK)
                    inside.road = road if pose.bridge is bridge else road.around(target[0])
                    return inside
                pose = bridge.exit(target[0])
                pose = on_road(pose, road.around(pose.u[0]))
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
                road = surveyed(model, pose, trial)
                if road is not trial.road:
                    pose = on_road(pose, road)
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
    """The pose at the end of a way, with the iterations of the whole way.

    At a dead centre it has no tangent to go on by: the next way starts from the last regular pose.
    """
    pose.iterations = iterations
    if pose.margin < NEAR_SINGULAR:
        pose.status = Status.NEAR_SINGULAR
        pose.base = regular
    return pose


def course(model: Model, start: Vector, target: Vector) -> tuple[Vector, float]:
    """Direction and length of a straight way of several drivers, measured by the driver that has most to go."""
    ways = [(b - a) / reach for a, b, reach in zip(start, target, model.REACH, strict=True)]
    length = max(map(abs, ways))
    if not 0.0 < length < inf:
        return start, length
    return tuple((b - a) / length for a, b in zip(start, target, strict=True)), length


def trusted_step(model: Model, pose: Pose, direction: Vector, s: float, u: Vector) -> Pose | None:
    """One step of predict and correct, or None if it cannot be trusted to stay on the branch."""
    zd, zdd = pose.tangent or directed(model, pose, direction)
    try:
        found = model.position(u, pose.z, zd, zdd, s)
        if found[2] < POLISHED:
            found = polished(model, u, found)
        trial = Pose(u, found, pose.road)
    except (ArithmeticError, ValueError):  # singular, diverged, or the sine of an overflow
        return None
    needed = TRUST * trial.moved
    if needed > trial.margin or needed > pose.margin or trial.margin == 0.0:
        return None
    for before, after in zip(pose.determinants, trial.determinants):  # noqa: B905  one a block, both
        if after < FALL * before if before > 0.0 else after > FALL * before:
            return None
    if model.TALL and _turns_over(model, pose, trial):
        return None
    if trial.moved > UNDOUBTED:
        for second, scale in zip(zdd, model.UNKNOWN_SCALES):  # noqa: B905  one an unknown, both
            if abs(second) * s * s > 2.0 * BENT * scale:
                return None
    return trial


def _turns_over(model: Model, pose: Pose, trial: Pose) -> bool:
    """True if the columns of a block's J change their orientation from a pose to another, det(J^T J') <= 0.

    The determinant of a block of more rows than unknowns has no sign by which a crossing in between could be seen.
    """
    here, there = model.jacobians(pose.values), model.jacobians(trial.values)
    return any(orientation(here[block], there[block]) <= 0.0 for block in model.TALL)


def keeps_branch(model: Model, pose: Pose, trial: Pose, direction: Vector, s: float) -> bool:
    """False if the tangent of a way jumps in a step along it, as it does from one branch to a crossing one.

    Near a crossing the branches lie as close as corrections are small, and one of them keeps the determinant's sign;
    their tangents stay apart. Toward a dead centre tangents grow, by at most this much in a step. So close to either
    that both branches are the same in doubles, no step leads on.
    """
    if pose.margin < UNDECIDED and trial.margin > pose.margin:
        return False
    zd, zdd = directed(model, pose, direction)
    there = directed(model, trial, direction)[0]
    scales = model.UNKNOWN_SCALES
    largest = max([abs(b) / c for b, c in zip(there, scales)])  # noqa: B905  one an unknown, all
    jump = max([abs(b - (a + s * aa)) / c for a, aa, b, c in zip(zd, zdd, there, scales)])  # noqa: B905
    return bool(jump <= SMOOTH * largest)


def surveyed(model: Model, pose: Pose, trial: Pose) -> Road | None:
    """The road with what is new at a trial pose: a bridge, if it has come near the window of a singular point; a
    searched stretch, if no bridge holds there. The road as it was, if nothing is new.
    """
    road: Road | None = trial.road
    here, known = trial.u[0], road or Road()
    low = [k for k, d in enumerate(trial.determinants) if -REGULAR < d < REGULAR and not known.knows(here, k)]
    if not low:
        return road

    def walk(start: Pose, u: float) -> Pose | None:
        return _plainly(model, start, u)

    if model.DRIVER_KINDS[0] == "angle":
        for old in known.bridges:
            again = moved(old, pose, here, walk)
            if again is not None:
                return known.with_bridge(again, pose.u[0])
    reach: float = model.REACH[0]
    before = pose if abs(here - pose.u[0]) > 1e-3 * reach else _beside(trial, low[0], walk, 0.02 * reach)
    if before is None:
        return road
    for block in low:  # upstream first
        zero = secant_zero(before, trial, block)
        if zero is None or abs(zero - here) > 1.05 * HALF_WIDTH * reach or known.knows(zero, block):
            continue
        bridge = build(model, before, block, zero, walk)
        if bridge is None:
            room = 2.0 * HALF_WIDTH * reach
            stretch = Searched(zero - room, zero + room, block)
        elif known.knows(bridge.centre, block):
            stretch = Searched(min(here, bridge.centre), max(here, bridge.centre), block)
        else:
            return known.with_bridge(bridge, pose.u[0])
        road = known = known.with_searched(stretch, len(trial.determinants))
    return road


def _beside(pose: Pose, block: int, walk: Walk, distance: float) -> Pose | None:
    """A pose beside another on the side where a block's determinant grows."""
    for offset in (distance, -distance):
        other = walk(pose, pose.u[0] + offset)
        if other is not None and abs(other.determinants[block]) > abs(pose.determinants[block]):
            return other
    return None


def _plainly(model: Model, start: Pose, u: float) -> Pose | None:
    """From a pose to a value of the only driver by trusted steps, without bridges; or None."""
    longest: float = LONGEST_STEP * model.REACH[0]
    pose, step = start, longest
    for _ in range(_MOST_WALKED):
        if pose.u[0] == u:
            return pose
        distance = u - pose.u[0]
        whole = -step <= distance <= step
        s = distance if whole else step if distance > 0.0 else -step
        trial = trusted_step(model, pose, ALONE, s, (u,) if whole else (pose.u[0] + s,))
        if trial is not None:
            pose = trial
        else:
            step = 0.5 * abs(s)
            if step < _ROUGHEST * longest:
                return None
    return None


def limit_beyond(model: Model, before: Pose, pose: Pose, direction: Vector) -> Limit:
    """Where the way ends, just beyond a pose that steps cannot leave.

    Near a dead centre the tangent grows without bound, and determinant^2 falls linearly along the way: the secant rule
    on the last two poses gives its zero. Where branches cross the determinant itself falls linearly.
    """
    if not pose.determinants:
        return Limit(pose.u, NO_BLOCK)
    block = min(range(len(pose.determinants)), key=lambda k: abs(pose.determinants[k]))
    unit = model.REACH[0] if len(direction) == 1 else 1.0
    slopes = directed(model, pose, direction)[0]
    crosses = max([abs(slopes[k]) / model.UNKNOWN_SCALES[k] for k in range(*model.BLOCKS[block])]) * unit < STEEP
    near, far = abs(pose.determinants[block]), abs(before.determinants[block])
    if not crosses:
        near, far = near * near, far * far
    if far <= near:
        return Limit(pose.u, block, crosses)
    beyond = near / (far - near)
    return Limit(tuple(b + (b - a) * beyond for a, b in zip(before.u, pose.u, strict=True)), block, crosses)


def is_beyond(target: Vector, limit: Vector, direction: Vector, s: float) -> bool:
    """True if the target lies past the limit on the way that s goes."""
    return sum((a - b) * d * s for a, b, d in zip(target, limit, direction, strict=True)) > 0.0


def limit_message(model: Model, limit: Limit, target: Vector) -> str:
    """Why a target cannot be reached, in one line."""
    if limit.block == TOO_FAR:
        return (
            f"{place(model, target)} is too far from {place(model, limit.u)}: more than {MOST_STEPS} steps on one way"
        )
    names = ", ".join(model.UNKNOWNS[slice(*model.BLOCKS[limit.block])]) if limit.block >= 0 else "the joints"
    why = f"branches of {names} cross" if limit.crosses else f"{names} would part"
    if limit.crosses and len(target) > 1:
        why += "; the crossing depends on several drivers, so no bridge is built"
    if not differs(model, target, limit.u, LOCATED):
        return f"{place(model, target, LOCATED)} cannot be reached: to these digits it is the limit, where {why}"
    asked = place(model, target, ROUGHLY if differs(model, target, limit.u, ROUGHLY) else LOCATED)
    return f"{asked} cannot be reached: the limit is {place(model, limit.u, LOCATED)}, where {why}"
