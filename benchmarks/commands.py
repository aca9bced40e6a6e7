"""Time of whole commands, each in a fresh process, compared with bare Python, with numpy and with `import kinfmu`."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import kinfmu
from benchmarks.rounds import in_turn, spread, table
from kinfmu.files import temporary_folder

ROUNDS = 11
STATEMENTS = ("pass", "import numpy", "import kinfmu")
COMMANDS = (
    "build crank_rocker --flavour python -o crank_rocker.fmu",
    "check crank_rocker",
    "solve jansen_leg -o run.csv",
    "simulate crank_rocker.fmu --stop 1 --step 0.001",
)


def run(rounds: int = ROUNDS) -> str:
    """Return a table: milliseconds of a whole process, compiled Python files and an empty cache of kinfmu before."""
    arguments = [["-c", statement] for statement in STATEMENTS]
    arguments += [["-m", "kinfmu", *command.split()] for command in COMMANDS]
    with temporary_folder() as folder:
        ways = [_process(each, folder) for each in arguments]
        measured = [[1e3 * value for value in seconds] for seconds in in_turn(ways, rounds)]
    rows = []
    for name, milliseconds in zip((*STATEMENTS, *COMMANDS), measured, strict=True):
        found = spread(milliseconds)
        rows.append([name, *(f"{value:.1f}" for value in (found.median, found.lower, found.upper, found.low))])
    head = (f"whole process, {rounds} rounds in turn; ms", "median", "lower quartile", "upper quartile", "min")
    return "\n".join(table(head, rows))


def _process(arguments: list[str], folder: Path) -> Callable[[], object]:
    """Return a function that runs Python in a folder, with the kinfmu of this process, installed or not."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    paths = [str(Path(kinfmu.__file__).parents[1]), *filter(None, [environment.get("PYTHONPATH")])]
    environment |= {"PYTHONPATH": os.pathsep.join(paths), "KINFMU_CACHE": str(folder / "cache")}
    command = [sys.executable, *arguments]
    return lambda: subprocess.run(command, check=True, cwd=folder, env=environment, capture_output=True)
