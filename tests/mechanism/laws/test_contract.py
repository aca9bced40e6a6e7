"""Contract of laws, tested for all members of LAWS."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kinfmu
import kinfmu.mechanism.laws
from kinfmu import AngleDriver, Body, Mechanism, Revolute
from kinfmu.errors import MechanismError
from kinfmu.mechanism.laws import LAWS, RISES, Harmonic, Law, MotionSequence, Polynomial, Spline
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text
from kinfmu.plan.equations.graph import Graph, evaluate
from kinfmu.solver.python.pose import Status
from tests.mechanism.joints.drawn import coordinates, laws, splines
from tests.power_series import Series

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
