"""What a record holds: tables, verdicts, and every mechanism of the gallery."""

from __future__ import annotations

import csv
import dataclasses
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import NonSeekingReader, make_reader

import kinfmu
from kinfmu.errors import LogError, MissingPackageError, RequestError
from kinfmu.log import McapLog, read, write_mcap, write_rrd, write_table
from kinfmu.log.viewer.card import card
from kinfmu.log.viewer.headless import executable
from kinfmu.run import Event, Run, tables
from kinfmu.run.channels import select
from kinfmu.run.tables import ROWS
from kinfmu.run.verdict import notable_events, sentence
from kinfmu.solver.python.pose import Status
from tests.gallery_members import every_member
from tests.log.runs import fourbar, with_gap, without_samples
from tests.log.sheets import read_xlsx
from tests.log.test_mcap import assert_same


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


@pytest.mark.parametrize("suffix", [".csv", ".npz", ".parquet", ".xlsx"])
def test_negative_zeros_are_written_as_zero(suffix: str, run: Run, tmp_path: Path) -> None:
    path = tmp_path / f"run{suffix}"
    write_table(dataclasses.replace(run, values=np.where(run.values == 0.0, -0.0, run.values)), path)
    if suffix == ".csv":
        assert "-0.0," not in path.read_text()
        return
    if suffix == ".npz":
        with np.load(path) as file:
            column = file["coupler.phi"]
    elif suffix == ".xlsx":
        column = read_xlsx(path)["coupler.phi [rad]"]
    else:
        column = pytest.importorskip("pyarrow.parquet").read_table(path)["coupler.phi"].to_numpy()
    assert not column.any()
    assert not np.signbit(column).any()


def test_an_unknown_kind_of_table_is_refused(run: Run, tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"'\.xls' is not a known format of tables; known: \.csv, \.xlsx, \.par"):
        write_table(run, tmp_path / "run.xls")


def test_a_workbook_holds_numbers_under_names_with_units(run_with_gap: Run, tmp_path: Path) -> None:
    for name in ("a.xlsx", "b.xlsx"):
        write_table(run_with_gap, tmp_path / name, lengths="mm")
    assert (tmp_path / "a.xlsx").read_bytes() == (tmp_path / "b.xlsx").read_bytes()
    table = read_xlsx(tmp_path / "a.xlsx")
    for name, unit, values in run_with_gap.columns():
        is_length = unit in ("m", "m/s", "m/s2")
        shown = table[f"{name} [{'m' if is_length else ''}{unit}]"]
        np.testing.assert_allclose(shown, 1e3 * values if is_length else values, rtol=1e-15)
    assert {"coupler.x [mm]", "coupler.vx [mm/s]", "coupler.ax [mm/s2]", "crank.omega [rad/s]"} <= {*table}


def test_a_table_that_no_spreadsheet_holds_is_refused_and_leaves_nothing(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tables, "MOST_ROWS", 100)
    with pytest.raises(
        RequestError, match=r"run\.xlsx: 181 rows of \d+ columns; a spreadsheet holds 99 of 16384: write"
    ):
        write_table(run, tmp_path / "run.xlsx")
    monkeypatch.setitem(sys.modules, "xlsxwriter", None)
    with pytest.raises(
        MissingPackageError, match=r"run\.xlsx: writing \.xlsx needs XlsxWriter: pip install 'kinfmu\[xlsx\]'$"
    ):
        write_table(run, tmp_path / "run.xlsx")
    assert not list(tmp_path.iterdir())


def test_missing_folders_are_made(run: Run, tmp_path: Path) -> None:
    write_table(run, tmp_path / "new" / "deep" / "run.csv")
    assert (tmp_path / "new" / "deep" / "run.csv").is_file()


# ------------------------------------------------------------------------------------------------------ gallery records


DRAWN = {"/joint_states", "/joint_accelerations", "/robot_description", "/tf"}


def solved(name: str) -> Run:
    mechanism = kinfmu.load(name)
    run = kinfmu.solve(mechanism, np.linspace(mechanism.run.start, mechanism.run.stop, 60))
    return run.part(slice(None), events=run.events)


@every_member
@pytest.mark.few(4)
def test_a_mechanism_of_the_gallery_is_recorded_with_all_that_draws_it(name: str, tmp_path: Path) -> None:
    run, path = solved(name), tmp_path / "run.mcap"
    sink = McapLog(path)
    sink.begin(without_samples(run))
    for start in range(0, 60, 25):
        sink.add(run.part(slice(start, start + 25), events=run.events if start == 50 else ()))
    sink.end(run, "")
    assert_same(run, read(path))
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        count = sum(1 for _ in reader.iter_messages())
        summary = reader.get_summary()
    assert summary.statistics.message_count == count
    assert {channel.topic for channel in summary.channels.values()} == {"/sample", "/log", *DRAWN}
    with path.open("rb") as file:
        assert sum(1 for _ in NonSeekingReader(file, validate_crcs=True).iter_messages()) == count
    process = subprocess.run(
        [executable(), "mcap", "check", "--full", str(path)], capture_output=True, text=True, check=True
    )
    rows = [line.split() for line in process.stdout.splitlines() if "/" in line and "ID" not in line]
    assert {row[0] for row in rows[1:]} == {"ok"}


@pytest.mark.parametrize(
    "channels", [["none"], ["q"], ["-qd", "-margin"], ["residual", "coupler.*"], ["points", "error"]], ids=" ".join
)
@pytest.mark.few(3)
def test_a_recording_is_made_of_what_was_kept(channels: list[str], tmp_path: Path) -> None:
    write_mcap(fourbar(np.arange(181.0)), tmp_path / "run.mcap", channels=channels)
    run = read(tmp_path / "run.mcap")
    assert_same(run, select(fourbar(np.arange(181.0)), channels))
    write_rrd(run, tmp_path / "run.rrd")
    subprocess.run([executable(), "rrd", "verify", str(tmp_path / "run.rrd")], check=True, capture_output=True)


# -------------------------------------------------------------------------------------------------------------- verdict


def test_the_verdict_counts_samples_by_status(run_with_gap: Run) -> None:
    assert sentence(run_with_gap) == "181 samples: 158 ok, 2 bridged, 21 outside; worst residual 1.1e-16 at 90 s"


def test_events_are_in_order_of_time_with_their_levels(run_with_gap: Run) -> None:
    found = [(event.t, event.level) for event in notable_events(run_with_gap)]
    assert found == [(0, "info"), (100, "error"), (180, "info")]


def test_a_failure_is_reported_once_with_its_reason_and_without_its_time(run: Run) -> None:
    reason = "crank = 1.9 rad cannot be reached: the limit is 1.75 rad"
    failed = dataclasses.replace(with_gap(run, 100, 180), events=(Event(100.0, "error", f"at t = 100 s: {reason}"),))
    assert [event for event in notable_events(failed) if event.level == "error"] == [Event(100.0, "error", reason)]


def test_a_failure_that_no_event_explains_is_reported_by_its_status(run: Run) -> None:
    failed = dataclasses.replace(with_gap(run, 100, 120), events=(Event(99.0, "error", "something else"),))
    failures = [event.text for event in notable_events(failed) if event.level == "error"]
    assert failures == [
        "something else",
        "21 samples, up to 120 s (crank 100 to 120 deg), outside: the drivers cannot take the mechanism there",
    ]


def test_a_run_whose_samples_are_all_ok_has_no_events() -> None:
    assert notable_events(fourbar(np.arange(10.0, 20.0))) == []


def test_near_singular_samples_are_a_warning(run: Run) -> None:
    near = dataclasses.replace(run, status=np.where(run.t == 5.0, Status.NEAR_SINGULAR, Status.OK))
    assert [(event.t, event.level) for event in notable_events(near)] == [(5.0, "warning")]


def test_bridged_samples_are_one_line_that_states_which_and_why() -> None:
    run = kinfmu.solve(kinfmu.load("fourbar"), crank_angle=np.radians(np.arange(-2.0, 20.0)))
    (event,) = notable_events(run)
    assert event.text == (
        "5 samples, up to crank = 2 deg, bridged: the equations are singular there, so poses are interpolated across"
    )


def test_the_card_states_mechanism_run_verdict_and_events(run_with_gap: Run) -> None:
    text = card(run_with_gap, "Not drawn: coupler.")
    for part in (
        "### Four-bar crank with a redundant constraint",
        "181 samples, t = 0 to 180 s",
        "* 21 outside: ",
        "Worst residual 1.1e-16",
        "* **100 s:** crank\\_angle = 1.9 rad: the limit is 1.75 rad\n",
        "Watched, set aside as redundant: AB.",
        "Not drawn: coupler.",
    ):
        assert part in text


def test_text_from_outside_cannot_break_the_card(run: Run) -> None:
    odd = dataclasses.replace(run, info={"title": "a | b\n# <c>"}, events=(Event(1.0, "info", "x|y\nz"),))
    assert "### a \\| b \\# \\<c\\>\n" in card(odd)
    assert "* **1 s:** x\\|y z\n" in card(odd)


def test_the_card_lists_the_first_events_and_counts_the_others(run: Run) -> None:
    long = dataclasses.replace(run, events=tuple(Event(float(k), "info", f"event {k}") for k in range(100)))
    assert "* and 90 more, in the log\n" in card(long)
