"""The generated Python of the four-bar, so that a change of the generator is read as a diff."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

import kinfmu
from kinfmu.codegen.python import emit
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text
from kinfmu.plan import compile_plan


def rounded(source: str) -> str:
    """Long numbers to 12 digits: the anchor is found by linear algebra whose last bits differ between machines."""

    def short(number: re.Match[str]) -> str:
        value = float(number.group())
        return repr(0.0 if abs(value) < 1e-12 else float(f"{value:.12g}"))

    return re.sub(r"\b\d+\.\d{9,}(e[+-]\d+)?", short, source)


def test_the_generated_python_of_the_fourbar_is_the_golden_file(golden: Callable[[str, str], None]) -> None:
    golden("fourbar.py.txt", rounded(emit(compile_plan(kinfmu.load("fourbar")))))


def test_generating_twice_gives_the_same_bytes() -> None:
    one, other = (emit(compile_plan(kinfmu.load("fourbar"))) for _ in range(2))
    assert one == other
    compile(one, "fourbar.py", "exec")


@pytest.mark.parametrize(
    "names",
    [("sin", "cos", "u"), ("lambda", "None", "class"), ("t1", "r0", "z0"), ("a", "a_x", "cos_a"), ("_", "s", "__")],
)
@pytest.mark.few(3)
def test_bodies_and_drivers_may_be_called_anything_that_is_a_name(names: tuple[str, str, str]) -> None:
    """Words of Python and names that the generated code uses itself, too."""
    fourbar = kinfmu.load("fourbar")
    told = text(fourbar)
    for old, new in zip(("crank", "coupler", "rocker"), names, strict=True):
        told = re.sub(rf"\b{old}\b", f"<{new}>", told)
    renamed = parse(re.sub(r"<(\w+)>", r"\1", told))
    assert renamed.coordinate_names[0] == f"{names[0]}.x"
    angles = [0.5, 1.5]
    run, expected = kinfmu.solve(renamed, angles), kinfmu.solve(fourbar, angles)
    np.testing.assert_allclose(run.accelerations, expected.accelerations, atol=1e-15)
    np.testing.assert_allclose(run.values, expected.values, atol=1e-15)


def test_long_numbers_are_rounded_and_short_ones_left_alone() -> None:
    assert rounded("a = 4.6057161519861405e-17, -1.0471975511965976, 1e-13, 0.25, x1") == (
        "a = 0.0, -1.0471975512, 1e-13, 0.25, x1"
    )
