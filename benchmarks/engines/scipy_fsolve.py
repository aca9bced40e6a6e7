"""What an engineer writes: scipy's fsolve on the closure equations, from the last pose, and the rates by linear solves.

The equations are those of the generated code, in the unknown angles alone, so that only the solver differs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import chain
from typing import Any

from benchmarks.case import Case, Motion
from benchmarks.engine import GAP, BenchEngine, EngineSetting, Sampler
from kinfmu.codegen.python import load_model
from kinfmu.mechanism import Parameter
from kinfmu.plan import compile_plan
from kinfmu.solver.python.pose import evaluated

DEFAULT = 1.49012e-8  # default xtol of fsolve
FINEST = 1e-15
UNREAD = "unread"  # a parameter on which nothing depends: only models with parameters have a function of residuals


@lru_cache(maxsize=1)
def _distinct(case: Case) -> Any:
    """Return the generated model of a case, with a function that gives its residuals."""
    mechanism = case.mechanism
    distinct = replace(mechanism, parameters={**mechanism.parameters, UNREAD: Parameter(1.0)})
    return load_model(compile_plan(distinct, case.columns))


def _sampler(case: Case, setting: EngineSetting) -> Sampler:
    """Return a sampler: MINPACK's hybrid method with its own difference quotients; the tolerance is `xtol`."""
    from scipy.optimize import fsolve

    model = _distinct(case)
    alone = len(case.u[0]) == 1
    gap = (GAP,) * (3 * len(case.columns))
    samples = list(zip(case.u, case.ud, case.udd, strict=True))

    def closure(z: Sequence[float], u: tuple[float, ...]) -> list[float]:
        return list(chain.from_iterable(model.residuals(evaluated(model, u, tuple(z))[-1])))

    def take(n: int) -> Motion:
        z, rows = case.start.z, []
        for u, ud, udd in samples[:n]:
            found, *_ = fsolve(closure, z, (u,), xtol=setting.tolerance, full_output=True)
            z = tuple(found.tolist())
            try:
                values = evaluated(model, u, z)[-1]
                if alone:
                    rows.append(model.first_motion(values, ud, udd)[1])
                else:
                    first = model.velocity(values, ud)
                    rows.append(model.motion(values, ud, udd, first, model.acceleration(values, ud, udd, first)))
            except ArithmeticError:  # exactly singular: there are no rates
                rows.append(gap)
        return rows

    return take


FSOLVE = BenchEngine(
    "scipy fsolve",
    _sampler,
    settings=tuple(EngineSetting(0, xtol) for xtol in (1e-3, 1e-6, DEFAULT, 1e-11, FINEST)),
    usual=EngineSetting(0, DEFAULT),
)
