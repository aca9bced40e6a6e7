"""Dimensional synthesis: parameters with which a mechanism follows paths, functions, poses or measures.

problem (targets, unknowns, constraints) -> equations (residuals, Jacobian) -> search from many starts -> result
"""

from __future__ import annotations

from kinfmu.design.fit.fit import fit
from kinfmu.design.fit.outcome import Optimum
from kinfmu.design.fit.problem import FitProblem, read_problem
from kinfmu.design.fit.result import FitResult
from kinfmu.design.fit.targets import (
    FunctionTarget,
    GrashofConstraint,
    MarginConstraint,
    MeasureConstraint,
    MeasureTarget,
    PathTarget,
    PoseTarget,
)

__all__ = [
    "FitProblem",
    "FitResult",
    "FunctionTarget",
    "GrashofConstraint",
    "MarginConstraint",
    "MeasureConstraint",
    "MeasureTarget",
    "Optimum",
    "PathTarget",
    "PoseTarget",
    "fit",
    "read_problem",
]
