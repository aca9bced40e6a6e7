"""Change points on the smooth branch, with steps of all sizes; with lengths close to one, right or reported as outside.

`pytest --grids 200 tests/solver/test_change_points.py` takes the grids in full.
"""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from numpy.typing import NDArray

import kinfmu
from kinfmu import Status
from tests import oracle
from tests.gallery_members import mostly_long
from tests.power_series import mp
from tests.solver.change_points import Case, change_point_cases, fourbar, grid, reference, slider_crank, two_loops

SHORT = 400  # samples of a grid in the usual run
RIGHT = (1e-12, 1e-10, 1e-8)  # q, qd, qdd at speed 1
OFF = ("1e-6", "-1e-6", "1e-8", "-1e-8", "1e-10", "-1e-10", "1e-11", "-1e-11")
FOURBARS = (("4", "1", "3", "2"), ("2", "1", "2", "1"))

CASES = [pytest.param(case, id=case.name) for case in change_point_cases()]
FEW = [
    one if one.id in ("4-1-3-2", "2-1-2-1 crossed") else pytest.param(*one.values, id=one.id, marks=pytest.mark.long)
    for one in CASES
]


@pytest.fixture
def grids(request: pytest.FixtureRequest) -> tuple[int, int | None]:
    """How many grids, and the most samples of each."""
    count = request.config.getoption("--grids")
    return (8, SHORT) if count is None else (count, None)


def off(length: str, by: str) -> str:
    """A decimal length, changed."""
    return str(mp.nstr(mp.mpf(length) + mp.mpf(by), 20))


# ------------------------------------------------------------------------------------ the closed forms, by 50 digits


@pytest.mark.parametrize("lengths", [*FOURBARS, ("4.000001", "1", "3", "2"), ("2", "1", "2.0000000001", "1")])
@pytest.mark.parametrize("branch", [1, -1])
def test_closed_form_of_a_fourbar_has_18_digits(lengths: tuple[str, str, str, str], branch: int) -> None:
    case = fourbar(*lengths, branch=branch)
    u = [0.003, 0.4, 1.0, 2.9, 3.13]  # up to the change point the oracle's branch is the smooth one
    exact = oracle.fourbar(*lengths, u, branch=branch)
    ours = case.motion(np.array(u, dtype=np.longdouble))
    for order in range(3):
        table = np.column_stack([ours[f"{body}.phi"][order] for body in ("crank", "coupler", "rocker")])
        gaps = np.array(
            [
                [float(mp.mpf(mp.mpf(str(a)) - b)) for a, b in zip(*row, strict=True)]
                for row in zip(table, exact[order], strict=True)
            ]
        )
        turns = math.tau if order == 0 else math.inf
        gaps = np.abs(np.remainder(gaps + turns / 2, turns) - turns / 2) if order == 0 else np.abs(gaps)
        assert gaps.max() < (3e-16, 1e-13, 1e-9)[order]


@pytest.mark.parametrize("case", FEW)
@pytest.mark.few(1)
def test_closed_form_is_the_smooth_branch_through_the_change_points(case: Case) -> None:
    """Against the residuals alone, followed in small steps with 50 digits."""
    numbers = case.name.removesuffix(" crossed")
    u = [3.0, math.pi, 3.2, math.tau, 6.5]
    if numbers.startswith("slider"):

        def residual(q, u):  # type: ignore[no-untyped-def]
            return [oracle.cos(u) + oracle.cos(q[0]) - q[1], oracle.sin(u) + oracle.sin(q[0])]

        names = ("rod.phi", "slider.x")
    else:
        g, a, b, c = map(mp.mpf, numbers.split("-"))

        def residual(q, u):  # type: ignore[no-untyped-def]
            return [
                oracle.cos(u) * a + oracle.cos(q[0]) * b - oracle.cos(q[1]) * c - g,
                oracle.sin(u) * a + oracle.sin(q[0]) * b - oracle.sin(q[1]) * c,
            ]

        names = ("coupler.phi", "rocker.phi")
    start = case.motion(np.array([1.0], dtype=np.longdouble))
    exact = oracle.follow(residual, [float(start[name][0][0]) for name in names], 1.0, u, step=0.2)
    ours = case.motion(np.array(u, dtype=np.longdouble))
    for order in range(3):
        table = np.column_stack([ours[name][order] for name in names]).astype(float)
        assert oracle.largest_error(table, exact[order]) < 1e-14


# --------------------------------------------------------------------------------------------------- the branch, kept


@pytest.mark.parametrize("speed", [1.0, math.pi / 180.0])
def test_reference_fourbar_stays_a_parallelogram_on_every_grid(grids: tuple[int, int | None], speed: float) -> None:
    count, most = grids
    case = reference()
    for seed in range(count):
        run = case.run(grid(seed, 0.01, 170.0, most=most), crank_speed=speed)
        assert run.good.all()
        assert (case.errors(run, speed).max(axis=0) <= RIGHT).all(), f"grid {seed}"


@pytest.mark.parametrize("case", CASES)
@pytest.mark.few(1)
def test_the_smooth_branch_is_kept_on_every_grid(case: Case, grids: tuple[int, int | None]) -> None:
    count, most = grids
    for seed in range(count):
        run = case.run(grid(seed, 0.01, 30.0, most=most))
        assert run.good.all()
        assert (case.errors(run).max(axis=0) <= RIGHT).all(), f"grid {seed}"


@pytest.mark.parametrize("case", [pytest.param(reference(), id="reference"), *CASES])
@pytest.mark.few(3)
def test_at_a_change_point_and_as_near_as_doubles_go_nothing_is_lost(case: Case) -> None:
    quarter = math.pi / 2.0 if case.name.startswith("slider") else 0.0
    near = [0.0, *(side * 10.0**-k for k in range(1, 13) for side in (1.0, -1.0))]
    for turns in range(-2, 4):
        u = [quarter + turns * math.pi + offset for offset in near]
        for order in (u, u[::-1]):
            run = case.run(order)
            assert run.good.all()
            assert (case.errors(run).max(axis=0) <= RIGHT).all()


@pytest.mark.parametrize("case", [pytest.param(reference(), id="reference"), *CASES])
@pytest.mark.parametrize("first", [0.0, math.pi, math.pi / 2.0, -9.0 * math.pi, 40.0])
@pytest.mark.few(13)
def test_a_run_may_begin_anywhere(case: Case, first: float) -> None:
    run = case.run([first, first + 0.5, first - 4.0])
    assert run.good.all()
    assert (case.errors(run).max(axis=0) <= RIGHT).all()


@pytest.mark.parametrize("case", [pytest.param(reference(), id="reference"), *CASES])
@pytest.mark.few(2)
def test_going_back_jumps_of_many_turns_and_any_order_arrive_where_small_steps_arrive(case: Case) -> None:
    rng = random.Random(7)  # noqa: S311  # samples, not secrets
    u = [rng.choice([rng.uniform(-60.0, 60.0), round(rng.uniform(-19, 19)) * math.pi]) for _ in range(60)]
    run = case.run(u)
    assert run.good.all()
    assert (case.errors(run).max(axis=0) <= RIGHT).all()


# ------------------------------------------------------------------------------------------ several of them, close by


@pytest.mark.parametrize("apart", [0.3, 0.1, 0.06, 0.03, 0.01, 4e-3, 1e-3, 1e-5, 0.0])
@pytest.mark.few(2)
def test_change_points_of_two_loops_are_bridged_apart_or_together(apart: float, grids: tuple[int, int | None]) -> None:
    count, most = grids
    case = two_loops(apart)
    between = [math.pi - apart * part for part in (-0.5, 0.0, 0.3, 0.5, 1.0, 1.3, 2.0)]
    for seed in range(4 if most else count):
        run = case.run([*grid(seed, 0.1, 60.0, turns=1, most=most), *between, *reversed(between)])
        assert run.good.all()
        errors = case.errors(run)
        assert ((errors <= RIGHT) | (errors <= run.error)).all()
        assert (errors.max(axis=0) <= (1e-11, 1e-8, 1e-5)).all()


# ----------------------------------------------------------------------------- lengths that all but make change points


def changed(by: str) -> list[Case]:
    """Every change-point mechanism with one of its lengths changed."""
    cases = []
    for lengths in FOURBARS:
        for k in range(4):
            new = tuple(off(length, by) if i == k else length for i, length in enumerate(lengths))
            cases += [fourbar(*new, branch=branch) for branch in (1, -1)]
    return [*cases, slider_crank("1", off("1", by))]


def gaps(case: Case) -> NDArray[np.float64]:
    """Crank angles where a mechanism does not close: what opens does so around multiples of pi/2."""
    u = np.arange(-4, 17) * (math.pi / 2.0)
    exact = case.motion(u.astype(np.longdouble))
    return u[np.any([np.isnan(f) for f, _, _ in exact.values()], axis=0)]


@pytest.mark.parametrize("by", mostly_long(OFF, few=("1e-6", "-1e-8", "-1e-11")))
@pytest.mark.few(1)
def test_near_a_change_point_samples_are_right_within_their_estimate_or_outside(
    by: str, grids: tuple[int, int | None]
) -> None:
    count, most = grids
    for case in changed(by)[OFF.index(by) % 3 :: 3] if most else changed(by):
        open_at = gaps(case)
        for seed in range(1 if most else count):
            run = case.run(grid(seed, 0.1 if most else 0.01, 30.0, turns=1, most=150 if most else None))
            errors = case.errors(run)
            where = f"{case.name}, grid {seed}"
            assert (run.status[~run.good] == Status.OUTSIDE).all(), where
            assert (run.status != Status.BRIDGED).all(), where
            assert ((errors <= RIGHT) | (errors <= run.error))[run.good].all(), where
            last = case.mechanism.drivers[0].law.start
            for u, good, exact in zip(run.inputs[:, 0], run.good, errors, strict=True):
                passed = (min(u, last) < open_at) & (open_at < max(u, last))
                assert good or passed.any() or np.isnan(exact).any(), where
                last = u if good else last


@pytest.mark.parametrize("by", ["1e-12", "-1e-12", "1e-13", "-1e-14"])
@pytest.mark.few(2)
def test_a_length_within_1e_12_of_a_change_point_counts_as_one(by: str) -> None:
    for case in change_point_cases():
        lengths = ("1", "1") if case.name.startswith("slider") else tuple(case.name.removesuffix(" crossed").split("-"))
        near = (*lengths[:-1], off(lengths[-1], by))
        branch = -1 if case.name.endswith("crossed") else 1
        moved = slider_crank(*near) if len(near) == 2 else fourbar(*near, branch=branch)
        run = kinfmu.solve(moved.mechanism, crank_angle=[0.0, 0.7, math.pi / 2.0, 3.0, math.pi, 3.3, math.tau, 9.0])
        assert run.good.all()
        assert Status.BRIDGED in run.status
        errors = case.errors(run)
        assert (errors.max(axis=0) <= (3e-11, 3e-9, 3e-8)).all(), case.name
