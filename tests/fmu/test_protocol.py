"""What a host may rely on: set then get, commit by doStep, discard and recovery, state, several slaves at once."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from kinfmu.solver.python import Solver, Status
from tests.fmu.host import DISCARD, LAST_SUCCESSFUL_TIME, TERMINATED, Host

Start = Callable[..., Host]
COUPLER = ("coupler.x", "coupler.vx", "coupler.ax")


def _counting(run: Callable[..., object], name: str, calls: dict[str, int]) -> Callable[..., object]:
    def counting(*args: object) -> object:
        calls[name] = calls.get(name, 0) + 1
        return run(*args)

    return counting


def _counted(monkeypatch: pytest.MonkeyPatch, host: Host) -> dict[str, int]:
    """How often the slave's solver is called from here on; its modules are those inside the FMU."""
    import sys

    (solver,) = {
        module.Solver
        for name, module in sys.modules.items()
        if name.startswith(f"kinfmu_{host.about.interface.name}_{host.about.token[1:9]}") and name.endswith(".solver")
    }
    assert solver is not Solver
    calls: dict[str, int] = {}
    for method in ("solve", "outputs", "rates", "accelerations", "errors", "margin"):
        monkeypatch.setattr(solver, method, _counting(getattr(solver, method), method, calls))
    return calls


def test_fresh_slave_holds_a_pose_at_the_law_s_start(start: Start) -> None:
    host = start("double_pendulum", "inputs", initialize=False)
    assert host.get("crank_angle", "upper.phi", "upper.x") == pytest.approx([5 * math.pi / 3, 5 * math.pi / 3, 0.5])
    assert host.status() <= Status.BRIDGED


def test_outputs_follow_a_set_input_at_once(start: Start) -> None:
    host = start()
    host.set({"crank_angle": 0.5, "crank_speed": 2.0, "crank_acceleration": 3.0})
    x, vx, ax = host.get(*COUPLER)
    c, s = math.cos(0.5), math.sin(0.5)
    assert (x, vx, ax) == pytest.approx((1 + c, -2 * s, -3 * s - 4 * c), abs=1e-12)


def test_trial_values_never_influence_a_result(start: Start) -> None:
    direct, trying = start(), start()
    for k in range(5):
        for wild in (2.0, -4.0, 30.0):
            trying.set({"crank_angle": wild})
            trying.outputs()
        for host in (direct, trying):
            host.set({"crank_angle": 0.3 + 0.7 * k})
        assert direct.outputs() == trying.outputs()
        assert direct.step(0.1 * k, 0.1)
        assert trying.step(0.1 * k, 0.1)


def test_unchanged_input_costs_no_solve_and_later_stages_wait_until_read(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    host = start()
    host.set({"crank_angle": 0.5})
    calls = _counted(monkeypatch, host)
    assert host.get("coupler.x") == pytest.approx([1 + math.cos(0.5)])
    assert calls == {"solve": 1, "outputs": 1}
    host.get("coupler.x", "rocker.phi")
    host.set({"crank_angle": 0.5})
    host.get("coupler.x")
    assert calls == {"solve": 1, "outputs": 1}
    host.get("coupler.vx")
    assert calls == {"solve": 1, "outputs": 1, "rates": 1}
    assert host.step(0.0, 0.1)
    host.get(*COUPLER)
    assert calls == {"solve": 1, "outputs": 1, "rates": 1, "accelerations": 1}


def test_time_drives_by_the_law_and_its_constants_can_be_set(start: Start) -> None:
    host = start("fourbar", "time", initialize=False)
    host.set({"crank.speed": 0.2, "crank.start": 0.4})
    host.initialize(1.0)
    assert host.get("crank.phi", "crank.omega") == pytest.approx([0.6, 0.2], abs=1e-15)
    assert host.step(1.0, 2.0)
    phi, x, vx = host.get("crank.phi", "coupler.x", "coupler.vx")
    assert (phi, x, vx) == pytest.approx((1.0, 1 + math.cos(1.0), -0.2 * math.sin(1.0)), abs=1e-12)
    host.set({"crank.speed": 0.1})
    assert host.get("crank.phi") == pytest.approx([0.7])


def test_one_step_reaches_the_same_pose_as_two_halves(start: Start) -> None:
    once, twice = start("fourbar", "time"), start("fourbar", "time")
    assert once.step(0.0, 40.0)
    assert twice.step(0.0, 20.0)
    assert twice.step(20.0, 20.0)
    assert once.get(*COUPLER) == pytest.approx(twice.get(*COUPLER), abs=1e-13)


def test_input_set_while_time_drives_is_warned_about_once(start: Start) -> None:
    host = start("fourbar", "time")
    host.set({"crank_angle": 0.0})
    assert host.step(0.0, 1.0)
    assert host.messages == []
    for k in range(1, 4):
        host.set({"crank_angle": 0.1 * k})
        assert host.step(float(k), 1.0)
    assert host.messages == [
        (1, "crank_angle was set, but driven_by_time is true: the law drives, inputs have no effect")
    ]
    assert host.get("crank.phi") == pytest.approx([math.radians(4.0)])


@pytest.mark.parametrize(("drive", "is_warned"), [("time", False), ("inputs", True)])
def test_warning_goes_by_what_drives_in_the_end(start: Start, drive: str, is_warned: bool) -> None:
    host = start("fourbar", drive, initialize=False)
    host.set({"crank_angle": 0.2})  # before the drive is chosen
    host.set({"driven_by_time": is_warned})
    host.initialize(0.0)
    assert host.step(0.0, 0.1)
    assert [status for status, _ in host.messages] == [1] * is_warned


def test_driven_by_time_is_fixed_once_initialized(start: Start) -> None:
    host = start("fourbar", "time")
    host.set({"driven_by_time": False})
    assert "fixed once the FMU is initialized" in host.messages[-1][1]
    assert not host.step(0.0, 1.0)
    assert host.step(0.0, 1.0)
    assert host.get("crank.phi") == pytest.approx([math.radians(1.0)])


@pytest.mark.parametrize("angle", [6.5, 2.0])
def test_unreachable_pose_is_discard_with_driver_value_and_limit_and_the_host_may_go_back(
    start: Start, angle: float
) -> None:
    host = start("double_pendulum", "inputs")
    host.set({"crank_angle": 5.0})
    assert host.step(0.0, 0.1)
    good = host.get("upper.phi", "lower.x", "lower.phi")
    host.set({"crank_angle": angle})
    assert host.status() == Status.OUTSIDE
    assert host.get("upper.phi", "lower.x", "lower.phi") == good
    assert not host.step(0.1, 0.1)
    status, text = host.messages[-1]
    assert status == DISCARD
    limit = math.pi if angle < math.pi else 2 * math.pi
    assert f"crank = {angle:g} rad" in text
    assert f"{limit:.5f}"[:6] in text
    assert host.message() in text
    assert host.slave.getRealStatus(LAST_SUCCESSFUL_TIME) == pytest.approx(0.1)
    assert host.slave.getBooleanStatus(TERMINATED)  # pythonfmu's binary says so after any Discard
    host.set({"crank_angle": 5.1})
    assert host.status() == Status.OK
    assert host.step(0.1, 0.1)
    assert host.get("upper.phi", "upper.x") == pytest.approx([5.1, math.cos(5.1)])


def test_step_of_time_past_the_limit_is_discard_and_a_smaller_one_goes(start: Start) -> None:
    host = start("double_pendulum", "time")
    assert host.step(0.0, 1.9)
    good = host.get("upper.phi", "lower.phi")
    assert not host.step(1.9, 0.2)
    assert host.status() == Status.OUTSIDE
    assert host.get("upper.phi", "lower.phi") == good
    assert host.step(1.9, 0.05)
    assert host.get("upper.phi") == pytest.approx([math.radians(300 + 30 * 1.95)])


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_input_that_is_no_number_is_refused_and_the_next_step_discard(start: Start, value: float) -> None:
    host = start()
    host.set({"crank_angle": 0.5})
    before = host.outputs()
    host.set({"crank_angle": value})
    assert host.messages[-1] == (3, f"crank_angle = {value!r} is not a finite number; 0.5 stays")
    assert host.outputs() == before
    assert not host.step(0.0, 0.1)
    host.set({"crank_angle": value})
    host.set({"crank_angle": 0.6})
    assert host.step(0.0, 0.1)


@pytest.mark.parametrize("name", ["coupler.x", "crank.x", "solver.residual", "solver.status", "solver.message"])
def test_what_is_not_settable_is_refused_and_stays(start: Start, name: str) -> None:
    host = start()
    host.set({name: {"solver.status": 1, "solver.message": "x"}.get(name, 7.0)})
    assert host.messages[-1][0] == 3
    assert name in host.messages[-1][1]
    assert host.get("crank.x") == [0.0]
    assert not host.step(0.0, 0.1)


def test_tolerance_is_taken_if_positive(start: Start) -> None:
    host = start()
    host.set({"solver.tolerance": 1e-6})
    assert host.get("solver.tolerance") == [1e-6]
    host.set({"solver.tolerance": -1.0})
    assert host.get("solver.tolerance") == [1e-6]
    assert host.messages[-1][1] == "solver.tolerance = -1.0 must be positive; 1e-06 stays"


def test_value_reference_that_does_not_exist_is_an_error_message_not_the_end(start: Start) -> None:
    host = start()
    (value,) = host.slave.getReal([9999])
    assert math.isnan(value)
    assert host.messages[-1] == (3, "value reference 9999 is not a Real variable of this FMU")
    assert host.step(0.0, 0.1)


def _drive(host: Host, steps: range) -> list[list[float]]:
    """Rows of all outputs while the crank is turned unevenly."""
    rows = []
    for k in steps:
        host.set({"crank_angle": 0.1 * k + 0.02 * math.sin(k)})
        rows.append(host.outputs())
        assert host.step(0.01 * k, 0.01)
        rows.append(host.outputs())
    return rows


@pytest.mark.parametrize("serialized", [False, True])
def test_restored_state_gives_the_same_bits_even_in_another_slave(start: Start, serialized: bool) -> None:
    host, other = start(), start()
    _drive(host, range(1, 28))
    host.set({"crank_angle": 3.1})
    state = host.slave.getFMUstate()
    expected = [host.outputs(), *_drive(host, range(28, 70))]
    if serialized:
        data = host.slave.serializeFMUstate(state)
        target = other
        restored = other.slave.deSerializeFMUstate(data)
    else:
        target, restored = host, state
    target.slave.setFMUstate(restored)
    assert [target.outputs(), *_drive(target, range(28, 70))] == expected
    target.slave.freeFMUstate(restored)


def test_restored_state_brings_back_parameters_refusals_and_time(start: Start) -> None:
    host = start("fourbar", "time")
    host.set({"crank.speed": 0.3})
    assert host.step(0.0, 2.0)
    host.set({"crank_angle": math.nan})
    state = host.slave.getFMUstate()
    assert not host.step(2.0, 1.0)
    host.set({"crank.speed": 0.1})
    assert host.step(2.0, 1.0)
    host.slave.setFMUstate(state)
    assert host.get("crank.phi", "crank.speed") == pytest.approx([0.6, 0.3])
    assert not host.step(2.0, 1.0)
    host.slave.freeFMUstate(state)


def test_state_of_another_fmu_is_refused(start: Start) -> None:
    host, other = start("fourbar"), start("double_pendulum")
    data = other.slave.serializeFMUstate(other.slave.getFMUstate())
    before = host.outputs()
    host.slave.setFMUstate(host.slave.deSerializeFMUstate(data))
    host.slave.setFMUstate(host.slave.deSerializeFMUstate(b"no state"))
    assert host.outputs() == before  # the binary hands messages over at the call that follows
    assert [text.partition(" ")[0] for _, text in host.messages] == ["state", "state"]
    assert not host.step(0.0, 0.1)


def test_reset_slave_is_as_fresh(start: Start) -> None:
    host, fresh = start(), start()
    _drive(host, range(1, 9))
    host.slave.reset()
    host.initialize(0.0)
    assert host.outputs() == fresh.outputs()
    assert _drive(host, range(1, 9)) == _drive(fresh, range(1, 9))


def test_slaves_of_one_fmu_and_of_two_share_a_process_and_nothing_else(start: Start) -> None:
    first, second, pendulum = start(), start(), start("double_pendulum", "inputs")
    first.set({"crank_angle": 0.5})
    second.set({"crank_angle": 1.5})
    pendulum.set({"crank_angle": 4.5})
    assert first.get("coupler.x") == pytest.approx([1 + math.cos(0.5)])
    assert second.get("coupler.x") == pytest.approx([1 + math.cos(1.5)])
    assert pendulum.get("upper.x") == pytest.approx([math.cos(4.5)])


def test_many_slaves_one_after_another_live_in_one_process(start: Start) -> None:
    for k in range(8):
        host = start()
        host.set({"crank_angle": 0.1 * k})
        assert host.get("crank.phi") == [0.1 * k]


@pytest.mark.parametrize("drive", ["time", "inputs"])
def test_a_step_past_the_stop_time_is_discarded_with_an_error_and_one_that_rounds_past_it_is_done(
    start: Start, drive: str
) -> None:
    host = start("fourbar", drive, initialize=False)
    host.initialize(0.5, 1.5)
    t = 0.5
    for _ in range(10):
        assert host.step(t, 0.1)
        t += 0.1
    for time, step in ((t, 0.1), (1.45, 0.1), (1.5, 1e-6), (0.5, 1.1)):
        assert not host.step(time, step)  # pythonfmu's binary has no other answer than Discard
        said = f"doStep from t = {time:.12g} s by {step:.12g} s: past the stop time of the experiment, 1.5 s"
        assert host.messages[-1] == (3, said)
    assert host.step(1.5, 0.0)
    assert host.step(1.4, math.nextafter(0.1, 1.0))
    host.slave.reset()
    host.initialize(0.0)
    assert host.step(0.0, 1e6)


def test_an_initial_pose_out_of_reach_is_an_error_message_at_the_end_of_initialization(start: Start) -> None:
    host = start("double_pendulum", "time", initialize=False)
    host.initialize(2.5)
    assert host.messages[-1][0] == 3
    assert host.messages[-1][1].startswith("initialization fails: at t = 2.5 s: crank = ")
    assert not host.step(2.5, 0.1)


def test_fixed_parameters_and_outputs_are_refused_after_initialization_too(start: Start) -> None:
    host = start("fourbar", "inputs")
    before = host.outputs()
    for values in ({"coupler.x": 7.0}, {"solver.residual": 1.0}, {"driven_by_time": True}, {"crank.x": 3.0}):
        host.set(values)
        (name,) = values
        assert host.outputs() == before  # the binary hands messages over at the call that follows
        assert host.messages[-1][0] == 3
        assert host.messages[-1][1].startswith(name)
        assert not host.step(0.0, 0.1)
        assert host.messages[-1][1].startswith(f"at t = 0 s: {name}")
    assert host.step(0.0, 0.1)
