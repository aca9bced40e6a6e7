"""svaj_columns(): displacement, velocity, acceleration and jerk of a quantity as columns of a table."""

from __future__ import annotations

from kinfmu.motion.motion_curve import MotionCurve, motion_curve
from kinfmu.run import Column, Run
from kinfmu.run.axis import TIME, rates_per
from kinfmu.run.tables import in_degrees
from kinfmu.units import Quantity, unit_of

NAMES = ("position", "velocity", "acceleration", "jerk")


def units_of(run: Run, curve: MotionCurve) -> list[str]:
    """Return the units of displacement, velocity, acceleration and jerk."""
    per = rates_per(run)
    return [unit_of(Quantity(curve.kind, order, per), run.length_unit) for order in range(4)]


def svaj_columns(run: Run, name: str, *, degrees: bool = False) -> list[Column]:
    """Return time, values of the drivers, position, velocity, acceleration, jerk and side of a quantity.

    There is a row for each sample, of side 0. At each break of a law two more rows hold the limits before it in the
    order of the run, of side -1, and after it, of side 1. A sample exactly at a break has the value of the piece on the
    right of the law, which is before the break where the law's argument falls. Without time on the axis of the run
    there is no column of it. Numbers that are not known are NaN.

    Args:
        run: The run, as for `motion_of`.
        name: A coordinate or a cam joint, as for `motion_of`.
        degrees: True: angles, and their rates in time, in deg.

    Raises:
        RequestError, KinfmuError, MechanismError: As `motion_of`.

    """
    curve = motion_curve(run, name)
    found = [Column("time", "s", curve.t)] if run.axis == TIME else []
    for k, driven in enumerate(run.input_names[::3]):
        found.append(Column(str(driven), unit_of(driven.quantity, run.length_unit), curve.drive[:, k]))
    for order, unit in enumerate(units_of(run, curve)):
        found.append(Column(NAMES[order], unit, curve.table[:, order]))
    if degrees:
        found = [*map(in_degrees, found)]
    found = [column._replace(values=column.values + 0.0) for column in found]  # no -0.0
    return [*found, Column("side", "1", curve.side)]
