"""Rerun recording of two runs: overlaid, with their differences."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.scene import drawable
from kinfmu.errors import LogError, listed
from kinfmu.log.cdr import check_times
from kinfmu.log.viewer.blueprint import compared
from kinfmu.log.viewer.card import parameters_apart, plain
from kinfmu.log.viewer.linkage import Linkage
from kinfmu.log.viewer.marks import log_loads
from kinfmu.log.viewer.package import require_viewer
from kinfmu.log.viewer.rerun_file import application, left_out, log_card, log_group, log_status, recording
from kinfmu.log.viewer.series import Group, efforts, groups, reactions, signals
from kinfmu.log.viewer.timeline import Timeline, decimated, timeline_of
from kinfmu.run import Run
from kinfmu.run.axis import axis_of
from kinfmu.run.verdict import sentence
from kinfmu.units import CoordinateName, ForceName, SignalName, degrees_of, unit_of

MOST_LISTED = 6  # coordinates that a line names
MOST_PERCENT = 1000  # of a difference; a larger part states only that the value in A is small
MOST_ROWS = 10  # efforts of the card's table
SAME = 1e-9  # of the largest value, a billionth; smaller differences are not visible


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
        check_times(run.t)
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
            log_group(rec, "/difference", timeline, apart or a, group, _LOOKS[1].curves)
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
        units = [degrees_of(unit_of(name.quantity(order, axis_of(a).per), a.length_unit)) for order in range(3)]
        largest = [_largest(table[:, k], *unit) for table, unit in zip(visible, units, strict=True)]
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


def _largest(column: FloatArray, unit: str, factor: float) -> str:
    known = np.abs(column[np.isfinite(column)])
    if not len(known):
        return "-"
    largest = float(f"{known.max() * factor:.2g}")
    return f"{largest:.6g} {unit}" if largest else "0"


class Apart(NamedTuple):
    """The largest difference of a column, with its unit, and relative to the column's largest value."""

    name: str
    largest: float
    unit: str
    part: float


def common(a: Run, b: Run) -> list[CoordinateName]:
    """Return the coordinates that both runs have."""
    return [name for name in a.outputs if name in b.outputs]


def difference_of(a: Run, b: Run) -> Run | None:
    """Return B - A of common coordinates, forces and signals at the times, or driver values, of A; None without any.

    Where the times differ, B is interpolated linearly, with an error of at most h^2 / 8 times the second derivative.
    """
    both = common(a, b)
    if not both or not len(a) or not len(b):
        return None
    at = axis_of(a).values
    tables: dict[str, Any] = {}
    for key in ("values", "rates", "accelerations"):
        tables[key] = _apart(a, b, at, key, [run.outputs for run in (a, b)], both)
    for names_key, key in (("force_names", "forces"), ("reaction_names", "reactions"), ("signal_names", "signals")):
        names = [getattr(run, names_key) for run in (a, b)]
        shared = tuple(name for name in names[0] if name in names[1])
        has_both = getattr(a, key) is not None and getattr(b, key) is not None
        tables[names_key] = shared if has_both else ()
        tables[key] = _apart(a, b, at, key, names, shared) if has_both and shared else None
    absent = a.absent | b.absent
    counted = {"outputs": tuple(both), "coordinate_count": len(both), "absent": absent, "shaking": None}
    return dataclasses.replace(a, **counted, **tables)  # type: ignore[arg-type]  # of several types


def _apart(
    a: Run, b: Run, at: FloatArray, key: str, names: Sequence[Sequence[str]], shared: Sequence[str]
) -> FloatArray:
    """Return B - A of the shared columns of a table."""
    of_a, of_b = ([own.index(name) for name in shared] for own in names)
    of_b_there = _at(at, axis_of(b).values, np.asarray(getattr(b, key))[:, of_b])
    return np.asarray(of_b_there - np.asarray(getattr(a, key))[:, of_a])


def _at(times: FloatArray, t: FloatArray, table: FloatArray) -> FloatArray:
    """Return the columns of a table (n, k), given at t, at other times; NaN outside the range of t."""
    if np.array_equal(times, t):
        return table
    if len(t) > 1 and np.all(np.diff(t) < 0.0):
        t, table = t[::-1], table[::-1]
    if np.any(np.diff(t) <= 0.0):
        raise LogError("the runs have different times, and B cannot be interpolated because its times do not increase")
    return np.column_stack([np.interp(times, t, column, left=np.nan, right=np.nan) for column in table.T])


def loads_of(run: Run) -> list[Group]:
    """Return efforts, energies, reactions and signals of a run, one group for each unit."""
    return [*efforts(run), *reactions(run), *signals(run)]


def moves_apart(group: Group, own: Group | None) -> bool:
    """Return True if a difference of coordinates is visible, compared with the curves of a run itself."""
    return own is None or size_of(group.values) > SAME * max(size_of(own.values), *map(abs, own.shown or (0.0,)))


def loads_apart(differences: Sequence[Group], own: Mapping[str, Group]) -> list[Group]:
    """Return the differences of efforts, reactions and signals that are visible, compared with all of their unit."""
    sizes: dict[str, float] = {}
    for path, group in own.items():
        sizes[_kind(path)] = max(size_of(group.values), sizes.get(_kind(path), 0.0))
    return [one for one in differences if size_of(one.values) > SAME * sizes.get(_kind(one.path), 0.0)]


def _kind(path: str) -> str:
    """Return 'torque' for 'reactions/torque'; the paths of signals are kinds of their own."""
    return path if path.startswith("signals") else path.rpartition("/")[2]


def most_apart(a: Run, difference: Run) -> list[Apart]:
    """Return forces, reactions and signals that differ visibly, those that differ most of their size first."""
    names: tuple[ForceName | SignalName, ...] = (
        *difference.force_names,
        *difference.reaction_names,
        *difference.signal_names,
    )
    found, sizes = [], dict[str, float]()
    for name in names:
        if name in difference.absent:
            continue
        largest, size = (size_of(np.where(a.good, run[name], np.nan)) for run in (difference, a))
        unit = name.unit if isinstance(name, SignalName) else unit_of(name.quantity, a.length_unit)
        kind = name if isinstance(name, SignalName) else unit
        sizes[kind] = max(size, sizes.get(kind, 0.0))
        found.append((kind, Apart(name, largest, unit, largest / size if size else np.inf)))
    visible = [one for kind, one in found if one.largest > SAME * sizes[kind]]
    return sorted(visible, key=lambda one: -one.part)


def size_of(values: FloatArray) -> float:
    """Return the largest size of the numbers among values; 0 without any."""
    return float(np.max(np.abs(values), initial=0.0, where=np.isfinite(values)))
