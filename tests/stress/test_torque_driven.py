"""Long motions without a torque keep their energy, in Python and in an FMU."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

import kinfmu
from kinfmu import Mechanism
from tests.fmu.host import OK, Host
from tests.mechanisms import fourbar


def heavy() -> Mechanism:
    plain = fourbar(2.0, 0.7, 1.9, 1.5)
    bodies = [
        body if body.is_ground else replace(body, mass=1.0 + 0.3 * k, center_of_mass=(0.3, 0.1), inertia=0.2)
        for k, body in enumerate(plain.bodies)
    ]
    return replace(plain, bodies=tuple(bodies))


def test_energy_is_constant_over_a_thousand_turns() -> None:
    run = kinfmu.simulate(
        heavy(), drive="torque", start=0.0, stop=940.0, step=1.0, state={"crank_speed": 7.0}, tolerance=1e-13
    )
    assert run["crank_angle"][-1] > 1000 * 2 * math.pi
    drift = np.abs(run["kinetic_energy"] / run["kinetic_energy"][0] - 1).max()
    print(f"drift over {run['crank_angle'][-1] / 2 / math.pi:.0f} turns: {drift:.2g}")
    assert drift < 1e-9


def test_energy_of_an_fmu_is_constant_over_a_thousand_turns(tmp_path: Path) -> None:
    path = kinfmu.build(heavy(), tmp_path / "free.fmu", drive="torque", flavour="native", fmi=3)
    host = Host(path, tmp_path / "free")
    host.set({"crank_speed": 7.0, "integrator.tolerance": 1e-13})
    host.initialize(0.0)
    (first,) = host.get("kinetic_energy")
    energies = []
    for k in range(940):
        assert host.step(float(k), 1.0) == OK
        energies += host.get("kinetic_energy")
    (angle,) = host.get("crank_angle")
    host.free()
    assert angle > 1000 * 2 * math.pi
    drift = np.abs(np.array(energies) / first - 1).max()
    print(f"drift over {angle / 2 / math.pi:.0f} turns of an FMU: {drift:.2g}")
    assert drift < 1e-9
