"""Four-bars in closed form: the reference one, and in 80 digits one whose branches cross. Those need mpmath.

    P = a (cos u, sin u),   d = (g, 0) - P,   Q - P = e d + h d_turned_left
    e = (b^2 - c^2 + d.d) / (2 d.d),   h^2 = b^2 / d.d - e^2

q' and q'' solve the derivatives of the loop P + (Q - P) = C + (Q - C), which are linear in them.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kinfmu.errors import MissingPackageError
from kinfmu.run import FloatArray

DIGITS = 80  # 1e-16 from a change point two thirds of them are lost


def closed_form(t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """q, qd, qdd of the reference four-bar, (n, 5): phi2 = 0, phi3 = phi1, x2 = 1 + cos phi1, y2 = sin phi1."""
    w = np.pi / 180.0
    phi, none = w * t, np.zeros_like(t)
    cos, sin = np.cos(phi), np.sin(phi)
    q = np.stack([phi, 1.0 + cos, sin, none, phi], axis=1)
    qd = np.stack([none + w, -w * sin, w * cos, none, none + w], axis=1)
    qdd = np.stack([none, -w * w * cos, -w * w * sin, none, none], axis=1)
    return q, qd, qdd


def exact_fourbar(ground: int, crank: int, coupler: int, rocker: int, u: float) -> FloatArray:
    """(3, 5) crank.phi, coupler.x, coupler.y, coupler.phi, rocker.phi and their two derivatives at the double u.

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
    """(w, v) with w (-qy, qx) - v (-ry, rx) = b: rates of coupler and rocker."""
    qx, qy, rx, ry = pins
    found = mp.lu_solve(mp.matrix([[-qy, ry], [qx, -rx]]), mp.matrix(b))
    return found[0], found[1]
