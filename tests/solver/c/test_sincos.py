"""Sine and cosine of the run time in C, compared with 50 digits."""

from __future__ import annotations

import ctypes
import math
from typing import Any

import mpmath
import numpy as np
import pytest

from kinfmu.codegen.c import compiler
from tests.solver.c.native import STRICT

CALLS = """\
#include "sincos.h"
void one_by_one(long n, const double *x, double *sine, double *cosine);
void side_by_side(long n, const double *x, double *sine, double *cosine);
void one_by_one(long n, const double *x, double *sine, double *cosine)
{
    long k;
    for (k = 0; k < n; ++k) {
        kf_sincos(x[k], &sine[k], &cosine[k]);
    }
}
void side_by_side(long n, const double *x, double *sine, double *cosine)
{
    long k;
    for (k = 0; k < n; ++k) {
        kf_sincos_lane(x[k], &sine[k], &cosine[k]);
    }
}
"""


@pytest.fixture(scope="module")
def library() -> Any:
    files = {"calls.c": CALLS, **compiler.sources(("sincos.h",))}
    return ctypes.CDLL(str(compiler.shared_library(files, (*STRICT, "-O3"))))


def evaluated(function: Any, x: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Sines and cosines, one under the other."""
    pointer = ctypes.POINTER(ctypes.c_double)
    out = np.empty((2, len(x)))
    function(ctypes.c_long(len(x)), *(np.ascontiguousarray(a).ctypes.data_as(pointer) for a in (x, out[0], out[1])))
    return out


def exactly(x: np.ndarray[Any, Any]) -> list[list[Any]]:
    with mpmath.workdps(50):
        return [[function(mpmath.mpf(value)) for value in x.tolist()] for function in (mpmath.sin, mpmath.cos)]


def errors(x: np.ndarray[Any, Any], found: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    rows = exactly(x)
    return np.array([[float(abs(a - b)) for a, b in zip(*pair, strict=True)] for pair in zip(found, rows, strict=True)])


def angles() -> np.ndarray[Any, Any]:
    """Of all sizes up to 2^20 quarter turns, and as near to quarters as doubles are."""
    random = np.random.default_rng(5)
    quarters = math.pi / 2 * np.concatenate([np.arange(-40, 41), random.integers(-(2**20), 2**20, 400)])
    near = [np.nextafter(quarters, side) for side in (-np.inf, np.inf)]
    widths = 10.0 ** random.uniform(-12, math.log10(2**20 * math.pi / 2), 4000)
    return np.concatenate([[0.0, -0.0], quarters, *near, random.uniform(-1, 1, 4000) * widths])


def test_sine_and_cosine_are_right_to_1e_16_one_by_one_and_side_by_side(library: Any) -> None:
    x = angles()
    found = evaluated(library.one_by_one, x)
    assert errors(x, found).max() < 1.3e-16
    np.testing.assert_array_equal(evaluated(library.side_by_side, x), found)


def test_small_angles_keep_all_their_digits(library: Any) -> None:
    x = np.random.default_rng(6).uniform(-0.7, 0.7, 2000) * 10.0 ** np.random.default_rng(7).uniform(-300, 0, 2000)
    sine, _ = evaluated(library.one_by_one, x)
    off = errors(x, evaluated(library.one_by_one, x))[0]
    assert (off <= 1.0 * np.spacing(np.abs(sine))).all()


def test_beyond_2_to_the_20_quarters_half_an_ulp_of_the_angle_is_lost(library: Any) -> None:
    x = np.random.default_rng(8).uniform(-1, 1, 2000) * 10.0 ** np.random.default_rng(9).uniform(6, 12, 2000)
    assert (errors(x, evaluated(library.one_by_one, x)) <= 1.3e-16 + 0.5 * np.spacing(np.abs(x))).all()


def test_the_sine_of_nan_and_infinity_is_nan(library: Any) -> None:
    x = np.array([math.nan, math.inf, -math.inf])
    for function in (library.one_by_one, library.side_by_side):
        assert np.isnan(evaluated(function, x)).all()
