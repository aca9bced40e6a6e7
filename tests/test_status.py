"""Status of a sample: 0 to 2 hold numbers and no NaN, 3 to 5 hold none, on every way a run can take."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu import Run
from kinfmu.solver.python import Status
from tests.analysis.linkages import pushed_crank
from tests.log.sheets import read_xlsx
from tests.mechanisms import fourbar, reference_fourbar

LOCKED_AT_90_DEGREES = (4.0, 3.0, 2.5, 2.5)
DIAGNOSTICS = ("residual", "margin", "error", "watch")  # of each sample


def assert_numbers_where_good(run: Run) -> None:
    """Rows of status 0 to 2 are numbers, those of 3 to 5 are not."""
    for table in ("values", "rates", "accelerations", *DIAGNOSTICS):
        numbers = getattr(run, table).reshape(len(run), -1)
        assert not np.isnan(numbers[run.good]).any(), table
        assert np.isnan(numbers[~run.good]).all(), table
    assert set(run.status.tolist()) <= set(map(int, Status))


def passing_a_limit() -> np.ndarray:
    """Crank angles across the limit at 90 degrees and back."""
    before = math.pi / 2 - np.logspace(-1, -15, 15)
    return np.concatenate([[1.0], before, [math.pi / 2, math.pi / 2 + 1e-12, 2.0, 3.0], before[::-1], [0.5]])


@pytest.fixture(scope="module")
def locked() -> Run:
    return kinfmu.solve(fourbar(*LOCKED_AT_90_DEGREES), crank_angle=passing_a_limit(), crank_speed=3.0)


def test_samples_beyond_a_limit_hold_no_numbers_and_those_before_it_do(locked: Run) -> None:
    assert_numbers_where_good(locked)
    assert set(locked.status.tolist()) == {Status.OK, Status.NEAR_SINGULAR, Status.OUTSIDE}
    assert locked.status[17:20].tolist() == [Status.OUTSIDE] * 3
    assert locked.status[[0, -1]].tolist() == [Status.OK] * 2  # not poisoned


def test_bridged_samples_hold_numbers() -> None:
    run = kinfmu.solve(kinfmu.load("fourbar"), crank_angle=np.concatenate([[1.0], math.pi - np.logspace(-2, -15, 14)]))
    assert_numbers_where_good(run)
    assert set(run.status.tolist()) == {Status.OK, Status.BRIDGED}


def test_an_open_redundant_row_is_inconsistent() -> None:
    run = kinfmu.solve(reference_fourbar(bar=1.0 + 5e-12), crank_angle=[1.0, 2.0], tolerance=1e-13)
    assert run.status.tolist() == [Status.INCONSISTENT] * 2
    assert_numbers_where_good(run)
    assert "redundant row AB.length does not close: gap" in run.events[0].text


def test_a_residual_above_the_tolerance_is_not_converged() -> None:
    run = kinfmu.solve(kinfmu.load("crank_rocker"), crank_angle=np.linspace(1.0, 7.0, 40), tolerance=1e-17)
    assert set(run.status.tolist()) == {Status.OK, Status.NOT_CONVERGED}
    assert_numbers_where_good(run)


def test_the_margin_falls_to_zero_where_a_row_of_a_block_vanishes() -> None:
    run = kinfmu.solve(pushed_crank(rod=2.0, offset=0.0), push_position=3.0 - np.logspace(-1, -13, 13))
    assert_numbers_where_good(run)
    m = np.sqrt(3.0 - run["push_position"])  # the determinant goes with the root of the way to the dead centre
    assert (np.diff(run.margin) < 0.0).all()
    assert (run.margin < 2.0 * m).all()
    assert run.status[-1] == Status.NEAR_SINGULAR


@pytest.mark.parametrize("suffix", ["csv", "npz", "parquet", "xlsx"])
def test_tables_have_gaps_where_runs_have(locked: Run, suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"run.{suffix}"
    kinfmu.log.write_table(locked, path)
    table = _read[suffix](path)
    np.testing.assert_array_equal(table["solver.status"], locked.status)
    for column in locked.columns():
        empty = ~np.isfinite(column.values) if suffix == "xlsx" else np.isnan(column.values)  # no cell holds inf
        np.testing.assert_array_equal(np.isnan(table[column.name]), empty, column.name)


def test_logs_have_gaps_where_runs_have(locked: Run, tmp_path: Path) -> None:
    kinfmu.log.write_mcap(locked, tmp_path / "run.mcap")
    again = kinfmu.log.read(tmp_path / "run.mcap")
    assert_numbers_where_good(again)
    for table in ("status", "values", "rates", "accelerations", *DIAGNOSTICS):
        np.testing.assert_array_equal(getattr(again, table), getattr(locked, table), table)


def test_a_simulation_ends_at_the_limit_with_a_sample_that_holds_no_numbers(tmp_path: Path) -> None:
    fmu = kinfmu.build(fourbar(*LOCKED_AT_90_DEGREES, start=1.0), tmp_path / "locked.fmu")
    run = kinfmu.simulate(fmu, stop=1.0, step=0.1)  # at 90 degrees after 0.57 s
    assert_numbers_where_good(run)
    assert run.good[:6].all()
    assert run.status[-1] == Status.OUTSIDE
    assert "cannot be reached: the limit is" in run.events[-1].text


def _csv(path: Path) -> dict[str, np.ndarray]:
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    names = [name.split(" [")[0] for name in rows[0]]
    return {
        name: np.array([float(cell or "nan") for cell in column])
        for name, column in zip(names, zip(*rows[1:], strict=True), strict=True)
    }


def _npz(path: Path) -> dict[str, np.ndarray]:
    with np.load(path) as file:
        return {name: file[name].astype(float) for name in file.files if file[name].dtype.kind in "if"}


def _parquet(path: Path) -> dict[str, np.ndarray]:
    parquet = pytest.importorskip("pyarrow.parquet")
    table = parquet.read_table(path)
    return {name: table[name].to_numpy().astype(float) for name in table.column_names}


def _xlsx(path: Path) -> dict[str, np.ndarray]:
    return {name.split(" [")[0]: values for name, values in read_xlsx(path).items()}


_read: dict[str, Callable[[Path], dict[str, np.ndarray]]] = {
    "csv": _csv,
    "npz": _npz,
    "parquet": _parquet,
    "xlsx": _xlsx,
}
