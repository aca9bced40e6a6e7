"""Try the installed kinfmu: check, FMU, simulation, record and tables, by its command and in Python.

With the extra `viewer` also a recording; without it the record alone.
"""

from __future__ import annotations

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np

import kinfmu

CHECKOUT = Path(__file__).resolve().parents[1]
COMMAND = Path(sys.executable).with_name("kinfmu")
CALLS = (
    ("check", "fourbar"),
    ("new", "crank_rocker", "mine.toml"),
    ("build", "mine.toml", "--flavour", "python", "-o", "mine.fmu"),
    ("simulate", "mine.fmu"),
    ("export", "logs/mine.mcap", "-o", "mine.csv"),
    ("export", "logs/mine.mcap", "-o", "mine.npz"),
    ("export", "mine.toml", "-o", "mine.html"),
)
SAVE = ("review", "logs/mine.mcap", "--save", "saved.rrd")


def main() -> int:
    """Return 0 if all works; an AssertionError or the failing command says what does not."""
    assert CHECKOUT not in Path(kinfmu.__file__).resolve().parents, "this is the checkout, not an installation"
    for call in CALLS:
        subprocess.run([COMMAND, *call], check=True)
    run = kinfmu.solve(kinfmu.load("fourbar"), crank_angle=np.radians(np.arange(361)))
    assert np.abs(run["rocker.phi"] - run["crank.phi"]).max() < 1e-12
    table = np.genfromtxt("mine.csv", delimiter=",", names=True)
    record = kinfmu.log.read("logs/mine.mcap")
    np.testing.assert_array_equal(table["time"], record.t)
    assert record.good.all()
    has_viewer = find_spec("rerun") is not None
    saved = subprocess.run([COMMAND, *SAVE], check=False, capture_output=True, text=True)
    assert (saved.returncode == 0) == has_viewer
    assert has_viewer or saved.stderr.endswith(" needs the Rerun viewer: pip install 'kinfmu[viewer]'\n")
    assert Path("saved.rrd").exists() == Path("logs/mine.rrd").exists() == has_viewer
    return 0


if __name__ == "__main__":
    sys.exit(main())
