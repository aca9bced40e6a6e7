"""Measures of runs, of their jerk and of their forces."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import replace
from pathlib import Path

import mpmath
import numpy as np
import pytest

import kinfmu
from kinfmu.draw import svaj
from kinfmu.errors import MechanismError, RequestError
from kinfmu.mechanism.measures import (
    READINGS,
    Dwell,
    LowestMargin,
    Maximum,
    Minimum,
    Peak,
    PeakAcceleration,
    PeakSpeed,
    Range,
    Roundness,
    Straightness,
    TimeRatio,
    VelocityRatio,
)
from kinfmu.mechanism.quantities import AngleBetween, DistanceBetween
from kinfmu.mechanism.toml_file import parse
from kinfmu.motion import History, Motion
from kinfmu.motion.motion_curve import motion_of
from kinfmu.motion.samples import sampled_history
from kinfmu.run.channels import select
from tests.analysis.test_lift_off import sliding
from tests.analysis.test_loading import ARM
from tests.mechanisms import slider_crank
from tests.reports import unwrapped
from tests.run.test_forces import loaded

TURN = np.linspace(0.0, 2.0 * math.pi, 361)


def yoke_over(*angles: float) -> kinfmu.Run:
    return kinfmu.solve(kinfmu.load("scotch_yoke"), crank_angle=np.linspace(*angles, 100))


def test_the_ends_count_where_the_motion_does_not_go_round() -> None:
    found = kinfmu.measure(yoke_over(0.5, 2.0), [Range("r", "yoke.x"), PeakSpeed("v", "yoke.x")])
    assert found["r"].value == pytest.approx(40.0 * (math.cos(0.5) - math.cos(2.0)), rel=1e-12)
    assert found["r"].at == (2.0, 0.5)
    assert found["v"].at == pytest.approx((0.5 * math.pi,), abs=1e-9)


def test_descending_driver_values_give_the_same_numbers() -> None:
    up, down = (kinfmu.measure(yoke_over(*ends), [PeakAcceleration("a", "yoke.x")]) for ends in ((1, 5), (5, 1)))
    assert up["a"].value == pytest.approx(down["a"].value, rel=1e-12)
    assert up["a"].at == pytest.approx(down["a"].at, abs=1e-9)


def test_derived_quantities_are_measured_like_coordinates() -> None:
    run = kinfmu.solve(kinfmu.load("slider_crank"), crank_angle=TURN)
    distance = Range("d", DistanceBetween(("ground.O", "piston.S")))
    angle = Maximum("a", AngleBetween("crank", to="rod"), 0.0, 1.0)
    found = kinfmu.measure(run, [distance, angle, Range("x", "piston.x"), Maximum("w", "rod.omega")])
    assert found["d"].value == pytest.approx(found["x"].value, rel=1e-12)
    assert found["a"].value == pytest.approx(1.0 + math.asin(45.0 * math.sin(1.0) / 144.0), rel=1e-9)
    assert (found["a"].unit, found["w"].unit) == ("rad", "rad/rad")
    assert found["w"].value == pytest.approx(45.0 / 144.0, rel=1e-9)


def test_samples_without_numbers_give_nan_with_the_reason() -> None:
    run = kinfmu.solve(kinfmu.load("triple_rocker"), left_angle=np.radians(np.linspace(40.0, 140.0, 101)))
    assert not run.good.all()
    readings = [
        Maximum("m", "right.phi"),
        Straightness("s", "coupler.apex"),
        LowestMargin("g"),
        PeakSpeed("v", "right.phi"),
    ]
    for found in kinfmu.measure(run, readings).values():
        assert math.isnan(found.value)
        assert all(map(math.isnan, found.at))
        assert found.reason.startswith(f"{int((~run.good).sum())} of 101 samples have no numbers, the first at left = ")
        assert found.as_json()["value"] is None
    part = kinfmu.measure(run, [Maximum("m", "right.phi", "60 deg", "70 deg")])["m"]  # type: ignore[arg-type]  # text
    assert part.reason == ""
    assert math.radians(60.0) <= part.at[0] <= math.radians(70.0)


def test_many_designs_at_once_equal_each_alone() -> None:
    """Designs side by side, one of them with a sample without numbers: the others are not touched."""
    mechanism = kinfmu.load("crank_rocker")
    runs = [kinfmu.solve(mechanism, crank_angle=TURN + shift) for shift in (0.0, 0.3, 0.7)]
    alone = [Motion.of_run(run) for run in runs]
    tables = tuple(np.stack([motion.tables[k] for motion in alone]) for k in range(3))
    tables[0][2, 100] = np.nan
    margin = np.stack([run.margin for run in runs])
    many = replace(alone[0], tables=tables, sampled=lambda _: margin, _histories={})
    readings = (
        Range("", "rocker.phi"),
        PeakAcceleration("", "coupler.x"),
        TimeRatio("", "rocker.phi"),
        Dwell("", "rocker.phi", 0.1),
        Straightness("", "coupler.tracer", 1.0, 2.0),
        Roundness("", "coupler.tracer", 1.0, 2.0),
        VelocityRatio("", "rocker.phi"),
        LowestMargin(""),
    )
    for reading in readings:
        found = reading.read(many.part(reading.begin, reading.end)).value
        assert found.shape == (3,)
        first, second = (
            float(reading.read(replace(one, drive=alone[0].drive, x=alone[0].x).part(reading.begin, reading.end)).value)
            for one in alone[:2]
        )
        assert found[:2] == pytest.approx([first, second], rel=1e-11), reading.type
        assert np.isnan(found[2]) == (reading.type != "lowest_margin"), reading.type


def test_two_leading_axes_of_designs_keep_their_shape() -> None:
    x = np.linspace(0.0, 2.0 * math.pi, 181)
    phase = np.arange(6.0).reshape(2, 3, 1)
    history = History(x, np.sin(x - phase), np.cos(x - phase), -np.sin(x - phase), is_closed=True)
    high = history.maximum()
    assert high.value == pytest.approx(np.ones((2, 3)), rel=1e-12)
    assert high.x == pytest.approx((0.5 * math.pi + phase[..., 0]) % (2.0 * math.pi), abs=1e-9)


def test_two_extremes_between_two_samples_are_both_seen() -> None:
    x = np.array([0.0, 1.0, 2.0])
    curve = np.polynomial.Polynomial.fromroots([0.5, 0.9]).integ()  # rises, falls from 0.5 to 0.9, rises
    history = History(x, *(curve.deriv(order)(x) if order else curve(x) for order in range(3))).part(0.0, 1.0)
    assert history.maximum() == pytest.approx((curve(0.5), 0.5), abs=1e-14)
    assert history.minimum() == pytest.approx((0.0, 0.0), abs=1e-14)
    assert history.part(0.1, 1.0).negative().maximum().x == 0.1
    assert history.part(0.6, 1.0).minimum() == pytest.approx((curve(0.9), 0.9), abs=1e-14)


def test_a_crossing_at_the_end_of_a_closed_motion_is_seen_despite_rounding() -> None:
    value = np.cos(TURN + 0.2003)
    value[[0, -1]] = math.cos(0.2003) + np.array([-1e-13, 1e-13])
    history = History(TURN, value, -np.sin(TURN + 0.2003), -np.cos(TURN + 0.2003), is_closed=True)
    start, stop = history.stay(1.0 - math.cos(0.2003))
    assert float(stop - start) == pytest.approx(2.0 * 0.2003, rel=1e-9)


@pytest.mark.parametrize(
    ("readings", "message"),
    [
        (["strok"], "there is no measure 'strok'; measures: none"),
        ([TimeRatio("r", "yoke.x")], "[measures.r]: time_ratio needs a motion that goes round"),
        (
            [Minimum("m", "yoke.x", 0.0, 1.0)],
            "[measures.m]: the driver does not reach 0; the motion goes from 0.5 to 2",
        ),
    ],
)
def test_wrong_requests_name_the_measure(readings: list[object], message: str) -> None:
    with pytest.raises(RequestError) as error:
        kinfmu.measure(yoke_over(0.5, 2.0), readings)  # type: ignore[arg-type]
    assert str(error.value).startswith(message)


def test_an_unknown_coordinate_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(MechanismError, match=r"did you mean 'yoke\.x'"):
        kinfmu.measure(yoke_over(0.5, 2.0), [Minimum("m", "yoke.xx")])


def test_a_motion_of_several_drivers_is_measured_over_time() -> None:
    run = kinfmu.solve(kinfmu.load("five_bar"))
    assert kinfmu.measure(run, [LowestMargin("g")])["g"].driver == "time"


def test_every_type_of_measure_has_a_name_of_its_own() -> None:
    assert len({reading.type for reading in READINGS}) == len(READINGS)


# ----------------------------------------------------------------------------------------------------------------- jerk


CAM = """
name = "cam"
bodies.ground.points = { O = [0, 0], G = [0, 0] }
bodies.cam.points = { O = [0, 0] }
bodies.follower = { points = { G = [0, 0] }, start = { y = 2 } }
joints.O = { type = "revolute", between = ["ground.O", "cam.O"] }
joints.guide = { type = "translational", between = ["ground.G", "follower.G"], axis = "90 deg" }
drivers.cam = { type = "angle", of = "cam", law = "constant_speed", speed = 2.0 }
[joints.lift]
type = "cam_translating"
between = ["ground.G", "follower.G"]
axis = "90 deg"
cam = "cam"
offset = 2
law = "sequence"
repeat = true
segments = [
    { law = "cycloidal", duration = "120 deg", rise = 0.5 },
    { law = "dwell", duration = "60 deg" },
    { law = "3-4-5", duration = "180 deg", rise = -0.5 },
]
"""


def test_jerk_of_a_slider_under_a_law_of_time() -> None:
    """x = r cos phi + sqrt(l^2 - r^2 sin^2 phi), phi = 0.3 + t + 0.7 t^2 - 0.2 t^3, differentiated by mpmath."""
    mechanism = slider_crank(1.0, 3.0)
    (driver,) = mechanism.drivers
    law = kinfmu.Polynomial((0.3, 1.0, 0.7, -0.2))
    mechanism = dataclasses.replace(mechanism, drivers=(dataclasses.replace(driver, law=law),))
    t = np.linspace(0.0, 1.5, 7)
    run = kinfmu.solve(mechanism, t)
    table, kind = motion_of(run, "slider.x")

    def x(time: mpmath.mpf) -> mpmath.mpf:
        phi = mpmath.mpf("0.3") + time + mpmath.mpf("0.7") * time**2 - mpmath.mpf("0.2") * time**3
        return mpmath.cos(phi) + mpmath.sqrt(9 - mpmath.sin(phi) ** 2)

    with mpmath.workdps(30):
        exact = [[float(mpmath.diff(x, mpmath.mpf(float(one)), k)) for k in range(4)] for one in t]
    assert kind == "length"
    np.testing.assert_allclose(table, exact, atol=1e-12, rtol=0.0)


def test_jerk_of_a_cam_follower_is_that_of_its_law(tmp_path: Path) -> None:
    path = tmp_path / "cam.toml"
    path.write_text(CAM, encoding="utf-8")
    angle = np.radians(np.arange(0.5, 360.0, 1.0))
    run = kinfmu.solve(kinfmu.load(path), cam_angle=angle)
    table, _ = motion_of(run, "lift")
    rise, beta = angle < math.radians(120.0), math.radians(120.0)
    phase = 2.0 * math.pi * angle / beta
    np.testing.assert_allclose(table[rise, 0], 0.5 * (phase - np.sin(phase))[rise] / (2.0 * math.pi), atol=1e-14)
    cycloid = 0.5 * (2.0 * math.pi) ** 2 / beta**3 * np.cos(phase)
    np.testing.assert_allclose(table[rise, 3], cycloid[rise], atol=1e-12)
    s = (angle - math.pi) / math.pi
    fall = angle > math.pi
    np.testing.assert_allclose(table[fall, 3], (-0.5 / math.pi**3 * (60 - 360 * s + 360 * s**2))[fall], atol=1e-12)
    np.testing.assert_array_equal(motion_of(run, "follower.y")[0][:, 1:], table[:, 1:])
    by_time = motion_of(kinfmu.solve(kinfmu.load(path), angle / 2.0), "lift")[0]
    np.testing.assert_allclose(by_time, table * 2.0 ** np.arange(4.0), atol=1e-11)
    svaj(run, tmp_path / "svaj.svg", "lift", degrees=True)
    text = (tmp_path / "svaj.svg").read_text(encoding="utf-8")
    assert all(f">{label}<" in text for label in ("s [m]", "v [m/rad]", "a [m/rad²]", "j [m/rad³]", "cam [deg]"))


def test_jerk_has_a_gap_at_a_bridge_and_is_refused_if_it_is_not_known() -> None:
    mechanism = kinfmu.load("fourbar")
    degrees = np.arange(0.0, 361.0, 30.0)
    run = kinfmu.solve(mechanism, crank_angle=np.radians(degrees))
    jerk = motion_of(run, "coupler.x")[0][:, 3]
    known = degrees % 180.0 != 0.0
    np.testing.assert_array_equal(np.isfinite(jerk), known)
    np.testing.assert_allclose(jerk[known], np.sin(np.radians(degrees))[known], atol=1e-12)
    other = kinfmu.solve(mechanism, crank_angle=np.radians(degrees), crank_acceleration=1.0)
    with pytest.raises(
        RequestError, match=r"^the jerk is not known: driver 'crank' has accelerations that are not those"
    ):
        motion_of(other, "coupler.x")
    with pytest.raises(
        RequestError, match=r"^'cupler\.x' is neither a coordinate nor a cam; did you mean 'coupler\.x'"
    ):
        motion_of(run, "cupler.x")
    part = kinfmu.solve(mechanism, crank_angle=np.radians(degrees), outputs=["crank.phi"])
    with pytest.raises(RequestError, match=r"^the jerk needs all coordinates, and the run does not hold coupler\.x"):
        motion_of(part, "crank.phi")
    with pytest.raises(kinfmu.KinfmuError, match=r"^the run does not hold 'crank\.omega'"):
        motion_of(select(run, ["q"]), "crank.phi")


@pytest.mark.parametrize("joint", ["roller", "flat"])
def test_jerk_of_followers_on_given_cams(joint: str) -> None:
    """The law's value is the height 0.05 + 0.004 cos theta of the follower."""
    theta = np.linspace(0.1, 6.0, 9)
    table, kind = motion_of(kinfmu.solve(sliding(joint), cam_angle=theta, cam_speed=1.0), "lift")
    exact = [np.cos(theta), -np.sin(theta), -np.cos(theta), np.sin(theta)]
    np.testing.assert_allclose(table, 0.004 * np.array(exact).T + [0.05, 0.0, 0.0, 0.0], atol=1e-14)
    assert kind == "length"


# --------------------------------------------------------------------------------------------------------------- forces


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
    assert " motor 6 N m 0 deg\n" in unwrapped(kinfmu.check(parse(text, "arm.toml")))


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
