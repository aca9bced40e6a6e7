"""--set: the same as a file with those numbers, in every command."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kinfmu
from tests.cli.conftest import Command, read_csv

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
