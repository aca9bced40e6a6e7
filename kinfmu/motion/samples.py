"""The samples of a motion: their order, the driver's values at them, crowded ones, closed motions, and derivatives."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray, IntArray
from kinfmu.errors import RequestError
from kinfmu.motion.history import History
from kinfmu.motion.quintic import ranges
from kinfmu.run.axis import TIME, HasAxis, axis_of, rates_per

_SAME = 1e-9  # of the travel of the driver; values closer than this are equal
_CLOSE = 0.1  # of the mean distance of samples
_EQUAL = 0.03  # of the largest acceleration; samples that differ by more follow a steep change and are all kept
_ROUNDING = 1e-9  # of the largest rate over the mean distance; the same for accelerations that are 0 but for rounding
_SAME_POSE = 1e-9  # [rad, sizes]; a motion whose first and last pose differ by less goes round
_SAME_RATE = 1e-6  # of the largest; the same for rates and accelerations
_FEW = 5  # samples that show the least range of all
_WIDE, _NARROW = 7, 5  # samples of a polynomial: of degree 6, and of degree 4 to judge it
_WEIGHTS_KEPT = 32  # of polynomials, because many quantities are read at the same arguments
_MOST_KEPT = 10_000  # arguments whose weights are kept
_ROUGH = 1e-3  # of the range of 7 samples; where the rates of both polynomials differ by more in a step, it has a kink
_PERIODIC = 1e-6  # of the range; a quantity whose first and last sample differ by less goes round
Ranges = Callable[[FloatArray], tuple[FloatArray, FloatArray]]  # smallest and largest number of each row (..., n)


class DrivenSamples(NamedTuple):
    """The samples of a motion in order.

    x: (n,) ascending arguments: time, or values of the driver. per: What x is: 'time', 'angle' or 'length'. order: The
    samples as a slice, which may reverse them. driver, drive: The only driver that moves, and its values over x; 'time'
    and None if several move.
    """

    x: FloatArray
    per: str
    order: slice
    driver: str
    drive: History | None


def driven_samples(run: HasAxis) -> DrivenSamples:
    """Return the samples of a run in order.

    Raise a RequestError if they are not in the order of time, or of one driver that has a constant speed.
    """
    x, per = _argument_of(run)
    order = np.s_[:] if x[-1] > x[0] else np.s_[::-1]
    x = x[order]
    if not np.all(np.diff(x) > 0.0):
        raise RequestError("the samples are not in ascending or descending order")
    if len(run.input_names) != 3 and run.axis == TIME:
        return DrivenSamples(x, per, order, TIME, None)
    column = 0 if run.axis == TIME else run.input_names.index(run.axis)
    u, ud, udd = (run.inputs[order, column + k] for k in range(3))
    if per != "time":
        ud, udd = np.ones_like(x), np.zeros_like(x)
    return DrivenSamples(x, per, order, run.input_names[column].driver, History(x, u, ud, udd))


def _argument_of(run: HasAxis) -> tuple[FloatArray, str]:
    """Return the arguments of a run's samples and what they are: 'time', or 'angle' or 'length' of a driver."""
    if run.axis == TIME:
        return run.t, "time"
    per = rates_per(run)
    if run.axis not in run.input_names:
        moved = [name for name in run.input_names[::3] if np.ptp(run.inputs[:, run.input_names.index(name)]) > 0.0]
        if len(moved) == 1:
            raise RequestError(f"measures need values of {moved[0]} that ascend or descend; here some do not")
        changes = "several drivers change" if moved else "no driver moves"
        raise RequestError(f"measures need samples over time or over one driver; here {changes}")
    column = run.input_names.index(run.axis)
    speed = run.inputs[:, column + 1]
    others = np.delete(run.inputs, (column, column + 1, column + 2), axis=1)
    if not (np.all(speed == speed[0]) and speed[0] and not run.inputs[:, column + 2].any()) or np.ptp(others, 0).any():
        raise RequestError(
            f"measures over {axis_of(run).name} need one constant speed other than 0, acceleration 0, "
            f"and other drivers at rest"
        )
    return (run.inputs[:, column], per) if per != "time" else (run.inputs[:, column] / speed[0], per)


def driven_at(drive: History, x: FloatArray) -> FloatArray:
    """Return values of the driver at arguments (...), which may be in the period before or after the motion."""
    if drive.is_linear:
        return np.asarray(drive.rate[0] * x + (drive.value[0] - drive.rate[0] * drive.x[0]))
    span, travel = drive.span, drive.value[-1] - drive.value[0]
    turns = np.floor((x - drive.x[0]) / span) if drive.is_closed else np.zeros_like(x)
    values = drive.at((x - turns * span).reshape(-1))[0].reshape(np.shape(x))
    return np.asarray(np.where(np.isnan(x), np.nan, values + turns * travel))


def within_period(drive: History, values: FloatArray) -> FloatArray:
    """Return values (...) with the end of a motion that goes round replaced by its begin."""
    first, last = drive.value[0], drive.value[-1]
    is_end = drive.is_closed & (np.abs(values - last) <= _SAME * np.abs(last - first))
    return np.asarray(np.where(is_end, first, values))


def window(drive: History, begin: float | None, end: float | None) -> tuple[float, float]:
    """Return the first and last argument between two values of the driver; None: its first or last.

    Raise a RequestError if the driver turns back or does not reach them.
    """
    ends = sorted((float(drive.value[0]), float(drive.value[-1])))
    if not (np.all(drive.rate > 0.0) or np.all(drive.rate < 0.0)):
        raise RequestError("'begin' and 'end' need a driver that moves in one direction")
    limits = [ends[0] if begin is None else begin, ends[1] if end is None else end]
    if drive.is_closed:
        limits[0] = ends[0] + (limits[0] - ends[0]) % (ends[1] - ends[0])
        limits[1] = ends[1] - (ends[1] - limits[1]) % (ends[1] - ends[0])
    for value in limits:
        if not ends[0] <= value <= ends[1]:
            raise RequestError(
                f"the driver does not reach {value:.9g}; the motion goes from {ends[0]:.9g} to {ends[1]:.9g}"
            )
    start, stop = (_argument_at(drive, value) for value in limits)
    if drive.rate[0] < 0.0:
        start, stop = stop, start
    if drive.is_closed and stop <= start:
        stop += drive.span
    if stop <= start:
        raise RequestError(f"'begin' {limits[0]:.9g} must be before 'end' {limits[1]:.9g}")
    return start, stop


def _argument_at(drive: History, value: float) -> float:
    """Return the argument at which a driver that moves in one direction has a value that it reaches."""
    for k in (0, -1):
        if value == drive.value[k]:
            return float(drive.x[k])
    return float(drive.crossings(np.asarray(value))[1][0])


def is_crowded(x: FloatArray) -> bool:
    """Return whether some of the ascending arguments (n,) are much closer than the others; equal ones are breaks."""
    steps = np.diff(x)
    return bool(((steps > 0.0) & (steps < _CLOSE * _mean(x))).any())


def spread(x: FloatArray, rates: FloatArray, accelerations: FloatArray) -> IntArray:
    """Return the numbers of the samples to keep: ends, both sides of breaks, of close and nearly equal ones the first.

    x: (n,) ascending arguments; a break is there twice. rates: (n, m) rates of the outputs. accelerations: (n, m) their
    accelerations. Samples without numbers are kept.
    """
    mean = _mean(x)
    with np.errstate(invalid="ignore"):
        sizes = [np.nanmax(np.abs(table), axis=0, initial=0.0) for table in (accelerations, rates)]
    limit = _EQUAL * sizes[0] + _ROUNDING * sizes[1] / mean
    is_break = np.zeros(len(x), dtype=bool)
    before = np.flatnonzero(np.diff(x) == 0.0)
    is_break[[0, -1, *before, *(before + 1)]] = True
    kept = [0]
    for k in range(1, len(x)):
        while (
            x[k] - x[kept[-1]] < _CLOSE * mean and (np.abs(accelerations[k] - accelerations[kept[-1]]) <= limit).all()
        ):
            if not is_break[k]:
                break
            if is_break[kept[-1]]:
                kept.append(k)
                break
            kept.pop()
        else:
            kept.append(k)
    return np.array(kept)


def _mean(x: FloatArray) -> float:
    return float(x[-1] - x[0]) / (len(x) - 1)


def goes_round(
    histories: Sequence[tuple[History, bool]], is_known: NDArray[np.bool_] | None = None
) -> NDArray[np.bool_]:
    """Return whether motions go round: quantities, rates and accelerations of the last sample are those of the first.

    They are compared with their largest values, of angles and of other quantities.

    (...) True for the designs that go round; False where a sample has no numbers, or nothing moves.

    histories: One or more quantities, each with True if it is an angle, which may be whole turns further. is_known:
    (...) True for the designs whose samples all have numbers: of those a few samples usually show that the motion is
    large enough, and the others are not looked at. Default: every sample is looked at.
    """
    if is_known is not None:
        is_closed = is_known & _ends_agree(histories, _ranges_of_few)
        if (is_closed == is_known).all():
            return np.asarray(is_closed)
    return _ends_agree(histories, ranges)


@np.errstate(invalid="ignore")  # of samples without numbers
def _ends_agree(histories: Sequence[tuple[History, bool]], ranges_of: Ranges) -> NDArray[np.bool_]:
    is_same, moves = np.asarray(True), np.asarray(False)
    for order in range(3):
        scales: dict[bool, FloatArray] = {}
        apart: list[tuple[FloatArray, bool]] = []
        for history, is_angle in histories:
            row = history.rows[order]
            low, high = ranges_of(row)
            is_same = is_same & (low <= high)  # both are NaN where a sample has no numbers
            difference = row[..., -1] - row[..., 0]
            if order == 0:
                moves = moves | (high > low)
                difference -= math.tau * np.round(difference / math.tau) if is_angle else 0.0
            size = high - low if order == 0 else np.maximum(high, -low)
            scales[is_angle] = np.maximum(scales.get(is_angle, np.asarray(1e-300)), size)
            apart.append((np.abs(difference), is_angle))
        for difference, is_angle in apart:
            within = _SAME_RATE * scales[is_angle] if order else _SAME_POSE * (1.0 if is_angle else scales[is_angle])
            is_same = is_same & (difference <= within)
    return np.asarray(is_same & moves)


def _ranges_of_few(table: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return smallest and largest numbers of a few samples: the range of all is at least as large."""
    some = np.moveaxis(table, -1, 0)[:: -(-table.shape[-1] // _FEW)].copy()
    return some.min(axis=0), some.max(axis=0)


def sampled_history(x: FloatArray, value: FloatArray, *, is_closed: bool, is_seamed: bool = False) -> History:
    """Return the history of samples (n,) at x, with the rates of the polynomial of degree 6 through 7 samples.

    Extremes have an error of order h^7 (h: distance of the samples). Where the samples do not follow a smooth curve, at
    jumps and kinks and if they are too few, rates are 0 in the samples, so that extremes are those of samples.

    Args:
        x: (n,) ascending arguments.
        value: (n,) the quantity.
        is_closed: The motion goes round.
        is_seamed: Derivatives jump at its ends. Inside they jump where two samples have the same argument.

    """
    cuts = np.flatnonzero(np.diff(x) == 0.0) + 1
    if not len(cuts):
        return replace(_smooth_history(x, value, is_closed=is_closed and not is_seamed), is_closed=is_closed)
    parts = [(x[a:b], value[a:b]) for a, b in pairwise([0, *cuts.tolist(), len(x)])]
    joins = is_closed and not is_seamed and abs(float(value[-1] - value[0])) <= _PERIODIC * float(np.ptp(value))
    if joins:  # the last part goes on in the first
        (first_x, first), (last_x, last) = parts[0], parts[-1]
        parts[0] = np.concatenate([last_x[:-1] - (x[-1] - x[0]), first_x]), np.concatenate([last[:-1], first])
        del parts[-1]
    histories = [_smooth_history(*part, is_closed=False) for part in parts]
    rows = [np.concatenate([row[k] for row in (history.rows for history in histories)]) for k in (1, 2)]
    if joins:
        count = len(last_x) - 1
        rows = [np.concatenate([row[count:], row[: count + 1]]) for row in rows]
    return History(x, value, rows[0], rows[1], is_closed, is_seamed)


def _smooth_history(x: FloatArray, value: FloatArray, *, is_closed: bool) -> History:
    """Return the history of samples between which no derivative is known to jump."""
    span = float(np.ptp(value)) if len(value) else 0.0
    wraps = is_closed and abs(float(value[-1] - value[0])) <= _PERIODIC * span
    if len(x) <= _WIDE or not np.isfinite(value).all():
        nothing = np.where(np.isfinite(value), 0.0, np.nan)
        return History(x, value, nothing, nothing, is_closed)
    rate, acceleration, extent = _rates(x, value, _WIDE, wraps=wraps)
    narrow, _, _ = _rates(x, value, _NARROW, wraps=wraps)
    step = np.gradient(x)
    is_rough = np.abs(rate - narrow) * step > _ROUGH * extent + 1e-13 * np.abs(value).max()
    near = np.convolve(is_rough, np.ones(_WIDE), "same") > 0.0  # polynomials near a kink see it too
    if wraps:
        near[0] = near[-1] = near[0] or near[-1]
    return History(x, value, np.where(near, 0.0, rate), np.where(near, 0.0, acceleration), is_closed)


def _rates(x: FloatArray, value: FloatArray, count: int, *, wraps: bool) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return first and second derivative of the polynomials through `count` samples, and the range of these."""
    weights_of = _kept_weights if len(x) <= _MOST_KEPT else _weights
    samples, scale, weights = weights_of(x.tobytes(), count, wraps=wraps)
    near = value[samples]
    derivatives = np.einsum("nk,nkd->nd", near - value[:, None], weights)
    return derivatives[:, 0] / scale, derivatives[:, 1] / scale**2, np.ptp(near, axis=1)


def _weights(arguments: bytes, count: int, *, wraps: bool) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return for each of some arguments, as bytes, the samples of its polynomial (n, count), its scale, its weights."""
    x = np.frombuffer(arguments)
    n, half = len(x), count // 2
    offsets = np.arange(-half, half + 1)
    samples: IntArray = np.arange(n)[:, None] + offsets
    turn = np.zeros_like(samples, dtype=float)
    if wraps:  # the last sample is the first
        turn = np.floor(samples / (n - 1)) * (x[-1] - x[0])
        samples = samples % (n - 1)
    else:
        samples = samples - np.minimum(samples[:, :1], 0) - np.maximum(samples[:, -1:] - (n - 1), 0)
    distance = x[samples] + turn - x[:, None]
    scale = np.abs(distance).max(axis=1, keepdims=True)
    powers = (distance / scale)[:, None, :] ** np.arange(count)[None, :, None]
    orders = np.zeros((count, 2))
    orders[1, 0], orders[2, 1] = 1.0, 2.0
    weights = np.linalg.solve(powers, np.broadcast_to(orders, (n, count, 2)))
    return samples, scale[:, 0], weights


_kept_weights = lru_cache(maxsize=_WEIGHTS_KEPT)(_weights)


def lowest(
    x: FloatArray, margin: FloatArray, window: tuple[float, float] | None, *, is_closed: bool
) -> tuple[FloatArray, FloatArray]:
    """Return the smallest margin of the samples in a window, and where it occurs.

    Args:
        x: (n,) arguments of the samples.
        margin: (..., n) their margins.
        window: First and last argument; the last may be in the next period. None: all samples.
        is_closed: True if the motion goes round.

    Raises:
        RequestError: No sample is in the window.

    """
    first, last = window or (x[0], x[-1])
    shifts = (0.0, x[-1] - x[0]) if is_closed else (0.0,)
    repeated = np.concatenate([x + shift for shift in shifts])
    inside = (repeated >= first) & (repeated <= last)
    if not inside.any():
        raise RequestError("no sample of the motion is between 'begin' and 'end'")
    margins = np.concatenate([margin] * len(shifts), axis=-1)[..., inside]
    k = np.argmin(margins, axis=-1)
    value = np.take_along_axis(margins, k[..., None], -1)[..., 0]
    return value, np.where(np.isnan(value), np.nan, repeated[inside][k])
