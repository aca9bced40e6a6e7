"""Four-bars for fits: the mechanism with all of its lengths as parameters, and its coupler curve in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np

from kinfmu.mechanism import Mechanism, toml_file
from tests.mechanisms import FOURBAR_DRIVER, FOURBAR_PINS

LENGTHS = {"ground": 4.0, "crank": 1.0, "coupler": 3.5, "rocker": 3.0, "px": 1.7, "py": 1.2}
TEXT = (
    """
name = "NAME"
[bodies.ground]
points = { PIVOTS }
[bodies.crank]
points = { O = [0, 0], P = ["crank", 0] }
start = { phi = "60 deg" }
[bodies.coupler]
points = { P = [0, 0], Q = ["coupler", 0], X = ["px", "py"] }
start = { phi = "40 deg" }
[bodies.rocker]
points = { C = [0, 0], Q = ["rocker", 0] }
start = { phi = "100 deg" }
"""
    + FOURBAR_PINS
    + FOURBAR_DRIVER
    + """start = "60 deg"
[parameters]
"""
)


def four_bar(more: str = "", **lengths: float) -> Mechanism:
    """Return a four-bar with these lengths; more: tables to add."""
    return with_parameters("four_bar", 'O = [0, 0], C = ["ground", 0]', LENGTHS | lengths, more)


def with_parameters(name: str, pivots: str, values: dict[str, float], more: str = "") -> Mechanism:
    """Return the four-bar whose pivots on the ground are points of these values."""
    parameters = "\n".join(f'{key} = "{value!r} m"' for key, value in values.items())
    return toml_file.parse(TEXT.replace("NAME", name).replace("PIVOTS", pivots) + f"{parameters}\n{more}")


def closed_form(theta: Any, lengths: dict[str, float]) -> tuple[Any, Any, Any, Any]:
    """Return x, y of the coupler point, the coupler's and the rocker's angle of an open four-bar."""
    a, b, c, g = (lengths[name] for name in ("crank", "coupler", "rocker", "ground"))
    p = a * np.exp(1j * np.asarray(theta))
    to_c = g - p
    d = np.abs(to_c)
    beta = np.arccos((b**2 + d**2 - c**2) / (2.0 * b * d))
    coupler = np.angle(to_c) + beta
    q = p + b * np.exp(1j * coupler)
    x = p + (lengths["px"] + 1j * lengths["py"]) * np.exp(1j * coupler)
    return x.real, x.imag, coupler, np.angle(q - g)
