"""Residuals and Jacobians against differences in 50 digits of the closed form of a four-bar."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import mpmath
import numpy as np
import pytest

import kinfmu
from kinfmu.design.fit import FunctionTarget, GrashofConstraint, MarginConstraint, MeasureTarget, PathTarget, PoseTarget
from kinfmu.design.fit.equations import Equations
from tests.design.fit.fourbars import LENGTHS, four_bar

mpmath.mp.dps = 50
NAMES = tuple(LENGTHS)
BOUNDS = {name: (0.5 * value, 2.0 * value) for name, value in LENGTHS.items()}
ANGLES = (0.3, 1.1, 2.4, 3.9, 5.2)
POINTS = ((0.2, 1.9), (-0.4, 2.1), (-0.9, 1.6), (0.1, 0.9), (1.3, 1.3))
Rows = Callable[[Sequence[Any]], list[Any]]  # unknowns -> residuals


def _pose(theta: Any, lengths: Sequence[Any]) -> tuple[Any, ...]:
    """Return x, y of P, x, y of X, the coupler's and the rocker's angle."""
    g, a, b, c, px, py = lengths
    p = a * mpmath.expj(theta)
    d = abs(g - p)
    coupler = mpmath.arg(g - p) + mpmath.acos((b**2 + d**2 - c**2) / (2 * b * d))
    x = p + (px + 1j * py) * mpmath.expj(coupler)
    rocker = mpmath.arg(p + b * mpmath.expj(coupler) - g)
    return p.real, p.imag, x.real, x.imag, coupler, rocker


def _differences(rows: Rows, x: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Return residuals and their Jacobian."""
    h = mpmath.mpf(10) ** -20
    exact = [mpmath.mpf(value) for value in x]
    columns = []
    for k in range(len(x)):
        above, below = list(exact), list(exact)
        above[k], below[k] = exact[k] + h, exact[k] - h
        columns.append([(a - b) / (2 * h) for a, b in zip(rows(above), rows(below), strict=True)])
    return np.array(rows(exact), dtype=float), np.array(columns, dtype=float).T


def _of_kinfmu(targets: Sequence[Any], **more: Any) -> tuple[Equations, np.ndarray, np.ndarray, np.ndarray]:
    """Return the equations at the written lengths, all unknowns, the residuals and the Jacobian by them."""
    problem = kinfmu.FitProblem(four_bar(), BOUNDS, targets, **more)
    equations = Equations(problem)
    ranges = np.array([high - low for low, high in problem.bounds.values()])
    z = np.full(len(ranges), 0.55)
    z[:6] = [(LENGTHS[name] - BOUNDS[name][0]) / (BOUNDS[name][1] - BOUNDS[name][0]) for name in NAMES]
    found, jacobian = equations.at(z)
    jacobian = equations.with_measures(z, found, jacobian) / ranges
    return equations, np.array(list(problem.vector(z).values())), found.residuals, jacobian


def _timed_path(x: Sequence[Any]) -> list[Any]:
    return [
        mpmath.sqrt(2) * (one - wanted)
        for angle, point in zip(ANGLES, POINTS, strict=True)
        for one, wanted in zip(_pose(x[6] + angle, x[:6])[2:4], point, strict=True)
    ]


def _function(x: Sequence[Any]) -> list[Any]:
    return [_pose(x[6] + angle, x[:6])[5] - x[7] - y for angle, (y, _) in zip(ANGLES, POINTS, strict=True)]


def _timed_poses(x: Sequence[Any]) -> list[Any]:
    rows = []
    for angle, point in zip(ANGLES, POINTS, strict=True):
        px, py, *_, phi, _ = _pose(x[6] + angle, x[:6])
        rows += [px - point[0], py - point[1], 3 * (phi - mpmath.mpf(0.5))]
    return rows


START = ("-1 rad", 1.0)
TARGETS = {
    "path": (PathTarget(name="t", of="coupler.X", points=POINTS, at=ANGLES, start=START, weight=2.0), _timed_path),
    "function": (
        FunctionTarget(
            name="t",
            of="rocker.phi",
            points=[(angle, y) for angle, (y, _) in zip(ANGLES, POINTS, strict=True)],
            start=START,
            offset=START,
        ),
        _function,
    ),
    "poses": (
        PoseTarget(name="t", of="coupler", poses=[(*p, 0.5) for p in POINTS], length=3.0, at=ANGLES, start=START),
        _timed_poses,
    ),
}


@pytest.mark.parametrize("kind", TARGETS)
def test_timed_targets(kind: str) -> None:
    target, rows = TARGETS[kind]
    _, x, residuals, jacobian = _of_kinfmu([target])

    expected, slopes = _differences(rows, x)

    assert residuals == pytest.approx(expected, abs=1e-13)
    assert jacobian == pytest.approx(slopes, abs=1e-12)


def test_the_gradient_of_untimed_points_and_poses_is_exact() -> None:
    points = [(x + 0.05, y) for x, y in POINTS]
    poses = [(0.4, 0.9, "40 deg"), (-0.9, 0.2, "35 deg")]
    equations, x, residuals, jacobian = _of_kinfmu(
        [
            PathTarget(name="path", of="coupler.X", points=points),
            PoseTarget(name="guide", of="coupler", poses=poses, length=3.0),
        ]
    )
    z = np.array([(x[k] - low) / (high - low) for k, (low, high) in enumerate(BOUNDS.values())])
    feet = [row.arguments.tolist() for row in equations.at(z)[0].rows]

    def squares(x: Sequence[Any]) -> list[Any]:
        total = mpmath.mpf(0)
        for point, guess in zip(points, feet[0], strict=True):

            def near(u: Any, point: Any = point) -> Any:
                _, _, px, py, *_ = _pose(u, x)
                return (px - point[0]) ** 2 + (py - point[1]) ** 2

            total += near(
                mpmath.findroot(
                    lambda u, near=near: mpmath.diff(near, u), (guess - 0.02, guess + 0.02), solver="anderson"
                )
            )
        for (px, py, text), guess in zip(poses, feet[1], strict=True):
            phi = mpmath.mpf(np.radians(float(text.split()[0])))

            def apart(u: Any, px: Any = px, py: Any = py, phi: Any = phi) -> Any:
                x_p, y_p, *_, coupler, _ = _pose(u, x)
                return (x_p - px) ** 2 + (y_p - py) ** 2 + 9 * (coupler - phi) ** 2

            total += apart(
                mpmath.findroot(
                    lambda u, apart=apart: mpmath.diff(apart, u), (guess - 0.02, guess + 0.02), solver="anderson"
                )
            )
        return [total]

    expected, gradient = _differences(squares, x)

    assert residuals @ residuals == pytest.approx(expected[0], rel=1e-12)
    assert 2.0 * residuals @ jacobian == pytest.approx(gradient[0], abs=1e-10)


def test_functions_between_outputs() -> None:
    over = (1.9, 2.0, 2.15, 2.3)
    target = FunctionTarget(
        name="t", of="coupler.phi", over="rocker.phi", points=[(r - 0.05, 0.6) for r in over], start=(-0.1, 0.2),
        begin="60 deg", end="220 deg",
    )  # fmt: skip

    def rows(x: Sequence[Any]) -> list[Any]:
        found = []
        for value in over:
            wanted = mpmath.mpf(value - 0.05) + x[6]
            u = mpmath.findroot(lambda u, wanted=wanted: _pose(u, x[:6])[5] - wanted, mpmath.mpf(2.4))
            found.append(_pose(u, x[:6])[4] - mpmath.mpf(0.6))
        return found

    _, x, residuals, jacobian = _of_kinfmu([target])

    expected, slopes = _differences(rows, x)

    assert x[6] == pytest.approx(0.065)
    assert residuals == pytest.approx(expected, abs=1e-11)
    assert jacobian == pytest.approx(slopes, abs=1e-10)


def test_measures_and_constraints() -> None:
    target = MeasureTarget(name="swing", of=kinfmu.measures.Range("s", of="rocker.phi"), value="40 deg")
    grashof = GrashofConstraint(
        name="turns", links=["ground", "crank", "2*coupler", "rocker"], shortest="crank", gap=2.0, weight=4.0
    )
    margin = MarginConstraint(name="margin", minimum=0.999, weight=1.0)

    def swing(x: Sequence[Any]) -> Any:
        g, a, b, c = x[:4]
        ends = [mpmath.acos((c**2 + g**2 - (b + side * a) ** 2) / (2 * c * g)) for side in (1, -1)]
        return ends[0] - ends[1] - mpmath.radians(40)

    def violation(x: Sequence[Any]) -> Any:  # 2 coupler is the longest link here
        size = (LENGTHS["ground"] + LENGTHS["crank"] + 2 * LENGTHS["coupler"] + LENGTHS["rocker"]) / 4
        return 2 * (x[1] + 2 * x[2] + 2 - x[0] - x[3]) / size

    _, x, residuals, jacobian = _of_kinfmu([target], constraints=[grashof, margin])

    values, slopes = _differences(lambda x: [swing(x), violation(x)], x)
    assert residuals[[0, 3]] == pytest.approx(values, abs=1e-9)
    assert jacobian[[0, 3]] == pytest.approx(slopes, abs=1e-7)
    assert residuals[1] > 0.0  # the margin is lower than its limit
    assert (residuals[[2, 4]] == 0.0).all()  # ground and rocker may be the longest link
    assert (residuals[5:] == 0.0).all()  # the crank is the shortest link
    assert np.abs(jacobian[1]).max() > 0.01
