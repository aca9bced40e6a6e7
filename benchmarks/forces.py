"""Cost of forces: time that efforts and reactions add to a sweep by the native engine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from time import process_time

import numpy as np

from benchmarks.rounds import in_turn, spread, table
from kinfmu.mechanism import Gravity, Mechanism, Point
from kinfmu.mechanism.gallery import load
from kinfmu.run import Run
from kinfmu.run.model import Model
from kinfmu.run.model import compile as compiled
from kinfmu.units import METRES

ROUNDS = 15
MECHANISMS = ("fourbar", "crank_rocker")  # the reference four-bar with its redundant bar; one without
SAMPLES = (3600, 36_000, 360_000)  # the smallest stay in the caches
LEAST = 36_000  # samples of a round
PER_SAMPLE = 1e9  # [ns/s]


def run(rounds: int = ROUNDS) -> str:
    """Return a table: nanoseconds a sample over a turn, with and without masses, efforts, shaking force, reactions."""
    rows = []
    for name in MECHANISMS:
        plain = load(name)
        models = compiled(_massless(plain), engine="native"), compiled(with_masses(plain), engine="native")
        for count in SAMPLES:
            angles = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False) + 0.1
            repeats = max(1, LEAST // count)
            ways = [
                partial(_repeated, partial(_solved, model, angles, read), repeats)
                for model, read in zip(
                    (models[0], *4 * models[1:]), (None, None, _efforts, _shaking, _reactions), strict=True
                )
            ]
            costs = [
                spread([s / repeats / count * PER_SAMPLE for s in seconds]).low
                for seconds in in_turn(ways, rounds, process_time)
            ]
            what = f"{name}, {count} samples"
            ratios = [f"{cost / costs[0]:.2f}" for cost in costs[1:]]
            rows.append([what, f"{costs[0]:.1f}", *ratios])
    head = ("", "no masses [ns]", "masses", "and efforts", "and shaking", "and reactions")
    return "\n".join(
        [f"Model.solve, native engine; the best of {rounds} rounds in turn, processor time; ratios", *table(head, rows)]
    )


def with_masses(mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with masses away from the origins of its bodies, and gravity."""
    metre = METRES[mechanism.length_unit]
    size = max(abs(value) for body in mechanism.bodies for point in body.points.values() for value in point)
    bodies = [
        body
        if body.is_ground
        else replace(body, mass=1.0, center_of_mass=Point(0.3 * size, 0.1 * size), inertia=0.4 * (size * metre) ** 2)
        for body in mechanism.bodies
    ]
    return replace(mechanism, bodies=tuple(bodies), gravity=Gravity(0.0, -9.81 / metre))


def _massless(mechanism: Mechanism) -> Mechanism:
    bodies = [
        body if body.is_ground else replace(body, mass=0.0, center_of_mass=Point(0.0, 0.0), inertia=0.0, rod=None)
        for body in mechanism.bodies
    ]
    return replace(mechanism, bodies=tuple(bodies), gravity=None, loads=())


def _solved(model: Model, angles: np.ndarray, read: Callable[[Run], object] | None) -> None:
    run = model.solve(crank_angle=angles, crank_speed=1.0, crank_acceleration=0.0)
    if read:
        read(run)


def _efforts(run: Run) -> object:
    return run.forces


def _shaking(run: Run) -> object:
    return run["shaking_force_x"]


def _reactions(run: Run) -> object:
    return run.reactions


def _repeated(call: Callable[[], object], times: int) -> None:
    for _ in range(times):
        call()
