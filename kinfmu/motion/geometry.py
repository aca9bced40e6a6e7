"""The geometry of a motion: the mechanism at constant speed over the values that its driver takes.

Measures that compare rates, such as dy/du, do not depend on how the driver moves. Over time they would be quotients of
two rates that are both 0 where its law stands still.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from kinfmu.errors import RequestError
from kinfmu.mechanism.checks import coordinate_orders
from kinfmu.mechanism.measures import Reading
from kinfmu.motion.history import History
from kinfmu.motion.motion import Motion
from kinfmu.run import Run
from kinfmu.run.solve import solve

_SAMPLES = 360  # in a turn, and in every range
_AT_REST = 1e-12  # of the value of the driver; one that changes by less does not move


def moves_evenly(drive: History) -> bool:
    """Return True for a driver with one speed that is not 0, at which the motion is its geometry."""
    return drive.is_linear and bool(drive.rate[0])


def geometry_of(run: Run, motion: Motion, reading: Reading, solved: Callable[..., Run] | None = None) -> Motion:
    """Return the motion on which a measure is read: of one that compares rates the geometry of the run.

    Args:
        run: The run.
        motion: Its motion.
        reading: The measure. A rate over another is not geometry.
        solved: Solves the run's mechanism for inputs. Default: `solve`.

    Raises:
        RequestError: The driver does not move.

    """
    drive, orders = motion.drive, coordinate_orders(motion.mechanism)
    if not reading.compares_rates or drive is None or moves_evenly(drive) or not run.good.all():
        return motion
    names = [getattr(reading, "of", None), getattr(reading, "to", None)]
    if any(name in orders and orders[name][1] for name in names if isinstance(name, str)):
        return motion  # the rate of a rate
    low, high = (float(extreme.value) for extreme in drive.extremes())
    if high - low <= _AT_REST * max(abs(low), abs(high)):
        raise RequestError(f"{motion.driver} does not move")
    angle, speed, _ = next(one.inputs() for one in motion.mechanism.drivers if one.name == motion.driver)
    turns = (high - low) / math.tau if angle.quantity.kind == "angle" else 1.0
    values = np.linspace(low, high, _SAMPLES * math.ceil(max(turns, 1.0)) + 1)
    solved = solved or partial(solve, replace(motion.mechanism, coordinates="all"))
    return Motion.of_run(solved(**{angle: values, speed: 1.0}), with_margin=False)
