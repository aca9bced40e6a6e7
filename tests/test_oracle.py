"""The oracle itself: closed forms against residuals alone, both against the textbook, series against known ones."""

from __future__ import annotations

import ast
import math
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import mpmath
import numpy as np
import pytest

from tests import oracle, power_series
from tests.oracle import Series, cos, follow, largest_error, mp, sin, sin_cos, solve, sqrt

EQUAL = 1e-48  # two ways to 50 digits
DEGREE = math.pi / 180.0


def reference_fourbar(q: Sequence[Series], u: Series) -> list[Series]:
    """Rows (1) to (4) of the reference problem and its driver; row (5) is redundant."""
    phi1, x2, y2, phi2, phi3 = q
    return [
        x2 - cos(phi1) - cos(phi2),
        y2 - sin(phi1) - sin(phi2),
        x2 - cos(phi3) - 1,
        y2 - sin(phi3),
        phi1 - u,
    ]


def double_pendulum(q: Sequence[Series], u: Series) -> list[Series]:
    """The guided double pendulum."""
    x1, y1, phi1, x2, y2, phi2 = q
    return [
        x1 - cos(phi1),
        y1 - sin(phi1),
        x2 - cos(phi1) - cos(phi2),
        y2 - sin(phi1) - sin(phi2),
        y2 + 1,
        phi1 - u,
    ]


def fourbar(ground: str, crank: str, coupler: str, rocker: str) -> oracle.Residual:
    """The loop of any four-bar in its three angles."""
    g, a, b, c = (mp.mpf(length) for length in (ground, crank, coupler, rocker))

    def residual(q: Sequence[Series], u: Series) -> list[Series]:
        (s1, c1), (s2, c2), (s3, c3) = map(sin_cos, q)
        return [a * c1 + b * c2 - g - c * c3, a * s1 + b * s2 - c * s3, q[0] - u]

    return residual


def slider_crank(crank: str, rod: str, offset: str) -> oracle.Residual:
    """The loop of a slider-crank in crank angle, rod angle and stroke."""
    a, b, y = (mp.mpf(length) for length in (crank, rod, offset))

    def residual(q: Sequence[Series], u: Series) -> list[Series]:
        phi, rod_angle, x = q
        return [a * cos(phi) + b * cos(rod_angle) - x, a * sin(phi) + b * sin(rod_angle) - y, phi - u]

    return residual


def assert_same(one: oracle.Motion, other: oracle.Motion, bound: float = EQUAL) -> None:
    """Position, velocity and acceleration agree to `bound`."""
    for name, a, b in zip(one._fields, one, other, strict=True):
        assert a.shape == b.shape, name
        assert max(abs(x) for x in (a - b).ravel()) < bound, name


@pytest.mark.parametrize("module", [oracle, power_series], ids=["oracle", "series"])
def test_the_oracle_imports_nothing_of_kinfmu(module: ModuleType) -> None:
    tree = ast.parse(Path(module.__file__ or "").read_text(encoding="utf-8"))
    imported = [a.name for node in ast.walk(tree) if isinstance(node, ast.Import) for a in node.names]
    imported += [node.module or "." for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    assert set(imported) <= {
        "__future__",
        "collections.abc",
        "typing",
        "mpmath",
        "numpy",
        "numpy.typing",
        "tests.power_series",
    }


@pytest.mark.parametrize(
    ("of_series", "of_number"),
    [
        (sin, mp.sin),
        (cos, mp.cos),
        (sqrt, mp.sqrt),
        (power_series.asin, mp.asin),
        (lambda x: power_series.atan2(x * x, 1 - x), lambda x: mp.atan2(x * x, 1 - x)),
        (lambda x: (2 - x) / (x * x + 1) - 1 / x, lambda x: (2 - x) / (x * x + 1) - 1 / x),
        (lambda x: -x * 3 + (1 + x), lambda x: 1 - 2 * x),
    ],
    ids=["sin", "cos", "sqrt", "asin", "atan2", "quotient", "sum"],
)
def test_a_series_has_the_derivatives_of_its_function(of_series: Any, of_number: Any) -> None:
    """Against mpmath's differences at twice the digits, an independent way to derivatives."""
    at = mp.mpf("0.37")
    series = of_series(Series([at, 1, 0, 0, 0]))
    for k, coefficient in enumerate(series.c):
        with mp.workdps(200):
            expected = mp.diff(of_number, at, k) / mp.factorial(k)
        assert abs(coefficient - expected) < 1e-60, k


@pytest.mark.parametrize("angle", [0.1, 30 * DEGREE, 1.7, 3.0, 200 * DEGREE, 5.5])
def test_reference_fourbar_from_its_residuals_is_the_closed_form(angle: float) -> None:
    closed = oracle.reference_fourbar(angle, "0.3", "-0.7")
    rough = np.round(closed.rounded().q[0], 2)
    assert_same(solve(reference_fourbar, rough, angle, "0.3", "-0.7"), closed)


def test_reference_fourbar_gives_the_reports_table() -> None:
    seconds = [30, 60, 90, 120, 150]
    motion = oracle.reference_fourbar([mp.pi * t / 180 for t in seconds], mp.pi / 180).rounded()
    table = [
        [0.5236, 1.8660, 0.5000, 0, 0.5236],
        [1.0472, 1.5000, 0.8660, 0, 1.0472],
        [1.5708, 1.0000, 1.0000, 0, 1.5708],
        [2.0944, 0.5000, 0.8660, 0, 2.0944],
        [2.6180, 0.1340, 0.5000, 0, 2.6180],
    ]
    np.testing.assert_allclose(motion.q, table, rtol=0, atol=5e-5)


def test_double_pendulum_from_its_residuals_is_the_closed_form() -> None:
    u = [5 * mp.pi / 3 + mp.pi * mp.mpf(t) / 6 for t in (0, 0.25, 0.8, 1.2, 1.5)]
    closed = oracle.guided_double_pendulum(u, mp.pi / 6, "0.2")
    assert_same(solve(double_pendulum, np.round(closed.rounded().q, 1), u, mp.pi / 6, "0.2"), closed)


def test_double_pendulum_gives_the_textbooks_numbers() -> None:
    motion = oracle.guided_double_pendulum(5 * mp.pi / 3, mp.pi / 6).rounded()
    np.testing.assert_allclose(motion.q[0], [0.5, -0.8660, 5.2360, 1.4910, -1.0, 6.1488], rtol=0, atol=5.1e-5)
    np.testing.assert_allclose(motion.qd[0], [0.4534, 0.2618, 0.5236, 0.41806, 0, -0.2642], rtol=0, atol=5.1e-5)
    np.testing.assert_allclose(motion.qdd[0], [-0.1371, 0.2374, 0, -0.23960, 0, -0.2490], rtol=0, atol=5.1e-5)


@pytest.mark.parametrize("branch", [1, -1])
@pytest.mark.parametrize("lengths", [("4", "1", "3.5", "3"), ("0.5", "0.7", "0.8", "0.9"), ("4", "1", "3", "2")])
def test_fourbar_from_its_residuals_is_the_closed_form(lengths: tuple[str, str, str, str], branch: int) -> None:
    u = [0.3, 1.9, 2.8, -1.2]
    closed = oracle.fourbar(*lengths, u, 2, "0.5", branch=branch)
    assert_same(solve(fourbar(*lengths), np.round(closed.rounded().q, 2), u, 2, "0.5"), closed)


@pytest.mark.parametrize("branch", [1, -1])
def test_the_branch_of_a_fourbar_is_the_side_of_the_diagonal(branch: int) -> None:
    phi, coupler, _ = oracle.fourbar("4", "1", "3.5", "3", 1.0, branch=branch).rounded().q[0]
    tip = np.array([math.cos(phi), math.sin(phi)])
    diagonal, bar = np.array([4.0, 0.0]) - tip, np.array([math.cos(coupler), math.sin(coupler)])
    assert np.sign(diagonal[0] * bar[1] - diagonal[1] * bar[0]) == branch


@pytest.mark.parametrize("branch", [1, -1])
@pytest.mark.parametrize("lengths", [("1", "3", "0.4"), ("0.25", "1", "0")])
def test_slider_crank_from_its_residuals_is_the_closed_form(lengths: tuple[str, str, str], branch: int) -> None:
    u = [0.0, 0.7, 3.0, -2.0]
    closed = oracle.slider_crank(*lengths, u, -1.5, 0.25, branch=branch)
    assert_same(solve(slider_crank(*lengths), np.round(closed.rounded().q, 2), u, -1.5, 0.25), closed)


def test_a_closed_form_refuses_a_pose_that_cannot_be_reached() -> None:
    with pytest.raises(ValueError, match=r"do not meet, or only just at 3\.0 rad"):
        oracle.fourbar("4", "3", "1.5", "2", 3.0)
    with pytest.raises(ValueError, match="the rod does not reach the slide"):
        oracle.slider_crank("2", "1", "0", 1.5)
    with pytest.raises(ValueError, match="does not reach y = -1 at 0"):
        oracle.guided_double_pendulum(0.5)


def test_rates_of_two_drivers_are_those_of_their_sum() -> None:
    """A rod on a slide: x = a + 2 b of two drivers, x and a product of both as coordinates."""

    def residual(q: Sequence[Series], u: Sequence[Series]) -> list[Series]:
        return [q[0] - u[0] - 2 * u[1], q[1] - u[0] * u[1]]

    motion = solve(residual, [0, 0], [(0.5, 0.25)], [(3, 5)], (7, 11)).rounded()
    assert motion.q.tolist() == [[1.0, 0.125]]
    assert motion.qd.tolist() == [[13.0, 3 * 0.25 + 5 * 0.5]]
    assert motion.qdd.tolist() == [[29.0, 7 * 0.25 + 2 * 3 * 5 + 0.5 * 11]]


@pytest.mark.long
def test_following_crosses_the_change_points_of_the_reference_fourbar() -> None:
    """At 0 exactly, at the double next to pi, very near it, and on: always the parallelogram."""
    angles = [1e-9, 0.0, 2.0, 179 * DEGREE, math.pi, math.pi + 1e-6, 3.3]
    motion = follow(reference_fourbar, [0.5, 1.9, 0.5, 0.0, 0.5], 0.5, angles, 0.7, 0.3, step=0.1)
    assert_same(motion, oracle.reference_fourbar(angles, 0.7, 0.3))


def test_following_changes_the_sign_of_the_closed_form_at_a_change_point() -> None:
    lengths = ("4", "1", "3", "2")  # 4 + 1 = 3 + 2: stretched at pi
    angles = [2.9, math.pi, 3.4]
    start = oracle.fourbar(*lengths, 2.8, branch=1).rounded().q[0]
    motion = follow(fourbar(*lengths), start, 2.8, angles)
    for k, branch in ((0, 1), (2, -1)):
        closed = oracle.fourbar(*lengths, angles[k], branch=branch)
        assert largest_error(motion.qdd[k].astype(float), closed.qdd[0]) < 1e-15
        assert max(abs(mp.sin((a - b) / 2)) for a, b in zip(motion.q[k], closed.q[0], strict=True)) < EQUAL
    assert abs(motion.qd[1, 1] - motion.qd[1, 2]) > 0.1  # of two branches one was taken, not their mean


@pytest.mark.long
def test_following_a_regular_stretch_is_solving() -> None:
    closed = oracle.slider_crank("1", "3", "0.4", [0.1, 0.6, -0.2])
    assert_same(follow(slider_crank("1", "3", "0.4"), [0, 0.1, 3.9], 0.0, [0.1, 0.6, -0.2]), closed)


@pytest.mark.long
def test_following_says_when_a_limit_stops_it() -> None:
    with pytest.raises(ValueError, match=r"singular|lost|converge"):
        follow(double_pendulum, [0.5, -0.87, 5.24, 1.5, -1, 6.14], 5.24, [6.5])


def test_a_singular_pose_is_refused_by_solve() -> None:
    with pytest.raises(ValueError, match="singular on the way"):
        solve(reference_fourbar, [0, 2, 0, 0, 0], 0.0)


def test_inputs_are_taken_exactly_and_outputs_are_the_nearest_doubles() -> None:
    assert oracle.reference_fourbar(0.1).q[0, 0] == mp.mpf(0.1) != mp.mpf("0.1")
    assert oracle.reference_fourbar(np.float64(0.1)).q[0, 0] == mp.mpf(0.1)
    rounded = oracle.reference_fourbar(np.array([0.1, 0.2])).rounded()
    assert [table.dtype for table in rounded] == [np.float64] * 3
    assert rounded.q[1, 2] == float(mp.sin(mp.mpf(0.2)))


def test_errors_are_measured_in_full_precision_and_modulo_turns_when_asked() -> None:
    exact = np.array([mp.mpf("0.1"), mp.mpf(2)], dtype=object)
    assert largest_error([0.1, 2.0], exact) == pytest.approx(5.55e-18, rel=1e-3)
    assert largest_error([0.1 + 2 * math.pi, 2.0], exact) > 6
    assert largest_error([0.1 + 2 * math.pi, 2.0], exact, modulo_turns=True) < 1e-15
    assert math.isnan(largest_error([0.1, math.nan], exact))


def test_the_digits_of_the_oracle_are_its_own() -> None:
    with mpmath.workdps(5):
        value = oracle.reference_fourbar(1.0).q[0, 2]
    assert abs(value - mp.sin(1)) < 1e-70
