"""Dimensional synthesis: parameters with which a mechanism follows paths, functions, poses or measures.

problem (targets, unknowns, constraints) -> equations (residuals, Jacobian) -> search from many starts -> result
"""

from __future__ import annotations

from kinfmu.synthesis.constraints import GrashofConstraint, MarginConstraint, MeasureConstraint
from kinfmu.synthesis.fit import fit
from kinfmu.synthesis.fit_file import read_problem
from kinfmu.synthesis.outcome import Optimum
from kinfmu.synthesis.problem import FitProblem
from kinfmu.synthesis.result import FitResult
from kinfmu.synthesis.targets import FunctionTarget, MeasureTarget, PathTarget, PoseTarget

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
