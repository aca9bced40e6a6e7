"""Timing in rounds: each round runs every way once, so that other load on the machine slows all of them."""

from __future__ import annotations

import gc
import statistics
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

from kinfmu.display import aligned

SLICE = 0.02  # [s] that a way should run for in a round


class Spread(NamedTuple):
    """Median, smallest and largest of what was measured round by round, and the quartiles between them."""

    median: float
    low: float
    high: float
    lower: float
    upper: float

    def cells(self, places: int) -> list[str]:
        """Return median, smallest and largest as cells of a table."""
        return [f"{value:.{places}f}" for value in (self.median, self.low, self.high)]


def spread(measured: Sequence[float]) -> Spread:
    """Return median, range and quartiles of at least one number."""
    lower, upper = statistics.quantiles(measured, n=4)[::2] if len(measured) > 1 else (measured[0], measured[0])
    return Spread(statistics.median(measured), min(measured), max(measured), lower, upper)


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of a table: the first column to the left, the others to the right, as wide as their cells."""
    return aligned([head, *rows], left=1, indent="")


def in_turn(
    ways: Sequence[Callable[[], object]],
    rounds: int,
    clock: Callable[[], float] = time.perf_counter,
    each: Callable[[], None] | None = None,
) -> list[list[float]]:
    """Return the seconds that each way takes, (ways, rounds), after one to warm up; call `each` after every round."""
    measured: list[list[float]] = [[] for _ in ways]
    with _garbage_set_aside():
        for way in ways:
            way()
        for _ in range(rounds):
            for way, seconds in zip(ways, measured, strict=True):
                start = clock()
                way()
                seconds.append(clock() - start)
            if each is not None:
                each()
    return measured


def samples_in_turn(
    ways: Sequence[Callable[[int], object]],
    rounds: int,
    most: int,
    fewest: int = 5,
    each: Callable[[], None] | None = None,
) -> list[list[float]]:
    """Return microseconds of processor time a sample of each way, (ways, rounds).

    A way takes its first n samples, from `fewest` to `most`, and again, so that a SLICE is filled.
    """
    slices, taken = [], []
    for way in ways:
        way(1)
        start = time.process_time()
        way(fewest)
        each_takes = max(time.process_time() - start, 1e-6) / fewest
        count = max(fewest, min(most, int(SLICE / each_takes)))
        times = max(1, int(SLICE / (each_takes * count)))  # repeated, if all samples do not fill it
        slices.append(_slice(way, count, times))
        taken.append(count * times)
    measured = in_turn(slices, rounds, time.process_time, each)
    return [[value / count * 1e6 for value in seconds] for seconds, count in zip(measured, taken, strict=True)]


def _slice(way: Callable[[int], object], count: int, times: int) -> Callable[[], object]:
    def take() -> None:
        for _ in range(times):
            way(count)

    return take


@contextmanager
def _garbage_set_aside() -> Iterator[None]:
    """Keep the garbage collector from objects that exist already, such as plans: they are not measured."""
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
