"""Motions between two samples: bands that are crossed twice, distances that pass 0, breaks of laws."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

import kinfmu
from kinfmu.mechanism.measures import (
    Dwell,
    Maximum,
    MechanicalAdvantage,
    Minimum,
    PeakAcceleration,
    PeakSpeed,
    Range,
    Reading,
    Roundness,
    Straightness,
    VelocityRatio,
)
from kinfmu.mechanism.quantities import DistanceBetween
from kinfmu.mechanism.toml_file import parse
from kinfmu.motion.history import History

TEXT = """
name = "tappet"
[units]
length = "m"
[gravity]
x = 0
y = "-9.81 m/s2"
[bodies.ground]
points = { O = [0, 0], G = [0, 0] }
[bodies.cam]
points = { O = [0, 0] }
[bodies.stem]
mass = "2 kg"
points = { roller = [0, 0], centre = [0, 0] }
start = { x = 0, y = 0.05 }
[joints]
O = { type = "revolute", between = ["ground.O", "cam.O"] }
guide = { type = "translational", between = ["ground.G", "stem.roller"], axis = "90 deg" }
[joints.lift]
type = "cam_translating"
between = ["ground.O", "stem.roller"]
cam = "cam"
axis = "90 deg"
offset = 0.05
law = "sequence"
repeat = true
begin = "BEGIN"
segments = [
    { law = "LAW", duration = "70 deg", rise = 0.01 },
    { law = "dwell", duration = "60 deg" },
    { law = "LAW", duration = "110 deg", rise = -0.01 },
    { law = "dwell", duration = "120 deg" },
]
[drivers.cam]
type = "angle"
of = "cam"
law = "constant_speed"
speed = "10 rad/s"
"""
RISE, FALL = math.radians(70.0), math.radians(110.0)
MASS, GRAVITY, SPEED, LIFT = 2.0, 9.81, 10.0, 0.01
TURN = np.linspace(0.0, math.tau, 361)
PEAKS = {  # velocity, acceleration of the normalized rise
    "cycloidal": (2.0, math.tau),
    "3-4-5": (15.0 / 8.0, 10.0 / math.sqrt(3.0)),
    "simple_harmonic": (math.pi / 2.0, math.pi**2 / 2.0),
}


def tappet(law: str, begin: str = "40 deg") -> kinfmu.Mechanism:
    return parse(TEXT.replace("LAW", law).replace("BEGIN", begin))


def largest(of: Callable[[float], float]) -> float:
    """Return the largest value of a function on [0, 1]."""
    grid = np.linspace(0.0, 1.0, 401)
    k = int(np.argmax([of(x) for x in grid]))
    ends = (grid[max(k - 1, 0)], grid[min(k + 1, 400)])
    found = minimize_scalar(lambda x: -of(x), bounds=ends, method="bounded", options={"xatol": 1e-12})
    return max(-float(found.fun), of(0.0), of(1.0))


@pytest.mark.parametrize("law", PEAKS)
@pytest.mark.parametrize(("begin", "shift"), [("40 deg", 0.0), ("40 deg", 0.3), ("0 deg", 0.0), ("0.4 deg", 0.0)])
def test_extremes_next_to_a_jump_of_the_jerk(law: str, begin: str, shift: float) -> None:
    run = kinfmu.solve(tappet(law, begin), cam_angle=TURN + math.radians(shift), cam_speed=1.0)
    found = kinfmu.measure(
        run,
        [
            Range("stroke", "stem.y"),
            Maximum("high", "stem.y"),
            Minimum("low", "stem.y"),
            PeakSpeed("speed", "stem.y"),
            PeakAcceleration("acceleration", "stem.y"),
        ],
    )
    velocity, acceleration = PEAKS[law]
    exact = {
        "stroke": LIFT,
        "high": 0.06,
        "low": 0.05,
        "speed": velocity * LIFT / RISE,
        "acceleration": acceleration * LIFT / RISE**2,
    }
    for name, value in exact.items():
        jumps = law == "simple_harmonic" and name == "acceleration"  # its largest value is at the jump: extrapolated
        assert found[name].value == pytest.approx(value, rel=5e-9 if jumps else 1e-9), name


@pytest.mark.parametrize("begin", ["40 deg", "40.37 deg"])
def test_peaks_of_check_on_a_cam_with_dwells(begin: str) -> None:
    """The force on the stem is m (g + a), the torque of the cam that force times the lift's slope."""
    peak = kinfmu.check(tappet("cycloidal", begin)).loading
    assert peak is not None

    def torque(x: float, duration: float, sign: float) -> float:
        slope = sign * LIFT / duration * (1.0 - math.cos(math.tau * x))
        bend = sign * LIFT / duration**2 * math.tau * math.sin(math.tau * x)
        return MASS * (GRAVITY + SPEED**2 * bend) * slope

    high = largest(lambda x: torque(x, RISE, 1.0))
    low = largest(lambda x: -torque(x, FALL, -1.0))
    (found,) = peak.efforts
    assert abs(found.value) == pytest.approx(max(high, low), rel=1e-8)
    assert peak.reaction is not None
    force = MASS * (GRAVITY + SPEED**2 * LIFT * math.tau / RISE**2)
    assert peak.reaction.name == "lift"
    assert peak.reaction.value == pytest.approx(force, rel=1e-8)


@pytest.mark.parametrize("begin", ["40 deg", "40.37 deg"])
@pytest.mark.parametrize("law", ["cycloidal", "modified_sine", "modified_trapezoid"])
@pytest.mark.few(2)
def test_what_is_never_negative_is_0_in_a_dwell(law: str, begin: str) -> None:
    """The reduced inertia is m y'^2; between samples next to a dwell its polynomials go below 0 by 1e-11."""
    mechanism = tappet(law, begin)
    loading = kinfmu.check(mechanism).loading
    assert loading is not None
    (inertia,) = loading.inertias
    steepest = {"cycloidal": 2.0, "modified_sine": 4.0 * math.pi / (4.0 + math.pi), "modified_trapezoid": 2.0}[law]
    assert inertia.smallest == 0.0
    assert inertia.largest == pytest.approx(MASS * (steepest * LIFT / RISE) ** 2, rel=1e-6)
    run = kinfmu.solve(mechanism, cam_angle=TURN, cam_speed=1.0)
    part = {"begin": math.radians(100.0), "end": math.radians(120.0)}
    found = kinfmu.measure(
        run,
        [
            Minimum("inertia", "cam.reduced_inertia"),
            Minimum("energy", "kinetic_energy"),
            Minimum("part", "cam.reduced_inertia", **part),
        ],
    )
    assert [found[name].value for name in ("inertia", "energy", "part")] == [0.0, 0.0, 0.0]
    power = kinfmu.measure(run, [Minimum("power", "cam.power")])["power"].value
    assert power < -1e-3  # other quantities stay negative


# ------------------------------------------------------------------------------------------------------ between samples


FMUS = Path(__file__).parents[2] / "fmus"
TO_Z = DistanceBetween(("ground.Z", "piston.S"))
R, ROD = 45.0, 144.0  # of the gallery's slider_crank


def slide(angle: float) -> float:
    return R * math.cos(angle) + math.sqrt(ROD**2 - (R * math.sin(angle)) ** 2)


def slider_crank(z: float = 0.0) -> kinfmu.Mechanism:
    """Return the gallery's slider-crank with a point Z of the ground on the line of its slide."""
    text = (FMUS / "slider_crank" / "mechanism.toml").read_text("utf-8")
    return parse(text.replace("points = { O = [0, 0] }", f"points = {{ O = [0, 0], Z = [{z}, 0] }}"))


def measured(angles: np.ndarray, *readings: Reading, z: float = 0.0) -> dict[str, kinfmu.MeasuredValue]:
    return kinfmu.measure(kinfmu.solve(slider_crank(z), crank_angle=angles), readings)


@pytest.mark.parametrize("start", [0.0, 0.004, 0.00872, -0.01])
@pytest.mark.parametrize("band", [2e-3, 1e-5, 1e-9])
@pytest.mark.parametrize("count", [361, 37])
def test_a_dwell_shorter_than_a_step(start: float, band: float, count: int) -> None:
    angles = start + np.linspace(0.0, 2.0 * math.pi, count)
    found = measured(angles, Dwell("d", "piston.x", band=band))["d"].value
    half = brentq(lambda a: slide(a) - (R + ROD - band), 0.0, 0.5, xtol=1e-15)
    assert found == pytest.approx(2.0 * half, rel=1e-6 if count == 361 else 1e-4, abs=1e-7)
    assert found < 0.1


@pytest.mark.parametrize("level", [0.7, 0.985, 0.9999])
def test_crossings_between_two_samples_are_found_on_both_sides_of_the_level(level: float) -> None:
    x = np.linspace(0.0, 2.0 * math.pi, 10)  # the peak at pi / 2 lies between two samples
    sine = History(x, np.sin(x), np.cos(x), -np.sin(x))
    for one in (sine, sine.negative()):
        design, at = one.crossings(np.asarray(math.copysign(level, one.rate[0])))
        expected = [math.asin(level), math.pi - math.asin(level)]
        assert sorted(at)[:2] == pytest.approx(expected, abs=2e-3)
        assert not design.any()


@pytest.mark.parametrize("start", [0.0, 0.00872, 1e-4])
@pytest.mark.parametrize("count", [361, 37])
def test_a_distance_that_passes_zero(start: float, count: int) -> None:
    angles = start + np.linspace(0.0, 2.0 * math.pi, count)
    readings = [Minimum("low", TO_Z), Maximum("high", TO_Z), PeakSpeed("speed", TO_Z), PeakSpeed("slide", "piston.x")]
    found = {name: one.value for name, one in measured(angles, *readings, z=130.3).items()}
    assert found["low"] == pytest.approx(0.0, abs=1e-6 if count == 361 else 1e-2)
    assert found["high"] == pytest.approx(max(R + ROD - 130.3, 130.3 - (ROD - R)), rel=1e-9)
    assert found["speed"] == pytest.approx(found["slide"], rel=1e-6 if count == 361 else 1e-3)


def test_a_distance_that_is_zero_at_a_sample_and_at_the_end() -> None:
    angles = np.linspace(0.0, 2.0 * math.pi, 361)
    for z in (slide(angles[100]), R + ROD):
        found = measured(angles, Minimum("low", TO_Z), Maximum("high", TO_Z), z=z)
        assert found["low"].value == pytest.approx(0.0, abs=1e-7)
        assert found["high"].value == pytest.approx(max(R + ROD - z, z - (ROD - R)), rel=1e-9)


def test_a_distance_that_passes_close_to_zero() -> None:
    angles = np.linspace(0.0, 2.0 * math.pi, 361)
    m = kinfmu.load("crank_rocker")
    run = kinfmu.solve(m, crank_angle=angles)
    k = 40
    x, y = float(run["coupler.x"][k]), float(run["coupler.y"][k])
    text = (FMUS / "crank_rocker" / "mechanism.toml").read_text("utf-8")
    assert "[bodies.ground]\npoints = {" in text
    near = 1e-3
    radius = math.hypot(x, y)
    at = [x * (1.0 + near / radius), y * (1.0 + near / radius)]  # just outside the circle of the crank's pin
    text = text.replace("[bodies.ground]\npoints = {", f"[bodies.ground]\npoints = {{ Z = {at},", 1)
    joint = next(j for j in m.joints if "crank" in str(j.between) and "coupler" in str(j.between))
    quantity = DistanceBetween(("ground.Z", next(p for p in joint.between if p.startswith("coupler"))))
    low = kinfmu.measure(kinfmu.solve(parse(text), crank_angle=angles + 0.004), [Minimum("low", quantity)])["low"]
    assert low.value == pytest.approx(near, rel=1e-6)


@pytest.mark.parametrize("start", [0.0, 0.00872, 0.004])
def test_the_roundness_of_a_straight_path_is_zero(start: float) -> None:
    angles = start + np.linspace(0.0, 2.0 * math.pi, 361)
    found = measured(angles, Roundness("round", "piston.S"), Straightness("straight", "piston.S"))
    assert found["round"].value <= found["straight"].value + 1e-15
    assert found["round"].value == pytest.approx(0.0, abs=1e-10)


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.few(1)
def test_designs_whose_distance_passes_zero(engine: str) -> None:
    text = (FMUS / "slider_crank" / "mechanism.toml").read_text("utf-8")
    text = text.replace("points = { O = [0, 0] }", 'points = { O = [0, 0], Z = ["z", 0] }')
    model = kinfmu.compile(parse("parameters.z = 130.3\n" + text), engine=engine)
    levels = [130.3, slide(math.radians(100.0)), 250.0]
    readings = [Minimum("low", TO_Z), Maximum("high", TO_Z)]
    angles = np.linspace(0.0, 2.0 * math.pi, 361)
    found = kinfmu.measure_designs(model, {"z": levels}, readings, crank_angle=angles)
    assert found["low"] == pytest.approx([0.0, 0.0, 250.0 - R - ROD], abs=1e-6)
    assert found["high"] == pytest.approx([max(R + ROD - z, z - (ROD - R)) for z in levels], rel=1e-9)


@pytest.mark.parametrize("start", [0.0, 0.00872, 0.004])
@pytest.mark.parametrize("count", [361, 37])
def test_ratios_of_speeds_across_a_dead_centre(start: float, count: int) -> None:
    angles = start + np.linspace(0.0, 2.0 * math.pi, count)
    readings: list[Reading] = [
        VelocityRatio("high", "rod.phi", "piston.x"),
        VelocityRatio("low", "rod.phi", "piston.x", extreme="minimum"),
        MechanicalAdvantage("advantage", "rod.phi", "piston.x"),
        VelocityRatio("inside", "rod.phi", "piston.x", begin=0.5, end=2.5),
        VelocityRatio("of_driver", "piston.x"),
    ]
    found = measured(angles, *readings)
    for name in ("high", "low"):
        assert math.isnan(found[name].value)
        assert found[name].reason == "piston.x turns back, where the ratio has no bound"
    assert found["advantage"].value == 0.0
    assert math.sin(found["advantage"].at[0]) == pytest.approx(0.0, abs=1e-6)
    assert math.isfinite(found["inside"].value)
    assert found["of_driver"].value == pytest.approx(47.163189, rel=1e-4)


def test_designs_whose_ratios_have_no_bound() -> None:
    angles = 0.004 + np.linspace(0.0, 2.0 * math.pi, 361)
    text = (FMUS / "slider_crank" / "mechanism.toml").read_text("utf-8").replace("S = [144, 0]", 'S = ["rod", 0]')
    readings = [VelocityRatio("ratio", "rod.phi", "piston.x"), MechanicalAdvantage("advantage", "rod.phi", "piston.x")]
    model = kinfmu.compile(parse("parameters.rod = 144\n" + text))
    found = kinfmu.measure_designs(model, {"rod": [144.0, 130.0]}, readings, crank_angle=angles)
    assert np.isnan(found["ratio"]).all()
    assert found["advantage"].tolist() == [0.0, 0.0]
    assert found.reasons == dict.fromkeys((0, 1), "piston.x turns back, where the ratio has no bound")


def test_two_quantities_that_turn_together_have_a_ratio() -> None:
    text = (FMUS / "slider_crank" / "mechanism.toml").read_text("utf-8")
    text += """
[bodies.wheel]
points = { W = [0, 0] }
[joints.W]
type = "revolute"
between = ["ground.O", "wheel.W"]
[joints.gear]
type = "gear"
between = ["rod", "wheel"]
ratio = 0.5
"""
    run = kinfmu.solve(parse(text), crank_angle=0.004 + np.linspace(0.0, 2.0 * math.pi, 361))
    found = kinfmu.measure(run, [VelocityRatio("ratio", "wheel.phi", "rod.phi")])["ratio"]
    assert found.value == pytest.approx(0.5, rel=1e-6)
