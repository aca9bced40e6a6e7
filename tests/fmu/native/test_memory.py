"""A C host under the sanitizers: no access out of bounds, no undefined behaviour, no uninitialized memory, no leaks.

Every mechanism with both versions of FMI: tests/stress/test_short_forms.py.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

import kinfmu
from kinfmu.codegen.c import compiler
from kinfmu.fmu.interface import Drive
from kinfmu.fmu.native.sources import headers
from tests.fmu.planned import fmu_sources
from tests.fmu.test_parameters import linkage
from tests.fmu.test_torque import motor, rocker

HOST = Path(__file__).with_name("host.c")
CC = shutil.which("gcc") or shutil.which("clang")
OWN: dict[str, Callable[[], kinfmu.Mechanism]] = {"settable": linkage, "motor": motor, "rocker": rocker}
DRIVEN_BY_TORQUES = ("motor", "rocker")  # the rocker falls to its dead centre, where its motion ends


def program(
    mechanism: kinfmu.Mechanism, fmi: int, folder: Path, *flags: str, drive: Drive = "inputs", host: Path = HOST
) -> Path:
    """The FMU's sources and a host, linked into one program."""
    files, variables, plan = fmu_sources(mechanism, fmi, drive)
    files |= headers(f"{fmi}.0")
    path = folder / "host"
    sources_and_host = files | {"host.c": host.read_text("utf-8")}
    references = variables.value_references()
    outputs = [v.name for v in variables if v.causality == "output" and v.type == "Real"]
    defined = {
        "FMI": fmi,
        "OUTPUT_REFERENCES": ",".join(str(references[name]) for name in outputs),
        "OUTPUTS": len(outputs),
        "INPUT": references[variables.part("efforts" if drive == "torque" else "inputs")[0].name],
        "AMPLITUDE": 40.0 if drive == "torque" else 2.0,
        "WORK": references.get("solver.work", 0),
        "PARAMETER": references[plan.parameters[0].name] if plan.parameters else -1,
    }
    for name, text in sources_and_host.items():
        (folder / name).write_text(text, "utf-8")
    command = [str(CC), "-std=c99", "-g", "-ffp-contract=off", *flags]
    command += [*(f"-D{name}={value}" for name, value in defined.items()), *compiler.units(sources_and_host), "-o"]
    command += [str(path), "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if "cannot find" in done.stderr:
        pytest.skip(f"this compiler has no {flags}")
    assert done.returncode == 0, done.stderr
    return path


@pytest.mark.skipif(CC is None, reason="neither gcc nor clang is there")
@pytest.mark.parametrize(
    ("name", "fmi"),
    [
        pytest.param("fourbar", 2, marks=pytest.mark.long),
        ("fourbar_loaded", 3),
        ("motor", 3),
        pytest.param("motor", 2, marks=pytest.mark.long),
        ("rocker", 2),
        pytest.param("settable", 3, marks=pytest.mark.long),
    ],
)
@pytest.mark.few(1)
def test_address_and_undefined_behaviour_sanitizers_report_no_errors(name: str, fmi: int, tmp_path: Path) -> None:
    check_under_sanitizers(name, fmi, tmp_path)


def check_under_sanitizers(name: str, fmi: int, tmp_path: Path, *more: str) -> None:
    """Run the host of a mechanism's FMU under the sanitizers; more: flags of the compiler."""
    mechanism = OWN[name]() if name in OWN else kinfmu.load(name)
    drive: Drive = "torque" if name in DRIVEN_BY_TORQUES else "inputs"
    flags = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", *more)
    done = subprocess.run([program(mechanism, fmi, tmp_path, *flags, drive=drive)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""


@pytest.mark.skipif(CC is None or shutil.which("valgrind") is None, reason="valgrind or a compiler is not there")
@pytest.mark.long
def test_valgrind_reports_no_errors(fmi: int, tmp_path: Path) -> None:
    command = ["valgrind", "--error-exitcode=9", "--leak-check=full", "-q", program(linkage(), fmi, tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
