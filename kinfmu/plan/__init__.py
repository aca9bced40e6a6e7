"""SolvePlan: what is computed, and in what order, for the outputs wanted."""

from __future__ import annotations

from kinfmu.plan.block import Block, determinant_formula
from kinfmu.plan.compile import compile_plan, plan_from, require_solvable
from kinfmu.plan.origin import localized
from kinfmu.plan.plan import DriverInfo, SolvePlan

__all__ = [
    "Block",
    "DriverInfo",
    "SolvePlan",
    "compile_plan",
    "determinant_formula",
    "localized",
    "plan_from",
    "require_solvable",
]
