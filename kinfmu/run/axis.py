"""The axes of a plot of a run: time, or a driver's value or the sample number; the range of values that is shown."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from kinfmu.arrays import FloatArray, finite
from kinfmu.errors import listed
from kinfmu.units import ANGLES, InputName, angular_speed

TIME, SAMPLE = "time", "sample"  # axes of runs; the others are names of inputs, such as 'crank_angle'
DEGREE = ANGLES["deg"]
_LARGE = 1e9  # [rad]; larger angles stay in radians
ROUND_OFF = 1e-9  # relative to a usual value of the motion; smaller curves are noise around 0
OUTLIERS = 1.0  # [percent] of the values on either side that may be outside the plot if they would flatten the others


class HasAxis(Protocol):
    """The fields of a run that determine its axis, as kinfmu.Run describes them."""

    @property
    def axis(self) -> str: ...

    @property
    def t(self) -> FloatArray: ...

    @property
    def input_names(self) -> tuple[InputName, ...]: ...

    @property
    def inputs(self) -> FloatArray: ...

    @property
    def length_unit(self) -> str: ...


@dataclass(frozen=True, eq=False)
class Axis:
    """The quantity over which pictures and reports show a run.

    name: 't', the name of a driver, or 'sample'; unit: 's', 'deg', the unit of length, or ''; factor: of the unit into
    the one used inside; values: (n,) in the unit, in ascending or descending order; span: their range in the unit used
    inside, which is that of the rates; per: what rates are derivatives by: 'time', or 'angle' or 'length' of the
    driver; rates: a sentence on them, empty where they are derivatives by the axis of a run over time.
    """

    name: str
    unit: str
    factor: float
    values: FloatArray
    span: float
    per: str
    rates: str
    t: FloatArray

    @property
    def label(self) -> str:
        """'t [s]', 'crank [deg]' or 'sample'."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def is_time(self) -> bool:
        """True for a run over time."""
        return self.unit == "s"

    def at(self, t: FloatArray) -> FloatArray:
        """Return values of the axis, in its unit, at times of the run."""
        return np.interp(t, self.t, self.values) if len(self.t) and not self.is_time else t

    def place(self, t: float) -> str:
        """Return '37 s', 'crank = 45 deg' or 'sample 45': a time of the run as text."""
        value = f"{float(self.at(np.array([t]))[0]):.6g}"
        if self.is_time:
            return f"{value} s"
        return f"{self.name} = {value} {self.unit}" if self.unit else f"{self.name} {value}"

    def range(self) -> str:
        """Return 't = 0 to 180 s', 'crank = 0 to 360 deg' or 'sample 0 to 360'; '' without samples."""
        if not len(self.values):
            return ""
        first, last = (f"{value:.6g}" for value in (self.values[0], self.values[-1]))
        return f"{self.name} = {first} to {last} {self.unit}" if self.unit else f"{self.name} {first} to {last}"


def axis_of(run: HasAxis) -> Axis:
    """Return the axis of a run, as its field `axis` names it."""
    if run.axis == TIME or run.axis not in (SAMPLE, *run.input_names[::3]):
        return Axis("t", "s", 1.0, run.t, _span(run.t), "time", "", run.t)
    if run.axis == SAMPLE:
        return Axis(SAMPLE, "", 1.0, run.t, _span(run.t), "time", _at_speeds(run), run.t)
    column = run.input_names.index(run.axis)
    driver, kind = run.input_names[column].driver, run.input_names[column].quantity.kind
    inside = run.inputs[:, column]
    values, unit, factor = inside, "rad" if kind == "angle" else run.length_unit, 1.0
    if kind == "angle" and np.max(np.abs(inside), initial=0.0) < _LARGE:
        values, unit, factor = np.round(inside / DEGREE, 9), "deg", DEGREE  # 45, not 45.00000000000001
    per = rates_per(run)
    if per == "time":
        fastest = float(np.max(np.abs(run.inputs[:, column + 1]), initial=0.0))
        span, rates = _span(inside) / (fastest or 1.0), _at_speeds(run)
    else:
        span, rates = _span(inside), f"Rates are derivatives by {driver}, per {'rad' if kind == 'angle' else unit}."
    return Axis(driver, unit, factor, values, span, per, rates, run.t)


def rates_per(run: HasAxis) -> str:
    """Return what the rates of a run are derivatives by: 'time', or 'angle' or 'length' of the driver on its axis.

    They are derivatives by the driver where it has speed 1 and acceleration 0, and the others are at rest.
    """
    if run.axis not in run.input_names[::3]:
        return "time"
    column = run.input_names.index(run.axis)
    moved = np.delete(run.inputs, (column, column + 1), axis=1)
    is_rate = np.delete(np.arange(len(run.input_names)) % 3 > 0, (column, column + 1))
    is_per_unit = bool(np.all(run.inputs[:, column + 1] == 1.0)) and not moved[:, is_rate].any()
    return run.input_names[column].quantity.kind if is_per_unit else "time"


def axis_for(u: FloatArray, names: tuple[str, ...]) -> str:
    """Return the axis of a run by inputs: the only value that changes, if it is monotonic, else the samples.

    u: (n, d) values of the drivers; names: of these inputs, (d,).
    """
    if len(names) == 1 and len(u) <= 1:
        return names[0]
    moved = [k for k, column in enumerate(u.T) if len(column) and column.min() < column.max()]
    return names[moved[0]] if len(moved) == 1 and _is_monotonic(u[:, moved[0]]) else SAMPLE


def _is_monotonic(values: FloatArray) -> bool:
    before, after = values[:-1], values[1:]
    return bool((before < after).all() if values[0] < values[-1] else (before > after).all())


def _span(values: FloatArray) -> float:
    return float(np.ptp(values)) if len(values) else 0.0


def _at_speeds(run: HasAxis) -> str:
    """Return 'Rates are at the speed crank = 3 rad/s.' if each driver has one speed, else that speeds were given."""
    shown = []
    for name in run.input_names[::3]:
        column = run.input_names.index(name) + 1
        speeds = run.inputs[:, column]
        if len(speeds) and math.isfinite(speeds[0]) and np.all(speeds == speeds[0]):
            is_angle = name.quantity.kind == "angle"
            text = angular_speed(speeds[0]) if is_angle else f"{speeds[0]:.6g} {run.length_unit}/s"
            shown.append(f"{name.driver} = {text}")
    if len(shown) < len(run.input_names) // 3:
        return f"Rates are at the speeds given for {listed(name.driver for name in run.input_names[::3])}."
    return f"Rates are at the speed{'s' if len(shown) > 1 else ''} {listed(shown)}."


def shown_range(values: FloatArray, usual: float) -> tuple[float, float] | None:
    """Return the range of an axis where the default, from least to greatest, would mislead; else None.

    Curves that are only round-off, compared with a `usual` value, are shown as a line at 0. A few samples near a
    singular point, where speeds grow without bound, do not flatten all others. The data keep all values.
    """
    known = finite(values)
    if not len(known):
        return None
    least, most = known.min(), known.max()
    if max(-least, most) < ROUND_OFF * usual:
        return -usual, usual
    low, high = np.percentile(known, [OUTLIERS, 100.0 - OUTLIERS])
    with np.errstate(over="ignore"):  # the largest numbers lead to infinite ends; the default range is used then
        width = high - low
        shown = low - width / 2, high + width / 2
        has_outliers = least < low - width or most > high + width
    if width > 0.0 and has_outliers and np.isfinite(shown).all():
        return float(shown[0]), float(shown[1])
    return None
