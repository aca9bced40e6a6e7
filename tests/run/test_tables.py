"""A run as a table of Arrow, pandas and polars: every column by its name, numbers to the bit, units as metadata."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from kinfmu.errors import MissingPackageError
from kinfmu.run import Run
from tests.log.runs import fourbar, with_gap

RUN = with_gap(fourbar(np.arange(20.0)), 5, 7)
UNITS = {place.name: place.unit for place in RUN.places()}


def assert_columns_are(run: Run, table: dict[str, np.ndarray]) -> None:
    assert list(table) == [column.name for column in run.columns()]
    for column in run.columns():
        assert table[column.name].dtype == column.values.dtype, column.name
        assert table[column.name].tobytes() == np.ascontiguousarray(column.values).tobytes(), column.name


def test_arrow_holds_the_units() -> None:
    pytest.importorskip("pyarrow")
    table = RUN.to_arrow()
    assert_columns_are(RUN, {name: table[name].to_numpy() for name in table.column_names})
    assert {field.name: field.metadata[b"unit"].decode() for field in table.schema} == UNITS


def test_pandas_holds_the_units_too() -> None:
    pytest.importorskip("pandas")
    frame = RUN.to_pandas()
    assert_columns_are(RUN, {name: frame[name].to_numpy() for name in frame.columns})
    assert frame.attrs["units"] == UNITS


def test_polars_is_one_call_away() -> None:
    pytest.importorskip("polars")
    frame = RUN.to_polars()
    assert_columns_are(RUN, {name: frame[name].to_numpy() for name in frame.columns})


def test_columns_that_were_not_kept_are_not_in_a_table() -> None:
    pytest.importorskip("pyarrow")
    part = RUN.without({"coupler.x", "solver.margin"})
    assert_columns_are(part, {name: part.to_arrow()[name].to_numpy() for name in part.to_arrow().column_names})
    assert "coupler.x" not in part.to_arrow().column_names


@pytest.mark.parametrize("package", ["pyarrow", "pandas", "polars"])
def test_a_package_that_is_missing_is_named(package: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    call = {"pyarrow": RUN.to_arrow, "pandas": RUN.to_pandas, "polars": RUN.to_polars}[package]
    with pytest.raises(MissingPackageError, match=f"^a table of {package} needs this package: pip install {package}$"):
        call()
