"""The arguments of samples in ascending order, and the driver that moves over them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import RequestError
from kinfmu.motion.history import History
from kinfmu.run.axis import TIME, HasAxis, axis_of, rates_per


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

    Raises:
        RequestError: The samples are not in the order of time, or of one driver that has a constant speed.

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
