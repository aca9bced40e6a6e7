"""CasADi: its rootfinder on the constraint equations of all coordinates, the sweep mapped in its virtual machine."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from benchmarks.case import Case, Motion
from benchmarks.engine import BenchEngine, EngineSetting, Sampler
from kinfmu.errors import MissingPackageError
from kinfmu.mechanism.quantities import arithmetic

FINEST = 1e-13


def _sampler(case: Case, setting: EngineSetting) -> Sampler:
    """Return a sampler: `fast_newton` from the last pose, rates by linear solves; tolerance: `abstol`."""
    try:
        import casadi
    except ImportError:
        raise MissingPackageError("CasADi is not installed: pip install 'kinfmu[bench]'") from None
    for function in ("sin", "cos", "sqrt"):
        getattr(arithmetic, function).register(casadi.SX, getattr(casadi, function))
    system = case.system
    step = _step(casadi, case, setting.tolerance)
    start = casadi.DM(case.start_coordinates)
    chosen = [system.coordinates.index(name) for name in case.columns]
    wanted = [k * len(system.coordinates) + c for k in range(3) for c in chosen]
    driven = [casadi.DM(np.array(table).T) for table in (case.u, case.ud, case.udd)]
    swept = cache(lambda n: step.mapaccum(n))

    def take(n: int) -> Motion:
        _, rows = swept(n)(start, *(table[:, :n] for table in driven))
        found: Any = np.array(rows)
        return list(found[wanted].T)

    return take


def _step(casadi: Any, case: Case, tolerance: float) -> Any:
    """Return (q, u, ud, udd) -> (q, [q, qd, qdd]), a sample from the last pose."""
    system = case.system
    n, d = len(system.coordinates), len(system.mechanism.drivers)
    q, u, ud, udd, qd = (casadi.SX.sym(name, k) for name, k in (("q", n), ("u", d), ("ud", d), ("udd", d), ("qd", n)))
    phi = system.evaluate(casadi.vertsplit(q), casadi.vertsplit(u))
    phi = casadi.vertcat(*(phi[k] / (system.rows[k].scale * system.size) for k in case.rows))
    jacobian, by_driver = casadi.jacobian(phi, q), casadi.jacobian(phi, u)
    where, rate = casadi.vertcat(q, u), casadi.vertcat(qd, ud)
    second = casadi.jtimes(casadi.jtimes(phi, where, rate), where, rate)
    velocity = casadi.Function("velocity", [q, u, ud], [casadi.solve(jacobian, -by_driver @ ud)])
    acceleration = casadi.Function(
        "acceleration", [q, u, ud, udd, qd], [casadi.solve(jacobian, -second - by_driver @ udd)]
    )
    options = {"abstol": tolerance, "max_iter": 50, "error_on_fail": False}
    position = casadi.rootfinder("position", "fast_newton", {"x": q, "p": u, "g": phi}, options)
    last, at, speed, more = (casadi.MX.sym(name, k) for name, k in (("last", n), ("u", d), ("ud", d), ("udd", d)))
    here = position(x0=last, p=at)["x"]
    moving = velocity(here, at, speed)
    everything = casadi.vertcat(here, moving, acceleration(here, at, speed, more, moving))
    return casadi.Function("step", [last, at, speed, more], [here, everything])


CASADI = BenchEngine(
    "CasADi",
    _sampler,
    settings=tuple(EngineSetting(0, tolerance) for tolerance in (1e-3, 1e-6, 1e-9, FINEST)),
    usual=EngineSetting(0, FINEST),
)
