"""What `check` tells: mobility, redundancy, plan, singular points, range, and the matrices of the method."""

from __future__ import annotations

from kinfmu.analysis.report import Report, check

__all__ = ["Report", "check"]
