"""Reactions where redundant rows are solved by least squares, and where they share loads."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import kinfmu
from kinfmu import Mechanism
from kinfmu.plan import compile_plan
from kinfmu.plan.undetermined import undetermined_reactions
from tests.mechanisms import wheels

QUARTER = math.pi / 2
LOCOMOTIVE = {"A": (0, 1, 0.0), "B": (0, 1, QUARTER)}
ROW = {f"{name}{k}": (k, k + 1, turn + 0.035 * k) for k in range(3) for name, turn in (("A", 0.0), ("B", QUARTER))}
MASS, CENTER, GRAVITY = 1.7, (0.3, 0.11), (0.6, -9.81)
SPEED, ACCELERATION = 2.0, -3.0
RADIUS, LENGTH = 0.5, 2.0  # of the pins of the wheels; of the rods


def coupled(rods: dict[str, tuple[int, int, float]]) -> Mechanism:
    mechanism = wheels(rods)
    bodies = [
        body if body.is_ground else replace(body, mass=MASS, center_of_mass=CENTER, inertia=0.2)
        for body in mechanism.bodies
    ]
    return replace(mechanism, bodies=tuple(bodies), gravity=GRAVITY)


@pytest.mark.parametrize("rods", [LOCOMOTIVE, ROW])
@pytest.mark.parametrize(("engine", "count"), [("python", 3), ("python", 29), ("native", 401)])
@pytest.mark.few(2)
def test_determined_reactions_of_coupled_wheels_are_exact(
    rods: dict[str, tuple[int, int, float]], engine: str, count: int
) -> None:
    """Closed form: rods move on circles without turning, so Newton and Euler give the forces across them.

    Along the rods, any tension of a pair may be added.
    """
    mechanism = coupled(rods)
    angles = np.linspace(0.0, 2.0 * np.pi, count)  # with the dead centres of both rods
    run = kinfmu.solve(mechanism, engine=engine, crank_angle=angles, crank_speed=SPEED, crank_acceleration=ACCELERATION)
    assert (run.status == 0).all()
    undetermined = undetermined_reactions(compile_plan(mechanism))
    for name, (_, _, turn) in rods.items():
        c, s = RADIUS * np.cos(angles + turn), RADIUS * np.sin(angles + turn)
        x = MASS * (-s * ACCELERATION - c * SPEED**2 - GRAVITY[0])
        y = MASS * (c * ACCELERATION - s * SPEED**2 - GRAVITY[1])
        last = (CENTER[0] * y - CENTER[1] * x) / LENGTH
        for pin, exact in ((f"P{name}", y - last), (f"Q{name}", last)):
            np.testing.assert_allclose(run[f"{pin}.force_y"], exact, rtol=0, atol=1e-12 * np.abs(y).max())
            assert f"{pin}.force_x" in undetermined
            assert np.isnan(run[f"{pin}.force_x"]).all()
    count_of_masses = len(mechanism.moving_bodies)
    weight_and_thrust = sum(run[f"O{k}.force_y"] for k in range(max(last for _, last, _ in rods.values()) + 1))
    centers = np.zeros(len(angles))  # sum of the vertical accelerations of the centres of mass
    for body in mechanism.moving_bodies:
        phi, omega, alpha = (run[f"{body.name}.{axis}"] for axis in ("phi", "omega", "alpha"))
        arm = (
            np.cos(phi) * CENTER[0] - np.sin(phi) * CENTER[1],
            np.sin(phi) * CENTER[0] + np.cos(phi) * CENTER[1],
        )
        centers += run[f"{body.name}.ay"] + alpha * arm[0] - omega**2 * arm[1]
    whole = MASS * (centers - count_of_masses * GRAVITY[1])
    np.testing.assert_allclose(weight_and_thrust, whole, rtol=0, atol=1e-12 * np.abs(whole).max())
