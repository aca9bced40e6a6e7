"""Tables of a run for other programs: CSV, Excel, Parquet and numpy's npz, one column for each variable."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kinfmu.errors import LogError, MissingPackageError, listed
from kinfmu.files import suffix_of
from kinfmu.log.record import description, ending
from kinfmu.log.target import replacing
from kinfmu.run import Column, Run
from kinfmu.run.channels import kept_columns, select
from kinfmu.run.tables import arrow_table, csv_lines, in_degrees, in_lengths, workbook

SUFFIXES = (".csv", ".xlsx", ".parquet", ".npz")


def write_table(
    run: Run,
    path: str | Path,
    columns: Sequence[str] | None = None,
    *,
    degrees: bool = False,
    lengths: str | None = None,
    **form: Any,
) -> None:
    """Write columns of `run` to a .csv, .xlsx, .parquet or .npz file, in the run's order.

    CSV: one line of names, then one line per sample, as `pandas.read_csv(path)` reads it; samples without numbers are
    nan. A workbook (.xlsx) has names with units in a first row that stays in sight, and empty cells. Parquet (in the
    metadata of fields and table) and npz (`kinfmu.units` for `kinfmu.columns`) also hold units and mechanism. Numbers
    read back to the same bits, of .xlsx to 16 digits, except -0.0, which is written as 0.0.

    Args:
        run: The run.
        path: The file; its suffix chooses the format.
        columns: Names such as 'coupler.x', 'coupler.*', 'q' or '-error', see kinfmu.run.channels; status is always
            written, and time or, of a run over driver values, the inputs. Default: all columns.
        degrees: True: angles, and their rates in time, in deg.
        lengths: Unit of lengths and their rates, such as 'mm'. Default: the run's.
        **form: Of a CSV file: units=True for names such as 'coupler.x [m]' in the first line, and one character each as
            separator= (default: ",") and decimal= (default: ".").

    Raises:
        RequestError: The run has no column of that name.
        LogError: The suffix is unknown, or the file cannot be written.
        MissingPackageError: Parquet without pyarrow, or .xlsx without XlsxWriter.

    """
    _check_suffix(path)
    write_columns(select(run, columns), columns_of(run, columns, degrees=degrees, lengths=lengths), path, **form)


def write_columns(run: Run, columns: Sequence[Column], path: str | Path, **form: Any) -> None:
    """Write columns that are computed from a run, as `write_table` does those of the run; errors as there."""
    suffix = _check_suffix(path)
    if suffix in (".csv", ".xlsx"):
        write_sheet(columns, path, **form)
        return
    with replacing(path) as temporary:
        if suffix == ".parquet":
            _write_parquet(run, temporary, columns)
        else:
            _write_npz(run, temporary, columns)


def write_sheet(columns: Sequence[Column], path: str | Path, **form: Any) -> None:
    """Write columns of equal length to a .csv or .xlsx file; form and errors as of `write_table`."""
    with replacing(path) as temporary:
        if suffix_of(path) == ".xlsx":
            temporary.write_bytes(workbook(columns, str(path)))
            return
        with temporary.open("w", encoding="utf-8", newline="") as file:
            file.writelines(csv_lines(columns, **form))


def _check_suffix(path: str | Path) -> str:
    suffix = suffix_of(path)
    if suffix not in SUFFIXES:
        raise LogError(f"{path}: '{suffix}' is not a known format of tables; known: {listed(SUFFIXES)}")
    return suffix


def columns_of(
    run: Run, names: Sequence[str] | None = None, *, degrees: bool = False, lengths: str | None = None
) -> list[Column]:
    """Return the columns chosen, as `write_table` does, with 0.0 in place of -0.0: its sign has no meaning in a table.

    Raises:
        RequestError: The run has no column of that name.

    """
    kept = None if names is None else kept_columns(run, names)
    found = [
        in_lengths(column._replace(values=column.values + 0), run.length_unit, lengths)
        for column in select(run, names).columns()
        if kept is None or column.name in kept
    ]
    return [*map(in_degrees, found)] if degrees else found


def _write_parquet(run: Run, path: Path, columns: Sequence[Column]) -> None:
    try:
        import pyarrow.parquet as pq
    except ImportError:
        raise MissingPackageError(f"{path}: writing Parquet needs pyarrow: pip install 'kinfmu[parquet]'") from None

    info = {f"info.{key}": value for key, value in run.info.items()}
    about = description(run) | ending(run) | {"mechanism": run.mechanism_text} | info
    about["columns"] = json.dumps([column.name for column in columns], ensure_ascii=False)
    about["units"] = json.dumps({column.name: column.unit for column in columns}, ensure_ascii=False)
    table = arrow_table(columns).replace_schema_metadata({f"kinfmu.{key}": text for key, text in about.items()})
    pq.write_table(table, path, compression="zstd", use_dictionary=False, use_byte_stream_split=True)


def _write_npz(run: Run, path: Path, columns: Sequence[Column]) -> None:
    texts = {
        "kinfmu.columns": np.array([column.name for column in columns]),
        "kinfmu.units": np.array([column.unit for column in columns]),
        "kinfmu.mechanism": np.array(run.mechanism_text),
    }
    with path.open("wb") as file:  # numpy would change the suffix of a path
        np.savez_compressed(file, allow_pickle=False, **{column.name: column.values for column in columns}, **texts)
