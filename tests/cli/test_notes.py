"""Notes on how inputs were understood, warnings of probable mistakes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu import RunSettings, log
from kinfmu.cli.group import patience
from kinfmu.mechanism import toml_text
from tests.cli.conftest import Command, read_csv
from tests.mechanisms import fourbar


@pytest.fixture
def notes(command: Command) -> Callable[..., list[str]]:
    """`notes("solve", ...)`: the lines on stderr of a command that ends well, without their `kinfmu: `."""

    def run(*arguments: object) -> list[str]:
        result = command(*arguments)
        assert result.exit_code == 0, result.stderr
        lines = result.stderr.splitlines()
        assert all(line.startswith("kinfmu: ") for line in lines)
        return [line.removeprefix("kinfmu: ") for line in lines]

    return run


def test_a_run_takes_its_ends_from_the_rows_of_its_input(notes: Callable[..., list[str]], tmp_path: Path) -> None:
    (tmp_path / "in.csv").write_text("time,crank_angle [deg]\n2,30\n4,32\n5,33\n")
    assert notes("simulate", "fourbar", "--input", "in.csv") == [
        "note: the run goes from 2 to 5 s, as the rows of in.csv"
    ]
    run = log.read(tmp_path / "logs" / "fourbar.mcap")
    assert run.t.tolist() == [2.0, 3.0, 4.0, 5.0]
    assert np.degrees(run["crank.phi"]) == pytest.approx([30.0, 31.0, 32.0, 33.0])
    assert notes("simulate", "fourbar", "--input", "in.csv", "--stop", 3) == [
        "note: the run goes from 2 to 3 s, one end as the rows of in.csv"
    ]
    assert log.read(tmp_path / "logs" / "fourbar.mcap").t.tolist() == [2.0, 3.0]
    assert notes("simulate", "fourbar", "--input", "in.csv", "--start", 3, "--stop", 4) == []
    (tmp_path / "in.csv").write_text("time,crank_angle [deg]\n2,30\n")
    assert notes("simulate", "fourbar", "--input", "in.csv") == [
        "note: the run goes from 2 to 2 s, as the rows of in.csv; "
        "add a second row to hold the values until a later time"
    ]


def test_a_table_as_long_as_the_models_run_needs_no_word(notes: Callable[..., list[str]], tmp_path: Path) -> None:
    (tmp_path / "in.csv").write_text("time,crank_angle\n0,0.5\n180,1.5\n")
    assert notes("simulate", "fourbar", "--input", "in.csv") == []


def test_an_fmu_driven_by_inputs_says_that_it_stands_still_and_how_to_drive_it(
    notes: Callable[..., list[str]], tmp_path: Path
) -> None:
    kinfmu.build(kinfmu.load("five_bar"), tmp_path / "five.fmu", drive="inputs")
    (message,) = notes("simulate", "five.fmu")
    start = {driver.name: driver.law.at(0.0) for driver in kinfmu.load("five_bar").drivers}
    values = ", ".join(f"{name}_angle stays at {value:.6g} rad" for name, value in start.items())
    names = ", ".join(f"{name}_angle" for name in start)
    assert message == (
        f"warning: no inputs are given: {values}; to set them, give a CSV file with the columns time, {names} (--input)"
    )
    first, second = names.split(", ")
    (tmp_path / "one.csv").write_text(f"time,{first}\n0,{start['left']}\n0.1,{start['left'] + 0.01}\n")
    *_, message = notes("simulate", "five.fmu", "--input", "one.csv", "--stop", "0.1", "--start", "0")
    assert message.startswith(f"warning: one.csv does not drive all inputs: {second} stays at ")


def test_a_mechanism_without_a_law_is_driven_by_inputs_and_reports_it(
    notes: Callable[..., list[str]], fourbar_file: Callable[..., Path]
) -> None:
    path = fourbar_file('law = "constant_speed"\nstart = 0\nspeed = "1 deg/s"', 'law = "external"\nstart = "60 deg"')
    (message,) = notes("simulate", path)
    assert message.startswith("warning: no inputs are given: crank_angle stays at 1.0472 rad; to set them, give a CSV")
    (message,) = notes("solve", path, "-o", "run.csv")
    assert message == (
        "warning: driver crank has no law and does not move with time; use solve --angle for one driver, simulate "
        "--input for any number"
    )
    assert notes("solve", path, "-o", "run.csv", "--angle", "0:1:3") == []


def test_an_input_that_jumps_by_a_turn_is_warned_of_unless_wrap_follows_it(
    notes: Callable[..., list[str]], tmp_path: Path
) -> None:
    (tmp_path / "in.csv").write_text("time,crank_angle [deg]\n0,340\n10,350\n20,0\n30,10\n")
    call = ("simulate", "fourbar", "--input", "in.csv", "--stop", 30)
    assert notes(*call) == [
        "warning: in.csv: crank_angle jumps by -350 deg from 10 to 20 s; used as given; --wrap unwraps "
        "angles that jump, such as from 360 to 0 deg"
    ]
    assert notes(*call, "--wrap") == []
    speed = log.read(tmp_path / "logs" / "fourbar.mcap")["crank.omega"]
    assert np.degrees(speed[1:]) == pytest.approx(np.ones(30))


def test_every_jump_is_counted_and_half_a_turn_is_none(notes: Callable[..., list[str]], tmp_path: Path) -> None:
    (tmp_path / "in.csv").write_text("time,crank_angle [deg]\n0,0\n60,180\n120,361\n180,0\n")
    (message,) = notes("simulate", "fourbar", "--input", "in.csv")
    assert message.startswith(
        "warning: in.csv: crank_angle jumps by 181 deg from 60 to 120 s, and 1 more such jump; used as given"
    )


def test_angles_of_an_input_without_unit_that_look_like_degrees_are_reported(
    notes: Callable[..., list[str]], tmp_path: Path
) -> None:
    (tmp_path / "in.csv").write_text("time,crank_angle\n0,0\n180,360\n")
    assert notes("simulate", "fourbar", "--input", "in.csv") == [
        "note: in.csv: crank_angle has no unit, so it is in rad: 0 to 360 rad, 57.3 turns; "
        "for degrees write 'crank_angle [deg]' in the header"
    ]


@pytest.mark.parametrize(
    ("angle", "message"),
    [
        ("0:360:3", "note: --angle 0:360:3: 0 to 360 rad, 57.3 turns; write 0deg:360deg:3 for degrees"),
        ("-45:30:2", "note: --angle -45:30:2: -45 to 30 rad, 11.9 turns; write -45deg:30deg:2 for degrees"),
        ("0deg:720deg:3", "warning: --angle 0deg:720deg:3: steps of 1 turns between samples; --wrap unwraps"),
        ("0deg:360deg:3", None),
        ("0:6.3:7", None),
        ("0deg:360:361", None),
    ],
)
def test_driver_values_that_are_probably_wrong_are_reported(
    angle: str, message: str | None, notes: Callable[..., list[str]], tmp_path: Path
) -> None:
    lines = notes("solve", "crank_rocker", "-o", "run.csv", "--angle", angle)
    assert len(lines) == (message is not None)
    assert all(line.startswith(str(message)) for line in lines)
    assert read_csv(tmp_path / "run.csv")["solver.status"].max() < 3


def test_a_name_of_the_gallery_that_is_a_file_here_too_is_reported(
    notes: Callable[..., list[str]], fourbar_file: Callable[..., Path]
) -> None:
    fourbar_file(name="fourbar.toml")
    assert notes("check", "fourbar") == ["note: fourbar is the gallery's; the file in this folder is fourbar.toml"]
    assert notes("check", "fourbar.toml") == []


def test_a_constant_of_an_angle_that_looks_like_degrees_is_reported(notes: Callable[..., list[str]]) -> None:
    call = ("solve", "fourbar", "-o", "run.csv", "--times", "0:1:1")
    assert notes(*call, "--set", "crank.start=90") == [
        "note: crank.start = 90 rad, 14.3 turns; write crank.start=90deg for degrees"
    ]
    assert notes(*call, "--set", "crank.start=90deg") == []
    assert notes(*call, "--set", "crank.speed=90deg/s") == []


def test_a_bare_number_is_reported_where_the_file_writes_another_unit(
    notes: Callable[..., list[str]], tmp_path: Path
) -> None:
    text = toml_text.text(kinfmu.load("crank_rocker"))
    (tmp_path / "cm.toml").write_text(text.replace("[bodies", '[parameters]\nspare = "2 cm"\n[bodies', 1), "utf-8")
    assert notes("check", "cm.toml", "--set", "spare=0.03") == [
        "note: --set: spare = 0.03 is taken in mm; the mechanism file writes it in cm: for these write '0.03 cm'"
    ]
    assert notes("check", "cm.toml", "--set", "spare=3cm") == []


@pytest.mark.parametrize(
    "call",
    [
        ("check", "toggle_press"),
        ("solve", "toggle_press", "-o", "run.csv", "--times", "0:0.1:0.1"),
        ("simulate", "toggle_press", "--stop", "0.01", "--mcap", "a.mcap", "--rrd", "a.rrd"),
        ("build", "toggle_press", "--flavour", "python", "--no-page"),
    ],
)
@pytest.mark.parametrize(
    ("setting", "text"),
    [
        (
            "crank.speed=3",
            "crank.speed = 3 is taken in rad/s; the mechanism file writes it in rpm: for these write '3 rpm'",
        ),
        ("work.start=2", "work.start = 2 is taken in N; the mechanism file writes it in kN: for these write '2 kN'"),
        ("work.start=2kN", None),
    ],
)
@pytest.mark.few(2)
def test_a_bare_constant_of_a_law_is_reported_where_the_file_writes_another_unit(
    call: tuple[str, ...], setting: str, text: str | None, notes: Callable[..., list[str]]
) -> None:
    noted = [line for line in notes(*call, "--set", setting) if "--set" in line]
    assert noted == ([f"note: --set: {text}"] if text else [])


def test_build_reports_a_run_beyond_the_range_as_check_does(
    notes: Callable[..., list[str]], command: Command, tmp_path: Path
) -> None:
    """Coupler and rocker stretch where the crank is at acos(1/8), within the run; the inputs of an FMU may not."""
    text = toml_text.text(replace(fourbar(2.0, 1.0, 1.0, 1.0, start=1.2), run=RunSettings(0.0, 6.0, 0.1)))
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    build = ("build", "mine.toml", "--flavour", "python", "--no-page")
    (printed,) = notes(*build)
    assert printed.endswith("beyond the range")
    shown = " ".join(command("check", "mine.toml").stdout.split())
    assert f" {printed.replace('note: ', 'poor ')} " in shown
    assert notes(*build, "--drive", "inputs") == []
    assert notes(*build, "--set", "crank.speed=0.01rad/s") == []


def test_a_page_that_takes_long_is_announced(capsys: pytest.CaptureFixture[str]) -> None:
    with patience(seconds=0.0):
        time.sleep(0.2)
    assert capsys.readouterr().err == "kinfmu: note: making the page\n"


def test_build_states_how_to_do_without_the_page(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def slow(_: kinfmu.Mechanism) -> str:
        time.sleep(0.2)
        return "page"

    command = import_module("kinfmu.cli.build")  # kinfmu.cli.build is the command of this module
    monkeypatch.setattr(import_module("kinfmu.page"), "page", slow)
    monkeypatch.setattr(command, "patience", partial(patience, seconds=0.0))
    assert command._page(kinfmu.load("fourbar"), True) == "page"
    assert capsys.readouterr().err.rstrip().endswith("; --no-page builds the FMU without it")
