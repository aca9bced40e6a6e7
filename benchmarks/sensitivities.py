"""Sensitivities: their cost for ten parameters, compared with that of the values alone."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from time import process_time

import numpy as np

from benchmarks.rounds import in_turn, spread, table
from kinfmu.mechanism.gallery import load
from kinfmu.run.model import compile as compiled
from kinfmu.run.sensitivities import Sensitivities

PARAMETERS = list("abcdefghij")  # ten of the leg's lengths
FOOT = ["foot.x", "foot.y"]
SAMPLES = {"native": (361, 3600, 20_000), "python": (361,)}
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
                fresh = partial(model.sensitivities, crank_angle=angles, wrt=PARAMETERS)
                calls = (partial(model.solve, crank_angle=angles), fresh, _into_earlier(fresh))
                repeats = REPEATS[engine]
                ways = [partial(_repeated, call, repeats) for call in calls]
                values, *both = (
                    spread([s / repeats / count * PER_SAMPLE for s in seconds])
                    for seconds in in_turn(ways, rounds, process_time)
                )
                what = f"{len(model.outputs)} outputs at {count} angles, {engine} engine"
                times = [f"{one.low:.0f}" for one in (values, *both)]
                rows.append([what, *times, *(f"{one.low / values.low:.2f}" for one in both)])
    return [
        f"Jansen leg: Model.solve, and Model.sensitivities with respect to {len(PARAMETERS)} lengths; "
        f"the best of {rounds} rounds in turn; ns of processor time a sample",
        *table(("", "solve", "sensitivities", "memory reused", "ratio", "ratio, reused"), rows),
    ]


def _into_earlier(call: Callable[..., Sensitivities]) -> Callable[[], None]:
    """Return a call that reuses the memory of its last result."""
    last = [call()]

    def again() -> None:
        last[0] = call(reuse=last[0])

    return again


def _repeated(call: Callable[[], object], times: int) -> None:
    for _ in range(times):
        call()
