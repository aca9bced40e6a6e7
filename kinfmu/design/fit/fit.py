"""fit(): parameters with which a mechanism does what its targets ask, by searches from many starts."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.design.fit.argument import SAMPLES
from kinfmu.design.fit.equations import Equations, Evaluation, NotAssembledError
from kinfmu.design.fit.outcome import Optimum, constraint_results
from kinfmu.design.fit.problem import FitProblem, read_problem
from kinfmu.design.fit.result import FitResult, result_of
from kinfmu.design.fit.text import angle_notes
from kinfmu.errors import AssemblyError, CompilerError, RequestError
from kinfmu.processes import cores, processes, require_workers, without_main
from kinfmu.run.engine import require_engine

STARTS = 16
_DRAWN, _SHORT = 16, 3  # designs that are drawn, and short searches, for each whole search
_DESIGNS = 110  # that are solved for each whole search, roughly
_POLISHED = 8  # optima that are computed to round-off
Progress = Callable[[int, int], None]  # done, of


def fit(
    problem: FitProblem | str | Path,
    *,
    starts: int = STARTS,
    seed: int = 0,
    workers: int | None = 1,
    engine: str = "auto",
    progress: Progress | None = None,
) -> FitResult:
    """Find parameters with which a mechanism does what its targets ask.

    Nonlinear least squares within bounds (`scipy.optimize.least_squares`, trust region reflective) with exact
    Jacobians, from many starts: 16 designs are drawn for each start (Sobol points, and the mechanism as written). Short
    searches of at most 12 designs begin at the best of them, three for each start, and whole searches at the best of
    these. The optima are computed to round-off.

    All designs are reached by continuation from the mechanism as written, so that they have its assembly. A design
    that cannot be assembled, or does not reach a sample, is never judged by numbers of another geometry: it counts as
    infinitely bad, and the result states how many there were.

    Args:
        problem: The problem, or the path of a fit file (.toml).
        starts: Number of whole searches.
        seed: Seed of the Sobol points.
        workers: Number of processes; None: one for each core. The result does not depend on it.
        engine: 'python'; 'native', generated C; or 'auto', native where a compiler is found.
        progress: Called with the number of steps done, and of all.

    Returns:
        The best mechanism, its errors, and the local optima found.

    Raises:
        RequestError: An argument is invalid.
        MechanismError: The problem is invalid; the message states file, table and key.
        AssemblyError: None of the designs drawn can be assembled and reaches all samples.
        KinfmuError: A process ended unexpectedly.

    """
    require_engine(engine)
    if not (isinstance(starts, int) and starts > 0):
        raise RequestError(f"starts = {starts!r} must be a positive whole number")
    if not (isinstance(seed, int) and seed >= 0):
        raise RequestError(f"seed = {seed!r} must be a whole number, 0 or above")
    if not isinstance(problem, FitProblem | str | Path):
        raise RequestError(f"fit needs a FitProblem or the path of a fit file, not {type(problem).__name__}")
    if not isinstance(problem, FitProblem):
        problem = read_problem(problem)
    steps = (_DRAWN + _SHORT + 1) * starts + _POLISHED
    done, tried, refused = 0, 0, Counter[str]()

    def advance(designs: int) -> None:
        nonlocal done, tried
        done, tried = done + 1, tried + designs
        if progress is not None:
            progress(done, steps)

    with Team(problem, engine, _DESIGNS * starts, workers).working() as team:
        drawn = team.results("draw", list(start_points(problem, _DRAWN * starts, seed)), advance)
        for one in drawn:
            refused.update(one.refused)
        if not np.isfinite([one.total for one in drawn]).any():
            reason, count = refused.most_common(1)[0]
            raise AssemblyError(
                f"none of {len(drawn)} designs within the bounds can be assembled and reaches all samples; "
                f"the reason of {count}: {reason}{''.join(f'; {text}' for text in angle_notes(problem))}"
            )
        typical = float(np.median([one.squares for one in drawn if np.isfinite(one.total)]))
        team.equations.scale = math.sqrt(typical) or 1.0
        scale = team.equations.scale**2  # that of the draws was 1
        drawn = [
            replace(one, total=one.squares + scale * (one.total - one.squares)) for one in drawn if one.z is not None
        ]
        short = team.results("short", _best(drawn, _SHORT * starts), advance)
        long = team.results("long", _best(short, starts), advance)
        same = Sameness(problem.turns, typical)
        ends = distinct([(one, 1) for one in long], same)
        polished = team.results("fine", [one.z for one, _ in ends[:_POLISHED] if one.z is not None], advance)
        for one in (*short, *long, *polished):
            refused.update(one.refused)
        if progress is not None:
            progress(steps, steps)
        counts = [count for _, count in ends]
        best = distinct([*zip(polished, counts, strict=False), *ends[_POLISHED:]], same, by_constraints=True)
        optima = tuple(
            Optimum(problem.vector(one.z), one.squares, one.total, count, one.holds)
            for one, count in best
            if one.z is not None
        )
        return result_of(team.equations, optima, tried, refused)


def _best(found: list[Found], count: int) -> list[FloatArray]:
    """Return the unknowns of those with the smallest sums, best first."""
    ranked = sorted(found, key=lambda one: one.total)
    return [one.z for one in ranked if one.z is not None][:count]


class Effort(NamedTuple):
    """When a search ends.

    tolerance: Relative change of the sum of squares, and of the unknowns; most: Number of designs that are tried.
    """

    tolerance: float
    most: int


_ROUNDS = 20  # most of the method of multipliers
SHORT, LONG, FINE = Effort(1e-6, 12), Effort(1e-6, 150), Effort(1e-15, 300)


@dataclass(frozen=True, eq=False)
class Found:
    """Where a search ended.

    Attributes:
        z: (n,) the unknowns as parts of their ranges; None: the start cannot be assembled.
        total: Sum of squares with penalties.
        tried: Number of designs.
        squares: Sum of squares of the targets.
        holds: Whether the constraints hold.
        refused: How often designs could not be assembled or did not reach a sample, by reason.

    """

    z: FloatArray | None
    total: float
    tried: int
    squares: float = np.inf
    holds: bool = True
    refused: Mapping[str, int] = field(default_factory=dict)


def start_points(problem: FitProblem, count: int, seed: int) -> FloatArray:
    """Return points (count, n) of a scrambled Sobol sequence; the first one is the mechanism as written.

    Unknowns that have no value as written, such as a free start, keep that of the sequence.
    """
    from scipy.stats.qmc import Sobol

    size = 1 << max(0, (count - 1).bit_length())  # Sobol points balance in powers of two
    points = np.asarray(Sobol(len(problem.bounds), scramble=True, rng=seed).random(size)[:count])
    for k, ((low, high), value) in enumerate(zip(problem.bounds.values(), problem.written().values(), strict=True)):
        if value is not None:
            points[0, k] = (value - low) / (high - low)
    return points


def search(equations: Equations, z: FloatArray, effort: Effort) -> Found:
    """Return where least squares from a start ends (trust region reflective; Branch, Coleman and Li 1999).

    A design that cannot be assembled counts as infinitely bad: the step is refused and a shorter one is tried, so that
    the search never goes on from a geometry that does not exist.
    """
    from scipy.optimize import least_squares

    refused: Counter[str] = Counter()
    last: dict[str, tuple[bytes, Evaluation, FloatArray]] = {}
    tried, count = 0, 1

    def residuals(z: FloatArray) -> FloatArray:
        nonlocal tried, count
        tried += 1
        try:
            found, jacobian = equations.at(z)
        except NotAssembledError as reason:
            refused[str(reason)] += 1
            return np.full(count, np.inf)
        count = len(found.residuals)
        last["design"] = z.tobytes(), found, jacobian
        return found.residuals

    def jacobian(z: FloatArray) -> FloatArray:
        if "design" not in last or last["design"][0] != z.tobytes():
            residuals(z)
        _, found, known = last["design"]
        return equations.with_measures(z, found, known)

    z = np.clip(z, 1e-9, 1.0 - 1e-9)  # strictly within the bounds
    if not np.isfinite(residuals(z)).all():
        return Found(None, np.inf, tried, refused=refused)
    before = np.full_like(equations.shifts, np.inf)
    try:
        for _ in range(_ROUNDS if effort is FINE else 1):
            last.clear()
            z = least_squares(
                residuals,
                z,
                jac=jacobian,
                bounds=(0.0, 1.0),
                method="trf",
                x_scale="jac",
                ftol=effort.tolerance,
                xtol=effort.tolerance,
                gtol=effort.tolerance,
                max_nfev=effort.most,
            ).x
            found, _ = equations.at(z)
            if not equations.tighten(before, found.violations):
                break
            before = found.violations
    finally:
        equations.relax()
    return found_at(equations, z, tried, refused)


def found_at(equations: Equations, z: FloatArray, tried: int = 1, refused: Mapping[str, int] | None = None) -> Found:
    """Return a design as the end of a search."""
    found, _ = equations.at(z)
    holds = all(one.holds for one in constraint_results(equations.problem, found))
    return Found(z, found.total, tried, found.squares, holds, refused or {})


SAME = 1e-3  # of the ranges of the unknowns, between two ends of a search at one optimum
SAME_TOTAL = 1e-2  # relative; where the sum has a slope at a bound, ends that are so near differ by some 1e-3


class Sameness(NamedTuple):
    """What two ends of searches at one optimum may differ by.

    turns: (n,) whole turns of the unknowns that are angles, as parts of their ranges; inf of others.
    typical: Sum of squares of a design that is far from any optimum.
    """

    turns: FloatArray
    typical: float = 0.0

    def holds(self, one: Found, other: Found) -> bool:
        """Return whether two searches ended at one optimum; angles count without whole turns."""
        if one.z is None or other.z is None:
            return False
        apart, is_angle = np.abs(one.z - other.z), np.isfinite(self.turns)
        turns = self.turns[is_angle]
        apart[is_angle] -= turns * np.round(apart[is_angle] / turns)
        most = SAME_TOTAL * max(one.total, other.total) + SAME**2 * self.typical + 1e-14
        return bool(np.abs(apart).max() <= SAME) and abs(one.total - other.total) <= most


def distinct(
    found: Sequence[tuple[Found, int]], same: Sameness, *, by_constraints: bool = False
) -> list[tuple[Found, int]]:
    """Return optima with the number of searches that ended there, each once, best first.

    by_constraints: Those whose constraints hold precede all others.
    """
    kept: list[tuple[Found, int]] = []
    for one, searches in sorted(found, key=lambda pair: (by_constraints and not pair[0].holds, pair[0].total)):
        for k, (other, count) in enumerate(kept):
            if same.holds(one, other):
                kept[k] = other, count + searches
                break
        else:
            kept.append((one, searches))
    return [pair for pair in kept if pair[0].z is not None]


Task = Literal["draw", "short", "long", "fine"]
Advance = Callable[[int], None]
WORTH = 2.0  # [s] in Python, from which compiling pays
_EFFORTS = {"short": SHORT, "long": LONG, "fine": FINE}
_equations: Equations  # of a process of the team


class Team:
    """Processes that search from many starts, with one worker this process; the results do not depend on their number.

    Raises a RequestError if `workers` is not a positive whole number.

    engine: 'auto', 'python' or 'native'; 'auto' is native where a compiler is found. designs: How many are solved,
    roughly. workers: Number of processes; None: one for each core.
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
        """Start the processes, and end them with the block; raise a WorkerLostError if one ends unexpectedly."""
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
