"""A team of processes that search from many starts; the results do not depend on their number."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from typing import Literal

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.design.fit.argument import SAMPLES
from kinfmu.design.fit.equations import Equations, NotAssembledError
from kinfmu.design.fit.problem import FitProblem
from kinfmu.design.fit.search import FINE, LONG, SHORT, Found, found_at, search
from kinfmu.errors import CompilerError
from kinfmu.processes import cores, processes, require_workers, without_main

Task = Literal["draw", "short", "long", "fine"]
Advance = Callable[[int], None]
WORTH = 2.0  # [s] in Python, from which compiling pays
_EFFORTS = {"short": SHORT, "long": LONG, "fine": FINE}
_equations: Equations  # of a process of the team


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
        if workers is None:
            workers = cores()
        require_workers(workers)
        self.equations = _equations_of(problem, engine, designs)
        self.workers = workers
        self._pool: Executor | None = None

    @contextmanager
    def working(self) -> Iterator[Team]:
        """Start the processes, and end them with the block.

        Raises:
            WorkerLostError: A process ended unexpectedly.

        """
        if self.workers == 1:
            yield self
            return
        with processes(self.workers, _join, self.equations.problem, self.equations.engine) as self._pool:
            yield self

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
        with without_main():
            return self._pool.map(_work, [(task, self.equations.scale)] * len(starts), starts, chunksize=chunk)


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


def _work(work: tuple[Task, float], z: FloatArray) -> Found:
    task, _equations.scale = work
    return _done(_equations, task, z)


def _done(equations: Equations, task: Task, z: FloatArray) -> Found:
    if task != "draw":
        return search(equations, z, _EFFORTS[task])
    try:
        return found_at(equations, z)
    except NotAssembledError as reason:
        return Found(None, np.inf, 1, refused={str(reason): 1})
