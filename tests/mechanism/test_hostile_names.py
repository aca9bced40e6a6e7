"""Names that have a meaning in C, in Python or in generated code do not change results."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from kinfmu.mechanism.toml_file import parse
from kinfmu.run.solve import solve
from tests.fuzz.mechanisms import SAMPLES, written

NAMES = {
    "name": '"main"',
    "crank": "for",  # parameters
    "rod": "coupler_phi",
    "arm": "int",  # a body
    "tip": "x",  # a point
    "joint": "errno",
    "driver": "lambda",
    "point": "t1",
}


@pytest.mark.parametrize("engine", ["python", "native"])
def test_names_of_languages_and_of_generated_code_change_no_number(
    engine: Literal["python", "native"], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("KINFMU_CACHE", str(tmp_path))
    plain = solve(parse(written({})), SAMPLES, engine="python")
    other = solve(parse(written(NAMES)), SAMPLES, engine=engine)
    assert other.status.tolist() == plain.status.tolist()
    np.testing.assert_allclose(other.values, plain.values, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(other.accelerations, plain.accelerations, rtol=0.0, atol=1e-12)
