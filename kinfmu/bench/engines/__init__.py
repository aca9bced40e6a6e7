"""Engines that the bench measures side by side: one a file.

A new one is a file, a line here and a look in bench/charts.py; tables and charts pick it up.
"""

from __future__ import annotations

from kinfmu.bench.engines.casadi_newton import CASADI
from kinfmu.bench.engines.generated import GENERATED
from kinfmu.bench.engines.native import NATIVE
from kinfmu.bench.engines.numpy_newton import NUMPY_NEWTON
from kinfmu.bench.engines.pylinkage_dyads import PYLINKAGE
from kinfmu.bench.engines.readable import READABLE
from kinfmu.bench.engines.scipy_fsolve import FSOLVE
from kinfmu.bench.engines.shipped import SHIPPED

ENGINES = (SHIPPED, NATIVE, GENERATED, NUMPY_NEWTON, READABLE, FSOLVE, CASADI, PYLINKAGE)

__all__ = [
    "CASADI",
    "ENGINES",
    "FSOLVE",
    "GENERATED",
    "NATIVE",
    "NUMPY_NEWTON",
    "PYLINKAGE",
    "READABLE",
    "SHIPPED",
]
