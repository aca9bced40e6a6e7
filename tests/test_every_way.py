"""Parameters and settings by every way in: files, Python, commands and FMUs."""

from __future__ import annotations

import math
import random
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import kinfmu
from kinfmu import Cycloidal, Mechanism
from kinfmu.analysis import check
from kinfmu.cli.group import main
from kinfmu.errors import FmuError, KinfmuError, RequestError
from kinfmu.mechanism import toml_file
from kinfmu.run.continued import continued
from tests.fmu.test_parameters import LENGTHS
from tests.fmu.test_parameters import linkage as fmu_linkage
from tests.fmu.test_parameters import linkage as settable

SPREAD = 0.6  # of the logarithm of a length
TIMES = np.array([0.0, 0.25])


def linkage(coupler: float | str = 3.5) -> Mechanism:
    """A four-bar with rough start poses, whose lengths are parameters."""
    return replace(settable({**LENGTHS, "coupler": coupler}), run=kinfmu.RunSettings(0.0, 0.25, 0.25))


def drawn(count: int, *, seed: int) -> list[dict[str, float]]:
    """Parameter sets far from those written; every third moves the start of the law too."""
    rng = random.Random(seed)  # noqa: S311
    sets = []
    for k in range(count):
        values = {name: round(value * math.exp(rng.uniform(-SPREAD, SPREAD)), 3) for name, value in LENGTHS.items()}
        if k % 3 == 2:
            values["crank.start"] = round(rng.uniform(-9.0, 9.0), 2)
        sets.append(values)
    return sets


def side(run: kinfmu.Run) -> float:
    """Which of the two assemblies a run is on: the sign of the angle between coupler and rocker."""
    return float(np.sign(np.sin(run["coupler.phi"][0] - run["rocker.phi"][0])))


def test_solve_and_the_mechanism_that_check_and_build_take_are_on_one_branch() -> None:
    closed = 0
    for values in drawn(14, seed=19):
        try:
            run = kinfmu.solve(linkage(), TIMES, parameters=values)
        except KinfmuError as refusal:
            with pytest.raises(type(refusal)):
                kinfmu.solve(continued(linkage(), values).mechanism, TIMES)
            continue
        same = kinfmu.solve(continued(linkage(), values).mechanism, TIMES)
        np.testing.assert_array_equal(run.status < 3, same.status < 3)
        np.testing.assert_allclose(run.values, same.values, rtol=0, atol=1e-10)
        closed += int(run.good[0])
    assert closed >= 7


@pytest.mark.parametrize(
    ("flavour", "fmi"), [("python", 2), ("native", 2), ("native", 3)], ids=["python", "native 2", "native 3"]
)
@pytest.mark.few(1)
def test_fmus_are_on_the_branch_of_solve_or_refuse(tmp_path: Path, flavour: str, fmi: int) -> None:
    fmu = kinfmu.build(linkage(), tmp_path, flavour=flavour, fmi=fmi)
    compared = 0
    for values in drawn(9, seed=20):
        try:
            run = kinfmu.simulate(fmu, parameters=values)
        except FmuError:
            continue  # solve assembles anew, with a note, or refuses too
        try:
            wanted = kinfmu.solve(linkage(), parameters=values)
        except KinfmuError:
            assert not run.good.any()
            continue
        if any("anew" in event.text for event in wanted.events):
            assert not run.good[0]
            continue
        both = run.good & wanted.good[: len(run.t)]
        np.testing.assert_allclose(run.values[both], wanted.values[: len(run.t)][both], rtol=0, atol=1e-10)
        compared += int(both.any())
    assert compared >= 4


def test_the_engines_are_on_one_branch() -> None:
    for values in drawn(6, seed=21):
        runs = []
        for engine in ("python", "native"):
            try:
                runs.append(kinfmu.solve(linkage(), TIMES, parameters=values, engine=engine))
            except KinfmuError as refusal:
                runs.append(str(refusal))
        if isinstance(runs[0], str) or isinstance(runs[1], str):
            assert runs[0] == runs[1]
        else:
            np.testing.assert_array_equal(runs[0].status < 3, runs[1].status < 3)
            np.testing.assert_allclose(runs[0].values, runs[1].values, rtol=0, atol=1e-11)


def test_the_pose_is_followed_where_a_file_with_those_numbers_assembles_otherwise() -> None:
    """Start poses that are rough for other lengths choose the other branch; the written mechanism keeps its own."""
    start = {"coupler": (0.5, 0.8, 2.0), "rocker": (4, 0, -0.4)}
    bodies = tuple(replace(body, start=start.get(body.name, body.start)) for body in linkage().bodies)
    mechanism, different = replace(linkage(), bodies=bodies), 0
    written = side(kinfmu.solve(mechanism, TIMES[:1]))
    for values in drawn(8, seed=22):
        lengths = {name: value for name, value in values.items() if name in LENGTHS}
        try:
            by_file = kinfmu.solve(mechanism.with_parameters(lengths), TIMES[:1])
            followed = continued(mechanism, lengths)
            run = kinfmu.solve(followed.mechanism, TIMES[:1])
        except KinfmuError:
            continue
        if not followed.message and run.good[0]:
            assert side(run) == written
            different += side(by_file) != written
    assert different


def test_a_parameter_that_an_expression_gives_is_followed_too() -> None:
    mechanism = linkage(coupler="crank*3.5")
    for value in (2.2, 3.1, 4.6):
        run, wanted = (kinfmu.solve(one, TIMES, parameters={"coupler": value}) for one in (mechanism, linkage()))
        np.testing.assert_allclose(run.values, wanted.values, rtol=0, atol=1e-12)


def test_what_cannot_be_followed_is_assembled_anew_with_a_note() -> None:
    """A law that starts turns away, with a crank that cannot turn round."""
    values = {"ground": 6.135, "crank": 1.803, "coupler": 4.299, "rocker": 2.002, "crank.start": 7.21}
    run = kinfmu.solve(linkage(), TIMES, parameters=values)
    assert run.good.all()
    assert [event.level for event in run.events] == ["info"]
    assert "cannot be reached" in run.events[0].text
    assert run.events[0].text.endswith("; the mechanism is assembled anew from its start poses")
    followed = continued(linkage(), values)
    assert followed.message == run.events[0].text
    report = check(followed.mechanism)
    assert report.problem is None
    assert report.range is not None
    assert report.range.turns is None


# ------------------------------------------------------------------------------------------------ settings by every way


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
    plain = fmu_linkage()
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
    written = fmu_linkage({**LENGTHS, "coupler": "crank*3.5"})
    model = kinfmu.compile(written, parameters=list(LENGTHS))
    for given in ({"crank": 0.9}, {"crank": "0.9 m"}, {"crank": 0.9, "coupler": 3.3}):
        run = model.solve([0.0, 0.25], parameters=given)
        assert run.mechanism is not None
        wanted = kinfmu.solve(run.mechanism, [0.0, 0.25])
        assert run.values == pytest.approx(wanted.values, abs=1e-12)


def test_a_parameter_that_a_model_has_built_in_is_refused() -> None:
    model = kinfmu.compile(fmu_linkage(), parameters=["crank"])
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
