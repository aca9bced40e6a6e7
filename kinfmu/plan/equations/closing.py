"""Closing: poses near a given one where all rows hold, and motion from one such pose to others."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.plan.equations.part import Part
from kinfmu.plan.equations.system import FAR, System

CLOSED = 1e-12  # residual relative to the mechanism's size at which a pose counts as closed
CONSISTENT = 1e-11  # gap up to which a dependent row counts as consistent, of the link that it is about
_DEPENDENT = 1e-6  # part of a row outside the span of others that counts as zero; so does a weight in a combination
_APART = 1e-6  # [rad, sizes]; poses further apart are different branches
_ITERATIONS = 200
_CORRECTIONS = 10  # iterations after a prediction that is nearer than the margin; more are on the way to another branch
_SLOW, _SLOW_STEPS = 0.9, 4  # a small residual that falls more slowly in so many steps does not close
OFFSET_ROUNDING = 8.0 * 2.0**-52  # of what is far from the origin, in the residual that it leaves
_TOLERANCE = 1e-9  # residual relative to the size up to which samples are good, by default
_ROUNDED = 1e-14  # residual relative to the size that rounding leaves
_FAR_FROM_SINGULAR = 1e-3  # least singular value over the largest; gradients keep the digits to tell what depends
_LONGEST = 0.2  # [rad, sizes]; step from the start poses to the start of the laws
_SHORTEST = 1e-5  # the same; shorter steps mean a limit
_CLOSEST = 1e-2  # of the square of the margin, the order of the distance to a limit; shorter steps lead nowhere
_HELD = 1e-6  # part of the speed of a driver that rows do not allow
_WORK = 1e7  # cube of the coordinates times steps: less than a second
_LEAST_TRIALS, _MOST_TRIALS = 8, 100  # of steps on a path
_LEAST_DIRECTIONS, _LEAST_ITERATIONS = 2, 25  # of searches for branches
_STEEPEST = 10.0  # change of a coordinate over the longest step: a prediction of more is rejected
_LESS = 0.5  # of the margin at the start of a path: beyond, the path leads toward a limit
_DOUBLED = 8.0  # times the correction, where a step to second order is twice as long
_CORRECTION = 0.02  # [rad, sizes]; a prediction that is corrected by more may have left the branch
_SAME_DIRECTION = 0.8  # cosine between directions of motion a step apart; branches cross at wider angles
_RANK = 1e-9  # singular values below this fraction of the largest count as zero


def close(part: System | Part, q: FloatArray, u: FloatArray, iterations: int = _ITERATIONS) -> tuple[FloatArray, float]:
    """Return the pose nearest to q where all rows hold, and its residual relative to the size.

    Levenberg-Marquardt far away, the shortest Gauss-Newton step near a solution, so that redundant rows and singular
    points do no harm; near a dead centre, where that step goes too far, Levenberg-Marquardt again.

    The residual is that beyond what the rounding of an offset leaves; above CLOSED the pose does not close.

    q: Rough pose, (columns of the part,). u: Driver values, (d,). iterations: at most.
    """
    part = Part(part) if isinstance(part, System) else part
    best, residual, jacobian = _straight(part, q, u)
    damping, too_far, slow = 1e-3, False, 0
    for _ in range(iterations):
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
    largest = float(np.abs(residual).max(initial=0.0))
    return best, max(0.0, largest - offset_rounding(part, best)) if largest > 0.0 else 0.0


def offset_rounding(part: Part, q: FloatArray) -> float:
    """Return what the rounding of a pose's offset from the origin leaves of residuals."""
    away = float(np.abs(part.whole(q).reshape(-1, 3)[:, :2]).max(initial=0.0)) / part.system.size
    return min(OFFSET_ROUNDING * away, _TOLERANCE) if away > FAR else 0.0


def closed_up_to(system: System) -> float:
    """Return the residual up to which all rows of a system are closed: redundant rows have a gap in every pose."""
    return CONSISTENT if len(system.rows) > len(system.coordinates) else CLOSED


def _straight(part: Part, q: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray | None]:
    """Return pose, residual and, if known, Jacobian: after a whole Gauss-Newton step if it closes the rows, or at q."""
    residual = part.residual(q, u)
    if np.abs(residual).max(initial=0.0) == 0.0:
        return q.copy(), residual, None
    jacobian = part.jacobian(q)
    there = q + part.column_scales * np.linalg.lstsq(jacobian, -residual, rcond=_RANK)[0]
    left = part.residual(there, u)
    is_linear = np.abs(left).max(initial=0.0) <= 1e-3 * CLOSED
    return (there, left, None) if is_linear else (q.copy(), residual, jacobian)


def motion_samples(part: Part, q: FloatArray, count: int, step: float = 0.2) -> Iterator[FloatArray]:
    """Yield up to `count` poses along the motion that the rows of a part leave, starting with the one nearest to q.

    Random directions of the null space of its Jacobian (seeded), `step` in radians and sizes. Where the motion ends or
    comes to a singular point, where other branches cross, it is followed from the first pose the other way. No pose if
    the rows do not close near q; one pose if they leave no motion. Drivers among the rows are at 0.
    """
    start, gap = close(part, q, np.zeros(len(part.system.mechanism.drivers)))
    if gap > CLOSED:
        return
    yield start
    found = 1
    rng = np.random.default_rng(1989)
    free, least = _freedom(part.jacobian(start))  # (n, free directions)
    least = min(_FAR_FROM_SINGULAR, 0.3 * least)
    first = free @ rng.standard_normal(free.shape[1])
    for direction in (first, -first):
        pose = start
        while found < count:
            free, _ = _freedom(part.jacobian(pose))
            if free.shape[1] == 0:  # all held, also where a singular start has been left
                break
            direction = free @ (free.T @ direction) + 0.3 * free @ rng.standard_normal(free.shape[1])
            direction /= np.abs(direction).max()
            onward = _onward(part, pose, free, direction, step, least)
            if onward is None:
                break
            pose = onward
            found += 1
            yield pose


def _onward(
    part: Part, pose: FloatArray, free: FloatArray, direction: FloatArray, step: float, least: float
) -> FloatArray | None:
    """Return a pose one step, or as much of it as possible, in a free direction; None where the motion ends.

    It is not singular (`least`: see _freedom) and on the same branch, where the motion goes on in that direction.
    """
    u = np.zeros(len(part.system.mechanism.drivers))
    along = direction / np.linalg.norm(direction)
    while step > 1e-3:
        ahead, gap = close(part, pose + step * part.column_scales * direction, u)
        if gap <= CLOSED:
            there, regular = _freedom(part.jacobian(ahead))
            more = there.shape[1] - free.shape[1]  # directions: less than 0 where a singular pose is left
            if regular >= least and (more < 0 or (more == 0 and np.linalg.norm(there.T @ along) >= _SAME_DIRECTION)):
                return ahead
        step /= 2.0
    return None


def _freedom(jacobian: FloatArray) -> tuple[FloatArray, float]:
    """Return the null space of a Jacobian (n, k), and the least of its other singular values over the largest."""
    _, singular, right = np.linalg.svd(jacobian)
    relative = singular / singular.max(initial=1e-300)
    rank = int((relative > _RANK).sum())
    return np.asarray(right[rank:].T), float(relative[:rank].min(initial=1.0))


def null_space(matrix: FloatArray, small: float = _RANK) -> FloatArray:
    """Return an orthonormal basis of the directions that a matrix maps to (nearly) zero, (n, k)."""
    _, singular, right = np.linalg.svd(matrix)
    rank = int((singular > small * singular.max(initial=0.0)).sum())
    return np.asarray(right[rank:].T)


def followed(
    system: System, q: FloatArray, u: FloatArray, target: FloatArray, trust: float | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return a pose followed along a straight line of driver values to `target`, or to its limit, and the values there.

    Steps are predicted to second order. trust: the margin over the largest correction of a prediction, so that no
    other branch is that near, and the end is where the margin has halved, where rows hold the driver, or after a number
    of steps that falls with the size of the system; None: any branch will do where branches cross.
    """
    whole, scales = Part(system), system.column_scales
    way, at_rest = target - u, np.zeros(len(target))
    length = float(np.abs(way / reaches(system)).max())
    if length == 0.0:
        return q, u
    done, step = 0.0, min(1.0, _LONGEST / length)
    here = first = there = margin(system, q) if trust else 0.0
    shortest = max(_ROUNDED, _CLOSEST * here * here) if trust else _SHORTEST
    trials = max(_LEAST_TRIALS, min(_MOST_TRIALS, affordable(len(q)))) if trust else -1
    while done < 1.0 and trials and (step == 1.0 or step * length >= shortest):  # a way of round-off is one step
        trials -= 1
        step = min(step, 1.0 - done)
        ahead = target if step == 1.0 - done else u + step * way
        jacobian = whole.jacobian(q)
        speeds = system.nu(q, u, step * way) / whole.row_scales
        qd = np.linalg.lstsq(jacobian, speeds, rcond=_RANK)[0]
        if trust and np.linalg.norm(jacobian @ qd - speeds) > _HELD * np.linalg.norm(speeds):
            break
        qd = scales * qd
        gamma = system.gamma(q, qd, u, step * way, at_rest)
        qdd = scales * np.linalg.lstsq(jacobian, gamma / whole.row_scales, rcond=_RANK)[0]
        predicted = q + qd + 0.5 * qdd
        corrected, allowed = np.inf, _CORRECTION
        if np.abs((predicted - q) / scales).max() <= _LONGEST * _STEEPEST:
            trial, gap = close(whole, predicted, ahead, _CORRECTIONS if trust else _ITERATIONS)
            if gap <= closed_up_to(system):
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


def affordable(coordinates: int) -> int:
    """Return the number of steps of all rows at once that take about as long as one answer may."""
    return int(_WORK / coordinates**3)


def reaches(system: System) -> FloatArray:
    """Return one unit of each driver, (d,): a radian, or the mechanism's size."""
    is_angle = [driver.quantity.kind == "angle" for driver in system.mechanism.drivers]
    return np.where(is_angle, 1.0, system.size)


def dependent_rows(gradients: FloatArray) -> dict[int, list[int]]:
    """Return rows that are combinations of earlier rows, each with the earlier independent rows that it needs."""
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
            weights = parts
            for k in range(count - 1, -1, -1):  # backward substitution
                weights[k] /= triangle[k, k]
                weights[:k] -= weights[k] * triangle[:k, k]
            dependent[index] = [
                row for row, weight in zip(independent, weights, strict=True) if abs(weight) > _DEPENDENT
            ]
    return dependent


def branches(system: System, singular: FloatArray, u: FloatArray) -> list[FloatArray]:
    """Return closed poses at driver values u near a singular pose, nearest first: one per branch that leaves it.

    Of a large system only those in the directions that are held least.
    """
    few = affordable(len(singular))
    free = null_space(system.scaled_jacobian(singular), 1e-4)[:, -max(_LEAST_DIRECTIONS, few) :]
    iterations = max(_LEAST_ITERATIONS, min(_ITERATIONS, 4 * few))
    starts = [singular] + [
        singular + side * system.column_scales * direction for direction in free.T for side in (-0.2, 0.2)
    ]
    found: list[tuple[float, FloatArray]] = []
    for start in starts:
        pose, gap = close(system, start, u, iterations)
        away = float(np.abs((pose - singular) / system.column_scales).max())
        new = all(np.abs((pose - other) / system.column_scales).max() > _APART for _, other in found)
        if gap <= closed_up_to(system) and away < 1.0 and new:
            found.append((away, pose))
    return [pose for _, pose in sorted(found, key=lambda item: item[0])]


def margin(system: System, q: FloatArray) -> float:
    """Return the smallest over the largest singular value of the scaled Jacobian of all rows: 0 at a singular point."""
    singular = np.linalg.svd(system.scaled_jacobian(q), compute_uv=False)
    return float(singular[-1] / singular[0]) if len(singular) == len(system.coordinates) else 0.0
