"""Settings by a changed mechanism, solve, simulate and --set: one mistake has one message."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

import kinfmu
from kinfmu import Cycloidal, Mechanism
from kinfmu.cli.group import main
from kinfmu.errors import KinfmuError, RequestError
from kinfmu.mechanism import toml_file
from tests.fmu.test_parameters import LENGTHS, linkage

MISTAKES = {  # name, value, message up to the list of what would be valid
    "a misspelt parameter": ("copler", 3.0, "there is no parameter 'copler'; did you mean 'coupler'?; parameters: "),
    "a misspelt constant": ("crank.rize", 3.0, "there is no parameter 'crank.rize'; did you mean 'crank.rise'?; param"),
    "a constant by an expression": ("crank.start", 1.0, "crank.start follows from 'tilt'; set the parameters in it"),
    "a wrong unit": ("coupler", "30 deg", "coupler = '30 deg': unit 'deg' must be one of m, mm, cm, um, km, in, ft"),
    "a constant's wrong unit": ("crank.rise", "2 mm", "crank.rise = '2 mm': unit 'mm' must be one of rad, deg, rev"),
    "no number": ("coupler", math.nan, "coupler = nan must be a finite number"),
    "an infinite constant": ("crank.rise", -math.inf, "crank.rise = -inf must be a finite number"),
    "a huge parameter": ("coupler", 1e31, "coupler = 1e+31 is too large; numbers go up to 1e+30"),
    "a huge constant": ("crank.rise", -1e40, "crank.rise = -1e+40 is too large; numbers go up to 1e+30"),
    "a constant of words": ("crank.rise", "full", "crank.rise = 'full' must be a number, alone or with a unit: rad"),
    "a duration of nothing": ("crank.duration", 0.0, "crank.duration = 0.0 must be positive"),
    "a duration below zero": ("crank.duration", "-2 s", "crank.duration = '-2 s' must be positive"),
}


def mechanism() -> Mechanism:
    """A four-bar with lengths and an angle as parameters, and a law with a duration."""
    plain = linkage()
    (driver,) = plain.drivers
    law = Cycloidal(rise=0.5, duration=1.0, start="tilt")  # type: ignore[arg-type]
    parameters: Any = {**plain.parameters, "tilt": "1 rad"}
    return replace(plain, drivers=(replace(driver, law=law),), parameters=parameters)  # type: ignore[type-var]


def message(call: Callable[..., Any], *arguments: Any, **options: Any) -> str:
    with pytest.raises(RequestError) as caught:
        call(*arguments, **options)
    return str(caught.value)


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return kinfmu.build(mechanism(), tmp_path_factory.mktemp("fmu"))


def on_command_line(setting: str, file: Path) -> str:
    """The message of a refused --set."""
    kinfmu.save(mechanism(), file)
    result = CliRunner().invoke(main, ["check", str(file), "--set", setting])
    assert result.exit_code == 2
    return result.output.strip().splitlines()[-1].removeprefix("Error: ")


@pytest.mark.parametrize(("name", "value", "words"), MISTAKES.values(), ids=list(MISTAKES))
@pytest.mark.few(3)
def test_a_mistake_has_one_message_by_every_way(
    name: str, value: float | str, words: str, fmu: Path, tmp_path: Path
) -> None:
    ways = [
        message(mechanism().with_parameters, {name: value}),
        message(kinfmu.solve, mechanism(), parameters={name: value}),
        message(kinfmu.compile(mechanism()).solve, parameters={name: value}),
        message(kinfmu.simulate, fmu, parameters={name: value}).removeprefix(f"{fmu}: "),
        on_command_line(f"{name}={value}", tmp_path / "linkage.toml").removeprefix("--set: "),
    ]
    assert [way.startswith(words) for way in ways] == [True] * 5, "\n".join(ways)


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_a_tolerance_is_refused_with_one_message(value: float, fmu: Path, tmp_path: Path) -> None:
    words = f"tolerance = {value!r} must be a positive number"
    assert message(kinfmu.solve, mechanism(), tolerance=value) == words
    assert message(kinfmu.simulate, fmu, parameters={"solver.tolerance": value}) == f"{fmu}: solver.{words}"
    file = tmp_path / "linkage.toml"
    kinfmu.save(mechanism(), file)
    result = CliRunner().invoke(main, ["solve", str(file), "-o", "a.csv", "--set", f"solver.tolerance={value}"])
    assert result.exit_code == 2
    assert result.output.strip().endswith(f"--set: solver.{words}")


def test_valid_settings_have_one_effect_by_every_way(fmu: Path) -> None:
    settings: dict[str, Any] = {"coupler": "3600 mm", "crank.rise": "30 deg", "crank.duration": 0.5}
    changed = mechanism().with_parameters(settings)
    constants = {constant.name: constant.value for constant in changed.law_constants}
    assert constants == {"crank.rise": math.pi / 6, "crank.duration": 0.5, "crank.begin": 0.0}
    solved = kinfmu.solve(mechanism(), [0.0, 0.25], parameters=settings)
    stepped = kinfmu.simulate(fmu, stop=0.25, step=0.25, parameters=settings)
    for run in (solved, stepped):
        assert run.mechanism is not None
        assert run.mechanism.parameters == changed.parameters
        assert run["crank.phi"] == pytest.approx([1.0, 1.0 + math.pi / 12], abs=1e-15)


def test_an_argument_that_follows_from_an_expression_follows_unless_given() -> None:
    written = linkage({**LENGTHS, "coupler": "crank*3.5"})
    model = kinfmu.compile(written, parameters=list(LENGTHS))
    for given in ({"crank": 0.9}, {"crank": "0.9 m"}, {"crank": 0.9, "coupler": 3.3}):
        run = model.solve([0.0, 0.25], parameters=given)
        assert run.mechanism is not None
        wanted = kinfmu.solve(run.mechanism, [0.0, 0.25])
        assert run.values == pytest.approx(wanted.values, abs=1e-12)


def test_a_parameter_that_a_model_has_built_in_is_refused() -> None:
    model = kinfmu.compile(linkage(), parameters=["crank"])
    with pytest.raises(KinfmuError) as caught:
        model.solve(parameters={"coupler": 3.0})
    assert str(caught.value) == (
        "coupler is a number of the model; compile(mechanism, parameters=['coupler']) makes it an argument"
    )


SPRING = """
name = "swing"
units.length = "mm"
parameters = { reach = 70, size = 10 }
bodies.ground.points = { O = [0, 0], S = ["reach", 0] }
bodies.crank = { points = { O = [0, 0], P = [30, 0] } }
bodies.slide = { points = { C = [0, 0] }, start = { x = 0, y = 40 } }
joints.O = { type = "revolute", between = ["ground.O", "crank.O"] }
joints.cam = { type = "cam_flat_face", between = ["crank.O", "slide.C"], normal = "90 deg", law = "sequence", \
segments = [{ law = "cycloidal", rise = 5, duration = "180 deg" }, { law = "cycloidal", rise = -5, \
duration = "180 deg" }], repeat = true, start = "2*size" }
drivers.crank = { type = "angle", of = "crank", law = "constant_speed", speed = "60 rpm" }
loads.spring = { type = "spring", between = ["ground.S", "crank.P"], stiffness = "0.05 N/mm", free_length = "reach" }
"""


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "spring.stiffness",
            "there is no parameter 'spring.stiffness': it is a number of [loads.spring]; to set it, give it as "
            'spring_stiffness in [parameters] and write "spring_stiffness" in its place; parameters: reach, ',
        ),
        ("cam.rise_1", "there is no parameter 'cam.rise_1': it is a number of [joints.cam]; to set it, give it as "),
        ("spring.free_length", "spring.free_length follows from 'reach'; set the parameters in it"),
        ("cam.start", "cam.start follows from '2*size'; set the parameters in it"),
        ("spring.stifness", "there is no parameter 'spring.stifness'; parameters: reach, "),
    ],
)
def test_numbers_of_joints_and_loads_are_set_by_parameters(name: str, message: str) -> None:
    with pytest.raises(RequestError, match=re.escape(message)):
        toml_file.parse(SPRING).with_parameters({name: 1.0})
