"""Inputs in which outputs are linear by structure: dependencies of kind `fixed` in model descriptions."""

from __future__ import annotations

import numpy as np
import pytest

import kinfmu
from kinfmu.fmu.variables import linear_inputs
from kinfmu.plan import compile_plan
from tests.fmu.test_parameters import geared
from tests.gallery_members import every_member


def _linear(mechanism: kinfmu.Mechanism) -> dict[str, tuple[str, ...]]:
    return {name: inputs for name, inputs in linear_inputs(compile_plan(mechanism)).items() if inputs}


@pytest.mark.parametrize(
    ("name", "linear"),
    [
        ("fourbar", {"crank.phi": ("crank_angle",)}),  # and not rocker.phi, which Newton finds
        ("five_bar", {"left_arm.phi": ("left_angle",), "right_arm.phi": ("right_angle",)}),
        ("geared_five_bar", {"gear.phi": ("gear_angle",), "pinion.phi": ("gear_angle",)}),
        ("excavator", {}),
    ],
)
def test_outputs_of_gallery_mechanisms_are_linear_in_these_drivers(name: str, linear: dict[str, object]) -> None:
    assert _linear(kinfmu.load(name)) == linear


def test_factor_may_hold_a_parameter() -> None:
    assert _linear(geared()) == {"crank.phi": ("crank_angle",), "wheel.phi": ("crank_angle",)}


@every_member
@pytest.mark.few(3)
def test_linear_outputs_are_straight_lines_over_the_run(name: str) -> None:
    run = kinfmu.solve(kinfmu.load(name))
    for output, inputs in _linear(kinfmu.load(name)).items():
        columns = [run.inputs[:, run.input_names.index(one)] for one in inputs]
        line = np.column_stack([np.ones_like(run.t), *columns])[run.good]
        values = run[output][run.good]
        factors, *_ = np.linalg.lstsq(line, values)
        np.testing.assert_allclose(line @ factors, values, rtol=0, atol=1e-12 * max(1.0, np.abs(values).max()))
