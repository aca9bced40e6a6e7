"""The benchmark of 18 timed points, crank angles 20 degrees apart (Kunjur and Krishnamurty 1997, and many others)."""

from __future__ import annotations

import kinfmu
from kinfmu.design.fit import PathTarget
from kinfmu.mechanism import Mechanism
from tests.design.fit.fourbars import with_parameters

BEST = 0.009028884630975  # sum of squares of the best optimum found; the best published one is 0.0091150
X = (0.5, 0.4, 0.3, 0.2, 0.1, 0.05, 0.02, 0.0, 0.0, 0.03, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.6)
Y = (1.1, 1.1, 1.1, 1.0, 0.9, 0.75, 0.6, 0.5, 0.4, 0.3, 0.25, 0.2, 0.3, 0.4, 0.5, 0.7, 0.9, 1.0)
BOUNDS = {
    **dict.fromkeys(("x", "y", "px", "py"), (-2.0, 2.0)),
    **dict.fromkeys(("gx", "gy"), (-4.0, 4.0)),
    **dict.fromkeys(("coupler", "rocker"), (0.1, 4.0)),
    "crank": (0.05, 1.5),
}
WRITTEN = {
    "x": 0.0, "y": 0.0, "px": 0.4, "py": 0.4, "gx": 1.0, "gy": 0.0, "coupler": 0.9, "rocker": 0.8, "crank": 0.3,
}  # fmt: skip


NEAR = {
    "x": 0.27, "y": 0.15, "px": 0.37, "py": 0.4, "gx": 1.01, "gy": 0.3, "coupler": 0.91, "rocker": 0.6, "crank": 0.42,
}  # fmt: skip


def mkh1(within: float | None = None) -> kinfmu.FitProblem:
    """Return the problem; within: bounds about the best optimum, in place of wide ones."""
    bounds = BOUNDS if within is None else {name: (value - within, value + within) for name, value in NEAR.items()}
    path = PathTarget(
        name="curve", of="coupler.X", points=list(zip(X, Y, strict=True)), step="20 deg", start=(0, "360 deg")
    )
    return kinfmu.FitProblem(_mechanism(WRITTEN if within is None else NEAR), bounds, [path])


def _mechanism(lengths: dict[str, float]) -> Mechanism:
    return with_parameters("mkh1", 'O = ["x", "y"], C = ["x + gx", "y + gy"]', lengths)
