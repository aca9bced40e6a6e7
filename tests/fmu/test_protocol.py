"""The protocol of all flavours: set then get, commit by doStep, discard and recovery, state, several instances."""

from __future__ import annotations

import math
import re

import pytest

from kinfmu.fmu.interface import Drive
from kinfmu.solver.python import Status
from tests.fmu.conftest import Build, Start
from tests.fmu.host import DISCARD, ERROR, LAST_SUCCESSFUL_TIME, OK, TERMINATED, WARNING, Host, answer, turned

FLAVOURS = ("python", "native 2", "native 3")
COUPLER = ("coupler.x", "coupler.vx", "coupler.ax")
INPUTS = ("crank_angle", "crank_speed", "crank_acceleration")
HUGE = (1e101, -1e155, 1e300, -1.7e308)
NO_STEPS = [
    (math.nan, 0.1), (math.inf, 0.1), (-math.inf, 0.1), (0.2, math.nan), (0.2, math.inf), (0.2, -0.1), (0.2, -5e-324),
    (1.7e308, 1.7e308), (-0.3, 0.1), (-1e300, 0.1),
]  # fmt: skip


@pytest.fixture(params=FLAVOURS)
def start(request: pytest.FixtureRequest, built: Build, built_native: Build, opened: Start) -> Start:
    """`start(name, drive)`: an instance of each flavour, by default initialized at time 0; freed at the end."""

    def get(name: str = "fourbar", drive: Drive = "inputs", *, initialize: bool = True) -> Host:
        is_python = request.param == "python"
        host = opened(built(name, drive) if is_python else built_native(name, int(request.param[-1]), drive))
        if initialize:
            host.initialize(0.0)
        return host

    return get


@pytest.mark.few(1)
def test_fresh_instance_holds_a_pose_at_the_law_s_start(start: Start) -> None:
    host = start("double_pendulum", "inputs", initialize=False)
    assert host.get("crank_angle", "upper.phi", "upper.x") == pytest.approx([5 * math.pi / 3, 5 * math.pi / 3, 0.5])
    assert host.status() <= Status.BRIDGED


@pytest.mark.few(1)
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
        assert direct.step(0.1 * k, 0.1) == trying.step(0.1 * k, 0.1) == OK


@pytest.mark.few(1)
def test_time_drives_by_the_law_and_its_constants_can_be_set(start: Start) -> None:
    host = start("fourbar", "time", initialize=False)
    host.set({"crank.speed": 0.2, "crank.start": 0.4})
    host.initialize(1.0)
    assert host.get("crank.phi", "crank.omega") == pytest.approx([0.6, 0.2], abs=1e-15)
    assert host.step(1.0, 2.0) == OK
    phi, x, vx = host.get("crank.phi", "coupler.x", "coupler.vx")
    assert (phi, x, vx) == pytest.approx((1.0, 1 + math.cos(1.0), -0.2 * math.sin(1.0)), abs=1e-12)
    host.set({"crank.speed": 0.1})
    assert host.get("crank.phi") == pytest.approx([0.7])


@pytest.mark.parametrize("drive", ["time", "inputs"])
def test_one_step_reaches_the_same_pose_as_two_halves(start: Start, drive: str) -> None:
    once, twice = start("fourbar", drive), start("fourbar", drive)
    for host in (once, twice):
        host.set({"crank_angle": 0.7, "crank_speed": 1.5, "crank_acceleration": -0.5} if drive == "inputs" else {})
    assert once.step(0.0, 40.0) == OK
    assert twice.step(0.0, 20.0) == OK
    assert twice.step(20.0, 20.0) == OK
    assert once.get(*COUPLER) == pytest.approx(twice.get(*COUPLER), abs=1e-13)


@pytest.mark.parametrize("name", ["crank_angle", "crank_speed"])
def test_input_set_while_time_drives_is_warned_about_once(start: Start, name: str) -> None:
    host = start("fourbar", "time")
    host.set({name: 0.0})
    assert host.step(0.0, 1.0) == OK
    assert host.messages == []
    for k in range(1, 4):
        host.set({name: 0.1 * k})
        assert host.step(float(k), 1.0) == OK
    assert host.messages == [
        (WARNING, f"{name} was set, but driven_by_time is true: the law drives, inputs have no effect")
    ]
    assert host.get("crank.phi") == pytest.approx([math.radians(4.0)])


@pytest.mark.parametrize(("drive", "is_warned"), [("time", False), ("inputs", True)])
def test_warning_goes_by_what_drives_in_the_end(start: Start, drive: str, is_warned: bool) -> None:
    host = start("fourbar", drive, initialize=False)
    host.set({"crank_angle": 0.2})  # before the drive is chosen
    host.set({"driven_by_time": is_warned})
    host.initialize(0.0)
    assert host.step(0.0, 0.1) == OK
    assert [status for status, _ in host.messages] == [WARNING] * is_warned


def test_driven_by_time_is_fixed_once_initialized(start: Start) -> None:
    host = start("fourbar", "time")
    assert "fixed once the FMU is initialized" in host.refusal({"driven_by_time": False})
    assert host.step_after_refusal(0.0, 1.0) == OK
    assert host.get("crank.phi") == pytest.approx([math.radians(1.0)])


@pytest.mark.parametrize("angle", [6.5, 2.0])
def test_unreachable_pose_is_discard_with_driver_value_and_limit_and_the_host_may_go_back(
    start: Start, angle: float
) -> None:
    host = start("double_pendulum", "inputs")
    host.set({"crank_angle": 5.0})
    assert host.step(0.0, 0.1) == OK
    good = host.get("upper.phi", "lower.x", "lower.phi")
    host.set({"crank_angle": angle})
    assert host.status() == Status.OUTSIDE
    if host.is_python:
        assert host.get("upper.phi", "lower.x", "lower.phi") == good
    else:
        assert answer(host.get, "upper.phi", "lower.x", "lower.phi") == DISCARD
    assert host.get("driven.crank_angle") == [angle]
    assert host.step(0.1, 0.1) == DISCARD
    status, text = host.messages[-1]
    assert status == DISCARD
    limit = math.pi if angle < math.pi else 2 * math.pi
    assert f"crank = {angle:g} rad" in text
    assert f"{limit:.5f}"[:6] in text
    assert host.message() in text
    if host.fmi == 2:
        assert host.fmu.getRealStatus(LAST_SUCCESSFUL_TIME) == pytest.approx(0.1)
        assert bool(host.fmu.getBooleanStatus(TERMINATED)) == host.is_python  # pythonfmu's binary: after any Discard
    host.set({"crank_angle": 5.1})
    assert host.status() == Status.OK
    assert host.step(0.1, 0.1) == OK
    assert host.get("upper.phi", "upper.x") == pytest.approx([5.1, math.cos(5.1)])


@pytest.mark.few(1)
def test_step_of_time_past_the_limit_is_discard_and_a_smaller_one_goes(start: Start) -> None:
    host = start("double_pendulum", "time")
    assert host.step(0.0, 1.9) == OK
    good = host.get("upper.phi", "lower.phi")
    assert host.step(1.9, 0.2) == DISCARD
    assert host.status() == Status.OUTSIDE
    if host.is_python:
        assert host.get("upper.phi", "lower.phi") == good
    else:
        assert answer(host.get, "upper.phi", "lower.phi") == DISCARD
    assert host.step(1.9, 0.05) == OK
    assert host.get("upper.phi") == pytest.approx([math.radians(300 + 30 * 1.95)])


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_input_that_is_no_number_is_refused_and_the_last_one_stays(start: Start, value: float) -> None:
    host = start()
    host.set({"crank_angle": 0.5})
    before = host.outputs()
    assert re.match(
        r"crank_angle = -?(nan|inf) is not a finite number; 0\.5 stays", host.refusal({"crank_angle": value})
    )
    assert host.outputs() == before
    assert host.get("crank_angle") == [0.5]
    assert host.step_after_refusal(0.0, 0.1) == OK
    host.refusal({"crank_angle": value})
    host.set({"crank_angle": 0.6})  # a valid value takes the refusal back
    assert host.step(0.0, 0.1) == OK


@pytest.mark.parametrize("name", ["coupler.x", "crank.x", "solver.residual", "solver.status", "solver.message"])
def test_variables_that_cannot_be_set_are_refused_by_name(start: Start, name: str) -> None:
    host = start()
    before = host.outputs()
    value: float | str = {"solver.status": 1, "solver.message": "x"}.get(name, 7.0)  # type: ignore[assignment]
    assert name in host.refusal({name: value})
    assert host.outputs() == before
    assert host.get("crank.x") == [0.0]
    assert host.step_after_refusal(0.0, 0.1) == OK


def test_tolerance_must_be_positive(start: Start) -> None:
    host = start()
    text = host.refusal({"solver.tolerance": -1.0})
    assert re.match(r"solver\.tolerance = -1(\.0)? must be positive; (1e-09|1\.0000000000000001e-09) stays", text)
    host.set({"solver.tolerance": 1e-6})
    assert host.get("solver.tolerance") == [1e-6]
    assert host.step(0.0, 0.1) == OK


@pytest.mark.parametrize("serialized", [False, True])
def test_restored_state_gives_the_same_bits_even_in_another_instance(start: Start, serialized: bool) -> None:
    host, other = start(), start()
    turned(host, range(1, 28))
    host.set({"crank_angle": 3.1})
    state = host.state()
    expected = [host.outputs(), *turned(host, range(28, 70))]
    target = other if serialized else host
    restored = target.deserialize(host.serialize(state)) if serialized else state
    target.restore(restored)
    assert [target.outputs(), *turned(target, range(28, 70))] == expected
    target.free_state(restored)


def test_reset_instance_equals_a_fresh_one(start: Start) -> None:
    host, fresh = start(), start()
    turned(host, range(1, 9))
    host.fmu.reset()
    host.initialize(0.0)
    assert host.outputs() == fresh.outputs()
    assert turned(host, range(1, 9)) == turned(fresh, range(1, 9))


def test_instances_of_one_fmu_and_of_two_in_one_process_share_nothing(start: Start) -> None:
    first, second, pendulum = start(), start(), start("double_pendulum", "inputs")
    first.set({"crank_angle": 0.5})
    second.set({"crank_angle": 1.5})
    pendulum.set({"crank_angle": 4.5})
    assert first.get("coupler.x") == pytest.approx([1 + math.cos(0.5)])
    assert second.get("coupler.x") == pytest.approx([1 + math.cos(1.5)])
    assert pendulum.get("upper.x") == pytest.approx([math.cos(4.5)])


@pytest.mark.parametrize("drive", ["time", "inputs"])
@pytest.mark.few(3)
def test_a_step_past_the_stop_time_is_invalid_and_one_that_rounds_past_it_is_valid(start: Start, drive: str) -> None:
    host = start("fourbar", drive, initialize=False)
    host.initialize(0.5, 1.5)
    t = 0.5
    for _ in range(10):
        assert host.step(t, 0.1) == OK
        t += 0.1  # as many hosts do: 1.4999999999999998 and 1.6 times as much
    before = host.outputs()
    for time, step in ((t, 0.1), (1.45, 0.1), (1.5, 1e-6), (0.5, 1.1), (1.6, 0.0)):
        assert host.step(time, step) == host.invalid
        text = f"doStep from t = {time:.12g} s by {step:.12g} s: past the stop time of the experiment, 1.5 s"
        assert host.messages[-1] == (ERROR, text)
    assert host.outputs() == before
    assert host.step(1.5, 0.0) == host.step(1.4, 0.1) == host.step(1.4, math.nextafter(0.1, 1.0)) == OK
    host.fmu.reset()
    host.initialize(0.0)
    assert host.step(0.0, 1e6) == OK


def test_an_unreachable_initial_pose_is_an_error_at_the_end_of_initialization(start: Start) -> None:
    host = start("double_pendulum", "time", initialize=False)
    assert answer(host.initialize, 2.5) == (OK if host.is_python else ERROR)
    status, text = host.messages[-1]
    assert status == ERROR
    assert text.startswith("initialization fails: at t = 2.5 s: crank = ")
    assert host.step(2.5, 0.1) == host.invalid


@pytest.mark.few(1)
def test_outputs_depend_on_the_inputs_that_are_listed_and_on_no_others(start: Start) -> None:
    """Speeds depend on the angle too where they are estimated, also those of the driven body itself."""
    estimated, wired = start("crank_rocker"), start("crank_rocker")
    inputs = dict(zip(INPUTS, (estimated.get("crank_angle")[0] + 0.4, 1.7, -0.6), strict=True))
    wired.set(inputs)
    for k in range(4):
        estimated.set({"crank_angle": inputs["crank_angle"] + 0.1 * k})
        for host in (estimated, wired):
            assert host.step(0.1 * k, 0.1) == OK
    about = estimated.about.interface
    outputs = [v for part in ("values", "rates", "accelerations") for v in about.part(part)]
    names = [v.name for v in outputs]
    found: dict[str, set[str]] = {name: set() for name in names}
    for host in (estimated, wired):
        for name in ("crank_angle",) if host is estimated else INPUTS:
            (value,) = host.get(name)
            host.set({name: value})
            before = host.get(*names)
            host.set({name: value + 0.01})
            for changed, old, new in zip(names, before, host.get(*names), strict=True):
                found[changed] |= {name} if old != new else set()
            host.set({name: value})
    assert found == {v.name: {name for name in v.dependencies or () if name in INPUTS} for v in outputs}
    assert found["crank.omega"] == {"crank_angle", "crank_speed"}


def test_rates_are_estimated_until_they_are_wired(start: Start) -> None:
    host = start()
    for k in range(6):
        host.set({"crank_angle": 0.3 + 0.1 * k + 0.02 * k * k})
        host.outputs()
        assert host.step(0.1 * k, 0.1) == OK
    assert host.get("crank.omega", "crank.alpha") == pytest.approx([3.0, 4.0], abs=1e-9)
    host.set({"crank_speed": 0.5})
    assert host.get("crank.omega") == [0.5]


# Invalid calls


@pytest.mark.parametrize("drive", ["inputs", "time"])
@pytest.mark.parametrize(("t", "h"), NO_STEPS)
@pytest.mark.few(11)
def test_an_invalid_step_changes_nothing(start: Start, drive: str, t: float, h: float) -> None:
    host, other = start("fourbar", drive), start("fourbar", drive)
    assert host.step(t, h) == host.invalid
    for one in (host, other):
        one.set({"crank_angle": 0.3} if drive == "inputs" else {})
        assert one.step(0.0, 0.1) == OK
        assert one.step(0.1, 0.0) == OK
    assert any("doStep from t = " in text for _, text in host.messages)
    assert host.step(t, h) == host.invalid
    assert "doStep from t = " in host.messages[-1][1]
    assert host.outputs() == other.outputs()
    assert all(math.isfinite(value) for value in host.get("rocker.phi", "rocker.omega", "rocker.alpha"))
    assert host.step(0.1, 0.1) == OK


@pytest.mark.parametrize("drive", ["inputs", "time"])
def test_steps_before_initialization_and_after_terminate_are_invalid(start: Start, drive: str) -> None:
    host = start("fourbar", drive, initialize=False)
    assert host.step(0.0, 0.1) == host.invalid
    host.initialize(0.0)
    assert host.step(0.0, 0.1) == OK
    host.fmu.terminate()
    assert host.step(0.1, 0.1) == host.invalid
    host.fmu.reset()
    assert host.step(0.1, 0.1) == host.invalid
    host.initialize(0.0)
    assert host.step(0.0, 0.1) == OK


def test_runs_may_start_before_time_0(start: Start) -> None:
    host = start("fourbar", "time", initialize=False)
    host.initialize(-2.0)
    assert host.step(-2.0, 0.5) == OK
    assert host.step(-2.1, 0.5) == host.invalid
    assert re.match(r"doStep from t = -2\.10* ?.*before the start at -2(\.0)? s", host.messages[-1][1])
    assert host.step(-1.5, 0.5) == OK


@pytest.mark.parametrize("name", [*INPUTS, "crank.speed"])
def test_numbers_whose_squares_are_infinite_are_refused(start: Start, name: str) -> None:
    host = start("fourbar", "time" if name == "crank.speed" else "inputs")
    (before,) = host.get(name)
    for value in HUGE:
        text = host.refusal({name: value})
        found = re.fullmatch(r"(\S+) = (\S+) is too large: at most 1e\+100 is taken; (\S+) stays", text)
        assert found
        assert (found[1], float(found[2]), float(found[3])) == (name, value, before)
        assert host.get(name) == [before]
        assert host.step_after_refusal(0.0, 0.1) == OK


@pytest.mark.parametrize("h", [5e-324, 1e-300, 1e-150])
def test_rates_estimated_over_no_time_are_finite(start: Start, h: float) -> None:
    host = start()
    for k in range(6):
        host.set({"crank_angle": 0.1 * k})
        assert all(math.isfinite(value) for value in host.outputs()), k
        assert host.step(k * h, h) == OK
        assert all(math.isfinite(value) for value in host.outputs()), k


@pytest.mark.few(1)
def test_laws_whose_rates_are_beyond_all_bounds_have_no_pose(start: Start) -> None:
    host = start("crank_rocker", "time")
    host.set({"crank.speed": 1e100})
    if host.is_python:
        assert all(math.isfinite(value) for value in host.outputs())
    assert host.step(0.0, 0.1) == DISCARD
    host.set({"crank.speed": 1.0})
    assert host.step(0.0, 0.1) == OK
