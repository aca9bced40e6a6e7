"""Rerun recording of two runs: overlaid, with their differences."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.scene import drawable
from kinfmu.errors import LogError, listed
from kinfmu.log.cdr import nanoseconds
from kinfmu.log.viewer.blueprint import compared
from kinfmu.log.viewer.card import plain
from kinfmu.log.viewer.decimated import decimated
from kinfmu.log.viewer.differences import (
    SAME,
    common,
    difference_of,
    loads_apart,
    loads_of,
    most_apart,
    moves_apart,
    size_of,
)
from kinfmu.log.viewer.linkage import Linkage
from kinfmu.log.viewer.loads import log_loads
from kinfmu.log.viewer.package import require_viewer
from kinfmu.log.viewer.parameters import parameters_apart
from kinfmu.log.viewer.rerun_file import application, left_out, log_card, log_group, log_status, recording
from kinfmu.log.viewer.series import Group, groups
from kinfmu.log.viewer.timeline import Timeline, timeline_of
from kinfmu.run import Run
from kinfmu.run.axis import axis_of
from kinfmu.run.verdict import sentence

MOST_LISTED = 6  # coordinates that a line names
MOST_PERCENT = 1000  # of a difference; a larger part states only that the value in A is small
MOST_ROWS = 10  # efforts of the card's table


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
        MissingPackageError: The viewer is not installed.

    """
    require_viewer(f"{path}: a recording")
    if a.length_unit != b.length_unit:
        raise LogError(
            f"{path}: the runs measure lengths in {a.length_unit} and {b.length_unit}; they need the same unit"
        )
    for run in (a, b):
        nanoseconds(run.t)
    timeline = _in_common(a, b, path)
    difference = difference_of(a, b)
    shown = [timeline.placed(decimated(run)) for run in (a, b)]
    scenes, notes = zip(*(drawable(run) for run in shown), strict=True)
    apart = timeline.placed(decimated(difference)) if difference else None
    differences = groups(apart) if apart else {}
    curves = [
        {key: _named(group, look) for key, group in groups(run).items()}
        for run, look in zip(shown, _LOOKS, strict=True)
    ]
    loads = [
        {group.path: _named(group, look) for group in loads_of(run)} for run, look in zip(shown, _LOOKS, strict=True)
    ]
    load_differences = loads_of(apart) if apart else []
    moved = {key: group for key, group in differences.items() if moves_apart(group, curves[0].get(key))}
    loaded = loads_apart(load_differences, loads[0])
    layout = compared(timeline, (shown[0], shown[1]), scenes, curves, moved, loads, loaded)
    in_views = [group for found in (*curves, differences) for group in found.values()]
    own_name = application(shown, [*in_views, *loads[0].values(), *loads[1].values(), *moved.values(), *loaded])
    with recording(path, f"{names[0]} and {names[1]}", layout, own_name) as rec:
        for number, (run, drawn, scene, own, look) in enumerate(
            zip((a, b), shown, scenes, curves, _LOOKS, strict=True)
        ):
            if scene:
                linkage = Linkage(
                    rec, f"{look.root}/linkage", timeline, drawn, scene, look.colour, look.bars, look.layer
                )
                linkage.log()
                log_loads(linkage)
            for group in (*own.values(), *loads[number].values()):
                log_group(rec, look.root, timeline, drawn, group, look.curves)
            log_status(rec, look.root, timeline, timeline.placed(run))
        for group in (*differences.values(), *load_differences):
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
    shared = common(a, b)
    if len(shared) == len(a.outputs) == len(b.outputs):
        return ""
    if not shared:
        return f"{names[0]} and {names[1]} have no coordinates in common, so there are no differences to show"
    shown = listed([*shared[:MOST_LISTED], *["..."][: len(shared) > MOST_LISTED]])
    return (
        f"{names[0]} and {names[1]} have {len(shared)} of {len(a.outputs)} and {len(b.outputs)} coordinates in common, "
        f"whose differences are shown: {shown}"
    )


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
    ]
    if changed := parameters_apart(a, b):
        rows = [f"| {plain(name)} | {plain(one)} | {plain(other)} |" for name, one, other in changed]
        lines += ["| parameter | A | B |", "|---|---:|---:|", *rows, ""]
    lines += [plain(note) for note in notes]
    if shared := in_common(a, b):
        lines += ["", f"{plain(shared)}.", ""]
    if difference is None:
        return "\n".join(lines)
    if not np.array_equal(axis_of(a).values, axis_of(b).values):
        lines += [f"{_differ(a)}: B is interpolated linearly at those of A.", ""]
    lines += _loads(a, difference)
    apart, equal = [], []
    visible = [_visible(a, difference, table) for table in ("values", "rates", "accelerations")]
    for k, name in enumerate(difference.outputs):
        largest = [_largest(table[:, k]) for table in visible]
        if set(largest) <= {"0", "-"} and "0" in largest:
            equal.append(plain(name))
        else:
            apart.append(f"| {plain(name)} | " + " | ".join(largest) + " |")
    if apart:
        lines += ["| largest difference | position | velocity | acceleration |", "|---|---:|---:|---:|", *apart, ""]
    if equal:
        lines += [f"Equal in both, to a billionth of the largest value: {', '.join(equal)}.", ""]
    return "\n".join(lines)


def _loads(a: Run, difference: Run) -> list[str]:
    """Return a table of the efforts, reactions and signals that differ most, and the number of the others."""
    found = most_apart(a, difference)
    if not found:
        return []
    rows = [
        f"| {plain(one.name)} | {one.largest:.3g} {'' if one.unit == '1' else one.unit} | {_percent(one.part)} |"
        for one in found[:MOST_ROWS]
    ]
    more = len(found) - MOST_ROWS
    rest = [f"{more} more differ less.", ""] if more > 0 else []
    return [
        "",
        "| effort or reaction | largest difference | of its largest value in A |",
        "|---|---:|---:|",
        *rows,
        "",
        *rest,
    ]


def _visible(a: Run, difference: Run, table: str) -> FloatArray:
    """Return a table of B - A in which columns that are only round-off, of the largest value of their kind, are 0."""
    apart, own = np.array(getattr(difference, table)), getattr(a, table)
    of_a = [a.outputs.index(name) for name in difference.outputs]
    for is_angle in (True, False):
        columns = [k for k, name in enumerate(difference.outputs) if name.is_angle == is_angle]
        largest = size_of(own[:, [of_a[k] for k in columns]][a.good])
        for k in columns:
            if size_of(apart[:, k]) <= SAME * largest:
                apart[np.isfinite(apart[:, k]), k] = 0.0
    return apart


def _percent(part: float) -> str:
    """Return '2.5 %', '113 %' or, where the value in A is small, 'over 1000 %'."""
    percent = 100.0 * part
    if percent > MOST_PERCENT:
        return f"over {MOST_PERCENT} %" if part < np.inf else "-"
    return f"{percent:.2g} %" if percent < 10.0 else f"{percent:.0f} %"


def _differ(run: Run) -> str:
    axis = axis_of(run)
    return "The times differ" if axis.is_time else f"The values of {axis.name} differ"


def _largest(column: FloatArray) -> str:
    known = np.abs(column[np.isfinite(column)])
    return f"{known.max():.2g}" if len(known) else "-"
