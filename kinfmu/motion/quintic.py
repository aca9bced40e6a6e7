"""Polynomials of degree 5 between samples (Hermite): coefficients, values, roots, extremes; all on arrays.

`quintic.c` has the same arithmetic, operation by operation, so that its numbers are equal to the bit. It is used where
many designs are measured and a compiler is found.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray, IntArray
from kinfmu.codegen.lanes.stage import address_of

Rows = tuple[FloatArray, FloatArray, FloatArray]  # (m, n) values, rates and accelerations of a quantity

_STEPS = 60  # of a root in its interval; Newton needs a few of them, halving at most 53
_SAME = 1e-15  # of an interval; roots closer than this are equal
_compiled: list[ctypes.CDLL] = []  # the library, once it is wanted


@cache
def use_compiled() -> None:
    """Compile `quintic.c` and `extremes.c`, or find them in the cache; many designs are measured by these from then on.

    Raise a CompilerError if there is no compiler, or it fails.
    """
    from kinfmu.codegen.c import compiler

    folder = Path(__file__).parent
    files = {name: (folder / name).read_text("utf-8") for name in ("quintic.c", "extremes.c")}
    library = compiler.load(files, compiler.VECTORIZED)
    place, count, step = ctypes.c_void_p, ctypes.c_int64, ctypes.c_ssize_t
    table = (place, step)
    library.kf_both_extremes.argtypes = (count, count, place, place, *table * 3, place)
    library.kf_higher.argtypes = (count, count, ctypes.c_bool, place, place, *table * 3, place, place)
    library.kf_ranges.argtypes = (count, count, *table, place, place)
    library.kf_both_extremes.restype = library.kf_higher.restype = library.kf_ranges.restype = None
    _compiled.append(library)


def compiled() -> ctypes.CDLL:
    """Return the library that `use_compiled` loaded."""
    return _compiled[0]


def ranges(table: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the smallest and the largest number of each row (..., n); both NaN where one of them is not finite."""
    if not _compiled:
        low, high = table.min(axis=-1), table.max(axis=-1)
        is_known = np.isfinite(low) & np.isfinite(high)
        return np.where(is_known, low, np.nan), np.where(is_known, high, np.nan)
    rows = _by_samples(table.reshape(-1, table.shape[-1]))
    low, high = np.empty(len(rows)), np.empty(len(rows))
    _compiled[0].kf_ranges(*rows.shape, address_of(rows), rows.strides[0] // 8, address_of(low), address_of(high))
    return low.reshape(table.shape[:-1]), high.reshape(table.shape[:-1])


def maxima(x: FloatArray, rows: Rows, signs: Sequence[float]) -> list[tuple[FloatArray, FloatArray]]:
    """Return the largest value of each design and where it occurs; NaN for designs with unknown samples.

    An interval counts if its polynomial can be larger than all samples: no polynomial exceeds its control points
    (Bernstein), which are

        f_0, f_0 + h v_0 / 5, f_0 + 2 h v_0 / 5 + h^2 a_0 / 20   and the same from the other end

    Both are (m,), for each sign.

    x: (n,) arguments. rows: (m, n) values, rates and accelerations. signs: 1 for the largest value of the quantity, -1
    for that of its negative.
    """
    if _compiled:
        return _compiled_maxima(x, rows, signs)
    return [_largest(x, [sign * row for row in rows]) for sign in signs]


def _largest(x: FloatArray, rows: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    f = rows[0]
    is_known = np.logical_and.reduce([np.isfinite(row).all(axis=-1) for row in rows])
    h = np.diff(x)
    k = np.argmax(f, axis=1)  # of unknown samples the first
    value, at = np.take_along_axis(f, k[:, None], 1)[:, 0].copy(), x[k]
    design, place = np.nonzero((highest_controls(h, rows) > value[:, None]) & is_known[:, None])
    c = of_intervals(rows, h, design, place)
    for which, s in peaks(c):
        where = x[place[which]] + s * h[place[which]]
        _keep_largest(value, at, design[which], polynomial(c[:, which], s), where)
    return np.where(is_known, value, np.nan), np.where(is_known, at, np.nan)


def highest_controls(h: FloatArray, rows: Sequence[FloatArray]) -> FloatArray:
    """Return (m, n - 1): the largest of the inner control points of each interval, of the lengths h."""
    f, v, a = rows
    c0 = h * v[:, :-1] * 0.2
    c1 = f[:, :-1] + c0
    c2 = c1 + c0 + h * h * a[:, :-1] * 0.05
    c5 = h * v[:, 1:] * 0.2
    c4 = f[:, 1:] - c5
    c3 = c4 - c5 + h * h * a[:, 1:] * 0.05
    return np.asarray(np.maximum(np.maximum(c1, c2), np.maximum(c3, c4)))


def peaks(c: FloatArray) -> Iterator[tuple[NDArray[np.bool_], FloatArray]]:
    """Yield peaks between s = 0 and 1, at most two of each polynomial: which of them have one, and where."""
    slope = derived(c)
    for begin, end in _peak_brackets(c):
        is_peak = (polynomial(slope, begin) > 0.0) & (polynomial(slope, end) < 0.0)
        yield is_peak, root(slope[:, is_peak], begin[is_peak], end[is_peak])


def higher_derivatives(
    rows: Rows,
    weights: tuple[FloatArray, FloatArray],
    *,
    is_closed: bool,
    neighbours: tuple[IntArray, IntArray],
) -> Rows:
    """Return the third and fourth derivative at the samples, which are sums of numbers of three samples.

    Args:
        rows: (m, n) values, rates and accelerations.
        weights: (8, n) of rate and acceleration of a sample, then of change, rate and acceleration of two others, for
            the third derivative; and the same for the fourth.
        is_closed: The motion goes round: the others are the neighbours; else at an end the next two samples.
        neighbours: The numbers of the two others.

    Returns:
        Second, third and fourth derivatives, (m, n) each.

    """
    near, far = neighbours
    if _compiled and not (np.diff(near[1:-1]) != 1).any():  # it knows no breaks
        return _compiled_higher(rows, weights, is_closed=is_closed)
    value, rate, acceleration = rows
    data = [rate, acceleration]
    for other, end, way in ((near, 0, -1.0), (far, -1, 1.0)):
        change = value[:, other] - value
        if is_closed:
            change[:, end] += way * (value[:, -1] - value[:, 0])  # of an angle that goes round
        data += [change, rate[:, other], acceleration[:, other]]
    third, fourth = (np.asarray(sum(w * row for w, row in zip(ws, data, strict=True))) for ws in weights)
    return acceleration, third, fourth


def neighbours(n: int, *, is_closed: bool) -> tuple[IntArray, IntArray]:
    """Return the numbers of the samples before and after each of n samples; at an open end those of the next two."""
    near, far = np.arange(-1, n - 1), np.arange(1, n + 1)
    near[0], far[-1] = (n - 2, 1) if is_closed else (2, n - 3)
    return near, far


def coefficients(low: list[FloatArray], high: list[FloatArray], h: FloatArray) -> FloatArray:
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


def of_intervals(rows: Sequence[FloatArray], h: FloatArray, design: IntArray, place: IntArray) -> FloatArray:
    """Return the coefficients (6, ...) of intervals of the lengths h, by designs and numbers of the sample before."""
    low, high = ([row[design, place + side] for row in rows] for side in (0, 1))
    return coefficients(low, high, h[place])


def polynomial(c: FloatArray, s: FloatArray) -> FloatArray:
    value = c[-1]
    for one in c[-2::-1]:
        value = value * s + one
    return np.asarray(value)


def derived(c: FloatArray) -> FloatArray:
    """Return the coefficients of the derivative by s."""
    return c[1:] * np.arange(1.0, len(c)).reshape(-1, *[1] * (c.ndim - 1))


def root(c: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return a root of each polynomial between two arguments of opposite signs: by Newton, else by halving."""
    low, high = low.copy(), high.copy()
    c1 = derived(c)
    is_rising = polynomial(c, high) > polynomial(c, low)
    s, is_found = 0.5 * (low + high), np.zeros(low.shape, bool)
    for _ in range(_STEPS):
        value = polynomial(c, s)
        is_below = (value < 0.0) == is_rising
        low, high = np.where(is_below, s, low), np.where(is_below, high, s)
        slope = polynomial(c1, s)
        step = s - value / np.where(slope == 0.0, np.inf, slope)
        new = np.where((step >= low) & (step <= high), step, 0.5 * (low + high))
        new = np.where(is_found, s, new)  # so that a root does not depend on the others
        is_found |= np.abs(new - s) <= _SAME
        s = new
        if is_found.all():
            break
    return s


def _peak_brackets(c: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Return two ranges of s for each polynomial, in each of which the slope changes its sign at most once.

    The interval is cut where the slope has an extreme, unless its ends have slopes of opposite signs.
    """
    c1 = derived(c)
    c2 = derived(c1)
    zero, one = np.zeros(c.shape[1]), np.ones(c.shape[1])
    is_whole = polynomial(c1, zero) * polynomial(c1, one) < 0.0
    turns = ~is_whole & (polynomial(c2, zero) * polynomial(c2, one) < 0.0)
    cut = np.where(is_whole, 1.0, 0.5)
    cut[turns] = root(c2[:, turns], zero[turns], one[turns])
    return [(zero, cut), (cut, one)]


def _keep_largest(value: FloatArray, x: FloatArray, design: IntArray, found: FloatArray, at: FloatArray) -> None:
    """Put the largest of the values found for each design in place of a smaller one."""
    order = np.argsort(found, kind="stable")
    order = order[found[order] > value[design[order]]]  # of several for one design, the last assignment stays
    value[design[order]], x[design[order]] = found[order], at[order]


def _compiled_maxima(x: FloatArray, rows: Rows, signs: Sequence[float]) -> list[tuple[FloatArray, FloatArray]]:
    tables = [_by_samples(row) for row in rows]
    x, h, (m, n) = np.ascontiguousarray(x), np.diff(x), tables[0].shape
    found = np.empty((m, 4))
    places = [part for table in tables for part in (address_of(table), table.strides[0] // 8)]
    _compiled[0].kf_both_extremes(m, n, address_of(x), address_of(h), *places, address_of(found))
    low, low_at, high, high_at = found.T.copy()
    return [(high, high_at) if sign > 0.0 else (-low, low_at) for sign in signs]


def _compiled_higher(rows: Rows, weights: tuple[FloatArray, FloatArray], *, is_closed: bool) -> Rows:
    tables = [_by_samples(row) for row in rows]
    m, n = tables[0].shape
    given = [np.ascontiguousarray(one) for one in weights]
    third, fourth = np.empty((m, n)), np.empty((m, n))
    places = [part for table in tables for part in (address_of(table), table.strides[0] // 8)]
    _compiled[0].kf_higher(m, n, is_closed, *map(address_of, given), *places, address_of(third), address_of(fourth))
    return rows[2], third, fourth


def _by_samples(row: FloatArray) -> FloatArray:
    """Return an array whose samples follow each other in memory."""
    return row if row.strides[1] == 8 and row.strides[0] % 8 == 0 else np.ascontiguousarray(row)
