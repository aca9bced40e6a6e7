"""The argument of a motion, the value of the only driver or time, and where a curve is nearest to given points."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray, IntArray
from kinfmu.errors import MechanismError
from kinfmu.mechanism import Mechanism
from kinfmu.run.driving import run_times
from kinfmu.units import Quantity

SAMPLES = 181  # of the path that untimed points are compared with, over one turn or over the run
CHOICES = ("driver", "time")


@dataclass(frozen=True)
class Argument:
    """What the samples of a motion go by.

    Attributes:
        name: Name of the driver, or 'time'.
        quantity: Of its values.
        input: Name of the driver's input; '' for time.
        begin: Where the motion begins.
        end: Its last value: one turn after `begin`, or the end of the file's run.

    """

    name: str
    quantity: Quantity
    input: str
    begin: float
    end: float

    @property
    def is_turn(self) -> bool:
        """Whether the motion is a turn of the driver."""
        return self.quantity.kind == "angle"

    def keywords(self, values: FloatArray) -> dict[str, Any]:
        """Return the arguments of `Model.solve` and `Model.sensitivities` for these values."""
        return {self.input: values} if self.input else {"t": values}

    def values(self, begin: float | None, end: float | None, count: int = SAMPLES) -> FloatArray:
        """Return samples (count,) from one value to another; default: the whole motion."""
        low = self.begin if begin is None else begin
        high = end if end is not None else self.end if begin is None or not self.is_turn else low + math.tau
        return np.linspace(low, high, count)


def argument_of(mechanism: Mechanism, choice: str | None) -> Argument:
    """Return what the samples of a mechanism go by; choice: 'driver', 'time' or None: the driver, if there is one only.

    Raise a MechanismError if there is no driver, or several where one is needed.
    """
    drivers, run = mechanism.drivers, mechanism.run
    if not drivers:
        raise MechanismError(f"{mechanism.name} has no driver; a fit needs one")
    if choice not in (None, *CHOICES):
        raise MechanismError(f"over = {choice!r} must be 'driver' or 'time'")
    if choice == "driver" and len(drivers) > 1:
        raise MechanismError(f"over = 'driver' needs one driver; {mechanism.name} has {len(drivers)}: write 'time'")
    if choice == "time" or len(drivers) > 1:
        return Argument("time", Quantity("time"), "", run.start, run.stop)
    (driver,) = drivers
    start = float(driver.law.at(run.start))
    end = start + math.tau
    if driver.quantity.kind != "angle":
        values = [float(driver.law.at(t)) for t in run_times(run).tolist()]
        start, end = min(values), max(values)
    return Argument(driver.name, driver.quantity, driver.inputs()[0], start, end)


_ROUNDS = 80  # most steps on exact poses; three are usual, halving down to rounding takes 50
_ENOUGH = 1e-14  # of the spacing of samples; a point for which the next step is smaller is found
_SLOW = 0.5  # of the step before; a larger step is no step of Newton near a root
Curve = Callable[[FloatArray], tuple[FloatArray, FloatArray, FloatArray]]  # u (m,) -> values, rates, accelerations


class NotReachedError(Exception):
    """An output never has a wanted value."""


def nearest(
    u: FloatArray, curve: Curve, wanted: FloatArray, periods: FloatArray, ends: tuple[float, float] | None
) -> FloatArray:
    """Return the arguments (m,) of the points of a curve that are nearest to given rows.

        r.P' = 0,   du = -r.P' / (P'.P' + r.P'')   with r = P - wanted

    Args:
        u: (n,) arguments of samples of the whole motion.
        curve: Values, rates and accelerations (m, d) at arguments (m,).
        wanted: (m, d).
        periods: (d,) what differences may differ by, such as a whole turn; inf: nothing.
        ends: Smallest and largest argument; None: the curve is closed.

    """
    samples = curve(u)
    known = np.isfinite(samples[0]).all(axis=1)
    if not known.any():
        raise NotReachedError
    distances = (modulo(samples[0][None, :, :] - wanted[:, None, :], periods) ** 2).sum(axis=2)
    k = np.where(known, distances, np.inf).argmin(axis=1)
    spacing = abs(float(u[1] - u[0]))
    low, high = u[k] - spacing, u[k] + spacing
    if ends is not None:
        low, high = np.maximum(low, min(ends)), np.minimum(high, max(ends))
    _, first = _to_foot(samples[0][k], samples[1][k], samples[2][k], wanted, periods, spacing)

    def step(u: FloatArray, rows: IntArray) -> tuple[FloatArray, FloatArray]:
        return _to_foot(*curve(u), wanted[rows], periods, spacing)

    return _refined(np.clip(u[k] + first, low, high), u[k], low, high, step)


def _refined(
    found: FloatArray,
    good: FloatArray,
    low: FloatArray,
    high: FloatArray,
    step_at: Callable[[FloatArray, IntArray], tuple[FloatArray, FloatArray]],
) -> FloatArray:
    """Return the roots (m,) of functions between bounds, by Newton's method; where it is slow an interval is halved.

    Args:
        found: (m,) first guesses.
        good: (m,) arguments that are known to have numbers.
        low: (m,) lower bounds.
        high: (m,) upper bounds.
        step_at: Of arguments of some rows, and these: positive where a root is below; the step of Newton.

    """
    found, good, low, high = (np.array(one, dtype=float) for one in (found, good, low, high))
    before, enough = high - low, _ENOUGH * float((high - low).max(initial=0.0))
    is_tried = np.zeros((2, len(found)), dtype=bool)  # the bounds, which are tried themselves before halves
    rows = np.arange(len(found))
    for _ in range(_ROUNDS):
        u = found[rows]
        side, step = step_at(u, rows)
        has_gap = ~np.isfinite(side)  # beyond a limit of the path
        side = np.where(has_gap, u - good[rows], side)
        good[rows] = np.where(has_gap, good[rows], u)
        is_tried[0, rows] |= side < 0.0
        is_tried[1, rows] |= side > 0.0
        low[rows], high[rows] = np.where(side < 0.0, u, low[rows]), np.where(side > 0.0, u, high[rows])
        a, b = low[rows], high[rows]
        wanted = np.where(has_gap, u, u + np.nan_to_num(step))
        new = np.clip(wanted, a, b)
        is_beyond = ((wanted < a) & is_tried[0, rows]) | ((wanted > b) & is_tried[1, rows])
        is_slow = is_beyond | has_gap | (np.abs(new - u) > _SLOW * before[rows])
        new = np.where(is_slow & (side != 0.0), 0.5 * (a + b), new)
        moved = np.abs(new - u)
        found[rows] = new
        is_open = moved**3 > enough * before[rows] ** 2
        before[rows] = moved
        rows = rows[is_open & (b - a > enough)]
        if not len(rows):
            break
    return found


def modulo(r: FloatArray, periods: FloatArray) -> FloatArray:
    """Return the smallest differences that are equal to r (..., d) up to whole periods."""
    if not np.isfinite(periods).any():
        return r
    turns = np.where(np.isfinite(periods), np.round(r / periods), 0.0)
    return np.asarray(r - turns * np.where(np.isfinite(periods), periods, 0.0))


def _to_foot(
    p: FloatArray, v: FloatArray, a: FloatArray, wanted: FloatArray, periods: FloatArray, spacing: float
) -> tuple[FloatArray, FloatArray]:
    """Return half the slope of the square of the distance, and the step to the nearest point."""
    r = modulo(p - wanted, periods)
    slope, along = (r * v).sum(axis=1), (v * v).sum(axis=1)
    curvature = along + (r * a).sum(axis=1)
    curvature = np.where(curvature > 0.1 * along, curvature, along)
    step = np.divide(-slope, curvature, out=np.zeros_like(slope), where=curvature > 0.0)
    return slope, np.asarray(np.clip(step, -spacing, spacing))


def crossings(u: FloatArray, curve: Curve, levels: FloatArray) -> FloatArray:
    """Return the arguments (m,) at which a curve of one output has given values.

    Where it has a value several times, the one nearest to the argument before counts; for the first value the first.

    Raise a NotReachedError if the output never has one of the values.

    u: (n,) arguments of samples of the whole motion. curve: Values, rates and accelerations (m, 1) at arguments (m,).
    levels: (m,).
    """
    x = curve(u)[0][:, 0]
    spacing = abs(float(u[1] - u[0]))
    found, before = np.empty((4, len(levels))), float(u[0])  # guess, bounds, 1 or -1 as the output rises or falls
    for j, level in enumerate(levels):
        gap = x - level
        places = np.flatnonzero((gap[:-1] <= 0.0) != (gap[1:] <= 0.0))
        places = places[np.isfinite(gap[places]) & np.isfinite(gap[places + 1])]
        guesses = u[places] - gap[places] * (u[places + 1] - u[places]) / (gap[places + 1] - gap[places])
        if len(guesses):
            nearest_one = int(np.abs(guesses - before).argmin())
            k = int(places[nearest_one])
            rising = np.sign((gap[k + 1] - gap[k]) * (u[1] - u[0]))
            found[:, j] = guesses[nearest_one], *sorted((u[k], u[k + 1])), rising
        elif np.isfinite(gap).any():  # it may touch the value between two samples
            guess = u[int(np.nanargmin(np.abs(gap)))]
            found[:, j] = guess, guess - spacing, guess + spacing, 0.0
        else:
            raise NotReachedError
        before = found[0, j]
    guesses, low, high, signs = found

    def step(u: FloatArray, rows: IntArray) -> tuple[FloatArray, FloatArray]:
        p, v, _ = (table[:, 0] for table in curve(u))
        with np.errstate(all="ignore"):
            return (p - levels[rows]) * signs[rows], np.clip((levels[rows] - p) / v, -spacing, spacing)

    at = _refined(guesses, guesses, low, high, step)
    if not np.abs(curve(at)[0][:, 0] - levels).max() <= 1e-6 * (np.abs(levels).max() + np.nanmax(np.abs(x))):
        raise NotReachedError
    return at
