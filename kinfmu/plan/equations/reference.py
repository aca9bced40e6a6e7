"""The method as the book writes it, dense and with numpy: readable, and the baseline for everything else."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import PoseError
from kinfmu.plan.equations.system import System

_ITERATIONS = 50


class Solution(NamedTuple):
    """All coordinates with their velocities and accelerations, each (n,), and the Newton iterations it took."""

    q: FloatArray
    qd: FloatArray
    qdd: FloatArray
    iterations: int


def solve_reference(
    system: System, rows: Sequence[int], q: FloatArray, u: FloatArray, ud: FloatArray, udd: FloatArray
) -> Solution:
    """Solve one sample: Newton from q, then the two linear solves, over all coordinates. Haug (1989), chapter 3.

        Phi_q dq = -Phi,   Phi_q qd = nu,   Phi_q qdd = gamma

    Args:
        system: The equations.
        rows: As many independent rows as coordinates, by index into System.rows.
        q: Rough pose, (n,).
        u: Driver values, (d,).
        ud: Driver speeds, (d,).
        udd: Driver accelerations, (d,).

    Returns:
        The solution.

    Raises:
        PoseError: Newton does not converge.

    """
    chosen = list(rows)
    q = np.array(q, dtype=float)
    iterations = 0
    while True:
        residual = system.residual(q, u)[chosen]
        jacobian = system.jacobian(q)[chosen]
        if np.abs(residual).max() <= 1e-14 * system.size:
            break
        if iterations == _ITERATIONS:
            raise PoseError(f"Newton did not end: residual {np.abs(residual).max():.2g} after {_ITERATIONS} iterations")
        dq = np.linalg.solve(jacobian, -residual)
        q += dq
        iterations += 1
    qd = np.asarray(np.linalg.solve(jacobian, system.nu(q, u, ud)[chosen]), dtype=float)
    qdd = np.asarray(np.linalg.solve(jacobian, system.gamma(q, qd, u, ud, udd)[chosen]), dtype=float)
    return Solution(q, qd, qdd, iterations)
