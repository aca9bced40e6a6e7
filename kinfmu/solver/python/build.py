"""Build: a bridge over a singular point ahead of a regular pose."""

from __future__ import annotations

from .bridge import AGREED, Bridge
from .hermite import weights
from .pose import UNIT_SPEED, Model, Pose, evaluated
from .span import Span, combined
from .trusted_step import follow_path, passes_unseen

HALF_WIDTH = 0.05  # [rad, sizes]; twice as wide loses four digits on the antiparallelogram
NARROWEST = 1e-3  # [rad, sizes]; nodes closer than this have lost the digits that a bridge would gain
FINE = 1e-12  # [rad, sizes]; difference of two widths below which narrower ones gain nothing
STRAIGHT = 0.1  # change of a zero located anew, as a part of the distance ahead: it is as small where there is a zero
STEADY = 0.1  # largest correction of an extrapolation over the determinant: beyond it lies another branch


def build(model: Model, pose: Pose, block: int, zero: float) -> Bridge | None:
    """Return a bridge over the zero of a block's determinant ahead of a regular pose, or None if none is accepted.

    zero: a first estimate. Windows shrink until they hold one point and its six nodes, and both widths agree. Then the
    closing decides: where lengths miss a change point, no narrower window would close. A dead centre gives no bridge:
    the determinant does not fall to zero straight, the far side cannot be reached.
    """
    reach: float = model.REACH[0]
    centre = _located(model, pose, block, zero)
    if centre is None:
        return None
    half, best, apart = HALF_WIDTH * reach, None, AGREED
    while half >= NARROWEST * reach and apart > FINE:
        span = _spanned(model, pose, block, centre, half)
        if span is not None and span.apart() < apart:
            best, apart = span, span.apart()
        half *= 0.5
    if best is None:
        return None
    bridge = Bridge(best)
    return bridge if bridge.closes() else None


def _located(model: Model, pose: Pose, block: int, zero: float) -> float | None:
    """Return where a block's determinant vanishes, by secants from the near side; None if it does not fall straight.

    Towards a dead centre it falls like a square root: the secant's zero is about twice as far as the dead centre.
    """
    reach: float = model.REACH[0]
    step = 0.5 * (zero - pose.u[0])
    is_compared = False  # the first step says nothing: the estimate may stem from the same two places
    while abs(step) > 0.1 * NARROWEST * reach:
        ahead = follow_path(model, pose, pose.u[0] + step)
        if ahead is None:
            step, is_compared = 0.5 * step, False
            continue
        better = secant_zero(pose, ahead, block)
        if better is None or (better - ahead.u[0]) * step <= 0.0:
            return None
        change = abs(better - zero)
        if is_compared and change <= STRAIGHT * abs(better - ahead.u[0]) and change <= 0.2 * NARROWEST * reach:
            return better
        pose, zero, is_compared = ahead, better, True
        step = 0.5 * (zero - pose.u[0])
    return None


def _spanned(model: Model, pose: Pose, block: int, centre: float, half: float) -> Span | None:
    """Return a span of one width over the zero of a block's determinant, built from the side of the pose, or None."""
    side = 1.0 if centre > pose.u[0] else -1.0
    near: list[Pose] = []
    for distance in (4.0, 2.0, 1.0):
        arrived = follow_path(model, near[-1] if near else pose, centre - side * distance * half)
        if arrived is None:
            return None
        near.append(arrived)
    far = _crossed(model, centre, half, side, near)
    if far is None:
        return None
    if near[-1].determinants[block] * far[0].determinants[block] >= 0.0 and block not in model.TALL:
        return None  # the determinant touches zero without crossing it: not a change point of two smooth branches
    return Span(model, centre, half, near + far if side > 0.0 else (near + far)[::-1])


def secant_zero(a: Pose, b: Pose, block: int) -> float | None:
    """Return the driver value where the determinant of a block vanishes on the secant through two poses."""
    rise = b.determinants[block] - a.determinants[block]
    return None if rise == 0.0 else b.u[0] - b.determinants[block] * (b.u[0] - a.u[0]) / rise


def _crossed(model: Model, centre: float, half: float, side: float, near: list[Pose]) -> list[Pose] | None:
    """Return poses at 1, 2, 4 half widths on the far side, each extrapolated from the last and corrected, or None."""
    places = [-4.0, -2.0, -1.0]  # seen in the direction of the crossing
    poses = list(near)
    for distance in (1.0, 2.0, 4.0):
        ahead = weights(tuple(places[-4:]), distance)
        u = (centre + side * distance * half,)
        guess = combined(model, side * half, ahead, poses[-4:])
        try:
            pose = Pose(u, evaluated(model, u, guess, held=0))
        except (ArithmeticError, ValueError):
            return None
        if pose.moved > STEADY * pose.margin:
            return None
        if distance > 1.0 and any(a * b <= 0.0 for a, b in zip(pose.determinants, poses[-1].determinants, strict=True)):
            return None  # there is another zero next to the one to be bridged
        if model.LAW_UNITS and passes_unseen(model, poses[-1], pose, UNIT_SPEED, u[0] - poses[-1].u[0]):
            return None
        places.append(distance)
        poses.append(pose)
    return poses[3:]
