"""kinfmu as shipped: generated code and a Solver, which stays on the branch and bridges singular points."""

from __future__ import annotations

from benchmarks.case import Case, Motion
from benchmarks.engine import GAP, BenchEngine, EngineSetting, Sampler
from kinfmu.codegen.python import load_model
from kinfmu.solver.python import Solver


def _sampler(case: Case, _setting: EngineSetting) -> Sampler:
    """Return a sampler with the solver of `kinfmu.solve` and of the FMU, with its step control."""
    solver = Solver(load_model(case.plan))
    start = solver.solve(solver.anchor, case.u[0])
    gap = (GAP,) * (3 * len(case.columns))
    samples = list(zip(case.u, case.ud, case.udd, strict=True))

    def take(n: int) -> Motion:
        pose, rows = start, []
        for u, ud, udd in samples[:n]:
            found = solver.solve(pose, u)
            if found.good:
                pose = found
                rows.append(solver.motion(pose, ud, udd))
            else:
                rows.append(gap)
        return rows

    return take


SHIPPED = BenchEngine("kinfmu", _sampler)
