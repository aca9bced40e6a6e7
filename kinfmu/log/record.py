"""A run as texts and rows of 8-byte items, and back: the common content of all files that keep a whole run.

The texts hold what is not in the columns: names, units and constants, known when the run begins; the number of samples
and the events, known when it has ended. Floats are written so that they read back to the same bits.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinfmu.draw.scene.estimates import with_estimates
from kinfmu.errors import LogError
from kinfmu.log.record_text import lists_of
from kinfmu.mechanism.valid import quoted
from kinfmu.run import Event, Run
from kinfmu.solver.python.status import Status

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

ESTIMATES = ("margin", "error")  # tables that follow from mechanism and driver values
_OPTIONAL = ("forces", "reactions", "signals")  # None in a run that has none


def computed_when_read(run: Run) -> frozenset[str]:
    """Return the columns of margins and errors if one is not computed yet: they follow from what the record holds."""
    if not any(map(run.is_lazy, ESTIMATES)) or not run.mechanism_text or run.absent.intersection(run.input_names):
        return frozenset()
    return frozenset(place.name for place in run.places() if place.table in ESTIMATES)


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


Layout = Sequence[tuple[str, list[int] | None]]  # tables by name, and which of their columns, all if None


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
