"""Trusted steps: predict, correct, and accept only what stays on the branch."""

from __future__ import annotations

from math import floor, inf

from .linear import orientation
from .pose import POLISHED, UNDECIDED, UNIT_SPEED, Model, Pose, Vector, directed, polished

LONGEST_STEP = 0.2  # [rad, sizes]; longer predictions may land on another branch by accident
TRUST = 10.0  # a correction of the prediction must be this much smaller than the determinants: so far off lie branches
FALL = 0.3  # a step may not bring a determinant below this part of what it was
BENT = 1.0  # [rad, sizes]; a prediction whose quadratic term is larger may land whole turns away by accident
MOST_OFF = 0.5  # [rad, sizes] of what a law gives outright from its prediction; farther off lie whole turns
UNDOUBTED = 1e-5  # [rad, sizes]; a prediction that was corrected by less did not land by accident
SMOOTH = 0.5  # largest jump of the tangent in a step, as a part of the tangent: a larger one is another branch
APART = 1e-3  # least distance of a crossing branch over the determinant, in radians and sizes; in most blocks about 1
_MOST_FOLLOWED = 10_000  # steps between a pose and a node; a few, as a rule
_ROUGHEST = 5e-4  # of the longest step; a path that needs shorter ones is not followed


def trusted_step(model: Model, pose: Pose, direction: Vector, s: float, u: Vector) -> Pose | None:
    """Return one step of predict and correct, or None if it cannot be trusted to stay on the branch."""
    zd, zdd = pose.tangent or directed(model, pose, direction)
    try:
        found = model.position(u, pose.z, zd, zdd, s)
    except (ArithmeticError, ValueError):  # singular, diverged, or the sine of an overflow
        return None
    if found[2] < POLISHED:
        found = polished(model, u, found)
    trial = Pose(u, found, pose.singularities)
    margin = trial.margin
    needed = TRUST * trial.moved
    if needed > margin or needed > pose.margin or margin == 0.0:
        return None
    for before, after in zip(pose.determinants, trial.determinants):  # noqa: B905  one item per block
        if after < FALL * before if before > 0.0 else after > FALL * before:
            return None
    if model.LAW_UNITS and passes_unseen(model, pose, trial, direction, s):
        return None
    if model.TALL and _turns_over(model, pose, trial):
        return None
    if trial.moved > UNDOUBTED:
        for second, scale in zip(zdd, model.UNKNOWN_SCALES):  # noqa: B905  one item per unknown
            if abs(second) * s * s > 2.0 * BENT * scale:
                return None
    return trial


def passes_unseen(model: Model, pose: Pose, trial: Pose, direction: Vector, s: float) -> bool:
    """Return whether a step passes over a part of a law that it has not seen, or over a length below 0.

    What it monitors moves along the step as predicted, and by what the prediction is `off` to either side. Arguments
    may turn back within the step. A coordinate that a law gives outright may not be off by so much that another one,
    predicted from it, may be a whole turn off.
    """
    zd, zdd = directed(model, pose, direction)
    motion = model.law_motion(pose.values, direction, (0.0,) * len(direction), zd, zdd)
    there, turns = model.law_positions(trial.values), model.LAW_TURNS
    count, arguments = len(there), len(turns)
    lows, highs = [], []
    for k, (end, unit) in enumerate(zip(there, model.LAW_UNITS)):  # noqa: B905  one item per motion
        here, rate, bend = motion[k], s * motion[count + k], s * s * motion[2 * count + k]
        predicted = here + rate + 0.5 * bend
        off = abs(end - predicted)
        if k < arguments and off > 1.0 and turns[k]:
            off = abs(off - turns[k] * floor(off / turns[k] + 0.5))
        if not off <= MOST_OFF * unit:
            return True
        if k < arguments + model.LAW_LENGTHS:
            low, high = (here, predicted) if here < predicted else (predicted, here)
            if rate * (rate + bend) < 0.0:
                turning = here - 0.5 * rate * rate / bend
                low, high = min(low, turning), max(high, turning)
            if k >= arguments and low < off:
                return True
            lows.append(low - off)
            highs.append(high + off)
    for low, high, slope in zip(lows, highs, model.law_slopes()):  # noqa: B905  lengths have none
        if slope * (high - low) > 1.0:
            break
    else:  # as a rule
        return False
    before, after = model.law_steps(lows[:arguments]), model.law_steps(highs[:arguments])
    return any(abs(b - a) > 1.0 for a, b in zip(before, after))  # noqa: B905  one item per argument


def _turns_over(model: Model, pose: Pose, trial: Pose) -> bool:
    """Return whether the columns of a block's J change their orientation from a pose to another, det(J^T J') <= 0.

    The determinant of a block of more rows than unknowns has no sign by which a crossing in between could be seen.
    """
    here, there = model.jacobians(pose.values), model.jacobians(trial.values)
    return any(orientation(here[block], there[block]) <= 0.0 for block in model.TALL)


def keeps_branch(model: Model, pose: Pose, trial: Pose, direction: Vector, s: float) -> bool:
    """Return False if the tangent of a path jumps in a step along it, as it does from one branch to a crossing one.

    Near a crossing the branches lie as close as corrections are small, and one of them keeps the determinant's sign;
    their tangents stay apart. Towards a dead centre the tangent grows, but in a step by at most SMOOTH of itself. Where
    the unknowns rest the tangent is rounding noise: at a distance x from a crossing both branches have a determinant
    |D| ~ x and lie |D| apart, so in a step s across it their tangents differ by (|D| + |D'|) / s. Where a pose is so
    close to either that doubles cannot tell the branches apart, no step is accepted.
    """
    if pose.margin < UNDECIDED and trial.margin > pose.margin:
        return False
    zd, zdd = directed(model, pose, direction)
    there = directed(model, trial, direction)[0]
    scales = model.UNKNOWN_SCALES
    largest = max([abs(b) / c for b, c in zip(there, scales)])  # noqa: B905  one item per unknown
    jump = max([abs(b - (a + s * aa)) / c for a, aa, b, c in zip(zd, zdd, there, scales)])  # noqa: B905
    return bool(jump <= SMOOTH * max(largest, APART * (pose.margin + trial.margin) / abs(s)))


def follow_path(model: Model, start: Pose, u: float) -> Pose | None:
    """Return the pose at a value of the only driver, followed by trusted steps without bridges, or None."""
    longest: float = LONGEST_STEP * model.REACH[0]
    pose, step = start, longest
    for _ in range(_MOST_FOLLOWED):
        if pose.u[0] == u:
            return pose
        distance = u - pose.u[0]
        whole = -step <= distance <= step
        s = distance if whole else step if distance > 0.0 else -step
        trial = trusted_step(model, pose, UNIT_SPEED, s, (u,) if whole else (pose.u[0] + s,))
        if trial is not None:
            pose = trial
        else:
            step = 0.5 * abs(s)
            if step < _ROUGHEST * longest:
                return None
    return None


def straight_path(model: Model, start: Vector, target: Vector) -> tuple[Vector, float]:
    """Return direction and length of a straight path of several drivers, measured by the one with most to go."""
    parts = [(b - a) / reach for a, b, reach in zip(start, target, model.REACH, strict=True)]
    length = max(map(abs, parts))
    if not 0.0 < length < inf:
        return start, length
    return tuple((b - a) / length for a, b in zip(start, target, strict=True)), length
