"""Inputs over time: from a CSV file or from arrays, checked, and interpolated at the samples of a run."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from kinfmu.errors import FmuError, listed, suggestion

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

TIME = "time"
ROUNDING = 1e-9  # of the range: how far times may lie beyond the table by rounding alone


@dataclass(frozen=True, eq=False)
class InputTable:
    """Values of inputs at given times. t: (r,) [s], increasing; names: the k inputs; values: (r, k)."""

    t: NDArray[np.float64]
    names: tuple[str, ...]
    values: NDArray[np.float64]
    source: str

    def at(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, k) values at times (n,): those of a row where one matches, linear between rows."""
        slack = ROUNDING * max(abs(self.t[0]), abs(self.t[-1]), self.t[-1] - self.t[0])
        if t[0] < self.t[0] - slack or t[-1] > self.t[-1] + slack:
            raise FmuError(
                f"{self.source}: holds {self.t[0]:g} to {self.t[-1]:g} s, the run goes from {t[0]:g} to {t[-1]:g} s"
            )
        return np.column_stack([np.interp(t, self.t, column) for column in self.values.T])


def input_table(inputs: str | Path | Mapping[str, ArrayLike], known: Sequence[str]) -> InputTable:
    """The table in a CSV file (header `time, crank_angle, ...`) or in a mapping of arrays; `known` are the inputs."""
    if isinstance(inputs, Mapping):
        return _from_arrays(inputs, known)
    return _from_csv(Path(inputs), known)


def _from_arrays(inputs: Mapping[str, ArrayLike], known: Sequence[str]) -> InputTable:
    columns = {name: np.atleast_1d(np.asarray(values, dtype=float)) for name, values in inputs.items()}
    _check_names("inputs", list(columns), known)
    rows = len(columns[TIME])
    for name, column in columns.items():
        if column.shape != (rows,):
            raise FmuError(f"inputs: '{name}' has shape {column.shape}, 'time' has {rows} values")
    return _checked("inputs", columns, [f"sample {k}" for k in range(rows)])


def _from_csv(path: Path, known: Sequence[str]) -> InputTable:
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file)
            rows = [(reader.line_num, row) for row in reader if any(map(str.strip, row))]
    except UnicodeDecodeError:
        raise FmuError(f"{path}: is not a text file") from None
    except OSError as error:
        raise FmuError(f"{path}: cannot be read ({error.strerror})") from None
    if not rows:
        raise FmuError(f"{path}: is empty; its first line must name the columns: {listed((TIME, *known))}")
    header = [name.strip() for name in rows[0][1]]
    _check_names(str(path), header, known)
    columns: dict[str, list[float]] = {name: [] for name in header}
    for line, row in rows[1:]:
        if len(row) != len(header):
            raise FmuError(f"{path}, line {line}: {len(row)} values, the header names {len(header)} columns")
        for name, cell in zip(header, row, strict=True):
            try:
                columns[name].append(float(cell))
            except ValueError:
                raise FmuError(f"{path}, line {line}: {name} = '{cell.strip()}' is not a number") from None
    arrays = {name: np.array(values) for name, values in columns.items()}
    return _checked(str(path), arrays, [f"line {line}" for line, _ in rows[1:]])


def _check_names(where: str, names: list[str], known: Sequence[str]) -> None:
    for name in names:
        if name != TIME and name not in known:
            raise FmuError(
                f"{where}: '{name}' is no input of this FMU{suggestion(name, known)}; columns: {listed((TIME, *known))}"
            )
        if names.count(name) > 1:
            raise FmuError(f"{where}: the column '{name}' is there twice")
    if TIME not in names:
        raise FmuError(f"{where}: the column 'time' is missing; columns: {listed(names)}")
    if len(names) == 1:
        raise FmuError(f"{where}: no input beside 'time'; inputs: {listed(known)}")


def _checked(where: str, columns: Mapping[str, NDArray[np.float64]], rows: Sequence[str]) -> InputTable:
    """The table, if it holds at least one row, finite numbers only and increasing times."""
    t = columns[TIME]
    if not len(t):
        raise FmuError(f"{where}: holds no samples")
    for name, column in columns.items():
        bad = np.flatnonzero(~np.isfinite(column))
        if len(bad):
            raise FmuError(f"{where}, {rows[bad[0]]}: {name} = {column[bad[0]]!s} is not a finite number")
    back = np.flatnonzero(np.diff(t) <= 0.0)
    if len(back):
        k = back[0] + 1
        raise FmuError(f"{where}, {rows[k]}: time = {t[k]:g} s does not lie after {t[k - 1]:g} s; time must increase")
    names = tuple(name for name in columns if name != TIME)
    return InputTable(t, names, np.column_stack([columns[name] for name in names]), where)
