"""What a plot shows along its horizontal axis: the axis of the run, or a column; angles in degrees."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import FigureError
from kinfmu.run import Run
from kinfmu.run.axis import DEGREE, axis_of, rates_per
from kinfmu.units import degrees_of, unit_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_DEGREES = (1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 45.0, 60.0, 90.0, 180.0, 360.0, 720.0, 1440.0)  # steps of ticks


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
    """Return a name with its unit, on two lines if both have more letters than `longest`.

    The unit is on a line of its own, or else the name is broken behind a dot or underscore.
    """
    text = labelled(name, unit)
    if len(text) <= longest:
        return text
    if text != name and len(name) <= longest:
        return f"{name}\n{text.removeprefix(name).lstrip()}"
    breaks = [k + 1 for k, letter in enumerate(name) if letter in "._"] or [len(text)]
    at = min(breaks, key=lambda k: max(k, len(text) - k))
    return f"{text[:at]}\n{text[at:]}".rstrip("\n")


def label_size(label: str, longest: int, size: float) -> float:
    """Return the size of the letters [pt] with which the lines of a label are no longer than `longest` letters are."""
    return size * min(1.0, longest / max(1, *map(len, label.split("\n"))))


def degree_ticks(axes: Axes, most: int) -> None:
    """Give a horizontal axis of degrees at most this many steps, such as 30, 45 or 90 deg."""
    from matplotlib.ticker import MultipleLocator

    low, high = axes.get_xlim()
    step = next((step for step in _DEGREES if abs(high - low) <= most * step), 0.0)
    if step and abs(high - low) >= 2.0 * step:  # else those that matplotlib chooses
        axes.xaxis.set_major_locator(MultipleLocator(step))


def raised(unit: str) -> str:
    """Return a unit with raised digits."""
    return unit.replace("2", "\N{SUPERSCRIPT TWO}").replace("3", "\N{SUPERSCRIPT THREE}")
