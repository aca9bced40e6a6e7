"""Andrews' squeezer, seven bodies and a spring: the driving torque that belongs to the published accelerations.

Constants and initial values: Test Set for IVP Solvers, "Andrews' squeezing mechanism"; Hairer and Wanner (1996),
Solving Ordinary Differential Equations II, section VII.7. It starts at rest, driven by 0.033 N m.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import kinfmu
from kinfmu import AngleDriver, Body, ConstantSpeed, Mechanism, Revolute, Spring
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text

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
