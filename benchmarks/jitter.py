"""How long single steps of the native FMU take in a C host that steps it at 10 kHz, compared with an empty function."""

from __future__ import annotations

import ctypes
import tempfile
from itertools import count
from pathlib import Path

import numpy as np

from benchmarks.native_step import DEGREE, host, instantiated
from benchmarks.rounds import table
from kinfmu.mechanism import Mechanism

STEPS = 100_000  # in a round: 10 s
ROUNDS = 1
PERIOD = ctypes.c_long(100_000)  # [ns]


def run(mechanism: Mechanism, rounds: int = ROUNDS, steps: int = STEPS) -> str:
    """Return a table: median, 99.99 % and longest time of a step (set 1, step, get 15), and of an empty function.

    Both are measured by the same clock, one after the other, and include reading it.
    """
    with tempfile.TemporaryDirectory(prefix="kinfmu_bench_", ignore_cleanup_errors=True) as folder:
        stepped, _ = instantiated(mechanism, 3, Path(folder, "fmu"))
        step, arguments, first = host().host_at_rate3, stepped.arguments(), count(0, steps)
        times = np.empty((2, rounds, steps))
        pointers = [[of.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for of in row] for row in times]
        for of_step, of_empty in zip(*pointers, strict=True):
            number = ctypes.c_long(next(first))
            failed = step(*arguments, number, ctypes.c_long(steps), DEGREE, PERIOD, of_step, of_empty)
            if failed:
                raise RuntimeError(f"{failed} calls failed")
    names = f"{mechanism.name}: set 1, step 1 deg, get 15", "an empty function"
    rows = [
        (name, *(f"{value / 1e3:.2f} us" for value in (*np.percentile(row, (50.0, 99.99)), row.max())))
        for name, row in zip(names, times, strict=True)
    ]
    return "\n".join(table((f"{rounds * steps} steps at 10 kHz", "median", "99.99 %", "longest"), rows))
