"""Inputs over time, from a CSV file or from arrays: checked, and interpolated at the samples of a run."""

from __future__ import annotations

import csv
import math
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from kinfmu.errors import FmuError, RequestError, listed, suggestion
from kinfmu.fmu.interface import Interface
from kinfmu.mechanism import RunSettings
from kinfmu.mechanism.toml_document import read_decimal
from kinfmu.mechanism.valid import quoted
from kinfmu.run import MOST_SAMPLES, Event
from kinfmu.run.driving import is_long, numbers_of, unwrap
from kinfmu.units import Quantity, factors, in_turns, looks_like_degrees, quantity_in, spelled

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

TIME = "time"
LAST_STEP = 1e-6  # of a step: a shorter remainder before `stop` is rounding, not a step
ROUNDING = 1e-9  # of the range: times beyond the table by less are rounding


@dataclass(frozen=True, eq=False)
class InputTable:
    """Values of inputs at given times.

    Attributes:
        t: (r,) times [s], increasing.
        names: Names of the k inputs.
        values: (r, k) values.
        source: Name of the table in messages.
        unitless: Names of columns of a file that have no unit.

    """

    t: NDArray[np.float64]
    names: tuple[str, ...]
    values: NDArray[np.float64]
    source: str
    unitless: tuple[str, ...] = ()

    @property
    def start(self) -> float:
        """Time of the first row [s]."""
        return float(self.t[0])

    @property
    def stop(self) -> float:
        """Time of the last row [s]."""
        return float(self.t[-1])

    def at(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values (n, k) at times (n,), linear between rows.

        Args:
            t: (n,) times [s], increasing.

        Raises:
            RequestError: If a time is before the first row or after the last: there is no extrapolation.

        """
        slack = ROUNDING * max(abs(self.start), abs(self.stop), self.stop - self.start)
        if t[0] < self.start - slack or t[-1] > self.stop + slack:
            raise RequestError(
                f"{self.source}: holds {self.start:g} to {self.stop:g} s, the run goes from {t[0]:g} to {t[-1]:g} s; "
                "choose start and stop within the rows, or add rows: inputs are not extrapolated"
            )
        return np.column_stack([np.interp(t, self.t, column) for column in self.values.T])


def input_table(
    inputs: str | Path | Mapping[str, ArrayLike], interface: Interface, *, wrap: bool = False
) -> InputTable:
    """Return the table of inputs of an FMU.

    Args:
        inputs: CSV file or mapping of arrays by name. The header of a file is such as `time, crank_angle [deg]`, and
            columns are separated by commas, semicolons or tabs. A column without a unit in brackets is in the unit
            that the FMU declares.
        interface: Variables of the FMU.
        wrap: True: angles that jump by more than half a turn are unwrapped.

    Raises:
        FmuError: If the table is faulty.
        RequestError: If the file cannot be read, or `wrap` is true and no column is an angle.

    """
    quantities = {
        variable.name: quantity_in(variable.unit or "1", interface.length_unit)
        for part in ("inputs", "efforts", "loads")
        for variable in interface.inputs(part)
    }
    units = {name: factors(quantity, interface.length_unit) for name, quantity in quantities.items()}
    table = table_of(inputs, units)
    return _unwrapped(table, quantities) if wrap else table


def table_of(inputs: str | Path | Mapping[str, ArrayLike], units: Mapping[str, Mapping[str, float]]) -> InputTable:
    """Return the table of inputs of any model.

    Args:
        inputs: As in `input_table`.
        units: For each input the units that its column may have, with their factors into that of the model.

    Raises:
        FmuError: If the table is faulty.
        RequestError: If the file cannot be read.

    """
    return _from_arrays(inputs, tuple(units)) if isinstance(inputs, Mapping) else _from_csv(Path(inputs), units)


def _unwrapped(table: InputTable, quantities: Mapping[str, Quantity]) -> InputTable:
    """Return the table with its angles unwrapped."""
    angles = [quantities[name] == Quantity("angle") for name in table.names]
    if not any(angles):
        raise RequestError(f"{table.source}: wrap unwraps angles, and no column is one; columns: {listed(table.names)}")
    columns = [unwrap(column) if is_angle else column for column, is_angle in zip(table.values.T, angles, strict=True)]
    return replace(table, values=np.column_stack(columns))


def _from_arrays(inputs: Mapping[str, ArrayLike], known: Sequence[str]) -> InputTable:
    columns = {name: np.atleast_1d(numbers_of(f"inputs: '{name}'", values)) for name, values in inputs.items()}
    _check_names("inputs", list(columns), known)
    rows = len(columns[TIME])
    for name, column in columns.items():
        if column.shape != (rows,):
            raise FmuError(f"inputs: '{name}' has shape {column.shape}, 'time' has {rows} values")
    return _checked("inputs", columns, lambda k: f"sample {k}")


def _from_csv(path: Path, accepted: Mapping[str, Mapping[str, float]]) -> InputTable:
    known = tuple(accepted)
    rows = _rows(path)
    _, first = next(rows, (0, []))
    if not first:
        raise FmuError(f"{path}: is empty; its first line must name the columns: {listed((TIME, *known))}")
    titles = [_title(name) for name in first]
    header = [name for name, _ in titles]
    _check_names(str(path), header, known)
    units = {TIME: factors(Quantity("time"), "m"), **accepted}
    into = [_factor(str(path), name, unit, units[name]) for name, unit in titles]
    columns = [array("d") for _ in header]  # 8 bytes per number, since tables may be long
    lines = array("q")
    for line, row in rows:
        if len(row) != len(header):
            raise FmuError(f"{path}, line {line}: {len(row)} values, the header names {len(header)} columns")
        for name, cell, factor, column in zip(header, row, into, columns, strict=True):
            try:
                column.append(read_decimal(cell) * factor)
            except ValueError:
                point = "; decimals are written with a point" if "," in cell else ""
                raise FmuError(f"{path}, line {line}: {name} = {quoted(cell.strip())} is not a number{point}") from None
        lines.append(line)
        if len(lines) > MOST_SAMPLES:
            raise FmuError(f"{path}, line {line}: more than {MOST_SAMPLES} rows")
    arrays = {name: np.array(column) for name, column in zip(header, columns, strict=True)}
    table = _checked(str(path), arrays, lambda k: f"line {lines[k]}")
    return replace(table, unitless=tuple(name for name, unit in titles if not unit))


def _rows(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows of a CSV file that are not blank, each with its line number."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            first = next((line for line in file if line.strip()), "")
            delimiter = next((mark for mark in ("\t", ";") if mark in first), ",")
            file.seek(0)
            reader = csv.reader(file, delimiter=delimiter)
            try:
                for row in reader:
                    if any(map(str.strip, row)):
                        yield reader.line_num, row
            except csv.Error as error:
                raise FmuError(f"{path}, line {reader.line_num}: {error}") from None
    except UnicodeDecodeError:
        raise FmuError(f"{path}: is not a text file") from None
    except OSError as error:
        raise RequestError(f"{path}: cannot be read ({error.strerror})") from None


def _title(cell: str) -> tuple[str, str]:
    """Return 'crank_angle' and 'deg' for 'crank_angle [deg]'."""
    name, bracket, unit = cell.strip().partition("[")
    return (name.rstrip(), unit[:-1].strip()) if bracket and unit.endswith("]") else (cell.strip(), "")


def _factor(where: str, name: str, unit: str, known: Mapping[str, float]) -> float:
    """Return the factor from the column's unit to the unit of the FMU."""
    if not unit:
        return 1.0
    unit = spelled(unit)
    if unit not in known:
        raise FmuError(
            f"{where}: unit {quoted(unit)} of {name} must be one of {listed(known)}{suggestion(unit, known)}"
        )
    return known[unit]


def _check_names(where: str, names: list[str], known: Sequence[str]) -> None:
    for name in names:
        if name != TIME and name not in known:
            raise FmuError(
                f"{where}: {quoted(name)} is not an input of this FMU{_hint(name, known)}; "
                f"columns: {listed((TIME, *known))}"
            )
        if names.count(name) > 1:
            raise FmuError(f"{where}: column '{name}' occurs twice")
    if TIME not in names:
        raise FmuError(f"{where}: the column 'time' is missing; columns: {listed(names)}")
    if len(names) == 1:
        raise FmuError(f"{where}: the only column is 'time'; inputs: {listed(known)}")


def _hint(title: str, known: Sequence[str]) -> str:
    """Return a hint for the title of a column that is not an input."""
    names = (TIME, *known)
    base, bracket, unit = title.partition("(")
    if bracket and base.strip() in names:
        meant = f"{base.strip()} [{unit.rstrip(' )')}]"
        return f"; did you mean {quoted(meant)}?"
    if any(name in title.split() for name in names):
        return "; separate columns by commas, semicolons or tabs"
    try:
        read_decimal(title)
    except ValueError:
        return suggestion(title, names)
    return "; the first line must name the columns"


def _checked(where: str, columns: Mapping[str, NDArray[np.float64]], place: Callable[[int], str]) -> InputTable:
    """Return the table after checking that it has rows, finite numbers and increasing times; place: names a row."""
    t = columns[TIME]
    if not len(t):
        raise FmuError(f"{where}: holds no samples")
    for name, column in columns.items():
        bad = np.flatnonzero(~np.isfinite(column))
        if len(bad):
            raise FmuError(f"{where}, {place(bad[0])}: {name} = {column[bad[0]]!s} is not a finite number")
    back = np.flatnonzero(np.diff(t) <= 0.0)
    if len(back):
        k = back[0] + 1
        raise FmuError(f"{where}, {place(k)}: time = {t[k]:g} s does not lie after {t[k - 1]:g} s; time must increase")
    names = tuple(name for name in columns if name != TIME)
    return InputTable(t, names, np.column_stack([columns[name] for name in names]), where)


def input_notes(interface: Interface, table: InputTable, start: float | None, stop: float | None) -> Iterator[Event]:
    """Yield events about probable mistakes in a table of inputs.

    Args:
        interface: Variables of the FMU.
        table: Inputs.
        start: Start time of the run [s], if given.
        stop: Stop time of the run [s], if given.

    """
    yield from _span(interface.experiment, table, start, stop)
    for variable in interface.part("inputs")[::3]:
        if variable.unit == "rad" and variable.name in table.names:
            yield from _unlikely(variable.name, table)


def undriven(interface: Interface, table: InputTable | None, t: float) -> Iterator[Event]:
    """Yield a warning at time t [s] if inputs of some drivers are not given: these keep their start values."""
    given = () if table is None else table.names
    still = [variable for variable in interface.part("inputs")[::3] if variable.name not in given]
    if still:
        why = "no inputs are given" if table is None else f"{table.source} does not drive all inputs"
        values = listed(f"{variable.name} stays at {variable.start:.6g} {variable.unit}" for variable in still)
        columns = listed((TIME, *(variable.name for variable in still)))
        yield Event(t, "warning", f"{why}: {values}; to set them, give a CSV file with the columns {columns} (--input)")


def _span(experiment: RunSettings, table: InputTable, start: float | None, stop: float | None) -> Iterator[Event]:
    """Yield a note if start or stop of the run are those of the table and differ from those of the model."""
    if (start is None and table.start != experiment.start) or (stop is None and table.stop != experiment.stop):
        first, last = table.start if start is None else start, table.stop if stop is None else stop
        rows = "as" if start is None and stop is None else "one end as"
        hint = "; add a second row to hold the values until a later time" if table.start == table.stop else ""
        yield Event(
            first, "info", f"the run goes from {first:g} to {last:g} s, {rows} the rows of {table.source}{hint}"
        )


def _unlikely(name: str, table: InputTable) -> Iterator[Event]:
    """Yield a note if an angle without a unit looks like degrees, else a warning if it jumps by over half a turn."""
    angles = table.values[:, table.names.index(name)]
    low, high = float(angles.min()), float(angles.max())
    long = np.flatnonzero(is_long(np.diff(angles)))
    if name in table.unitless and (looks_like_degrees(low) or looks_like_degrees(high)):
        yield Event(
            table.start,
            "info",
            f"{table.source}: {name} has no unit, so it is in rad: {low:g} to {high:g} rad, {in_turns(high - low)}; "
            f"for degrees write '{name} [deg]' in the header",
        )
    elif len(long):
        k = int(long[0])
        jump = math.degrees(angles[k + 1] - angles[k])
        others = f", and {len(long) - 1} more such {'jump' if len(long) == 2 else 'jumps'}" if len(long) > 1 else ""
        yield Event(
            float(table.t[k + 1]),
            "warning",
            f"{table.source}: {name} jumps by {jump:.6g} deg from {table.t[k]:g} to {table.t[k + 1]:g} s{others}; "
            "used as given; --wrap unwraps angles that jump, such as from 360 to 0 deg",
        )


def times(span: RunSettings | InputTable, start: float | None, stop: float | None, step: float) -> NDArray[np.float64]:
    """Return t_k = start + k step (n,), of which stop is the last; start and stop default to those of `span`."""
    first = span.start if start is None else float(start)
    last = span.stop if stop is None else float(stop)
    h = float(step)
    if not np.isfinite([first, last, h]).all() or h <= 0.0 or last < first:
        raise RequestError(
            f"start = {first:g} s, stop = {last:g} s, step = {h:g} s: "
            "a run needs finite times, start <= stop and a positive step"
        )
    if (last - first) / h > MOST_SAMPLES:
        raise RequestError(f"{first:g} to {last:g} s in steps of {h:g} s: more than {MOST_SAMPLES} samples")
    count = int((last - first) / h + LAST_STEP)
    t: NDArray[np.float64] = first + h * np.arange(count + 1, dtype=np.float64)
    if last - t[-1] > LAST_STEP * h:
        return np.append(t, last)
    t[-1] = last
    return t
