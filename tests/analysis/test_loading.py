"""Efforts, reduced inertia and reactions in the report of check, against closed forms."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import mpmath
import numpy as np
import pytest

import kinfmu
from kinfmu.mechanism.toml_file import parse
from tests.reports import unwrapped
from tests.run.test_forces import loaded

ARM = """
name = "arm"
units = { length = "mm" }
gravity = { x = 0, y = "-10 m/s2" }

[bodies]
ground.points = { O = [0, 0] }
arm = { points = { O = [0, 0] }, mass = "2 kg", center_of_mass = [300, 0], inertia = "0.5 kg m2" }

[joints]
O = { type = "revolute", between = ["ground.O", "arm.O"] }

[drivers.arm]
type = "angle"
of = "arm"
law = "constant_speed"
start = 0
speed = 4
"""


def test_an_arm_that_turns_has_the_torque_of_its_weight() -> None:
    """Torque m g r cos(phi), inertia I + m r^2, and at the lowest point the reaction m g + m r omega^2."""
    report = kinfmu.check(parse(ARM, "arm.toml"))
    found = report.loading
    assert found is not None
    assert found.over == "one turn of arm at 4 rad/s"
    (torque,) = found.efforts
    assert (torque.name, torque.unit, torque.driver, torque.at_unit) == ("arm.torque", "N m", "arm", "rad")
    assert abs(torque.value) == pytest.approx(6.0, rel=1e-12)
    assert torque.rms == pytest.approx(6.0 / math.sqrt(2.0), rel=1e-12)
    (inertia,) = found.inertias
    assert (inertia.smallest, inertia.largest) == pytest.approx((0.68, 0.68), rel=1e-12)
    assert found.reaction is not None
    assert (found.reaction.name, found.reaction.unit) == ("O", "N")
    assert found.reaction.value == pytest.approx(20.0 + 2.0 * 0.3 * 16.0, rel=1e-12)
    assert found.reaction.at == pytest.approx(1.5 * math.pi, rel=1e-12)
    assert found.undetermined == ()
    force, moment = found.shaking  # the arm is at the origin: its torque and bearing are all that the ground feels
    assert (force.value, moment.value) == pytest.approx((29.6, -torque.value), rel=1e-12)
    assert (force.unit, moment.unit) == ("N", "N m")
    text = unwrapped(report, detail=False)
    assert " Over one turn of arm at 4 rad/s\n force peak at arm rms\n arm.torque " in text
    assert " 4.243 N m\n largest reaction: O 29.6 N 270 deg " in text
    assert "\n shaking_force 29.6 N 270 deg " in text
    assert "\n arm.reduced_inertia 0.68 kg m2 0.68 kg m2" in text


def test_json_has_the_same_numbers() -> None:
    report = kinfmu.check(parse(ARM, "arm.toml"))
    found = json.loads(json.dumps(report.as_json()))["forces"]
    assert found["over"] == "one turn of arm at 4 rad/s"
    assert abs(found["efforts"][0]["value"]) == pytest.approx(6.0, rel=1e-12)
    assert found["largest_reaction"]["value"] == pytest.approx(29.6, rel=1e-12)
    assert [peak["name"] for peak in found["shaking"]] == ["shaking_force", "shaking_moment"]
    assert found["reduced_inertias"][0]["name"] == "arm.reduced_inertia"
    assert (found["undetermined"], found["reason"], found["samples_without_numbers"]) == ([], None, 0)


def test_undetermined_reactions_are_named_with_the_row_that_shares_the_load() -> None:
    report = kinfmu.check(loaded("fourbar"))
    assert report.loading is not None
    assert report.loading.reaction is None
    words = "note Statically indeterminate: O.force_x, O.force_y, P.force_x, P.force_y, C.force_x, C.force_y, "
    assert f"{words}Q.force_x, Q.force_y share the load with AB.length" in unwrapped(report)
    ((names, rows),) = report.loading.undetermined
    assert "AB.force" in names
    assert rows[0] == "AB.length"


def test_other_motions_are_the_run_of_the_file() -> None:
    report = kinfmu.check(loaded("excavator"))
    assert report.loading is not None
    assert report.loading.over == "the run of the file, t = 0 to 5 s"
    assert [effort.name for effort in report.loading.efforts] == [
        f"{name}_cylinder.force" for name in ("boom", "stick", "bucket")
    ]
    assert {effort.driver for effort in report.loading.efforts} == {"time"}


def test_without_masses_and_loads_nothing_is_reported_of_forces() -> None:
    report = kinfmu.check(kinfmu.load("slider_crank"))
    assert report.loading is None
    assert "forces" not in report.as_json()
    assert "force" not in str(report)


def test_a_load_moves_the_peak() -> None:
    """Without a mass, the torque balances a constant torque on the arm."""
    mechanism = parse(ARM, "arm.toml")
    (ground, arm) = mechanism.bodies
    light = replace(arm, mass=0.0, inertia=0.0, center_of_mass=(0.0, 0.0))
    text = '[loads.brake]\ntype = "torque"\non = "arm"\nlaw = "constant"\nlevel = "-3 N m"\n'
    loads = parse(ARM + text, "arm.toml").loads
    report = kinfmu.check(replace(mechanism, bodies=(ground, light), loads=loads))
    assert report.loading is not None
    assert report.loading.efforts[0].value == pytest.approx(3.0, rel=1e-12)
    assert report.loading.efforts[0].rms == pytest.approx(3.0, rel=1e-12)
    assert report.loading.inertias == ()


def test_the_cycle_of_a_four_stroke_engine_is_two_turns() -> None:
    found = kinfmu.check(kinfmu.load("engine")).loading
    assert found is not None
    assert found.over.startswith("2 turns of crank")


@pytest.mark.parametrize(
    ("law", "turns"),
    [
        ('law = "harmonic", amplitude = 2, frequency = 0.5', "2 turns"),
        ('law = "harmonic", amplitude = 2, frequency = 1.25', "4 turns"),
        ('law = "harmonic", amplitude = 2, frequency = 3', "one turn"),
        (
            'law = "sequence", repeat = true, segments = [{ law = "cycloidal", rise = 2, duration = "540 deg" },'
            ' { law = "cycloidal", rise = -2, duration = "540 deg" }]',
            "3 turns",
        ),
    ],
)
def test_the_cycle_lasts_until_the_law_of_a_load_repeats(law: str, turns: str) -> None:
    text = f"""
name = "wheel"
[bodies]
ground.points = {{ O = [0, 0] }}
wheel = {{ points = {{ O = [0, 0] }}, inertia = 1, mass = 1 }}
[joints]
O = {{ type = "revolute", between = ["ground.O", "wheel.O"] }}
[drivers]
wheel = {{ type = "angle", of = "wheel", law = "constant_speed", speed = 1 }}
[loads]
work = {{ type = "torque", on = "wheel", over = {{ measure = "angle", of = "wheel" }}, {law} }}
"""
    found = kinfmu.check(parse(text)).loading
    assert found is not None
    assert found.over.startswith(f"{turns} of wheel")
    assert abs(found.efforts[0].value) == pytest.approx(2.0, rel=1e-9)


def test_peaks_lie_between_the_samples() -> None:
    """Slider-crank with all mass in the slider: torque, inertia and guide force by closed forms, their peaks by mpmath.

    x = cos u + sqrt(n^2 - sin^2 u),  F = m x'' w^2,  torque = F x',  reduced inertia = m x'^2
    """
    n, m, w = mpmath.mpf("3.7"), mpmath.mpf("1.3"), mpmath.mpf("11.25")
    text = """
name = "ram"
[bodies]
ground.points = { O = [0, 0] }
crank = { points = { O = [0, 0], P = [1, 0] } }
rod = { points = { P = [0, 0], S = [3.7, 0] } }
ram = { points = { S = [0, 0] }, start = { x = 4.7, y = 0, phi = 0 }, mass = "1.3 kg" }
[joints]
O = { type = "revolute", between = ["ground.O", "crank.O"] }
P = { type = "revolute", between = ["crank.P", "rod.P"] }
S = { type = "revolute", between = ["rod.S", "ram.S"] }
guide = { type = "translational", between = ["ground.O", "ram.S"] }
[drivers]
crank = { type = "angle", of = "crank", law = "constant_speed", start = 0.123, speed = 11.25 }
"""
    found = kinfmu.check(parse(text, "ram.toml")).loading
    assert found is not None

    def x(u: Any) -> Any:
        return mpmath.cos(u) + mpmath.sqrt(n * n - mpmath.sin(u) ** 2)

    def slope(u: Any) -> Any:
        return mpmath.diff(x, u)

    def torque(u: Any) -> Any:
        return m * w * w * mpmath.diff(x, u, 2) * slope(u)

    def normal(u: Any) -> Any:  # the rod pushes the ram sideways
        return m * w * w * mpmath.diff(x, u, 2) * mpmath.sin(u) / mpmath.sqrt(n * n - mpmath.sin(u) ** 2)

    def peak(of: Callable[[Any], Any], near: float) -> tuple[float, float]:
        at = mpmath.findroot(lambda u: mpmath.diff(of, u), near)
        return float(abs(of(at))), float(at)

    with mpmath.workdps(40):
        (effort,) = found.efforts
        value, at = peak(torque, effort.at)
        assert abs(effort.value) == pytest.approx(value, rel=1e-9)
        assert effort.at == pytest.approx(at, abs=1e-6)
        (inertia,) = found.inertias
        assert inertia.largest == pytest.approx(peak(lambda u: m * slope(u) ** 2, 1.3)[0], rel=1e-9)
        assert inertia.smallest == pytest.approx(0.0, abs=1e-9)
        assert found.reaction is not None
        (u, *_) = [k * mpmath.pi for k in (2,)]
        force = mpmath.sqrt((m * w * w * mpmath.diff(x, u, 2)) ** 2 + normal(u) ** 2)
        assert found.reaction.value == pytest.approx(float(force), rel=1e-9)  # at the outer dead centre
    samples = kinfmu.solve(parse(text, "ram.toml"), np.linspace(0, 2 * math.pi / 11.25, 361))["crank.torque"]
    assert np.abs(samples).max() < value * (1.0 - 1e-7)  # the peak is between the samples


def test_gravity_springs_and_loads_beyond_their_tables_are_reported() -> None:
    loads = """
[gravity]
x = 0
y = -9.81
[loads.coil]
type = "spring"
between = ["ground.F", "arm.E"]
stiffness = 40
free_length = 0.1
[loads.push]
type = "force_along"
at = "arm.E"
over = { measure = "coordinate", of = "arm.E", axis = "x" }
law = "spline"
points = [[-0.3, 1], [-0.1, 2], [0.1, 2], [0.2, 5]]
[loads.gust]
type = "torque"
on = "arm"
law = "spline"
points = [[0, 0], [0.5, 3], [0.7, 3], [1, 7]]
[loads.whole]
type = "torque"
on = "arm"
over = { measure = "angle", of = "arm" }
law = "spline"
points = [[0, 0], [2, 1], [4, 1], ["360 deg", 0]]
"""
    text = f"""
name = "arm"
units.length = "m"
[bodies]
ground.points = {{ O = [0, 0], F = [1, 0] }}
arm = {{ points = {{ O = [0, 0], E = [0.4, 0] }}, mass = 1 }}
[joints]
O = {{ type = "revolute", between = ["ground.O", "arm.O"] }}
[drivers]
arm = {{ type = "angle", of = "arm", law = "constant_speed", speed = 4 }}
{loads}"""
    report = kinfmu.check(parse(text))
    found = report.loading
    assert found is not None
    assert found.gravity == (0.0, -9.81)
    force, length = found.loads
    assert (force.smallest, force.largest) == pytest.approx((-40.0 * 1.3, -40.0 * 0.5), rel=1e-9)
    assert (length.smallest, length.largest, length.unit) == (pytest.approx(0.6), pytest.approx(1.4), "m")
    push, gust = found.left_tables  # the table of a whole turn is not left
    assert push.reached == pytest.approx((-0.4, 0.4))
    assert gust.reached == pytest.approx((0.0, math.tau / 4.0))
    shown = [line.strip() for line in unwrapped(report).splitlines()]
    assert "gravity (0, -9.81) m/s2" in shown
    assert {"coil.force -52 N -20 N", "coil.length 0.6 m 1.4 m"} <= {*shown}
    beyond = "note push: its table goes from -0.3 m to 0.2 m, the motion from -0.4 m to 0.4 m; it keeps "
    assert f"{beyond}1 N before it and 5 N after it" in shown
    ends = "from 0 s to 1 s, the motion from 0 s to 1.571 s"
    assert f"note gust: its table goes {ends}; it keeps 7 N m after it" in unwrapped(report, detail=False)
    written = report.as_json()["forces"]
    assert (written["gravity"], len(written["loads"]), len(written["left_tables"])) == ([0.0, -9.81], 2, 2)
