"""Time of `import kinfmu` compared with bare Python, each in a fresh process."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import kinfmu
from benchmarks.rounds import in_turn, spread, table

ROUNDS = 21
STATEMENTS = ("pass", "import kinfmu")


def run(rounds: int = ROUNDS) -> str:
    """Return a table: milliseconds of a whole process, and of the differences round by round."""
    bare, ours = ([1e3 * value for value in seconds] for seconds in in_turn([_process(s) for s in STATEMENTS], rounds))
    differences = [b - a for a, b in zip(bare, ours, strict=True)]
    measured = zip((*STATEMENTS, "difference"), (bare, ours, differences), strict=True)
    rows = [[name, *spread(milliseconds).cells(1)] for name, milliseconds in measured]
    return "\n".join(table((f"whole process, {rounds} rounds in turn; ms", "median", "min", "max"), rows))


def _process(statement: str) -> Callable[[], object]:
    folder = Path(kinfmu.__file__).parents[1]  # where it is found, installed or not
    return lambda: subprocess.run([sys.executable, "-c", statement], check=True, cwd=folder)
