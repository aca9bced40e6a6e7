"""Columns with units: their places in the tables of a run, and tables of Arrow, pandas and polars made of them."""

from __future__ import annotations

import io
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from functools import lru_cache
from importlib import import_module
from math import isfinite
from types import MappingProxyType
from typing import Any, NamedTuple

from numpy.typing import NDArray

from kinfmu.errors import MissingPackageError, RequestError
from kinfmu.units import METRES, CoordinateName, ForceName, InputName, SignalName, degrees_of, force_sizes


class Column(NamedTuple):
    """One column of a table."""

    name: str
    unit: str
    values: NDArray[Any]  # (n,)


ROWS = 4096  # of a CSV file converted at once: Python's numbers take four times the memory


def csv_lines(
    columns: Sequence[Column], *, units: bool = False, separator: str = ",", decimal: str = "."
) -> Iterator[str]:
    """Yield the lines of a CSV table, each with its end: numbers with the shortest text of the same bits.

    Args:
        columns: The columns.
        units: True: names in the first line have their units, such as 'coupler.x [m]'.
        separator: Between the columns.
        decimal: Decimal sign of the numbers.

    Raises:
        RequestError: Separator and decimal sign are equal, or not one character each.

    """
    if len(separator) != 1 or len(decimal) != 1 or separator == decimal:
        raise RequestError(f"separator = {separator!r} and decimal = {decimal!r} must be two different characters")
    names = [_with_unit(column) if units else column.name for column in columns]
    yield separator.join(_quoted(name, separator) for name in names) + "\n"
    for start in range(0, len(columns[0].values), ROWS):
        block = (column.values[start : start + ROWS].tolist() for column in columns)
        for row in zip(*block, strict=True):
            line = separator.join(map(repr, row)) + "\n"
            yield line if decimal == "." else line.replace(".", decimal)


def _with_unit(column: Column) -> str:
    return f"{column.name} [{column.unit}]"


MOST_ROWS, MOST_COLUMNS = 1_048_576, 16_384  # of a spreadsheet, with the row of names


def workbook(columns: Sequence[Column], name: str) -> bytes:
    """Return columns as an .xlsx workbook: names with units in a first row that stays in sight, numbers below it.

    Cells without a finite number are empty. Equal columns give equal bytes.

    Args:
        columns: The columns.
        name: Of the file, in messages.

    Raises:
        RequestError: There are too many rows or columns for a spreadsheet.
        MissingPackageError: XlsxWriter is not installed.

    """
    try:
        from xlsxwriter import Workbook
    except ImportError:
        raise MissingPackageError(f"{name}: writing .xlsx needs XlsxWriter: pip install 'kinfmu[xlsx]'") from None
    rows = len(columns[0].values)
    if rows >= MOST_ROWS or len(columns) > MOST_COLUMNS:
        raise RequestError(
            f"{name}: {rows} rows of {len(columns)} columns; a spreadsheet holds {MOST_ROWS - 1} of {MOST_COLUMNS}: "
            "write .csv, or choose fewer"
        )
    file = io.BytesIO()
    with Workbook(file, {"constant_memory": True}) as book:
        book.set_properties({"created": datetime(1980, 1, 1, tzinfo=UTC)})
        sheet = book.add_worksheet()
        sheet.freeze_panes(1, 0)
        bold = book.add_format({"bold": True})
        for k, column in enumerate(columns):
            sheet.set_column(k, k, max(len(_with_unit(column)) + 1, 9))
            sheet.write_string(0, k, _with_unit(column), bold)
        for start in range(0, rows, ROWS):
            block = (column.values[start : start + ROWS].tolist() for column in columns)
            for number, row in enumerate(zip(*block, strict=True), start + 1):
                for k, value in enumerate(row):
                    if isfinite(value):
                        sheet.write_number(number, k, value)
    return file.getvalue()


def _quoted(name: str, separator: str) -> str:
    """Return a name as a CSV field."""
    return '"' + name.replace('"', '""') + '"' if set(name) & {separator, *'"\n\r'} else name


def in_degrees(column: Column) -> Column:
    """Return a column with angles, and their rates in time, in degrees; other columns as they are."""
    unit, factor = degrees_of(column.unit)
    return column if unit == column.unit else Column(column.name, unit, column.values * factor)


def in_lengths(column: Column, own: str, unit: str | None) -> Column:
    """Return a column of lengths, in the unit `own`, or of their rates, in another unit; other columns as they are."""
    base, slash, per = column.unit.partition("/")
    if unit in (None, own) or base != own or per.startswith(own):
        return column
    return Column(column.name, f"{unit}{slash}{per}", column.values * (METRES[own] / METRES[str(unit)]))


class Tabular(ABC):
    """A value that has columns of one length, and so can be a table of other packages."""

    __slots__ = ()

    @abstractmethod
    def columns(self) -> Iterator[Column]:
        """Yield the columns in their order."""

    def to_arrow(self) -> Any:
        """Return the columns as a pyarrow.Table, with the unit of each in the metadata of its field.

        Raises:
            MissingPackageError: pyarrow is not installed.

        """
        return arrow_table(self.columns())

    def to_pandas(self) -> Any:
        """Return the columns as a pandas.DataFrame, with the units by column in `attrs["units"]`.

        Raises:
            MissingPackageError: pandas is not installed.

        """
        columns = list(self.columns())
        frame = table_package("pandas").DataFrame({column.name: column.values for column in columns})
        frame.attrs["units"] = {column.name: column.unit for column in columns}
        return frame

    def to_polars(self) -> Any:
        """Return the columns as a polars.DataFrame, which has no place for units.

        Raises:
            MissingPackageError: polars is not installed.

        """
        tables = {name: values.tolist() if values.dtype == object else values for name, _, values in self.columns()}
        return table_package("polars").DataFrame(tables)


def arrow_table(columns: Iterable[Column]) -> Any:
    """Return columns as a pyarrow.Table, without nulls, with the unit of each in the metadata of its field."""
    pa = table_package("pyarrow")
    arrays, fields = [], []
    for column in columns:
        arrays.append(pa.array(column.values))
        fields.append(pa.field(column.name, arrays[-1].type, False, {"unit": column.unit}))
    return pa.table(arrays, schema=pa.schema(fields))


def table_package(name: str) -> Any:
    """Import a package of tables, which is not installed with kinfmu.

    Raises:
        MissingPackageError: It is not installed.

    """
    try:
        return import_module(name)
    except ImportError:
        raise MissingPackageError(f"a table of {name} needs this package: pip install {name}") from None


Place = tuple[str, str, int | None]  # of a column: its name, the table, and the number of the column there
NAMES = ("input_names", "outputs", "force_names", "reaction_names", "signal_names", "watch_names")  # fields of a run


@lru_cache(maxsize=64)  # the runs of a model have the same names
def tables_of(
    input_names: tuple[InputName, ...],
    outputs: tuple[CoordinateName, ...],
    force_names: tuple[ForceName, ...],
    reaction_names: tuple[ForceName, ...],
    signal_names: tuple[SignalName, ...],
    watch_names: tuple[str, ...],
) -> tuple[Place, ...]:
    """Return the places of all columns, in their order; names of equal text have equal places."""
    places: list[Place] = [("time", "t", None)]
    places += [(name, "inputs", k) for k, name in enumerate(input_names)]
    for order, table in enumerate(("values", "rates", "accelerations")):
        places += [(name.derivative(order), table, k) for k, name in enumerate(outputs)]
    places += [(name, "forces", k) for k, name in enumerate(force_names)]
    places += [(name, "reactions", k) for k, name in enumerate(reaction_names)]
    places += [(name, "signals", k) for k, name in enumerate(signal_names)]
    places += [(f"solver.{table}", table, None) for table in ("status", "residual", "iterations", "margin")]
    places += [(f"solver.error_{order}", "error", k) for k, order in enumerate(("q", "qd", "qdd"))]
    return (*places, *((f"watch.{name}", "watch", k) for k, name in enumerate(watch_names)))


@lru_cache(maxsize=64)
def index_of(*names: Any) -> Mapping[str, tuple[str, int | None]]:
    """Return the table and the number of the column by name."""
    return {name: (table, column) for name, table, column in tables_of(*names)}


@lru_cache(maxsize=64)
def sizes_of(reaction_names: tuple[ForceName, ...]) -> Mapping[ForceName, tuple[ForceName, ForceName]]:
    """Return the sizes of forces among the reactions, with their components; they are computed, not kept."""
    return MappingProxyType(force_sizes(reaction_names))
