"""Extremes of motions whose laws have jumps of the jerk, against closed forms: a mass on a cam with dwells."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import kinfmu
from kinfmu.mechanism.measures import Maximum, Minimum, PeakAcceleration, PeakSpeed, Range
from kinfmu.mechanism.toml_file import parse

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
