"""What `import kinfmu` costs over bare Python, each in a fresh process."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import kinfmu
from kinfmu.bench.rounds import in_turn, spread

ROUNDS = 21
STATEMENTS = ("pass", "import kinfmu")


def run(rounds: int = ROUNDS) -> str:
    """A table: milliseconds of a whole process, and of the differences round by round."""
    bare, ours = ([1e3 * value for value in seconds] for seconds in in_turn([_process(s) for s in STATEMENTS], rounds))
    differences = [b - a for a, b in zip(bare, ours, strict=True)]
    lines = [f"whole process, {rounds} rounds in turn; ms{'':8}{'median':>9}{'min':>9}{'max':>9}"]
    for name, measured in zip((*STATEMENTS, "difference"), (bare, ours, differences), strict=True):
        of = spread(measured)
        lines.append(f"{name:39}{of.median:9.1f}{of.low:9.1f}{of.high:9.1f}")
    return "\n".join(lines)


def _process(statement: str) -> Callable[[], object]:
    beside = Path(kinfmu.__file__).parents[1]  # where it is found, installed or not
    return lambda: subprocess.run([sys.executable, "-c", statement], check=True, cwd=beside)
