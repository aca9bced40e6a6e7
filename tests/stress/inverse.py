"""Mechanisms driven elsewhere than at the bar that their closed form starts from.

The closed form gives every angle over the crank's, psi(theta). Driven at psi, theta is the root of psi(theta) = u on a
stretch where psi rises or falls all the way; where it turns back there is a limit, elsewhere the stretch merely ends.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from tests.stress.drawn import TURN, Pose, Sketch
from tests.stress.jets import LONG, Array, Jet, Numbers
from tests.stress.loops import Closing

FINE = 1440  # places to a turn
SHORTEST = 24  # places of an interval
LEAST_POSITIVE = 0.05  # least value along an interval of what must stay positive
BEYOND, WITHIN = 0.3, 1e-9  # [rad] past a limit; before an end that is no limit
ITERATIONS, MORE_DIGITS, CLOSE = 40, 6, 1e-17

CrankPoses = Callable[[Numbers, Sequence[Jet], Closing], dict[str, Pose]]


class Inverse:
    """theta over psi on one stretch; psi of a body."""

    def __init__(self, poses: CrankPoses, body: str, theta: Array, psi: Array, turns_back: tuple[bool, bool]) -> None:
        self.poses, self.body = poses, body
        self.theta, self.psi = theta, psi  # both in order of rising psi
        self.turns_back = turns_back  # at the least psi, at the largest
        self.slope = float(np.abs(np.diff(np.asarray(psi, float)) / np.diff(np.asarray(theta, float))).max())

    def angle(self, numbers: Numbers, theta: Array) -> Jet:
        """psi with its derivatives in theta, a principal value."""
        d1 = numbers.array(np.ones(len(theta)))
        return self.poses(numbers, [Jet(numbers, theta, d1, 0 * d1)], Closing())[self.body].phi

    def reach(self) -> tuple[float, float]:
        """Values of psi to examine: past the interval if its end is a limit, and just before its end otherwise."""
        low, high = (float(value) for value in (self.psi[0], self.psi[-1]))
        past = [BEYOND if turns_back else -WITHIN for turns_back in self.turns_back]
        return low - past[0], high + past[1]

    def at(self, u: Jet, closing: Closing) -> Jet:
        """theta as a jet where psi is u; past a limit no number."""
        numbers = u.numbers
        theta = self._quick(u.d0)
        if numbers is not LONG:
            theta = numbers.array(np.asarray(theta, dtype=float))
            for _ in range(MORE_DIGITS):
                psi = self.angle(numbers, theta)
                theta = theta - _wrapped(numbers, psi.d0 - u.d0) / psi.d1
        psi = self.angle(numbers, theta)
        d1 = u.d1 / psi.d1
        rate = psi.d1 * (1 if self.theta[-1] > self.theta[0] else -1) / self.slope
        closing.limits.append(np.where(np.isnan(np.asarray(theta, dtype=float)), -1.0, rate * abs(rate)))
        closing.sines.append(rate)
        return Jet(numbers, theta, d1, (u.d2 - psi.d2 * d1 * d1) / psi.d1)

    def _quick(self, u: Array) -> Array:
        """theta in long doubles: Newton held between places of the stretch."""
        if u.dtype != np.longdouble:
            u = LONG.array([float(value) for value in u])
        k = np.clip(np.searchsorted(self.psi, u) - 1, 0, len(self.psi) - 2)
        left, right = self.theta[k], self.theta[k + 1]  # psi too small, too large
        theta = left + (right - left) * (u - self.psi[k]) / (self.psi[k + 1] - self.psi[k])
        inside = (u >= self.psi[0]) & (u <= self.psi[-1])
        open_ = np.flatnonzero(inside)
        for _ in range(ITERATIONS):
            psi = self.angle(LONG, theta[open_])
            off = _wrapped(LONG, psi.d0 - u[open_])
            left[open_] = np.where(off <= 0, theta[open_], left[open_])
            right[open_] = np.where(off >= 0, theta[open_], right[open_])
            ahead = theta[open_] - off / psi.d1
            is_between = (ahead - left[open_]) * (ahead - right[open_]) <= 0
            ahead = np.where(is_between, ahead, 0.5 * (left[open_] + right[open_]))
            is_done = np.abs(ahead - theta[open_]) <= CLOSE
            theta[open_] = ahead
            open_ = open_[~is_done]
            if len(open_) == 0:
                break
        return np.where(inside, theta, np.longdouble("nan"))


def _wrapped(numbers: Numbers, angle: Array) -> Array:
    turns = np.rint(np.asarray(angle, dtype=float) / TURN)
    return angle - numbers.array(np.nan_to_num(turns)) * (2 * numbers.pi)


def driven_at(sketch: Sketch, body: str, chosen: float) -> Sketch | None:
    """A sketch whose driver is the angle of another body, on one of its stretches, or None if it has none.

    chosen: 0 to 1, which stretch.
    """
    theta = LONG.array(np.linspace(0.0, TURN, FINE + 1))
    closing = Closing()
    with np.errstate(all="ignore"):
        one = LONG.array(np.ones(FINE + 1))
        psi = sketch.poses(LONG, [Jet(LONG, theta, one, 0 * one)], closing)[body].phi
        lowest = np.minimum.reduce([*closing.limits, one])
        rising = np.where(lowest > LEAST_POSITIVE, np.sign(psi.d1), 0.0)
    edges = np.flatnonzero(np.diff(rising) != 0) + 1
    pieces = [p for p in np.split(np.arange(FINE + 1), edges) if len(p) >= SHORTEST and rising[p[0]] != 0]
    if not pieces:
        return None
    piece = pieces[int(chosen * len(pieces))]
    sign = rising[piece[0]]
    ends, turns_back = [], []
    for last, beyond in ((piece[0], piece[0] - 1), (piece[-1], piece[-1] + 1)):
        is_limit = 0 <= beyond <= FINE and rising[beyond] == -sign
        turns_back.append(bool(is_limit))
        ends.append(_turning(sketch.poses, body, theta[last], theta[beyond]) if is_limit else theta[last])
    stretch = np.unique(np.concatenate([[ends[0]], theta[piece], [ends[1]]]))
    inverse = Inverse(sketch.poses, body, stretch, stretch, (False, False))
    principal = inverse.angle(LONG, stretch).d0
    rounded = np.asarray(principal, dtype=float)
    values = principal + np.rint((np.unwrap(rounded) - rounded) / TURN) * (2 * LONG.pi)
    if sign < 0:
        stretch, values, turns_back = stretch[::-1], values[::-1], turns_back[::-1]
    if not (np.diff(values) > 0).all():
        return None
    inverse = Inverse(sketch.poses, body, stretch, values, (turns_back[0], turns_back[1]))

    def poses(numbers: Numbers, u: Sequence[Jet], closing: Closing) -> dict[str, Pose]:
        moving = sketch.poses(numbers, [inverse.at(u[0], closing)], closing)
        return {**moving, body: Pose(moving[body].at, u[0])}

    return replace(sketch, poses=poses, period=0, marks=(), reach=inverse.reach())


def _turning(poses: CrankPoses, body: str, good: Array, beyond: Array) -> Array:
    """Where psi turns back, to a rounding: its slope changes sign there."""
    inverse = Inverse(poses, body, LONG.array([good, beyond]), LONG.array([0.0, 1.0]), (False, False))
    sign = np.sign(inverse.angle(LONG, LONG.array([good])).d1[0])
    for _ in range(70):
        middle = 0.5 * (good + beyond)
        if np.sign(inverse.angle(LONG, LONG.array([middle])).d1[0]) == sign:
            good = middle
        else:
            beyond = middle
    return good
