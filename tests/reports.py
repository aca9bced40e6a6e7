"""Texts of reports in tests."""

from __future__ import annotations

import re

import kinfmu


def unwrapped(report: kinfmu.Report, *, detail: bool = True) -> str:
    """The text of a report without wrapped lines, with single blanks."""
    return re.sub(" +", " ", report.summary(detail=detail).text(100_000))
