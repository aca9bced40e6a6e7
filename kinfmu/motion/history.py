"""Histories: a quantity with its first and second derivative at the samples of a motion, for one design or for many.

Between two samples a history is the polynomial of degree 5 with the values and derivatives of both (Hermite).
Extremes and crossings of a level are those of the polynomials, not of the samples.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray, IntArray
from kinfmu.motion.quintic import (
    Rows,
    coefficients,
    derived,
    higher_derivatives,
    highest_controls,
    maxima,
    neighbours,
    of_intervals,
    peaks,
    polynomial,
    root,
)
from kinfmu.plan.equations.taylor import Taylor

FEWEST = 3  # samples that an estimate of a third derivative needs
_ROUNDING = 1e-13  # of the range of a quantity
_LEVEL = 0.382  # of the range; where no dwell is likely to be
_REPEATED = 1e-6  # of the range; values that differ by less are the same
_NEAR = 1e-9  # of the smallest distance of samples; a part begins at a sample that is closer


class Extreme(NamedTuple):
    """The largest or smallest value of each design, and the argument where it occurs: both (...)."""

    value: FloatArray
    x: FloatArray


@dataclass(frozen=True, eq=False)
class History:
    """A quantity over a motion.

    Attributes:
        x: (n,) ascending arguments: time, or the value of a driver.
        value: (..., n) the quantity; leading axes are designs.
        rate: (..., n) its derivative by x.
        acceleration: (..., n) its second derivative by x.
        is_closed: True if the motion goes round: the last sample is the first, after one period.
        is_seamed: True if derivatives jump at the ends of a motion that goes round. Inside they jump where two samples
            have the same argument, one for each side.
        is_nonnegative: True for a quantity that is never negative, such as a reduced inertia: then its polynomials are
            read as 0 where rounding or an error of interpolation makes them negative.
        is_root: True for a square root, such as a distance. Where it comes close to 0 it has a kink or a sharp bend;
            there the polynomials of its square are read, which is smooth.

    """

    x: FloatArray
    value: FloatArray
    rate: FloatArray
    acceleration: FloatArray
    is_closed: bool = False
    is_seamed: bool = False
    is_nonnegative: bool = False
    is_root: bool = False

    @classmethod
    def of(cls, like: History, quantity: Taylor) -> History:
        """Return a quantity computed from the histories of a motion as a history of the same motion."""
        parts = [np.asarray(quantity.derivative(order), float) for order in range(3)]
        shape = np.broadcast_shapes(*(part.shape for part in parts), like.x.shape)
        value, rate, acceleration = (np.broadcast_to(part, shape) for part in parts)
        return cls(like.x, value, rate, acceleration, like.is_closed, like.is_seamed)

    @property
    def taylor(self) -> Taylor:
        """The history as a number with two derivatives, with which formulas compute."""
        return Taylor.of(2, *self.rows)

    @property
    def span(self) -> float:
        """Length of the motion, the period of one that goes round."""
        return float(self.x[-1] - self.x[0])

    @cached_property
    def is_linear(self) -> bool:
        """True if the quantity of one design changes at a constant rate."""
        return bool(np.ptp(self.rate) == 0.0) and not np.any(self.acceleration)

    @property
    def is_known(self) -> NDArray[np.bool_]:
        """(...) True for the designs in which every sample has numbers."""
        return np.asarray(np.logical_and.reduce([np.isfinite(row).all(axis=-1) for row in self.rows]))

    @property
    def rows(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Value, rate and acceleration."""
        return self.value, self.rate, self.acceleration

    def samples(self, numbers: IntArray) -> History:
        """Return the history of some of the samples."""
        value, rate, acceleration = (row[..., numbers] for row in self.rows)
        return replace(self, x=self.x[numbers], value=value, rate=rate, acceleration=acceleration)

    def negative(self) -> History:
        """Return the history of the negative quantity."""
        return History.of(self, -self.taylor)

    def derivative(self) -> History:
        """Return the history of the first derivative.

        Its own second derivative is estimated from three neighbouring samples, with an error of order h^6 (h: distance
        of the samples): the polynomial of degree 8 with their values, rates and accelerations.
        """
        _, third, _ = self._higher
        if self.is_root:
            third = np.where(self._is_near_zero, 0.0, third)
        return History(self.x, self.rate, self.acceleration, third, self.is_closed, self.is_seamed)

    def second_derivative(self) -> History:
        """Return the history of the second derivative; its own derivatives are estimated as in `derivative`."""
        _, third, fourth = self._higher
        if self.is_root:
            third, fourth = (np.where(self._is_near_zero, 0.0, one) for one in (third, fourth))
        return History(self.x, self.acceleration, third, fourth, self.is_closed, self.is_seamed)

    @cached_property
    def _higher(self) -> Rows:
        """Second, third and fourth derivative at the samples.

            f(x_0 + d) = f_0 + v_0 d + a_0 d^2/2 + d^3 g(d):   6 g(0) and 24 g'(0)

        g is the polynomial of degree 5 through two other samples: both neighbours, at an end or a break the next two.
        Its values are sums of the samples' numbers with weights that depend on x only.
        """
        wraps = self.is_closed and not self.is_seamed
        near = neighbours_within(self.x, is_closed=wraps)
        found = higher_derivatives(self._flat, weights_at(self.x, is_closed=wraps), is_closed=wraps, neighbours=near)
        shape = self.value.shape
        return found[0].reshape(shape), found[1].reshape(shape), found[2].reshape(shape)

    @property
    def _flat(self) -> Rows:
        """The rows with one axis of designs."""
        n = len(self.x)
        return self.value.reshape(-1, n), self.rate.reshape(-1, n), self.acceleration.reshape(-1, n)

    def at(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return value, rate and acceleration (..., k) at arguments, (k,) or (..., k) for each design.

        Arguments outside the motion are taken in the first or last interval.
        """
        k = np.clip(np.searchsorted(self.x, x, side="right") - 1, 0, len(self.x) - 2)
        h = self.x[k + 1] - self.x[k]

        def ends(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
            if k.ndim == 1:
                return rows[..., k], rows[..., k + 1]
            return np.take_along_axis(rows, k, -1), np.take_along_axis(rows, k + 1, -1)

        both = [ends(rows) for rows in self.rows]
        c = coefficients([low for low, _ in both], [high for _, high in both], h)
        s = (x - self.x[k]) / h
        c1 = derived(c)
        return polynomial(c, s), polynomial(c1, s) / h, polynomial(derived(c1), s) / h**2

    def part(self, begin: float, end: float) -> History:
        """Return the history between two arguments, at most a period apart; if it goes round, also across its end."""
        whole = self
        if self.is_closed and end > self.x[-1]:
            turn = self.value[..., -1:] - self.value[..., :1]
            turns = (turn, 0.0 * turn, 0.0 * turn)
            rows = [np.concatenate([row, row[..., 1:] + more], -1) for row, more in zip(self.rows, turns, strict=True)]
            whole = History(np.concatenate([self.x, self.x[1:] + self.span]), rows[0], rows[1], rows[2])
        _, first, last = cut_places(self.x, begin, end, is_closed=self.is_closed)
        x = np.concatenate([[begin], whole.x[first:last], [end]])
        rows = []
        for at, row in zip(whole.at(np.array([begin, end])), whole.rows, strict=True):
            part = np.empty((*row.shape[:-1], len(x)))  # samples one after another, however the whole is stored
            part[..., 0], part[..., 1:-1], part[..., -1] = at[..., 0], row[..., first:last], at[..., 1]
            rows.append(part)
        value = np.maximum(rows[0], 0.0) if self.is_nonnegative else rows[0]
        return replace(self, x=x, value=value, rate=rows[1], acceleration=rows[2], is_closed=False, is_seamed=False)

    def maximum(self) -> Extreme:
        """Return the largest value of each design and where it occurs; NaN for designs with unknown samples."""
        return self._largest(1.0)[0]

    def minimum(self) -> Extreme:
        """Return the smallest value of each design and where it occurs; NaN for designs with unknown samples."""
        return self._largest(-1.0)[0]

    def extremes(self) -> tuple[Extreme, Extreme]:
        """Return minimum and maximum, found in one pass over the samples."""
        low, high = self._largest(-1.0, 1.0)
        return low, high

    def largest_size(self) -> Extreme:
        """Return the largest absolute value of each design and where it occurs."""
        return larger(*self.extremes())

    def _largest(self, *signs: float) -> list[Extreme]:
        """Return the extremes of these signs: 1 for the maximum, -1 for the minimum."""
        missing = [sign for sign in signs if sign not in self._found]
        if missing:
            shape = self.value.shape[:-1]
            for sign, (value, x) in zip(missing, maxima(self.x, self._flat, missing), strict=True):
                found = (sign * value).reshape(shape)
                self._found[sign] = Extreme(np.maximum(found, 0.0) if self.is_nonnegative else found, x.reshape(shape))
            if self.is_root and self._is_near_zero.any():
                is_near = self._is_near_zero.any(axis=-1)
                for sign, square in zip(missing, self._square._largest(*missing), strict=True):
                    value, x = self._found[sign]
                    root_of = np.sqrt(np.maximum(square.value, 0.0))
                    self._found[sign] = Extreme(np.where(is_near, root_of, value), np.where(is_near, square.x, x))
        return [self._found[sign] for sign in signs]

    @cached_property
    def _is_near_zero(self) -> NDArray[np.bool_]:
        """(..., n) True for samples of a square root from which it reaches 0 within two steps, at its rate there."""
        step = np.max(np.diff(self.x), initial=0.0)
        return np.asarray((self.value == 0.0) | (self.value <= 2.0 * step * np.abs(self.rate)))

    @cached_property
    def _square(self) -> History:
        """The square, which is smooth at 0; samples that are 0 have no rate of their own, but that of a neighbour."""
        rate, acceleration = np.where(self.value == 0.0, 0.0, (self.rate, self.acceleration))
        near = np.abs(np.concatenate([rate[..., 1:2], rate, rate[..., -2:-1]], axis=-1))
        steepest = np.where(self.value == 0.0, np.maximum(near[..., 2:], near[..., :-2]), rate)
        bend = 2.0 * (steepest**2 + self.value * acceleration)
        return History(self.x, self.value**2, 2.0 * self.value * rate, bend, self.is_closed, self.is_seamed)

    @cached_property
    def _found(self) -> dict[float, Extreme]:
        """Extremes that are known, by their signs."""
        return {}

    def crossings(self, level: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return where the quantity takes a value, (...) for each design.

        It returns the numbers of the designs, counted over all leading axes, and the arguments, both (crossings,).
        """
        flat = (self.value - level[..., None]).reshape(-1, len(self.x))
        rows = [flat, *(row.reshape(flat.shape) for row in (self.rate, self.acceleration))]
        h = np.diff(self.x)
        is_above, is_known = flat >= 0.0, self.is_known.reshape(-1)[:, None]
        design, place = np.nonzero((is_above[:, 1:] != is_above[:, :-1]) & is_known)
        c = of_intervals(rows, h, design, place)
        x = self.x[place] + root(c, np.zeros(len(design)), np.ones(len(design))) * h[place]
        for sign in (1.0, -1.0):
            twice, at = _crossings_and_back(self.x, [sign * row for row in rows], is_known)
            design, x = np.append(design, twice), np.append(x, at)
        if self.is_closed:  # a crossing at the end itself is hidden where rounding puts its two samples on other sides
            is_equal = np.abs(flat[:, -1] - flat[:, 0]) <= _NEAR * np.ptp(flat, axis=1)
            hidden = np.flatnonzero(is_equal & (is_above[:, -1] != is_above[:, 0]))
            design, x = np.append(design, hidden), np.append(x, np.full(len(hidden), self.x[-1]))
        return design, x

    def repeats(self) -> IntArray:
        """Return (...) how many times the quantity of a motion that goes round repeats on the way: once or more.

        It does so k times if it rises k times through a level, or k times a whole number, and has the same values one
        k-th of the period later.
        """
        low, high = self.extremes()
        shape = self.value.shape[:-1]
        level = (low.value + _LEVEL * (high.value - low.value)).reshape(-1, 1)
        is_above = self._flat[0][:, :-1] >= level
        rises = np.count_nonzero(is_above & ~np.roll(is_above, 1, axis=1), axis=1)
        found = np.ones(len(rises), dtype=int)
        for design in np.flatnonzero(rises > 1).tolist():
            own = self.of_designs(np.array([design]))
            within = _REPEATED * float(np.ptp(own.value))
            for count in range(int(rises[design]), 1, -1):
                later = self.x + self.span / count
                later = np.where(later > self.x[-1], later - self.span, later)
                if rises[design] % count == 0 and (np.abs(own.at(later)[0] - own.value) <= within).all():
                    found[design] = count
                    break
        return found.reshape(shape)

    def of_designs(self, numbers: IntArray) -> History:
        """Return the history of some designs, counted over all leading axes; each may be there more than once."""
        value, rate, acceleration = (row[numbers] for row in self._flat)
        return replace(self, value=value, rate=rate, acceleration=acceleration)

    def stay(self, band: float) -> tuple[FloatArray, FloatArray]:
        """Return where the quantity enters and leaves the band below its maximum, around the place of the maximum.

        band: its height. These are two arguments for each design: the first crossings before and after the maximum, or
        the ends of the motion; of a motion that goes round they may lie one period further.
        """
        highest = self.maximum()
        top = highest.x.reshape(-1)
        design, x = self.crossings(highest.value - band)
        start, stop = np.full_like(top, -np.inf), np.full_like(top, np.inf)
        shifts = (-self.span, 0.0, self.span) if self.is_closed else (0.0,)
        for shift in shifts:
            is_before = x + shift <= top[design]
            np.maximum.at(start, design[is_before], (x + shift)[is_before])
            np.minimum.at(stop, design[~is_before], (x + shift)[~is_before])
        start, stop = np.where(start == -np.inf, self.x[0], start), np.where(stop == np.inf, self.x[-1], stop)
        known, shape = np.isfinite(top), highest.x.shape
        return tuple(np.where(known, one, np.nan).reshape(shape) for one in (start, stop))  # type: ignore[return-value]


def larger(low: Extreme, high: Extreme) -> Extreme:
    """Return the largest absolute value of each design, of minimum and maximum, and where it occurs."""
    is_low = -low.value > high.value
    return Extreme(np.where(is_low, -low.value, high.value), np.where(is_low, low.x, high.x))


def cut_places(x: FloatArray, begin: float, end: float, *, is_closed: bool) -> tuple[FloatArray, int, int]:
    """Return where a part of a motion is cut out of its samples.

    Args:
        x: (n,) arguments of the motion.
        begin: First argument of the part.
        end: Last argument of the part; of a motion that goes round also in the next period.
        is_closed: The motion goes round.

    Returns:
        Arguments of the motion, with those of the next period if the part reaches into it; the first sample after
        the begin, and the first one that is not before the end.

    """
    whole = np.concatenate([x, x[1:] + (x[-1] - x[0])]) if is_closed and end > x[-1] else x
    steps = np.diff(x)
    least = _NEAR * float(np.min(steps[steps > 0.0]))
    first, last = np.searchsorted(whole, begin + least, "right"), np.searchsorted(whole, end - least, "left")
    return whole, int(first), int(last)


def _crossings_and_back(
    x: FloatArray, rows: list[FloatArray], is_known: NDArray[np.bool_]
) -> tuple[IntArray, FloatArray]:
    """Return where rows (m, n) below 0 at two neighbouring samples are above 0 between them, as `crossings` does."""
    h, (f, _, _) = np.diff(x), rows
    is_below = is_known & (f < 0.0)
    design, place = np.nonzero(is_below[:, 1:] & is_below[:, :-1] & (highest_controls(h, rows) > 0.0))
    least = _ROUNDING * np.ptp(f, axis=1)[design]
    c = of_intervals(rows, h, design, place)
    found: tuple[list[IntArray], list[FloatArray]] = [np.empty(0, int)], [np.empty(0)]
    for which, s in peaks(c):
        is_above = polynomial(c[:, which], s) > least[which]
        chosen, top = np.flatnonzero(which)[is_above], s[is_above]
        for low, high in ((np.zeros_like(top), top), (top, np.ones_like(top))):
            found[0].append(design[chosen])
            found[1].append(x[place[chosen]] + root(c[:, chosen], low, high) * h[place[chosen]])
    return np.concatenate(found[0]), np.concatenate(found[1])


def neighbours_within(x: FloatArray, *, is_closed: bool) -> tuple[IntArray, IntArray]:
    """Return the neighbours of samples; at a break, which is two samples with the same argument, those of one side."""
    near, far = neighbours(len(x), is_closed=is_closed)
    before = np.flatnonzero(np.diff(x) == 0.0)
    near[before], far[before] = before - 1, before - 2
    near[before + 1], far[before + 1] = before + 2, before + 3
    return near, far


def weights_at(x: FloatArray, *, is_closed: bool) -> tuple[FloatArray, FloatArray]:
    """Return the weights (8, n) of the third and of the fourth derivative at arguments (n,), as `_weights` does."""
    return _weights(x.tobytes(), is_closed=is_closed)


@lru_cache(maxsize=8)
def _weights(arguments: bytes, *, is_closed: bool) -> tuple[FloatArray, FloatArray]:
    """Return the weights (8, n) of the third and of the fourth derivative at n arguments, as bytes.

    They belong to rate and acceleration of a sample, then to change, rate and acceleration of two others at the
    distances d_a and d_b.
    """
    x = np.frombuffer(arguments)
    near, far = neighbours_within(x, is_closed=is_closed)
    d_a, d_b = x[near] - x, x[far] - x
    if is_closed:
        d_a[0] -= x[-1] - x[0]
        d_b[-1] += x[-1] - x[0]
    v, a, f_a, v_a, a_a, f_b, v_b, a_b = np.eye(8)[:, :, None]
    sides = []
    for d, f_d, v_d, a_d in ((d_a, f_a, v_a, a_a), (d_b, f_b, v_b, a_b)):
        g = (f_d - v * d - 0.5 * a * d**2) / d**3
        g1 = (v_d - v - a * d - 3.0 * d**2 * g) / d**3
        sides.append([g, g1, (a_d - a - 6.0 * d * g - 6.0 * d**2 * g1) / d**3])
    h = d_b - d_a
    c = coefficients(sides[0], sides[1], h)
    return 6.0 * polynomial(c, -d_a / h), 24.0 * polynomial(derived(c), -d_a / h) / h


_SLOW = 1e-6  # of the largest speed; of two quantities that turn back together both are
_RESTING = 1e-12  # of the largest speed, at a sample


def first_pole(over: History, under: History) -> FloatArray:
    """Return (...) the first place where the ratio of two speeds has no bound, NaN for designs without one."""
    over, under = (
        History.of(one, one.taylor + 0.0 * other.taylor) for one, other in ((over, under), (under, over))
    )  # both with an axis of designs if one has it
    design, x = under.crossings(np.zeros(under.value.shape[:-1]))
    speeds = np.abs(under.value.reshape(-1, len(under.x)))
    resting = np.nonzero(speeds <= _RESTING * speeds.max(axis=1, keepdims=True))
    design, x = np.append(design, resting[0]), np.append(x, under.x[resting[1]])
    own = over.of_designs(design)
    moves = np.abs(own.at(x[:, None])[0][:, 0]) > _SLOW * np.abs(own.value).max(axis=1)
    first = np.full(len(speeds), np.inf)
    np.minimum.at(first, design[moves], x[moves])
    return np.where(np.isfinite(first), first, np.nan).reshape(over.value.shape[:-1])
