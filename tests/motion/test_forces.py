"""Measures of forces: extremes between samples, where forces have no rates."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import kinfmu
from kinfmu.errors import MechanismError
from kinfmu.mechanism.measures import Maximum, Minimum, Peak, PeakSpeed, Range
from kinfmu.mechanism.toml_file import parse
from kinfmu.motion.samples import sampled_history
from tests.analysis.test_loading import ARM
from tests.run.test_forces import loaded


def test_extremes_of_a_torque_lie_between_the_samples() -> None:
    """Torque 6 cos(phi) N m, with samples on both sides of its extremes; reaction 29.6 N at the lowest point."""
    arm = parse(ARM, "arm.toml")
    run = kinfmu.solve(arm, arm_angle=0.003 + np.linspace(0.0, math.tau, 361), arm_speed=4.0)
    asked = [Maximum("high", "arm.torque"), Minimum("low", "arm.torque"), Range("span", "arm.torque"),
             Peak("peak", "arm.torque"), Maximum("pin", "O.force"), Peak("inertia", "arm.reduced_inertia"),
             Maximum("stored", "potential_energy")]  # fmt: skip
    found = kinfmu.measure(run, asked)
    values = [found[name].value for name in ("high", "low", "span", "peak", "pin", "inertia", "stored")]
    assert values == pytest.approx([6.0, -6.0, 12.0, 6.0, 29.6, 0.68, 6.0], rel=1e-11)
    assert [one.unit for one in found.values()] == ["N m", "N m", "N m", "N m", "N", "kg m2", "J"]
    assert found["low"].at == pytest.approx((math.pi,), abs=1e-6)
    assert found["pin"].at == pytest.approx((1.5 * math.pi,), abs=1e-6)
    assert (found["pin"].driver, found["pin"].at_unit) == ("arm", "rad")


def test_361_samples_give_peaks_of_a_slider_crank_to_1e_10() -> None:
    mechanism = replace(
        loaded("slider_crank"), measures=(Peak("torque", "crank.torque"), Maximum("pin", "P.force", begin=3.0, end=7.0))
    )
    coarse, fine = (
        kinfmu.measure(kinfmu.solve(mechanism, crank_angle=np.linspace(0.0, math.tau, n), crank_speed=20.0 * math.pi))
        for n in (361, 20001)
    )
    for name in ("torque", "pin"):
        assert coarse[name].value == pytest.approx(fine[name].value, rel=1e-10)


def test_kinks_jumps_and_few_samples_give_extremes_of_the_samples() -> None:
    x = np.linspace(0.0, 1.0, 101)
    kink = np.where(x < 0.503, x, 0.503 - 0.2 * (x - 0.503))
    jump = np.where(x < 0.503, x**2, x - 1.0)
    for value in (kink, jump, np.sin(200.0 * x)):
        history = sampled_history(x, value, is_closed=False)
        assert history.maximum().value <= value.max() + 1e-9
        assert history.minimum().value >= value.min() - 1e-9
    few = sampled_history(x[:4], np.array([0.0, 2.0, 1.0, 0.0]), is_closed=False)
    assert few.maximum().value == 2.0


def test_designs_are_measured_one_by_one() -> None:
    text = ARM.replace('"2 kg"', '"m"').replace("[bodies]", '[parameters]\nm = "2 kg"\n\n[bodies]')
    model = kinfmu.compile(parse(text, "arm.toml"))
    asked = [Peak("torque", "arm.torque"), Range("swing", "arm.phi")]
    angles = np.linspace(0.0, math.tau, 361)
    table = kinfmu.measure_designs(model, {"m": np.array([1.0, 2.0, 3.0])}, asked, arm_angle=angles, arm_speed=4.0)
    np.testing.assert_allclose(table["torque"], [3.0, 6.0, 9.0], rtol=1e-11)
    assert table.units["torque"] == "N m"
    assert table["swing"] == pytest.approx(math.tau)


def test_undetermined_reactions_have_no_value_but_a_reason() -> None:
    run = kinfmu.solve(loaded("fourbar"), np.arange(10.0, 60.0))
    found = kinfmu.measure(run, [Maximum("pin", "O.force"), Peak("torque", "crank.torque")])
    assert math.isnan(found["pin"].value)
    assert found["pin"].reason.startswith("'O.force' is not determined: redundant rows share the load")
    assert math.isfinite(found["torque"].value)


def test_check_reports_measures_of_forces() -> None:
    text = ARM + '[measures.motor]\ntype = "peak"\nof = "arm.torque"\n'
    assert "motor = 6 N m (arm at 0 deg)" in str(kinfmu.check(parse(text, "arm.toml")))


def test_wrong_names_and_rates_of_forces_get_one_line() -> None:
    arm = parse(ARM, "arm.toml")
    with pytest.raises(MechanismError, match=r"'arm.torque' is a force, which has no rates; types for forces: minimum"):
        replace(arm, measures=(PeakSpeed("a", "arm.torque"),))
    with pytest.raises(MechanismError, match=r"'arm.torqe' is not a coordinate .*; did you mean 'arm.torque'\?"):
        replace(arm, measures=(Peak("a", "arm.torqe"),))
    with pytest.raises(MechanismError, match=r"'crank.torque' is not there: without masses and loads"):
        replace(kinfmu.load("slider_crank"), measures=(Peak("a", "crank.torque"),))


def test_loads_over_time_are_measured_over_one_turn_by_check() -> None:
    """Torque 6 cos(4 t) - 2 sin(4 t) N m."""
    load = '[loads.brake]\ntype = "torque"\non = "arm"\nlaw = "harmonic"\namplitude = 2\nfrequency = 4\n'
    report = kinfmu.check(parse(ARM + load + '[measures.motor]\ntype = "peak"\nof = "arm.torque"\n', "arm.toml"))
    assert report.measured is not None
    (motor,) = report.measured.values
    assert motor.value == pytest.approx(math.sqrt(40.0), rel=1e-11)
    assert motor.driver == "arm"
    assert report.loading is not None
    assert abs(report.loading.efforts[0].value) == pytest.approx(math.sqrt(40.0), rel=1e-4)  # of the samples
    assert report.loading.efforts[0].rms == pytest.approx(math.sqrt(20.0), rel=1e-12)
