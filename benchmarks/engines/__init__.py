"""Engines that the bench measures side by side: one a file.

A new one is a file, a line here and a look in benchmarks/charts.py; tables and charts pick it up.
"""

from __future__ import annotations

from benchmarks.engines.casadi_newton import CASADI
from benchmarks.engines.generated import GENERATED
from benchmarks.engines.kimech_joints import KIMECH
from benchmarks.engines.native import NATIVE
from benchmarks.engines.numpy_newton import NUMPY_NEWTON
from benchmarks.engines.pylinkage_dyads import PYLINKAGE
from benchmarks.engines.readable import READABLE
from benchmarks.engines.scipy_fsolve import FSOLVE
from benchmarks.engines.shipped import SHIPPED

ENGINES = (SHIPPED, NATIVE, GENERATED, NUMPY_NEWTON, READABLE, FSOLVE, CASADI, PYLINKAGE, KIMECH)

__all__ = [
    "CASADI",
    "ENGINES",
    "FSOLVE",
    "GENERATED",
    "KIMECH",
    "NATIVE",
    "NUMPY_NEWTON",
    "PYLINKAGE",
    "READABLE",
    "SHIPPED",
]
