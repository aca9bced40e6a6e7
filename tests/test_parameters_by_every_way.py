"""Parameters by solve, check, simulate, build and FMUs: the same continuation from the written pose."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu import Mechanism
from kinfmu.analysis import check
from kinfmu.errors import FmuError, KinfmuError
from kinfmu.run.continued import continued
from tests.fmu.test_parameters import LENGTHS
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
