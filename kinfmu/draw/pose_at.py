"""The pose of a run at a value of its axis: that of a sample, or between two samples solved from them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene.placing import poses_after, poses_of
from kinfmu.errors import FigureError
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.laws import External
from kinfmu.run import Run
from kinfmu.run.axis import SAMPLE, Axis, axis_of

_SAME = 1e-9  # of the largest value; nearer ones are one: driver values are rounded


def pose_at(run: Run, mechanism: Mechanism, at: float, path: Path) -> dict[str, FloatArray]:
    """Return poses (1, 3) by body and for the ground.

    Args:
        run: The run, with a sample at least.
        mechanism: Its mechanism.
        at: Value on the axis of the run, in the unit of `axis_of`.
        path: The file to draw, for messages.

    Raises:
        FigureError: The value is outside the run, in a gap, or its pose cannot be solved.

    """
    axis = axis_of(run)
    asked = f"at t = {at:g} s" if axis.is_time else f"at {axis.name} = {at:.9g} {axis.unit}".rstrip()
    distance = (axis.values - at) * (1.0 if axis.values[-1] >= axis.values[0] else -1.0)  # ascending
    same = _SAME * float(np.abs(axis.values).max())
    if distance[0] > same or distance[-1] < -same:
        raise FigureError(f"{path}: {asked} is outside the run, {axis.range()}")
    there = np.flatnonzero(np.abs(axis.values - at) <= same)
    after = int(there[-1]) if len(there) else int(np.argmax(distance > 0.0))
    before = after if len(there) else after - 1
    if not run.good[[before, after]].all():
        raise FigureError(f"{path}: the run has no numbers {asked}")
    ground = {GROUND_NAME: np.zeros((1, 3))}
    if len(there):
        return {body: pose[[after]] for body, pose in poses_of(run, mechanism)[0].items()} | ground
    found = None
    if run.axis != SAMPLE:
        found = poses_after(run, mechanism, before, [*_driver_values(run, mechanism, axis, at, before)])
    if found is None:
        raise FigureError(
            f"{path}: {asked} is between two samples, and its pose cannot be solved from them; samples: "
            f"{axis.values[before]:.9g} and {axis.values[after]:.9g}"
        )
    return found | ground


def _driver_values(run: Run, mechanism: Mechanism, axis: Axis, at: float, row: int) -> Iterator[float]:
    """Yield the value of each driver at a value of the axis between `row` and the next sample.

    Over time it is that of the law if the run follows it there, else of a polynomial through values, speeds and
    accelerations; over a driver it is that on the axis, and the others are at rest.
    """
    from scipy.interpolate import BPoly

    ends = [row, row + 1]
    for k, name in enumerate(run.input_names[::3]):
        table = run.inputs[ends, 3 * k : 3 * k + 3]
        if not axis.is_time:
            yield at * axis.factor if name == run.axis else float(table[0, 0])
            continue
        law = mechanism.drivers[k].law
        t = run.t[ends]
        if not isinstance(law, External) and np.allclose([law.at(one) for one in t], table[:, 0], 1e-9, 1e-9):
            yield float(law.at(at))
        else:
            known = table if np.isfinite(table).all() else table[:, :1]
            yield float(BPoly.from_derivatives(t, known)(at))
