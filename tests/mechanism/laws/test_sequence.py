"""Sequences, jumps and splines."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinfmu import (
    AngleDriver,
    Body,
    Cycloidal,
    Harmonic,
    Mechanism,
    MotionSequence,
    Polynomial,
    Polynomial345,
    Revolute,
    Segment,
    SimpleHarmonic,
    Spline,
    solve,
)
from kinfmu.mechanism.laws import LAWS, RISES, ConstantSpeed, ConstantValue, External, Law
from kinfmu.mechanism.laws.spline import ENDS, tridiagonal
from tests.mechanism.joints.drawn import splines
from tests.mechanism.laws.test_contract import motion
from tests.power_series import mp

UP_AND_DOWN = (
    Segment("dwell", 0.5),
    Segment("cycloidal", 1.0, 2.0),
    Segment("dwell", 0.25),
    Segment("3-4-5", 2.0, -2.0),
)
WHOLE = 3.75


def test_a_single_sequence_runs_its_segments_and_stays_at_the_last_value() -> None:
    law = MotionSequence((*UP_AND_DOWN[:3], Segment("3-4-5", 2.0, -1.5)), start=10.0, begin=1.0)
    assert motion(law, -5.0) == [10.0, 0.0, 0.0]
    assert motion(law, 1.25) == [10.0, 0.0, 0.0]
    up, down = Cycloidal(2.0, 1.0, 10.0, 1.5), Polynomial345(-1.5, 2.0, 12.0, 2.75)
    for x in (1.6, 2.0, 2.4):
        assert motion(law, x) == pytest.approx(motion(up, x), abs=1e-13)
    assert motion(law, 2.6) == [12.0, 0.0, 0.0]
    for x in (2.8, 3.7, 4.7):
        assert motion(law, x) == pytest.approx(motion(down, x), abs=1e-13)
    assert motion(law, 1e3) == [10.5, 0.0, 0.0]


@given(x=st.floats(-20.0, 20.0))
def test_a_repeated_sequence_is_periodic_before_its_begin_too(x: float) -> None:
    law = MotionSequence(UP_AND_DOWN, begin=1.0, repeat=True)
    once = MotionSequence(UP_AND_DOWN)
    since = (x - 1.0) % WHOLE
    assert law.at(x) == pytest.approx(once.at(since), abs=1e-12)


def test_repeated_steps_add_up() -> None:
    step = MotionSequence((Segment("modified_sine", 0.5, 0.25), Segment("dwell", 0.5)), repeat=True)
    assert [step.at(float(k)) for k in range(-2, 4)] == [-0.5, -0.25, 0.0, 0.25, 0.5, 0.75]
    assert step.at(100.75) == 25.25


def test_a_break_belongs_to_the_segment_that_follows() -> None:
    law = MotionSequence((Segment("simple_harmonic", 1.0, 1.0), Segment("simple_harmonic", 2.0, 1.0)))
    assert motion(law, 1.0) == pytest.approx(motion(SimpleHarmonic(1.0, 2.0, 1.0, 1.0), 1.0))
    assert motion(law, 1.0)[2] == pytest.approx(math.pi**2 / 8.0)


def test_constants_of_a_sequence_are_named_by_the_number_of_the_segment() -> None:
    law = MotionSequence(UP_AND_DOWN)
    names = ["start", "begin", "duration_1", "rise_2", "duration_2", "duration_3", "rise_4", "duration_4"]
    assert list(law.constants()) == names
    longer = law.with_numbers({("rise_2",): 5.0, ("duration_1",): 1.5})
    assert longer.at(2.6) == 5.0


TURN = 2.0 * math.pi


@pytest.mark.parametrize(
    ("law", "why"),
    [
        (MotionSequence(UP_AND_DOWN), "its sequence does not repeat; set repeat = true"),
        (
            MotionSequence(UP_AND_DOWN, repeat=True),
            "the durations of its sequence add up to 214.859173 deg, not to a turn of 360 deg; "
            "145.140827 deg are missing: add a dwell",
        ),
        (
            MotionSequence((Segment("dwell", 110.0), Segment("dwell", 250.0)), repeat=True),
            "the durations of its sequence add up to 20626.4806 deg, not to a turn of 360 deg; "
            "a bare angle is in radians: write '110 deg' for degrees",
        ),
        (MotionSequence((Segment("dwell", TURN),), repeat=True), ""),
        (
            MotionSequence((Segment("cycloidal", TURN, 0.25),), repeat=True),
            "the rises of its sequence add up to 0.25, not to 0",
        ),
        (Harmonic(1.0, 3.0), ""),
        (Harmonic(1.0, 2.5), "frequency = 2.5 must be a whole number of waves in a turn"),
        (Polynomial((2.0,)), ""),
        (Polynomial((2.0, 0.0)), ""),
        (Polynomial((2.0, 1.0)), "law 'polynomial' does not repeat"),
        (Cycloidal(1.0, TURN), "law 'cycloidal' does not repeat"),
        (Spline(tuple((k * TURN / 4.0, k % 4.0) for k in range(5)), "periodic"), ""),
        (Spline(tuple((k * TURN / 8.0, k % 4.0) for k in range(5)), "periodic"), ""),
        (
            Spline(tuple((float(k), k % 4.0) for k in range(5)), "periodic"),
            "its table spans 229.183118 deg, not a turn of 360 deg or a whole part of it",
        ),
        (Spline(tuple((float(k), k % 4.0) for k in range(5))), "its table does not repeat; set ends = 'periodic'"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_law_states_why_it_does_not_repeat_after_a_turn(law: Polynomial, why: str) -> None:
    assert law.why_not_periodic() == why


@pytest.mark.parametrize("turns", [0, 1, 1000, 10**6, -(10**6)])
@pytest.mark.parametrize("begin", [0.0, 0.1])
def test_a_repeating_sequence_is_exact_after_any_number_of_periods(turns: int, begin: float) -> None:
    """Oracle: durations added and whole periods taken off as fractions, without rounding."""
    segments = (Segment("3-4-5", 0.7, 0.25), Segment("dwell", 0.1), Segment("3-4-5", 1.3, -0.25))
    law = MotionSequence(segments, begin=begin, repeat=True)
    period = sum(Fraction(segment.duration) for segment in segments)
    for k in range(40):
        x = float(turns * period) + 0.0537 * k
        since, expected = (Fraction(x) - Fraction(begin)) % period, Fraction(0)
        for segment in segments:
            part = max(Fraction(0), min(Fraction(1), since / Fraction(segment.duration)))
            expected += Fraction(segment.rise) * (10 * part**3 - 15 * part**4 + 6 * part**5)
            since -= Fraction(segment.duration)
        assert law.at(x) == pytest.approx(float(expected), rel=0.0, abs=2e-16)


@pytest.mark.parametrize("engine", ["python", "native"])
def test_both_engines_are_exact_after_a_thousand_periods(engine: str) -> None:
    """The generated code forms the same sums and products: no compiler reorders them."""
    law = MotionSequence((Segment("3-4-5", 0.7, 0.25), Segment("3-4-5", 1.3, -0.25)), begin=0.1, repeat=True)
    mechanism = Mechanism(
        "lever",
        [Body("ground", {"O": (0.0, 0.0)}), Body("lever", {"O": (0.0, 0.0)}, (0.0, 0.0, 0.0))],
        [Revolute("O", ("ground.O", "lever.O"))],
        [AngleDriver("lever", "lever", law)],
    )
    times = 2000.0 + np.linspace(0.0, 2.0, 41)
    run = solve(mechanism, times, engine=engine)  # type: ignore[arg-type]
    assert run["lever.phi"].tolist() == pytest.approx([law.at(float(t)) for t in times], rel=0.0, abs=2e-16)
    assert (run.status == 0).all()


# ---------------------------------------------------------------------------------------------------------------- jumps


TABLE = ((0.0, 0.0), (1.0, 1.0), (2.5, 0.5), (3.0, 2.0))
SWINGS = (("simple_harmonic", 1.0, 0.5), ("dwell", 0.5), ("simple_harmonic", 1.5, -0.5), ("cycloidal", 1.0, 0.2))
EXAMPLES: dict[str, Law] = {
    "constant_speed": ConstantSpeed(0.3, 1.5),
    "external": External(0.2),
    "harmonic": Harmonic(1.0, 2.0),
    "constant": ConstantValue(0.75),
    "polynomial": Polynomial((0.5, 1.0, -0.25, 0.125)),
    **{rise.type: rise(rise=-1.5, duration=1.25, begin=0.75) for rise in RISES},
    "sequence": MotionSequence(SWINGS, begin=0.25),
    "repeating sequence": MotionSequence(SWINGS, begin=0.25, repeat=True),
    "spline": Spline(TABLE),
    "natural spline": Spline(TABLE, "natural"),
    "periodic spline": Spline(((0.0, 0.0), (1.0, 1.0), (2.5, 0.5), (3.0, 0.0)), "periodic"),
}
EXPECTED = {
    "simple_harmonic": [0.75, 2.0],
    "sequence": [0.25, 1.25, 1.75, 3.25],
    "repeating sequence": [0.25, 1.25, 1.75, 3.25, 4.25, 5.25, 5.75, 7.25, 8.25],
    "spline": [0.0, 3.0],
    "natural spline": [0.0, 3.0],
}
FIRST, LAST = -0.6, 8.4


def jumps(law: Law) -> list[float]:
    """Every argument between FIRST and LAST at which the law says that it jumps."""
    at, period = law.own_breaks()
    times = np.arange(-9.0, 10.0) if period else np.zeros(1)
    return sorted({round(float(x + k * period), 9) for x in at for k in times if FIRST < x + k * period < LAST})


def test_there_is_an_example_of_every_law() -> None:
    assert {type(law) for law in EXAMPLES.values()} == set(LAWS)


@pytest.mark.parametrize("name", EXAMPLES)
@pytest.mark.few(3)
def test_laws_jump_only_at_the_arguments_they_declare(name: str) -> None:
    law = EXAMPLES[name]
    expected = EXPECTED.get(name, [])
    found = jumps(law)
    assert [x for x in found if x > 0.0 or name != "repeating sequence"] == pytest.approx(expected, abs=1e-9)
    size = np.ptp([motion(law, x) for x in np.linspace(FIRST, LAST, 500)], axis=0) + 1e-12
    for x in found:
        gap = np.abs(np.subtract(motion(law, x + 1e-9), motion(law, x - 1e-9)))
        assert (gap / size).max() > 0.1
    for start, end in pairwise([FIRST, *found, LAST]):
        rows = np.array([motion(law, x) for x in np.linspace(start + 1e-9, end - 1e-9, 1500)])
        assert (np.abs(np.diff(rows, axis=0)) / size).max() < 0.05


def test_jumps_follow_the_constants() -> None:
    law = SimpleHarmonic(1.0, 2.0)
    assert law.breaks(2, start=0.0, rise=1.0, begin=3.0, duration=0.5).at == (3.0, 3.5)


# --------------------------------------------------------------------------------------------------------------- spline


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
