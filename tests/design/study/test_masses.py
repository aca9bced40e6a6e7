"""A study over a mass and a density, of torque and shaking force, against closed forms."""

from __future__ import annotations

import numpy as np

import kinfmu
from kinfmu.mechanism.toml_file import parse

# A steel bar turns at 4 rad/s about one end, with a weight fixed on it.
LEVER = """
name = "lever"
units = { length = "mm" }
gravity = { x = 0, y = "-10 m/s2" }
parameters = { weight = "2 kg", density = "7850 kg/m3" }

[bodies]
ground.points = { O = [0, 0] }
lever = { points = { O = [0, 0], E = [500, 0] }, rod = ["O", "E"], width = 20, thickness = 10, density = "density" }
weight = { points = { O = [0, 0] }, mass = "weight", center_of_mass = [-100, 0] }

[joints]
O = { type = "revolute", between = ["ground.O", "lever.O"] }
screw = { type = "fixed", between = ["lever.O", "weight.O"] }

[drivers.lever]
type = "angle"
of = "lever"
law = "constant_speed"
speed = 4

[measures]
torque = { type = "peak", of = "lever.torque" }
shaking = { type = "peak", of = "shaking_force" }
"""
BAR = 0.5 * 0.02 * 0.01  # [m3]


def test_a_study_over_a_mass_and_a_density() -> None:
    """Weight times arm; at the lowest point, or the highest, the weight with the centrifugal force."""
    grids = {"weight": {"values": [1.0, 2.0, -1.0]}, "density": {"values": ["1 g/cm3", 7850.0]}}
    table = kinfmu.study(parse(LEVER, "lever.toml"), grids, workers=1)
    weight, density = (np.array(table[name]) for name in ("weight", "density"))
    moment, mass = 0.25 * BAR * density - 0.1 * weight, BAR * density + weight
    valid = weight > 0.0
    np.testing.assert_allclose(table["torque"][valid], 10.0 * np.abs(moment[valid]), rtol=1e-9)
    np.testing.assert_allclose(table["shaking"][valid], (10.0 * mass + 16.0 * np.abs(moment))[valid], rtol=1e-9)
    assert np.isnan(table["torque"][~valid]).all()
    reason = "[bodies.weight] mass = -1.0 must be 0 or more"
    assert f"2 of 6 designs lack a measure, the first is design 4: {reason}" in str(table)
