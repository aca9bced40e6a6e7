"""A run as texts and rows of 8-byte items, and back: the common content of all files that keep a whole run.

The texts hold what is not in the columns: names, units and constants, known when the run begins; the number of samples
and the events, known when it has ended. Floats are written so that they read back to the same bits.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinfmu.draw.scene.completed import with_estimates
from kinfmu.errors import LogError, listed
from kinfmu.mechanism.valid import is_line, quoted
from kinfmu.run import MOST_SAMPLES, Event, Run
from kinfmu.run.axis import SAMPLE, TIME
from kinfmu.solver.python.pose import Status
from kinfmu.units import METRES, ForceName, SignalName, read_coordinate, read_force, read_inputs

FORMAT = "2"  # increased when older files can no longer be read the same way
_INTEGERS = ("status", "iterations")
_TABLES = (
    "inputs",
    "values",
    "rates",
    "accelerations",
    "forces",
    "reactions",
    "signals",
    "error",
    "watch",
)  # of several columns

_ESTIMATED = ("margin", "error")  # tables that follow from mechanism and driver values
_OPTIONAL = ("forces", "reactions", "signals")  # None in a run that has none
Layout = Sequence[tuple[str, list[int] | None]]  # tables by name, and which of their columns, all if None
MOST_COLUMNS = 500_000  # three times those of the largest mechanism
ESTIMATES = ("solver.margin", "solver.error_q", "solver.error_qd", "solver.error_qdd")
LEVELS = ("info", "warning", "error")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,199}(?:\.[a-z]{1,5})?")


def computed_when_read(run: Run) -> frozenset[str]:
    """Return the columns of margins and errors if one is not computed yet: they follow from what the record holds."""
    if not any(map(run.is_lazy, _ESTIMATED)) or not run.mechanism_text or run.absent.intersection(run.input_names):
        return frozenset()
    return frozenset(place.name for place in run.places() if place.table in _ESTIMATED)


def description(run: Run) -> dict[str, str]:
    """Return what is known when a run begins as texts; its info and its mechanism are stored separately."""
    later = computed_when_read(run)
    lists: dict[str, Any] = {
        "columns": [place.name for place in run.places() if place.name not in later],
        "units": {place.name: place.unit for place in run.places()},
        "absent": sorted(run.absent),
        "computed": sorted(later),
        "outputs": run.outputs,
        "coordinate_count": run.coordinate_count,
        "fixed": {name: float(value) for name, value in run.fixed.items()},
        "input_names": run.input_names,
        "watch_names": run.watch_names,
        "length_unit": run.length_unit,
        "axis": run.axis,
    }
    for table, names in (("forces", run.force_names), ("reactions", run.reaction_names)):
        if names:
            lists[table] = {name: name.quantity.kind for name in names}
    if run.signal_names:
        lists["signals"] = {name: name.unit for name in run.signal_names}
    return {"format": FORMAT} | {key: json.dumps(value, ensure_ascii=False) for key, value in lists.items()}


def ending(run: Run) -> dict[str, str]:
    """Return what is known only when a run has ended as texts."""
    return {"samples": json.dumps(len(run)), "events": json.dumps(run.events, ensure_ascii=False)}


def lists_in(texts: Mapping[str, str]) -> dict[str, Any]:
    """Return the values that `description` made texts of; LogError for another format and for lists that disagree."""
    if texts.get("format") != FORMAT:
        raise LogError(f"format {quoted(texts.get('format'))} of the record; this version of kinfmu reads {FORMAT!r}")
    about = lists_of(texts)
    names = [place.name for place in _empty(about, 0).places()]
    if names != about["columns"]:
        raise LogError("columns of the record do not match its outputs, inputs, forces and watches")
    return about


def is_integer(table: str) -> bool:
    """Return True for tables of int64; the others hold float64."""
    return table in _INTEGERS


def layout(run: Run) -> Layout:
    """Return the tables and columns that were kept, in their order."""
    found: list[tuple[str, list[int] | None]] = []
    for name, group in groupby(run.places(kept=False), key=lambda place: place.table):
        places = list(group)
        kept = [place.column or 0 for place in places if place.name not in run.absent]
        if kept:
            found.append((name, kept if len(kept) < len(places) else None))
    return found


def tables(run: Run, columns: Layout) -> list[NDArray[np.generic]]:
    """Return all columns that were kept as tables (n, k) of 8-byte items."""
    found = []
    for name, kept in columns:
        table = _of_columns(np.asarray(getattr(run, name), "<i8" if is_integer(name) else "<f8"))
        found.append(table if kept is None else table[:, kept])
    return found


def _of_columns(table: NDArray[Any]) -> NDArray[Any]:
    """Return a column as a table of one column."""
    return table[:, None] if table.ndim == 1 else table


def run_of(
    about: Mapping[str, Any],
    blocks: Sequence[NDArray[np.uint64]],
    events: Sequence[Event],
    info: Mapping[str, str],
    mechanism_text: str,
    model_description: str,
) -> Run:
    """Return the run that was written.

    about: result of `lists_in`; blocks: (k, columns) rows of `tables`. LogError for samples with an invalid status or
    time.
    """
    run = replace(
        _empty(about, sum(map(len, blocks))),
        mechanism_source=mechanism_text,
        model_description=model_description,
        info=dict(info),
        events=tuple(events),
    )
    _fill(run, blocks)
    if about["computed"]:
        run = with_estimates(run.replaced(absent=frozenset(about["absent"]))).without(about["absent"])
    if not np.isin(run.status, list(Status)).all():
        row = int(np.argmin(np.isin(run.status, list(Status))))
        raise LogError(f"sample {row} has the status {run.status[row]}; known: 0 to {max(Status):d}")
    if not np.isfinite(run.t).all():
        raise LogError(f"time of sample {int(np.argmin(np.isfinite(run.t)))} is not a finite number")
    return run


def _empty(about: Mapping[str, Any], n: int) -> Run:
    """Return a run of n samples that are not filled in yet; columns that were not kept hold NaN."""
    outputs, inputs, watches = (about[key] for key in ("outputs", "input_names", "watch_names"))
    widths = dict.fromkeys(("values", "rates", "accelerations"), len(outputs))
    widths |= {"inputs": len(inputs), "error": 3, "watch": len(watches)}
    widths |= {table: len(about[table]) for table in _OPTIONAL}
    blank: dict[str, Any] = {name: np.empty((n, widths[name])) for name in _TABLES}
    blank |= {table: None for table in _OPTIONAL if not about[table]}
    blank["inputs"] = np.zeros((n, len(inputs)))  # they are read before they are filled
    blank |= {name: np.empty(n) for name in ("residual", "margin")}
    blank |= {name: np.zeros(n, np.int64) for name in _INTEGERS}
    empty = Run.of_texts(
        t=np.empty(n),
        outputs=outputs,
        coordinate_count=about["coordinate_count"],
        fixed=about["fixed"],
        input_names=inputs,
        watch_names=tuple(watches),
        force_names=about["forces"],
        reaction_names=about["reactions"],
        signal_names=about["signals"],
        length_unit=about["length_unit"],
        absent=frozenset(about["absent"]) | frozenset(about["computed"]),
        axis=about["axis"],
        info={},
        **blank,
    )
    for place in empty.places(kept=False):
        if place.name in empty.absent and not is_integer(place.table):
            _of_columns(getattr(empty, place.table))[:, place.column or 0] = np.nan
    return empty


def _fill(run: Run, blocks: Sequence[NDArray[np.uint64]]) -> None:
    """Copy rows into the tables of a run, block by block so that each block stays in the processor's cache."""
    moves = []
    at = 0
    for name, kept in layout(run):
        table = _of_columns(getattr(run, name)).view("<u8")
        columns = slice(None) if kept is None else kept
        count = table.shape[1] if kept is None else len(kept)
        moves.append((table, columns, slice(at, at + count)))
        at += count
    row = 0
    for block in blocks:
        for table, target, source in moves:
            table[row : row + len(block), target] = block[:, source]
        row += len(block)


def lists_of(texts: Mapping[str, str]) -> dict[str, Any]:
    """Return the values in the texts of `record.description`: names by kind, units, constants, counts.

    Raises:
        LogError: A value is missing, of another type or invalid, or a list is too long.

    """
    kinds: dict[str, tuple[Callable[[Any], bool], str]] = {
        "columns": (_are_lines, "names"),
        "units": (_are_texts, "texts by name"),
        "absent": (_are_lines, "names"),
        "outputs": (_are_coordinates, "coordinates"),
        "coordinate_count": (_is_count, "a count"),
        "fixed": (_are_constants, "numbers by coordinate"),
        "input_names": (_are_inputs, "inputs, three for each driver"),
        "watch_names": (_are_lines, "names"),
        "length_unit": (lambda value: isinstance(value, str) and value in METRES, f"one of {listed(METRES)}"),
    }
    found = {}
    for key, (is_valid, valid) in kinds.items():
        found[key] = value = _value(texts, key)
        if isinstance(value, list | dict) and len(value) > MOST_COLUMNS:
            raise LogError(f"{key} of the record: {len(value)} entries; {MOST_COLUMNS} at most")
        if not is_valid(value):
            raise LogError(f"{key} of the record = {quoted(value)} must be {valid}")
    found["axis"] = axis = _value(texts, "axis") if "axis" in texts else TIME  # older records have no axis
    if not isinstance(axis, str):
        raise LogError(f"axis of the record = {quoted(axis)} must be the name of an input, or {TIME} or {SAMPLE}")
    found["computed"] = later = _value(texts, "computed") if "computed" in texts else []  # older records hold estimates
    if not (_are_lines(later) and set(later) <= set(ESTIMATES)):
        raise LogError(f"computed of the record = {quoted(later)} must be names among {listed(ESTIMATES)}")
    found |= {table: _forces(texts, table) for table in ("forces", "reactions")}
    found["signals"] = _signals(texts)
    if found["coordinate_count"] > len(found["outputs"]):
        raise LogError(f"coordinate_count of the record = {found['coordinate_count']} is more than its outputs")
    if len(set(found["columns"])) < len(found["columns"]):
        raise LogError("columns of the record hold a name twice")
    return found


def _forces(texts: Mapping[str, str], key: str) -> tuple[ForceName, ...]:
    """Return the names of forces or of reactions; none in records of mechanisms without masses and loads."""
    kinds = _value(texts, key) if key in texts else {}
    names = [read_force(*entry) for entry in kinds.items()] if _are_texts(kinds) and _are_lines(list(kinds)) else [None]
    if None in names or len(names) > MOST_COLUMNS:
        raise LogError(f"{key} of the record = {quoted(kinds)} must be kinds of quantities, such as 'torque', by name")
    return tuple(name for name in names if name is not None)


def _signals(texts: Mapping[str, str]) -> tuple[SignalName, ...]:
    """Return the names of the outputs of other FMUs; older records have none."""
    units = _value(texts, "signals") if "signals" in texts else {}
    if not (_are_texts(units) and _are_lines(list(units)) and len(units) <= MOST_COLUMNS):
        raise LogError(f"signals of the record = {quoted(units)} must be units by name")
    return tuple(SignalName(*entry) for entry in units.items())


def samples_of(texts: Mapping[str, str]) -> int:
    """Return the number of samples in the texts of `record.ending`; raise a LogError if it is missing or invalid."""
    count = _value(texts, "samples")
    if not _is_count(count):
        raise LogError(f"samples of the record = {quoted(count)} must be a count")
    return int(count)


def events_of(texts: Mapping[str, str]) -> tuple[Event, ...]:
    """Return the events in the texts of `record.ending`; raise a LogError for entries that are not events."""
    entries = _value(texts, "events")
    if not isinstance(entries, list):
        raise LogError(f"events of the record = {quoted(entries)} must be a list")
    for entry in entries:
        if not _is_event(entry):
            raise LogError(f"events of the record: {quoted(entry)} must be [time, level, text]")
    return tuple(Event(float(t), level, text) for t, level, text in entries)


def whole_number(texts: Mapping[str, str], key: str) -> int:
    """Return a whole number that is written as text, default 0; raise a LogError for any other text."""
    text = texts.get(key, "0")
    if not re.fullmatch(r"[+-]?[0-9]{1,12}", text):
        raise LogError(f"{key} of the record = {quoted(text)} must be a whole number")
    return int(text)


def _value(texts: Mapping[str, str], key: str) -> Any:
    """Return the JSON value of a text."""
    if key not in texts:
        raise LogError(f"{key} of the record is missing")
    try:
        return json.loads(texts[key])
    except RecursionError:
        raise LogError(f"{key} of the record is nested too deeply") from None
    except ValueError as error:
        raise LogError(f"{key} of the record is not JSON ({error})") from None


def _is_count(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= MOST_SAMPLES


def _is_number(value: Any) -> bool:
    """Return True for a number that a double can hold; Python's JSON has infinity and NaN as well."""
    return isinstance(value, float) or (isinstance(value, int) and not isinstance(value, bool) and abs(value) < 1e300)


def _are_texts(value: Any) -> bool:
    return isinstance(value, dict) and all(isinstance(text, str) for text in value.values())


def _are_lines(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(name, str) and is_line(name) for name in value)


def _are_coordinates(value: Any) -> bool:
    return _are_lines(value) and all(_NAME.fullmatch(name) and read_coordinate(name) for name in value)


def _are_constants(value: Any) -> bool:
    return isinstance(value, dict) and _are_coordinates(list(value)) and all(map(_is_number, value.values()))


def _are_inputs(value: Any) -> bool:
    return _are_lines(value) and all(map(_NAME.fullmatch, value)) and read_inputs(value) is not None


def _is_event(entry: Any) -> bool:
    return (
        isinstance(entry, list)
        and len(entry) == 3
        and _is_number(entry[0])
        and entry[1] in LEVELS
        and isinstance(entry[2], str)
        and not any("\ud800" <= character <= "\udfff" for character in entry[2])
    )
