"""Efforts and reduced inertias against Sympy's Lagrange equations; `lagrange.json` is written by `lagrange`."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu import AngleDriver, Body, ConstantSpeed, Mechanism, Revolute, SlideDriver, Spring, Translational
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text
from kinfmu.run import Run
from tests.motion.torque import andrews
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


# ------------------------------------------------------------------------------------------------------------- squeezer
# Constants and initial values: Test Set for IVP Solvers, "Andrews' squeezing mechanism"; Hairer and Wanner (1996),
# Solving Ordinary Differential Equations II, section VII.7. It starts at rest, driven by 0.033 N m.


TORQUE = 0.033  # [N m]
A, B, C = (-0.06934, -0.00227), (-0.03635, 0.03273), (0.014, 0.072)
BETA, THETA, GAMMA = -0.0617138900142764496358948458001, 0.0, 0.455279819163070380255912382449
PHI, DELTA = 0.222668390165885884674473185609, 0.487364979543842550225598953530
OMEGA, EPSILON = -0.222668390165885884674473185609, 1.23054744454982119249735015568
BETA_2, THETA_2 = 14222.4439199541138705911625887, -10666.8329399655854029433719415  # [rad/s2]
LAMBDA = 98.5668703962410896057654982170, -6.12268834425566265503114393122  # [N]


def squeezer() -> Mechanism:
    """The mechanism at its published start; angles of K2, K4 and K6 are relative to K1, K5 and K7 there."""
    e = 0.007 * math.cos(BETA), 0.007 * math.sin(BETA)
    h = A[0] + 0.04 * math.cos(DELTA), A[1] + 0.04 * math.sin(DELTA)
    g = A[0] + 0.04 * math.sin(EPSILON), A[1] - 0.04 * math.cos(EPSILON)

    def body(
        name: str,
        points: dict[str, tuple[float, float]],
        start: tuple[float, float, float],
        mass: float,
        center: tuple[float, float],
        inertia: float,
    ) -> Body:
        return Body(name, points, start, mass=mass, center_of_mass=center, inertia=inertia)

    bodies = [
        Body("ground", {"O": (0.0, 0.0), "A": A, "A2": A, "B": B, "C": C}),
        body("k1", {"O": (0, 0), "F": (0.007, 0)}, (0, 0, BETA), 0.04325, (0.00092, 0), 2.194e-6),
        body("k2", {"F": (0, 0), "E": (-0.028, 0)}, (*e, BETA + THETA), 0.00365, (-0.0115, 0), 4.410e-7),
        body(
            "k3",
            {"B": (0, 0), "E": (0, -0.035), "D": (0.02, -0.018)},
            (*B, GAMMA),
            0.02373,
            (0.01874, -0.01043),
            5.255e-6,
        ),
        body("k4", {"H": (0, 0), "E": (0, -0.02)}, (*h, PHI + DELTA), 0.00706, (0, -(0.02 - 0.01421)), 5.667e-7),
        body("k5", {"A": (0, 0), "H": (0.04, 0)}, (*A, DELTA), 0.07050, (0.02308, 0.00916), 1.169e-5),
        body("k6", {"G": (0, 0), "E": (0.02, 0)}, (*g, OMEGA + EPSILON), 0.00706, (0.02 - 0.01421, 0), 5.667e-7),
        body("k7", {"A": (0, 0), "G": (0, -0.04)}, (*A, EPSILON), 0.05498, (-0.00449, -0.01228), 1.912e-5),
    ]
    pins = {
        "O": ("ground.O", "k1.O"),
        "F": ("k1.F", "k2.F"),
        "B": ("ground.B", "k3.B"),
        "A": ("ground.A", "k5.A"),
        "A2": ("ground.A2", "k7.A"),
        "H": ("k5.H", "k4.H"),
        "G": ("k7.G", "k6.G"),
        "E3": ("k2.E", "k3.E"),
        "E4": ("k2.E", "k4.E"),
        "E6": ("k2.E", "k6.E"),
    }
    return Mechanism(
        "squeezer",
        bodies,
        [Revolute(name, between) for name, between in pins.items()],
        [AngleDriver("crank", "k1", ConstantSpeed(BETA, 1.0))],
        loads=[Spring("spring", ("ground.C", "k3.D"), 4530.0, 0.07785)],
    )


def squeezed(method: str, tolerance: float) -> Run:
    """Return the published motion of Andrews' squeezer, integrated."""
    return kinfmu.simulate(
        squeezer(),
        drive="torque",
        start=0.0,
        stop=andrews.END,
        step=andrews.END,
        inputs={"crank_torque": TORQUE},
        state={"crank_speed": 0.0},
        tolerance=tolerance,
        method=method,
    )


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.few(1)
def test_the_driving_torque_of_the_published_start(engine: str) -> None:
    count = 1 if engine == "python" else 400
    run = kinfmu.solve(
        squeezer(), engine=engine, crank_angle=np.full(count, BETA), crank_speed=0.0, crank_acceleration=BETA_2
    )
    assert run["k2.alpha"] == pytest.approx(BETA_2 + THETA_2, rel=1e-12)
    for body in ("k3", "k4", "k5", "k6", "k7"):
        assert np.abs(run[f"{body}.alpha"]).max() < 1e-9 * BETA_2
    assert run["crank.torque"] == pytest.approx(TORQUE, rel=1e-12)


def test_the_reactions_of_the_published_start() -> None:
    """The first two multipliers are the force of the second link on the third; nothing loads the other links."""
    run = kinfmu.solve(squeezer(), crank_angle=[BETA], crank_speed=0.0, crank_acceleration=BETA_2)
    assert [abs(float(run[f"E3.force_{axis}"][0])) for axis in "xy"] == pytest.approx(
        [abs(one) for one in LAMBDA], rel=1e-12
    )
    assert max(abs(float(run[f"{pin}.force_{axis}"][0])) for pin in ("E4", "E6", "A", "A2") for axis in "xy") < 1e-9


def test_a_file_of_the_squeezer_gives_the_same() -> None:
    again = parse(text(squeezer()))
    run = kinfmu.solve(again, crank_angle=[BETA], crank_speed=0.0, crank_acceleration=BETA_2)
    assert run["crank.torque"][0] == pytest.approx(TORQUE, rel=1e-12)
