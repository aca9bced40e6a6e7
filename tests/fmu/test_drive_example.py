"""examples/dc_motor: a motor with inertia of its own drives the press; stable with the port, equal to one system."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from fmpy.validation import validate_fmu

FOLDER = Path(__file__).parents[2] / "examples" / "dc_motor"
PYTHON = os.environ.get("KINFMU_HOSTS", sys.executable)
STOP = 0.5  # [s]; a turn of the crank takes about a second
ECOS = """
from ecospy import EcosSimulation
import sys
ssp, step, count = sys.argv[1:]
with EcosSimulation(float(step), ssp_path=ssp) as simulation:
    simulation.init(parameter_set="initialValues")
    for _ in range(int(count)):
        simulation.step(1)
        print("row", simulation.get_real("motor::angle"), simulation.get_real("motor::speed"))
"""
OSP = """
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver
import sys
ssp, step, count = sys.argv[1:]
execution = CosimExecution.from_ssp_file(ssp, round(float(step) * 1e9))
observer = CosimObserver.create_last_value()
execution.add_observer(observer)
motor = execution.slave_index_from_instance_name("motor")
for _ in range(int(count)):
    assert execution.step()
    print("row", *observer.last_real_values(motor, [3, 4]))
"""
HOSTS = {"libcosimpy": OSP, "ecospy": ECOS}


@pytest.fixture(scope="module")
def example() -> ModuleType:
    """The module of the loop, with the module that builds in it."""
    sys.path.insert(0, str(FOLDER))
    spec = importlib.util.spec_from_file_location("coupling", FOLDER / "coupling.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    sys.path.remove(str(FOLDER))
    return module


@pytest.fixture(scope="module")
def fmus(example: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    built: dict[str, Path] = example.build(tmp_path_factory.mktemp("drive"))
    return built


@pytest.fixture(scope="module")
def at_ratio_4(example: ModuleType) -> np.ndarray:
    """Angle and speed every 2 ms, of motor and press as one system, with a quarter of the press's inertia."""
    rows: np.ndarray = example.monolithic(example.LARGEST_INERTIA / 4.0, np.linspace(0.0, STOP, 251))
    return rows


def test_the_motor_is_a_valid_fmu(fmus: dict[str, Path]) -> None:
    assert validate_fmu(str(fmus["dc_motor"])) == []


def test_the_port_is_of_first_order_at_an_inertia_ratio_of_4(
    example: ModuleType, fmus: dict[str, Path], at_ratio_4: np.ndarray
) -> None:
    errors = []
    for step in (2e-3, 1e-3, 5e-4):
        rows = example.coupled(fmus, "port", example.LARGEST_INERTIA / 4.0, step, STOP)
        assert len(rows) == round(STOP / step) + 1
        errors.append(np.abs(rows[:: round(2e-3 / step)] - at_ratio_4).max(axis=0))
    assert (errors[-1] < [1e-3, 1e-2]).all()
    for coarse, fine in pairwise(errors):
        np.testing.assert_allclose(coarse / fine, 2.0, atol=0.1)


def test_the_torque_alone_diverges_above_an_inertia_ratio_of_1(example: ModuleType, fmus: dict[str, Path]) -> None:
    def count(ratio: float, step: float) -> int:
        return len(example.coupled(fmus, "torque", example.LARGEST_INERTIA / ratio, step, 0.1))

    assert count(0.5, 1e-3) == 101
    assert count(4.0, 1e-3) < 101
    assert count(4.0, 2.5e-4) < 101  # a smaller step does not help


def test_a_free_motor_follows_its_closed_form(example: ModuleType, fmus: dict[str, Path]) -> None:
    k, resistance, inertia = example.TORQUE_CONSTANT, example.RESISTANCE, 0.7
    with ExitStack() as stack:
        motor = example.Slave(fmus["dc_motor"], stack)
        motor.initialize(inertia=inertia, voltage=200.0, load_torque=30.0, load_inertia=0.4)
        rate, final = k * k / resistance / (inertia + 0.4), (200.0 - 30.0 * resistance / k) / k
        time = 0.0
        for step in (1e-7, 0.004, 0.1, 2.0):
            motor.step(time, step)
            time += step
            decay = np.exp(-rate * time)
            wanted = [final * (time + np.expm1(-rate * time) / rate), final * (1.0 - decay), final * rate * decay]
            np.testing.assert_allclose(motor.get("angle", "speed", "acceleration"), wanted, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("host", HOSTS)
def test_other_hosts_step_the_ssp(host: str, fmus: dict[str, Path], example: ModuleType, tmp_path: Path) -> None:
    if subprocess.run([PYTHON, "-c", f"import {host}"], capture_output=True).returncode:
        pytest.skip(f"{host} is not installed")
    wanted = example.monolithic(1.1, np.linspace(0.0, STOP, 251))[1:]
    errors = []
    for step in (2e-3, 1e-3):
        command = [PYTHON, "-c", HOSTS[host], str(fmus["press_drive"]), str(step), str(round(STOP / step))]
        done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, timeout=120)
        assert done.returncode == 0, done.stderr
        rows = np.array([line.split()[1:] for line in done.stdout.splitlines() if line.startswith("row ")], float)
        every = round(2e-3 / step)
        errors.append(np.abs(rows[every - 1 :: every] - wanted).max(axis=0))
    assert (errors[1] < [5e-3, 5e-2]).all()
    np.testing.assert_allclose(errors[0] / errors[1], 2.0, atol=0.15)
