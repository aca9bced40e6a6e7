"""FMUs whose plain numbers are parameters: in every flavour as a file with those numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy.validation import validate_fmu

import kinfmu
from kinfmu.errors import FmuError
from kinfmu.fmu import description
from kinfmu.fmu.unpacked import DESCRIPTION, unpacked
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text

FLAVOURS: list[dict[str, Any]] = [
    {"flavour": "python"},
    {"flavour": "native"},
    {"flavour": "native", "fmi": 3},
    {"flavour": "native", "drive": "torque"},
]
NUMBERS = {"crank.P.x": 41.0, "coupler.Q.x": 103.0, "coupler.thickness": 7.0, "rocker.mass": 0.7, "gravity.y": -1620.0}


def with_numbers() -> kinfmu.Mechanism:
    """Return the loaded four-bar of the gallery with NUMBERS in its file."""
    written = text(kinfmu.load("fourbar_loaded"))
    for old, new in (
        ("P = [40.0, 0.0]", "P = [41.0, 0.0]"),
        ("Q = [100.0, 0.0]", "Q = [103.0, 0.0]"),
        ("thickness = 8.0", "thickness = 7.0"),
        ("mass = 0.5\n", "mass = 0.7\n"),
        ("y = -9810.0", "y = -1620.0"),
    ):
        assert written.count(old) == 1
        written = written.replace(old, new)
    return parse(written)


@pytest.mark.parametrize("options", FLAVOURS, ids=lambda options: " ".join(map(str, options.values())))
def test_numbers_that_are_set_are_as_in_a_file(options: dict[str, Any], tmp_path: Path) -> None:
    fmu = kinfmu.build(kinfmu.load("fourbar_loaded"), tmp_path, parameters="all", **options)
    assert validate_fmu(str(fmu)) == []
    with unpacked(fmu) as folder:
        about = description.read((folder / DESCRIPTION).read_bytes(), "ours").interface
    variables = {variable.name: variable for variable in about}
    for name, unit, start, what in (
        ("crank.P.x", "mm", 40.0, "Body crank: point P, x"),
        ("crank.inertia", "kg m2", 0.0007, "Body crank: inertia"),
        ("gravity.y", "mm/s2", -9810.0, "Gravity: y"),
    ):
        variable = variables[name]
        assert (variable.unit, variable.start, variable.description) == (unit, start, what)
        assert (variable.causality, variable.variability, variable.initial) == ("parameter", "fixed", "exact")
    assert [name for name in variables if name.startswith("crank.O")] == []  # a zero
    span = {"stop": 0.02, "step": 0.002}
    run = kinfmu.simulate(fmu, parameters=NUMBERS, **span)
    if "drive" in options:
        file = kinfmu.simulate(kinfmu.build(with_numbers(), tmp_path / "file.fmu", **options), **span)
    else:
        file = kinfmu.solve(with_numbers(), run.t)
    assert run.outputs == file.outputs
    for ours, theirs in ((run.values, file.values), (run.rates, file.rates), (run.accelerations, file.accelerations)):
        np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-9 if "drive" in options else 1e-10)
    np.testing.assert_allclose(run["crank.torque"], file["crank.torque"], rtol=1e-10, atol=1e-13)
    assert run.mechanism
    assert run.mechanism.parameters["coupler.Q.x"].value == 103.0


def test_lengths_that_do_not_close_are_refused(tmp_path: Path) -> None:
    fmu = kinfmu.build(kinfmu.load("crank_rocker"), tmp_path, parameters=["coupler.Q.x"])
    with pytest.raises(FmuError, match=r"^parameters coupler.Q.x = 1000: the mechanism does not close: rows "):
        kinfmu.simulate(fmu, parameters={"coupler.Q.x": 1000.0})
