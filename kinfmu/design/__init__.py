"""Design: studies of thousands of designs, and fits, which find parameters for what a mechanism is to do."""

from __future__ import annotations

from kinfmu.design.fit import (
    FitProblem,
    FitResult,
    FunctionTarget,
    GrashofConstraint,
    MarginConstraint,
    MeasureConstraint,
    MeasureTarget,
    Optimum,
    PathTarget,
    PoseTarget,
    read_problem,
)
from kinfmu.design.study import Study, StudyResult, read_study, run_study

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
    "Study",
    "StudyResult",
    "read_problem",
    "read_study",
    "run_study",
]
