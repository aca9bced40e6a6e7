"""Laws in an FMU: their constants are parameters, and the FMU moves as solve does."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu import (
    AngleDriver,
    Body,
    ConstantSpeed,
    External,
    Harmonic,
    Mechanism,
    MotionSequence,
    Polynomial,
    Polynomial4567,
    Revolute,
    RunSettings,
    Segment,
    Spline,
)
from kinfmu.errors import KinfmuError
from kinfmu.fmu.build import default_drive
from kinfmu.mechanism.laws import Law
from tests.fmu.host import DISCARD, OK, Host

SEQUENCE = MotionSequence((Segment("cycloidal", 1.0, 2.0), Segment("dwell", 0.5)), start=0.25, repeat=True)
LAWS = {
    "polynomial": Polynomial((0.5, 1.0, -0.25, 0.125)),
    "harmonic": Harmonic(1.0, 2.0),
    "rise": Polynomial4567(1.0, 2.0, begin=0.5),
    "spline": Spline(((0.0, 0.0), (1.0, 1.0), (2.0, 0.5), (3.0, 2.0))),
    "sequence": SEQUENCE,
}


def arms(*laws: Law) -> Mechanism:
    """Return a mechanism with one arm per law."""
    count = len(laws)
    return Mechanism(
        "arms",
        (
            Body("ground", {f"O{k}": (k, 0) for k in range(count)}),  # type: ignore[dict-item,misc]
            *(Body(f"arm{k}", {"O": (0, 0)}, (k, 0, 0)) for k in range(count)),  # type: ignore[dict-item,arg-type]
        ),
        tuple(Revolute(f"O{k}", (f"ground.O{k}", f"arm{k}.O")) for k in range(count)),
        tuple(AngleDriver(f"arm{k}", f"arm{k}", law) for k, law in enumerate(laws)),
        run=RunSettings(stop=3.0, step=0.125),
    )


UNIX_TIME = 1764331200.0  # [s]
of_each_flavour = pytest.mark.parametrize(("flavour", "fmi"), [("python", 2), ("native", 2), ("native", 3)])


@of_each_flavour
def test_a_law_that_begins_at_the_start_of_the_host_has_the_digits_of_one_that_begins_at_0(
    flavour: str, fmi: int, fmu_of: Callable[..., Path]
) -> None:
    runs = []
    for begin in (0.0, UNIX_TIME):
        mechanism = arms(Polynomial4567(1.0, 2.0, begin=begin), replace(SEQUENCE, begin=begin))
        mechanism = replace(mechanism, run=RunSettings(begin, begin + 3.0, 0.125))
        runs.append(kinfmu.simulate(fmu_of(mechanism, flavour, fmi)))
        assert runs[-1].good.all()
    for one, other in zip((runs[0].q, runs[0].qd, runs[0].qdd), (runs[1].q, runs[1].qd, runs[1].qdd), strict=True):
        np.testing.assert_array_equal(one, other)


@of_each_flavour
def test_a_start_that_is_too_far_for_a_law_is_refused_with_the_reason(
    flavour: str, fmi: int, fmu_of: Callable[..., Path]
) -> None:
    reason = r"^initialization fails: at t = 1\.76433e\+09 s: crank = .* is too far .*; laws count from t = 0 s$"
    with pytest.raises(KinfmuError, match=reason):
        kinfmu.simulate(fmu_of("fourbar", flavour, fmi), start=UNIX_TIME, stop=UNIX_TIME + 1.0)


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.few(2)
def test_an_fmu_driven_by_a_law_moves_as_solve_does(name: str, tmp_path: Path) -> None:
    mechanism = arms(LAWS[name])
    solved = kinfmu.solve(mechanism)
    stepped = kinfmu.simulate(kinfmu.build(mechanism, tmp_path / "arms.fmu"))
    for output in ("arm0.phi", "arm0.omega", "arm0.alpha"):
        np.testing.assert_array_equal(stepped[output], solved[output])
    np.testing.assert_allclose(solved["arm0.phi"], [LAWS[name].at(t) for t in solved.t], rtol=0.0, atol=1e-15)


def test_constants_of_laws_are_parameters_with_units_and_a_duration_stays_positive(
    fmu_of: Callable[..., Path], opened: Callable[..., Host]
) -> None:
    host = opened(fmu_of(arms(SEQUENCE, LAWS["polynomial"])))
    variables = {variable.name: variable for variable in host.about.interface}
    units = {"start": "rad", "begin": "s", "rise_1": "rad", "duration_1": "s", "duration_2": "s"}
    units_of_polynomial = {"c0": "rad", "c1": "rad/s", "c2": "rad/s2", "c3": "rad/s3"}
    for arm, keys in (("arm0", units), ("arm1", units_of_polynomial)):
        assert {key: variables[f"{arm}.{key}"].unit for key in keys} == keys
    positive = [v.name for v in variables.values() if (v.minimum, v.causality, v.type) == (0.0, "parameter", "Real")]
    assert positive == ["arm0.duration_1", "arm0.duration_2"]
    host.set({"arm0.duration_1": 4.0, "arm0.rise_1": -1.0})
    host.initialize(0.0)
    assert host.step(0.0, 2.0) == OK
    assert host.get("arm0.phi") == pytest.approx([0.25 - 0.5])
    host.set({"arm0.duration_1": 0.0})
    assert host.get("arm0.duration_1") == [4.0]
    assert host.step(2.0, 0.5) == DISCARD


def test_constants_are_checked_where_they_are_given_to_solve() -> None:
    mechanism = arms(SEQUENCE)
    longer = kinfmu.solve(mechanism, [2.0], parameters={"arm0.duration_1": 4.0})
    assert longer["arm0.phi"] == pytest.approx([1.25])
    with pytest.raises(KinfmuError, match=r"^arm0.duration_1 = -1.0 must be positive$"):
        kinfmu.solve(mechanism, parameters={"arm0.duration_1": -1.0})


def test_an_external_law_waits_for_the_inputs(opened: Callable[..., Host], tmp_path: Path) -> None:
    mechanism = arms(External(0.75), ConstantSpeed())
    assert default_drive(mechanism) == "inputs"
    assert default_drive(arms(ConstantSpeed())) == "time"
    host = opened(kinfmu.build(mechanism, tmp_path / "arms.fmu"))
    host.initialize(0.0)
    assert host.get("arm0.phi") == pytest.approx([0.75])
    host.set({"arm0_angle": math.pi})
    assert host.get("arm0.phi") == pytest.approx([math.pi])
    by_time = kinfmu.simulate(kinfmu.build(mechanism, tmp_path / "timed.fmu", drive="time"), stop=1.0)
    assert by_time["arm0.phi"] == pytest.approx(0.75)
    assert by_time["arm1.phi"][-1] == pytest.approx(1.0)
