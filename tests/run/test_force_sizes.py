"""The sizes of forces in pins and on the ground: columns that are computed from their components and not stored."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu import Run
from kinfmu.draw.stacks import stacks_of
from kinfmu.errors import KinfmuError
from kinfmu.log import read, write_mcap
from kinfmu.log.record import description
from kinfmu.log.table import columns_of, write_table
from kinfmu.run.channels import select
from kinfmu.run.tables import csv_lines
from tests.run.test_forces import loaded

SIZES = ("O.force", "P.force", "S.force", "shaking_force")


@pytest.fixture(scope="module")
def run() -> Run:
    return kinfmu.solve(loaded("slider_crank"), np.linspace(0.0, 0.5, 21))


def header(run: Run, *columns: str) -> list[str]:
    """The names in the first line of a CSV table, without those that are always there."""
    (names,) = csv.reader([next(csv_lines(columns_of(run, columns)))])
    return [name for name in names if name not in ("time", "solver.status")]


@pytest.mark.parametrize("name", SIZES)
def test_a_size_is_a_column_after_its_components(run: Run, name: str) -> None:
    x, y = run[f"{name}_x"], run[f"{name}_y"]
    assert np.ptp(y) > 0.0
    np.testing.assert_allclose(run[name], np.sqrt(x**2 + y**2), rtol=1e-14)
    columns = list(run.columns())
    names = [column.name for column in columns]
    place = names.index(name)
    assert names[place - 2 : place] == [f"{name}_x", f"{name}_y"]
    assert columns[place].unit == run.column_units()[name] == "N"
    np.testing.assert_array_equal(run.to_pandas()[name], run[name])


def test_only_forces_with_two_components_have_a_size(run: Run) -> None:
    assert tuple(run.force_sizes) == SIZES
    assert [column.name for column in run.columns()].count("bore.force") == 1
    assert not kinfmu.solve(kinfmu.load("fourbar"), [0.0]).force_sizes
    with pytest.raises(KinfmuError, match=r"no column 'O\.forces'; did you mean 'O\.force'\?"):
        run["O.forces"]


def test_a_size_is_computed_when_it_is_read() -> None:
    run = kinfmu.solve(loaded("slider_crank"), np.linspace(0.0, 0.5, 21))
    assert run["shaking_force"].any()
    assert callable(run.__dict__["reactions"])  # the shaking force needs none of the others


def test_tables_hold_the_sizes_that_are_chosen(run: Run, tmp_path: Path) -> None:
    assert header(run, "O.force") == ["O.force"]
    assert header(run, "O.*") == ["O.force_x", "O.force_y", "O.force"]
    assert header(run, "O.force_y", "shaking_force") == ["O.force_y", "shaking_force"]
    assert header(run, "reactions", "-O.force*", "-[PS]*", "-bore*") == [
        "shaking_force_x",
        "shaking_force_y",
        "shaking_force",
        "shaking_moment",
    ]
    assert set(SIZES) <= set(header(run, "all"))
    write_table(run, tmp_path / "run.npz", ["O.force"])
    with np.load(tmp_path / "run.npz") as file:
        assert file["kinfmu.columns"].tolist() == ["time", "O.force", "solver.status"]
        np.testing.assert_array_equal(file["O.force"], run["O.force"])


def test_a_parquet_file_describes_the_columns_that_it_holds(run: Run, tmp_path: Path) -> None:
    pq = pytest.importorskip("pyarrow.parquet")
    write_table(run, tmp_path / "run.parquet", ["O.force"])
    table = pq.read_table(tmp_path / "run.parquet")
    assert table.column_names == json.loads(table.schema.metadata[b"kinfmu.columns"])
    assert table.column_names == ["time", "O.force", "solver.status"]
    assert table.schema.field("O.force").metadata[b"unit"] == b"N"


def test_a_record_keeps_the_components_alone(run: Run, tmp_path: Path) -> None:
    assert not set(SIZES) & set(json.loads(description(run)["columns"]))
    write_mcap(run, tmp_path / "all.mcap")
    np.testing.assert_array_equal(read(tmp_path / "all.mcap")["O.force"], run["O.force"])
    write_mcap(run, tmp_path / "one.mcap", channels=["O.force"])
    kept = read(tmp_path / "one.mcap")
    np.testing.assert_array_equal(kept["O.force"], run["O.force"])
    names = [column.name for column in kept.columns()]
    assert names == ["time", "O.force_x", "O.force_y", "O.force", "solver.status"]
    with pytest.raises(KinfmuError, match=r"the run does not hold 'shaking_force_x'"):
        kept["shaking_force"]


def test_a_size_goes_with_its_components(run: Run) -> None:
    left = select(run, ["reactions", "-O.force_x"])
    assert {"O.force_x", "O.force"} <= left.absent
    assert not {"O.force_y", "P.force", "P.force_x"} & left.absent
    assert "P.force" in run.without(["P.force_y"]).absent


def test_an_fmu_gives_its_run_the_sizes(run: Run, tmp_path: Path) -> None:
    kinfmu.build(loaded("slider_crank"), tmp_path / "crank.fmu", flavour="python")
    stepped = kinfmu.simulate(tmp_path / "crank.fmu", stop=0.5, step=0.025, channels=["O.force"])
    np.testing.assert_allclose(stepped["O.force"], run["O.force"], rtol=1e-9)


def test_plots_show_sizes(run: Run) -> None:
    (stack,) = stacks_of(run, ["O.force"])
    assert [(panel.column, panel.label, panel.unit) for panel in stack.panels] == [("O.force", "force", "N")]
    (stack,) = stacks_of(run, ["O.*"])
    assert [panel.label for panel in stack.panels] == ["force_x", "force_y", "force"]
