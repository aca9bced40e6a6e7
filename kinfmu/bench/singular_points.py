"""Singular points that mechanisms pass, with their motion there in closed form."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from kinfmu import gallery
from kinfmu.bench.exact_fourbar import exact_fourbar
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.toml_file import parse
from kinfmu.run import FloatArray

# Ground 4, crank 1, coupler 3, rocker 2: at 180 degrees coupler and rocker are stretched, and two branches cross.
CHANGE_POINT_FOURBAR = """
name = "change_point_fourbar"
[bodies]
ground = { points = { O = [0, 0], C = [4, 0] } }
crank = { points = { O = [0, 0], P = [1, 0] } }
coupler = { points = { P = [0, 0], Q = [3, 0] }, start = { phi = 0.3 } }
rocker = { points = { C = [0, 0], Q = [2, 0] }, start = { x = 4, phi = 1.9 } }
[joints]
O = { type = "revolute", between = ["ground.O", "crank.O"] }
P = { type = "revolute", between = ["crank.P", "coupler.P"] }
Q = { type = "revolute", between = ["coupler.Q", "rocker.Q"] }
C = { type = "revolute", between = ["ground.C", "rocker.C"] }
[drivers]
crank = { type = "angle", of = "crank", law = "constant_speed", start = 1, speed = 1 }
"""

# Crank 1, rod 1: at 90 degrees the piston is at the crank's pivot, and may stay there.
EQUAL_SLIDER_CRANK = """
name = "equal_slider_crank"
[bodies]
ground = { points = { O = [0, 0] } }
crank = { points = { O = [0, 0], P = [1, 0] } }
rod = { points = { P = [0, 0], S = [1, 0] }, start = { phi = -0.5 } }
piston = { points = { S = [0, 0] }, start = { x = 1.76 } }
[joints]
O = { type = "revolute", between = ["ground.O", "crank.O"] }
P = { type = "revolute", between = ["crank.P", "rod.P"] }
S = { type = "revolute", between = ["rod.S", "piston.S"] }
bore = { type = "translational", between = ["ground.O", "piston.S"] }
[drivers]
crank = { type = "angle", of = "crank", law = "constant_speed", start = 0.5, speed = 1 }
"""


class SingularCase(NamedTuple):
    """A singular point that a mechanism passes, and its motion there in closed form."""

    title: str
    mechanism: Callable[[], Mechanism]
    columns: tuple[str, ...]  # of the closed form
    centre: float  # [rad]
    start: float  # [rad]
    closed_form: Callable[[float], FloatArray]  # (3, m) q, q', q'' at a value of the driver


def _parallelogram(u: float) -> FloatArray:
    """crank.phi, coupler.x, coupler.y, coupler.phi, rocker.phi of the reference four-bar."""
    s, c = math.sin(u), math.cos(u)
    return np.array([[u, 1.0 + c, s, 0.0, u], [1.0, -s, c, 0.0, 1.0], [0.0, -c, -s, 0.0, 0.0]])


def _isosceles(u: float) -> FloatArray:
    """crank.phi, rod.x, rod.y, rod.phi, piston.x of a slider-crank whose rod is as long as its crank, 1."""
    s, c = math.sin(u), math.cos(u)
    return np.array([[u, c, s, -u, 2.0 * c], [1.0, -s, c, -1.0, -2.0 * s], [0.0, -c, -s, 0.0, -2.0 * c]])


FOURBAR = ("crank.phi", "coupler.x", "coupler.y", "coupler.phi", "rocker.phi")
POINTS = (
    SingularCase(
        "four-bar 4-1-3-2 at 180 deg",
        lambda: parse(CHANGE_POINT_FOURBAR, "change_point_fourbar"),
        FOURBAR,
        math.pi,
        1.0,
        lambda u: exact_fourbar(4, 1, 3, 2, u),
    ),
    SingularCase(
        "reference four-bar at 180 deg",
        lambda: gallery.load("fourbar"),
        FOURBAR,
        math.pi,
        math.radians(60.0),
        _parallelogram,
    ),
    SingularCase(
        "slider-crank, rod = crank, at 90 deg",
        lambda: parse(EQUAL_SLIDER_CRANK, "equal_slider_crank"),
        ("crank.phi", "rod.x", "rod.y", "rod.phi", "piston.x"),
        0.5 * math.pi,
        0.5,
        _isosceles,
    ),
)
