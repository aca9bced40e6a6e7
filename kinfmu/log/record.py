"""A run as text and one table of columns, and back: what every file that keeps a whole run stores.

The text holds what the columns do not say: names, units, constants, events. Floats are written so that they read back
to the same bits.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinfmu.errors import LogError
from kinfmu.run import Event, Run

FORMAT = "1"  # raised when files written before can no longer be read the same way
_INTEGERS = ("solver.status", "solver.iterations")
_DIAGNOSTICS = 7  # columns of Run.columns() between the accelerations and the watches


def description(run: Run) -> dict[str, str]:
    """The run without its columns, its info and its mechanism, as texts."""
    lists: dict[str, Any] = {
        "samples": len(run),
        "columns": [column.name for column in run.columns()],
        "units": {column.name: column.unit for column in run.columns()},
        "outputs": run.outputs,
        "coordinate_count": run.coordinate_count,
        "fixed": {name: float(value) for name, value in run.fixed.items()},
        "input_names": run.input_names,
        "watch_names": run.watch_names,
        "length_unit": run.length_unit,
        "events": run.events,
    }
    return {"format": FORMAT} | {key: json.dumps(value, ensure_ascii=False) for key, value in lists.items()}


def column_names(texts: Mapping[str, str]) -> list[str]:
    """Names of the columns that a description tells of."""
    return list(json.loads(texts.get("columns", "[]")))


def words(run: Run) -> NDArray[np.uint64]:
    """All columns side by side as raw 8-byte items, (n, columns): float64, but int64 for status and iterations."""
    columns = [np.asarray(column.values, dtype_of(column.name)).view("<u8") for column in run.columns()]
    return np.column_stack(columns)


def dtype_of(column: str) -> str:
    """'<i8' for columns that count, '<f8' for those that measure."""
    return "<i8" if column in _INTEGERS else "<f8"


def run_of(
    texts: Mapping[str, str], table: NDArray[np.uint64], info: Mapping[str, str], mechanism_text: str, where: str
) -> Run:
    """The run that `description` and `words` were made of; `where` names the file in messages."""
    if texts.get("format") != FORMAT:
        raise LogError(f"{where}: format {texts.get('format')!r} of the record; this kinfmu reads {FORMAT!r}")
    about = {key: json.loads(text) for key, text in texts.items() if key != "format"}
    if table.shape[1] != len(about["columns"]):
        raise LogError(f"{where}: {table.shape[1]} columns of data, but {len(about['columns'])} names")
    if len(table) != about["samples"]:
        raise LogError(f"{where}: holds {len(table)} of {about['samples']} samples; it was cut off or damaged")
    outputs, inputs, watches = (tuple(about[key]) for key in ("outputs", "input_names", "watch_names"))

    def block(start: int, count: int, dtype: str = "<f8") -> NDArray[Any]:
        return np.ascontiguousarray(table[:, start : start + count]).view(dtype).astype(dtype[1:], copy=False)

    first = 1 + len(inputs)
    values, rates, accelerations = (block(first + k * len(outputs), len(outputs)) for k in range(3))
    at = first + 3 * len(outputs)
    return Run(
        t=block(0, 1)[:, 0],
        outputs=outputs,
        coordinate_count=about["coordinate_count"],
        values=values,
        rates=rates,
        accelerations=accelerations,
        fixed=about["fixed"],
        input_names=inputs,
        inputs=block(1, len(inputs)),
        status=block(at, 1, "<i8")[:, 0],
        residual=block(at + 1, 1)[:, 0],
        iterations=block(at + 2, 1, "<i8")[:, 0],
        margin=block(at + 3, 1)[:, 0],
        error=block(at + 4, 3),
        watch_names=watches,
        watch=block(at + _DIAGNOSTICS, len(watches)),
        length_unit=about["length_unit"],
        mechanism_text=mechanism_text,
        info=dict(info),
        events=_events(about["events"]),
    )


def _events(entries: Sequence[Sequence[Any]]) -> tuple[Event, ...]:
    return tuple(Event(float(t), level, text) for t, level, text in entries)
