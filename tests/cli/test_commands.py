"""kinfmu list, new, build and simulate, help, and the command as its own program."""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import click
import fmpy
import numpy as np
import pytest

import kinfmu
from kinfmu import log
from kinfmu.cli import main
from kinfmu.cli.group import ORDER
from kinfmu.fmu.native.platforms import host
from kinfmu.mechanism import gallery
from kinfmu.units import CoordinateName
from tests.cli.conftest import Command, read_csv
from tests.gallery_members import every_member
from tests.log.runs import fourbar

ROOT = Path(__file__).parents[2]


def program(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """The command in a process of its own."""
    return subprocess.run(
        [sys.executable, "-W", "error", "-m", "kinfmu", *arguments],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )


def test_the_help_fits_on_a_terminal_and_cuts_no_sentence(command: Command) -> None:
    text = command("--help").stdout
    assert "..." not in text.partition("Commands:")[2]
    assert max(map(len, text.splitlines())) <= 80


def test_list_names_the_gallery_with_titles(command: Command) -> None:
    result = command("list")
    assert result.exit_code == 0
    assert [line.split()[0] for line in result.stdout.splitlines()] == gallery.names()
    titles = dict(line.split(maxsplit=1) for line in result.stdout.splitlines())
    assert titles["fourbar"] == "Four-bar crank with a redundant constraint"


@every_member
@pytest.mark.few(2)
def test_new_writes_a_commented_file_that_checks(name: str, command: Command, tmp_path: Path) -> None:
    result = command("new", name, "mine.toml")
    assert result.exit_code == 0
    assert result.stdout == (
        "mine.toml: written; next: kinfmu check mine.toml; to see it move: kinfmu play mine.toml\n"
    )
    assert kinfmu.load(tmp_path / "mine.toml") == kinfmu.load(name)
    assert (tmp_path / "mine.toml").read_text(encoding="utf-8").startswith("# ")
    assert command("check", "mine.toml").exit_code == 0


def test_new_starts_from_a_file_of_the_user(
    command: Command, fourbar_file: Callable[..., Path], tmp_path: Path
) -> None:
    source = fourbar_file("stop = 180", "stop = 90")
    assert command("new", source, "copy.toml").exit_code == 0
    assert (tmp_path / "copy.toml").read_bytes() == source.read_bytes()


def test_new_does_not_overwrite(refuses: Callable[..., str], tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text("precious")
    assert refuses("new", "fourbar", "mine.toml") == "mine.toml: exists already; nothing was written"
    assert (tmp_path / "mine.toml").read_text() == "precious"


def test_new_reports_a_file_that_cannot_be_written(fails: Callable[..., str]) -> None:
    assert fails("new", "fourbar", "n" * 300 + ".toml").endswith(": cannot be written (File name too long)")


def test_build_and_simulate_step_an_fmu_into_logs(command: Command, tmp_path: Path) -> None:
    built = command("build", "fourbar", "-o", "four.fmu")
    assert built.exit_code == 0
    assert re.fullmatch(
        r"four\.fmu: \d+ kB, python FMU for x86_64-linux, x86_64-windows in hosts that contain Python, "
        r"FMI 2\.0 co-simulation, driven by time\n",
        built.stdout,
    )
    logs = ("--mcap", "four.mcap", "--rrd", "four.rrd")
    result = command("simulate", "four.fmu", "--start", "20", "--stop", "30", "--step", "5", *logs)
    assert result.exit_code == 0
    assert result.stdout.splitlines()[1:] == ["to review it: kinfmu review four.mcap"]
    assert result.stdout.startswith("3 samples: 3 ok; worst residual ")
    run = log.read(tmp_path / "four.mcap")
    assert run.t.tolist() == [20.0, 25.0, 30.0]
    assert run["coupler.y"][2] == pytest.approx(0.5, abs=1e-12)
    assert (tmp_path / "four.rrd").stat().st_size > 0
    assert not (tmp_path / "logs").exists()


def test_simulate_builds_a_mechanism_first_and_logs_into_logs(
    command: Command, fourbar_file: Callable[..., Path], tmp_path: Path
) -> None:
    result = command("simulate", fourbar_file(), "--stop", "2", "--set", "crank.speed=0.5", "--set", "crank.start=0.25")
    assert result.exit_code == 0
    assert sorted(path.name for path in (tmp_path / "logs").iterdir()) == ["mine.mcap", "mine.rrd"]
    assert log.read(tmp_path / "logs" / "mine.mcap")["crank.phi"] == pytest.approx([0.25, 0.75, 1.25])
    assert "replaced" not in result.stdout
    again = command("simulate", "mine.toml", "--stop", "2")
    assert again.stdout.splitlines()[0].endswith("logs/mine.rrd (an older run of that name was replaced)")


def test_an_fmu_is_named_after_the_mechanism_and_logs_after_the_file_given(
    command: Command, fourbar_file: Callable[..., Path], tmp_path: Path
) -> None:
    file = fourbar_file('name = "fourbar"', 'name = "press"').name
    assert command("build", file).stdout.startswith("press.fmu: ")
    assert "written to logs/mine.mcap" in command("simulate", file, "--stop", 1).stdout.replace(os.sep, "/")
    assert command("solve", file, "-o", "table.npz", "--times", "0:1:1").exit_code == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["logs", "mine.toml", "press.fmu", "table.npz"]
    assert log.read(tmp_path / "logs" / "mine.mcap").info["name"] == "press"
    with np.load(tmp_path / "table.npz") as table:
        assert 'name = "press"' in str(table["kinfmu.mechanism"])


def test_the_recording_is_written_into_the_folder_of_the_record(command: Command, tmp_path: Path) -> None:
    result = command("simulate", "fourbar", "--stop", "2", "--mcap", "one.mcap")
    assert result.stdout.splitlines()[0].endswith("written to one.mcap and one.rrd")
    assert (tmp_path / "one.rrd").stat().st_size > 0
    assert not (tmp_path / "logs").exists()


def test_simulate_takes_inputs_from_a_csv(command: Command, tmp_path: Path) -> None:
    (tmp_path / "inputs.csv").write_text("time,crank_angle\n0,0.5\n2,1.5\n")
    assert command("simulate", "fourbar", "--stop", "2", "--input", "inputs.csv").exit_code == 0
    assert log.read(tmp_path / "logs" / "fourbar.mcap")["crank.phi"] == pytest.approx([0.5, 1.0, 1.5])


def test_simulate_unwraps_angles_with_wrap(command: Command, tmp_path: Path) -> None:
    (tmp_path / "inputs.csv").write_text("time,crank_angle [deg]\n0,350\n2,10\n")
    assert command("simulate", "fourbar", "--stop", "2", "--input", "inputs.csv", "--wrap").exit_code == 0
    angles = log.read(tmp_path / "logs" / "fourbar.mcap")["crank.phi"]
    assert angles == pytest.approx([math.radians(350), math.tau, math.radians(370)])


def test_simulate_reports_a_limit_and_keeps_what_was_reached(command: Command, tmp_path: Path) -> None:
    result = command("simulate", "double_pendulum", "--stop", "3", "--step", "0.5")
    assert result.exit_code == 1
    assert result.stderr.startswith("kinfmu: at t = 2.5 s: crank")
    assert "crank = 6.544985 rad (375 deg) cannot be reached: the limit is crank = 6.28318530" in result.stderr
    assert len(result.stderr.splitlines()) == 1
    run = log.read(tmp_path / "logs" / "double_pendulum.mcap")
    assert run.good[:5].all()


def test_review_of_a_run_that_is_missing_is_reported(refuses: Callable[..., str], tmp_path: Path) -> None:
    (tmp_path / "fourbar.mcap").touch()
    message = refuses("review", "forbar.mcap", "--save", "none.rrd")
    assert message.endswith("forbar.mcap: there is no such file; did you mean 'fourbar.mcap'?")


def test_review_says_what_two_runs_have_in_common(command: Command, tmp_path: Path) -> None:
    run = fourbar(np.arange(3.0))
    log.write_mcap(run, tmp_path / "a.mcap")
    log.write_mcap(
        replace(run, outputs=tuple(CoordinateName(f"b_{name.owner}", name.axis) for name in run.outputs)),
        tmp_path / "b.mcap",
    )
    result = command("review", "a.mcap", "b.mcap", "--save", "both.rrd")
    assert (result.exit_code, result.stdout) == (0, "written: both.rrd\n")
    assert result.stderr == (
        "kinfmu: note: a.mcap and b.mcap have no coordinates in common, so there are no differences to show\n"
    )
    assert command("review", "a.mcap", "a.mcap", "--save", "both.rrd").stderr == ""


def test_every_command_explains_itself(command: Command) -> None:
    assert command("--version").stdout == f"kinfmu, version {kinfmu.VERSION}\n"
    message = command("-h").stdout
    for name, one in main.commands.items():
        assert f"  {name} " in message
        explained = command(name, "--help")
        assert explained.exit_code == 0
        assert (one.help or "").split("\n")[0][:60] in " ".join(explained.stdout.split())
        assert re.search(rf"^  Example: kinfmu {name}\b.*$", explained.stdout, re.MULTILINE)
        assert not [option.name for option in one.params if isinstance(option, click.Option) and not option.help]


def test_commands_are_listed_in_the_order_of_work(command: Command) -> None:
    message = re.findall(r"^  (\w+)  ", command("-h").stdout.split("Commands:\n")[1], re.MULTILINE)
    assert message == [name for name in ORDER if name in main.commands]


@pytest.mark.parametrize("name", list(main.commands))
def test_examples_of_the_help_are_of_the_commands_own_options(name: str) -> None:
    one = main.commands[name]
    used = re.findall(r" (--?[a-z]+)", one.epilog or "")
    assert set(used) <= {option for parameter in one.params for option in parameter.opts}


def test_an_unknown_command_is_wrong_usage(refuses: Callable[..., str]) -> None:
    assert refuses("chek").startswith("No such command 'chek'")


def test_the_program_checks_a_mechanism_in_a_process_of_its_own(tmp_path: Path) -> None:
    done = program("check", "double_pendulum", cwd=tmp_path)
    assert done.returncode == 0
    assert done.stderr == ""
    assert "ok  Moves with one driver: crank from 180 deg to 360 deg; " in done.stdout


def test_the_package_is_a_program_too(tmp_path: Path) -> None:
    command = [sys.executable, "-W", "error", "-m", "kinfmu", "--version"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.endswith(f", version {kinfmu.VERSION}\n")


@pytest.mark.long
def test_the_program_reports_a_wrong_bar_on_stderr(tmp_path: Path, fourbar_file: Callable[..., Path]) -> None:
    path = fourbar_file("length = 1\n", "length = 1.01\n")
    done = program("solve", path.name, "-o", "run.csv", cwd=tmp_path)
    assert done.returncode == 1
    assert done.stdout == ""
    assert re.fullmatch(r"kinfmu: mine\.toml: \[joints\.AB\] contradicts .*: gap 0\.01 m.*\n", done.stderr)


def test_the_program_reports_wrong_usage_with_status_two(tmp_path: Path) -> None:
    done = program("solve", "fourbar", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.endswith("Error: Missing option '-o'.\n")


@pytest.fixture
def slider(tmp_path: Path) -> Path:
    """A slider-crank of two parameters."""
    path = tmp_path / "slider.toml"
    path.write_text(
        """
        name = "slider"
        parameters = { crank = 1.0, rod = "3*crank" }
        bodies.ground = { points = { O = [0, 0] } }
        bodies.crank = { points = { O = [0, 0], P = ["crank", 0] }, start = { phi = "50 deg" } }
        bodies.rod = { points = { P = [0, 0], S = ["rod", 0] }, start = { x = 0.6, y = 0.8 } }
        joints.O = { type = "revolute", between = ["ground.O", "crank.O"] }
        joints.P = { type = "revolute", between = ["crank.P", "rod.P"] }
        joints.guide = { type = "coordinate", of = "rod.S", axis = "y" }
        drivers.crank = { type = "angle", of = "crank", law = "constant_speed", start = "50 deg" }
        """
    )
    return path


def test_parameters_are_set_for_a_check_and_a_build(command: Command, slider: Path, tmp_path: Path) -> None:
    whole, part = command("check", slider), command("check", slider, "--set", "rod=90cm")
    assert "crank turns all the way round" in whole.stdout
    assert "crank turns all the way round" not in part.stdout
    assert command("check", slider, "--set", "crank=100cm", "--set", "rod=crank + 2 m").stdout == whole.stdout
    assert command("build", slider, "-o", "one.fmu", "--set", "crank=50cm").exit_code == 0
    half = slider.read_text().replace("crank = 1.0", 'crank = "50 cm"')
    (tmp_path / "half.toml").write_text(half)
    assert command("build", "half.toml", "-o", "two.fmu").exit_code == 0
    for path in (tmp_path / "one.fmu", tmp_path / "two.fmu"):
        variables = fmpy.read_model_description(path).modelVariables
        assert [float(variable.start) for variable in variables if variable.name == "crank"] == [0.5]
    one, two = kinfmu.simulate(tmp_path / "one.fmu"), kinfmu.simulate(tmp_path / "two.fmu")
    assert one.names == two.names
    np.testing.assert_allclose(one.values, two.values, rtol=0.0, atol=1e-12)


@pytest.mark.long
def test_what_a_check_takes_a_solve_and_a_simulation_take_too(command: Command, slider: Path, tmp_path: Path) -> None:
    paced = slider.read_text().replace("parameters = { ", 'parameters = { pace = "1 rad/s", ')
    slider.write_text(paced.replace("law = ", 'speed = "pace", law = '))
    for setting in ("crank=0.5", "crank=50cm", "rod=5/2*crank + 0 m", "pace=10rpm", "crank.start=60deg"):
        solved = command("solve", slider, "-o", "run.csv", "--times", "0:20ms:10ms", "--set", setting)
        assert solved.exit_code == 0, solved.stderr
        table = read_csv(tmp_path / "run.csv")
        assert command("simulate", slider, "--stop", "20ms", "--step", "10ms", "--set", setting).exit_code == 0
        stepped = log.read(tmp_path / "logs" / "slider.mcap")
        for name in ("crank.phi", "rod.phi", "rod.x"):
            assert stepped[name] == pytest.approx(table[name], abs=1e-12)


def test_a_law_constant_that_follows_from_parameters_is_not_set_itself(
    slider: Path, refuses: Callable[..., str]
) -> None:
    slider.write_text(slider.read_text().replace("law = ", 'speed = "crank*1 rad/s/(1 m)", law = '))
    for command, *options in (("check",), ("build",), ("solve", "-o", "run.csv"), ("simulate",)):
        assert refuses(command, slider, *options, "--set", "crank.speed=2") == (
            "--set: crank.speed follows from 'crank*1 rad/s/(1 m)'; set the parameters in it"
        )


@pytest.mark.parametrize("call", [("check",), ("build",), ("solve", "-o", "run.csv"), ("simulate",)])
def test_what_cannot_be_set_is_reported_equally_by_every_command(
    call: tuple[str, ...], slider: Path, refuses: Callable[..., str], tmp_path: Path
) -> None:
    def message(setting: str) -> str:
        return refuses(call[0], slider, *call[1:], "--set", setting)

    known = "crank, rod, crank.start, crank.speed"
    assert message("crnk=2").startswith(
        f"--set: there is no parameter 'crnk'; did you mean 'crank'?; parameters: {known}"
    )
    assert "did you mean 'crank.speed'?" in message("crank.sped=2")
    assert message("crank").endswith("must be NAME=VALUE, such as crank.speed=30rpm")
    assert message("crank=2 deg").startswith("--set: crank = '2 deg': unit 'deg' must be one of m, mm")
    assert message("crank=rod") == "--set: [parameters] crank needs itself: crank -> rod -> crank"
    assert message("crank=nan") == "--set: crank = nan must be a finite number"
    assert message("crank.speed=nan") == "--set: crank.speed = nan must be a finite number"
    expected = "--set: crank.speed = 'fast' must be a number, alone or with a unit: "
    assert message("crank.speed=fast").startswith(expected)
    assert message("crank.start=3mm") == "--set: crank.start = '3mm': unit 'mm' must be one of rad, deg, rev"
    assert [path.name for path in tmp_path.iterdir()] == [slider.name]


def test_what_belongs_to_a_run_is_not_set_elsewhere(slider: Path, refuses: Callable[..., str]) -> None:
    message = refuses("check", slider, "--set", "solver.tolerance=1e-6")
    assert message == "--set: solver.tolerance belongs to a run; use solve or simulate"
    assert "use simulate, or set its default with build --drive" in refuses(
        "build", slider, "--set", "driven_by_time=false"
    )
    assert "use simulate, with auto, estimated or wired" in refuses("check", slider, "--set", "rates=wired")
    assert "rates = 'wire' must be auto, estimated or wired" in refuses("simulate", slider, "--set", "rates=wire")
    for call in (("solve", slider, "-o", "run.csv"), ("simulate", slider)):
        for value, shown in (("fine", "'fine'"), ("-1", "-1.0"), ("nan", "nan")):
            message = refuses(*call, "--set", f"solver.tolerance={value}")
            assert message == f"--set: solver.tolerance = {shown} must be a positive number"


@pytest.mark.parametrize("fmi", ["2", "3"])
@pytest.mark.few(1)
def test_native_fmus_are_built_and_simulated(command: Command, tmp_path: Path, fmi: str) -> None:
    built = command("build", "fourbar", "--flavour", "native", "--fmi", fmi, "-o", "four.fmu")
    assert re.fullmatch(
        rf"four\.fmu: \d+ kB, native FMU for {host().name}, FMI {fmi}\.0 co-simulation and model exchange, "
        r"driven by time\n",
        built.stdout,
    )
    logs = ("--mcap", "four.mcap", "--rrd", "four.rrd")
    result = command("simulate", "four.fmu", "--start", "20", "--stop", "21", *logs)
    assert result.stdout.startswith("2 samples: 2 ok; worst residual ")
    phi = log.read(tmp_path / "four.mcap")["crank.phi"].tolist()
    assert phi == pytest.approx([math.radians(20.0), math.radians(21.0)])


def test_an_fmu_goes_into_a_folder_of_the_gallery_only_for_a_name_of_the_gallery(
    command: Command, tmp_path: Path
) -> None:
    own = tmp_path / "fmus" / "crank_rocker"
    own.mkdir(parents=True)
    assert command("build", "crank_rocker").stdout.startswith("fmus/crank_rocker/crank_rocker.fmu: ")
    (tmp_path / "crank_rocker.toml").write_text(
        (gallery.folder() / "crank_rocker" / "mechanism.toml").read_text(encoding="utf-8"), encoding="utf-8"
    )
    before = (own / "crank_rocker.fmu").stat().st_mtime_ns
    assert command("build", "crank_rocker.toml").stdout.startswith("crank_rocker.fmu: ")
    assert (tmp_path / "crank_rocker.fmu").is_file()
    assert (own / "crank_rocker.fmu").stat().st_mtime_ns == before
    assert command("build", "fourbar").stdout.startswith("fourbar.fmu: ")


def test_a_mechanism_driven_by_torques_is_built_and_simulated(command: Command, tmp_path: Path) -> None:
    """A flywheel of 2 kg m2 under 3 N m, from 60 rpm: the angle after 2 s, by an FMU and by its mechanism."""
    (tmp_path / "flywheel.toml").write_text(
        'name = "flywheel"\n'
        "bodies.ground.points = { O = [0, 0] }\n"
        'bodies.wheel = { points = { O = [0, 0] }, mass = "1 kg", inertia = "2 kg m2" }\n'
        'joints.O = { type = "revolute", between = ["ground.O", "wheel.O"] }\n'
        'drivers.crank = { type = "angle", of = "wheel", law = "constant_speed", speed = "30 rpm" }\n'
    )
    (tmp_path / "torque.csv").write_text("time,crank_torque\n0,3\n2,3\n")
    command("build", "flywheel.toml", "--drive", "torque", "-o", "torque.fmu")
    for source in ("torque.fmu", "flywheel.toml"):
        drive = ["--drive", "torque"] if source.endswith("toml") else []
        command("simulate", source, *drive, "--set", "crank_speed=60rpm", "--input", "torque.csv", "--step", "0.5")
        run = log.read(tmp_path / "logs" / f"{Path(source).stem}.mcap")
        assert run["crank_angle"][-1] == pytest.approx(2.0 * 2.0 * math.pi + 3.0, rel=1e-9)
