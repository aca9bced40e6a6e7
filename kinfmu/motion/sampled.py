"""Rates of quantities that are known at samples alone, such as forces, from polynomials through neighbours."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from kinfmu.arrays import FloatArray, IntArray
from kinfmu.motion.history import History

_WIDE, _NARROW = 7, 5  # samples of a polynomial: of degree 6, and of degree 4 to judge it
_ROUGH = 1e-3  # of the range of 7 samples; where the rates of both polynomials differ by more in a step, it has a kink
_PERIODIC = 1e-6  # of the range; a quantity whose first and last sample differ by less goes round


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
    wanted = np.zeros((count, 2))
    wanted[1, 0], wanted[2, 1] = 1.0, 2.0
    weights = np.linalg.solve(powers, np.broadcast_to(wanted, (n, count, 2)))
    near = value[samples]
    found = np.einsum("nk,nkd->nd", near - value[:, None], weights)
    return found[:, 0] / scale[:, 0], found[:, 1] / scale[:, 0] ** 2, np.ptp(near, axis=1)
