"""Tables: every column by its name, numbers to the bit."""

from __future__ import annotations

import csv
import dataclasses
from pathlib import Path

import numpy as np
import pytest

from kinfmu.errors import LogError
from kinfmu.log import write_table
from kinfmu.run import Run
from kinfmu.run.tables import ROWS
from tests.log.runs import fourbar


@pytest.mark.few(5)
def test_csv_reads_back_bit_for_bit_with_the_csv_module(any_run: Run, tmp_path: Path) -> None:
    write_table(any_run, tmp_path / "run.csv")
    with (tmp_path / "run.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    columns = list(any_run.columns())
    assert header == [column.name for column in columns]
    table = np.array([[float(text) for text in row] for row in rows])
    for k, column in enumerate(columns):
        np.testing.assert_array_equal(table[:, k], column.values)


def test_a_long_csv_has_every_sample_once(tmp_path: Path) -> None:
    t = 0.01 * np.arange(2 * ROWS + 7)
    write_table(fourbar(t), tmp_path / "run.csv")
    np.testing.assert_array_equal(np.loadtxt(tmp_path / "run.csv", delimiter=",", skiprows=1, usecols=0), t)


def test_csv_reads_with_numpy_in_one_call(run_with_gap: Run, tmp_path: Path) -> None:
    write_table(run_with_gap, tmp_path / "run.csv")
    table = np.loadtxt(tmp_path / "run.csv", delimiter=",", skiprows=1)
    assert table.shape == (181, len(list(run_with_gap.columns())))
    assert np.isnan(table).any()


def test_whole_numbers_stay_whole_in_csv(run: Run, tmp_path: Path) -> None:
    write_table(run, tmp_path / "run.csv")
    with (tmp_path / "run.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["solver.status"] for row in rows[:2]] == ["2", "0"]


def test_parquet_carries_units_and_mechanism(run_with_gap: Run, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    write_table(run_with_gap, tmp_path / "run.parquet")
    table = parquet.read_table(tmp_path / "run.parquet")
    for column in run_with_gap.columns():
        assert table.schema.field(column.name).metadata == {b"unit": column.unit.encode()}
        assert table[column.name].to_numpy().tobytes() == (column.values + 0).tobytes()
    assert table.schema.metadata[b"kinfmu.mechanism"].decode() == run_with_gap.mechanism_text
    assert table.schema.field("coupler.vx").metadata == {b"unit": b"m/s"}


def test_npz_carries_units(any_run: Run, tmp_path: Path) -> None:
    write_table(any_run, tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz") as file:
        units = dict(zip(file["kinfmu.columns"].tolist(), file["kinfmu.units"].tolist(), strict=True))
        assert units == {column.name: column.unit for column in any_run.columns()}
        for column in any_run.columns():
            np.testing.assert_array_equal(file[column.name], column.values)
        assert str(file["kinfmu.mechanism"]) == any_run.mechanism_text


@pytest.mark.parametrize("suffix", [".csv", ".npz", ".parquet"])
def test_negative_zeros_are_written_as_zero(suffix: str, run: Run, tmp_path: Path) -> None:
    path = tmp_path / f"run{suffix}"
    write_table(dataclasses.replace(run, values=np.where(run.values == 0.0, -0.0, run.values)), path)
    if suffix == ".csv":
        assert "-0.0," not in path.read_text()
        return
    if suffix == ".npz":
        with np.load(path) as file:
            column = file["coupler.phi"]
    else:
        column = pytest.importorskip("pyarrow.parquet").read_table(path)["coupler.phi"].to_numpy()
    assert not column.any()
    assert not np.signbit(column).any()


def test_an_unknown_kind_of_table_is_refused(run: Run, tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"'\.xls' is not a known format of tables; known: \.csv, \.parquet, \.npz"):
        write_table(run, tmp_path / "run.xls")


def test_missing_folders_are_made(run: Run, tmp_path: Path) -> None:
    write_table(run, tmp_path / "new" / "deep" / "run.csv")
    assert (tmp_path / "new" / "deep" / "run.csv").is_file()
