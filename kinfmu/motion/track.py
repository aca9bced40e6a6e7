"""Tracks: a quantity with its first and second derivative at the samples of a motion, for one design or for many.

Between two samples a track is the polynomial of degree 5 with the values and derivatives of both (Hermite).
Extremes and crossings of a level are those of the polynomials, not of the samples.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinfmu.equations.taylor import Taylor

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
FEWEST = 3  # samples that an estimate of a third derivative needs
_STEPS = 60  # of a root in its interval; Newton needs a few of them, halving at most 53
_NEAR = 1e-9  # of the smallest distance of samples; a part begins at a sample that is closer
_SAME = 1e-15  # of an interval; roots closer than this are equal


class Extreme(NamedTuple):
    """The largest or smallest value of each design, and the argument where it occurs: both (...)."""

    value: FloatArray
    x: FloatArray


@dataclass(frozen=True, eq=False)
class Track:
    """A quantity over a motion.

    Attributes:
        x: (n,) ascending arguments: time, or the value of a driver.
        value: (..., n) the quantity; leading axes are designs.
        rate: (..., n) its derivative by x.
        acceleration: (..., n) its second derivative by x.
        is_closed: True if the motion goes round: the last sample is the first, after one period.

    """

    x: FloatArray
    value: FloatArray
    rate: FloatArray
    acceleration: FloatArray
    is_closed: bool = False

    @classmethod
    def of(cls, like: Track, quantity: Taylor) -> Track:
        """Return a quantity computed from the tracks of a motion as a track of the same motion."""
        parts = (np.asarray(part, float) for part in (quantity.f, quantity.d1, quantity.d2))
        shape = np.broadcast_shapes(*(np.shape(part) for part in (quantity.f, quantity.d1, quantity.d2)), like.x.shape)
        value, rate, acceleration = (np.broadcast_to(part, shape) for part in parts)
        return cls(like.x, value, rate, acceleration, like.is_closed)

    @property
    def taylor(self) -> Taylor:
        """The track as a number with two derivatives, with which formulas compute."""
        return Taylor(self.value, self.rate, self.acceleration)

    @property
    def span(self) -> float:
        """Length of the motion, the period of one that goes round."""
        return float(self.x[-1] - self.x[0])

    @property
    def is_known(self) -> NDArray[np.bool_]:
        """(...) True for the designs in which every sample has numbers."""
        return np.asarray(np.logical_and.reduce([np.isfinite(row).all(axis=-1) for row in self.rows]))

    @property
    def rows(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Value, rate and acceleration."""
        return self.value, self.rate, self.acceleration

    def negative(self) -> Track:
        """Return the track of the negative quantity."""
        return Track.of(self, -self.taylor)

    def derivative(self) -> Track:
        """Return the track of the first derivative.

        Its own second derivative is estimated from three neighbouring samples, with an error of order h^6 (h: distance
        of the samples): the polynomial of degree 8 with their values, rates and accelerations.
        """
        third, _ = self._third_and_fourth()
        return Track(self.x, self.rate, self.acceleration, third, self.is_closed)

    def second_derivative(self) -> Track:
        """Return the track of the second derivative; its own derivatives are estimated as in `derivative`."""
        third, fourth = self._third_and_fourth()
        return Track(self.x, self.acceleration, third, fourth, self.is_closed)

    def _third_and_fourth(self) -> tuple[FloatArray, FloatArray]:
        """Return the third and fourth derivative at the samples.

            f(x_0 + d) = f_0 + v_0 d + a_0 d^2/2 + d^3 g(d):   6 g(0) and 24 g'(0)

        g is the polynomial of degree 5 through two other samples: both neighbours, at an end the next two. Its values
        are sums of the samples' numbers with weights that depend on x only.
        """
        n = len(self.x)
        near, far = np.arange(-1, n - 1), np.arange(1, n + 1)
        near_wraps, far_wraps = np.zeros(n), np.zeros(n)
        if self.is_closed:
            near[0], far[-1] = n - 2, 1
            near_wraps[0], far_wraps[-1] = -1.0, 1.0
        else:
            near[0], far[-1] = 2, n - 3
        turn = self.value[..., -1:] - self.value[..., :1]  # of an angle that goes round
        data, distances = [self.rate, self.acceleration], []
        for other, wraps in ((near, near_wraps), (far, far_wraps)):
            distances.append(self.x[other] - self.x + wraps * self.span)
            change = self.value[..., other] - self.value
            if self.is_closed:
                change += wraps * turn
            data += [change, self.rate[..., other], self.acceleration[..., other]]
        third, fourth = (
            np.asarray(sum(weight * row for weight, row in zip(weights, data, strict=True)))
            for weights in _weights(distances[0], distances[1])
        )
        return third, fourth

    def at(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return value, rate and acceleration at arguments.

        Args:
            x: (k,) equal for all designs, or (..., k) with the designs' leading axes.

        Returns:
            Three arrays (..., k). Arguments outside the motion are taken in the first or last interval.

        """
        k = np.clip(np.searchsorted(self.x, x, side="right") - 1, 0, len(self.x) - 2)
        h = self.x[k + 1] - self.x[k]

        def ends(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
            if k.ndim == 1:
                return rows[..., k], rows[..., k + 1]
            return np.take_along_axis(rows, k, -1), np.take_along_axis(rows, k + 1, -1)

        both = [ends(rows) for rows in self.rows]
        c = _quintic([low for low, _ in both], [high for _, high in both], h)
        s = (x - self.x[k]) / h
        c1 = _derived(c)
        return _polynomial(c, s), _polynomial(c1, s) / h, _polynomial(_derived(c1), s) / h**2

    def part(self, begin: float, end: float) -> Track:
        """Return the track between two arguments; of a motion that goes round also across its end.

        Args:
            begin: First argument.
            end: Last argument, at most one period after `begin`.

        """
        whole = self
        if self.is_closed and end > self.x[-1]:
            turn = self.value[..., -1:] - self.value[..., :1]
            turns = (turn, 0.0 * turn, 0.0 * turn)
            rows = [np.concatenate([row, row[..., 1:] + more], -1) for row, more in zip(self.rows, turns, strict=True)]
            whole = Track(np.concatenate([self.x, self.x[1:] + self.span]), rows[0], rows[1], rows[2])
        least = _NEAR * float(np.min(np.diff(self.x)))
        first, last = np.searchsorted(whole.x, begin + least, "right"), np.searchsorted(whole.x, end - least, "left")
        x = np.concatenate([[begin], whole.x[first:last], [end]])
        rows = []
        for at, row in zip(whole.at(np.array([begin, end])), whole.rows, strict=True):
            part = np.empty((*row.shape[:-1], len(x)))  # samples one after another, however the whole is stored
            part[..., 0], part[..., 1:-1], part[..., -1] = at[..., 0], row[..., first:last], at[..., 1]
            rows.append(part)
        return Track(x, rows[0], rows[1], rows[2])

    def maximum(self) -> Extreme:
        """Return the largest value of each design and where it occurs; NaN for designs with unknown samples."""
        flat = self.value.reshape(-1, len(self.x))
        rates, accelerations = (rows.reshape(flat.shape) for rows in (self.rate, self.acceleration))
        known = self.is_known.reshape(-1)
        h = np.diff(self.x)
        k = np.argmax(flat, axis=1)  # of unknown samples the first
        value, x = np.take_along_axis(flat, k[:, None], 1)[:, 0].copy(), self.x[k]
        design, place = np.nonzero(self._may_peak(rates, accelerations) & known[:, None])
        low, high = ([rows[design, place + side] for rows in (flat, rates, accelerations)] for side in (0, 1))
        reach = np.maximum(low[0], high[0]) + h[place] * np.maximum(np.abs(low[1]), np.abs(high[1]))
        can_win = reach >= value[design]  # most intervals end far below the largest sample
        design, place = design[can_win], place[can_win]
        low, high = ([row[can_win] for row in side] for side in (low, high))
        c = _quintic(low, high, h[place])
        c1 = _derived(c)
        for begin, end in _peak_brackets(c):
            is_peak = (_polynomial(c1, begin) > 0.0) & (_polynomial(c1, end) < 0.0)
            s = _root(c1[:, is_peak], begin[is_peak], end[is_peak])
            at = self.x[place[is_peak]] + s * h[place[is_peak]]
            _keep_largest(value, x, design[is_peak], _polynomial(c[:, is_peak], s), at)
        value[~known], x = np.nan, np.where(known, x, np.nan)
        shape = self.value.shape[:-1]
        return Extreme(value.reshape(shape), x.reshape(shape))

    def minimum(self) -> Extreme:
        """Return the smallest value of each design and where it occurs; NaN for designs with unknown samples."""
        value, x = self.negative().maximum()
        return Extreme(-value, x)

    def largest_size(self) -> Extreme:
        """Return the largest absolute value of each design and where it occurs."""
        high, low = self.maximum(), self.minimum()
        is_low = -low.value > high.value
        return Extreme(np.where(is_low, -low.value, high.value), np.where(is_low, low.x, high.x))

    @staticmethod
    def _may_peak(v: FloatArray, a: FloatArray) -> NDArray[np.bool_]:
        """Return (designs, n - 1), True for intervals in which the polynomial may have a maximum.

        Its slope changes sign from plus to minus between the ends, or dips below 0 between two positive (rises above it
        between two negative) ones.
        """
        rises, falls, bends_up, bends_down = v > 0.0, v < 0.0, a > 0.0, a < 0.0
        left, right = np.s_[:, :-1], np.s_[:, 1:]
        crosses = rises[left] & falls[right]
        dips = ~(falls[left] | falls[right] | bends_up[left] | bends_down[right]) & (bends_down[left] | bends_up[right])
        tops = ~(rises[left] | rises[right] | bends_down[left] | bends_up[right]) & (bends_up[left] | bends_down[right])
        may_peak: NDArray[np.bool_] = crosses | dips | tops
        return may_peak

    def crossings(self, level: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return where the quantity takes a value.

        Args:
            level: (...) the value for each design.

        Returns:
            The numbers of the designs, counted over all leading axes, and the arguments, both (crossings,).

        """
        flat = (self.value - level[..., None]).reshape(-1, len(self.x))
        rates, accelerations = (rows.reshape(flat.shape) for rows in (self.rate, self.acceleration))
        h = np.diff(self.x)
        is_above = flat >= 0.0
        design, place = np.nonzero((is_above[:, 1:] != is_above[:, :-1]) & self.is_known.reshape(-1)[:, None])
        low, high = ([rows[design, place + side] for rows in (flat, rates, accelerations)] for side in (0, 1))
        s = _root(_quintic(low, high, h[place]), np.zeros(len(design)), np.ones(len(design)))
        x = self.x[place] + s * h[place]
        if self.is_closed:  # a crossing at the end itself is hidden where rounding puts its two samples on other sides
            is_equal = np.abs(flat[:, -1] - flat[:, 0]) <= _NEAR * np.ptp(flat, axis=1)
            hidden = np.flatnonzero(is_equal & (is_above[:, -1] != is_above[:, 0]))
            design, x = np.append(design, hidden), np.append(x, np.full(len(hidden), self.x[-1]))
        return design, x

    def stay(self, band: float) -> tuple[FloatArray, FloatArray]:
        """Return where the quantity enters and leaves the band below its maximum, around the place of the maximum.

        Args:
            band: Height of the band.

        Returns:
            Two arguments for each design: those of the first crossings before and after the maximum, or the ends of the
            motion; of a motion that goes round they may lie one period further.

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


def _weights(d_a: FloatArray, d_b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the weights (8, n) of the third and of the fourth derivative.

    They belong to rate and acceleration of a sample, then to change, rate and acceleration of two others at the
    distances d_a and d_b.
    """
    v, a, f_a, v_a, a_a, f_b, v_b, a_b = np.eye(8)[:, :, None]
    sides = []
    for d, f_d, v_d, a_d in ((d_a, f_a, v_a, a_a), (d_b, f_b, v_b, a_b)):
        g = (f_d - v * d - 0.5 * a * d**2) / d**3
        g1 = (v_d - v - a * d - 3.0 * d**2 * g) / d**3
        sides.append([g, g1, (a_d - a - 6.0 * d * g - 6.0 * d**2 * g1) / d**3])
    h = d_b - d_a
    c = _quintic(sides[0], sides[1], h)
    return 6.0 * _polynomial(c, -d_a / h), 24.0 * _polynomial(_derived(c), -d_a / h) / h


def _quintic(low: list[FloatArray], high: list[FloatArray], h: FloatArray) -> FloatArray:
    """Return the coefficients (6, ...) in s = 0 to 1 of the polynomial with value, rate, acceleration at both ends."""
    f, v, a = low[0], low[1] * h, low[2] * h * h
    df = high[0] - f - v - 0.5 * a
    dv = high[1] * h - v - a
    da = high[2] * h * h - a
    return np.stack(
        np.broadcast_arrays(
            f, v, 0.5 * a, 10.0 * df - 4.0 * dv + 0.5 * da, -15.0 * df + 7.0 * dv - da, 6.0 * df - 3.0 * dv + 0.5 * da
        )
    )


def _polynomial(c: FloatArray, s: FloatArray) -> FloatArray:
    value = c[-1]
    for one in c[-2::-1]:
        value = value * s + one
    return np.asarray(value)


def _derived(c: FloatArray) -> FloatArray:
    """Return the coefficients of the derivative by s."""
    return c[1:] * np.arange(1.0, len(c)).reshape(-1, *[1] * (c.ndim - 1))


def _peak_brackets(c: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Return two ranges of s for each polynomial, in each of which the slope changes its sign at most once.

    The interval is cut where the slope has an extreme, unless its ends have slopes of opposite signs.
    """
    c1 = _derived(c)
    c2 = _derived(c1)
    zero, one = np.zeros(c.shape[1]), np.ones(c.shape[1])
    is_whole = _polynomial(c1, zero) * _polynomial(c1, one) < 0.0
    turns = ~is_whole & (_polynomial(c2, zero) * _polynomial(c2, one) < 0.0)
    cut = np.where(is_whole, 1.0, 0.5)
    cut[turns] = _root(c2[:, turns], zero[turns], one[turns])
    return [(zero, cut), (cut, one)]


def _root(c: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return a root of each polynomial between two arguments of opposite signs: by Newton, else by halving."""
    low, high = low.copy(), high.copy()
    c1 = _derived(c)
    is_rising = _polynomial(c, high) > _polynomial(c, low)
    s, is_found = 0.5 * (low + high), np.zeros(low.shape, bool)
    for _ in range(_STEPS):
        value = _polynomial(c, s)
        is_below = (value < 0.0) == is_rising
        low, high = np.where(is_below, s, low), np.where(is_below, high, s)
        slope = _polynomial(c1, s)
        step = s - value / np.where(slope == 0.0, np.inf, slope)
        new = np.where((step >= low) & (step <= high), step, 0.5 * (low + high))
        new = np.where(is_found, s, new)  # so that a root does not depend on the others
        is_found |= np.abs(new - s) <= _SAME
        s = new
        if is_found.all():
            break
    return s


def _keep_largest(value: FloatArray, x: FloatArray, design: IntArray, found: FloatArray, at: FloatArray) -> None:
    """Put the largest of the values found for each design in place of a smaller one."""
    order = np.argsort(found, kind="stable")
    order = order[found[order] > value[design[order]]]  # of several for one design, the last assignment stays
    value[design[order]], x[design[order]] = found[order], at[order]
