"""A four-bar with one load of every kind, and two at one pair of points."""

from __future__ import annotations

from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.toml_file import parse

FOURBAR = """
name = "four_bar"
title = "Four-bar with loads"
[units]
length = "mm"
[run]
stop = "1 s"
step = "10 ms"
[bodies.ground]
points = { O = [0, 0], C = [200, 0], D = [-90, 160], E = [330, 60], F = [60, -70] }
[bodies.crank]
points = { O = [0, 0], P = [50, 0] }
[bodies.coupler]
points = { P = [0, 0], Q = [200, 0], M = [90, 60] }
start = { x = 50 }
mass = "2 kg"
[bodies.rocker]
points = { C = [0, 0], Q = [120, 0], T = [60, 0] }
start = { x = 200, phi = "70 deg" }
[joints]
O = { type = "revolute", between = ["ground.O", "crank.O"] }
P = { type = "revolute", between = ["crank.P", "coupler.P"] }
Q = { type = "revolute", between = ["coupler.Q", "rocker.Q"] }
C = { type = "revolute", between = ["ground.C", "rocker.C"] }
[drivers.crank]
type = "angle"
of = "crank"
law = "constant_speed"
start = "60 deg"
speed = "60 rpm"
"""
GRAVITY = """
[gravity]
x = 0
y = "-9.81 m/s2"
"""
LOADS = """
[loads.coil]
type = "spring"
between = ["ground.D", "coupler.M"]
stiffness = 100
free_length = 50
[loads.oil]
type = "damper"
between = ["ground.D", "coupler.M"]
damping = 10
[loads.strut]
type = "gas_spring"
between = ["ground.E", "rocker.Q"]
extended_length = 400
stroke = 250
extended_force = 100
compressed_force = 150
[loads.muscle]
type = "force_between"
between = ["ground.F", "rocker.T"]
law = "external"
[loads.weight]
type = "force"
at = "coupler.M"
y = -50
[loads.wind]
type = "force_along"
at = "rocker.T"
law = "external"
axes = "rocker"
angle = "-90 deg"
[loads.brake]
type = "torque"
on = "rocker"
law = "constant"
level = -2
[loads.clock]
type = "torsion_spring"
between = ["ground", "crank"]
stiffness = 1
[loads.grease]
type = "torsion_damper"
between = ["coupler", "rocker"]
damping = 1
"""


def fourbar(loads: str = "", *, has_gravity: bool = False) -> Mechanism:
    """Return the four-bar with tables of loads, by default with none."""
    return parse(FOURBAR + GRAVITY * has_gravity + loads, "four_bar.toml")


def every_load() -> Mechanism:
    """Return the four-bar with every kind of load, in gravity."""
    return fourbar(LOADS, has_gravity=True)
