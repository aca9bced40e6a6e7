"""Measures of gallery mechanisms against their closed forms, from 361 samples of a turn."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import kinfmu
from kinfmu.errors import KinfmuError
from kinfmu.mechanism.laws import Harmonic
from kinfmu.mechanism.measures import (
    Dwell,
    Maximum,
    MechanicalAdvantage,
    Minimum,
    PathDistance,
    PeakAcceleration,
    PeakSpeed,
    PressureAngle,
    Range,
    Reading,
    Roundness,
    Straightness,
    TimeRatio,
    TransmissionAngle,
    VelocityRatio,
)
from kinfmu.mechanism.quantities.arithmetic import cos, sin
from kinfmu.mechanism.toml_file import parse
from kinfmu.motion.fitting import Circle, deviation
from kinfmu.motion.history import History
from kinfmu.plan.equations.taylor import Taylor

TURN = np.linspace(0.0, 2.0 * math.pi, 361)
EXACT = {"rel": 1e-9, "abs": 1e-12}


def measured(name: str, *readings: Reading) -> dict[str, kinfmu.MeasuredValue]:
    return kinfmu.measure(kinfmu.solve(kinfmu.load(name), crank_angle=TURN), readings)


def test_stroke_and_dead_centres_of_an_offset_slider_crank() -> None:
    r, rod, e = 30.0, 100.0, 20.0
    found = measured("offset_slider_crank", Range("stroke", "slider.x"))["stroke"]
    assert found.value == pytest.approx(math.sqrt((rod + r) ** 2 - e**2) - math.sqrt((rod - r) ** 2 - e**2), **EXACT)
    assert found.at == pytest.approx((math.pi + math.asin(e / (rod - r)), math.asin(e / (rod + r))), **EXACT)
    assert (found.unit, found.driver, found.at_unit) == ("mm", "crank", "rad")


def test_time_ratio_of_an_offset_slider_crank() -> None:
    found = measured("offset_slider_crank", TimeRatio("ratio", "slider.x"))["ratio"]
    alpha = math.asin(20.0 / 70.0) - math.asin(20.0 / 130.0)
    assert found.value == pytest.approx((math.pi + alpha) / (math.pi - alpha), **EXACT)


def test_stroke_of_an_in_line_slider_crank_lies_at_samples() -> None:
    found = measured("slider_crank", Range("stroke", "piston.x"))["stroke"]
    assert found.value == pytest.approx(90.0, **EXACT)
    assert found.at[0] == pytest.approx(math.pi, **EXACT)


def test_swing_angle_and_time_ratio_of_a_crank_rocker() -> None:
    found = measured("crank_rocker", Range("swing", "rocker.phi"), TimeRatio("ratio", "rocker.phi"))

    def at_ground(near: float, far: float) -> float:
        return math.acos((40.0**2 + near**2 - far**2) / (2.0 * 40.0 * near))

    swing = math.acos((40.0**2 + 50.0**2 - 70.0**2) / 4000.0) - math.acos((40.0**2 + 50.0**2 - 30.0**2) / 4000.0)
    assert found["swing"].value == pytest.approx(swing, **EXACT)
    alpha = abs(at_ground(70.0, 50.0) - at_ground(30.0, 50.0))
    assert found["ratio"].value == pytest.approx((math.pi + alpha) / (math.pi - alpha), **EXACT)


def test_transmission_angle_is_worst_where_crank_and_ground_are_in_line() -> None:
    reading = TransmissionAngle("mu", ("coupler.P", "coupler.Q"), ("rocker.C", "rocker.Q"))
    found = measured("crank_rocker", reading)["mu"]
    at_0, at_180 = (math.acos((2.0 * 50.0**2 - f**2) / (2.0 * 50.0**2)) for f in (20.0, 60.0))
    worst = max(abs(at_0 - 0.5 * math.pi), abs(at_180 - 0.5 * math.pi))
    assert found.value == pytest.approx(worst, **EXACT)
    assert found.at == pytest.approx((0.0,), abs=1e-9)


def tracer(u: float) -> tuple[float, float]:
    """Return the tracer of Hoeken's linkage: C + 2 h n, h the height of the equal-sided triangle over P C."""
    x, y = 20.0 * math.cos(u) - 40.0, 20.0 * math.sin(u)
    f = math.hypot(x, y)
    h = math.sqrt(2500.0 - 0.25 * f * f)
    return 40.0 + 2.0 * h * y / f, -2.0 * h * x / f


def test_straightness_of_hoekens_linkage() -> None:
    begin, end = 0.55 * math.pi, 1.45 * math.pi
    found = measured("crank_rocker", Straightness("line", "coupler.tracer", begin, end))["line"]
    u = np.linspace(begin, end, 2001)
    y = np.array([tracer(one)[1] for one in u])
    extremes = []
    for sign in (1.0, -1.0):
        k = int(np.clip(np.argmin(sign * y), 1, len(u) - 2))
        best = minimize_scalar(lambda one: sign * tracer(one)[1], bounds=(u[k - 1], u[k + 1]), method="bounded")  # noqa: B023
        extremes.append(min(best.fun, sign * y[0], sign * y[-1]))
    # The part is symmetric about 180 degrees, so the best line is parallel to the ground.
    assert found.value == pytest.approx(-0.5 * sum(extremes), **EXACT)


def test_peak_speed_and_acceleration_of_a_scotch_yoke_over_time() -> None:
    mechanism = kinfmu.load("scotch_yoke")
    run = kinfmu.solve(mechanism, np.linspace(0.0, 0.5, 361))
    found = kinfmu.measure(run, [PeakSpeed("v", "yoke.x"), PeakAcceleration("a", "yoke.x"), PeakSpeed("p", "crank.P")])
    omega = 4.0 * math.pi
    assert found["v"].value == pytest.approx(40.0 * omega, **EXACT)
    assert found["a"].value == pytest.approx(40.0 * omega**2, **EXACT)
    assert found["p"].value == pytest.approx(40.0 * omega, **EXACT)
    assert [found[name].unit for name in "va"] == ["mm/s", "mm/s2"]
    assert abs(math.sin(found["v"].at[0])) == pytest.approx(1.0, **EXACT)


def test_peaks_of_a_slider_crank_per_radian_of_the_crank() -> None:
    found = measured("slider_crank", PeakSpeed("v", "piston.x"), PeakAcceleration("a", "piston.x"))

    def speed(u: float) -> float:
        s, c = math.sin(u), math.cos(u)
        return 45.0 * s + 45.0**2 * s * c / math.sqrt(144.0**2 - (45.0 * s) ** 2)

    best = minimize_scalar(lambda u: -speed(u), bounds=(0.5, 2.0), method="bounded", options={"xatol": 1e-10})
    assert found["v"].value == pytest.approx(-best.fun, **EXACT)
    assert found["a"].value == pytest.approx(45.0 + 45.0**2 / 144.0, **EXACT)  # at the outer dead centre
    assert found["v"].unit == "mm/rad"


def test_dwell_of_a_scotch_yoke() -> None:
    band = 40.0 * (1.0 - math.cos(0.2003))
    found = measured("scotch_yoke", Dwell("top", "yoke.x", band), Dwell("low", "yoke.x", band, near="minimum"))
    assert found["top"].value == pytest.approx(2.0 * 0.2003, **EXACT)
    assert found["low"].value == pytest.approx(2.0 * 0.2003, **EXACT)
    assert found["low"].at == pytest.approx((math.pi - 0.2003, math.pi + 0.2003), **EXACT)


def test_pressure_angle_of_an_eccentric_cam() -> None:
    """A circular cam is a slider-crank: crank = eccentricity, rod = radius of the pitch circle."""
    reading = PressureAngle("alpha", cam="crank", follower="piston.S", axis=0.0)
    found = measured("slider_crank", reading)["alpha"]
    assert found.value == pytest.approx(math.asin(45.0 / 144.0), **EXACT)
    assert abs(math.sin(found.at[0])) == pytest.approx(1.0, **EXACT)


def test_pressure_angle_of_an_eccentric_cam_with_a_swinging_follower() -> None:
    """The four-bar in its place has the normal of the cam as coupler: 90 degrees minus the transmission angle."""
    reading = PressureAngle("alpha", cam="crank", follower="rocker.Q", pivot="rocker.C")
    found = measured("crank_rocker", reading)["alpha"]
    assert found.value == pytest.approx(0.5 * math.pi - math.acos((2.0 * 50.0**2 - 20.0**2) / 5000.0), **EXACT)


@pytest.mark.parametrize("band", [40.0 * (1.0 - math.cos(0.2003)) + shift for shift in (-1e-14, 0.0, 1e-14)])
@pytest.mark.parametrize("side", [-0.2003, 0.2003])
def test_a_dwell_that_begins_or_ends_where_the_motion_closes(band: float, side: float) -> None:
    run = kinfmu.solve(kinfmu.load("scotch_yoke"), crank_angle=TURN + side)
    assert kinfmu.measure(run, [Dwell("top", "yoke.x", band)])["top"].value == pytest.approx(2.0 * 0.2003, **EXACT)


def test_velocity_ratio_and_mechanical_advantage() -> None:
    low = VelocityRatio("low", "yoke.x", extreme="minimum")
    yoke = measured("scotch_yoke", low, MechanicalAdvantage("ma", "yoke.x"))
    assert yoke["low"].value == pytest.approx(-40.0, **EXACT)
    assert yoke["ma"].value == pytest.approx(1.0 / 40.0, **EXACT)
    assert (yoke["low"].unit, yoke["ma"].unit) == ("mm/rad", "rad/mm")
    ratio = measured("slider_crank", VelocityRatio("r", "rod.phi", to="crank.phi"))["r"]
    assert ratio.value == pytest.approx(45.0 / 144.0, **EXACT)
    assert ratio.unit == "1"


def test_a_target_path_is_as_far_as_its_farthest_point() -> None:
    targets = tuple((r * math.cos(u), r * math.sin(u)) for r, u in ((41.0, 0.301), (37.5, 4.0009), (40.0, 1.0)))
    found = measured("scotch_yoke", PathDistance("d", "crank.P", targets))["d"]
    assert found.value == pytest.approx(2.5, **EXACT)
    assert found.at == pytest.approx((4.0009,), abs=1e-9)


def test_an_ellipse_is_as_far_from_a_circle_as_its_half_axes_differ() -> None:
    assert measured("scotch_yoke", Roundness("r", "crank.P"))["r"].value == pytest.approx(0.0, abs=1e-12)
    assert measured("slider_crank", Straightness("s", "piston.S"))["s"].value == pytest.approx(0.0, abs=1e-12)
    run = kinfmu.solve(kinfmu.load("elliptic_trammel"), bar_angle=TURN)
    pen = kinfmu.measure(run, [Roundness("r", "bar.pen"), Straightness("s", "bar.pen")])
    assert pen["r"].value == pytest.approx(0.5 * (160.0 - 60.0), **EXACT)
    assert pen["s"].value == pytest.approx(60.0, **EXACT)


@pytest.mark.parametrize(("begin", "end", "lowest", "highest"), [(0.5, 1.5, 1.5, 0.5), (5.5, 0.7, 5.5, 0.0)])
def test_a_part_of_the_motion_has_its_own_extremes(begin: float, end: float, lowest: float, highest: float) -> None:
    found = measured("scotch_yoke", Minimum("low", "yoke.x", begin, end), Maximum("high", "yoke.x", begin, end))
    at_low = min((begin, end), key=math.cos)
    assert math.cos(lowest) == pytest.approx(math.cos(at_low))
    assert found["low"].value == pytest.approx(40.0 * math.cos(lowest), **EXACT)
    assert found["high"].value == pytest.approx(40.0 * math.cos(highest), **EXACT)


STANDING = [  # laws that stand still for a moment, or for long
    'law = "harmonic", start = "100 deg", amplitude = "40 deg", frequency = "0.7 Hz"',
    'law = "sequence", start = 1, segments = [{ law = "dwell", duration = 0.5 }, { law = "cycloidal", rise = 2, '
    'duration = 0.7 }, { law = "dwell", duration = 0.8 }]',
    'law = "sequence", segments = [{ law = "3-4-5", rise = "1 rev", duration = 1.5 }, { law = "dwell", duration = 1 }]',
    'law = "polynomial", coefficients = [0.3, 0, 0.4]',
    'law = "constant_speed", start = 0.3, speed = -2',
]


@pytest.mark.parametrize(
    ("law", "engine"), [*((law, "python") for law in STANDING), *((law, "native") for law in STANDING[:2])]
)
@pytest.mark.few(2)
def test_ratios_are_geometry_where_the_law_stands_still(law: str, engine: str) -> None:
    """dx/du = -r sin u (1 + r cos u / sqrt(l^2 - r^2 sin^2 u)) of a slider-crank, over the angles of the law."""
    r, rod = 0.2, 0.6
    mechanism = parse(f"""
name = "press"
run = {{ stop = 2.0, step = 0.0101 }}
parameters = {{ r = "0.2 m" }}
[bodies]
ground.points = {{ O = [0, 0] }}
crank = {{ points = {{ O = [0, 0], P = ["r", 0] }} }}
rod = {{ points = {{ P = [0, 0], S = [{rod}, 0] }} }}
ram = {{ points = {{ S = [0, 0] }}, start = {{ x = 0.7, y = 0, phi = 0 }} }}
[joints]
O = {{ type = "revolute", between = ["ground.O", "crank.O"] }}
P = {{ type = "revolute", between = ["crank.P", "rod.P"] }}
S = {{ type = "revolute", between = ["rod.S", "ram.S"] }}
guide = {{ type = "translational", between = ["ground.O", "ram.S"] }}
[drivers]
crank = {{ type = "angle", of = "crank", {law} }}
""")
    readings = (
        VelocityRatio("low", "ram.x", extreme="minimum"),
        VelocityRatio("high", "ram.x"),
        MechanicalAdvantage("ma", "ram.x"),
        VelocityRatio("rods", "rod.phi", to="crank.phi"),
    )
    run = kinfmu.solve(mechanism, engine=engine)
    found = kinfmu.measure(run, readings)
    fine = np.array([mechanism.drivers[0].law.at(t) for t in np.linspace(run.t[0], run.t[-1], 20001)])
    u = np.linspace(fine.min(), fine.max(), 200001)
    root = np.sqrt(rod**2 - (r * np.sin(u)) ** 2)
    ratio, of_rod = -r * np.sin(u) * (1.0 + r * np.cos(u) / root), -r * np.cos(u) / root
    assert found["low"].value == pytest.approx(ratio.min(), abs=2e-9)
    assert found["high"].value == pytest.approx(ratio.max(), abs=2e-9)
    assert found["ma"].value == pytest.approx(1.0 / np.abs(ratio).max(), rel=1e-8)
    assert found["rods"].value == pytest.approx(of_rod.max(), abs=2e-9)
    model = kinfmu.compile(mechanism, parameters=["r"], engine=engine)
    table = kinfmu.measure_designs(model, {"r": [0.2, 0.1]}, readings)
    for name, one in found.items():
        assert table[name][0] == pytest.approx(one.value, rel=1e-12)
    other = -0.1 * np.sin(u) * (1.0 + 0.1 * np.cos(u) / np.sqrt(rod**2 - (0.1 * np.sin(u)) ** 2))
    assert table["low"][1] == pytest.approx(other.min(), abs=2e-9)


def test_a_ratio_to_a_driver_that_rests_for_the_whole_run_has_no_value() -> None:
    mechanism = kinfmu.load("scotch_yoke")
    (crank,) = mechanism.drivers
    rests = replace(mechanism, drivers=(replace(crank, law=Harmonic(0.0, 1.0)),))
    with pytest.raises(KinfmuError, match="crank does not move"):
        kinfmu.measure(kinfmu.solve(rests), [MechanicalAdvantage("ma", "yoke.x")])


@pytest.mark.parametrize("count", [90, 360])
@pytest.mark.parametrize("turned", [0.0, 0.7])
@pytest.mark.parametrize(("half", "width"), [(0.5, 0.05), (0.8, 0.05), (1.2, 0.02), (0.5, 0.1)])
@pytest.mark.few(7)
def test_roundness_of_a_bent_oval_is_half_its_width_although_its_ring_is_not_unique(
    half: float, width: float, turned: float, count: int
) -> None:
    """An oval along an arc: its nearest and farthest point have one normal, on which the centre may be anywhere."""
    t = np.linspace(0.0, math.tau, count + 1) + 0.0123
    along = Taylor.of(2, t, np.ones_like(t), np.zeros_like(t))
    angle, radius = cos(along) * half + turned, sin(along) * width + 1.0
    x, y = (
        History(t, *map(one.derivative, range(3)), is_closed=True)
        for one in (radius * cos(angle) + 3.0, radius * sin(angle))
    )
    assert float(deviation(x, y, Circle)) == pytest.approx(width, abs=1e-9 if count == 90 else 1e-13)
