"""What the run of a mechanism's file meets: whether it stays where the mechanism can go."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from kinfmu.analysis.singular import DriverRange
from kinfmu.analysis.written import written
from kinfmu.plan import SolvePlan
from kinfmu.sweep import solve

_LOOKS = 201  # times of a run that are looked at
_LARGE = 600  # coordinates of a mechanism whose run with several drivers is left unlooked at


def run_notes(plan: SolvePlan, ranges: Sequence[DriverRange]) -> Iterator[str]:
    """One line where the file's run takes its driver past a limit, or several drivers where the mechanism cannot go."""
    mechanism = plan.mechanism
    times = np.linspace(mechanism.run.start, mechanism.run.stop, _LOOKS)
    if len(mechanism.drivers) == 1 and ranges:
        (driver,) = mechanism.drivers
        values = [float(driver.law.at(t)) for t in times.tolist()]
        low, high = (
            end if limit is None else limit for end, limit in ((-math.inf, ranges[0].low), (math.inf, ranges[0].high))
        )
        if min(values) < low or max(values) > high:
            ends = (values[0], values[-1])
            way = ends if {min(values), max(values)} == set(ends) else (min(values), max(values))
            asked = " to ".join(written(u, mechanism.length_unit, driver.quantity.kind) for u in way)
            yield f"[run] takes {driver.name} from {asked}: beyond the range"
    elif len(mechanism.drivers) > 1 and len(mechanism.coordinate_names) <= _LARGE:
        for event in solve(plan, times).events[:1]:
            yield f"[run] at t = {event.t:.6g} s: {event.text}"
