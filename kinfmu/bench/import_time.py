"""What `import kinfmu` costs over bare Python, each in a fresh process."""

from __future__ import annotations

import statistics
import subprocess
import sys
import time

ROUNDS = 21


def run() -> str:
    """A table: milliseconds of a whole process, in turn, and the median of the differences."""
    times: dict[str, list[float]] = {"pass": [], "import kinfmu": []}
    for _ in range(ROUNDS):
        for statement, measured in times.items():
            start = time.perf_counter()
            subprocess.run([sys.executable, "-c", statement], check=True)
            measured.append((time.perf_counter() - start) * 1e3)
    differences = [ours - bare for bare, ours in zip(*times.values(), strict=True)]
    lines = [f"whole process, {ROUNDS} rounds in turn; ms{'':8}{'median':>9}{'min':>9}{'max':>9}"]
    for name, measured in (*times.items(), ("difference", differences)):
        lines.append(f"{name:39}{statistics.median(measured):9.1f}{min(measured):9.1f}{max(measured):9.1f}")
    return "\n".join(lines)
