"""The report of `check`: mobility, redundancy, drivers, plan, loops, ranges, assemblies, the matrices of the method."""

from __future__ import annotations

from kinfmu.analysis.assemblies import Assemblies
from kinfmu.analysis.cams import cam_profile
from kinfmu.analysis.report import Report, check

__all__ = ["Assemblies", "Report", "cam_profile", "check"]
