"""Sine, cosine and atan2 of the run time in C, compared with 50 digits."""

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
void directions(long n, const double *y, const double *x, double *angle);
void directions(long n, const double *y, const double *x, double *angle)
{
    long k;
    for (k = 0; k < n; ++k) {
        angle[k] = kf_atan2(y[k], x[k]);
    }
}
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


def directions(library: Any, y: Any, x: Any) -> np.ndarray[Any, Any]:
    """kf_atan2 of each pair."""
    pointer = ctypes.POINTER(ctypes.c_double)
    pair = [np.array(values, np.float64) for values in (y, x)]
    angle = np.empty_like(pair[0])
    library.directions(ctypes.c_long(angle.size), *(values.ctypes.data_as(pointer) for values in (*pair, angle)))
    return angle


def points() -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """In all directions, at the limits of the formulas and next to them, of very unlike and of extreme sizes."""
    random = np.random.default_rng(10)
    turn = random.uniform(-math.pi, math.pi, 6000)
    limits = np.repeat([0.4375, 0.5, 0.6875, 1.0, 1.1875, 1.5, 2.4375], 60)
    near = limits * (1 + random.integers(-3, 4, limits.size) * 2.0**-52)
    base = random.uniform(1, 2, limits.size)
    wide = 10.0 ** random.uniform(-300, 300, (2, 3000))
    tiny, huge = (10.0 ** random.uniform(*sizes, (2, 1000)) for sizes in ((-322, -307), (299, 308)))
    y = np.concatenate([np.sin(turn), base * near, wide[0], tiny[0], huge[0], np.sin(turn) * 1e-160])
    x = np.concatenate([np.cos(turn), base, wide[1], tiny[1], huge[1], np.cos(turn) * 1e-160])
    signs = random.choice([-1.0, 1.0], (2, len(x)))
    return y * signs[0], x * signs[1]


def test_atan2_is_right_within_one_ulp(library: Any) -> None:
    y, x = points()
    found = directions(library, y, x)
    with mpmath.workdps(50):
        exact = [mpmath.atan2(mpmath.mpf(b), mpmath.mpf(a)) for b, a in zip(y.tolist(), x.tolist(), strict=True)]
        gaps = np.array([float(abs(mpmath.mpf(one) - e)) for one, e in zip(found.tolist(), exact, strict=True)])
    ulp = np.spacing(np.abs([float(e) for e in exact]))
    assert (gaps <= ulp).all()
    usual = np.abs(found) > 1e-300
    assert (gaps[usual] / ulp[usual]).max() < 0.85


def test_atan2_of_zeros_infinities_and_nan_is_that_of_c99(library: Any) -> None:
    special = [0.0, -0.0, 1.0, -1.0, 5e-324, -5e-324, 1.7e308, -1.7e308, math.inf, -math.inf, math.nan]
    y, x = (values.ravel() for values in np.meshgrid(special, special))
    found, expected = directions(library, y, x), np.array(list(map(math.atan2, y.tolist(), x.tolist())))
    np.testing.assert_allclose(found, expected, rtol=2.3e-16, atol=0.0)
    np.testing.assert_array_equal(np.signbit(found), np.signbit(expected))
