"""Verdict on a run: samples by status, the worst residual, its events, and whether its samples show the motion."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray, IntArray
from kinfmu.run import Event, Run
from kinfmu.run.axis import axis_of
from kinfmu.solver.python.pose import Status
from kinfmu.units import InputName, degrees_of, unit_of

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


_REASONS = MEANINGS | {Status.BRIDGED: "bridged: the equations are singular there, so poses are interpolated across"}


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
    return {Status(value): number for value, number in enumerate(np.bincount(run.status).tolist()) if number}


def worst_residual(run: Run) -> Worst | None:
    """Return the largest residual; None if no sample holds numbers."""
    known = run.good & np.isfinite(run.residual)
    if not known.any():
        return None
    worst = float(np.max(run.residual, initial=-np.inf, where=known))
    return Worst(worst, float(run.t[np.argmax(known & (run.residual == worst))]))


def changed_samples(run: Run) -> IntArray:
    """Return the samples whose status differs from the one before."""
    return np.flatnonzero(run.status[1:] != run.status[:-1]) + 1


def changes(run: Run) -> Iterator[Change]:
    """Yield every sample whose status differs from the one before, and the first sample."""
    for row in (*range(min(1, len(run))), *changed_samples(run)):
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
    """Return each series of samples that are not ok, and the run's own events, in order of time, each failure once.

    The times at the beginning of texts are removed: `t` has them.
    """
    found = [*unexplained(_series(run), run.events), *run.events]
    return sorted((event._replace(text=_WHEN.sub("", event.text)) for event in found), key=lambda event: event.t)


def _series(run: Run) -> Iterator[Event]:
    """Yield an event for each series of samples of one status that is not ok: how many, up to where, and why."""
    found = list(changes(run))
    ends = [change.row for change in found[1:]] + [len(run)]
    for change, end in zip(found, ends, strict=False):  # a run without samples has no change
        last = end - 1
        if change.status is Status.OK:
            continue
        count = last - change.row + 1
        upto = f", up to {axis_of(run).place(float(run.t[last]))}" if count > 1 else ""
        at = _driver_values(run, change.row, last)
        which = f"{count} sample{'' if count == 1 else 's'}{upto}{at}"
        yield Event(change.t, _LEVELS.get(change.status, "error"), f"{which}, {_REASONS[change.status]}")


def _driver_values(run: Run, first: int, last: int) -> str:
    """Return ' (crank 0 to 2 deg)' for samples of a run over time with one driver; else ''."""
    names = [name for name in run.input_names[::3] if name not in run.absent]
    if not axis_of(run).is_time or len(names) != 1:
        return ""
    unit, factor = degrees_of(unit_of(names[0].quantity, run.length_unit))
    begin, end = (f"{run[names[0]][row] * factor + 0.0:.6g}" for row in (first, last))
    return f" ({names[0].driver} {begin}{f' to {end}' if end != begin else ''} {unit})"


def sentence(run: Run) -> str:
    """Return the verdict in one line, such as '181 samples: 179 ok, 2 bridged; worst residual 1.1e-16 at 37 s'."""
    parts = ", ".join(f"{number} {label(status)}" for status, number in counts(run).items())
    text = f"{len(run)} sample{'' if len(run) == 1 else 's'}" + (f": {parts}" if parts else "")
    worst = worst_residual(run)
    return f"{text}; worst residual {worst.residual:.2g} at {axis_of(run).place(worst.t)}" if worst else text


_MOST_TURN = math.pi / 3.0  # [rad] between samples: six samples a turn
_GOOD_TURN = math.pi / 18.0  # [rad] between samples with the step that the note states: 36 samples a turn
_MOST_MISS = 0.02  # of the range of a value; eight samples a period of an oscillation
_LEAST = 1e-3  # of a value, or [rad]; smaller motions between samples are none


def coarse_samples(t: FloatArray, names: Sequence[InputName], u: FloatArray, ud: FloatArray) -> str:
    """Return a note if samples are too far apart to show the motion of the drivers; '' if they are not.

    They are if a driver turns by more than 60 deg between two of them, or if its speeds at the samples do not explain
    how its value changes, as when it swings to and fro between them.

    Args:
        t: (n,) times [s].
        names: (d,) names of the drivers' values, such as 'crank_angle'.
        u: (n, d) their values.
        ud: (n, d) their speeds.

    """
    good = np.isfinite(u).all(axis=1) & np.isfinite(ud).all(axis=1)
    t, u, ud = t[good], u[good], ud[good]
    steps = np.diff(t)
    if len(t) < 3 or not (steps > 0.0).all():
        return ""
    found: list[tuple[float, str]] = []  # steps that would do, and why
    for name, value, speed in zip(names, u.T, ud.T, strict=True):
        fastest, span = float(np.abs(speed).max()), float(np.ptp(value))
        is_angle = name.quantity.kind == "angle"
        least = _LEAST * (1.0 if is_angle else float(np.abs(value).max()))
        if not fastest * float(steps.max()) > least:
            continue
        turned = np.maximum(np.abs(np.diff(value)), np.abs(speed[1:]) * steps)
        miss = np.abs(np.diff(value) - steps * (speed[1:] + speed[:-1]) / 2.0)
        if is_angle and turned.max() > _MOST_TURN:
            most = math.degrees(float(turned.max()))
            why = f"{name.driver} turns by up to {most:.3g} deg from one to the next"
            found.append((float((steps * _GOOD_TURN / np.maximum(turned, _GOOD_TURN)).min()), why))
        elif miss.max() > _MOST_MISS * span:
            rate = fastest / max(span / 2.0, fastest * float(steps.max()) / 20.0)  # of an oscillation of this range
            why = f"the speed of {name.driver} changes too much from one to the next"
            found.append((min(2.0 * math.pi / 36.0 / rate, float(steps.min()) / 3.0), why))
    if not found:
        return ""
    step, why = min(found)
    return (
        f"samples {float(steps.max()):.6g} s apart do not show the motion: {why}; "
        f"a step of {_rounded_down(step):g} s would"
    )


def _rounded_down(step: float) -> float:
    """Return the largest 1, 2 or 5 times a power of ten that is not above a step."""
    power = math.floor(math.log10(step))
    return float(f"{max(digit for digit in (1, 2, 5) if digit * 10.0**power <= step * (1.0 + 1e-12))}e{power}")
