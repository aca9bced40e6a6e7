"""The neighbourhood of singular points: error at shrinking distances, exactly at the point, and beyond it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from benchmarks.accuracy import Done, per_lap, prepared, quietly
from benchmarks.case import Case, along_driver
from benchmarks.engine import BenchEngine, Sampler
from benchmarks.engines import ENGINES
from benchmarks.rounds import Spread, samples_in_turn
from benchmarks.singular_points import POINTS, SingularCase
from kinfmu.arrays import FloatArray
from kinfmu.errors import MissingPackageError
from kinfmu.plan import compile_plan

DISTANCES = tuple(10.0 ** (-0.5 * k) for k in range(2, 17))  # [rad], 1e-1 to 1e-8
STEP = math.radians(2.0)  # of the path there
ROUNDS = 7


class Near(NamedTuple):
    """One engine in its usual setting near one point.

    before, beyond: (k, 3) error of q, qd, qdd [rad, length, at 1 rad/s] at each of DISTANCES on either side; at: (3,)
    exactly at the point; NaN where it gave no numbers. The samples are taken in this order: before, at, beyond.
    """

    point: str
    engine: str
    before: FloatArray
    at: FloatArray
    beyond: FloatArray
    microseconds: Spread  # a sample of the whole path


def case_of(point: SingularCase) -> Case:
    """Return the path from the start past the point: steps of STEP, the DISTANCES before, the point, those beyond."""
    first, last = point.start, point.centre - 2.0 * DISTANCES[0]
    steps = np.linspace(first, last, math.ceil((last - first) / STEP) + 1).tolist()
    before = [point.centre - d for d in DISTANCES]
    beyond = [point.centre + d for d in reversed(DISTANCES)]
    u = [*steps, *before, point.centre, *beyond]
    plan = compile_plan(point.mechanism(), point.columns)
    return along_driver(point.title, plan, u, range(len(steps), len(u)), point.closed_form)


def measure(
    rounds: int = ROUNDS, done: Done = lambda: None, engines: Sequence[BenchEngine] = ENGINES
) -> tuple[tuple[Near, ...], tuple[str, ...]]:
    """Take every engine past every point in its usual setting; also return a line for each that is not installed."""
    found: list[Near] = []
    absent: dict[str, None] = {}
    for point in POINTS:
        try:
            case = case_of(point)
        except MissingPackageError as missing:
            absent[f"{point.title}: {missing}"] = None
            continue
        samplers: list[tuple[BenchEngine, Sampler]] = []
        for engine in engines:
            sampler = prepared(engine, case, engine.usual, absent)
            if sampler is not None:
                samplers.append((engine, quietly(sampler)))
        k = len(DISTANCES)
        errors = []
        for _, sampler in samplers:
            errors.append(case.errors(sampler(len(case.t))))
            done()
        times = samples_in_turn([_whole(sampler, len(case.t)) for _, sampler in samplers], rounds, 1, fewest=1)
        for (engine, _), error, seconds in zip(samplers, errors, times, strict=True):
            microseconds = per_lap(engine, [value / len(case.t) for value in seconds])
            found.append(Near(point.title, engine.name, error[:k], error[k], error[:k:-1], microseconds))
    return tuple(found), tuple(absent)


def _whole(sampler: Sampler, n: int) -> Callable[[int], object]:
    """Return the sampler of the whole path, counted as one sample."""
    return lambda _: sampler(n)


def steps(engines: Sequence[BenchEngine] = ENGINES) -> int:
    """Return how often `measure` calls `done`, at most."""
    return len(POINTS) * len(engines)
