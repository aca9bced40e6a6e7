"""Efforts and reduced inertias against Sympy's Lagrange equations; `lagrange.json` is written by `lagrange`."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu import (
    AngleDriver,
    Body,
    ConstantSpeed,
    Mechanism,
    Revolute,
    SlideDriver,
    Translational,
)
from tests.run.lagrange import ACCELERATIONS, GRAVITY, LENGTHS, MASSES, SPEEDS, TABLE

SAMPLES = json.loads(TABLE.read_text("utf-8"))
CASES = [(name, mode) for name, modes in SAMPLES.items() for mode in modes]
PLACES = {"m, at the origin": ("m", (0.0, 0.0)), "mm": ("mm", (0.0, 0.0)), "far away": ("m", (250_000.0, -31_000.0))}


def mechanism(name: str, mode: str, unit: str, at: tuple[float, float]) -> Mechanism:
    """The mechanism of a case in a unit of length, moved to a place."""
    per = {"m": 1.0, "mm": 1000.0}[unit]
    n = {bar: float(x) * per for bar, x in LENGTHS[name].items()}
    pose = SAMPLES[name][mode][0]["pose"]

    def end(x: float, y: float, angle: float, length: float) -> tuple[float, float]:
        return x + length * math.cos(angle), y + length * math.sin(angle)

    def body(bar: str, points: dict[str, tuple[float, float]], x: float, y: float, phi: float) -> Body:
        mass, center, inertia = MASSES[bar]
        return Body(
            bar,
            points,
            (x, y, phi),
            mass=float(mass),
            center_of_mass=(float(center[0]) * per, float(center[1]) * per),
            inertia=float(inertia),
        )

    x0, y0 = at
    drivers: list[Any]
    joints: list[Any]
    if name == "five_bar":
        other = x0 + n["ground"], y0
        tips = end(x0, y0, pose["a"], n["left"]), end(*other, pose["e"], n["right"])
        bodies = [
            Body("ground", {"O": (x0, y0), "C": other}),
            body("left", {"O": (0, 0), "P": (n["left"], 0)}, x0, y0, pose["a"]),
            body("right", {"C": (0, 0), "Q": (n["right"], 0)}, *other, pose["e"]),
            body("forearm", {"P": (0, 0), "T": (n["forearm"], 0)}, *tips[0], pose["b"]),
            body("strut", {"Q": (0, 0), "T": (n["strut"], 0)}, *tips[1], pose["c"]),
        ]
        pairs = {"O": "ground left", "C": "ground right", "P": "left forearm", "Q": "right strut", "T": "forearm strut"}
        drivers = [
            AngleDriver("one", "left", ConstantSpeed(pose["a"], 1.0)),
            AngleDriver("two", "right", ConstantSpeed(pose["e"], 1.0)),
        ]
        joints = []
    elif name == "fourbar":
        tip = end(x0, y0, pose["a"], n["crank"])
        bodies = [
            Body("ground", {"O": (x0, y0), "C": (x0 + n["ground"], y0)}),
            body("crank", {"O": (0, 0), "P": (n["crank"], 0)}, x0, y0, pose["a"]),
            body("coupler", {"P": (0, 0), "Q": (n["coupler"], 0)}, *tip, pose["b"]),
            body("rocker", {"C": (0, 0), "Q": (n["rocker"], 0)}, x0 + n["ground"], y0, pose["c"]),
        ]
        pairs = {"O": "ground crank", "P": "crank coupler", "Q": "coupler rocker", "C": "ground rocker"}
        drivers, joints = [AngleDriver("one", "crank", ConstantSpeed(pose["a"], 1.0))], []
    else:
        tip = end(x0, y0, pose["a"], n["crank"])
        way = x0, y0 + n["offset"]
        bodies = [
            Body("ground", {"O": (x0, y0), "way": way}),
            body("crank", {"O": (0, 0), "P": (n["crank"], 0)}, x0, y0, pose["a"]),
            body("rod", {"P": (0, 0), "S": (n["rod"], 0)}, *tip, pose["b"]),
            body("block", {"S": (0, 0)}, x0 + pose["x"] * per, way[1], 0.0),
        ]
        pairs = {"O": "ground crank", "P": "crank rod", "S": "rod block"}
        joints = [Translational("slide", ("ground.way", "block.S"))]
        if mode == "slide":
            drivers = [SlideDriver("one", ("ground.way", "block.S"), 0.0, ConstantSpeed(pose["x"] * per, per))]
        else:
            drivers = [AngleDriver("one", "crank", ConstantSpeed(pose["a"], 1.0))]
    joints += [Revolute(pin, (f"{pair.split()[0]}.{pin}", f"{pair.split()[1]}.{pin}")) for pin, pair in pairs.items()]
    gravity = float(GRAVITY[0]) * per, float(GRAVITY[1]) * per
    return Mechanism(name, bodies, joints, drivers, length_unit=unit, gravity=gravity)


@pytest.mark.parametrize(("name", "mode"), CASES)
@pytest.mark.parametrize("where", PLACES)
def test_efforts_and_inertias_are_those_of_sympy(name: str, mode: str, where: str) -> None:
    """Efforts in N and N m are the same in metres, in millimetres and far from the origin."""
    unit, at = PLACES[where]
    model = kinfmu.compile(mechanism(name, mode, unit, at))
    samples = SAMPLES[name][mode]
    per = {"m": 1.0, "mm": 1000.0}[unit] if mode == "slide" else 1.0
    inputs: dict[str, Any] = {}
    for k, driver in enumerate(model.plan.drivers):
        inputs[driver.inputs[0]] = np.array([float(sample["driven"][k]) for sample in samples]) * per
        inputs[driver.inputs[1]], inputs[driver.inputs[2]] = float(SPEEDS[k]) * per, float(ACCELERATIONS[k]) * per
    run = model.solve(**inputs)
    noun = "force" if mode == "slide" else "torque"
    for k, sample in enumerate(samples):
        for row, (driver, exact) in enumerate(zip(model.plan.drivers, sample["efforts"], strict=True)):
            assert run[f"{driver.name}.{noun}"][k] == pytest.approx(exact, rel=1e-12, abs=1e-12)
            inertia = sample["inertia"]
            for column, other in enumerate(model.plan.drivers[row:], start=row):
                suffix = "" if other.name == driver.name else f".{other.name}"
                found = run[f"{driver.name}.reduced_inertia{suffix}"][k]
                scale = math.sqrt(inertia[row][row] * inertia[column][column])
                assert found == pytest.approx(inertia[row][column], rel=0, abs=1e-12 * scale)
