"""Rates of a driver estimated from samples of its value, for hosts that connect no rates. Standard library only."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from math import inf

from .layout import Numbers

# C has these numbers too, in interface.h.
SAMPLES = 4  # that a slave remembers: the last one, two for the estimates and one more for their errors
LARGEST = 1e100  # of rates and of values that a host sets: squares of larger numbers overflow
EPS = 2.220446049250313e-16
SAME_TIME = 1e-9  # of a step: rounding errors of times that hosts add up, which move no pose
LATE = 1e-3  # of a step: a sum of a million steps may end this late
ROUNDING = 2.0 * EPS  # of a time: its last digits
UNSURE = 2.0  # safety factor: the next term may change by this much over the step
Sample = tuple[float, tuple[float, ...]]  # a communication point t [s] and the driver values u there


class Rates(IntEnum):
    """Values of the parameter `rates`: the source of the drivers' speeds and accelerations in co-simulation."""

    AUTO = 0
    ESTIMATED = 1
    WIRED = 2


def estimated_rates(samples: Sequence[Sample], t: float, u: Sequence[float]) -> tuple[Numbers, Numbers]:
    """Return speeds and accelerations of all drivers at t, one of each per driver: see estimated_rate."""
    speeds: Numbers = ()
    accelerations: Numbers = ()
    for k, value in enumerate(u):
        speed, acceleration = estimated_rate(samples, t, value, k)
        speeds += speed
        accelerations += acceleration
    return speeds, accelerations


def estimated_rate(samples: Sequence[Sample], t: float, value: float, k: int = 0) -> tuple[Numbers, Numbers]:
    """Return speed and acceleration of a driver at t, from the parabola through its last three samples.

        a = 2 (d2 - d1) / (t2 - t0),   v = d2 + (d2 - d1) (t2 - t1) / (t2 - t0),   d1, d2 the two slopes

    Backward differences on a non-uniform grid: v is of order 2, a of order 1 in the steps between the samples. With two
    samples v is the slope, of order 1, and a is 0; with one both are 0.

    Args:
        samples: Committed samples, oldest first; only those before t are used.
        t: Time [s].
        value: Of the driver at t.
        k: Place of the driver among all.

    Returns:
        Speed and acceleration, each as a tuple of one number: 0 if it exceeds LARGEST, as between two samples at almost
        the same time.

    """
    last = len(samples) - 1
    while last >= 0:
        t1, u1 = samples[last]
        if t1 < t:
            break
        last -= 1
    else:
        return (0.0,), (0.0,)
    step, before = t - t1, u1[k]
    slope = (value - before) / step
    if not last:
        return (slope if -LARGEST <= slope <= LARGEST else 0.0,), (0.0,)
    t0, u0 = samples[last - 1]
    bend = (slope - (before - u0[k]) / (t1 - t0)) / (t - t0)
    speed, acceleration = slope + bend * step, bend + bend
    return (
        (speed if -LARGEST <= speed <= LARGEST else 0.0,),
        (acceleration if -LARGEST <= acceleration <= LARGEST else 0.0,),
    )


def errors_of_estimated_rates(samples: Sequence[Sample], t: float, u: Sequence[float]) -> tuple[Numbers, Numbers]:
    """Return the errors of the estimated speed and acceleration of each driver: the term of one more sample.

        v: c3 (t - t2) (t - t1),   a: 2 c3 ((t - t2) + (t - t1)),   c3 the third divided difference

    plus the round-off of the differences. The error is inf for an acceleration from three samples and for both rates
    from two: one more sample is missing.

    Args:
        samples: Committed samples, oldest first; only those before t are used.
        t: Time [s].
        u: Driver values at t.

    Returns:
        Errors of speeds and accelerations, one of each per driver; inf where there is no estimate.

    """
    before = [sample for sample in samples if sample[0] < t][-3:]
    speeds, accelerations = [], []
    for k, last in enumerate(u):
        times, values = [t], [last]
        for time, known in reversed(before):
            times.append(time)
            values.append(known[k])
        differences = _divided(times, values)
        speed = acceleration = inf
        if len(before) > 1:
            h2, h1 = t - times[1], t - times[2]
            rounding = EPS * max(map(abs, values))
            speed = abs(differences[2]) * h2
            if len(before) > 2 and h2 * h1 > 0.0:
                speed = UNSURE * abs(differences[3]) * h2 * h1
                acceleration = 2.0 * UNSURE * abs(differences[3]) * (h2 + h1) + 4.0 * rounding / (h2 * h1)
            speed += 2.0 * rounding / h2
        speeds.append(speed if speed < inf else inf)  # NaN counts as unknown
        accelerations.append(acceleration if acceleration < inf else inf)
    return tuple(speeds), tuple(accelerations)


def _divided(times: Sequence[float], values: Sequence[float]) -> list[float]:
    """Return the divided differences of the first value with one, two, ... of the values after it."""
    column, leading = list(values), [values[0]]
    for order in range(1, len(values)):
        column = [(column[i] - column[i + 1]) / (times[i] - times[i + order]) for i in range(len(column) - 1)]
        leading.append(column[0])
    return leading
