"""The Python engine bare: generated code without step control, with each predictor."""

from __future__ import annotations

from benchmarks.case import Case, Motion
from benchmarks.engine import GAP, BenchEngine, EngineSetting, Sampler
from kinfmu.codegen.python import load_model


def _sampler(case: Case, setting: EngineSetting) -> Sampler:
    """Return a sampler: `position` of the generated model from one sample to the next, and its rates."""
    model = load_model(case.plan)
    start = case.start
    alone = len(case.u[0]) == 1
    rest = (0.0,) * len(start.z)
    still = (0.0,) * len(case.u[0])
    gap = (GAP,) * (3 * len(case.columns))
    samples = list(zip(case.u, case.ud, case.udd, strict=True))

    def take(n: int) -> Motion:
        here, z, values, tangent = start.u, start.z, start.values, None
        rows = []
        for u, ud, udd in samples[:n]:
            zd = zdd = rest
            if alone:
                s = u[0] - here[0]
                if setting.predictor:
                    tangent = tangent or model.tangent(values)
                    zd = tangent[0]
                    zdd = tangent[1] if setting.predictor > 1 else rest
            else:
                s, sampler = 1.0, tuple([b - a for a, b in zip(here, u)])  # noqa: B905  one a driver, both
                if setting.predictor:
                    zd = model.velocity(values, sampler)
                    zdd = model.acceleration(values, sampler, still, zd) if setting.predictor > 1 else rest
            try:
                found = model.position(u, z, zd, zdd, s)
                if alone:
                    there, row = model.first_motion(found[-1], ud, udd)
                else:
                    there, first = None, model.velocity(found[-1], ud)
                    second = model.acceleration(found[-1], ud, udd, first)
                    row = model.motion(found[-1], ud, udd, first, second)
            except (ArithmeticError, ValueError):  # diverged: go on from the last pose
                rows.append(gap)
                continue
            here, z, values, tangent = u, found[0], found[-1], there
            rows.append(row)
        return rows

    return take


GENERATED = BenchEngine("generated Python", _sampler, tuple(EngineSetting(order) for order in range(3)))
