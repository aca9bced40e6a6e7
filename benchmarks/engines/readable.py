"""The readable reference: the method as the book writes it, over all coordinates, in every setting of Newton."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.case import Case, Motion
from benchmarks.engine import GAP, ROUND_OFF, BenchEngine, EngineSetting, Sampler
from kinfmu.arrays import FloatArray
from kinfmu.errors import PoseError
from kinfmu.plan.equations.reference import Solution
from kinfmu.plan.equations.system import System

FLOOR = 1e-14  # residual relative to the size at which kinfmu.plan.equations.reference stops
MOST = 60  # iterations


def _sampler(case: Case, setting: EngineSetting) -> Sampler:
    """Return a sampler: Newton and two linear solves with numpy on the rows kept, as in `equations.reference`."""
    system, rows, q0 = case.system, case.rows, case.start_coordinates
    chosen = [system.coordinates.index(name) for name in case.columns]
    gap = (GAP,) * (3 * len(chosen))
    u, ud, udd = (np.array(table) for table in (case.u, case.ud, case.udd))  # (n, d) each

    def take(n: int) -> Motion:
        last, last_t = Solution(q0, 0.0 * q0, 0.0 * q0, 0), case.t[0]
        motion: list[Sequence[float]] = []
        for k, t in enumerate(case.t[:n]):
            q = _predicted(last, t - last_t, setting.predictor)
            try:
                last = solved(system, rows, q, u[k], ud[k], udd[k], setting)
            except (PoseError, np.linalg.LinAlgError):  # go on from the last pose
                motion.append(gap)
                continue
            last_t = t
            motion.append([*last.q[chosen], *last.qd[chosen], *last.qdd[chosen]])
        return motion

    return take


def solved(
    system: System,
    rows: Sequence[int],
    q: FloatArray,
    u: FloatArray,
    ud: FloatArray,
    udd: FloatArray,
    setting: EngineSetting,
) -> Solution:
    """Return one sample, solved from a predicted pose; at round-off it is that of `equations.reference`.

    Args:
        system: The equations.
        rows: Numbers of the rows to solve.
        q: (n,) predicted pose.
        u: (d,) driver values.
        ud: (d,) their rates.
        udd: (d,) their accelerations.
        setting: Tolerance, or number of corrections, and chord or full Newton.

    Raises:
        PoseError: Newton's method does not converge.
        LinAlgError: The Jacobian is singular.

    """
    chosen = list(rows)
    bound = max(setting.tolerance, FLOOR) * system.size
    jacobian: FloatArray | None = None
    for iteration in range(MOST):
        residual = system.residual(q, u)[chosen]
        if not np.isfinite(residual).all():
            break
        if np.abs(residual).max() <= bound if setting.corrections is None else iteration == setting.corrections:
            jacobian = system.jacobian(q)[chosen]
            qd = np.asarray(np.linalg.solve(jacobian, system.nu(q, u, ud)[chosen]), dtype=float)
            qdd = np.asarray(np.linalg.solve(jacobian, system.gamma(q, qd, u, ud, udd)[chosen]), dtype=float)
            return Solution(q, qd, qdd, iteration)
        if jacobian is None or not setting.chord:
            jacobian = system.jacobian(q)[chosen]
        q = q + np.linalg.solve(jacobian, -residual)
    raise PoseError(f"Newton did not converge: residual {np.abs(residual).max():.2g}")


def _predicted(last: Solution, h: float, order: int) -> FloatArray:
    """Return q + h qd + h^2 qdd / 2 up to the term of this order."""
    terms = (last.q, h * last.qd, 0.5 * h * h * last.qdd)
    return np.asarray(sum(terms[1 : order + 1], start=terms[0]))


READABLE = BenchEngine(
    "readable reference",
    _sampler,
    settings=tuple(
        setting
        for order in range(3)
        for setting in (
            *(EngineSetting(order, corrections=n) for n in range(4) if order + n > 0),
            *(EngineSetting(order, tolerance) for tolerance in (1e-3, 1e-9, ROUND_OFF)),
            *(EngineSetting(order, corrections=n, chord=True) for n in (2, None)),
        )
    ),
)
