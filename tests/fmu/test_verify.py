"""Reference results in FMUs, and hosts that are compared with them."""

from __future__ import annotations

import csv
import re
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import kinfmu
from kinfmu.cli import main
from kinfmu.errors import FmuError, RequestError
from kinfmu.fmu.interface import Drive
from kinfmu.fmu.reference import FOLDER
from tests.fmu.conftest import Build

Built = Callable[[str, Drive], Path]


def texts(fmu: Path) -> dict[str, str]:
    with zipfile.ZipFile(fmu) as zipped:
        return {Path(name).name: zipped.read(name).decode() for name in zipped.namelist() if name.startswith(FOLDER)}


def rows_of(text: str) -> list[list[str]]:
    return list(csv.reader(text.splitlines()))


def write(path: Path, rows: list[list[str]], delimiter: str = ",") -> Path:
    with path.open("w", newline="") as file:
        csv.writer(file, delimiter=delimiter).writerows(rows)
    return path


@pytest.mark.parametrize(("name", "drive"), [("fourbar", "inputs"), ("toggle_press", "time")])
@pytest.mark.few(1)
def test_an_fmu_has_the_results_of_the_solver(built: Built, name: str, drive: Drive) -> None:
    fmu = built(name, drive)
    found = kinfmu.verify(fmu)
    assert found.ok, str(found)
    assert found.samples == 21
    assert found.difference < 1e-10
    header, *rows = rows_of(texts(fmu)[f"{name}_ref.csv"])
    table = np.array(rows, float)
    run = kinfmu.solve(kinfmu.load(name), table[:, 0])
    for column, title in enumerate(header[1:], start=1):
        np.testing.assert_allclose(table[:, column], run[title], rtol=1e-12, atol=1e-12)
    assert ("crank.torque" in header) == (name == "toggle_press")
    inputs = texts(fmu).get(f"{name}_in.csv")
    assert (inputs is not None) == (drive == "inputs")
    if inputs is not None:
        assert rows_of(inputs)[0] == ["time", "crank_angle", "crank_speed", "crank_acceleration"]


def test_results_of_hosts_in_their_formats(built: Built, tmp_path: Path) -> None:
    fmu = built("fourbar", "time")
    header, *rows = rows_of(texts(fmu)["fourbar_ref.csv"])
    ecos = [["iterations", "time", *(f"it::{name}[REAL]" for name in header[1:])]]
    ecos += [[str(k), *(f"{float(value):.6g}" for value in row)] for k, row in enumerate(rows)]
    path = write(tmp_path / "ecos.csv", ecos)
    found = kinfmu.verify(fmu, path)
    assert not found.ok
    assert "the digits of the results may be the difference: compare with --tolerance 1e-05" in str(found)
    assert kinfmu.verify(fmu, path, tolerance=1e-5).ok
    place = header.index("rocker.phi")
    degrees = [["Time", "model.root.fourbar.rocker.phi [deg]"]]
    degrees += [[row[0], repr(float(np.degrees(float(row[place]))))] for row in rows]
    found = kinfmu.verify(fmu, write(tmp_path / "degrees.csv", degrees, ";"), columns=["rocker.phi"])
    assert found.ok, str(found)
    assert found.names == ("rocker.phi",)


@pytest.mark.parametrize("parts", [1, 2, 3, 30])  # of a step of the reference
def test_a_host_that_records_a_step_late_is_reported_at_any_step(built: Built, tmp_path: Path, parts: int) -> None:
    fmu = built("fourbar", "time")
    header, *rows = rows_of(texts(fmu)["fourbar_ref.csv"])
    times, stop = [float(row[0]) for row in rows], float(rows[-1][0])
    t = np.linspace(times[0], stop, 20 * parts + 1)
    run = kinfmu.solve(kinfmu.load("fourbar"), t)
    outputs = np.column_stack([run[name] for name in header[1:]])
    late = np.vstack([outputs[:1], outputs[:-1]])
    table = [header, *([repr(float(time)), *map(repr, row)] for time, row in zip(t, late.tolist(), strict=True))]
    found = kinfmu.verify(fmu, write(tmp_path / "late.csv", table))
    assert (found.is_a_step_late, found.ok) == (True, False)
    assert "the row after each sample equals its reference: this host records outputs a step late" in str(found)
    table[5][1] = repr(float(table[5][1]) + 1.0)  # rows between the samples are not compared, unless they follow one
    table[parts + 2][1] = repr(float(table[parts + 2][1]) + 1.0)
    found = kinfmu.verify(fmu, write(tmp_path / "wrong.csv", table))
    assert (found.is_a_step_late, found.ok) == (False, False)


def test_outputs_that_are_not_in_the_results_fail_unless_others_are_named(built: Built, tmp_path: Path) -> None:
    fmu = built("fourbar", "time")
    table = rows_of(texts(fmu)["fourbar_ref.csv"])
    places = [k for k, name in enumerate(table[0]) if name == "time" or name.startswith("coupler.")]
    path = write(tmp_path / "some.csv", [[row[k] for k in places] for row in table])

    def verified(*columns: str) -> tuple[int, str]:
        done = CliRunner().invoke(main, ["verify", str(fmu), "--results", str(path), *columns])
        return done.exit_code, done.output

    status, text = verified()
    assert status == 1
    assert (
        f"kinfmu: {path}: 12 of 21 outputs are not in the results; to compare only some, name them: --columns" in text
    )
    assert verified(*text.rpartition("name them: ")[2].replace("'", "").split())[0] == 0
    status, text = verified("--columns", "coupler.*")
    assert status == 0
    assert "9 outputs at 21 of 21 samples compared" in text
    status, text = verified("--columns", "coupler.*,crank.phi")
    assert (status, "not in the results: crank.phi" in text) == (1, True)
    status, text = verified("--columns", "copler.x")
    assert status == 2
    assert "columns: the reference results have no output 'copler.x'; did you mean 'coupler.x'?" in text
    assert kinfmu.verify(fmu, columns=["rocker.*"]).names == ("rocker.phi", "rocker.omega", "rocker.alpha")


@pytest.mark.parametrize("titles", [("coupler.x", "coupler.x"), ("a.coupler.x", "b.coupler.x [m]")])
def test_an_output_in_two_columns_is_refused(built: Built, tmp_path: Path, titles: tuple[str, str]) -> None:
    fmu = built("fourbar", "time")
    table = [["time", *titles], ["0", "0", "0"]]
    message = f"output coupler.x is in columns 2, '{titles[0]}' and 3, '{titles[1]}'; leave only one of them"
    with pytest.raises(FmuError, match=re.escape(message)):
        kinfmu.verify(fmu, write(tmp_path / "twice.csv", table))


@pytest.mark.parametrize("shape", ["{!r}", "{:.6g}"])
def test_results_in_another_unit_are_reported(built: Built, tmp_path: Path, shape: str) -> None:
    fmu = built("fourbar", "time")
    header, *rows = rows_of(texts(fmu)["fourbar_ref.csv"])

    def report(factors: dict[str, float]) -> list[str]:
        table = [
            [shape.format(float(one) * factors.get(n, 1.0)) for n, one in zip(header, row, strict=True)] for row in rows
        ]
        found = kinfmu.verify(fmu, write(tmp_path / "host.csv", [header, *table]))
        assert not found.ok
        return [line for line in str(found).splitlines() if line.startswith("units?")]

    assert report({"coupler.x": 1e3, "coupler.y": 1e3, "coupler.vx": 1e3}) == [
        "units? coupler.x, coupler.y: mm in place of m, 1000 times the reference throughout",
        "units? coupler.vx: mm/s in place of m/s, 1000 times the reference throughout",
    ]
    degrees = 180.0 / np.pi
    assert report({"crank.phi": degrees, "coupler.x": 1.0 / 0.0254}) == [
        "units? crank.phi: deg in place of rad, 57.2958 times the reference throughout",
        "units? coupler.x: in in place of m, 39.3701 times the reference throughout",
    ]
    assert report({"coupler.x": 1.5}) == []


@pytest.mark.parametrize("shape", ["{:.0f}", "{:.0e}", "{:.1e}", "0"])
def test_results_of_one_or_two_digits_have_no_tolerance_that_would_do(built: Built, tmp_path: Path, shape: str) -> None:
    fmu = built("fourbar", "time")
    header, *rows = rows_of(texts(fmu)["fourbar_ref.csv"])
    table = [header, *([row[0], *(shape.format(float(value)) for value in row[1:])] for row in rows)]
    found = kinfmu.verify(fmu, write(tmp_path / "host.csv", table))
    assert not found.ok
    assert "--tolerance" not in str(found)


def test_one_wrong_number_is_named(built: Built, tmp_path: Path) -> None:
    fmu = built("fourbar", "time")
    table = rows_of(texts(fmu)["fourbar_ref.csv"])
    place = table[0].index("coupler.x")
    table[8][place] = repr(float(table[8][place]) + 1e-6)
    path = write(tmp_path / "host.csv", table)
    done = CliRunner().invoke(main, ["verify", str(fmu), "--results", str(path)])
    assert done.exit_code == 1
    assert "coupler.x at t = 63 s" in done.output
    assert f"kinfmu: {path}: the results are not those of the reference" in done.output
    found = kinfmu.verify(fmu, write(tmp_path / "short.csv", [table[0], *table[3:8]]))
    assert found.missing[:2] == (0.0, 9.0)
    assert not found.ok
    assert "5 of 21 samples" in str(found)
    done = CliRunner().invoke(main, ["verify", str(fmu)])
    assert done.exit_code == 0
    assert "21 outputs at 21 of 21 samples compared" in done.output


@pytest.mark.parametrize(
    ("dropped", "status", "message"),
    [
        (slice(1, 2), 0, "the results agree at the 20 of 21 samples that they have"),
        (slice(1, 11), 0, "the results agree at the 11 of 21 samples that they have"),
        (slice(1, 12), 1, "host.csv: 11 of 21 samples of the reference are missing"),
        (slice(21, 22), 0, "the results agree at the 20 of 21 samples that they have"),
        (slice(12, 22), 0, "the results agree at the 11 of 21 samples that they have"),
        (slice(11, 22), 1, "host.csv: 11 of 21 samples of the reference are missing"),
        (slice(10, 11), 1, "host.csv: 1 of 21 samples of the reference are missing"),
        (slice(1, 22), 1, "host.csv: 21 of 21 samples of the reference are missing"),
    ],
)
@pytest.mark.few(5)
def test_only_the_first_and_the_last_samples_may_be_missing(
    built: Built, tmp_path: Path, dropped: slice, status: int, message: str
) -> None:
    fmu = built("fourbar", "time")
    table = rows_of(texts(fmu)["fourbar_ref.csv"])
    del table[dropped]
    path = write(tmp_path / "host.csv", table)
    done = CliRunner().invoke(main, ["verify", str(fmu), "--results", str(path)])
    assert done.exit_code == status
    assert message in done.output
    if status == 0:
        assert f"the rows are from {float(table[1][0]):g} s to {float(table[-1][0]):g} s" in done.output
        assert "digits" not in done.output
        table[4][3] = repr(float(table[4][3]) + 1e-3)
        assert not kinfmu.verify(fmu, write(tmp_path / "wrong.csv", table)).ok


def test_drivers_whose_law_is_external_swing(tmp_path: Path) -> None:
    mechanism = kinfmu.load("crank_rocker")
    mechanism = replace(mechanism, drivers=(replace(mechanism.drivers[0], law=kinfmu.External()),))
    fmu = kinfmu.build(mechanism, tmp_path, flavour="python")
    assert kinfmu.verify(fmu).ok
    inputs = np.array(rows_of(texts(fmu)[f"{mechanism.name}_in.csv"])[1:], float)
    assert np.ptp(inputs[:, 1]) > 0.1


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("a,b\n1,2\n", "has no column time; columns: a, b"),
        ("t,coupler.x\n1,2\n", "has no column time; columns: t, coupler.x"),
        ("time,coupler.x\n0,true\n", "row 1 after the header, column 'coupler.x': 'true'; valid are numbers"),
        ("time,b\n1,2\n", "has no output of the FMU, such as crank.phi, coupler.x, coupler.y"),
        (
            "time,coupler.x\n0,1\n1,two\n",
            "is no table of numbers: row 2 after the header, column 'coupler.x': 'two'; valid are numbers with a "
            "decimal point, such as 1234.5",
        ),
        ("time,coupler.x\n0,\n", "is no table of numbers: row 1 after the header, column 'coupler.x': ''; valid are"),
        (
            "time;coupler.x\n0,5;1,5\n",
            "row 1 after the header, column 'time': '0,5'; valid are",
        ),
        (
            'time,coupler.x\n0,"1,000.5"\n',
            "row 1 after the header, column 'coupler.x': '1,000.5'",
        ),
        ("time,x,coupler.x\n0,1\n", "is no table of numbers: row 1 after the header has 2 values, the header 3"),
        ("time,coupler.x\n0,1\nnan,1\n", "row 2 after the header has the time nan"),
        ("time,coupler.x [deg]\n0,2\n", "column 'coupler.x [deg]': unit 'deg' does not fit 'm'"),
        ("", "has no column time; columns: none"),
    ],
)
def test_faulty_results_have_one_line(built: Built, tmp_path: Path, content: str, message: str) -> None:
    path = tmp_path / "host.csv"
    path.write_text(content)
    with pytest.raises(FmuError, match=re.escape(f"{path}: ") + ".*" + re.escape(message)):
        kinfmu.verify(built("fourbar", "time"), path)


def test_damaged_reference_results_and_settings(built: Built, tmp_path: Path) -> None:
    fmu = built("fourbar", "time")
    with pytest.raises(RequestError, match="tolerance = 2 must be above 0 and below 1"):
        kinfmu.verify(fmu, tolerance=2.0)
    for name, new, message in (
        ("fourbar_ref.csv", b"time,coupler.z\n0,1\n1,2\n", "'coupler.z' is no variable"),
        ("fourbar_ref.csv", b"time,coupler.x\n0,1\n", "needs two or more samples at increasing times"),
        ("fourbar_ref.opt", b"StepSize, 1\n", "RelTol is missing"),
    ):
        path = tmp_path / "damaged.fmu"
        with zipfile.ZipFile(fmu) as before, zipfile.ZipFile(path, "w") as after:
            for entry in before.namelist():
                after.writestr(entry, new if entry == f"{FOLDER}/{name}" else before.read(entry))
        with pytest.raises(FmuError, match=re.escape(message)):
            kinfmu.verify(path)


@pytest.mark.parametrize("fmi", [2, 3])
def test_native_fmus_agree_with_the_python_engine(built_native: Build, fmi: int) -> None:
    found = kinfmu.verify(built_native("fourbar", fmi, "inputs"))
    assert found.ok, str(found)
    assert len(found.names) == 21
    assert found.difference < 1e-10


def test_an_fmu_that_torques_drive_has_no_reference(tmp_path: Path) -> None:
    fmu = kinfmu.build(kinfmu.load("fourbar_loaded"), tmp_path / "t.fmu", flavour="python", drive="torque")
    with pytest.raises(FmuError, match=r"t\.fmu: efforts drive this FMU, .* holds no reference results; compare with"):
        kinfmu.verify(fmu)
