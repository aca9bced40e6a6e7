"""The equation of motion of a mechanism in its drivers, at a pose and along a course of poses.

    J(u) udd = T - bias(u, ud)        u: driver values, T: efforts, J: reduced inertia

J and the bias efforts come from one motion with accelerations of 0 and from the rates at unit speeds, which on a bridge
are interpolated where the blocks are singular.
"""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import NamedTuple

from ..pose import Pose, Vector
from ..solver import Solver
from ..tracks import sample_rates


class Given(NamedTuple):
    """What the host sets: efforts of the drivers, efforts of external loads, and parameters."""

    efforts: Vector
    loads: Vector
    parameters: Vector


class EquationOfMotion:
    """The equation of motion of a mechanism in its drivers.

    Args:
        inertia: Emitted; gives bias efforts, then the upper triangle of J, row by row.
        in_si: Units of the drivers in SI units.

    """

    def __init__(self, inertia: Callable[..., Vector], in_si: Vector) -> None:
        self._inertia, self._in_si = inertia, in_si

    def accelerations(self, solver: Solver, pose: Pose, t: float, ud: Vector, given: Given) -> Vector | None:
        """Return the accelerations of the drivers at a good pose; None where reduced inertias do not determine them."""
        d, efforts = len(ud), given.efforts
        try:
            numbers = self._numbers(solver, pose, t, ud, given)
            if d == 1:
                udd: Vector = ((efforts[0] - numbers[0]) / numbers[1] / self._in_si[0],) if numbers[1] > 0.0 else ()
            else:
                udd = self._solved(numbers, [effort - bias for effort, bias in zip(efforts, numbers[:d], strict=True)])
        except (ArithmeticError, ValueError):  # a singular matrix, or a load without a value
            return None
        return udd if udd and isfinite(sum(udd)) else None

    def _solved(self, numbers: Vector, x: list[float]) -> Vector:
        """Return J^-1 x in the units of the drivers, by L D L^T; empty if a pivot, an inertia, is not positive."""
        d = len(x)
        entries = iter(numbers[d:])
        rows = [[next(entries) for _ in range(k, d)] for k in range(d)]
        for k, row in enumerate(rows):
            if not row[0] > 0.0:
                return ()
            for j in range(1, d - k):
                ratio, below = row[j] / row[0], rows[k + j]
                for i in range(j, d - k):
                    below[i - j] -= ratio * row[i]
                x[k + j] -= ratio * x[k]
        for k in range(d - 1, -1, -1):
            row = rows[k]
            for j in range(1, d - k):
                x[k] -= row[j] * x[k + j]
            x[k] /= row[0]
        return tuple([udd / si for udd, si in zip(x, self._in_si, strict=True)])

    def massless(self, solver: Solver, pose: Pose, t: float, ud: Vector, given: Given) -> list[int]:
        """Return the places of the drivers without reduced inertia at a good pose."""
        numbers, d = self._numbers(solver, pose, t, ud, given), len(ud)
        diagonal = [d + k * d - k * (k - 1) // 2 for k in range(d)]
        return [k for k, place in enumerate(diagonal) if not numbers[place] > 0.0]

    def _numbers(self, solver: Solver, pose: Pose, t: float, ud: Vector, given: Given) -> Vector:
        rest = (0.0,) * len(ud)
        zd, zdd, slopes = sample_rates(solver.model, pose, ud, rest)
        return self._inertia(t, pose.u, ud, rest, pose.z, zd, zdd, slopes, given.loads, given.parameters)


class StepEnd(NamedTuple):
    """One end of a step: time, values and speeds of the drivers, their derivatives, and the pose."""

    t: float
    y: Vector
    f: Vector
    pose: Pose


class Course:
    """The derivative of a state, whose pose is followed from the last good one.

    Args:
        solver: Gives the poses.
        accelerations: Those of the drivers at a time, a good pose and speeds; None where they are not determined.

    Attributes:
        here: The last good pose.
        refused: The last pose that was not reached; None: all were.

    """

    def __init__(self, solver: Solver, accelerations: Callable[[float, Pose, Vector], Vector | None]) -> None:
        self.solver, self._accelerations = solver, accelerations
        self.reach: Vector = solver.model.REACH
        self.here = solver.anchor
        self.refused: Pose | None = None
        self.low = self.high = 0.0  # times between which the laws are read

    def follow(self, u: Vector) -> Pose | None:
        """Return the pose at driver values; None where it is not reached."""
        pose = self.solver.solve(self.here, u)
        if not pose.good:
            self.refused = pose
            return None
        self.here = pose
        return pose

    def derive(self, t: float, y: Vector) -> Vector | None:
        """Return the derivative of a state at a time; None where it has none."""
        d = len(self.reach)
        pose = self.follow(y[:d])
        if pose is None:
            return None
        udd = self._accelerations(min(max(t, self.low), self.high), pose, y[d:])
        return None if udd is None else (*y[d:], *udd)

    def complete(self, t: float, y: Vector) -> StepEnd | None:
        """Return a state as the end of a step; None where it has no derivative."""
        f = self.derive(t, y)
        return None if f is None else StepEnd(t, y, f, self.here)
