"""fit(): parameters with which a mechanism does what its targets ask."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.design.fit.angle_notes import angle_notes
from kinfmu.design.fit.fit_file import read_problem
from kinfmu.design.fit.outcome import Optimum
from kinfmu.design.fit.problem import FitProblem
from kinfmu.design.fit.result import FitResult, result_of
from kinfmu.design.fit.search import Found, Sameness, distinct, start_points
from kinfmu.design.fit.team import Team
from kinfmu.errors import AssemblyError, RequestError
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
