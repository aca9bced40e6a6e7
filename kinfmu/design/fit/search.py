"""Least squares from one start, and the starts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.design.fit.constraint_results import constraint_results
from kinfmu.design.fit.equations import Equations, Evaluation, NotAssembledError
from kinfmu.design.fit.problem import FitProblem


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
