"""What importing costs: heavy packages are loaded when they are used, not before."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[2]
HEAVY = {"numpy", "scipy", "pythonfmu", "fmpy", "mcap", "rerun", "pyarrow", "PIL", "matplotlib", "importlib.metadata"}


def loaded_by(statement: str) -> set[str]:
    """Names of all modules that a fresh process has loaded after a statement."""
    done = subprocess.run(
        [sys.executable, "-c", f"{statement}\nimport sys\nprint(*sys.modules)"],
        cwd=CHECKOUT,
        capture_output=True,
        text=True,
        check=True,
    )
    return set(done.stdout.split())


@pytest.mark.parametrize(
    ("statement", "late"),
    [
        ("import kinfmu", HEAVY | {"click"}),
        ("import kinfmu; kinfmu.load; kinfmu.Mechanism; kinfmu.Body", HEAVY | {"click"}),
        ("import kinfmu.solver", HEAVY | {"click"}),
        ("import kinfmu.cli", HEAVY),
        ("import kinfmu.log", HEAVY - {"numpy", "importlib.metadata"}),
        ("import kinfmu.draw", HEAVY - {"numpy", "scipy", "importlib.metadata"}),
        ("import kinfmu.fmu", HEAVY - {"numpy", "importlib.metadata"}),
    ],
)
def test_importing_loads_no_heavy_package(statement: str, late: set[str]) -> None:
    loaded = loaded_by(statement)
    assert "kinfmu" in loaded
    assert loaded & late == set()
