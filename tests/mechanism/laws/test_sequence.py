"""Sequences: rises and dwells one after another, once or again and again."""

from __future__ import annotations

import math
from fractions import Fraction

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
from tests.mechanism.laws.test_closed_forms import motion

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
