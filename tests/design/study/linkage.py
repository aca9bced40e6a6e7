"""Hoeken's linkage with lengths as parameters, and its closed form."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kinfmu import Mechanism
from kinfmu.mechanism import toml_file

TEXT = """
name = "hoeken"
units.length = "mm"
parameters = { crank = "20 mm", rocker = "50 mm", base = "40 mm" }
bodies.ground.points = { O = [0, 0], C = ["base", 0] }
bodies.crank.points = { O = [0, 0], P = ["crank", 0] }
bodies.coupler = { points = { P = [0, 0], Q = ["rocker", 0] }, start = { x = 20, phi = "78 deg" } }
bodies.rocker = { points = { C = [0, 0], Q = ["rocker", 0] }, start = { x = 40, phi = "102 deg" } }
joints.O = { type = "revolute", between = ["ground.O", "crank.O"] }
joints.P = { type = "revolute", between = ["crank.P", "coupler.P"] }
joints.Q = { type = "revolute", between = ["coupler.Q", "rocker.Q"] }
joints.C = { type = "revolute", between = ["ground.C", "rocker.C"] }
drivers.crank = { type = "angle", of = "crank", law = "constant_speed", speed = "30 rpm" }
measures.swing = { type = "range", of = "rocker.phi" }
measures.fastest = { type = "peak_speed", of = "rocker.phi" }
"""
RANGES: Mapping[str, Mapping[str, Any]] = {
    "crank": {"from": "15 mm", "to": "25 mm"},
    "base": {"from": "35 mm", "to": "60 mm"},
}


def linkage() -> Mechanism:
    """Return the linkage."""
    return toml_file.parse(TEXT)


def write(folder: Path, study: str, name: str = "study.toml") -> Path:
    """Write the linkage and a study file, which must be TOML, into a folder."""
    tomllib.loads(study)
    (folder / "hoeken.toml").write_text(TEXT, encoding="utf-8")
    path = folder / name
    path.write_text(study, encoding="utf-8")
    return path


def swing(crank: float, rocker: float, base: float) -> float:
    """Return the swing angle of the rocker: between the two dead centres of its stroke (law of cosines)."""

    def angle(reach: float) -> float:
        return math.acos((base**2 + rocker**2 - reach**2) / (2.0 * base * rocker))

    return angle(rocker + crank) - angle(rocker - crank)
