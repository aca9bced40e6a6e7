"""Torque-driven cams with dwells: the integrator restarts where derivatives of the law jump, and keeps its order."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

import kinfmu
from kinfmu import AngleBetween, Mechanism, Run, TorqueOn
from kinfmu.mechanism.laws import MotionSequence
from kinfmu.mechanism.laws.sequence import Segment
from tests.motion.test_breaks import tappet
from tests.motion.torque.test_torque_driven import pendulum


def heavy_tappet(law: str) -> Mechanism:
    """A cam of 0.02 kg m2 that lifts 2 kg against gravity, with two dwells."""
    plain = tappet(law)
    bodies = [replace(body, mass=1.0, inertia=0.02) if body.name == "cam" else body for body in plain.bodies]
    return replace(plain, bodies=tuple(bodies))


def energy_error(run: Run, torque: float) -> float:
    """Return what the change of energy misses of the torque's work, relative to the work or the kinetic energy."""
    energy = run["kinetic_energy"] + run["potential_energy"]
    work = torque * (run["cam_angle"] - run["cam_angle"][0])
    size = max(float(np.abs(work).max()), float(run["kinetic_energy"].max()))
    return float(np.abs(energy - energy[0] - work).max()) / size


@pytest.mark.parametrize("law", ["cycloidal", "simple_harmonic"])
@pytest.mark.parametrize("tolerance", [1e-6, 1e-9, 1e-11])
@pytest.mark.few(2)
def test_the_error_follows_the_tolerance_over_breaks(law: str, tolerance: float) -> None:
    """Ten turns in few long steps; the harmonic law jumps in its second derivative, the cycloidal one in its third."""
    run = kinfmu.simulate(
        heavy_tappet(law),
        drive="torque",
        start=0.0,
        stop=2.0,
        step=1.0,
        inputs={"cam_torque": 0.4},
        state={"cam_angle": 0.0, "cam_speed": 10.0},
        tolerance=tolerance,
    )
    assert run["cam_angle"][-1] > 9 * 2 * np.pi
    assert energy_error(run, 0.4) < 5.0 * tolerance


@pytest.mark.parametrize(("flavour", "fmi"), [("native", 3), ("python", 2)])
@pytest.mark.few(1)
def test_an_fmu_restarts_at_breaks_too(
    flavour: Literal["native", "python"], fmi: Literal[2, 3], tmp_path: Path
) -> None:
    path = kinfmu.build(
        heavy_tappet("simple_harmonic"), tmp_path / "tappet.fmu", flavour=flavour, fmi=fmi, drive="torque"
    )
    for tolerance in (1e-6, 1e-9, 1e-11):
        run = kinfmu.simulate(
            path,
            start=0.0,
            stop=2.0,
            step=0.5,
            inputs={"time": [0.0, 2.0], "cam_torque": [0.4, 0.4]},
            state={"cam_angle": 0.0, "cam_speed": 10.0},
            tolerance=tolerance,
        )
        assert energy_error(run, 0.4) < 5.0 * tolerance


def test_a_motion_that_turns_round_crosses_the_same_break_twice() -> None:
    state = {"cam_angle": 0.6, "cam_speed": 3.0}  # the rise begins at 40 deg = 0.698 rad
    run = kinfmu.simulate(
        heavy_tappet("simple_harmonic"),
        drive="torque",
        start=0.0,
        stop=0.4,
        step=0.05,
        inputs={"cam_torque": -0.4},
        state=state,
        tolerance=1e-11,
    )
    assert run["cam_angle"].max() > 0.75
    assert run["cam_angle"][-1] < 0.6
    assert energy_error(run, -0.4) < 1e-10


def test_a_torque_over_the_angle_is_the_change_of_kinetic_energy() -> None:
    """Three pieces over the angle: the work of each rise of the torque is its mean, by symmetry."""
    law = MotionSequence((Segment("dwell", 1.0), Segment("simple_harmonic", 0.5, 6.0), Segment("dwell", 9.0)))
    wheel = pendulum(gravity=None, loads=(TorqueOn("push", "rod", law, over=AngleBetween("rod")),))
    state = {"crank_angle": 0.0, "crank_speed": 2.0}
    run = kinfmu.simulate(wheel, drive="torque", start=0.0, stop=2.0, step=2.0, state=state, tolerance=1e-10)
    last = run["crank_angle"][-1]
    assert last > 1.5
    work = 0.5 * 6.0 * 0.5 + 6.0 * (last - 1.5)
    assert float(np.ptp(run["kinetic_energy"])) == pytest.approx(work, rel=5e-10)
