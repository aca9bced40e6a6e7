"""Native FMUs under sanitizers: a random host in C calls every function of FMI in every state. See fmu_driver.c."""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple

import kinfmu
from kinfmu.codegen.c import compiler
from kinfmu.fmu.interface import Drive
from kinfmu.fmu.native.sources import headers
from tests.fmu.planned import fmu_sources
from tests.fmu.test_parameters import linkage
from tests.fmu.test_torque import MECHANISMS
from tests.fuzz.summary import Summary, seeds

DRIVER = Path(__file__).with_name("fmu_driver.c")
CALLS = 400  # of a trial, by each thread
MOST_STEPS = "#define KF_TORQUE_MOST (1000000)"  # of the integrator in one step of the host
FEW_STEPS = "#define KF_TORQUE_MOST (500)"
PATIENCE = 120.0  # [s] for one trial
SANITIZERS = {
    "address": ("-fsanitize=address,undefined", "-fno-sanitize-recover=all"),
    "thread": ("-fsanitize=thread",),
}


class Variant(NamedTuple):
    """A program: an FMU's sources and the host, under sanitizers."""

    mechanism: str
    fmi: int
    drive: Drive
    sanitizer: str

    def __str__(self) -> str:
        return f"{self.mechanism}, FMI {self.fmi}, driven by {self.drive}, {self.sanitizer} sanitizer"


VARIANTS = [
    Variant("fourbar", 2, "inputs", "address"),
    Variant("settable", 3, "inputs", "thread"),
    Variant("five_bar", 3, "inputs", "address"),
    Variant("cam_roller", 2, "time", "address"),
    Variant("five_bar", 2, "time", "thread"),
    Variant("settable", 2, "time", "address"),
    Variant("triple_rocker", 3, "time", "thread"),
    Variant("double_pendulum", 2, "inputs", "address"),
    Variant("excavator", 3, "time", "address"),
    Variant("excavator_loaded", 3, "inputs", "thread"),
    Variant("engine", 2, "time", "address"),
    Variant("motor", 2, "torque", "address"),
    Variant("arms", 3, "torque", "thread"),
]


def run(seed: int, seconds: float) -> Summary:
    """Run trials from `seed` on: each seed has its program and its calls. Compiling does not count as time."""
    summary = Summary("fmu")
    with tempfile.TemporaryDirectory(prefix="kinfmu_fuzz_") as folder:
        for one in seeds(seed, seconds):
            trial(one, Path(folder), summary)
    return summary


def trial(seed: int, folder: Path, summary: Summary) -> None:
    """Do the trial of a seed and keep what it finds: one line of the host, or the first of a sanitizer."""
    variant = VARIANTS[seed % len(VARIANTS)]
    threads = 2 if variant.sanitizer == "thread" else 1
    program = _program(variant, folder)
    command = [str(program), str(seed), str(CALLS), str(threads)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        summary.find(seed, str(variant), f"no end after {PATIENCE:g} s")
        return
    summary.count(f"times {CALLS} calls, {variant.sanitizer} sanitizer")
    if done.returncode != 0 or done.stderr:
        lines = done.stderr.splitlines() or [f"the program ended with status {done.returncode}"]
        marks = ("finding:", "runtime error", "ERROR:", "WARNING:")
        summary.find(
            seed, str(variant), next((line for line in lines if any(mark in line for mark in marks)), lines[0])
        )


def _program(variant: Variant, folder: Path) -> Path:
    """The program of a variant, compiled when it is first wanted."""
    path = folder / "_".join(map(str, variant))
    if not path.exists():
        version = f"{variant.fmi}.0"
        files = fmu_sources(_mechanism(variant.mechanism), variant.fmi, variant.drive)[0] | headers(version)
        if variant.drive == "torque":  # under sanitizers a million steps take a minute
            assert MOST_STEPS in files["efforts.h"]
            files["efforts.h"] = files["efforts.h"].replace(MOST_STEPS, FEW_STEPS)
        files[DRIVER.name] = DRIVER.read_text("utf-8")
        flags = ("-std=c99", "-g", "-O0", "-ffp-contract=off", "-pthread")
        compiler.compile_files(
            compiler.command(),
            files,
            (
                *flags,
                f"-DFMI={variant.fmi}",
                f"-DTORQUE={int(variant.drive == 'torque')}",
                *SANITIZERS[variant.sanitizer],
            ),
            path,
        )
    return path


def _mechanism(name: str) -> kinfmu.Mechanism:
    if name == "settable":
        return linkage()
    return MECHANISMS[name]() if name in MECHANISMS else kinfmu.load(name)
