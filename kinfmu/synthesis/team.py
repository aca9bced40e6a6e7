"""A team of processes that search from many starts; the results do not depend on their number."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from types import TracebackType
from typing import Literal

import numpy as np

from kinfmu.errors import CompilerError, RequestError
from kinfmu.run import FloatArray
from kinfmu.synthesis.argument import SAMPLES
from kinfmu.synthesis.equations import Equations, NotAssembledError
from kinfmu.synthesis.problem import FitProblem
from kinfmu.synthesis.search import FINE, LONG, SHORT, Found, search

Task = Literal["draw", "short", "long", "fine"]
Advance = Callable[[int], None]
WORTH = 2.0  # [s] in Python, from which compiling pays
_EFFORTS = {"short": SHORT, "long": LONG, "fine": FINE}
_equations: Equations  # of a process of the team


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Team:
    """Processes that work on tasks; with one worker, this process.

    Args:
        problem: The problem.
        engine: 'auto', 'python' or 'native'; 'auto' is native where a compiler is found.
        designs: How many are solved, roughly.
        workers: Number of processes; None: one for each core.

    Raises:
        RequestError: `workers` is not a positive whole number.

    """

    def __init__(self, problem: FitProblem, engine: str, designs: int, workers: int | None) -> None:
        if workers is not None and not (isinstance(workers, int) and workers > 0):
            raise RequestError(f"workers = {workers!r} must be a positive whole number")
        self.equations = _equations_of(problem, engine, designs)
        self.workers = workers or cores()
        self._pool: ProcessPoolExecutor | None = None

    def __enter__(self) -> Team:
        if self.workers > 1:
            self._pool = ProcessPoolExecutor(
                self.workers,
                multiprocessing.get_context("spawn"),
                initializer=_join,
                initargs=(self.equations.problem, self.equations.engine),
            )
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._pool is not None:
            self._pool.shutdown(wait=kind is None, cancel_futures=True)

    def results(self, task: Task, starts: Sequence[FloatArray], advance: Advance) -> list[Found]:
        """Return what a task gives for each start, in order."""
        found = []
        for one in self._each(task, starts):
            found.append(one)
            advance(one.tried)
        return found

    def _each(self, task: Task, starts: Sequence[FloatArray]) -> Iterator[Found]:
        if self._pool is None:
            return (_done(self.equations, task, z) for z in starts)
        chunk = max(1, len(starts) // (8 * self.workers))
        return self._pool.map(_work, [task] * len(starts), starts, chunksize=chunk)


def _equations_of(problem: FitProblem, engine: str, designs: int) -> Equations:
    """Return the equations with an engine that works on this machine; 'auto': native where that pays for compiling."""
    if engine == "python" or (engine == "auto" and _in_python(problem) * designs < WORTH):
        return Equations(problem, "python")
    equations = Equations(problem, "native")
    try:
        equations.at(np.full(len(problem.bounds), 0.5))
    except NotAssembledError:
        pass
    except CompilerError:
        if engine == "native":
            raise
        return Equations(problem, "python")
    return equations


def _in_python(problem: FitProblem) -> float:
    """Return the time of a design in Python [s], roughly; samples far apart take longer than those of a motion."""
    timed = sum(len(target.wanted) for target in problem.sampled)
    untimed = sum(SAMPLES for target in problem.sampled if not target.is_timed)
    return 5e-4 + 6e-5 * timed + 8e-6 * untimed + (0.02 if problem.measuring else 0.0)


def _join(problem: FitProblem, engine: str) -> None:
    """Begin the work of a process."""
    global _equations
    _equations = Equations(problem, engine)


def _work(task: Task, z: FloatArray) -> Found:
    return _done(_equations, task, z)


def _done(equations: Equations, task: Task, z: FloatArray) -> Found:
    if task != "draw":
        return search(equations, z, _EFFORTS[task])
    try:
        return Found(z, equations.at(z)[0].total, 1)
    except NotAssembledError as reason:
        return Found(None, np.inf, 1, {str(reason): 1})
