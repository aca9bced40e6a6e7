"""The timeline of a recording: time, or whole numbers of a part of the driver's unit for runs that have no time."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import LogError
from kinfmu.log.cdr import nanoseconds
from kinfmu.run import Run
from kinfmu.run.axis import DEGREE, SAMPLE, axis_of

if TYPE_CHECKING:
    import rerun as rr

FINEST = 9  # decimals of a value
_LOST = 0.01  # part of the smallest step between samples that rounding may move one
_MOST = 2.0**31  # the largest of the whole numbers
_OF_DRIVER = re.compile(r"(?P<driver>.+) \[(?:0\.(?P<decimals>0*1) )?(?P<unit>[a-z]+)\]")  # 'crank [0.1 deg]'


@dataclass(frozen=True)
class Timeline:
    """The timeline of a recording.

    name: 'sim_time', 'crank [deg]', 'crank [0.1 deg]' or 'sample'; parts: whole numbers per unit of the axis, None for
    times, which are seconds.
    """

    name: str
    parts: int | None = None

    @property
    def unit(self) -> str:
        """Unit of the axis: 's', 'deg', 'rad', a unit of length, or '' of samples."""
        match = _OF_DRIVER.fullmatch(self.name)
        return "s" if self.parts is None else match["unit"] if match else ""

    @property
    def label(self) -> str:
        """'t [s]', 'crank [deg]' or 'sample'."""
        match = _OF_DRIVER.fullmatch(self.name)
        return "t [s]" if self.parts is None else f"{match['driver']} [{match['unit']}]" if match else self.name

    def place(self, value: float) -> float:
        """Return the time of placed runs at a value of the axis [s, rad, length, sample]."""
        return value / (DEGREE if self.unit == "deg" else 1.0) * (self.parts or 1)

    def placed(self, run: Run) -> Run:
        """Return the run with times on this timeline, for its samples and events."""
        if self.parts is None:
            return run
        axis, parts = axis_of(run), self.parts
        at = np.rint(axis.at(np.array([event.t for event in run.events])) * parts)
        events = tuple(event._replace(t=float(t)) for event, t in zip(run.events, at, strict=True))
        return replace(run, t=np.rint(axis.values * parts), events=events)

    def column(self, t: FloatArray) -> rr.TimeColumn:
        """Return times of placed runs (n,) for Rerun, as whole nanoseconds because Rerun truncates float durations."""
        import rerun as rr

        if self.parts is None:
            return rr.TimeColumn(self.name, duration=nanoseconds(t).astype("timedelta64[ns]"))
        return rr.TimeColumn(self.name, sequence=np.rint(t).astype(np.int64))

    def cursor(self, t: float) -> dict[str, Any]:
        """Return a time of placed runs as a viewer's cursor."""
        return {"duration": t} if self.parts is None else {"sequence": round(t)}

    def number(self, t: float) -> dict[str, Any]:
        """Return a time of placed runs, or a span, as the argument of one of Rerun's boundaries."""
        return {"seconds": t} if self.parts is None else {"seq": round(t)}


def timeline_named(name: str) -> Timeline:
    """Return the timeline that has a name in a recording."""
    match = _OF_DRIVER.fullmatch(name)
    if not match:
        return Timeline(name, 1 if name == SAMPLE else None)
    return Timeline(name, 10 ** len(match["decimals"] or ""))


def timeline_of(runs: Sequence[Run]) -> Timeline:
    """Return the timeline that runs have in common; LogError if they have none."""
    axes = [axis_of(run) for run in runs]
    if len({(axis.name, axis.unit) for axis in axes}) > 1:
        raise LogError(
            f"the runs are over {' and '.join(axis.label for axis in axes)}; runs over the same axis can be compared"
        )
    first = axes[0]
    if first.is_time:
        return Timeline("sim_time")
    for axis in axes:
        if float(np.max(np.abs(axis.values), initial=0.0)) > _MOST:
            raise LogError(f"{axis.label}: a recording holds values of at most {_MOST:.10g}")
    decimals = max(_decimals(axis.values) for axis in axes) if first.unit else 0
    part = f"{10.0**-decimals:.{decimals}f}"
    return Timeline(first.label.replace("[", f"[{part} ") if decimals else first.label, 10**decimals)


def _decimals(values: FloatArray) -> int:
    """Return how many decimals distinguish the values."""
    steps = np.abs(np.diff(values))
    least = float(steps[steps > 0.0].min(initial=math.inf))
    largest = float(np.max(np.abs(values), initial=0.0))
    for decimals in range(FINEST):
        lost = float(np.max(np.abs(np.rint(values * 10**decimals) / 10**decimals - values), initial=0.0))
        if lost <= _LOST * least or largest * 10 ** (decimals + 1) > _MOST:
            return decimals
    return FINEST
