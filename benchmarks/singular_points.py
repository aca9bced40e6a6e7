"""Singular points that mechanisms pass, with their motion there in closed form."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.cli.demo import parallelogram
from kinfmu.errors import MissingPackageError
from kinfmu.mechanism import Mechanism, gallery
from kinfmu.mechanism.toml_file import parse

FOURBAR = ("crank.phi", "coupler.x", "coupler.y", "coupler.phi", "rocker.phi")
DIGITS = 80  # 1e-16 from a change point two thirds of them are lost

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


def _isosceles(u: float) -> FloatArray:
    """Return q, q', q'' of a slider-crank with rod = crank = 1: crank.phi, rod.x, rod.y, rod.phi, piston.x, (3, 5)."""
    s, c = math.sin(u), math.cos(u)
    return np.array([[u, c, s, -u, 2.0 * c], [1.0, -s, c, -1.0, -2.0 * s], [0.0, -c, -s, 0.0, -2.0 * c]])


def exact_fourbar(ground: int, crank: int, coupler: int, rocker: int, u: float) -> FloatArray:
    """Return q, q', q'' of FOURBAR in a four-bar whose branches cross at pi, (3, 5), from 80 digits. Needs mpmath.

        P = a (cos u, sin u),   d = (g, 0) - P,   Q - P = e d + h d_turned_left
        e = (b^2 - c^2 + d.d) / (2 d.d),   h^2 = b^2 / d.d - e^2

    q' and q'' solve the derivatives of the loop P + (Q - P) = C + (Q - C), which are linear in them.

    Lengths are whole numbers; ground + crank = coupler + rocker, so that the smooth motion passes u = pi, where the
    coupler's pin goes from the left of the diagonal to its right. The coupler's frame is at the crank's pin.
    """
    try:
        from mpmath import mp, workdps
    except ImportError:
        raise MissingPackageError("mpmath is not installed: pip install 'kinfmu[bench]'") from None
    with workdps(DIGITS):
        angle = mp.mpf(u)
        px, py = crank * mp.cos(angle), crank * mp.sin(angle)
        dx, dy = ground - px, -py
        square = dx * dx + dy * dy
        along = (coupler**2 - rocker**2 + square) / (2 * square)
        across = mp.sign(mp.pi - angle) * mp.sqrt(coupler**2 / square - along**2)
        qx, qy = along * dx - across * dy, along * dy + across * dx  # of the coupler
        rx, ry = qx - dx, qy - dy  # of the rocker
        first = _solved(mp, (qx, qy, rx, ry), (py, -px))
        b = px + qx * first[0] ** 2 - rx * first[1] ** 2, py + qy * first[0] ** 2 - ry * first[1] ** 2
        second = _solved(mp, (qx, qy, rx, ry), b)
        rows = [
            [angle, px, py, mp.atan2(qy, qx), mp.atan2(ry, rx)],
            [1, -py, px, *first],
            [0, -px, -py, *second],
        ]
        exact = np.array(rows, dtype=float)
    exact[0, 3:] += 2.0 * math.pi * np.round((_NEAR - exact[0, 3:]) / (2.0 * math.pi))
    return exact


_NEAR = np.array([0.0, math.pi])  # where the two angles lie when coupler and rocker are stretched


def _solved(mp: Any, pins: tuple[Any, Any, Any, Any], b: tuple[Any, Any]) -> tuple[Any, Any]:
    """Return (w, v) with w (-qy, qx) - v (-ry, rx) = b: rates of coupler and rocker."""
    qx, qy, rx, ry = pins
    found = mp.lu_solve(mp.matrix([[-qy, ry], [qx, -rx]]), mp.matrix(b))
    return found[0], found[1]


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
        parallelogram,
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
