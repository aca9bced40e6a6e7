"""Memory of a process that steps FMUs of the Python flavour: instances leave little, and nothing is freed twice."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import kinfmu

STEPS = "import sys, kinfmu; [kinfmu.simulate(sys.argv[1], stop=0.1, step=0.05) for _ in range(2)]; print('stepped')"
IN_FMPY = "import sys; from fmpy import simulate_fmu; simulate_fmu(sys.argv[1], stop_time=0.1); print('stepped')"
INSTANCES = """
import gc, sys, tracemalloc
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
about = read_model_description(sys.argv[1])
identifier = about.coSimulation.modelIdentifier
before = list(sys.path)
slave = FMU2Slave(guid=about.guid, modelIdentifier=identifier, unzipDirectory=extract(sys.argv[1]), instanceName="it")

def step():
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    slave.doStep(0.0, 0.01)
    slave.terminate()
    slave.fmi2FreeInstance(slave.component)

def left():
    gc.collect()
    return tracemalloc.get_traced_memory()[0], len(gc.get_objects())

tracemalloc.start()
for _ in range(200):
    step()
size, objects = left()
for _ in range(1000):
    step()
size, objects = (now - then for now, then in zip(left(), (size, objects)))
print(size / 1000, objects / 1000, sys.path == before)
"""
LIBRARY = ("crank_rocker.so", "libpythonfmu-export")  # frames of an error in it


def test_instances_leave_nothing(tmp_path: Path) -> None:
    """The least FMU of pythonfmu leaves 7 kB, one of ours left 1.5 kB, and a path in `sys.path`."""
    fmu = kinfmu.build(kinfmu.load("fourbar_loaded"), tmp_path / "it.fmu", flavour="python", page=False)
    done = subprocess.run([sys.executable, "-c", INSTANCES, str(fmu)], capture_output=True, text=True, check=True)
    size, objects, path_is_the_same = done.stdout.split()
    assert float(size) < 50.0
    assert abs(float(objects)) < 0.1
    assert path_is_the_same == "True"


@pytest.mark.parametrize("program", [STEPS, IN_FMPY], ids=["kinfmu", "fmpy"])
@pytest.mark.long
@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
def test_pythonfmus_library_frees_nothing_twice(program: str, tmp_path: Path) -> None:
    """Else some processes abort at their end, after all files are written."""
    fmu = kinfmu.build(kinfmu.load("crank_rocker"), tmp_path / "crank_rocker.fmu", flavour="python", page=False)
    command = ["valgrind", f"--log-file={tmp_path / 'log'}", sys.executable, "-c", program, str(fmu)]
    environment = {**os.environ, "PYTHONMALLOC": "malloc"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["stepped"]
    errors = (tmp_path / "log").read_text("utf-8").split("Invalid ")[1:]
    heads = [error.split("Address")[0] for error in errors]  # without where the memory came from
    assert [head for head in heads if any(name in head for name in LIBRARY)] == []
