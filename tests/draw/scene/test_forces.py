"""Arrows of reactions: their directions balance a body, their scale is that of the legend."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import kinfmu
from kinfmu.draw.scene.forces import LONGEST, arrows
from kinfmu.draw.scene.scene import scene
from kinfmu.mechanism.toml_file import parse
from kinfmu.run import Run
from tests.analysis.test_loading import ARM
from tests.motion.cams.followers import ALL
from tests.run.test_forces import loaded


@pytest.fixture(scope="module")
def run() -> Run:
    return kinfmu.solve(loaded("slider_crank"))


def test_arrows_are_the_forces_to_the_scale_of_the_legend(run: Run) -> None:
    assert run.mechanism is not None
    shown = scene(run, run.mechanism)
    found = arrows(run, run.mechanism, shown)
    assert found is not None
    assert set(found.along) == {"joints.O", "joints.P", "joints.S", "joints.bore"}
    newtons = found.along["joints.P"] * found.newton / found.length
    np.testing.assert_allclose(newtons, np.column_stack([run["P.force_x"], run["P.force_y"]]), rtol=1e-12)
    bore = found.along["joints.bore"] * found.newton / found.length
    np.testing.assert_allclose(bore[:, 0], 0.0, atol=1e-12)  # the bore is along x
    np.testing.assert_allclose(bore[:, 1], run["bore.force"], rtol=1e-12)
    np.testing.assert_allclose(found.at["joints.P"], np.column_stack([run["rod.x"], run["rod.y"]]), atol=1e-9)
    longest = max(float(np.hypot(*along.T).max()) for along in found.along.values())
    assert longest == pytest.approx(LONGEST * shown.size, rel=0.02)
    assert found.legend == "1000 N"


def test_undetermined_reactions_and_those_not_kept_have_no_arrow(run: Run) -> None:
    fourbar = kinfmu.solve(loaded("fourbar"), np.arange(5.0))
    assert fourbar.mechanism is not None
    assert run.mechanism is not None
    assert arrows(fourbar, fourbar.mechanism, scene(fourbar, fourbar.mechanism)) is None
    part = run.without(["P.force_x"])
    found = arrows(part, run.mechanism, scene(part, run.mechanism))
    assert found is not None
    assert set(found.along) == {"joints.O", "joints.S", "joints.bore"}


def test_joints_between_bodies_have_no_arrow() -> None:
    lever = """[bodies.lever]
points = { E = [0, 0] }
mass = 1
[joints.E]
type = "revolute"
between = ["ground.O", "lever.E"]
[joints.lobe]
type = "cam_oscillating"
between = ["ground", "lever"]
cam = "arm"
law = "harmonic"
amplitude = "10 deg"
frequency = 1
"""
    mechanism = parse(ARM + lever, "lever.toml")
    run = kinfmu.solve(mechanism)
    found = arrows(run, mechanism, scene(run, mechanism))
    assert found is None  # the bearings depend on the contact, which is unknown


@pytest.mark.parametrize("follower", ALL)
@pytest.mark.few(5)
def test_the_force_of_a_cam_starts_at_the_contact_and_is_that_on_its_axle(follower: str) -> None:
    """The cam has no weight, so its axle carries the contact force alone."""
    mechanism = ALL[follower]()
    mechanism = replace(
        mechanism,
        bodies=tuple(
            replace(body, mass=1.0, center_of_mass=(-20.0, 0.0)) if body.name == "follower" else body
            for body in mechanism.bodies
        ),
        gravity=(0.0, -9810.0),
    )
    run = kinfmu.solve(mechanism, np.linspace(0.0, 0.9, 7))
    shown = scene(run, mechanism)
    found = arrows(run, mechanism, shown)
    assert found is not None
    newtons = found.along["joints.lift"] * found.newton / found.length
    np.testing.assert_allclose(newtons, np.column_stack([run["O.force_x"], run["O.force_y"]]), rtol=1e-9, atol=1e-9)
    x, y = found.at["joints.lift"].T
    moment = x * newtons[:, 1] - y * newtons[:, 0]  # about the axle, in N mm
    np.testing.assert_allclose(moment, 1e3 * run["cam.torque"], rtol=1e-8, atol=1e-8)


LOADS = """
[loads.weight]
type = "force"
at = "arm.O"
y = "-50 N"

[loads.push]
type = "force_along"
at = "arm.O"
axes = "arm"
law = "constant"
level = "30 N"

[loads.wind]
type = "force_along"
at = "arm.O"
law = "external"

[loads.brake]
type = "torque"
on = "arm"
law = "constant"
level = "-3 N m"
"""
SPRING = """
[loads.spring]
type = "spring"
between = ["ground.far", "arm.tip"]
stiffness = "200 N/m"
free_length = 100
"""


def test_loads_have_arrows_where_they_act() -> None:
    text = ARM.replace("{ O = [0, 0] }, mass", "{ O = [0, 0], tip = [300, 0] }, mass")
    text = text.replace("ground.points = { O = [0, 0] }", "ground.points = { O = [0, 0], far = [900, 0] }")
    mechanism = parse(text + LOADS + SPRING, "arm.toml")
    run = kinfmu.solve(mechanism)
    found = arrows(run, mechanism, scene(run, mechanism))
    assert found is not None
    assert set(found.along) == {"joints.O", "loads.weight", "loads.push", "loads.spring"}
    newtons = {name: along * found.newton / found.length for name, along in found.along.items()}
    np.testing.assert_allclose(newtons["loads.weight"], np.tile([0.0, -50.0], (len(run), 1)), atol=1e-11)
    phi = run["arm.phi"]
    turning = np.column_stack([np.cos(phi), np.sin(phi)])
    np.testing.assert_allclose(newtons["loads.push"], 30.0 * turning, atol=1e-11)
    tip = 300.0 * turning
    np.testing.assert_allclose(found.at["loads.spring"], tip, atol=1e-9)
    away = np.array([900.0, 0.0]) - tip
    length = np.hypot(*away.T)[:, None]
    np.testing.assert_allclose(newtons["loads.spring"], 200.0 * (length - 100.0) * 1e-3 * away / length, atol=1e-10)
