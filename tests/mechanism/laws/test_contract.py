"""Contract of laws, and their closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kinfmu
import kinfmu.mechanism.laws
from kinfmu import (
    AngleDriver,
    Body,
    ConstantSpeed,
    Cycloidal,
    External,
    Mechanism,
    ModifiedSine,
    ModifiedTrapezoid,
    Polynomial345,
    Polynomial4567,
    Revolute,
    SimpleHarmonic,
)
from kinfmu.errors import MechanismError
from kinfmu.mechanism.laws import LAWS, RISES, Harmonic, Law, MotionSequence, Polynomial, Rise, Spline
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text
from kinfmu.plan.equations.graph import Graph, evaluate
from kinfmu.plan.equations.taylor import Taylor
from kinfmu.solver.python.curve import curve
from kinfmu.solver.python.pose import Status
from tests.mechanism.joints.drawn import coordinates, laws, splines
from tests.power_series import Real, Series, cos, mp, sin

HARMONIC = Harmonic(amplitude=1.0, frequency=100.0)
every_law = pytest.mark.parametrize("cls", LAWS, ids=lambda cls: cls.type)


def driven(law: Law) -> Mechanism:
    """An arm that turns by a law."""
    return Mechanism(
        "arm",
        (Body("ground", {"O": (0, 0)}), Body("arm", {"O": (0, 0)}, (0, 0, 0))),  # type: ignore[dict-item,arg-type]
        (Revolute("O", ("ground.O", "arm.O")),),
        (AngleDriver("arm", "arm", law),),
    )


@every_law
@given(data=st.data())
def test_steps_of_a_path_through_a_law_never_turn_back_and_are_bounded(cls: type[Law], data: st.DataObject) -> None:
    """Where there are none, the law is straight; tables are bent at their ends."""
    law = data.draw(laws(cls))
    constants = {name: constant.value for name, constant in law.constants().items()}
    x = np.sort(data.draw(st.lists(coordinates, min_size=2, max_size=8)))
    steps = [float(law.fewest_steps(float(at), **constants)) for at in x]
    changes = np.diff(steps)
    slack = 1e-9 * (1.0 + max(map(abs, steps)))
    assert (changes >= -slack).all() or (changes <= slack).all()
    assert (np.abs(changes) <= float(law.most_steps(**constants)) * np.diff(x) + slack).all()
    if cls not in (Polynomial, Spline) and np.ptp(steps) == 0.0:
        middle = law.at(0.5 * (x[0] + x[-1]))
        assert middle == pytest.approx(0.5 * (law.at(x[0]) + law.at(x[-1])), abs=1e-9)


@every_law
@given(data=st.data())
def test_numbers_that_a_law_adds_are_as_large_as_its_breaks_and_its_period(cls: type[Law], data: st.DataObject) -> None:
    law = data.draw(laws(cls))
    added = float(law.most_added(**{name: constant.value for name, constant in law.constants().items()}))
    breaks, period = law.own_breaks()
    assert max(map(abs, (*breaks, period))) <= added * (1.0 + 1e-11)


@every_law
@given(data=st.data(), x=coordinates)
def test_a_traced_law_has_the_bits_of_the_formula_and_its_exact_derivatives(
    cls: type[Law], data: st.DataObject, x: float
) -> None:
    law = data.draw(laws(cls))
    constants = {name: constant.value for name, constant in law.constants().items()}
    graph = Graph()
    argument = graph.symbol("x")
    target = graph.lift(law.target(argument, **{name: graph.symbol(name) for name in constants}))
    (rate,) = graph.derivative([target], {argument: graph.constant(1.0)})
    (acceleration,) = graph.derivative([rate], {argument: graph.constant(1.0)})
    traced = evaluate([target, rate, acceleration], {"x": x, **constants})
    assert traced[0] == law.at(x)
    series = law.target(Series([x, 1, 0, 0]), **constants)
    terms = series.c if isinstance(series, Series) else [series, 0.0, 0.0, 0.0]
    exact = [float(c * math.factorial(k)) for k, c in enumerate(terms)]
    size = 1.0 + max(map(abs, exact[:3]))
    longest = 1.0 + abs(x) + sum(segment.duration for segment in getattr(law, "segments", ()))
    shift = longest * np.finfo(float).eps  # of an argument that is reduced to the period
    for order in range(3):
        assert traced[order] == pytest.approx(exact[order], rel=1e-12, abs=1e-13 * size + shift * abs(exact[order + 1]))


@every_law
@given(data=st.data(), x=coordinates)
def test_a_law_with_its_own_numbers_or_read_from_a_file_is_equal(cls: type[Law], data: st.DataObject, x: float) -> None:
    law = data.draw(laws(cls))
    again = law.with_numbers({path: constant.value for path, constant in law.numbers().items()})
    assert again == law
    assert hash(again) == hash(law)
    law.check("[drivers.arm]")
    assert again.at(x) == law.at(x)
    mechanism = driven(law)
    assert parse(text(mechanism)) == mechanism


@pytest.mark.parametrize("cls", [*RISES, MotionSequence], ids=lambda cls: cls.type)
@given(data=st.data())
def test_numbers_that_must_be_positive_are_checked(cls: type[Law], data: st.DataObject) -> None:
    law = data.draw(laws(cls))
    for path, (_, measures) in law.numbers().items():
        wrong = law.with_numbers({**{p: c.value for p, c in law.numbers().items()}, path: 0.0})
        if measures.is_positive:
            with pytest.raises(MechanismError, match=rf"^\[drivers.arm\] {path[0]} = 0.0 must be positive$"):
                driven(wrong)


@st.composite
def turning(draw: st.DrawFn) -> Law:
    """Draw laws that are periodic over a turn."""
    spline = draw(splines("periodic"))
    first, width = spline.points[0][0], spline.points[-1][0] - spline.points[0][0]
    scaled = tuple((first + (x - first) * 2.0 * math.pi / width, u) for x, u in spline.points)
    sequence = draw(laws(MotionSequence).filter(lambda law: len(law.segments) > 1))
    whole = sum(segment.duration for segment in sequence.segments)
    segments = [
        segment._replace(duration=segment.duration * 2.0 * math.pi / whole, rise=0.0) for segment in sequence.segments
    ]
    rising = [k for k, segment in enumerate(segments) if segment.law != "dwell"]
    if len(rising) > 1:
        for k, rise in zip(rising[:2], (1.5, -1.5), strict=True):
            segments[k] = segments[k]._replace(rise=rise)
    return draw(
        st.sampled_from(
            [
                Spline(scaled, "periodic"),
                replace(sequence, segments=tuple(segments), repeat=True),
                Harmonic(draw(coordinates), float(draw(st.integers(-3, 3)))),
                Polynomial((draw(coordinates),)),
            ]
        )
    )


@given(law=turning(), x=coordinates)
def test_a_law_declared_periodic_over_a_turn_is_periodic(law: Law, x: float) -> None:
    assert law.why_not_periodic() == ""
    assert law.at(x + 2.0 * math.pi) == pytest.approx(law.at(x), abs=1e-11)  # x + 2 pi is rounded, and slopes are steep


@every_law
@given(data=st.data())
def test_a_time_at_which_a_law_has_no_value_is_outside(cls: type[Law], data: st.DataObject) -> None:
    """Or has numbers, without an error of Python: phases and powers of such times overflow."""
    mechanism = driven(data.draw(laws(cls)))
    run = kinfmu.solve(mechanism, [mechanism.run.start, 1e300, -1e300, 1.7e308], engine="python")
    for status, row in zip(run.status, np.hstack([run.values, run.rates]), strict=True):
        assert status in (Status.OK, Status.OUTSIDE)
        assert not (status == Status.OK and np.isnan(row).any())


@pytest.mark.parametrize("engine", ["python", "native"])
def test_a_harmonic_law_at_the_largest_times_is_outside(
    engine: Literal["python", "native"], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("KINFMU_CACHE", str(tmp_path))
    run = kinfmu.solve(driven(HARMONIC), [0.0, 1e308, 1e308], engine=engine)
    assert run.status.tolist() == [Status.OK, Status.OUTSIDE, Status.OUTSIDE]
    assert "arm = nan rad (nan deg) is not a finite number" in run.events[0].text


def test_an_fmu_at_such_a_time_discards_the_step(tmp_path: Path) -> None:
    fmu = kinfmu.build(driven(HARMONIC), tmp_path / "arm.fmu", flavour="python")
    stepped = kinfmu.simulate(fmu, start=0.0, stop=1e308, step=1e308)
    assert stepped.status.tolist() == [Status.OK, Status.OUTSIDE]
    assert stepped.events[-1].text == "at t = 1e+308 s: arm = nan rad (nan deg) is not a finite number"


# --------------------------------------------------------------------------------------------------------- closed forms


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
