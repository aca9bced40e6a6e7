"""`kinfmu solve` with values from the command line, and logs of `kinfmu simulate`."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu import log
from kinfmu.log import read
from tests.cli.conftest import Command, read_csv


def test_the_run_of_the_file_is_solved_to_its_end(command: Command, tmp_path: Path) -> None:
    result = command("solve", "fourbar", "-o", "run.csv")
    assert result.exit_code == 0
    assert result.stdout.startswith("181 samples: 175 ok, 6 bridged; worst residual ")
    assert result.stdout.endswith(" s; written to run.csv\n")
    table = read_csv(tmp_path / "run.csv")
    assert table["time"].tolist() == list(range(181))
    np.testing.assert_allclose(table["coupler.x"], 1.0 + np.cos(np.radians(table["time"])), atol=1e-12)
    np.testing.assert_allclose(table["rocker.omega"], math.radians(1.0), atol=1e-12)


def test_driver_values_in_degrees_go_all_the_way_round(command: Command, tmp_path: Path) -> None:
    assert command("solve", "fourbar", "-o", "run.npz", "--angle", "0deg:360deg:361").exit_code == 0
    with np.load(tmp_path / "run.npz") as table:
        np.testing.assert_allclose(table["crank_angle"], np.radians(np.arange(361.0)), atol=1e-14)
        np.testing.assert_allclose(table["coupler.y"], np.sin(table["crank.phi"]), atol=1e-12)
        assert set(table["solver.status"]) <= {0, 2}


def test_driver_values_are_unwrapped_with_wrap(command: Command, refuses: Callable[..., str], tmp_path: Path) -> None:
    assert command("solve", "fourbar", "-o", "run.csv", "--angle", "0deg:700deg:3", "--wrap").exit_code == 0
    assert np.degrees(read_csv(tmp_path / "run.csv")["crank.phi"]) == pytest.approx([0.0, -10.0, -20.0])
    assert "--wrap needs --angle" in refuses("solve", "fourbar", "-o", "run.csv", "--wrap")


def test_driver_values_without_units_are_radians(command: Command, tmp_path: Path) -> None:
    assert command("solve", "fourbar", "-o", "run.csv", "--angle", "0.5:-1.5:5").exit_code == 0
    assert read_csv(tmp_path / "run.csv")["crank_angle"].tolist() == [0.5, 0.0, -0.5, -1.0, -1.5]


def test_times_include_the_end_where_a_step_meets_it(command: Command, tmp_path: Path) -> None:
    assert command("solve", "double_pendulum", "-o", "run.csv", "--times", "0:0.3:0.1").exit_code == 0
    assert read_csv(tmp_path / "run.csv")["time"] == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert command("solve", "double_pendulum", "-o", "run.csv", "--times", "0:0.35s:100ms").exit_code == 0
    assert read_csv(tmp_path / "run.csv")["time"] == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert command("solve", "double_pendulum", "-o", "run.csv", "--times", "1:1:1").exit_code == 0
    assert read_csv(tmp_path / "run.csv")["time"].tolist() == [1.0]


def test_a_parquet_table_has_the_columns_of_the_csv(command: Command, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is optional")
    assert command("solve", "fourbar", "-o", "run.parquet", "--times", "0:2:1").exit_code == 0
    assert command("solve", "fourbar", "-o", "run.csv", "--times", "0:2:1").exit_code == 0
    assert parquet.read_table(tmp_path / "run.parquet").column_names == list(read_csv(tmp_path / "run.csv"))


def test_a_solved_run_is_recorded_for_plots_and_the_viewer(command: Command, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    angles = ("--angle", "0deg:360deg:37")
    message = command("solve", "fourbar", "-o", "run.mcap", *angles).stdout
    assert message.endswith("written to run.mcap\n")
    run = read(tmp_path / "run.mcap")
    solved = kinfmu.solve(kinfmu.load("fourbar"), crank_angle=np.radians(np.linspace(0.0, 360.0, 37)))
    np.testing.assert_allclose(run.values, solved.values, atol=1e-12)
    assert run.mechanism_text == solved.mechanism_text != ""
    assert command("export", "run.mcap", "-o", "run.svg").exit_code == 0
    assert command("solve", "fourbar", "-o", "run.csv", *angles).exit_code == 0
    assert command("export", "run.mcap", "-o", "exported.csv").exit_code == 0
    assert (tmp_path / "exported.csv").read_bytes() == (tmp_path / "run.csv").read_bytes()


def test_a_setting_changes_the_law(command: Command, tmp_path: Path) -> None:
    settings = ("--set", "crank.speed=0.5", "--set", "crank.start=1")
    assert command("solve", "fourbar", "-o", "run.csv", "--times", "0:2:1", *settings).exit_code == 0
    assert read_csv(tmp_path / "run.csv")["crank.phi"] == pytest.approx([1.0, 1.5, 2.0])


def test_only_the_outputs_asked_for_are_in_the_table(command: Command, tmp_path: Path) -> None:
    outputs = ("--outputs", "rocker.phi, A.x")
    assert command("solve", "fourbar", "-o", "run.csv", "--times", "0:2:1", *outputs).exit_code == 0
    names = list(read_csv(tmp_path / "run.csv"))
    assert {"rocker.phi", "rocker.omega", "rocker.alpha", "A.x", "A.vx", "A.ax"} <= set(names)
    assert not [name for name in names if name.startswith("coupler.")]


def test_constants_of_laws_may_carry_their_units(command: Command, tmp_path: Path) -> None:
    settings = ("--set", "crank.speed=30rpm", "--set", "crank.start=45 deg")
    assert command("solve", "fourbar", "-o", "run.csv", "--times", "0:500ms:500ms", *settings).exit_code == 0
    assert read_csv(tmp_path / "run.csv")["crank.phi"] == pytest.approx(np.array([0.25, 0.75]) * np.pi)


def test_a_run_past_a_limit_is_written_reported_and_exits_with_one(command: Command, tmp_path: Path) -> None:
    result = command("solve", "double_pendulum", "-o", "run.csv", "--times", "0:3:0.5")
    assert result.exit_code == 1
    assert "4 ok, 1 near singular, 2 outside" in result.stdout
    assert result.stderr.startswith("kinfmu: at t = 2.5 s: crank = 6.54")
    assert "the limit is crank = 6.283185" in result.stderr
    assert len(result.stderr.splitlines()) == 1
    table = read_csv(tmp_path / "run.csv")
    assert np.isnan(table["lower.phi"]).tolist() == [False] * 5 + [True] * 2
    assert table["solver.status"].tolist() == [0.0] * 4 + [1.0] + [3.0] * 2


def test_a_run_over_driver_values_reports_the_sample_and_its_value_and_no_time(
    fails: Callable[..., str], tmp_path: Path
) -> None:
    message = fails("solve", "double_pendulum", "-o", "run.csv", "--angle", "5:7:8")
    asked = "crank = 6.428571 rad (368.33 deg) cannot be reached"
    assert message.startswith(f"sample 5: {asked}: the limit is crank = 6.283185307")
    table = read_csv(tmp_path / "run.csv")
    assert list(table)[:3] == ["crank_angle", "crank_speed", "crank_acceleration"]
    assert "time" not in table
    np.testing.assert_allclose(table["crank_angle"], np.linspace(5.0, 7.0, 8), rtol=1e-15)
    assert np.isnan(table["lower.phi"]).tolist() == [False] * 5 + [True] * 3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("--set", "crank.sped=1"),
            "--set: there is no parameter 'crank.sped'; did you mean 'crank.speed'?; parameters: "
            "crank.start, crank.speed, solver.tolerance",
        ),
        (("--set", "crank.speed=true"), "--set: crank.speed = 'true' must be a number, alone or with a unit: "),
        (
            ("--outputs", "roker.phi"),
            "fourbar: outputs: 'roker.phi' is not one; did you mean 'rocker.phi'?; outputs: crank.phi, coupler.x, "
            "coupler.y, coupler.phi, rocker.phi, A.x, A.y",
        ),
    ],
)
def test_a_name_or_number_that_the_mechanism_does_not_have_is_reported(
    arguments: tuple[str, ...], message: str, refuses: Callable[..., str]
) -> None:
    assert refuses("solve", "fourbar", "-o", "run.csv", *arguments).startswith(message)


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--times", "0:1", "'0:1' must be A:B:STEP, such as 0:1.5:0.01"),
        ("--times", "1:0:1", "'1:0:1' must increase, with a positive step"),
        ("--times", "0:1:0", "'0:1:0' must increase, with a positive step"),
        ("--times", "0:1:1deg", "'1deg' is not a number (units: s, ms, min, h)"),
        ("--times", "0:inf:1", "'inf' is not a finite number"),
        ("--times", "0:1:1e-18", "'0:1:1e-18' asks for more than 10000000 samples"),
        ("--angle", "0:1", "'0:1' must be A:B:N, such as 0deg:360deg:361"),
        ("--angle", "0:1:1.5", "'0:1:1.5': N = 1.5 must be a whole number of samples"),
        ("--angle", "0:1:0", "'0:1:0': N = 0 must be a whole number of samples"),
        ("--angle", "0:1:1e12", "'0:1:1e12' asks for more than 10000000 samples"),
        ("--angle", "0:1m:3", "'1m' is not a number (units: rad, deg, rev)"),
        ("--set", "crank.speed", "'crank.speed' must be NAME=VALUE, such as crank.speed=30rpm"),
    ],
)
def test_a_value_of_an_option_that_is_invalid_is_wrong_usage(
    option: str, value: str, message: str, refuses: Callable[..., str], tmp_path: Path
) -> None:
    called = "'--angle' / '--position'" if option == "--angle" else f"'{option}'"
    assert refuses("solve", "fourbar", "-o", "run.csv", option, value) == f"Invalid value for {called}: {message}"
    assert not list(tmp_path.iterdir())


def test_a_run_of_too_many_samples_in_the_file_is_reported(
    fails: Callable[..., str], fourbar_file: Callable[..., Path]
) -> None:
    message = fails("solve", fourbar_file("step = 1\n", "step = 1e-9\n"), "-o", "run.csv")
    assert message == "[run] 0 to 180 s in steps of 1e-09 s: more than 10000000 samples"


def test_driver_values_are_lengths_where_a_length_is_driven(
    command: Command, refuses: Callable[..., str], tmp_path: Path
) -> None:
    assert command("solve", "parallel_jaw", "-o", "run.csv", "--position", "-2cm:30mm:3").exit_code == 0
    assert read_csv(tmp_path / "run.csv")["piston_position"].tolist() == [-20.0, 5.0, 30.0]
    assert "'0deg' is not a number (units: m, mm, cm" in refuses(
        "solve", "parallel_jaw", "-o", "r.csv", "--angle", "0deg:3:3"
    )


@pytest.mark.parametrize("speed", ["60rpm", "1 rev/s", "6.283185307179586", "360/1 deg/s"])
def test_driver_values_at_a_speed_have_rates_per_second(
    speed: str, command: Command, refuses: Callable[..., str], tmp_path: Path
) -> None:
    angles = ("--angle", "0deg:180deg:181")
    result = command("solve", "crank_rocker", "-o", "run.csv", *angles, "--speed", speed)
    assert result.exit_code == 0
    assert result.stderr == ""
    table = read_csv(tmp_path / "run.csv")
    assert command("solve", "crank_rocker", "-o", "unit.csv", *angles).exit_code == 0
    unit = read_csv(tmp_path / "unit.csv")
    np.testing.assert_allclose(table["crank_speed"], math.tau, rtol=1e-15)
    np.testing.assert_allclose(table["rocker.omega"], math.tau * unit["rocker.omega"], rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(table["rocker.alpha"], math.tau**2 * unit["rocker.alpha"], rtol=1e-12, atol=1e-12)
    assert "--speed 60rpm needs --angle" in refuses("solve", "fourbar", "-o", "run.csv", "--speed", "60rpm")
    assert "'60mm' is not a number (units: " in refuses("solve", "fourbar", "-o", "r.csv", *angles, "--speed", "60mm")


@pytest.mark.parametrize("step", ["1/360 s", "1/360s", "1/360", "1000/360 ms"])
def test_numbers_may_be_quotients(step: str, command: Command, refuses: Callable[..., str], tmp_path: Path) -> None:
    assert command("solve", "fourbar", "-o", "run.csv", "--times", f"0:1:{step}").exit_code == 0
    np.testing.assert_allclose(read_csv(tmp_path / "run.csv")["time"], np.arange(361) / 360.0, rtol=1e-15)
    for wrong in ("1/0 s", "1/x s", "/3 s", "1/2/3 s"):
        assert "is not a number" in refuses("solve", "fourbar", "-o", "run.csv", "--times", f"0:1:{wrong}")


# ------------------------------------------------------------------------------------------------------------------ set


LINKAGE = """
name = "press"

[parameters]
crank = "40 mm"
rod = "3*crank"
turns = 2 # a second

[units]
length = "mm"

[bodies.ground]
points = { O = [0, 0] }
[bodies.crank]
points = { O = [0, 0], P = ["crank", 0] }
start = { phi = 0.5 }
[bodies.rod]
points = { P = [0, 0], S = ["rod", 0] }
start = { phi = -0.2 }
[joints]
O = { type = "revolute", between = ["ground.O", "crank.O"] }
P = { type = "revolute", between = ["crank.P", "rod.P"] }
guide = { type = "coordinate", of = "rod.S", axis = "y" }
[drivers]
crank = { type = "angle", of = "crank", law = "constant_speed", start = 0.5, speed = "2*pi*turns" }
[points]
slide = "rod.S"
[run]
stop = 0.5
step = 0.01
"""


@pytest.fixture
def press(tmp_path: Path) -> Path:
    path = tmp_path / "press.toml"
    path.write_text(LINKAGE, encoding="utf-8")
    return path


@pytest.fixture
def changed(tmp_path: Path) -> Path:
    """The same file with the numbers that are set elsewhere."""
    path = tmp_path / "changed.toml"
    text = LINKAGE.replace('crank = "40 mm"', "crank = 50").replace("turns = 2 ", "turns = 3 ")
    path.write_text(text, encoding="utf-8")
    return path


SET = ("--set", "crank=5cm", "--set", "turns=3")


def test_solve_with_set_is_solve_of_a_file_with_those_numbers(command: Command, press: Path, changed: Path) -> None:
    assert command("solve", press, *SET, "-o", "set.csv").exit_code == 0
    assert command("solve", changed, "-o", "file.csv").exit_code == 0
    by_set, by_file = read_csv(Path("set.csv")), read_csv(Path("file.csv"))
    assert list(by_set) == list(by_file)
    for name, column in by_file.items():
        if not name.startswith("solver."):
            np.testing.assert_allclose(by_set[name], column, rtol=0, atol=1e-12 * max(1.0, np.abs(column).max()))
    u = 0.5 + 6.0 * np.pi * by_set["time"]
    np.testing.assert_allclose(by_set["slide.x"], 50 * np.cos(u) + np.sqrt(150**2 - (50 * np.sin(u)) ** 2), rtol=1e-13)


def test_driver_values_go_with_other_geometry(command: Command, press: Path) -> None:
    assert command("solve", press, "--set", "crank=50", "--angle", "0deg:90deg:3", "-o", "run.csv").exit_code == 0
    slide = read_csv(Path("run.csv"))["slide.x"]
    np.testing.assert_allclose(slide, [200.0, np.sqrt(0.5) * 50 + np.sqrt(150**2 - 1250), np.sqrt(150**2 - 2500)])


def test_simulate_with_set_steps_the_same_motion(command: Command, press: Path, changed: Path) -> None:
    assert command("simulate", press, *SET, "--mcap", "set.mcap", "--rrd", "set.rrd").exit_code == 0
    run, wanted = kinfmu.log.read("set.mcap"), kinfmu.solve(kinfmu.load(changed))
    np.testing.assert_allclose(run.values, wanted.values, rtol=0, atol=1e-11)
    np.testing.assert_allclose(run.rates, wanted.rates, rtol=0, atol=1e-9)


def test_an_fmu_is_built_with_the_numbers_set_and_takes_others(command: Command, press: Path, changed: Path) -> None:
    assert command("build", press, *SET, "-o", "press.fmu").exit_code == 0
    run = kinfmu.simulate("press.fmu")
    np.testing.assert_allclose(run.values, kinfmu.solve(kinfmu.load(changed)).values, rtol=0, atol=1e-11)
    back = kinfmu.simulate("press.fmu", parameters={"crank": 40.0, "turns": 2.0})
    np.testing.assert_allclose(back.values, kinfmu.solve(kinfmu.load(press)).values, rtol=0, atol=1e-11)


# ----------------------------------------------------------------------------------------------------- logs of simulate


def test_channels_and_rate_choose_what_is_kept(command: Command, tmp_path: Path) -> None:
    result = command("simulate", "fourbar", "--channels", "q, residual", "--rate", "0.1")
    assert result.exit_code == 0
    run = log.read(tmp_path / "logs" / "fourbar.mcap")
    assert run.t.tolist() == [10.0 * k for k in range(19)]
    assert [column.name for column in run.columns()] == ["time", *run.names, "solver.status", "solver.residual"]
    assert result.stdout.startswith("19 samples: ")


def test_a_minus_leaves_out(command: Command, tmp_path: Path) -> None:
    assert command("simulate", "fourbar", "--stop", "2", "--channels", "-error,-residual").exit_code == 0
    run = log.read(tmp_path / "logs" / "fourbar.mcap")
    assert run.absent == {"solver.residual", *(f"solver.error_{order}" for order in ("q", "qd", "qdd"))}


def test_none_leaves_no_logs(command: Command, refuses: Callable[..., str], tmp_path: Path) -> None:
    result = command("simulate", "fourbar", "--channels", "none")
    assert result.exit_code == 0
    assert result.stdout.startswith("181 samples: ")
    assert "nan" not in result.stdout
    assert "written" not in result.stdout
    assert not list(tmp_path.iterdir())
    message = refuses("simulate", "fourbar", "--channels", "none", "--mcap", "run.mcap")
    assert message == "--channels none leaves nothing to write to run.mcap"


@pytest.mark.parametrize(
    ("model", "name"), [("fourbar_chain:2", "fourbar_chain_2"), ("mine.toml", "mine"), ("other.fmu", "other")]
)
@pytest.mark.few(1)
def test_logs_have_the_name_of_what_is_simulated(
    model: str, name: str, command: Command, fourbar_file: Callable[..., Path], tmp_path: Path
) -> None:
    fourbar_file(name="mine.toml")
    assert command("build", "fourbar", "-o", "other.fmu").exit_code == 0
    assert command("simulate", model, "--stop", "1").exit_code == 0
    assert sorted(path.name for path in (tmp_path / "logs").iterdir()) == [f"{name}.mcap", f"{name}.rrd"]


@pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="names of files are Unicode there")
@pytest.mark.parametrize("place", [b"caf\xe9.toml", b"M\xfcll/mine.toml"])  # Latin-1
def test_names_of_files_need_not_be_utf8(
    place: bytes, command: Command, fourbar_file: Callable[..., Path], tmp_path: Path
) -> None:
    file = tmp_path / os.fsdecode(place)
    file.parent.mkdir(exist_ok=True)
    fourbar_file(name="mine.toml").replace(file)
    logs = [file.with_suffix(suffix) for suffix in (".mcap", ".rrd")]
    assert command("simulate", str(file), "--stop", "1", "--mcap", str(logs[0]), "--rrd", str(logs[1])).exit_code == 0
    assert log.read(logs[0]).good.all()
    compared = file.with_name(os.fsdecode(b"\xe9.rrd"))
    assert command("review", str(logs[0]), str(logs[0]), "--save", str(compared)).exit_code == 0
    assert all(b"RRF" in path.read_bytes()[-64:] for path in (logs[1], compared))
