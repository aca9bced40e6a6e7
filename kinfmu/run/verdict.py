"""Verdict on a run: samples by status, the worst residual, and its events."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from kinfmu.run import Event, Run
from kinfmu.run.axis import axis_of
from kinfmu.solver.python.status import Status

_WHEN = re.compile(r"^at t = \S+ s: ")
_LEVELS = {Status.OK: "info", Status.BRIDGED: "info", Status.NEAR_SINGULAR: "warning"}  # the others: "error"
MEANINGS = {
    Status.OK: "ok",
    Status.NEAR_SINGULAR: "near singular: correct, with fewer digits",
    Status.BRIDGED: "bridged across a singular point",
    Status.OUTSIDE: "outside: the drivers cannot take the mechanism there",
    Status.INCONSISTENT: "inconsistent: a constraint set aside as redundant does not hold",
    Status.NOT_CONVERGED: "not converged",
}


class Worst(NamedTuple):
    """The largest residual of the samples that hold numbers, relative to the mechanism's size, and its time."""

    residual: float
    t: float  # [s]


class Change(NamedTuple):
    """The first sample of a series of one status."""

    row: int
    t: float  # [s]
    status: Status


def label(status: Status) -> str:
    """Return the name of a status in words, such as 'near singular'."""
    return status.name.lower().replace("_", " ")


def counts(run: Run) -> dict[Status, int]:
    """Return the number of samples by status, of those that occur, in the order of Status."""
    values, numbers = np.unique(run.status, return_counts=True)
    return {Status(int(value)): int(number) for value, number in zip(values, numbers, strict=True)}


def worst_residual(run: Run) -> Worst | None:
    """Return the largest residual; None if no sample holds numbers."""
    rows = np.flatnonzero(run.good & np.isfinite(run.residual))
    if not len(rows):
        return None
    row = rows[np.argmax(run.residual[rows])]
    return Worst(float(run.residual[row]), float(run.t[row]))


def changes(run: Run) -> Iterator[Change]:
    """Yield every sample whose status differs from the one before, and the first sample."""
    starts = np.flatnonzero(np.diff(run.status, prepend=run.status[:1] - 1))
    for row in starts:
        yield Change(int(row), float(run.t[row]), Status(int(run.status[row])))


def status_events(run: Run, before: Status = Status.OK) -> list[Event]:
    """Return changes of status as events; before: status of the sample before the first, default ok."""
    return [
        Event(change.t, _LEVELS.get(change.status, "error"), MEANINGS[change.status])
        for change in changes(run)
        if change.row or change.status is not before
    ]


def unexplained(changes: Iterable[Event], events: Iterable[Event]) -> list[Event]:
    """Return the changes of status, except failures that an error among `events` explains at the same time."""
    explained = {_moment(event) for event in events if event.level == "error"}
    return [change for change in changes if change.level != "error" or _moment(change) not in explained]


def _moment(event: Event) -> float:
    """Return the time of an event in whole nanoseconds: records round it to these."""
    return float(np.rint(event.t * 1e9))


def notable_events(run: Run) -> list[Event]:
    """Return changes of status and the run's own events in order of time, each failure once.

    A first sample of status ok has no entry. The times at the beginning of texts are removed: `t` has them.
    """
    found = [*unexplained(status_events(run), run.events), *run.events]
    return sorted((event._replace(text=_WHEN.sub("", event.text)) for event in found), key=lambda event: event.t)


def sentence(run: Run) -> str:
    """Return the verdict in one line, such as '181 samples: 179 ok, 2 bridged; worst residual 1.1e-16 at 37 s'."""
    parts = ", ".join(f"{number} {label(status)}" for status, number in counts(run).items())
    text = f"{len(run)} sample{'' if len(run) == 1 else 's'}" + (f": {parts}" if parts else "")
    worst = worst_residual(run)
    return f"{text}; worst residual {worst.residual:.2g} at {axis_of(run).place(worst.t)}" if worst else text
