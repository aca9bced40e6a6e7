"""Events of model exchange: discrete variables change at events only, and jumps of laws are announced."""

from __future__ import annotations

import math
from typing import Any

import pytest

from kinfmu import MotionSequence, Spline
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.laws import Cycloidal, Harmonic, Law, SimpleHarmonic
from kinfmu.solver.python.pose import Status
from tests.fmu.conftest import Start
from tests.fmu.host import OK, Host, answer
from tests.fmu.test_laws import arms
from tests.gallery_members import mostly_long

SWINGS = (("simple_harmonic", 1.0, 0.5), ("dwell", 0.5), ("simple_harmonic", 1.5, -0.5), ("cycloidal", 1.0, 0.2))
JUMPS: dict[str, tuple[Law, list[float]]] = {
    "rise": (SimpleHarmonic(2.0, 1.5, begin=0.5), [0.5, 2.0]),
    "smooth_rise": (Cycloidal(2.0, 1.5, begin=0.5), []),
    "harmonic": (Harmonic(1.0, 2.0), []),
    "sequence": (
        MotionSequence(SWINGS, begin=0.3, repeat=True),
        [0.3, 1.3, 1.8, 3.3, 4.3, 5.3, 5.8, 7.3, 8.3, 9.3, 9.8],
    ),
    "spline": (Spline(((0.7, 0.0), (1.0, 1.0), (2.5, 0.5), (3.1, 2.0))), [0.7, 3.1]),
}


def named(name: str, *laws: Law) -> Mechanism:
    from dataclasses import replace

    return replace(arms(*laws), name=f"events_{name}")


def next_event(host: Host) -> float | None:
    """Return the time of the next event, from the update of discrete states."""
    if host.fmi == 2:
        *_, defined, time = host.fmu.newDiscreteStates()
    else:
        *_, defined, time = host.fmu.updateDiscreteStates()
    return float(time) if defined else None


def at_event(host: Host, time: float) -> float | None:
    """Handle the event at a time; return the time of the next one."""
    host.fmu.setTime(time)
    assert answer(host.fmu.completedIntegratorStep) == OK
    host.fmu.enterEventMode()
    following = next_event(host)
    host.fmu.enterContinuousTimeMode()
    return following


def begin(start: Start, mechanism: Mechanism | str, drive: str = "time") -> tuple[Host, float | None]:
    host = start(mechanism, drive, initialize=False, model_exchange=True)
    host.initialize(0.0)
    event = next_event(host)
    host.fmu.enterContinuousTimeMode()
    return host, event


@pytest.mark.parametrize("name", mostly_long(JUMPS, few=("harmonic", "sequence")))
@pytest.mark.few(1)
def test_every_jump_of_a_law_is_announced_and_has_its_right_hand_value(start: Start, name: str) -> None:
    law, expected = JUMPS[name]
    host, event = begin(start, named(name, law))
    found = []
    while event is not None and event < 10.0:
        found.append(event)
        host.fmu.setTime(event - 1e-7)
        before = host.get("arm0.alpha", "arm0.omega")
        event = at_event(host, event)
        reached = host.get("arm0.alpha", "arm0.omega")
        host.fmu.setTime(found[-1] + 1e-7)
        beyond = host.get("arm0.alpha", "arm0.omega")
        assert reached == pytest.approx(beyond, abs=1e-4)
        assert max(abs(left - right) for left, right in zip(before, reached, strict=True)) > 0.1
    assert found == pytest.approx(expected, rel=1e-11)  # a spline's table reaches 1e-12 of its width further


@pytest.mark.few(1)
def test_the_next_event_follows_tunable_constants_and_there_is_none_when_inputs_drive(start: Start) -> None:
    host, event = begin(start, named("rise", JUMPS["rise"][0]))
    assert event == pytest.approx(0.5)
    host.fmu.enterEventMode()
    host.set({"arm0.begin": 0.75})
    assert next_event(host) == pytest.approx(0.75)
    driven = start(named("rise", JUMPS["rise"][0]), "inputs", initialize=False, model_exchange=True)
    driven.initialize(0.0)
    assert next_event(driven) is None


@pytest.mark.few(1)
def test_of_several_drivers_the_earliest_event_comes_next(start: Start) -> None:
    laws = (SimpleHarmonic(1.0, 1.0, begin=0.25), SimpleHarmonic(1.0, 1.0, begin=0.5), Harmonic(1.0, 2.0))
    host, event = begin(start, named("several", *laws))
    found: list[Any] = []
    while event is not None:
        found.append(event)
        event = at_event(host, event)
    assert found == pytest.approx([0.25, 0.5, 1.25, 1.5], rel=1e-13)


def test_discrete_variables_change_only_at_events_and_a_new_status_asks_for_one(start: Start) -> None:
    host, _ = begin(start, "fourbar", "inputs")  # a parallelogram: bridged at 0 and pi
    assert host.status() == Status.BRIDGED
    wanted = []
    for k in range(1, 12):
        host.fmu.setTime(0.01 * k)
        host.set({"crank_angle": 0.3 * k})
        assert host.status() == Status.BRIDGED
        wants, terminate = host.fmu.completedIntegratorStep()
        assert not terminate
        wanted.append(bool(wants))
        if k == 5:
            host.fmu.enterEventMode()
            assert host.status() == Status.OK
            host.fmu.enterContinuousTimeMode()
            break
    assert wanted == [True] * 5
    host.set({"crank_angle": math.pi})
    assert host.status() == Status.OK
    assert host.fmu.completedIntegratorStep()[0]
    host.fmu.enterEventMode()
    assert host.status() == Status.BRIDGED


def test_iterations_are_those_at_the_last_event(start: Start) -> None:
    host, _ = begin(start, "crank_rocker", "inputs")
    before = host.count("solver.iterations")
    host.set({"crank_angle": host.get("crank_angle")[0] + 0.3})
    assert host.count("solver.iterations") == before
    host.fmu.enterEventMode()
    assert host.count("solver.iterations") > before


def test_an_unreachable_pose_is_discard_before_the_event_and_in_the_status_after_it(start: Start) -> None:
    host, _ = begin(start, "double_pendulum", "inputs")
    host.set({"crank_angle": 6.5})
    assert host.status() == Status.OK
    assert host.message() == ""
    assert answer(host.get, "upper.phi") == 2
    host.fmu.enterEventMode()
    assert host.status() == Status.OUTSIDE
    assert "crank = 6.5 rad" in host.message()
