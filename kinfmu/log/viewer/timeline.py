"""The rows of a recording: its timeline, fewer samples of long runs, and how they are sent."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray
from kinfmu.errors import LogError
from kinfmu.log.cdr import nanoseconds
from kinfmu.run import Run
from kinfmu.run.axis import DEGREE, SAMPLE, axis_of

if TYPE_CHECKING:
    import rerun as rr


ROWS = 4096  # larger blocks are slower and take more memory
FINEST = 9  # decimals of a value
_LOST = 0.01  # part of the smallest step between samples that rounding may move one
_MOST = 2.0**31  # the largest of the whole numbers
_OF_DRIVER = re.compile(r"(?P<driver>.+) \[(?:0\.(?P<decimals>0*1) )?(?P<unit>[a-z]+)\]")  # 'crank [0.1 deg]'
MOST_ROWS = 200_000  # of a recording; the viewer is slow with more


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


def send(
    rec: rr.RecordingStream,
    path: str,
    timeline: Timeline,
    t: FloatArray,
    columns: Callable[[slice], Iterable[rr.ComponentColumn]],
) -> None:
    """Send rows at times t (n,) of the timeline to the entity `path`; columns(rows): the columns of a slice of rows."""
    for start in range(0, len(t), ROWS):
        rows = slice(start, start + ROWS)
        rec.send_columns(path, [timeline.column(t[rows])], columns(rows))


def decimated(run: Run, most: int | None = None) -> Run:
    """Return the run itself if it has at most `most` samples, else evenly spaced ones and the important ones between.

    most: default MOST_ROWS. Important are the first and last sample of every gap and the numbers next to it, and the
    least and greatest value of each column, so that no peak is lost. The MCAP record keeps every sample.
    """
    most = MOST_ROWS if most is None else most
    if len(run) <= most:
        return run
    rows = np.union1d(np.arange(0, len(run), -(-len(run) // most)), _indispensable(run))
    return run.part(rows, events=run.events)


def _indispensable(run: Run) -> NDArray[np.int64]:
    """Return the samples that must not be left out."""
    found = [0, len(run) - 1]
    turns = np.flatnonzero(np.diff(run.good.astype(int)))
    found += [*turns.tolist(), *(turns + 1).tolist()]
    for column in run.columns():
        known = np.flatnonzero(np.isfinite(column.values))
        if len(known):
            values = column.values[known]
            found += [int(known[np.argmin(values)]), int(known[np.argmax(values)])]
    return np.array(found)
