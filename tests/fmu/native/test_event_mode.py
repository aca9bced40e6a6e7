"""Co-simulation of FMI 3.0 with event mode and early return, against fine steps without them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fmpy import simulate_fmu

import kinfmu
from kinfmu import AngleDriver, Mechanism
from kinfmu.mechanism.laws import ConstantSpeed
from kinfmu.solver.python.pose import Status
from tests.fmu.conftest import Build, Start
from tests.fmu.host import DISCARD, ERROR, OK, WARNING, Host, answer
from tests.fmu.native.test_events import JUMPS, named
from tests.fmu.test_torque import motor, rocker
from tests.mechanisms import fourbar
from tests.motion.torque.test_torque_driven import heavy_tappet

Rows = list[tuple[float, list[float]]]
STEP, STOP = 0.4, 4.0


@pytest.fixture
def start(built_native: Build, opened: Start) -> Callable[..., Host]:
    """`start(mechanism, drive, events=, early=, **values)`: an initialized instance, in step mode."""

    def get(
        mechanism: Mechanism | str, drive: str = "time", *, events: bool = True, early: bool = True, **values: float
    ) -> Host:
        host = opened(built_native(mechanism, 3, drive), events=events, early=early)
        host.set(values)
        host.initialize(0.0)
        if events:
            host.fmu.enterStepMode()
        return host

    return get


def stepped(host: Host, names: tuple[str, ...], stop: float = STOP, step: float = STEP) -> tuple[Rows, Rows, Rows]:
    """Step to `stop`; return rows at communication points, and those before and in event mode."""
    rows, left, right = [(0.0, host.get(*names))], [], []
    t = 0.0
    while t < stop - 1e-9:
        end = step * round(t / step + 1.0 if abs(t / step - round(t / step)) < 1e-9 else math.ceil(t / step))
        event, terminates, early, reached = host.fmu.doStep(t, end - t)
        assert not terminates
        assert early == (reached < end)
        assert event or not early
        t = reached if early else end
        if not early:
            rows.append((t, host.get(*names)))
        if event:
            left.append((t, host.get(*names)))
            host.fmu.enterEventMode()
            assert not any(host.fmu.updateDiscreteStates()[:2])
            right.append((t, host.get(*names)))
            host.fmu.enterStepMode()
    return rows, left, right


@pytest.mark.parametrize("name", ["rise", "sequence", "spline", "smooth_rise"])
@pytest.mark.few(1)
def test_steps_end_at_the_jumps_of_laws_with_both_values(name: str, start: Callable[..., Host]) -> None:
    """Between them outputs are those of an instance without event mode; without jumps to the bit."""
    law, jumps = JUMPS[name]
    mechanism, names = named(name, law), ("arm0.phi", "arm0.omega", "arm0.alpha")
    rows, left, right = stepped(start(mechanism), names)
    assert [t for t, _ in left] == pytest.approx([jump for jump in jumps if jump < STOP], rel=1e-11)
    plain = start(mechanism, events=False)
    for k, (t, row) in enumerate(rows):
        assert t == pytest.approx(k * STEP)
        same = plain.get(*names)
        assert row == (pytest.approx(same, abs=1e-12) if left else same) or t in dict(left)
        plain.step(t, STEP)
    fine = kinfmu.solve(mechanism, np.add.outer([0.0, *(t for t, _ in left)], [-1e-8, 1e-8]).ravel())
    for k, (before, after) in enumerate(zip(left, right, strict=True)):
        for (_, row), place in ((before, 2 * k + 2), (after, 2 * k + 3)):
            assert row == pytest.approx([fine[one][place] for one in names], abs=1e-5)
        assert abs(before[1][2] - after[1][2]) > 0.1
        assert before[1][0] == pytest.approx(after[1][0], abs=1e-10)


def test_a_jump_at_the_end_of_a_step_is_an_event_without_early_return(start: Callable[..., Host]) -> None:
    mechanism, names = named("rise", JUMPS["rise"][0]), ("arm0.phi", "arm0.alpha")
    for early in (False, True):
        rows, left, right = stepped(start(mechanism, early=early), names, step=0.1)
        assert len(rows) == STOP / 0.1 + 1
        assert [t for t, _ in left] == pytest.approx([0.5, 2.0])
        assert [row[1] for _, row in left] == pytest.approx([0.0, -right[0][1][1]], abs=1e-9)
        assert right[1][1][1] == pytest.approx(0.0, abs=1e-9)
    coarse, none, _ = stepped(start(mechanism, early=False), names, step=0.8)
    assert not none
    assert coarse == rows[::8]


def test_loads_that_jump_and_breaks_of_cams_end_steps_under_torques(start: Callable[..., Host]) -> None:
    names = ("crank_angle", "crank_speed", "crank_acceleration")
    values = {"crank_speed": 3.0, "integrator.tolerance": 1e-12}
    rows, left, right = stepped(start(motor(), "torque", **values), names, stop=0.8)
    assert [t for t, _ in left] == pytest.approx([0.35, 0.45])
    plain = start(motor(), "torque", events=False, **values)
    fine = [plain.get(*names)]
    for k in range(80):
        assert plain.step(k * 0.01, 0.01) == OK
        fine.append(plain.get(*names))
    assert np.allclose([row for _, row in rows], fine[::40], rtol=1e-9)
    for (_, before), (_, after) in zip(left, right, strict=True):
        assert before == pytest.approx(after, rel=1e-9)  # a torque whose second derivative jumps
    assert left[0][1] == pytest.approx(fine[35], rel=1e-7)


def test_a_step_ends_past_a_break_of_a_cam(start: Callable[..., Host]) -> None:
    names, state = ("cam_angle", "cam_speed"), {"cam_angle": 0.0, "cam_speed": 10.0, "integrator.tolerance": 1e-12}
    rows, _, right = stepped(start(heavy_tappet("cycloidal"), "torque", **state), names, stop=0.8)
    plain = start(heavy_tappet("cycloidal"), "torque", events=False, **state)
    assert (plain.step(0.0, 0.4), plain.step(0.4, 0.4)) == (OK, OK)
    assert rows[-1][1] == pytest.approx(plain.get(*names), rel=1e-9)
    turns = np.array([row[0] for _, row in right]) / (2 * math.pi)
    assert len(turns) >= 4
    breaks = turns[:4] - np.floor(turns[:4])
    again = turns[4:8] - np.floor(turns[4:8])
    assert again == pytest.approx(breaks[: len(again)], abs=1e-9)


def test_a_motion_ends_at_its_limit(start: Callable[..., Host]) -> None:
    """A fall to a dead centre."""
    limit = -math.acos((2.0**2 + 1.0**2 - (0.9 + 1.5) ** 2) / (2 * 2.0 * 1.0))
    host = start(rocker(), "torque", crank_angle=0.5, crank_speed=0.1)
    _, terminates, early, reached = host.fmu.doStep(0.0, 1.0)
    assert (terminates, early) == (True, True)
    assert reached == pytest.approx(0.693189, abs=1e-5)
    assert host.get("crank_angle")[0] == pytest.approx(limit, abs=1e-4)
    assert host.status() < Status.OUTSIDE
    (discarded, why), (warned, end) = host.messages[-2:]
    assert (discarded, warned) == (DISCARD, WARNING)
    assert "the motion ends at a limit" in why
    assert end == f"the step ends at t = {reached:.12g} s, before this limit"
    later = host.fmu.doStep(reached, 0.1)
    assert later[1]
    assert later[3] < reached + 1e-5


def test_a_law_past_a_limit_leads_to_it(start: Callable[..., Host]) -> None:
    limit = math.acos((2.0**2 + 1.0**2 - (0.9 + 1.5) ** 2) / (2 * 2.0 * 1.0))
    rocking = fourbar(2.0, 1.0, 0.9, 1.5)
    turned = AngleDriver("crank", "crank", ConstantSpeed(start=0.5, speed=1.0))
    host = start(replace(rocking, name="turned", drivers=(turned,)))
    _, terminates, early, reached = host.fmu.doStep(0.0, 10.0)
    assert (terminates, early) == (True, True)
    assert limit - 2e-8 < 0.5 + reached < limit + 1e-9
    assert host.get("driven.crank_angle")[0] == 0.5 + reached


def test_fmpy_records_both_sides_of_each_jump(built_native: Build) -> None:
    path = built_native(named("rise", JUMPS["rise"][0]), 3, "time")
    options: dict[str, Any] = {"fmi_type": "CoSimulation", "output_interval": 0.3, "stop_time": 3.9}
    plain = simulate_fmu(str(path), **options)
    same = simulate_fmu(str(path), **options, use_event_mode=True)
    early = simulate_fmu(str(path), **options, use_event_mode=True, early_return_allowed=True)
    assert np.array_equal(plain, same)
    times, counts = np.unique(np.round(early["time"], 9), return_counts=True)
    assert times[counts == 2].tolist() == pytest.approx([0.5, 2.0])
    assert len(times) == len(plain) + 2


def test_modes_are_entered_in_their_order_only(start: Callable[..., Host]) -> None:
    host = start("fourbar")
    assert answer(host.fmu.enterStepMode) == ERROR
    host.fmu.enterEventMode()
    assert host.step(0.0, 0.1) == ERROR
    assert host.messages[-1][1].startswith("doStep before the end of initialization, in event mode")
    state = host.state()
    host.fmu.enterStepMode()
    assert host.step(0.0, 0.1) == OK
    host.restore(state)
    assert host.step(0.0, 0.1) == ERROR
    plain = start("fourbar", events=False)
    assert answer(plain.fmu.enterEventMode) == ERROR
    assert answer(plain.fmu.enterStepMode) == ERROR
    state, data = None, host.serialize(state)
    plain.restore(plain.deserialize(data))
    assert plain.step(0.0, 0.1) == OK  # the mode of the state does not change what the host asked for
