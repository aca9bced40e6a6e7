"""The spline against its defining equations, solved with 50 digits, and against what it must reproduce."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinfmu import Spline
from kinfmu.mechanism.laws.spline import ENDS, tridiagonal
from tests.mechanism.joints.drawn import splines
from tests.mechanism.laws.test_closed_forms import motion
from tests.power_series import mp

every_end = pytest.mark.parametrize("ends", ENDS)


def cubics(points: tuple[tuple[float, float], ...], ends: str) -> list[Any]:
    """Coefficients (c0, c1, c2, c3) of every piece from all conditions at once, one dense system of 4 n equations."""
    x, u = zip(*((mp.mpf(a), mp.mpf(b)) for a, b in points), strict=True)
    n = len(x) - 1
    rows: list[tuple[dict[int, Any], Any]] = []

    def at(piece: int, s: Any, order: int, sign: int = 1) -> dict[int, Any]:
        return {4 * piece + k: sign * mp.ff(k, order) * s ** (k - order) for k in range(order, 4)}

    h = [b - a for a, b in pairwise(x)]
    for k in range(n):
        rows += [(at(k, mp.mpf(0), 0), u[k]), (at(k, h[k], 0), u[k + 1])]
    for k in range(n - 1):
        rows += [({**at(k, h[k], order), **at(k + 1, mp.mpf(0), order, -1)}, mp.mpf(0)) for order in (1, 2)]
    if ends == "natural":
        rows += [(at(0, mp.mpf(0), 2), mp.mpf(0)), (at(n - 1, h[-1], 2), mp.mpf(0))]
    elif ends == "periodic":
        rows += [({**at(n - 1, h[-1], order), **at(0, mp.mpf(0), order, -1)}, mp.mpf(0)) for order in (1, 2)]
    else:
        rows += [({4 * k + 3: mp.mpf(1), 4 * k + 7: mp.mpf(-1)}, mp.mpf(0)) for k in (0, n - 2)]
    matrix, right = mp.zeros(4 * n), mp.zeros(4 * n, 1)
    for row, (entries, value) in enumerate(rows):
        right[row] = value
        for column, entry in entries.items():
            matrix[row, column] = entry
    solution = mp.lu_solve(matrix, right)
    return [[solution[4 * k + j] for j in range(4)] for k in range(n)]


@every_end
def test_a_spline_is_the_solution_of_its_equations_to_round_off(ends: str) -> None:
    rng = np.random.default_rng(3)
    for count in (4, 5, 9):
        x = [0.1]
        for _ in range(count - 1):
            x.append(x[-1] + rng.uniform(0.2, 2.0))
        u = [rng.uniform(-1.0, 1.0) for _ in x]
        if ends == "periodic":
            u[-1] = u[0]
        points = tuple(zip(x, u, strict=True))
        spline, exact = Spline(points, ends), cubics(points, ends)
        for k, (a, b) in enumerate(pairwise(x)):
            for part in (0.0, 0.3, 0.9):
                t = a + part * (b - a)
                s = mp.mpf(t) - mp.mpf(a)
                truth = [
                    sum(c * mp.ff(j, order) * s ** max(j - order, 0) for j, c in enumerate(exact[k]))
                    for order in range(3)
                ]
                assert motion(spline, t) == pytest.approx(list(map(float, truth)), rel=1e-13, abs=2e-13)


@given(data=st.data())
@every_end
def test_a_spline_meets_its_points_and_is_smooth_there(ends: str, data: st.DataObject) -> None:
    spline = data.draw(splines(ends))
    for x, u in spline.points[:-1]:
        assert motion(spline, x)[0] == u
    for x, _ in spline.points[1:-1]:
        before, after = motion(spline, math.nextafter(x, -math.inf)), motion(spline, x)
        assert before == pytest.approx(after, rel=1e-12, abs=1e-11)


@given(data=st.data())
def test_a_periodic_spline_is_smooth_across_its_ends_too(data: st.DataObject) -> None:
    spline = data.draw(splines("periodic"))
    first, last = spline.points[0][0], spline.points[-1][0]
    before, after = motion(spline, last - 1e-9), motion(spline, last + 1e-9)
    assert before == pytest.approx(after, abs=1e-6)
    turned = first + 3.0 * (last - first)
    assert motion(spline, turned + 0.25) == pytest.approx(motion(spline, first + 0.25), abs=1e-9)
    assert motion(spline, first - 0.25) == pytest.approx(motion(spline, last - 0.25), abs=1e-9)


def test_not_a_knot_reproduces_a_cubic_and_natural_a_line() -> None:
    x = (-1.0, 0.0, 0.5, 1.5, 4.0)
    cubic = Spline(tuple((t, 1.0 - 2.0 * t + 3.0 * t**2 - 0.5 * t**3) for t in x))
    line = Spline(tuple((t, 1.0 - 2.0 * t) for t in x), "natural")
    for t in (-0.9, 0.2, 1.0, 3.9):
        expected = [1.0 - 2.0 * t + 3.0 * t**2 - 0.5 * t**3, -2.0 + 6.0 * t - 1.5 * t**2, 6.0 - 3.0 * t]
        assert motion(cubic, t) == pytest.approx(expected, abs=1e-13)
        assert motion(line, t) == pytest.approx([1.0 - 2.0 * t, -2.0, 0.0], abs=1e-13)


@pytest.mark.parametrize("ends", ["not_a_knot", "natural"])
def test_outside_its_table_a_spline_is_constant_and_the_last_point_belongs_to_the_table(ends: str) -> None:
    spline = Spline(((0.0, 1.0), (1.0, 2.0), (2.0, 5.0), (3.0, 4.0)), ends)
    assert motion(spline, -0.5) == [1.0, 0.0, 0.0]
    assert motion(spline, 3.5) == [4.0, 0.0, 0.0]
    u, rate, _ = motion(spline, 3.0)
    assert u == pytest.approx(4.0, abs=1e-15)
    assert rate < -1.0
    assert motion(spline, math.nextafter(3.0, 4.0))[1] == pytest.approx(rate)  # as 30 * 0.1 would ask for it


def test_a_spline_of_a_sine_converges_with_order_four() -> None:
    def error(count: int) -> float:
        points = tuple((2.0 * math.pi * k / count, math.sin(2.0 * math.pi * k / count)) for k in range(count))
        spline = Spline((*points, (2.0 * math.pi, 0.0)), "periodic")
        return max(abs(spline.at(0.01 * k) - math.sin(0.01 * k)) for k in range(629))

    assert error(20) / error(40) == pytest.approx(16.0, rel=0.1)


@given(data=st.data())
def test_a_tridiagonal_system_is_solved(data: st.DataObject) -> None:
    n = data.draw(st.integers(1, 8))
    small = st.floats(-1.0, 1.0)
    lower, upper, right = (data.draw(st.lists(small, min_size=n, max_size=n)) for _ in range(3))
    main = data.draw(st.lists(st.floats(2.5, 5.0), min_size=n, max_size=n))
    x = tridiagonal(lower, main, upper, right)
    for k in range(n):
        before = lower[k] * x[k - 1] if k else 0.0
        after = upper[k] * x[k + 1] if k < n - 1 else 0.0
        assert before + main[k] * x[k] + after == pytest.approx(right[k], abs=1e-14)


def test_the_third_derivative_of_a_periodic_table_jumps_where_its_ends_meet() -> None:
    points = ((1.0, 0.0), (2.0, 3.0), (3.5, -1.0), (4.0, 1.0), (6.0, 0.0))
    law = Spline(points, "periodic")
    assert law.own_breaks(2).at == ()
    assert law.own_breaks(3) == ((1.0, 2.0, 3.5, 4.0), 5.0)
