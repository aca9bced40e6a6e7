"""Rerun recording of two runs: overlaid, with their differences."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import NamedTuple

import numpy as np

from kinfmu.errors import LogError, listed
from kinfmu.log.cdr import nanoseconds
from kinfmu.log.viewer.blueprint import compared
from kinfmu.log.viewer.card import plain
from kinfmu.log.viewer.decimated import decimated
from kinfmu.log.viewer.linkage import Linkage
from kinfmu.log.viewer.rerun_file import application, left_out, log_card, log_group, log_status, recording
from kinfmu.log.viewer.series import Group, groups
from kinfmu.log.viewer.timeline import Timeline, timeline_of
from kinfmu.run import FloatArray, Run
from kinfmu.run.axis import axis_of
from kinfmu.run.verdict import sentence
from kinfmu.scene import palette
from kinfmu.scene.scene import drawable
from kinfmu.units import CoordinateName

MOST_LISTED = 6  # coordinates that a line names


class _Look(NamedTuple):
    """Style of one of the two runs: B is narrow, over a wide A, so that both are visible where they agree."""

    name: str
    root: str
    colour: palette.Colour
    bars: float  # width, 1 as for a single run
    curves: float  # width [points]
    layer: float


_LOOKS = (
    _Look("A", "/a", palette.RUNS[0], 1.0, 4.0, 0.0),
    _Look("B", "/b", palette.RUNS[1], 0.5, 1.5, 100.0),
)


def write_comparison(a: Run, b: Run, path: str | Path, names: tuple[str, str] = ("A", "B")) -> None:
    """Write two runs into one recording: linkages and curves overlaid, and B - A of the common coordinates.

    Args:
        a: Run A.
        b: Run B, with the same unit of length and the same axis.
        path: The .rrd file; an older one is replaced when the new one is complete.
        names: Of the runs, for titles. Default: A and B.

    Raises:
        LogError: The runs cannot be compared, a time is outside the range of a log, or the file cannot be written.

    """
    if a.length_unit != b.length_unit:
        raise LogError(
            f"{path}: the runs measure lengths in {a.length_unit} and {b.length_unit}; they need the same unit"
        )
    for run in (a, b):
        nanoseconds(run.t)
    timeline = _in_common(a, b, path)
    difference = _difference(a, b)
    shown = [timeline.placed(decimated(run)) for run in (a, b)]
    scenes, notes = zip(*(drawable(run) for run in shown), strict=True)
    apart = timeline.placed(decimated(difference)) if difference else None
    differences = groups(apart) if apart else {}
    curves = [groups(run) for run in shown]
    layout = compared(timeline, (shown[0], shown[1]), scenes, curves, differences)
    own_name = application(shown, [group for found in (*curves, differences) for group in found.values()])
    with recording(path, f"{names[0]} and {names[1]}", layout, own_name) as rec:
        for run, drawn, scene, own, look in zip((a, b), shown, scenes, curves, _LOOKS, strict=True):
            if scene:
                Linkage(rec, f"{look.root}/linkage", timeline, drawn, scene, look.colour, look.bars, look.layer).log()
            for group in own.values():
                log_group(rec, look.root, timeline, drawn, _named(group, look), look.curves)
            log_status(rec, look.root, timeline, timeline.placed(run))
        for group in differences.values():
            log_group(rec, "/difference", timeline, apart or a, group)
        decimation = [
            f"{look.name}: {text}"
            for run, drawn, look in zip((a, b), shown, _LOOKS, strict=True)
            for text in left_out(run, drawn)
        ]
        log_card(rec, _card(a, b, difference, names, [*decimation, *(note for note in notes if note)]))


def _in_common(a: Run, b: Run, path: str | Path) -> Timeline:
    """Return the timeline of two runs."""
    try:
        return timeline_of((a, b))
    except LogError as error:
        raise LogError(f"{path}: {error}") from None


def in_common(a: Run, b: Run, names: tuple[str, str] = ("A", "B")) -> str:
    """Return a line that states which coordinates two runs have in common; '' if both have the same coordinates."""
    common = _common(a, b)
    if len(common) == len(a.outputs) == len(b.outputs):
        return ""
    if not common:
        return f"{names[0]} and {names[1]} have no coordinates in common, so there are no differences to show"
    shown = listed([*common[:MOST_LISTED], *["..."][: len(common) > MOST_LISTED]])
    return (
        f"{names[0]} and {names[1]} have {len(common)} of {len(a.outputs)} and {len(b.outputs)} coordinates in common, "
        f"whose differences are shown: {shown}"
    )


def _common(a: Run, b: Run) -> list[CoordinateName]:
    return [name for name in a.outputs if name in b.outputs]


def _difference(a: Run, b: Run) -> Run | None:
    """Return B - A of the common coordinates at the times, or driver values, of A; None if there are none.

    Where the times differ, B is interpolated linearly, with an error of at most h^2 / 8 times the second derivative.
    """
    common = _common(a, b)
    if not common or not len(a) or not len(b):
        return None
    at = axis_of(a).values
    of_a, of_b = ([run.outputs.index(name) for name in common] for run in (a, b))
    tables = {
        key: _at(at, axis_of(b).values, getattr(b, key)[:, of_b]) - getattr(a, key)[:, of_a]
        for key in ("values", "rates", "accelerations")
    }
    absent = a.absent | b.absent
    return dataclasses.replace(a, outputs=tuple(common), coordinate_count=len(common), absent=absent, **tables)


def _at(times: FloatArray, t: FloatArray, table: FloatArray) -> FloatArray:
    """Return the columns of a table (n, k), given at t, at other times; NaN outside the range of t."""
    if np.array_equal(times, t):
        return table
    if len(t) > 1 and np.all(np.diff(t) < 0.0):
        t, table = t[::-1], table[::-1]
    if np.any(np.diff(t) <= 0.0):
        raise LogError("the runs have different times, and B cannot be interpolated because its times do not increase")
    return np.column_stack([np.interp(times, t, column, left=np.nan, right=np.nan) for column in table.T])


def _named(group: Group, look: _Look) -> Group:
    """Return the group with its curves named after the run, those of B in lighter colours."""
    colours = group.colours if look is _LOOKS[0] else tuple(palette.lighter(colour) for colour in group.colours)
    return dataclasses.replace(group, names=tuple(f"{look.name} {name}" for name in group.names), colours=colours)


def _card(a: Run, b: Run, difference: Run | None, names: tuple[str, str], notes: list[str]) -> str:
    lines = [
        "### B - A",
        "",
        f"**A**, orange: {plain(names[0])}. {sentence(a)}.",
        "",
        f"**B**, blue: {plain(names[1])}. {sentence(b)}.",
        "",
        *[plain(note) for note in notes],
    ]
    if common := in_common(a, b):
        lines += ["", f"{plain(common)}.", ""]
    if difference is None:
        return "\n".join(lines)
    if not np.array_equal(axis_of(a).values, axis_of(b).values):
        lines += [f"{_differ(a)}: B is interpolated linearly at those of A.", ""]
    apart, equal = [], []
    for k, name in enumerate(difference.outputs):
        tables = (difference.values, difference.rates, difference.accelerations)
        largest = [_largest(table[:, k]) for table in tables]
        if set(largest) <= {"0", "-"} and "0" in largest:
            equal.append(plain(name))
        else:
            apart.append(f"| {plain(name)} | " + " | ".join(largest) + " |")
    if apart:
        lines += ["| largest difference | position | velocity | acceleration |", "|---|---:|---:|---:|", *apart, ""]
    if equal:
        lines += [f"Equal in both: {', '.join(equal)}.", ""]
    return "\n".join(lines)


def _differ(run: Run) -> str:
    axis = axis_of(run)
    return "The times differ" if axis.is_time else f"The values of {axis.name} differ"


def _largest(column: FloatArray) -> str:
    known = np.abs(column[np.isfinite(column)])
    return f"{known.max():.2g}" if len(known) else "-"
