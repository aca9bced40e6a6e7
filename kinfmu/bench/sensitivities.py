"""Sensitivities: their cost for ten parameters, compared with that of the values alone."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from time import process_time

import numpy as np

from kinfmu.bench.rounds import in_turn, spread, table
from kinfmu.gallery import load
from kinfmu.sweep import compile as compiled

PARAMETERS = list("abcdefghij")  # ten of the leg's lengths
FOOT = ["foot.x", "foot.y"]
SAMPLES = {"native": (361, 3600), "python": (361,)}
REPEATS = {"native": 10, "python": 1}  # calls of a round
PER_SAMPLE = 1e9  # [ns/s]


def sensitivity_lines(rounds: int) -> list[str]:
    """Return a table: nanoseconds a sample of Jansen's leg, for values and for sensitivities."""
    leg = load("jansen_leg")
    rows = []
    for engine, counts in SAMPLES.items():
        for outputs in (None, FOOT):
            model = compiled(leg, outputs, engine=engine)
            for count in counts:
                angles = np.linspace(0.0, 2.0 * np.pi, count)
                calls = (
                    partial(model.solve, crank_angle=angles),
                    partial(model.sensitivities, crank_angle=angles, wrt=PARAMETERS),
                )
                repeats = REPEATS[engine]
                ways = [partial(_repeated, call, repeats) for call in calls]
                values, both = (
                    spread([s / repeats / count * PER_SAMPLE for s in seconds])
                    for seconds in in_turn(ways, rounds, process_time)
                )
                what = f"{len(model.outputs)} outputs at {count} angles, {engine} engine"
                ratio = both.low / values.low
                rows.append([what, f"{values.low:.0f}", f"{both.low:.0f}", f"{ratio:.2f}"])
    return [
        f"Jansen leg: Model.solve, and Model.sensitivities with respect to {len(PARAMETERS)} lengths; "
        f"the best of {rounds} rounds in turn; ns of processor time a sample",
        *table(("", "solve", "sensitivities", "ratio"), rows),
    ]


def _repeated(call: Callable[[], object], times: int) -> None:
    for _ in range(times):
        call()
