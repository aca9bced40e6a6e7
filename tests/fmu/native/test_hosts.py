"""FMUs in hosts of other authors, most in a process of its own, compared with the Python engine.

A test is skipped if its host is not installed (scripts/hosts installs them): libcosimpy (OSP, FMI 2.0), ecospy with its
`ecos` command, FMUContainer (both versions). KINFMU_HOSTS may name another Python that has the first two.
"""

from __future__ import annotations

import csv
import math
import os
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.fmu import description
from tests.fmu.conftest import Build
from tests.fmu.planned import planned

PYTHON = os.environ.get("KINFMU_HOSTS", sys.executable)
STEP, COUNT = 0.013, 40
NAMES = ("coupler.x", "coupler.phi", "rocker.omega", "crank.torque", "O.force_x", "shaking_moment")

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


OSP_BY_INPUTS = """
import sys
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimManipulator import CosimManipulator
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave
fmu, step, values, input, ok, *references = sys.argv[1:]
execution = CosimExecution.from_step_size(step_size=round(float(step) * 1e9))
slave = execution.add_local_slave(CosimLocalSlave(fmu_path=fmu, instance_name="it"))
observer = CosimObserver.create_last_value()
execution.add_observer(observer)
manipulator = CosimManipulator.create_override()
execution.add_manipulator(manipulator)
for value in values.split():
    manipulator.slave_real_values(slave, [int(input)], [float(value)])
    done = execution.step()
    seen = observer.last_boolean_values(slave, [int(ok)])
    seen += observer.last_real_values(slave, [int(reference) for reference in references])
    print("row", int(done), *(repr(float(one)) for one in seen))
"""
ECOS_BY_INPUTS = """
import sys
from ecospy import EcosSimulation, EcosSimulationStructure
fmu, step, values, input, ok, *names = sys.argv[1:]
structure = EcosSimulationStructure()
structure.add_model("it", fmu)
with EcosSimulation(float(step), structure=structure) as simulation:
    simulation.init()
    for value in values.split():
        simulation.set_real(f"it::{input}", float(value))
        done = simulation.step(1) > 0.0
        seen = [simulation.get_bool(f"it::{ok}"), *(simulation.get_real(f"it::{name}") for name in names)]
        print("row", int(done), *(repr(float(one)) for one in seen))
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
    from kinfmu.fmu.variables import interface

    plan, forces = planned(kinfmu.load("fourbar_loaded"))
    references = interface(plan, forces=forces).value_references()
    fmu = built_native("fourbar_loaded", 2, "time")
    rows = _rows(OSP, fmu, tmp_path, *(str(references[name]) for name in NAMES))
    times = STEP * np.arange(1, COUNT + 1)
    np.testing.assert_allclose(rows, _wanted("fourbar_loaded", times), rtol=0, atol=1e-9)


@pytest.mark.skipif(not _has("ecospy"), reason="ecospy is not installed, or lacks libtbb12")
@pytest.mark.few(1)
def test_ecospy_steps_it(built_native: Build, fmi: int, tmp_path: Path) -> None:
    rows = _rows(ECOS, built_native("fourbar_loaded", fmi, "time"), tmp_path, *NAMES)
    times = STEP * np.arange(1, COUNT + 1)
    np.testing.assert_allclose(rows, _wanted("fourbar_loaded", times), rtol=0, atol=1e-9)


def table_of_ecos(
    fmu: Path, stop: float, step: float, folder: Path, *options: str
) -> tuple[list[str], list[list[str]]]:
    """Return the header and the rows of the CSV file that the ecos command writes, of an FMU or an SSP."""
    ecos = ecos_command()
    assert ecos is not None
    command = [str(ecos), "simulate", "--path", str(fmu), "--stopTime", str(stop), "--stepSize", str(step), *options]
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder, timeout=120)
    if "error while loading shared libraries" in done.stderr:
        pytest.skip("the ecos command lacks libtbb12")
    assert done.returncode == 0, done.stdout + done.stderr
    with next(iter(folder.rglob("*.csv"))).open() as file:
        header, *lines = list(csv.reader(file))
    return header, [line for line in lines if len(line) > 1]


def ecos_command() -> Path | None:
    """Return the command that scripts/hosts makes runnable, next to the Python that has ecospy."""
    linked = Path(PYTHON).parent / "ecos"
    if linked.is_file() and os.access(linked, os.X_OK):
        return linked
    code = "import importlib.util as u; print(u.find_spec('ecospy').submodule_search_locations[0])"
    done = subprocess.run([PYTHON, "-c", code], capture_output=True, text=True)
    command = Path(done.stdout.strip(), "binaries", "ecos")  # of a Python without the link
    if done.returncode or not command.is_file():
        return None
    command.chmod(0o755)
    return command


@pytest.mark.skipif(ecos_command() is None, reason="ecospy is not installed: no ecos command")
def test_the_ecos_command_steps_it(built_native: Build, fmi: int, tmp_path: Path) -> None:
    header, lines = table_of_ecos(built_native("fourbar_loaded", fmi, "time"), STEP * COUNT, STEP, tmp_path)
    columns = [next(k for k, cell in enumerate(header) if f"::{name}[" in cell.replace(" ", "")) for name in NAMES]
    rows = np.array([[float(line[k]) for k in (1, *columns)] for line in lines])
    np.testing.assert_allclose(
        rows[:, 1:], _wanted("fourbar_loaded", rows[:, 0]), rtol=0, atol=2e-5
    )  # the command writes 6 digits


@pytest.mark.parametrize(
    ("client", "flavour"),
    [
        ("fmu_manipulation_toolbox", "native 2"),
        ("fmu_manipulation_toolbox", "native 3"),
        ("fmu_manipulation_toolbox", "python"),
        ("casadi", "native 2"),
        ("casadi", "native 3"),
    ],
)
@pytest.mark.few(2)
def test_clients_inside_this_process_step_it(client: str, flavour: str, tmp_path: Path) -> None:
    from tests.fmu.native.hosts_page import MECHANISM, SHOWN, rows_of_casadi, rows_of_container

    pytest.importorskip(client)
    kind, _, fmi = flavour.partition(" ")
    path = kinfmu.build(kinfmu.load(MECHANISM), tmp_path, flavour=kind, fmi=int(fmi or 2), page=False)
    angles, places = (rows_of_casadi if client == "casadi" else rows_of_container)(path).T
    assert len(np.unique(angles)) == len(angles)
    wanted = kinfmu.solve(kinfmu.load(MECHANISM), crank_angle=angles)[SHOWN[1]]
    np.testing.assert_allclose(places, wanted, rtol=0, atol=1e-13)


# Driven by inputs, in steps that the host chooses, up to a limit and past it


@pytest.fixture(scope="module")
def fmus(built_native: Build, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, str], Path]:
    """`fmus(flavour, name)`: an FMU that inputs drive; these hosts hold Python, so they load the python flavour too."""
    folder = tmp_path_factory.mktemp("python")

    def get(flavour: str, name: str) -> Path:
        path = folder / f"{name}.fmu"
        if flavour != "python":
            return built_native(name, int(flavour[-1]), "inputs")
        return path if path.exists() else kinfmu.build(kinfmu.load(name), path, flavour="python", drive="inputs")

    return get


def _driven(host: str, fmu: Path, folder: Path, step: float, values: list[float], *names: str) -> np.ndarray:
    """Rows of a host: whether the step was done, solver.ok, and variables, after each step."""
    with zipfile.ZipFile(fmu) as zipped:
        about = description.read(zipped.read("modelDescription.xml"), str(fmu))
    references = about.interface.value_references()
    wanted = ["crank_angle", "solver.ok", *names]
    if host == "libcosimpy":
        wanted = [str(references[name]) for name in wanted]
    script = OSP_BY_INPUTS if host == "libcosimpy" else ECOS_BY_INPUTS
    command = [PYTHON, "-c", script, str(fmu), repr(step), " ".join(map(repr, values)), *wanted]
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder, timeout=120)
    assert done.returncode == 0, done.stderr
    return np.array(
        [[float(one) for one in line.split()[1:]] for line in done.stdout.splitlines() if line[:3] == "row"]
    )


HOSTS = [
    pytest.param(host, flavour, marks=pytest.mark.skipif(not _has(host), reason=f"{host} is not installed"))
    for host, flavour in (
        ("libcosimpy", "native 2"),
        ("libcosimpy", "python"),
        ("ecospy", "native 2"),
        ("ecospy", "native 3"),
        ("ecospy", "python"),
    )
]


@pytest.mark.parametrize(("host", "flavour"), HOSTS)
@pytest.mark.few(2)
def test_rates_of_a_driven_crank_are_estimated_in_hosts_that_wire_the_angle_alone(
    fmus: Callable[[str, str], Path], host: str, flavour: str, tmp_path: Path
) -> None:
    h, count = 0.01, 40
    t = h * np.arange(count)
    values = (1.0 + 0.3 * np.sin(2.0 * t)).tolist()
    names = ("crank.phi", "crank.omega", "crank.alpha")
    rows = _driven(host, fmus(flavour, "fourbar"), tmp_path, h, values, *names)
    assert rows[:, :2].all()  # every step is done and ok
    exact = np.column_stack([values, 0.6 * np.cos(2.0 * t), -1.2 * np.sin(2.0 * t)])
    errors = np.abs(rows[3:, 2:] - exact[3:]).max(axis=0)
    assert (errors < [1e-13, 0.8 * 1.1 * h**2, 2.4 * 1.1 * h]).all()


@pytest.mark.parametrize(("host", "flavour"), HOSTS)
@pytest.mark.few(2)
def test_hosts_react_to_a_limit_as_documented(
    fmus: Callable[[str, str], Path], host: str, flavour: str, tmp_path: Path
) -> None:
    values = [5.3 + 0.1 * k for k in range(14)]  # the limit is 2 pi, before value number 10
    rows = _driven(host, fmus(flavour, "double_pendulum"), tmp_path, 0.1, values, "upper.phi")
    past = np.array(values) > 2.0 * math.pi
    assert rows[~past, :2].all()
    np.testing.assert_allclose(rows[~past, 2], np.array(values)[~past], rtol=0, atol=1e-12)
    if host == "libcosimpy":  # it stops, and shows the last good sample
        assert not rows[past, 0].any()
        assert rows[past, 1].all()
    else:  # it continues: only solver.ok shows that the numbers are old
        assert rows[past, 0].all()
        assert not rows[past, 1].any()
    np.testing.assert_allclose(rows[past, 2], values[9], rtol=0, atol=1e-12)


@pytest.mark.skipif(ecos_command() is None, reason="ecospy is not installed: no ecos command")
def test_the_ecos_command_writes_ok_as_a_column_that_turns_0_at_the_limit(built_native: Build, tmp_path: Path) -> None:
    header, lines = table_of_ecos(built_native("double_pendulum", 2, "time"), 3.0, 0.1, tmp_path)
    (ok,) = (k for k, cell in enumerate(header) if "::solver.ok[BOOL]" in cell)
    rows = [(float(line[1]), int(line[ok])) for line in lines]
    assert {t for t, good in rows if not good} == {t for t, _ in rows if t > 2.0 + 1e-9}  # 360 degrees are there at 2 s
