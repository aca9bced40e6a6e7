"""Rises compared with their textbook formulas in 50 digits: values, derivatives, ends, continuity, peaks."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinfmu import (
    ConstantSpeed,
    Cycloidal,
    External,
    Harmonic,
    ModifiedSine,
    ModifiedTrapezoid,
    Polynomial,
    Polynomial345,
    Polynomial4567,
    SimpleHarmonic,
)
from kinfmu.mechanism.laws import RISES, Law, Rise
from kinfmu.plan.equations.taylor import Taylor
from kinfmu.solver.python.curve import curve
from tests.power_series import Real, Series, cos, mp, sin

pi = mp.pi
Formula = Callable[[Series], Series]


def simple_harmonic(x: Series) -> Series:
    return (1 - cos(pi * x)) / 2


def cycloidal(x: Series) -> Series:
    return x - sin(2 * pi * x) / (2 * pi)


def modified_sine(x: Series) -> Series:
    """Rothbart and Norton: three pieces over 1/8, 7/8."""
    k = 1 / (4 + pi)
    if x.c[0] < mp.mpf(1) / 8:
        return k * (pi * x - sin(4 * pi * x) / 4)
    if x.c[0] < mp.mpf(7) / 8:
        return k * (2 + pi * x - mp.mpf(9) / 4 * sin(4 * pi * x / 3 + pi / 3))
    return k * (4 + pi * x - sin(4 * pi * x) / 4)


def modified_trapezoid(x: Series) -> Series:
    """Norton's five pieces, with their decimal constants in closed form."""
    a = 8 * pi / (2 + pi)  # 4.888124
    v = 2 / (2 + pi)  # 0.38898448
    b = a / (16 * pi * pi)  # 0.0309544
    if x.c[0] < mp.mpf(1) / 8:
        return v * x - b * sin(4 * pi * x)
    if x.c[0] < mp.mpf(3) / 8:
        return a / 2 * x * x + (v - a / 8) * x + (a / 128 - b)  # 2.44406184, -0.22203097, 0.00723407
    if x.c[0] < mp.mpf(5) / 8:
        return (2 - v) * x - b * sin(4 * pi * x - pi) - (1 - v) / 2  # 1.6110154, -0.3055077
    if x.c[0] < mp.mpf(7) / 8:
        return 1 - modified_trapezoid(1 - x)
    return (1 - v) + v * x + b * sin(4 * pi * x - 3 * pi)


def polynomial_345(x: Series) -> Series:
    return x * x * x * (10 - 15 * x + 6 * x * x)


def polynomial_4567(x: Series) -> Series:
    return x * x * x * x * (35 - 84 * x + 70 * x * x - 20 * x * x * x)


FORMULAS: dict[type[Rise], Formula] = {
    SimpleHarmonic: simple_harmonic,
    Cycloidal: cycloidal,
    ModifiedSine: modified_sine,
    ModifiedTrapezoid: modified_trapezoid,
    Polynomial345: polynomial_345,
    Polynomial4567: polynomial_4567,
}
PEAKS = {  # of velocity and acceleration, as textbooks print them
    SimpleHarmonic: (1.571, 4.935),
    Cycloidal: (2.0, 6.283),
    ModifiedSine: (1.760, 5.528),
    ModifiedTrapezoid: (2.0, 4.888),
    Polynomial345: (1.875, 5.774),
    Polynomial4567: (2.188, 7.513),
}
SMOOTH = {SimpleHarmonic: 1, Polynomial4567: 3}  # derivatives that are continuous at the ends; 2 for the others
BREAKS = (0.0, 0.125, 0.375, 0.5, 0.625, 0.875, 1.0)

every_rise = pytest.mark.parametrize("cls", RISES, ids=lambda cls: cls.type)


def exact(law: Formula, x: float) -> list[Real]:
    """Value, first and second derivative."""
    c = law(Series([x, 1, 0])).c
    return [c[0], c[1], 2 * c[2]]


def motion(law: Law, x: float) -> list[float]:
    """Value, first and second derivative of a law."""
    u = law.at(Taylor.of(2, x, 1.0))
    return [u.derivative(k) for k in range(3)] if isinstance(u, Taylor) else [u, 0.0, 0.0]


def close(values: list[float], truth: list[Real], size: float = 1.0) -> Any:
    gaps = [abs(mp.mpf(value) - real) for value, real in zip(values, truth, strict=True)]
    return all(gap <= size * bound for gap, bound in zip(gaps, (4e-16, 4e-15, 4e-14), strict=True))


def test_every_rise_has_its_formula_here() -> None:
    assert set(FORMULAS) == set(PEAKS) == set(RISES)


@every_rise
@given(x=st.floats(0.0, 1.0, exclude_max=True))
def test_a_rise_is_its_textbook_formula_to_round_off(cls: type[Rise], x: float) -> None:
    values = [curve(cls.shape, order, x) for order in range(3)]
    assert close(values, exact(FORMULAS[cls], x))


@every_rise
@given(x=st.floats(0.0, 1.0))
def test_the_second_half_mirrors_the_first(cls: type[Rise], x: float) -> None:
    back = 1.0 - x  # rounded: compare where it is exact
    if 1.0 - back == x and x not in BREAKS:
        assert curve(cls.shape, 0, x) + curve(cls.shape, 0, back) == pytest.approx(1.0, abs=4e-16)
        assert curve(cls.shape, 1, x) == pytest.approx(curve(cls.shape, 1, back), abs=4e-15)
        assert curve(cls.shape, 2, x) == pytest.approx(-curve(cls.shape, 2, back), abs=4e-14)


@every_rise
def test_a_rise_is_at_rest_before_and_after(cls: type[Rise]) -> None:
    law = cls(rise=-3.0, duration=2.0, start=10.0, begin=1.0)
    for x in (-100.0, 0.0, math.nextafter(1.0, 0.0)):
        assert motion(law, x) == [10.0, 0.0, 0.0]
    for x in (3.0, 3.5, 1e6):
        assert motion(law, x) == [7.0, 0.0, 0.0]


@every_rise
@pytest.mark.parametrize("x", BREAKS)
def test_value_velocity_and_where_expected_acceleration_are_continuous(cls: type[Rise], x: float) -> None:
    orders = SMOOTH.get(cls, 2) if x in (0.0, 1.0) else 2
    for order in range(orders + 1):
        before, after = curve(cls.shape, order, math.nextafter(x, -1.0)), curve(cls.shape, order, x)
        assert after == pytest.approx(before, abs=1e-14 * 10.0**order)


def test_the_acceleration_of_a_simple_harmonic_rise_jumps_and_at_the_jump_the_right_hand_side_counts() -> None:
    law = SimpleHarmonic(rise=1.0, duration=1.0)
    assert motion(law, 0.0)[2] == pytest.approx(math.pi**2 / 2.0, rel=1e-15)
    assert motion(law, 1.0)[2] == 0.0


@every_rise
def test_peaks_are_those_of_the_textbooks(cls: type[Rise]) -> None:
    grid = [k / 20000.0 for k in range(20000)]
    velocity = max(curve(cls.shape, 1, x) for x in grid)
    acceleration = max(abs(curve(cls.shape, 2, x)) for x in grid)
    assert (velocity, acceleration) == pytest.approx(PEAKS[cls], abs=6e-4)
    assert curve(cls.shape, 1, 0.5) == pytest.approx(velocity, rel=1e-15)


@every_rise
@given(
    x=st.floats(-1.0, 5.0),
    rise=st.floats(-3.0, 3.0),
    duration=st.floats(0.5, 4.0),
    start=st.floats(-3.0, 3.0),
    begin=st.floats(-1.0, 1.0),
)
def test_a_rise_is_stretched_to_its_constants(
    cls: type[Rise], x: float, rise: float, duration: float, start: float, begin: float
) -> None:
    part = (x - begin) / duration
    if 0.01 < part < 0.99:
        scaled = (Series([x, 1, 0]) - begin) / duration
        c = (start + rise * FORMULAS[cls](scaled)).c
        law = cls(rise, duration, start, begin)
        assert motion(law, x) == pytest.approx([float(c[0]), float(c[1]), float(2 * c[2])], rel=1e-12, abs=2e-12)


@given(x=st.floats(-3.0, 3.0), c=st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=6))
def test_a_polynomial_is_the_sum_of_its_powers(x: float, c: list[float]) -> None:
    truth = [
        float(mp.fsum(mp.mpf(a) * mp.ff(k, order) * mp.mpf(x) ** max(k - order, 0) for k, a in enumerate(c)))
        for order in range(3)
    ]
    assert motion(Polynomial(tuple(c)), x) == pytest.approx(truth, rel=1e-12, abs=1e-11)


@given(x=st.floats(-3.0, 3.0), start=st.floats(-3.0, 3.0), speed=st.floats(-3.0, 3.0))
def test_uniform_motion_and_external_laws_are_lines(x: float, start: float, speed: float) -> None:
    assert motion(ConstantSpeed(start, speed), x) == pytest.approx([start + speed * x, speed, 0.0], abs=1e-15)
    assert motion(External(start), x) == [start, 0.0, 0.0]


@given(x=st.floats(-1e6, 1e6), a=st.floats(-3.0, 3.0), w=st.floats(-3.0, 3.0), p=st.floats(-3.0, 3.0))
def test_a_harmonic_law_is_a_sine_after_thousands_of_turns_too(x: float, a: float, w: float, p: float) -> None:
    angle = mp.mpf(w) * mp.mpf(x) + mp.mpf(p)
    truth = [0.5 + a * mp.sin(angle), a * w * mp.cos(angle), -a * w * w * mp.sin(angle)]
    assert motion(Harmonic(a, w, 0.5, p), x) == pytest.approx(list(map(float, truth)), abs=1e-13)
