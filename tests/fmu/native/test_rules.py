"""Native FMUs: derivatives, model exchange, Error at initialization, and calls of C, in both versions of FMI."""

from __future__ import annotations

import ctypes
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu.fmu.native.sources import HEADERS, headers
from kinfmu.fmu.slave.layout import UNKNOWN_ERROR
from kinfmu.solver.python.pose import Status
from tests import oracle
from tests.fmu.conftest import Build, Start
from tests.fmu.host import DISCARD, ERROR, LAST_SUCCESSFUL_TIME, OK, TERMINATED, WARNING, Host, answer, turned
from tests.fmu.test_parameters import LENGTHS, OTHERS, linkage
from tests.oracle import Motion, mp
from tests.run.test_sensitivities import Form, exact_derivative

COUPLER = ("coupler.x", "coupler.vx", "coupler.ax")
UNIT_INPUTS = ("crank_angle", "crank_speed", "crank_acceleration")


def test_freed_state_is_null(start: Start) -> None:
    host = start()
    state = host.state()
    assert state.value
    host.free_state(state)
    assert not state.value


def test_bytes_that_are_not_a_state_of_this_fmu_are_refused(start: Start) -> None:
    host, other = start("fourbar"), start("double_pendulum")
    before = host.outputs()
    foreign = other.serialize(other.state())
    own = host.serialize(host.state())
    for data in (foreign, b"no state", own[:-1], own[::-1]):
        assert answer(host.deserialize, data) == ERROR
        assert "not a state of this FMU" in host.messages[-1][1]
    assert host.outputs() == before


# Derivatives


def _differences(host: Host, names: list[str], at: dict[str, float], way: dict[str, float], h: float) -> Any:
    """Central differences of sixth order, from set and get."""
    total = np.zeros(len(names))
    for j, weight in ((1, 45.0), (2, -9.0), (3, 1.0)):
        for sign in (-1, 1):
            host.set({name: at[name] + sign * j * h * slope for name, slope in way.items()})
            total += sign * weight / (60.0 * h) * np.array(host.get(*names))
    host.set({name: at[name] for name in way})
    return total


@pytest.mark.parametrize("known", UNIT_INPUTS)
@pytest.mark.few(1)
def test_directional_derivative_with_respect_to_an_input_is_the_finite_difference(start: Start, known: str) -> None:
    host = start("stephenson_six_bar" if known == "crank_angle" else "fourbar")
    inputs = [variable.name for variable in host.about.interface.part("inputs")]
    at = dict(zip(inputs, (host.get(inputs[0])[0] + 0.4, 1.7, -0.6), strict=True))
    host.set(at)
    moved = inputs[UNIT_INPUTS.index(known)]
    outputs = [v.name for part in ("values", "rates", "accelerations") for v in host.about.interface.part(part)]
    exact = np.array(host.slopes(outputs, [moved], [1.0]))
    found = _differences(host, outputs, at, {moved: 1.0}, 2e-3)
    np.testing.assert_allclose(exact, found, rtol=0, atol=2e-10 * max(1.0, np.abs(found).max()))
    np.testing.assert_allclose(host.slopes(outputs, [moved], [-2.5]), -2.5 * exact, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("steps", [[0.1], [0.1, 0.1], [0.1, 0.1, 0.1], [0.1, 0.05, 0.2]])
@pytest.mark.parametrize("moves", [False, True])
@pytest.mark.few(8)
def test_directional_derivatives_after_a_step_are_the_differences_of_setting_an_input(
    start: Start, steps: list[float], moves: bool
) -> None:
    host = start("crank_rocker")
    (angle,) = host.get("crank_angle")
    host.set({"crank_angle": angle})
    outputs = [v.name for part in ("values", "rates", "accelerations") for v in host.about.interface.part(part)]
    time = 0.0
    for k, step in enumerate(steps):
        if moves:
            angle += 0.03 * (k + 1)
            host.set({"crank_angle": angle})
        host.step(time, step)
        time += step
    shown = host.get(*outputs)
    exact = np.array(host.slopes(outputs, ["crank_angle"], [1.0]))
    assert host.get(*outputs) == shown
    found = _differences(host, outputs, {"crank_angle": angle}, {"crank_angle": 1.0}, 2e-3)
    assert np.abs(found).max() > 1.0
    np.testing.assert_allclose(exact, found, rtol=0, atol=2e-10 * np.abs(found).max())


def test_directional_derivatives_of_the_parallelogram_are_those_of_its_formulas(start: Start) -> None:
    host = start()
    u, v, a = 0.6, 1.3, -0.4
    host.set(dict(zip(UNIT_INPUTS, (u, v, a), strict=True)))
    c, s = math.cos(u), math.sin(u)  # x = 1 + cos u, vx = -v sin u, ax = -a sin u - v^2 cos u
    wanted = {
        "crank_angle": (-s, -v * c, -a * c + v * v * s),
        "crank_speed": (0.0, -s, -2.0 * v * c),
        "crank_acceleration": (0.0, 0.0, -s),
    }
    for known, slopes in wanted.items():
        assert host.slopes(COUPLER, [known], [1.0]) == pytest.approx(slopes, abs=1e-11)
    mixed = [2.0 * x - 3.0 * y for x, y in zip(wanted["crank_angle"], wanted["crank_speed"], strict=True)]
    assert host.slopes(COUPLER, ["crank_angle", "crank_speed"], [2.0, -3.0]) == pytest.approx(mixed, abs=1e-10)


def test_every_real_output_has_directional_derivatives_which_do_not_change_the_state(start: Start) -> None:
    host, untouched = start(), start()
    for one in (host, untouched):
        turned(one, range(1, 6))
        one.set({"crank_angle": 0.65})
    names = host.real_outputs()
    assert all(map(math.isfinite, host.slopes([n for n in names if "error" not in n], ["crank_angle"], [1.0])))
    assert host.outputs() == untouched.outputs()
    assert turned(host, range(7, 12)) == turned(untouched, range(7, 12))


@pytest.mark.parametrize("parameter", ["ground", "coupler"])
@pytest.mark.few(1)
def test_directional_derivative_with_respect_to_a_parameter_is_the_finite_difference(
    start: Start, parameter: str
) -> None:
    host = start(linkage(), initialize=False)
    host.enter(0.0)
    host.set({"crank_angle": 1.2, "crank_speed": 1.1, "crank_acceleration": 0.3})
    at = {parameter: host.get(parameter)[0]}
    outputs = [v.name for part in ("values", "rates", "accelerations") for v in host.about.interface.part(part)]
    outputs += [v.name for v in host.about.interface.part("fixed") if v.causality == "calculatedParameter"]
    slopes = host.slopes(outputs, [parameter], [1.0])
    found = _differences(host, outputs, at, {parameter: 1.0}, 4e-3)
    np.testing.assert_allclose(slopes, found, rtol=0, atol=1e-9)
    assert np.abs(found).max() > 0.1


def test_directional_derivative_with_respect_to_a_law_s_constant(start: Start) -> None:
    host = start("fourbar", "time", initialize=False)
    host.enter(2.0)
    (speed,) = host.get("crank.speed")
    u = 2.0 * speed
    slopes = host.slopes(["coupler.x", "coupler.vx"], ["crank.speed"], [1.0])
    assert slopes == pytest.approx([-2.0 * math.sin(u), -math.sin(u) - 2.0 * speed * math.cos(u)], abs=1e-11)
    host.fmu.exitInitializationMode()  # it is tunable: the slope is there later, too
    assert host.slopes(["coupler.x", "coupler.vx"], ["crank.speed"], [1.0]) == slopes


def _exact(form: Form, numbers: dict[str, Any], names: Sequence[str]) -> np.ndarray[Any, Any]:
    """Derivatives of the angles of crank, coupler and rocker and of their speeds in 50 digits, (6, names)."""
    found = [exact_derivative(form, numbers, name).rounded() for name in names]
    return np.stack([np.concatenate([one.q[0], one.qd[0]]) for one in found], axis=1)


ANGLES = ("crank.phi", "coupler.phi", "rocker.phi", "crank.omega", "coupler.omega", "rocker.omega")


def test_derivatives_with_respect_to_fixed_parameters_are_exact_in_initialization(start: Start, fmi: int) -> None:
    """Directional ones, and adjoint ones in FMI 3.0, which are refused with the name later."""
    host = start(linkage(), initialize=False)
    host.enter(0.0)
    host.set({"crank_angle": 1.2, "crank_speed": 1.1})
    exact = _exact(oracle.fourbar, dict(LENGTHS) | {"u": [1.2], "ud": 1.1}, list(LENGTHS))
    for name, column in zip(LENGTHS, exact.T, strict=True):
        np.testing.assert_allclose(host.slopes(ANGLES, [name], [1.0]), column, rtol=0, atol=1e-10)
    along = np.array([0.3, -1.2, 0.5, 2.0])
    np.testing.assert_allclose(host.slopes(ANGLES, list(LENGTHS), along.tolist()), exact @ along, rtol=0, atol=2e-10)
    weights = np.array([1.0, -0.5, 2.0, 0.3, 0.7, -1.1])
    if fmi == 3:
        found = host.adjoint(ANGLES, list(LENGTHS), weights.tolist())
        np.testing.assert_allclose(found, weights @ exact, rtol=0, atol=1e-9)
    host.fmu.exitInitializationMode()
    calls = [(host.slopes, [1.0])] + ([(host.adjoint, weights.tolist())] if fmi == 3 else [])
    for function, seed in calls:
        assert answer(function, ANGLES, ["coupler"], seed) == ERROR
        assert "no directional derivative along coupler (value reference" in host.messages[-1][1]


@pytest.mark.few(1)
def test_derivatives_with_respect_to_tunable_parameters_are_exact(start: Start, fmi: int) -> None:
    host = start(linkage(), "time", initialize=False)
    host.enter(0.0)
    host.fmu.exitInitializationMode()
    assert host.step(0.0, 0.7) == OK
    constants = ["crank.start", "crank.speed"]
    given = dict(zip(("start", "speed"), host.get(*constants), strict=True))
    t = mp.mpf(0.7)

    def form(start: Any, speed: Any) -> Motion:
        return oracle.fourbar(**LENGTHS, u=[mp.mpf(start) + mp.mpf(speed) * t], ud=speed)

    exact = _exact(form, given, ["start", "speed"])
    for name, column in zip(constants, exact.T, strict=True):
        np.testing.assert_allclose(host.slopes(ANGLES, [name], [1.0]), column, rtol=0, atol=1e-11)
    if fmi == 3:
        weights = [1.0, -0.5, 2.0, 0.3, 0.7, -1.1]
        np.testing.assert_allclose(host.adjoint(ANGLES, constants, weights), weights @ exact, rtol=0, atol=1e-10)
        speeds = host.slopes(ANGLES, ["time"], [1.0])
        found = host.adjoint(ANGLES, ["time", "solver.tolerance"], weights)
        assert found == pytest.approx([np.dot(weights, speeds), 0.0], rel=1e-12, abs=1e-15)


def test_invalid_adjoint_derivatives_are_refused(start: Start, fmi: int) -> None:
    if fmi == 2:
        return
    host = start()
    assert host.adjoint([], ["crank_angle"], []) == [0.0]
    assert answer(host.adjoint, ["coupler.x"], ["crank_angle"], [math.inf]) == ERROR
    assert "no adjoint derivative of coupler.x (value reference" in host.messages[-1][1]
    assert answer(host.adjoint, ["coupler.x"], ["crank_angle"], [1.0, 2.0]) == ERROR
    assert "1 value references, but 2 values" in host.messages[-1][1]
    assert answer(host.adjoint, ["crank_angle"], ["crank_angle"], [1.0]) == ERROR
    assert "crank_angle (value reference 1) has no directional derivative" in host.messages[-1][1]


def test_variables_without_directional_derivative_are_refused_by_name(start: Start) -> None:
    host = start()
    assert answer(host.slopes, ["crank_angle"], ["crank_angle"], [1.0]) == ERROR
    assert "crank_angle (value reference 1) has no directional derivative" in host.messages[-1][1]
    assert answer(host.slopes, ["coupler.x"], ["coupler.y"], [1.0]) == ERROR
    assert "no directional derivative along coupler.y" in host.messages[-1][1]
    assert answer(host.fmu.getDirectionalDerivative, [9999], host.of("crank_angle"), [1.0]) == ERROR
    assert "an unknown variable (value reference 9999) has no directional derivative" in host.messages[-1][1]


def test_output_derivatives_are_the_velocity_and_acceleration_outputs(start: Start) -> None:
    host = start()
    host.set({"crank_angle": 0.5, "crank_speed": 2.0, "crank_acceleration": 3.0})
    derivative = host.fmu.getRealOutputDerivatives if host.fmi == 2 else host.fmu.getOutputDerivatives
    found = derivative(host.of("coupler.x", "coupler.x", "coupler.vx"), [1, 2, 1])
    assert list(found) == [*host.get("coupler.vx", "coupler.ax"), *host.get("coupler.ax")]
    assert answer(derivative, host.of("coupler.ax"), [1]) == ERROR
    assert "coupler.ax (value reference" in host.messages[-1][1]
    assert answer(derivative, host.of("coupler.x"), [3]) == ERROR


def test_inputs_follow_their_derivatives_through_a_step(start: Start, fmi: int) -> None:
    if fmi == 3:
        pytest.skip("FMI 3.0 has no input derivatives")
    host = start()
    host.set({"crank_angle": 0.3})
    host.fmu.setRealInputDerivatives(host.of("crank_angle", "crank_angle"), [1, 2], [2.0, 4.0])
    assert host.step(0.0, 0.1) == OK
    assert host.get("crank.phi", "coupler.x") == pytest.approx([0.52, 1 + math.cos(0.52)], abs=1e-14)
    assert host.step(0.1, 0.1) == OK  # they held for one step
    assert host.get("crank.phi") == pytest.approx([0.52], abs=1e-14)
    assert answer(host.fmu.setRealInputDerivatives, host.of("crank_angle"), [4], [1.0]) == ERROR
    assert answer(host.fmu.setRealInputDerivatives, host.of("coupler.x"), [1], [1.0]) == ERROR


# What is refused


def test_fixed_parameters_and_the_drive_are_fixed_once_initialized(start: Start) -> None:
    host = start(linkage())
    assert answer(host.set, {"coupler": 3.0}) == ERROR
    assert "coupler = 3 comes too late: it is fixed once the FMU is initialized" in host.messages[-1][1]
    assert answer(host.set, {"driven_by_time": True}) == ERROR
    assert host.get("coupler") == [3.5]


def test_value_reference_that_does_not_exist_is_an_error(start: Start) -> None:
    host = start()
    get = host.fmu.getReal if host.fmi == 2 else host.fmu.getFloat64
    assert answer(get, [9999]) == ERROR
    assert host.messages[-1] == (ERROR, "value reference 9999 is not a variable of this FMU")
    assert answer(get, host.of("solver.status")) == ERROR
    assert "solver.status" in host.messages[-1][1]


def test_stop_times_before_the_start_are_errors(start: Start) -> None:
    for stop in (0.5, math.nan, -math.inf):
        host = start(initialize=False)
        assert answer(host.enter, 1.0, stop) == ERROR
        assert host.messages[-1][1] == f"the stop time {stop:g} s is not after the start time 1 s"


def test_an_accepted_step_past_the_stop_time_of_model_exchange_is_an_error(start: Start) -> None:
    host = start("fourbar", "time", model_exchange=True, initialize=False)
    host.initialize(0.0, 1.0)
    host.fmu.enterContinuousTimeMode()
    for t in (0.5, 1.0, math.nextafter(1.0, 2.0)):
        host.fmu.setTime(t)
        assert answer(host.fmu.completedIntegratorStep) == OK
    host.fmu.setTime(1.2)
    assert host.get("crank.phi") == pytest.approx([math.radians(1.2)])  # solvers try times beyond the end
    assert answer(host.fmu.completedIntegratorStep) == ERROR
    assert "past the stop time of the experiment, 1 s" in host.messages[-1][1]


# Unreachable poses and parameters with no solution


@pytest.mark.parametrize("model_exchange", [False, True])
def test_an_unreachable_initial_pose_is_an_error_with_the_reason(start: Start, model_exchange: bool) -> None:
    host = start("double_pendulum", "time", initialize=False, model_exchange=model_exchange)
    host.enter(2.5)
    assert answer(host.fmu.exitInitializationMode) == ERROR
    assert host.messages[-1][1].startswith("initialization fails: at t = 2.5 s: crank = ")
    driven = start("double_pendulum", "inputs", initialize=False, model_exchange=model_exchange)
    driven.enter(0.0)
    driven.set({"crank_angle": 6.5})
    assert answer(driven.fmu.exitInitializationMode) == ERROR
    assert "crank = 6.5 rad" in driven.messages[-1][1]


def _terminated(host: Host, t: float, h: float) -> tuple[int, bool, float]:
    """Status of a step, whether the FMU wants to end, and the last time that was reached."""
    if host.fmi == 2:
        status = host.step(t, h)
        fmu = host.fmu
        return status, bool(fmu.getBooleanStatus(TERMINATED)), float(fmu.getRealStatus(LAST_SUCCESSFUL_TIME))
    flags = [ctypes.c_bool() for _ in range(3)]
    last = ctypes.c_double()
    call = host.fmu.dll.fmi3DoStep
    call.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_bool, *([ctypes.c_void_p] * 4)]
    status = call(host.fmu.component, t, h, True, *map(ctypes.byref, flags), ctypes.byref(last))
    return status, flags[1].value, last.value


def test_step_past_the_limit_is_discard_a_smaller_one_goes_and_the_same_again_ends_the_run(start: Start) -> None:
    host = start("double_pendulum", "time")
    assert _terminated(host, 0.0, 1.9) == (OK, False, 1.9)
    assert _terminated(host, 1.9, 0.2) == (DISCARD, False, 1.9)
    assert _terminated(host, 1.9, 0.15) == (DISCARD, False, 1.9)
    assert _terminated(host, 1.9, 0.15) == (DISCARD, True, 1.9)
    assert _terminated(host, 1.9, 0.05) == (OK, False, pytest.approx(1.95))
    assert host.get("upper.phi") == pytest.approx([math.radians(300 + 30 * 1.95)])


def test_other_parameters_are_reached_before_initialization_ends(start: Start) -> None:
    host = start(linkage(), initialize=False)
    host.set(OTHERS)
    host.enter(0.0)
    host.fmu.exitInitializationMode()
    wanted = kinfmu.solve(linkage(OTHERS), crank_angle=np.array([0.8]))
    host.set({"crank_angle": 0.8, "crank_speed": 1.0})
    assert host.get(*wanted.outputs) == pytest.approx(wanted.values[0].tolist(), abs=1e-12)


def test_impossible_parameters_are_an_error_with_the_reason(start: Start) -> None:
    host = start(linkage(), initialize=False)
    host.set({"coupler": 9.0})
    host.enter(0.0)
    assert answer(host.fmu.exitInitializationMode) == ERROR
    assert "coupler = 9" in host.messages[-1][1]
    assert "Q.x, Q.y leave a gap of" in host.messages[-1][1]
    host.fmu.reset()
    host.initialize(0.0)
    assert host.status() == Status.OK


def test_inputs_set_while_time_drives_are_warned_about_once_in_model_exchange(start: Start) -> None:
    host = start("fourbar", "time", model_exchange=True)
    for k in range(4):
        host.set({"crank_speed": 0.1 * k})
        host.fmu.setTime(float(k))
        host.fmu.completedIntegratorStep()
        assert len(host.messages) == (k > 0)
    assert host.messages == [
        (WARNING, "crank_speed was set, but driven_by_time is true: the law drives, inputs have no effect")
    ]
    assert host.get("crank.phi") == pytest.approx([math.radians(3.0)])


@pytest.mark.parametrize("name", ["fourbar", "five_bar", "double_pendulum"])
@pytest.mark.parametrize("wired", [0, 1, 2])
@pytest.mark.few(2)
def test_no_output_is_infinite_and_errors_without_an_estimate_are_the_declared_maximum(
    start: Start, name: str, wired: int
) -> None:
    host = start(name)
    inputs = [variable.name for variable in host.about.interface.part("inputs")]
    first = dict(zip(inputs[::3], host.get(*inputs[::3]), strict=True))
    (maximum,) = {variable.maximum for variable in host.about.interface.part("errors")}
    assert maximum == UNKNOWN_ERROR
    seen = set()
    for k in range(6):
        for driver in range(0, len(inputs), 3):
            rates = (first[inputs[driver]] + 0.01 * k * k, 0.2 * k, 0.0)
            host.set(dict(zip(inputs[driver : driver + 1 + wired], rates, strict=False)))
        for _ in range(2):
            assert all(map(math.isfinite, host.outputs()))
            seen.update(host.get("solver.error_qd", "solver.error_qdd"))
            assert host.step(0.1 * k, 0.1) == OK
    assert max(seen) == UNKNOWN_ERROR
    assert min(seen) < 1e-6
    assert not [value for value in seen if 1e3 < value < UNKNOWN_ERROR]


# Model exchange


def test_model_exchange_follows_inputs_and_time_without_estimates(start: Start) -> None:
    host = start(model_exchange=True)
    for k in range(5):
        host.fmu.setTime(0.1 * k)
        host.set({"crank_angle": 0.2 * k})
        assert host.get(*COUPLER) == pytest.approx([1 + math.cos(0.2 * k), 0.0, 0.0], abs=1e-13)
        _, terminate = host.fmu.completedIntegratorStep()
        assert not terminate
    clock = start("fourbar", "time", model_exchange=True)
    clock.fmu.setTime(30.0)
    assert clock.get("crank.phi") == pytest.approx([math.radians(30.0)])
    clock.fmu.setTime(20.0)
    assert clock.get("crank.phi") == pytest.approx([math.radians(20.0)])


def test_model_exchange_gives_discard_for_a_trial_and_error_for_an_accepted_step(start: Start) -> None:
    host = start("double_pendulum", "time", model_exchange=True)
    host.fmu.setTime(1.5)
    assert answer(host.fmu.completedIntegratorStep) == OK
    host.fmu.setTime(2.5)
    assert answer(host.get, "upper.phi") == DISCARD
    assert answer(host.fmu.completedIntegratorStep) == ERROR
    host.fmu.setTime(1.6)
    assert host.get("upper.phi") == pytest.approx([math.radians(300 + 30 * 1.6)])


# Unusual hosts


@pytest.fixture
def library(start: Start) -> Any:
    """The FMU's library itself, and a host of it."""
    host = start()
    return ctypes.CDLL(host.fmu.dll._name), host


def _instantiate(
    library: Any, host: Host, token: bytes | None, callbacks: Any = None, name: bytes | None = b"x"
) -> Any:
    if host.fmi == 2:
        library.fmi2Instantiate.restype = ctypes.c_void_p
        return library.fmi2Instantiate(name, 1, token, None, callbacks, 0, 0)
    library.fmi3InstantiateCoSimulation.restype = ctypes.c_void_p
    library.fmi3InstantiateCoSimulation.argtypes = [
        *([ctypes.c_char_p] * 3), *([ctypes.c_bool] * 4), ctypes.c_void_p, ctypes.c_size_t, *([ctypes.c_void_p] * 3)
    ]  # fmt: skip
    return library.fmi3InstantiateCoSimulation(name, token, None, 0, 0, 0, 0, None, 0, None, callbacks, None)


@pytest.mark.parametrize("token", [b"{other}", b"", None])
def test_wrong_token_gives_null_and_a_message(library: Any, token: bytes | None) -> None:
    from fmpy.fmi3 import fmi3LogMessageCallback

    from kinfmu.fmu.host.slaves import fmi2_callbacks

    dll, host = library
    logged: list[tuple[int, str]] = []
    if host.fmi == 2:
        callbacks = fmi2_callbacks(lambda *message: logged.append(message))
        given = ctypes.byref(callbacks)
    else:
        callbacks = fmi3LogMessageCallback(
            lambda _host, status, _category, text: logged.append((status, text.decode()))
        )
        given = ctypes.cast(callbacks, ctypes.c_void_p)
    assert _instantiate(dll, host, token, given) is None
    assert logged[0][0] == ERROR
    assert host.about.token in logged[0][1]
    assert _instantiate(dll, host, token) is None  # and no callback for the message


@pytest.mark.parametrize("name", [b"x", None])
def test_null_callbacks_are_accepted(library: Any, name: bytes | None) -> None:
    dll, host = library
    instance = ctypes.c_void_p(_instantiate(dll, host, host.about.token.encode(), name=name))
    assert instance.value
    prefix = f"fmi{host.fmi}"
    wrong = (ctypes.c_uint * 1)(9999)
    value = (ctypes.c_double * 1)()
    more = () if host.fmi == 2 else (ctypes.c_size_t(1),)
    get = getattr(dll, f"{prefix}GetReal" if host.fmi == 2 else f"{prefix}GetFloat64")
    assert get(instance, wrong, ctypes.c_size_t(1), value, *more) == ERROR  # a message without a callback
    getattr(dll, f"{prefix}FreeInstance").restype = None
    getattr(dll, f"{prefix}FreeInstance")(instance)
    getattr(dll, f"{prefix}FreeInstance")(None)


def test_logging_can_be_turned_off_and_categories_are_checked(start: Start) -> None:
    host = start()
    log = host.fmu.dll[f"fmi{host.fmi}SetDebugLogging"]
    switch = ctypes.c_int if host.fmi == 2 else ctypes.c_bool

    def turn(on: bool, *names: str) -> int:
        given = (ctypes.c_char_p * max(len(names), 1))(*[name.encode() for name in names])
        return int(log(ctypes.c_void_p(component), switch(on), ctypes.c_size_t(len(names)), given))

    component = getattr(host.fmu.component, "value", host.fmu.component)
    assert turn(False) == OK
    assert answer(host.set, {"crank_angle": math.nan}) == ERROR
    assert host.messages == []
    assert turn(True, "logStatusError") == OK
    assert answer(host.set, {"crank_angle": math.nan}) == ERROR
    assert len(host.messages) == 1
    assert turn(True) == OK
    assert turn(True, "logEvents") == WARNING
    assert "unknown log category 'logEvents'; categories: logStatusWarning" in host.messages[-1][1]


def test_paths_may_have_blanks_and_letters_of_any_script(built_native: Build, fmi: int, tmp_path: Path) -> None:
    host = Host(built_native("fourbar", fmi), tmp_path / "ä ö %20 +机构 b")
    host.initialize(0.0)
    assert host.get("crank.phi") == [0.0]
    host.free()


def test_every_function_of_the_standard_is_exported_and_needs_an_instance(library: Any, fmi: int) -> None:
    dll, _ = library
    text = headers("2.0" if fmi == 2 else "3.0")[HEADERS["2.0" if fmi == 2 else "3.0"][-1]]
    names = re.findall(rf"FMI{fmi}_Export fmi{fmi}\w+\s+(fmi{fmi}\w+);", text)
    assert len(names) > 40
    for name in names:
        function = getattr(dll, name)
        if not re.search("Instantiate|GetVersion|GetTypesPlatform|Free", name):
            assert function(*[None] * 8) == ERROR, name


def test_nothing_else_is_exported(library: Any) -> None:
    dll, _ = library
    with pytest.raises(AttributeError):
        dll.kf_solve  # noqa: B018  # it is not exported


def test_a_thousand_instances_at_once_share_nothing(library: Any) -> None:
    dll, host = library
    token = host.about.token.encode()
    instances = [ctypes.c_void_p(_instantiate(dll, host, token)) for _ in range(1000)]
    reference = (ctypes.c_uint * 1)(host.references["crank_angle"])
    one = ctypes.c_size_t(1)
    more = () if host.fmi == 2 else (one,)
    kind = "Real" if host.fmi == 2 else "Float64"
    set_one, get_one = (getattr(dll, f"fmi{host.fmi}{word}{kind}") for word in ("Set", "Get"))
    phi = (ctypes.c_uint * 1)(host.references["crank.phi"])
    for k, instance in enumerate(instances):
        assert set_one(instance, reference, one, (ctypes.c_double * 1)(0.001 * k), *more) == OK
    value = (ctypes.c_double * 1)()
    for k, instance in enumerate(instances):
        assert get_one(instance, phi, one, value, *more) == OK
        assert value[0] == 0.001 * k
        getattr(dll, f"fmi{host.fmi}FreeInstance")(instance)


def test_ten_thousand_instances_in_turn_leak_no_memory(library: Any) -> None:
    resource = pytest.importorskip("resource")
    dll, host = library
    token = host.about.token.encode()
    free = getattr(dll, f"fmi{host.fmi}FreeInstance")

    def churn(count: int) -> int:
        for _ in range(count):
            free(ctypes.c_void_p(_instantiate(dll, host, token)))
        return int(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)

    before = churn(1000)
    assert churn(10_000) - before < 2000  # kB; one instance alone takes tens of them
