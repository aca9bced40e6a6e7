"""Tables of a run for everything else: CSV, Parquet and numpy's npz, one column for each name of the contract."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from kinfmu.errors import LogError, MissingPackageError, listed
from kinfmu.files.whole_file import suffix_of
from kinfmu.log.record import description, ending
from kinfmu.log.target import replacing
from kinfmu.run import Column, Run
from kinfmu.run.channels import select
from kinfmu.run.run import arrow_table

ROWS = 4096  # of a CSV file at once: numbers of Python take four times the memory


def write_table(run: Run, path: str | Path, columns: Sequence[str] | None = None) -> None:
    """Write columns of `run` to a .csv, .parquet or .npz file: all, or those named, in the run's order.

    columns: names such as 'coupler.x', 'coupler.*', 'q' or '-error', as those of channels that a simulation keeps; time
    and status are always there.

    CSV: one line of names, then one a sample, and nothing else, so that `pandas.read_csv(path)` reads it; a sample
    without numbers says nan. Parquet (metadata of fields and table) and npz (`kinfmu.units` beside `kinfmu.columns`)
    carry the units and the mechanism too. Numbers read back to the same bits, but -0.0, which is written as 0.0.

    Raises a RequestError for a name that is not there, a LogError for another suffix or a file that cannot be written,
    MissingPackageError without pyarrow.
    """
    writers = {".csv": _write_csv, ".parquet": _write_parquet, ".npz": _write_npz}
    suffix = suffix_of(path)
    if suffix not in writers:
        raise LogError(f"{path}: '{suffix}' is no table that can be written; known: {listed(writers)}")
    chosen = run if columns is None else select(run, columns)
    with replacing(path) as temporary:
        writers[suffix](chosen, temporary)


def _columns(run: Run) -> list[Column]:
    """The run's columns without negative zeros, which mean nothing to who reads a table."""
    return [column._replace(values=column.values + 0) for column in run.columns()]


def _write_csv(run: Run, path: Path) -> None:
    columns = _columns(run)
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(_quoted(column.name) for column in columns) + "\n")
        for start in range(0, len(run), ROWS):
            block = (column.values[start : start + ROWS].tolist() for column in columns)
            rows = zip(*block, strict=True)
            file.writelines(",".join(map(repr, row)) + "\n" for row in rows)  # repr: shortest text of the same bits


def _quoted(name: str) -> str:
    """A name as a CSV field."""
    return '"' + name.replace('"', '""') + '"' if set(name) & set(',"\n\r') else name


def _write_parquet(run: Run, path: Path) -> None:
    try:
        import pyarrow.parquet as pq
    except ImportError:
        raise MissingPackageError(f"{path}: writing Parquet needs pyarrow: pip install pyarrow") from None

    info = {f"info.{key}": value for key, value in run.info.items()}
    about = description(run) | ending(run) | {"mechanism": run.mechanism_text} | info
    table = arrow_table(_columns(run)).replace_schema_metadata({f"kinfmu.{key}": text for key, text in about.items()})
    pq.write_table(table, path, compression="zstd", use_dictionary=False, use_byte_stream_split=True)


def _write_npz(run: Run, path: Path) -> None:
    columns = _columns(run)
    texts = {
        "kinfmu.columns": np.array([column.name for column in columns]),
        "kinfmu.units": np.array([column.unit for column in columns]),
        "kinfmu.mechanism": np.array(run.mechanism_text),
    }
    with path.open("wb") as file:  # numpy would give a path another suffix
        np.savez_compressed(file, allow_pickle=False, **{column.name: column.values for column in columns}, **texts)
