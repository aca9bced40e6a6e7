"""The line and the circle from which a path deviates least: the largest distance is as small as possible.

The best one touches the path at p + 1 points with equal distances of both signs (p: its parameters). Among the samples
these points are found by exchange (the dual simplex method for the linearized distance), between the samples by Newton.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray, IntArray
from kinfmu.mechanism.quantities.arithmetic import sqrt
from kinfmu.motion.history import History
from kinfmu.plan.equations.taylor import Taylor

_ROUNDS = 5  # of linearizing and exchanging; the line and the circle need two or three
_EXCHANGES = 60  # per round; each makes the smallest possible distance larger
_POLISHES = 12
_NEAR = 0.05  # [rad] from the direction that fits the samples, in which a better one is searched
_SECTIONS = 40  # each leaves 0.62 of the range; the deviation changes with the square of what is left
_GOLDEN = 0.5 * (5.0**0.5 - 1.0)
_STRETCH = 0.7  # logarithm of the radius by the fitted one, within which a better one is searched
_EQUAL = 1e-14  # of the size of the path; distances closer than this are equal


class FittedShape(ABC):
    """A line or a circle for each design, with parameters (..., p)."""

    parameters: FloatArray

    @abstractmethod
    def distance(self, x: Any, y: Any) -> Any:
        """Return the distance of points (..., n) with its sign; also of histories, as Taylor numbers."""

    @abstractmethod
    def basis(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return (..., n, p): the change of the distance per change of the parameters, times -1."""


class Line(FittedShape):
    """A line n.(x, y) = o with n = (-sin theta, cos theta); parameters o and theta."""

    def __init__(self, x: FloatArray, y: FloatArray) -> None:
        dx, dy = x - x.mean(-1, keepdims=True), y - y.mean(-1, keepdims=True)
        theta = 0.5 * np.arctan2(2.0 * (dx * dy).sum(-1), (dx * dx - dy * dy).sum(-1))  # of least squares
        offset = np.cos(theta) * y.mean(-1) - np.sin(theta) * x.mean(-1)
        self.parameters = np.stack([offset, theta], axis=-1)

    def distance(self, x: Any, y: Any) -> Any:
        offset, theta = self.parameters[..., :1], self.parameters[..., 1:]
        return np.cos(theta) * y - np.sin(theta) * x - offset

    def basis(self, x: FloatArray, y: FloatArray) -> FloatArray:
        theta = self.parameters[..., 1:]
        return np.stack([np.ones_like(x), np.cos(theta) * x + np.sin(theta) * y], axis=-1)


class Circle(FittedShape):
    """A circle; parameters radius and centre."""

    def __init__(self, x: FloatArray, y: FloatArray) -> None:
        rows = np.stack([np.ones_like(x), x, y], axis=-1)  # x^2 + y^2 = c + 2 a x + 2 b y, least squares
        c, a, b = np.moveaxis(np.linalg.pinv(rows) @ (x * x + y * y)[..., None], -2, 0)[..., 0]
        a, b = 0.5 * a, 0.5 * b
        self.parameters = np.stack([np.sqrt(np.maximum(c + a * a + b * b, 0.0)), a, b], axis=-1)

    def distance(self, x: Any, y: Any) -> Any:
        radius, a, b = (self.parameters[..., k : k + 1] for k in range(3))
        return _length(x - a, y - b) - radius

    def basis(self, x: FloatArray, y: FloatArray) -> FloatArray:
        _, a, b = (self.parameters[..., k : k + 1] for k in range(3))
        angle = np.arctan2(y - b, x - a)
        return np.stack([np.ones_like(x), np.cos(angle), np.sin(angle)], axis=-1)


def deviation(x: History, y: History, shape: type[Line] | type[Circle]) -> FloatArray:
    """Return the largest distances (...) of paths (..., n) from the line or circle for which they are smallest.

    A line is a circle whose radius grows without bound. Designs with unknown samples have NaN.
    """
    leading = x.value.shape[:-1]
    known = (x.is_known & y.is_known).reshape(-1)
    x, y = (_flat(history, known) for history in (x, y))
    middle = [t.value.mean(-1, keepdims=True) for t in (x, y)]  # small numbers keep more digits
    x, y = (History.of(t, t.taylor - m) for t, m in zip((x, y), middle, strict=True))
    size = np.maximum(np.ptp(x.value, axis=-1), np.ptp(y.value, axis=-1))
    best = shape(x.value, y.value)
    contacts = _exchange(best, x.value, y.value, size)
    fitted = best.parameters
    found = _largest(best, x, y)
    candidates = [_polished(best, x, y, contacts)]
    candidates.append((_turned if isinstance(best, Line) else _along_normal)(fitted, x, y, contacts))
    for candidate in candidates:
        best.parameters = candidate
        found = np.fmin(found, _largest(best, x, y))
    if isinstance(best, Circle):
        is_line = Line(x.value, y.value).distance(x.value, y.value).std(axis=-1) < found  # else no line is better
        if is_line.any():
            x, y = (History(t.x, t.value[is_line], t.rate[is_line], t.acceleration[is_line]) for t in (x, y))
            found[is_line] = np.fmin(found[is_line], deviation(x, y, Line))
    return np.where(known, found, np.nan).reshape(leading)


def _largest(shape: FittedShape, x: History, y: History) -> FloatArray:
    return History.of(x, shape.distance(x.taylor, y.taylor)).largest_size().value


def _flat(history: History, known: NDArray[np.bool_]) -> History:
    """Return a history with one axis of designs, and zeros for designs with unknown samples."""
    value, rate, acceleration = (np.where(known[:, None], row.reshape(-1, len(history.x)), 0.0) for row in history.rows)
    return History(history.x, value, rate, acceleration)


def _length(x: Any, y: Any) -> Any:
    squared = x * x + y * y
    return sqrt(squared) if isinstance(squared, Taylor) else np.sqrt(squared)


def _exchange(shape: FittedShape, x: FloatArray, y: FloatArray, size: FloatArray) -> IntArray:
    """Fit the shape to the samples and return the numbers of those at the largest distance, (designs, p + 1)."""
    count = shape.parameters.shape[-1] + 1
    n = x.shape[-1]
    contacts = np.tile(np.arange(count) * (n - 1) // count, (len(x), 1))
    is_fitted = np.zeros((len(x), 1), bool)
    for _ in range(_ROUNDS):
        errors, basis = shape.distance(x, y), shape.basis(x, y)
        for _ in range(_EXCHANGES):
            at, e = _rows(basis, contacts), np.take_along_axis(errors, contacts, 1)
            weights = np.linalg.svd(np.swapaxes(at, 1, 2))[2][:, -1]  # (designs, count): sum of weight times row is 0
            step, level, signs = _level(at, e, np.where(weights < 0.0, -1.0, 1.0))
            left = errors - (basis @ step[..., None])[..., 0]
            entering = np.argmax(np.abs(left), axis=1)
            worst = np.take_along_axis(left, entering[:, None], 1)[:, 0]
            grows = (np.abs(worst) > level + _EQUAL * size) & ~is_fitted[:, 0]
            if not grows.any():
                break
            signed = np.concatenate([at * signs[..., None], np.ones((*contacts.shape, 1))], axis=-1)
            row = np.where(worst < 0.0, -1.0, 1.0)[:, None] * _rows(basis, entering[:, None])[:, 0]
            of_row = np.concatenate([row, np.ones((len(x), 1))], axis=-1)
            d = (np.linalg.pinv(np.swapaxes(signed, 1, 2)) @ of_row[..., None])[..., 0]
            shares = np.where(d > 0.0, np.abs(weights) / np.where(d > 0.0, d, 1.0), np.inf)
            leaving = np.argmin(shares, axis=1)
            contacts[grows, leaving[grows]] = entering[grows]
        shape.parameters = np.where(is_fitted, shape.parameters, shape.parameters + step)
        is_fitted |= (np.abs(step).max(axis=-1) <= _EQUAL * (1.0 + size))[:, None]
        if is_fitted.all():
            break
    return contacts


def _polished(shape: FittedShape, x: History, y: History, contacts: IntArray) -> FloatArray:
    """Return the parameters with contacts between the samples: extremes of the distance nearest to the samples."""
    at = x.x[contacts]
    low = x.x[np.maximum(contacts - 1, 0)]
    high = x.x[np.minimum(contacts + 1, len(x.x) - 1)]
    for _ in range(_POLISHES):
        px, py = (Taylor.of(2, *t.at(at)) for t in (x, y))
        value, slope, bend = map(shape.distance(px, py).derivative, range(3))
        is_peak = value * bend < 0.0  # elsewhere, as at an end of the path, the distance grows up to the bound
        uphill = np.where(value * slope < 0.0, low, high)
        at = np.where(is_peak, np.clip(at - slope / np.where(is_peak, bend, 1.0), low, high), uphill)
        p_x, p_y = (t.at(at)[0] for t in (x, y))
        basis = shape.basis(p_x, p_y)
        weights = np.linalg.svd(np.swapaxes(basis, 1, 2))[2][:, -1]
        step, _, _ = _level(basis, shape.distance(p_x, p_y), np.where(weights < 0.0, -1.0, 1.0))
        shape.parameters = shape.parameters + step
    return shape.parameters


def _turned(fitted: FloatArray, x: History, y: History, contacts: IntArray) -> FloatArray:
    """Return the lines whose deviation is smallest among directions near the fitted ones, by golden sections.

    The strip around an oval touches it at two points only: two of the three contacts are neighbours. Elsewhere the
    fitted lines are returned.
    """
    is_double = np.diff(np.sort(contacts, axis=1), axis=1).min(axis=1) <= 1
    parameters = fitted.copy()
    if not is_double.any():
        return parameters
    x, y = (t.of_designs(np.flatnonzero(is_double)) for t in (x, y))

    def strip(theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the half width of the strip at an angle, and its offset."""
        across = History.of(x, np.cos(theta)[:, None] * y.taylor - np.sin(theta)[:, None] * x.taylor)
        low, high = (extreme.value for extreme in across.extremes())
        return 0.5 * (high - low), 0.5 * (high + low)

    theta = _least(lambda angle: strip(angle)[0], fitted[is_double, 1] - _NEAR, fitted[is_double, 1] + _NEAR)
    parameters[is_double] = np.stack([strip(theta)[1], theta], axis=-1)
    return parameters


def _least(size: Callable[[FloatArray], FloatArray], low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the arguments (n,) between bounds at which sizes are smallest, by golden sections."""
    for _ in range(_SECTIONS):
        left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
        is_left = size(left) < size(right)
        low, high = np.where(is_left, low, left), np.where(is_left, right, high)
    return np.asarray(0.5 * (low + high))


def _along_normal(fitted: FloatArray, x: History, y: History, contacts: IntArray) -> FloatArray:
    """Return the circles whose ring touches a path at two points of one radius, such as a bent oval.

    Two of the four contacts are then neighbours. The two points have a common normal, on which the centre may be
    anywhere in a range: the best ring is not unique. Elsewhere the fitted circles are returned.
    """
    is_double = np.diff(np.sort(contacts, axis=1), axis=1).min(axis=1) <= 1
    parameters = fitted.copy()
    if not is_double.any():
        return parameters
    x, y = (History(t.x, t.value[is_double], t.rate[is_double], t.acceleration[is_double]) for t in (x, y))
    shape, rows = Circle.__new__(Circle), np.arange(len(x.value))
    shape.parameters = fitted[is_double]
    ends = History.of(x, shape.distance(x.taylor, y.taylor)).extremes()
    at = np.stack([end.x for end in ends], axis=-1)  # of the nearest and the farthest point
    for _ in range(_POLISHES):
        (p_x, v_x, a_x), (p_y, v_y, a_y) = (t.at(at) for t in (x, y))
        d_x, d_y = p_x[:, 1:] - p_x[:, :1], p_y[:, 1:] - p_y[:, :1]
        slope = d_x * v_x + d_y * v_y  # 0 at both points
        sign = np.array([-1.0, 1.0])
        matrix = np.empty((len(rows), 2, 2))
        own = sign * (v_x * v_x + v_y * v_y) + d_x * a_x + d_y * a_y
        across = v_x[:, 0] * v_x[:, 1] + v_y[:, 0] * v_y[:, 1]
        matrix[:, 0, 0], matrix[:, 1, 1], matrix[:, 0, 1], matrix[:, 1, 0] = own[:, 0], own[:, 1], across, -across
        at = np.clip(at - (np.linalg.pinv(matrix) @ slope[..., None])[..., 0], x.x[0], x.x[-1])
    near, far = (np.stack([t.at(at)[0][:, k] for t in (x, y)], axis=-1) for k in (0, 1))
    width = np.linalg.norm(far - near, axis=-1, keepdims=True)
    normal = np.divide(far - near, width, out=np.zeros_like(near), where=width > 0.0)

    def circles(stretch: FloatArray) -> FloatArray:
        """Return the circles with centres on the normal, at a multiple of the fitted radius from its points."""
        radius = fitted[is_double, 0] * np.exp(stretch)
        return np.concatenate([radius[:, None], 0.5 * (near + far) - radius[:, None] * normal], axis=-1)

    def size(stretch: FloatArray) -> FloatArray:
        shape.parameters = circles(stretch)
        return _largest(shape, x, y)

    most = np.full(len(rows), _STRETCH)
    parameters[is_double] = circles(_least(size, -most, most))
    return parameters


def _level(basis: FloatArray, errors: FloatArray, signs: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the step of the parameters that makes the errors equal but for these signs, their size, and the signs."""
    rows = np.concatenate([basis, signs[..., None]], axis=-1)
    solution = (np.linalg.pinv(rows) @ errors[..., None])[..., 0]
    level = solution[:, -1]
    return solution[:, :-1], np.abs(level), np.where(level[:, None] < 0.0, -signs, signs)


def _rows(basis: FloatArray, places: IntArray) -> FloatArray:
    return np.take_along_axis(basis, places[..., None], 1)
