"""Engines that the bench measures side by side: one a file.

A new one is a file, a line here and a look in bench/pictures.py; tables and charts pick it up.
"""

from __future__ import annotations

from kinfmu.bench.engines.casadi_newton import Casadi
from kinfmu.bench.engines.dense import Dense
from kinfmu.bench.engines.engine import Engine, Sampler
from kinfmu.bench.engines.generated import Generated
from kinfmu.bench.engines.native import Native
from kinfmu.bench.engines.numpy_newton import NumpyNewton
from kinfmu.bench.engines.pylinkage_dyads import Pylinkage
from kinfmu.bench.engines.scipy_fsolve import Fsolve
from kinfmu.bench.engines.shipped import Shipped

ENGINES: tuple[Engine, ...] = (
    Shipped(),
    Native(),
    Generated(),
    NumpyNewton(),
    Dense(),
    Fsolve(),
    Casadi(),
    Pylinkage(),
)

__all__ = [
    "ENGINES",
    "Casadi",
    "Dense",
    "Engine",
    "Fsolve",
    "Generated",
    "Native",
    "NumpyNewton",
    "Pylinkage",
    "Sampler",
    "Shipped",
]
