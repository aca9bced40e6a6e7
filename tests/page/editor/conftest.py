"""States of drawings in a folder of the test."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def states_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder in which a test keeps states."""
    folder = tmp_path / "states_of_drawings"
    monkeypatch.setenv("KINFMU_STATES", str(folder))
    return folder
