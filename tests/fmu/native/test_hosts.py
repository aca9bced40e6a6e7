"""Native FMUs in hosts that others wrote, each in a process of its own, equal to the Python engine.

They run where these packages are installed beside the tests, as scripts/hosts does: libcosimpy (OSP, FMI 2.0), ecospy
with its own `ecos` command (both versions). KINFMU_HOSTS may name another Python that has them.
"""

from __future__ import annotations

import csv
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from tests.fmu.native.conftest import Build

PYTHON = os.environ.get("KINFMU_HOSTS", sys.executable)
STEP, COUNT = 0.05, 40
NAMES = ("coupler.x", "coupler.phi", "rocker.omega")

OSP = """
import sys
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimManipulator import CosimManipulator
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave
fmu, step, count, *references = sys.argv[1:]
execution = CosimExecution.from_step_size(step_size=int(float(step) * 1e9))
slave = execution.add_local_slave(CosimLocalSlave(fmu_path=fmu, instance_name="fourbar"))
observer = CosimObserver.create_last_value()
execution.add_observer(observer)
for _ in range(int(count)):
    assert execution.step()
    print(*map(repr, observer.last_real_values(slave, [int(reference) for reference in references])))
"""
ECOS = """
import sys
from ecospy import EcosSimulation, EcosSimulationStructure
fmu, step, count, *names = sys.argv[1:]
structure = EcosSimulationStructure()
structure.add_model("fourbar", fmu)
with EcosSimulation(float(step), structure=structure) as simulation:
    simulation.init()
    for _ in range(int(count)):
        simulation.step(1)
        print(*(repr(simulation.get_real(f"fourbar::{name}")) for name in names))
"""


def _has(module: str) -> bool:
    return subprocess.run([PYTHON, "-c", f"import {module}"], capture_output=True).returncode == 0


def _rows(script: str, fmu: Path, folder: Path, *names: str) -> np.ndarray:
    """What a host prints, a row a step."""
    command = [PYTHON, "-c", script, str(fmu), str(STEP), str(COUNT), *names]
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder, timeout=120)
    assert done.returncode == 0, done.stderr
    rows = [line.split() for line in done.stdout.splitlines() if len(line.split()) == len(names)]
    return np.array([[float(value) for value in row] for row in rows])


def _wanted(name: str, times: np.ndarray) -> np.ndarray:
    run = kinfmu.solve(kinfmu.load(name), times)
    return np.column_stack([run[column] for column in NAMES])


@pytest.mark.skipif(not _has("libcosimpy"), reason="libcosimpy is not installed")
def test_osp_steps_it(built_native: Build, tmp_path: Path) -> None:
    from kinfmu.fmu.interface import interface
    from kinfmu.plan import compile_plan

    references = interface(compile_plan(kinfmu.load("crank_rocker"))).value_references()
    fmu = built_native("crank_rocker", 2, "time")
    rows = _rows(OSP, fmu, tmp_path, *(str(references[name]) for name in NAMES))
    times = STEP * np.arange(1, COUNT + 1)
    np.testing.assert_allclose(rows, _wanted("crank_rocker", times), rtol=0, atol=1e-9)


@pytest.mark.skipif(not _has("ecospy"), reason="ecospy is not installed, or lacks libtbb12")
def test_ecospy_steps_it(built_native: Build, fmi: int, tmp_path: Path) -> None:
    rows = _rows(ECOS, built_native("crank_rocker", fmi, "time"), tmp_path, *NAMES)
    times = STEP * np.arange(1, COUNT + 1)
    np.testing.assert_allclose(rows, _wanted("crank_rocker", times), rtol=0, atol=1e-9)


def _ecos() -> Path | None:
    """The native command inside the wheel of ecospy."""
    code = "import importlib.util as u; print(u.find_spec('ecospy').submodule_search_locations[0])"
    done = subprocess.run([PYTHON, "-c", code], capture_output=True, text=True)
    found = sorted(Path(done.stdout.strip()).rglob("ecos")) if done.returncode == 0 else []
    return next((path for path in found if path.is_file()), None)


@pytest.mark.skipif(_ecos() is None, reason="ecospy is not installed: no ecos command")
def test_the_ecos_command_steps_it(built_native: Build, fmi: int, tmp_path: Path) -> None:
    ecos = _ecos()
    assert ecos is not None
    ecos.chmod(0o755)
    fmu = built_native("crank_rocker", fmi, "time")
    command = [str(ecos), "simulate", "--path", str(fmu), "--stopTime", str(STEP * COUNT), "--stepSize", str(STEP)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, timeout=120)
    if "error while loading shared libraries" in done.stderr:
        pytest.skip("the ecos command lacks libtbb12")
    assert done.returncode == 0, done.stdout + done.stderr
    with next(iter(tmp_path.rglob("*.csv"))).open() as file:
        header, *lines = list(csv.reader(file))
    columns = [next(k for k, cell in enumerate(header) if f"::{name}[" in cell.replace(" ", "")) for name in NAMES]
    rows = np.array([[float(line[k]) for k in (header.index(header[1]), *columns)] for line in lines if len(line) > 1])
    np.testing.assert_allclose(
        rows[:, 1:], _wanted("crank_rocker", rows[:, 0]), rtol=0, atol=2e-5
    )  # it prints 6 digits
