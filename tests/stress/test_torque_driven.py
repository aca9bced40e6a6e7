"""Long motions without a torque keep their energy."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

import kinfmu
from tests.mechanisms import fourbar


def test_energy_is_constant_over_a_thousand_turns() -> None:
    plain = fourbar(2.0, 0.7, 1.9, 1.5)
    bodies = [
        body if body.is_ground else replace(body, mass=1.0 + 0.3 * k, center_of_mass=(0.3, 0.1), inertia=0.2)
        for k, body in enumerate(plain.bodies)
    ]
    mechanism = replace(plain, bodies=tuple(bodies))
    run = kinfmu.simulate(
        mechanism, drive="torque", start=0.0, stop=940.0, step=1.0, state={"crank_speed": 7.0}, tolerance=1e-13
    )
    assert run["crank_angle"][-1] > 1000 * 2 * math.pi
    drift = np.abs(run["kinetic_energy"] / run["kinetic_energy"][0] - 1).max()
    print(f"drift over {run['crank_angle'][-1] / 2 / math.pi:.0f} turns: {drift:.2g}")
    assert drift < 1e-9
