"""Limits: driver values where a path ends, and the messages that state where and why."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from .pose import EPS, STEEP, Model, Pose, Vector, directed

MOST_STEPS = 1_000_000  # of a path: seconds, and more than any intended motion
NO_BLOCK, TOO_FAR, NEGATIVE = -1, -2, -3  # in place of a block: no determinant vanishes; too many steps; see VANISHING
VANISHING = 1e-6  # [sizes] of a length that a law gives: where steps end there, it would be negative beyond
FAR_FROM_ORIGIN = 1e6  # [sizes]; rows tied to the world's origin are rounded there to a tenth of the usual tolerance
NO_POLE = -1  # in place of an unknown that runs to infinity
FAR_AWAY = 100.0  # [sizes]; what runs to infinity is at least as far away
AT_POLE = 0.999  # of the distance to a pole; beyond it an unknown is more than a thousand times as far away
STEEPEST_SLOPE, LEAST_SLOPE = -0.8, -0.2  # of z'/z'': -1 / (p + 1) toward a pole of order p, -2 to a dead centre
ROUGHLY, LOCATED = 6, 10  # digits; limits are located to 1e-10 rad
_DEGREE = 57.29577951308232  # degrees in a radian
_LARGE = 1e6  # [rad]; decimals of larger numbers are meaningless
_MORE = 6  # digits that such numbers have before the point


class Limit(NamedTuple):
    """Driver values where a path ends, and the block whose determinant vanishes there (or NO_BLOCK, TOO_FAR, NEGATIVE).

    crosses: another branch crosses there and no bridge holds, so that the motion does not turn back; pole: the unknown
    that runs to infinity there, or NO_POLE.
    """

    u: Vector
    block: int
    crosses: bool = False
    pole: int = NO_POLE


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


def pole_before(
    model: Model,
    before: Pose,
    pose: Pose,
    direction: Vector,
    distance: float,
    derivatives: Callable[[Model, Pose, Vector], tuple[Vector, Vector]] = directed,
    least: float = FAR_AWAY,
) -> Limit | None:
    """Return the pole that lies ahead of a pose within a distance along the path, or None.

    At the distance x from a pole of order p an unknown length grows like 1 / x^p, as that of a slide whose pin's path
    becomes parallel to it. There f = z'/z'' = x / (p + 1) (1 + k x^2), and two poses give f and its slope, so x without
    k. Steps become as short as x^(5/3), and do not pass it.

    derivatives: first and second of z on a straight path; least: how far away [sizes] it must be, 0 where no step is
    left.
    """
    square = sum([d * d for d in direction])
    between = sum([(b - a) * d for a, b, d in zip(before.u, pose.u, direction)]) / square  # noqa: B905  one per driver
    unit = model.REACH[0] if len(direction) == 1 else 1.0
    (old, older), (new, newer) = derivatives(model, before, direction), derivatives(model, pose, direction)
    for k, scale in enumerate(model.UNKNOWN_SCALES):
        is_far = abs(new[k]) * unit > STEEP * scale and new[k] * new[k] > least * scale * abs(newer[k])
        if model.UNKNOWN_IS_ANGLE[k] or not is_far or newer[k] * older[k] * between == 0.0:
            continue
        there, here = old[k] / older[k], new[k] / newer[k]
        slope = (here - there) / between
        if not STEEPEST_SLOPE < slope < LEAST_SLOPE:
            continue
        order = 0.5 * round(-2.0 / slope) - 1.0
        ahead = 1.5 * (there + here) / (2.0 / (order + 1.0) - slope) - 0.5 * between
        if 0.0 < AT_POLE * ahead / distance <= 1.0:
            block = next(number for number, (_, end) in enumerate(model.BLOCKS) if k < end)
            u = tuple([a + ahead * d for a, d in zip(pose.u, direction)])  # noqa: B905  one item per driver
            return Limit(u, block, pole=k)
    return None


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
    elif limit.pole != NO_POLE:
        why = f", where {model.UNKNOWNS[limit.pole]} runs to infinity"
    if limit.crosses and len(target) > 1:
        why += "; the crossing depends on several drivers, so no bridge is built"
    why += rounding_far_from_origin(model)
    if not differs(model, target, limit.u, LOCATED):
        return f"{place(model, target, LOCATED)} cannot be reached: to these digits it is the limit{why}"
    asked = place(model, target, ROUGHLY if differs(model, target, limit.u, ROUGHLY) else LOCATED)
    return f"{asked} cannot be reached: the limit is {place(model, limit.u, LOCATED)}{why}"


def rounding_far_from_origin(model: Model) -> str:
    """Return the end of a message that states how rows tied to the world's origin are rounded; empty near it."""
    off: float = model.ROW_OFFSET
    is_far = off > FAR_FROM_ORIGIN
    return f"; {off:.1e} sizes from the world's origin the rows are rounded to {off * EPS:.1e} sizes" if is_far else ""


def place(model: Model, u: Vector, digits: int = ROUGHLY) -> str:
    """Return driver values as 'crank = 1.047198 rad (60 deg)'; digits: decimals of angles, digits of lengths."""
    parts = []
    for name, kind, value in zip(model.DRIVERS, model.DRIVER_KINDS, u, strict=True):
        if kind == "angle":
            parts.append(f"{name} = {_decimals(value, digits)} rad ({_decimals(value * _DEGREE, digits - 2)} deg)")
        else:
            parts.append(f"{name} = {value:.{digits}g} {model.LENGTH_UNIT}")
    return ", ".join(parts)


def differs(model: Model, a: Vector, b: Vector, digits: int) -> bool:
    """Return whether `place` shows a driver of two places with different digits: of an angle, in rad and in degrees."""
    for kind, first, second in zip(model.DRIVER_KINDS, a, b, strict=True):
        if kind != "angle":
            is_same = f"{first:.{digits}g}" == f"{second:.{digits}g}"
        else:  # in degrees there are fewer digits
            is_same = _decimals(first * _DEGREE, digits - 2) == _decimals(second * _DEGREE, digits - 2)
        if not is_same:
            return True
    return False


def _decimals(value: float, count: int) -> str:
    """Return a number with at most `count` decimals, without zeros at its end."""
    if not -_LARGE < value < _LARGE:
        return f"{value:.{count + _MORE if count > ROUGHLY else count}g}"
    text = f"{value:.{count}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text
