"""What a plot shows along its horizontal axis: the axis of the run, or a column; angles in degrees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kinfmu.errors import FigureError
from kinfmu.run import FloatArray, Run
from kinfmu.run.axis import DEGREE, axis_of, rates_per
from kinfmu.units import degrees_of, unit_of

TICK_STEPS = (1, 1.5, 3, 4.5, 6, 9, 10)  # of degrees: 30, 45, 60, 90; of other quantities matplotlib chooses


@dataclass(frozen=True, eq=False)
class Abscissa:
    """Values along the horizontal axis.

    name: of the axis or column; unit: as shown, '' without one; values: (n,) in this unit; is_axis: True for the axis
    of the run, on which gaps have a place.
    """

    name: str
    unit: str
    values: FloatArray
    is_axis: bool

    @property
    def label(self) -> str:
        """The name with its unit, such as 'crank.phi [deg]'."""
        return labelled(self.name, self.unit)

    @property
    def is_angle(self) -> bool:
        """True for an angle in degrees."""
        return self.unit == "deg"

    @property
    def angles(self) -> FloatArray:
        """The values as angles [rad], for polar plots; FigureError if they are no angles."""
        if self.unit not in ("deg", "rad"):
            raise FigureError(f"a polar plot needs an angle, not {self.label}")
        return self.values * DEGREE if self.is_angle else self.values


def abscissa(run: Run, name: str = "") -> Abscissa:
    """Return the horizontal axis for a column of a run, or for the axis of the run if no name is given."""
    if not name:
        axis = axis_of(run)
        return Abscissa(axis.name, axis.unit, axis.values, True)
    unit = unit_in(run, name)
    shown, factor = degrees_of(unit)
    return Abscissa(name, shown, np.asarray(run[name], dtype=float) * factor, False)


def unit_in(run: Run, name: str) -> str:
    """Return the unit of a column, also of one that never moves; KinfmuError for an unknown name."""
    units = run.column_units(kept=False)
    if name not in units:
        per = rates_per(run)
        held = {one.derivative(order): one.quantity(order, per) for one in run.fixed for order in range(3)}
        run[name]  # reports an unknown name
        return unit_of(held[name], run.length_unit)
    return units[name]


def labelled(name: str, unit: str) -> str:
    """Return 'coupler.ax [m/s2]' with a raised 2; numbers have no unit."""
    return f"{name} [{raised(unit)}]" if unit not in ("", "1") else name


def axis_label(name: str, unit: str, longest: int) -> str:
    """Return a name with its unit, which is on a line of its own if both have more letters than `longest`."""
    text = labelled(name, unit)
    return text if len(text) <= longest or text == name else f"{name}\n{text.removeprefix(name).lstrip()}"


def raised(unit: str) -> str:
    """Return a unit with raised digits."""
    return unit.replace("2", "\N{SUPERSCRIPT TWO}").replace("3", "\N{SUPERSCRIPT THREE}")
