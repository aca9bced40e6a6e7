"""Random crank-rockers, and their closed form."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.gallery import load

ANGLES = 361  # a turn by one degree
LENGTHS = {"ground_link": 42.0, "crank_link": 15.0, "coupler_link": 50.0, "rocker_link": 45.0}
SPREAD = 0.03  # of the lengths, so that all are crank-rockers


def crank_rocker() -> Mechanism:
    """Return the gallery's crank-rocker with its lengths as parameters."""
    written = load("crank_rocker")
    places = {
        "ground": {"C": ("ground_link", 0.0)},
        "crank": {"P": ("crank_link", 0.0)},
        "coupler": {"Q": ("coupler_link", 0.0)},
        "rocker": {"Q": ("rocker_link", 0.0)},
    }
    bodies = [replace(body, points={**body.points, **places[body.name]}) for body in written.bodies]  # type: ignore[dict-item]
    return replace(written, bodies=tuple(bodies), parameters=LENGTHS)  # type: ignore[arg-type]  # numbers are read


def drawn(count: int) -> dict[str, FloatArray]:
    """Return random lengths around those of the crank-rocker, equal in every call."""
    rng = np.random.default_rng(1)
    return {name: value * np.exp(rng.uniform(-SPREAD, SPREAD, count)) for name, value in LENGTHS.items()}


def closed_form(u: Any, g: float, a: float, b: float, c: float) -> tuple[Any, Any]:
    """Return the angles of coupler and rocker of the open crank-rocker."""
    dx, dy = g - a * np.cos(u), -a * np.sin(u)
    square = dx * dx + dy * dy
    e = 0.5 + 0.5 * (b * b - c * c) / square
    h = np.sqrt(b * b / square - e * e)
    qx, qy = e * dx - h * dy, e * dy + h * dx
    return np.arctan2(qy, qx), np.arctan2(qy - dy, qx - dx)
