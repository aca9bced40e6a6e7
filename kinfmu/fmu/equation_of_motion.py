"""Accelerations of the drivers of a pose under efforts. The FMU has a copy: standard library only.

    J(u) udd = T - bias(u, ud)        u: driver values, T: efforts, J: reduced inertia

J and the bias efforts come from one motion with accelerations of 0 and from the rates at unit speeds, which on a bridge
are interpolated where the blocks are singular.
"""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import NamedTuple

from ..solver.python import Pose, Solver
from ..solver.python.linear import factor, lu_solve
from ..solver.python.tracks import sample_rates
from .slave.layout import Numbers


class Given(NamedTuple):
    """What the host sets: efforts of the drivers, efforts of external loads, and parameters."""

    efforts: Numbers
    loads: Numbers
    parameters: Numbers


class EquationOfMotion:
    """The equation of motion of a mechanism in its drivers.

    Args:
        inertia: Emitted; gives bias efforts, then the upper triangle of J, row by row.
        in_si: Units of the drivers in SI units.

    """

    def __init__(self, inertia: Callable[..., Numbers], in_si: Numbers) -> None:
        self._inertia, self._in_si = inertia, in_si

    def accelerations(self, solver: Solver, pose: Pose, t: float, ud: Numbers, given: Given) -> Numbers | None:
        """Return the accelerations of the drivers at a good pose; None where reduced inertias do not determine them."""
        d, efforts = len(ud), given.efforts
        try:
            found = self._found(solver, pose, t, ud, given)
            if d == 1:
                udd: Numbers = ((efforts[0] - found[0]) / found[1] / self._in_si[0],) if found[1] > 0.0 else ()
            else:
                udd = self._solved(found, [effort - bias for effort, bias in zip(efforts, found[:d], strict=True)])
        except (ArithmeticError, ValueError):  # a singular matrix, or a load without a value
            return None
        return udd if udd and isfinite(sum(udd)) else None

    def _solved(self, found: Numbers, right: list[float]) -> Numbers:
        """Return J^-1 b in the units of the drivers."""
        d = len(right)
        matrix = [[0.0] * d for _ in range(d)]
        entries = iter(found[d:])
        for k in range(d):
            for j in range(k, d):
                matrix[k][j] = matrix[j][k] = next(entries)
        if not all(matrix[k][k] > 0.0 for k in range(d)):
            return ()
        return tuple([one / si for one, si in zip(lu_solve(factor(matrix), right), self._in_si, strict=True)])

    def massless(self, solver: Solver, pose: Pose, t: float, ud: Numbers, given: Given) -> int:
        """Return the place of the first driver without reduced inertia at a good pose, or 0."""
        found, d = self._found(solver, pose, t, ud, given), len(ud)
        place = d  # of the diagonal
        for k in range(d):
            if not found[place] > 0.0:
                return k
            place += d - k
        return 0

    def _found(self, solver: Solver, pose: Pose, t: float, ud: Numbers, given: Given) -> Numbers:
        rest = (0.0,) * len(ud)
        zd, zdd, slopes = sample_rates(solver.model, pose, ud, rest)
        return self._inertia(t, pose.u, ud, rest, pose.z, zd, zdd, slopes, given.loads, given.parameters)
