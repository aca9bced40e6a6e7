"""All FMUs of tests/fmu/native/test_memory.py under the sanitizers, optimized."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.fmu.native.test_memory import CC, check_under_sanitizers


@pytest.mark.skipif(CC is None, reason="neither gcc nor clang is there")
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize(
    "name",
    ["fourbar", "five_bar", "settable", "fourbar_loaded", "engine", "excavator_loaded", "motor", "rocker"],
)
def test_sanitizers_report_no_errors_in_optimized_code(name: str, fmi: int, tmp_path: Path) -> None:
    check_under_sanitizers(name, fmi, tmp_path, "-O1")
