"""The parameters in which two runs differ: of the mechanisms in their records, and what was set of their FMUs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

import kinfmu
from kinfmu import Run
from kinfmu.cli import main
from kinfmu.log import read
from kinfmu.log.viewer.card import parameters_apart
from kinfmu.log.viewer.comparison import write_comparison
from kinfmu.run.components import mechanism_info
from tests.log.viewer.test_rerun_file import documents

WHEEL = """
name = "wheel"
units.length = "mm"
parameters = { r = "30 mm", half = "r/2", tilt = "30 deg", push = "2 kN", copies = 3 }
bodies.ground.points = { O = [0, 0] }
bodies.crank = { points = { O = [0, 0], P = ["r", "half"] }, start = { phi = "60 deg" } }
joints.O = { type = "revolute", between = ["ground.O", "crank.O"] }
drivers.m = { type = "angle", of = "crank", law = "constant_speed", start = "tilt", speed = "60 rpm" }
loads.weight = { type = "force", at = "crank.P", x = 0, y = "-push*copies" }
run = { stop = 0.5, step = 0.1 }
"""
SPEED = ("m.speed", "6.28319 rad/s (60 rpm)", "7.33038 rad/s (70 rpm)")


@pytest.fixture
def wheel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, with wheel.toml in it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wheel.toml").write_text(WHEEL, encoding="utf-8")
    return tmp_path


def recorded(*arguments: str) -> Run:
    """The run that a command writes."""
    result = CliRunner().invoke(main, [*arguments, "-o" if arguments[0] == "solve" else "--mcap", "run.mcap"])
    assert result.exit_code == 0, result.stderr
    return read("run.mcap")


@pytest.mark.parametrize("command", ["simulate", "solve"])
@pytest.mark.few(1)
def test_parameters_and_law_constants_are_compared_with_units(command: str, wheel: Path) -> None:
    assert wheel.is_dir()
    a = recorded("simulate", "wheel.toml")
    settings = ("r=35mm", "m.speed=70rpm", "tilt=20deg", "push=2500N", "copies=4")
    b = recorded(command, "wheel.toml", *(word for setting in settings for word in ("--set", setting)))
    assert parameters_apart(a, b) == [  # not half, which follows from r
        ("r", "30 mm", "35 mm"),
        ("tilt", "0.523599 rad (30 deg)", "0.349066 rad (20 deg)"),
        ("push", "2000 N", "2500 N"),
        ("copies", "3", "4"),
        SPEED,
    ]
    assert parameters_apart(a, a) == []


def test_an_fmu_with_a_setting_is_compared_with_its_file(wheel: Path) -> None:
    kinfmu.build(kinfmu.load("wheel.toml"), wheel / "wheel.fmu", flavour="python")
    a = recorded("simulate", "wheel.toml")
    b = recorded("simulate", "wheel.fmu", "--set", "m.speed=70rpm", "--set", "solver.tolerance=1e-8")
    assert parameters_apart(a, b) == [SPEED, ("solver.tolerance", "-", "1e-08")]


def test_units_are_those_of_the_file_while_a_run_has_them() -> None:
    mechanism = kinfmu.mechanism.toml_file.parse(WHEEL)
    a, b = (kinfmu.solve(mechanism, parameters=values) for values in ({}, {"push": 3e3, "tilt": "40 deg"}))
    assert parameters_apart(a, b) == [
        ("tilt", "30 deg", "40 deg"),
        ("push", "2 kN", "3 kN"),
    ]


def test_numbers_are_never_shown_with_the_same_digits() -> None:
    mechanism = kinfmu.mechanism.toml_file.parse(WHEEL)
    a, b = (kinfmu.solve(mechanism, parameters={"r": r}) for r in (30.0, 30.0 + 1e-7))
    assert parameters_apart(a, b) == [("r", "30 mm", "30.0000001 mm")]


def test_the_mechanisms_of_a_system_are_compared_under_the_names_of_their_columns() -> None:
    a = kinfmu.solve(kinfmu.mechanism.toml_file.parse(WHEEL))
    of_a, of_b = (mechanism_info("wheel", [("slide", WHEEL.replace("30 mm", length))]) for length in ("30 mm", "40 mm"))
    a, b = (replace(a, info={"parameters": given, **info}) for given, info in (("", of_a), ("slide.r = 40", of_b)))
    assert parameters_apart(a, b) == [("slide.r", "30 mm", "40 mm")]


def test_what_a_damaged_record_holds_of_its_mechanism_is_not_compared() -> None:
    run = replace(kinfmu.solve(kinfmu.mechanism.toml_file.parse(WHEEL)), info={"g": "1"}, mechanism_source="name = ")
    assert parameters_apart(run, replace(run, info={"g": "2", "note": "x"})) == [("g", "1", "2"), ("note", "-", "x")]


def test_the_table_follows_the_names_of_the_runs(wheel: Path) -> None:
    a = recorded("simulate", "wheel.toml")
    b = recorded("simulate", "wheel.toml", "--set", "r=35mm")
    write_comparison(a, b, wheel / "both.rrd")
    (text,) = documents(wheel / "both.rrd", "/card")
    table = "| parameter | A | B |\n|---|---:|---:|\n| r | 30 mm | 35 mm |"
    title, of_a, of_b, third, *_ = text.split("\n\n")
    assert (title, of_a[:5], of_b[:5], third) == ("### B - A", "**A**", "**B**", table)
