"""What is told of the inputs of a run: what nothing drives, angles that jump, radians that look like degrees."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from kinfmu.errors import listed
from kinfmu.fmu.input_table import TIME, InputTable
from kinfmu.fmu.interface import Interface
from kinfmu.mechanism import RunSettings
from kinfmu.run import Event
from kinfmu.run.unwrap import is_long
from kinfmu.units import in_turns, looks_like_degrees


def input_notes(interface: Interface, table: InputTable, start: float | None, stop: float | None) -> Iterator[Event]:
    """Events about a table of inputs, for a run whose ends are `start` and `stop` [s] if the caller said any."""
    yield from _span(interface.experiment, table, start, stop)
    for variable in interface.part("inputs")[::3]:
        if variable.unit == "rad" and variable.name in table.names:
            yield from _unlikely(variable.name, table)


def undriven(interface: Interface, table: InputTable | None, t: float) -> Iterator[Event]:
    """A warning at time t [s] for a run by inputs if those of some drivers are not given: they stay as they start."""
    given = () if table is None else table.names
    still = [variable for variable in interface.part("inputs")[::3] if variable.name not in given]
    if still:
        why = "no inputs are given" if table is None else f"{table.source} does not drive all inputs"
        values = listed(f"{variable.name} stays at {variable.start:.6g} {variable.unit}" for variable in still)
        columns = listed((TIME, *(variable.name for variable in still)))
        yield Event(t, "warning", f"{why}: {values}; a CSV with the columns {columns} drives (--input)")


def _span(experiment: RunSettings, table: InputTable, start: float | None, stop: float | None) -> Iterator[Event]:
    """A note if the run has ends of the table that are not those of the model."""
    if (start is None and table.start != experiment.start) or (stop is None and table.stop != experiment.stop):
        first, last = table.start if start is None else start, table.stop if stop is None else stop
        rows = "as" if start is None and stop is None else "one end as"
        alone = "; a second row would hold the values until then" if table.start == table.stop else ""
        yield Event(
            first, "info", f"the run goes from {first:g} to {last:g} s, {rows} the rows of {table.source}{alone}"
        )


def _unlikely(name: str, table: InputTable) -> Iterator[Event]:
    """A note of an angle without a unit that looks like degrees, else a warning of jumps by more than half a turn."""
    angles = table.values[:, table.names.index(name)]
    low, high = float(angles.min()), float(angles.max())
    long = np.flatnonzero(is_long(np.diff(angles)))
    if name in table.unitless and (looks_like_degrees(low) or looks_like_degrees(high)):
        yield Event(
            table.start,
            "info",
            f"{table.source}: {name} has no unit, so it is in rad: {low:g} to {high:g} rad, {in_turns(high - low)}; "
            f"'{name} [deg]' in the header says degrees",
        )
    elif len(long):
        k = int(long[0])
        jump = math.degrees(angles[k + 1] - angles[k])
        others = f", and {len(long) - 1} more such {'jump' if len(long) == 2 else 'jumps'}" if len(long) > 1 else ""
        yield Event(
            float(table.t[k + 1]),
            "warning",
            f"{table.source}: {name} jumps by {jump:.6g} deg from {table.t[k]:g} to {table.t[k + 1]:g} s{others}; "
            "followed as given; --wrap follows wrapped angles, from 360 to 0 deg, say, the short way",
        )
