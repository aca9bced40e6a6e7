"""Studies: thousands of designs of a mechanism, measured on all cores or on a cluster, and resumed where they ended."""

from __future__ import annotations

from kinfmu.design.study.definition import Study, read_study
from kinfmu.design.study.result import StudyResult
from kinfmu.design.study.run import run_study, study

__all__ = ["Study", "StudyResult", "read_study", "run_study", "study"]
