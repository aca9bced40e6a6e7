"""Run time against error: every engine in every setting on several mechanisms, timed in turn."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from typing import NamedTuple

from benchmarks.case import Case, of_gallery
from benchmarks.engine import BenchEngine, EngineSetting, Sampler
from benchmarks.engines import ENGINES
from benchmarks.rounds import Spread, samples_in_turn, spread
from kinfmu.errors import MissingPackageError

MECHANISMS = ("crank_rocker", "slider_crank", "stephenson_six_bar", "jansen_leg", "excavator")
ROUNDS = 7

Done = Callable[[], None]  # called after each of `steps`


class Measured(NamedTuple):
    """One engine in one setting on one mechanism.

    microseconds: processor time a sample; errors: largest of q, qd, qdd over the samples of the reference, relative to
    each column's largest magnitude; NaN if a sample was not found.
    """

    case: str
    engine: str
    setting: EngineSetting
    is_usual: bool
    microseconds: Spread
    errors: tuple[float, float, float]

    @property
    def error(self) -> float:
        """The largest of the three; NaN if one is NaN."""
        return max(self.errors, key=lambda error: (math.isnan(error), error))


class Result(NamedTuple):
    """What was measured, and a line for each engine that was not."""

    measured: tuple[Measured, ...]
    absent: tuple[str, ...]


def measure(
    mechanisms: Sequence[str] = MECHANISMS,
    rounds: int = ROUNDS,
    done: Done = lambda: None,
    engines: Sequence[BenchEngine] = ENGINES,
) -> Result:
    """Measure errors in one whole sweep of every sampler; then times, all samplers of a mechanism once a round."""
    measured: list[Measured] = []
    absent: dict[str, None] = {}
    for name in mechanisms:
        case = of_gallery(name)
        samplers: list[tuple[BenchEngine, EngineSetting, Sampler]] = []
        for engine in engines:
            for setting in engine.settings:
                done()
                sampler = prepared(engine, case, setting, absent)
                if sampler is not None:
                    samplers.append((engine, setting, sampler))
        errors = []
        for _, _, sampler in samplers:
            done()
            errors.append(largest(case, sampler))
        times = samples_in_turn([quietly(sampler) for _, _, sampler in samplers], rounds, len(case.t), each=done)
        measured += [
            Measured(name, engine.name, setting, setting == engine.usual, per_lap(engine, microseconds), error)
            for (engine, setting, _), microseconds, error in zip(samplers, times, errors, strict=True)
        ]
    return Result(tuple(measured), tuple(absent))


def steps(
    mechanisms: Sequence[str] = MECHANISMS, rounds: int = ROUNDS, engines: Sequence[BenchEngine] = ENGINES
) -> int:
    """Return how often `measure` calls `done`, at most."""
    return len(mechanisms) * (rounds + 2 * sum(len(engine.settings) for engine in engines))


def prepared(engine: BenchEngine, case: Case, setting: EngineSetting, absent: dict[str, None]) -> Sampler | None:
    """Return a sampler to be measured; None if there is none, with a line in `absent` if a package is missing."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of other people's packages
            return engine.sampler(case, setting)
    except MissingPackageError as error:
        absent[str(error)] = None
        return None


def per_lap(engine: BenchEngine, microseconds: Sequence[float]) -> Spread:
    """Return the time of a sample; an engine may take each sample several times in a call."""
    return spread([value / engine.laps for value in microseconds])


def quietly(sampler: Sampler) -> Sampler:
    """Return the sampler without warnings of other people's packages on stderr, such as those of a singular matrix."""

    def take(n: int) -> Sequence[Sequence[float]]:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return sampler(n)

    return take


def largest(case: Case, sampler: Sampler) -> tuple[float, float, float]:
    """Return the largest error of q, qd, qdd over a whole sweep."""
    q, qd, qdd = case.errors(quietly(sampler)(len(case.t))).max(axis=0).tolist()
    return q, qd, qdd
