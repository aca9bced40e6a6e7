"""What importing costs: heavy packages are loaded when they are used, not before."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[2]
LOGGING = {"mcap", "zstandard", "lz4", "rerun", "pyarrow", "pandas", "polars"}
HEAVY = {"numpy", "scipy", "pythonfmu", "fmpy", "PIL", "matplotlib", "importlib.metadata"} | LOGGING


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
        ("import kinfmu.solver.python", HEAVY | {"click"}),
        ("import kinfmu.cli", HEAVY),
        (
            "from kinfmu.log import read, review, write_mcap, write_rrd, write_table",
            HEAVY - {"numpy", "importlib.metadata"},
        ),
        ("import kinfmu.draw", HEAVY - {"numpy", "scipy", "importlib.metadata"}),
        ("import kinfmu.fmu", HEAVY - {"numpy", "importlib.metadata"}),
    ],
)
@pytest.mark.few(2)
def test_importing_loads_no_heavy_package(statement: str, late: set[str]) -> None:
    loaded = loaded_by(statement)
    assert "kinfmu" in loaded
    assert loaded & late == set()


@pytest.mark.long
def test_building_and_stepping_an_fmu_loads_nothing_to_log_with(tmp_path: Path) -> None:
    statement = (
        f"import kinfmu; fmu = kinfmu.build(kinfmu.load('fourbar'), {str(tmp_path / 'fourbar.fmu')!r}); "
        "run = kinfmu.simulate(fmu, stop=1.0); assert len(run) == 2"
    )
    loaded = loaded_by(statement)
    assert {"kinfmu.fmu.host.simulate", "fmpy"} <= loaded
    assert loaded & LOGGING == set()
    assert not [name for name in loaded if name.startswith("kinfmu.log")]


def test_writing_and_reading_a_record_loads_no_viewer(tmp_path: Path) -> None:
    path = str(tmp_path / "run.mcap")
    statement = (
        f"import kinfmu; run = kinfmu.solve(kinfmu.load('fourbar')); kinfmu.log.write_mcap(run, {path!r}); "
        f"assert len(kinfmu.log.read({path!r})) == 181"
    )
    assert loaded_by(statement) & LOGGING == {"zstandard"}
