"""Assembly: putting the bodies together near a rough pose, and walking along the motion that some rows leave."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular

from kinfmu.equations.blocks import Ordered, ordered_blocks
from kinfmu.equations.part import Part
from kinfmu.equations.system import FloatArray, System
from kinfmu.errors import AssemblyError, listed

CLOSED = 1e-12  # residual relative to the mechanism's size at which a pose counts as closed
SINGULAR = 1e-6  # margin below which a start pose counts as singular: double roots are known to half the digits
COMFORTABLE = 0.03  # margin below which a pose beside the start makes a better anchor
COMFORTABLE_WITHOUT_BRIDGES = 1e-3  # the same with several drivers: solved to round-off over the margin
BESIDE = 0.1  # [rad, sizes]; how far beside a singular start pose the anchor is sought
MOST_DENSE = 900  # coordinates; what needs all rows at once takes minutes beyond
NEAR = 0.5  # [rad, sizes]; a pose as near as that to what the start poses give is the one that is meant
_THROWS = 60  # of what the start poses leave out; blocks that alone can close in two ways each need a few
_THROWS_TO_COME_NEARER = 15  # where the first pose is regular and only not near what is given
_DENSE_THROWS = 8
_DEPENDENT = 1e-6  # part of a row outside the span of others that counts as zero; so does a weight in a combination
_LOOKS = 4  # random poses at which the structure of the rows is seen
_APART = 1e-6  # [rad, sizes]; poses further apart are different branches
_ITERATIONS = 200
_SLOW, _SLOW_STEPS = 0.9, 4  # a residual that falls no further in so many steps close by does not close
_ROUNDED = 1e-14  # residual relative to the size that rounding leaves
_FAR_FROM_SINGULAR = 1e-3  # least singular value over the largest; gradients keep the digits to tell what depends
_LONGEST = 0.2  # [rad, sizes]; step on the way from the start poses to the start of the laws
_SHORTEST = 1e-5  # the same; where steps get shorter a limit lies between
_STEEPEST = 10.0  # change of a coordinate over the longest step: a prediction of more is rejected
_TRUST = 10.0  # a correction of a prediction must be this much smaller than the margin: other branches are farther away
_PARTS = (1.0, 0.3, 0.1, 0.03, 0.01)  # of BESIDE, at which branches beside a singular start pose are sought
_NEARBY_STARTS = 6  # poses tried beside a start that does not close by a little
_SPREAD = 0.3  # [rad, sizes]; how far they lie from the start pose
_NEARLY = 0.01  # residual of a pose that may close beside the start
_LESS = 0.5  # of the margin at the start of a way: what follows leads toward a limit
_DOUBLED = 8.0  # times the correction, where a step to second order is twice as long
_CORRECTION = 0.02  # [rad, sizes]; a prediction that is corrected by more may have left the branch
_SAME_WAY = 0.8  # cosine between directions of motion a step apart; branches cross at wider angles
_RANK = 1e-9  # singular values below this fraction of the largest are directions that the rows do not see


def close(part: System | Part, q: FloatArray, u: FloatArray) -> tuple[FloatArray, float]:
    """The pose nearest to q where all rows of a system or of a part of it hold, and its residual relative to the size.

    Levenberg-Marquardt far away, the shortest Gauss-Newton step near by, so that redundant rows and singular points do
    no harm; close to a dead centre, where that step goes too far, Levenberg-Marquardt again. Stops on the residual: a
    residual above CLOSED means that the pose does not close.
    """
    part = Part(part) if isinstance(part, System) else part
    best, residual = _straight(part, q, u)
    damping, too_far, slow = 1e-3, False, 0
    jacobian = None
    for _ in range(_ITERATIONS):
        norm = float(np.linalg.norm(residual))
        if norm == 0.0 or slow == _SLOW_STEPS:
            break
        if jacobian is None:
            jacobian = part.jacobian(best)
        is_whole = norm <= 1e-3 and not too_far  # close enough for the full step
        if is_whole:
            step = np.linalg.lstsq(jacobian, -residual, rcond=_RANK)[0]
        else:
            damped = np.vstack([jacobian, np.sqrt(damping) * np.eye(jacobian.shape[1])])
            step = np.linalg.lstsq(damped, np.concatenate([-residual, np.zeros(jacobian.shape[1])]), rcond=None)[0]
            longest = float(np.abs(step).max(initial=0.0))
            step *= min(1.0, 0.5 / longest) if longest > 0.0 else 1.0  # half a radian or half a size at most
        trial = best + part.column_scales * step
        trial_residual = part.residual(trial, u)
        left = float(np.linalg.norm(trial_residual))
        if left < norm:
            slow = slow + 1 if norm <= 1e-3 and left > _SLOW * norm else 0
            best, residual, jacobian = trial, trial_residual, None
            damping, too_far = max(damping / 5.0, 1e-12), False
        elif norm <= _ROUNDED or damping > 1e8:
            break
        elif is_whole:
            too_far = True
        else:
            damping *= 8.0
    return best, float(np.abs(residual).max(initial=0.0))


def _straight(part: Part, q: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Pose and residual after one whole Gauss-Newton step if that closes linear rows, else as they are at q."""
    residual = part.residual(q, u)
    if np.abs(residual).max(initial=0.0) == 0.0:
        return q.copy(), residual
    there = q + part.column_scales * np.linalg.lstsq(part.jacobian(q), -residual, rcond=_RANK)[0]
    left = part.residual(there, u)
    linear = np.abs(left).max(initial=0.0) <= 1e-3 * CLOSED
    return (there, left) if linear else (q.copy(), residual)


def motion_samples(part: Part, q: FloatArray, count: int, step: float = 0.2) -> list[FloatArray]:
    """Up to `count` poses spread along the motion that the rows of a part leave, starting with the one nearest to q.

    Random directions of the null space of its Jacobian (seeded), `step` in radians and sizes. Where the motion ends or
    comes to a singular point, where other branches cross, it is followed from the first pose the other way. Empty if
    the rows do not close near q; one pose if they leave no motion. Drivers among the rows stand at 0.
    """
    start, gap = close(part, q, np.zeros(len(part.system.mechanism.drivers)))
    if gap > CLOSED:
        return []
    rng = np.random.default_rng(1989)
    samples = [start]
    free, least = _freedom(part.jacobian(start))  # (n, free directions)
    least = min(_FAR_FROM_SINGULAR, 0.3 * least)
    first = free @ rng.standard_normal(free.shape[1])
    for direction in (first, -first):
        pose = start
        while free.shape[1] > 0 and len(samples) < count:
            free, _ = _freedom(part.jacobian(pose))
            direction = free @ (free.T @ direction) + 0.3 * free @ rng.standard_normal(free.shape[1])
            direction /= np.abs(direction).max()
            onward = _onward(part, pose, free, direction, step, least)
            if onward is None:
                break
            pose = onward
            samples.append(pose)
    return samples


def _onward(
    part: Part, pose: FloatArray, free: FloatArray, direction: FloatArray, step: float, least: float
) -> FloatArray | None:
    """A pose one step, or as much of it as can be gone, in a free direction; None where the motion ends.

    It is not singular (`least`: see _freedom) and on the same branch, where the motion goes on in that direction.
    """
    u = np.zeros(len(part.system.mechanism.drivers))
    along = direction / np.linalg.norm(direction)
    while step > 1e-3:
        ahead, gap = close(part, pose + step * part.column_scales * direction, u)
        if gap <= CLOSED:
            there, regular = _freedom(part.jacobian(ahead))
            more = there.shape[1] - free.shape[1]  # directions: less than 0 where a singular pose is left
            if regular >= least and (more < 0 or (more == 0 and np.linalg.norm(there.T @ along) >= _SAME_WAY)):
                return ahead
        step /= 2.0
    return None


def _freedom(jacobian: FloatArray) -> tuple[FloatArray, float]:
    """The null space of a Jacobian (n, k), and the least of its other singular values over the largest."""
    _, singular, right = np.linalg.svd(jacobian)
    relative = singular / singular.max(initial=1e-300)
    rank = int((relative > _RANK).sum())
    return np.asarray(right[rank:].T), float(relative[:rank].min(initial=1.0))


def null_space(matrix: FloatArray, small: float = _RANK) -> FloatArray:
    """Orthonormal basis of the directions that a matrix maps to zero or to a small part of its norm, (n, k)."""
    _, singular, right = np.linalg.svd(matrix)
    rank = int((singular > small * singular.max(initial=0.0)).sum())
    return np.asarray(right[rank:].T)


class StartValues(NamedTuple):
    """Where assembly begins: a rough pose q (n,) and driver values u (d,).

    is_followed: True if the start poses and the laws give different driver values; is_moved: True if those of the laws
    were taken, because they cannot be reached from those of the start poses.
    """

    q: FloatArray
    u: FloatArray
    is_followed: bool = False
    is_moved: bool = False


def rough_start(system: System) -> FloatArray:
    """Return the rough pose from which the mechanism is assembled, (n,): what the file leaves out is 0."""
    return start_values(system).q


def start_targets(system: System) -> FloatArray:
    """Return the driver values at which the mechanism is assembled, (d,)."""
    return start_values(system).u


def start_values(system: System) -> StartValues:
    """Return the rough pose and the driver values at which a mechanism is assembled.

    The driver's value decides. Driven angles of the start poses are moved by whole turns to the start of the laws. From
    there the pose is followed to the start of the laws: if it does not close, or a limit lies between, the mechanism is
    assembled at the start of the laws.
    """
    given = start_from_poses(system)
    return _decided(system)[0] if given.is_followed else given


@lru_cache(maxsize=4)
def _decided(system: System) -> tuple[StartValues, Assembled | None]:
    """Return the start values of a mechanism whose start poses and laws give different ones, and the assembled pose."""
    given, law = start_from_poses(system), law_targets(system)
    found = _assembled(system, given)
    if len(system.coordinates) > MOST_DENSE or (found is not None and _is_reached(system, found, law)):
        return given, found
    if found is None and len(system.rows) > len(system.coordinates):
        return given, None  # contradictory joints may close at isolated poses by chance
    moved = StartValues(_with_angles(system, given.q, law - given.u), law, is_followed=True, is_moved=True)
    there = _assembled(system, moved)
    return (moved, there) if there is not None and there.margin > SINGULAR else (given, found)


def law_targets(system: System) -> FloatArray:
    """Return the driver values at which the laws start, (d,)."""
    mechanism = system.mechanism
    return np.array([driver.law.at(mechanism.run.start) for driver in mechanism.drivers], dtype=float)


def start_from_poses(system: System) -> StartValues:
    """Return the start poses and the driver values in them, angles moved by whole turns to the start of the laws.

    A driver whose value the start poses leave out is at the start of its law.
    """
    bodies = system.mechanism.moving_bodies
    given = [value is not None for body in bodies for value in body.start]
    q = np.array([value or 0.0 for body in bodies for value in body.start])
    measured, law = system.measure(q), law_targets(system)
    targets = law.copy()
    turns = np.zeros(len(law))
    for k, driver in enumerate(system.mechanism.drivers):
        member = system.members[len(system.mechanism.joints) + k]
        (seen,) = system.gradients(member, q) != 0.0
        if all(given[column] for column, used in zip(member.columns, seen, strict=True) if used):
            if driver.quantity.kind == "angle":
                turns[k] = math.tau * round((law[k] - measured[k]) / math.tau)
            targets[k] = measured[k] + turns[k]
    return StartValues(_with_angles(system, q, turns), targets, is_followed=not np.array_equal(targets, law))


def _with_angles(system: System, q: FloatArray, change: FloatArray) -> FloatArray:
    """Return a rough pose with driven angles changed by `change` (d,); driven lengths are left to assembly."""
    q = q.copy()
    for k, driver in enumerate(system.mechanism.drivers):
        if driver.quantity.kind == "angle" and change[k] != 0.0:
            member = system.members[len(system.mechanism.joints) + k]
            (slopes,) = system.gradients(member, q)
            turned = int(np.abs(slopes).argmax())
            q[member.columns[turned]] += change[k] / slopes[turned]
    return q


def _is_reached(system: System, found: Assembled, target: FloatArray) -> bool:
    """True if a straight line of driver values leads from a pose to others: no limit lies between."""
    _, u = _followed(system, found.q, found.u, target)
    return np.array_equal(u, target)


def _followed(
    system: System, q: FloatArray, u: FloatArray, target: FloatArray, trust: float | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return a pose followed along a straight line of driver values to `target`, or to its limit, and the values there.

    Steps are predicted to second order. trust: the margin over the largest correction of a prediction, so that no
    other branch is that near, and the end is where the margin has halved; None: any branch will do where branches
    cross.
    """
    whole, scales = Part(system), system.column_scales
    way, at_rest = target - u, np.zeros(len(target))
    length = float(np.abs(way / _reaches(system)).max())
    shortest = _SHORTEST if trust is None else _ROUNDED
    done, step = 0.0, min(1.0, _LONGEST / length)
    here = first = there = margin(system, q) if trust else 0.0
    while done < 1.0 and step * length >= shortest:
        step = min(step, 1.0 - done)
        ahead = target if step == 1.0 - done else u + step * way
        jacobian = whole.jacobian(q)
        qd = scales * np.linalg.lstsq(jacobian, system.nu(q, u, step * way) / whole.row_scales, rcond=_RANK)[0]
        gamma = system.gamma(q, qd, u, step * way, at_rest)
        qdd = scales * np.linalg.lstsq(jacobian, gamma / whole.row_scales, rcond=_RANK)[0]
        predicted = q + qd + 0.5 * qdd
        corrected, allowed = np.inf, _CORRECTION
        if np.abs((predicted - q) / scales).max() <= _LONGEST * _STEEPEST:
            trial, gap = close(whole, predicted, ahead)
            if gap <= CLOSED:
                corrected = float(np.abs((trial - predicted) / scales).max())
                there = margin(system, trial) if trust else there
                allowed = min(allowed, here / trust, there / trust) if trust else allowed
        if corrected > allowed:
            step /= 2.0
            continue
        q, u, here, done = trial, ahead, there, done + step
        if here < _LESS * first:
            break
        if _DOUBLED * corrected <= allowed:
            step *= 2.0
    return q, u


def _reaches(system: System) -> FloatArray:
    """What counts as one unit of each driver, (d,): a radian, or the mechanism's size."""
    return np.array([_reach(system, driver.quantity.kind) for driver in system.mechanism.drivers])


class Assembled(NamedTuple):
    """A closed pose: coordinates q (n,), driver values u (d,), and how far from singular it is."""

    q: FloatArray
    u: FloatArray
    margin: float  # the smallest over the blocks of smallest over largest singular value of the scaled Jacobian


def assemble(system: System) -> Assembled | None:
    """The start pose, closed; if it is singular or nearly so, the most regular of it and the poses a little beside it.

    Block by block where rows and coordinates allow an order; all rows at once where they do not, or where a block is
    open or singular. None if the rows, all together, do not close near the start pose.
    """
    values = start_values(system)
    return _decided(system)[1] if values.is_followed else _assembled(system, values)


def _assembled(system: System, start: StartValues) -> Assembled | None:
    """Return what `assemble` does, from a rough pose and driver values."""
    u = start.u
    order = in_order(system)
    found, trouble = _assembled_in_order(system, u, start.q, order)
    if order.blocks and (found is None or _off(system, start, found) > NEAR):
        found = _thrown_together(system, start, found, order)
    if found is not None:
        return found
    if len(system.coordinates) > MOST_DENSE:
        raise AssemblyError(
            f"a mechanism of {len(system.coordinates)} coordinates (more than {MOST_DENSE}) must assemble block by "
            f"block from its start pose, but {trouble}"
        )
    q, gap = close(system, start.q, u)
    if gap > CLOSED:
        found = _assembled_beside(system, start) if gap < _NEARLY else None
        return found if found or order.blocks else _thrown_together(system, start, None, order)
    found = _without_spare_rows(system, q, u) or Assembled(q, u, margin(system, q))
    if found.margin > comfortable(system):
        return found
    beside = []
    for side in (1.0, -1.0):
        if found.margin > SINGULAR:
            there, at = _followed(system, q, u, u + side * BESIDE * _reaches(system), trust=_TRUST)
            beside.append(Assembled(there, at, margin(system, there)))
            continue
        near = _beside(system, found, side)
        beside += [] if near is None else [near]
    return max([found, *beside], key=lambda pose: pose.margin)


def closes_beside(system: System, singular: Assembled) -> bool:
    """True if a mechanism closes a little beside a singular pose."""
    return any(_beside(system, singular, side) is not None for side in (1.0, -1.0))


def _beside(system: System, singular: Assembled, side: float) -> Assembled | None:
    """Return a closed pose on one side of a singular one, at the first distance of _PARTS that has one."""
    for part in _PARTS:
        u = singular.u + side * part * BESIDE * _reaches(system)
        near = next(iter(branches(system, singular.q, u)), None)
        if near is not None:
            return Assembled(near, u, margin(system, near))
    return None


def _assembled_beside(system: System, start: StartValues) -> Assembled | None:
    """Return the pose nearest to the start poses, a little beside them, from which the start is reached, if any.

    Near a change point a rough pose may lie between the branches, where no row closes by a small gap; with redundant
    rows poses near it are tried too.
    """
    rng = np.random.default_rng(1989)
    beside: list[tuple[float, Assembled]] = []
    for trial in range(_NEARBY_STARTS if len(system.rows) > len(system.coordinates) else 1):
        spread = _SPREAD * system.column_scales * rng.uniform(-1.0, 1.0, len(start.q)) if trial else 0.0
        for side in (1.0, -1.0):
            u = start.u + side * BESIDE * _reaches(system)
            q, gap = close(system, start.q + spread, u)
            near = Assembled(q, u, margin(system, q) if gap <= CLOSED else 0.0)
            if near.margin > SINGULAR and _is_reached(system, near, start.u):
                beside.append((_off(system, start, near), near))
    return min(beside, key=lambda pose: pose[0])[1] if beside else None


def comfortable(system: System) -> float:
    """Margin from which a pose is a good anchor: with one driver outside a bridge's window."""
    return COMFORTABLE if len(system.mechanism.drivers) == 1 else COMFORTABLE_WITHOUT_BRIDGES


def _without_spare_rows(system: System, q: FloatArray, u: FloatArray) -> Assembled | None:
    """A closed pose with its margin by blocks, once rows that depend on earlier ones there are left out.

    None if that leaves no order of solving, as at a singular pose, or a block that is nearly singular.
    """
    joints = Part(system, range(system.joint_row_count))
    spare = dependent_rows(joints.jacobian(q))
    rows = [k for k in range(len(system.rows)) if k not in spare]
    order = in_order(system, rows) if len(rows) == len(system.coordinates) else Ordered(())
    if not order.blocks:
        return None
    blocks = [(Part(system, members, columns, q), list(columns)) for members, columns in order.blocks]
    least = min(_block_margin(part.jacobian(q[columns])) for part, columns in blocks)
    return Assembled(q, u, least) if least > comfortable(system) else None


def dependent_rows(gradients: FloatArray) -> dict[int, list[int]]:
    """Rows of a matrix that are combinations of earlier rows, each with the earlier independent rows that it needs."""
    dependent: dict[int, list[int]] = {}
    independent: list[int] = []
    directions = np.zeros_like(gradients)  # orthonormal, one an independent row
    triangle = np.zeros((len(gradients), len(gradients)))  # the independent rows over these directions
    for index, gradient in enumerate(gradients):
        count = len(independent)
        parts, rest = np.zeros(count), gradient
        for _ in range(2):  # Gram-Schmidt, twice for round-off
            more = directions[:count] @ rest
            parts, rest = parts + more, rest - more @ directions[:count]
        length = float(np.linalg.norm(rest))
        if length > _DEPENDENT * max(1.0, float(np.linalg.norm(gradient))):
            directions[count] = rest / length
            triangle[:count, count], triangle[count, count] = parts, length
            independent.append(index)
        else:
            weights = solve_triangular(triangle[:count, :count], parts)
            dependent[index] = [
                row for row, weight in zip(independent, weights, strict=True) if abs(weight) > _DEPENDENT
            ]
    return dependent


def in_order(system: System, rows: Sequence[int] | None = None) -> Ordered:
    """The order of solving rows (all if None), by index into System.rows.

    A row meets the coordinates along which its gradient does not vanish at every one of some random poses: at one pose
    a cam that dwells does not show whom it leads.
    """
    rng = np.random.default_rng(1989)
    poses = rng.uniform(-3.0, 3.0, (_LOOKS, len(system.coordinates))) * system.column_scales
    meets: list[list[int]] = []
    for member in system.members:
        slopes = np.any([system.gradients(member, q) != 0.0 for q in poses], axis=0)  # (rows, columns)
        meets += [[column for column, meet in zip(member.columns, row, strict=True) if meet] for row in slopes]
    chosen = range(len(meets)) if rows is None else rows
    order = ordered_blocks([meets[row] for row in chosen], len(system.coordinates))
    return Ordered(
        tuple((tuple(chosen[k] for k in members), columns) for members, columns in order.blocks),
        tuple(chosen[k] for k in order.unmatched_rows),
        order.unmatched_columns,
    )


def _thrown_together(system: System, start: StartValues, first: Assembled | None, order: Ordered) -> Assembled | None:
    """Of a first pose and regular ones from seeded random values of what the start poses leave out, the one that comes
    nearest to what they give: the first that comes near, else the nearest of all.
    """
    u = start.u
    is_open = np.array([value is None for body in system.mechanism.moving_bodies for value in body.start])
    if not is_open.any():
        return first
    ground = next(body for body in system.mechanism.bodies if body.is_ground)
    middle = np.mean([tuple(point) for point in ground.points.values()] or [(0.0, 0.0)], axis=0)
    centre = np.tile([*middle, 0.0], len(is_open) // 3)
    spread = np.tile([1.5 * system.size, 1.5 * system.size, np.pi], len(is_open) // 3)
    rng = np.random.default_rng(1989)
    if len(is_open) > MOST_DENSE:
        return first
    nearest = first
    throws = _DENSE_THROWS if not order.blocks else _THROWS if first is None else _THROWS_TO_COME_NEARER
    for _ in range(throws):
        thrown = np.where(is_open, centre + spread * rng.uniform(-1.0, 1.0, len(is_open)), start.q)
        if order.blocks:
            found, _ = _assembled_in_order(system, u, thrown, order)
        else:
            q, gap = close(system, thrown, u)
            found = Assembled(q, u, margin(system, q)) if gap <= CLOSED else None
        if found is None or found.margin <= comfortable(system):
            continue
        if nearest is None or _off(system, start, found) < _off(system, start, nearest):
            nearest = found
        if _off(system, start, nearest) <= NEAR:
            break
    return nearest


def _off(system: System, start: StartValues, found: Assembled) -> float:
    """How far a pose is from what the start poses give, in radians (without whole turns) and sizes."""
    largest = 0.0
    is_given = (value is not None for body in system.mechanism.moving_bodies for value in body.start)
    for name, counts, value, q in zip(system.coordinates, is_given, start.q, found.q, strict=True):
        if counts:
            off = float(q) - float(value)
            off = math.remainder(off, math.tau) if name.endswith(".phi") else off / system.size
            largest = max(largest, abs(off))
    return largest


def _assembled_in_order(
    system: System, u: FloatArray, start: FloatArray, order: Ordered
) -> tuple[Assembled, str] | tuple[None, str]:
    """A rough pose closed block by block, or None and what stands in the way.

    Never a pose that is nearly singular.
    """
    if order.unmatched_columns:
        return None, f"nothing determines {listed(system.coordinates[k] for k in order.unmatched_columns[:5])}"
    if order.unmatched_rows:
        return None, f"there are rows to spare: {listed(system.rows[k].name for k in order.unmatched_rows[:5])}"
    q, least = start.copy(), 1.0
    for rows, columns in order.blocks:
        part = Part(system, rows, columns, q)
        q[list(columns)], gap = close(part, q[list(columns)], u)
        if gap > CLOSED:
            return None, f"the rows {listed(system.rows[k].name for k in rows[:5])} do not close"
        least = min(least, _block_margin(part.jacobian(q[list(columns)])))
        if least <= comfortable(system):
            return None, f"the rows {listed(system.rows[k].name for k in rows[:5])} are singular there or nearly so"
    open_rows = np.flatnonzero(np.abs(Part(system).residual(q, u)) > CLOSED)
    if len(open_rows):  # a cam that dwells at every random pose does not show whom it leads
        return None, f"the rows {listed(system.rows[k].name for k in open_rows[:5])} open when others close"
    return Assembled(q, u, least), ""


def _block_margin(jacobian: FloatArray) -> float:
    """Smallest over largest singular value; of a single row, where that says nothing, its slope."""
    if jacobian.size == 1:
        return min(1.0, abs(float(jacobian[0, 0])))
    singular = np.linalg.svd(jacobian, compute_uv=False)
    return float(singular[-1] / singular[0])


def branches(system: System, singular: FloatArray, u: FloatArray) -> list[FloatArray]:
    """Closed poses at driver values u a little beside a singular pose, nearest first: one a branch that leaves it."""
    free = null_space(system.scaled_jacobian(singular), 1e-4)
    starts = [singular] + [
        singular + side * system.column_scales * direction for direction in free.T for side in (-0.2, 0.2)
    ]
    found: list[tuple[float, FloatArray]] = []
    for start in starts:
        pose, gap = close(system, start, u)
        away = float(np.abs((pose - singular) / system.column_scales).max())
        new = all(np.abs((pose - other) / system.column_scales).max() > _APART for _, other in found)
        if gap <= CLOSED and away < 1.0 and new:
            found.append((away, pose))
    return [pose for _, pose in sorted(found, key=lambda item: item[0])]


def _reach(system: System, kind: str) -> float:
    return 1.0 if kind == "angle" else system.size


def margin(system: System, q: FloatArray) -> float:
    """Smallest over largest singular value of the scaled Jacobian of all rows: 0 at a singular point."""
    singular = np.linalg.svd(system.scaled_jacobian(q), compute_uv=False)
    return float(singular[-1] / singular[0]) if len(singular) == len(system.coordinates) else 0.0
