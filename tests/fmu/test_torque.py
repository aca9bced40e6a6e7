"""FMUs that own the motion of their drivers: efforts in, angle and speed integrated by the FMU or by its host."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu

import kinfmu
from kinfmu import Body, Mechanism, Revolute
from kinfmu.errors import KinfmuError, RequestError
from kinfmu.mechanism.drivers import AngleDriver
from kinfmu.mechanism.laws import ConstantValue, External, MotionSequence
from kinfmu.mechanism.laws.sequence import Segment
from kinfmu.mechanism.loads import Damper, ForceAlong, TorqueOn
from kinfmu.solver.python.pose import Status
from tests.fmu.host import DISCARD, LAST_SUCCESSFUL_TIME, OK, Host
from tests.mechanisms import fourbar
from tests.motion.torque.test_torque_driven import G, five_bar, heavy, pendulum

PUSH = MotionSequence((Segment("dwell", 0.35), Segment("simple_harmonic", 0.1, 4.0), Segment("dwell", 1.0)))
WINDOW = 0.01  # [s] step of the host


def motor() -> Mechanism:
    """A four-bar with gravity, a damper, an external force and a torque that begins at 0.35 s."""
    loads = (
        Damper("oil", ("ground.O", "rocker.Q"), 3.0),
        ForceAlong("wind", "coupler.Q", External(), 0.4),
        TorqueOn("push", "crank", PUSH),
    )
    return replace(heavy(fourbar(2.0, 0.7, 1.9, 1.5), gravity=(0, -G), loads=loads), name="motor")


def rocker() -> Mechanism:
    """A triple rocker that falls to its dead centre."""
    return replace(heavy(fourbar(2.0, 1.0, 0.9, 1.5), gravity=(0, -G)), name="rocker")


MECHANISMS: dict[str, Callable[[], Mechanism]] = {
    "motor": motor,
    "rocker": rocker,
    "pendulum": pendulum,
    "arms": lambda: replace(heavy(five_bar(), gravity=(0, -G)), name="arms"),
    "parallelogram": lambda: heavy(kinfmu.load("fourbar")),
}
FLAVOURS = [("native", 2), ("native", 3), ("python", 2)]
of_each_flavour = pytest.mark.parametrize(("flavour", "fmi"), FLAVOURS)


@pytest.fixture
def torque_driven(fmu_of: Callable[..., Path]) -> Callable[..., Path]:
    """`torque_driven(name, flavour, fmi)`: path of an FMU."""
    return lambda name, flavour, fmi: fmu_of(MECHANISMS[name](), flavour, fmi, "torque")


@pytest.fixture
def start(torque_driven: Callable[..., Path], opened: Callable[..., Host]) -> Callable[..., Host]:
    """`start(name, flavour, fmi, **values)`: an initialized instance."""

    def get(name: str, flavour: str, fmi: int, *, model_exchange: bool = False, **values: float) -> Host:
        host = opened(torque_driven(name, flavour, fmi), model_exchange=model_exchange)
        host.set({name.replace("__", "."): value for name, value in values.items()})
        host.initialize(0.0)
        return host

    return get


def steps(host: Host, count: int, h: float = WINDOW, first: int = 0) -> None:
    for k in range(first, first + count):
        assert host.step(k * h, h) == OK


def same_motion(mechanism: Mechanism, stop: float, h: float, **arguments: Any) -> Any:
    return kinfmu.simulate(mechanism, drive="torque", start=0.0, stop=stop, step=h, **{"tolerance": 1e-12} | arguments)


@of_each_flavour
@pytest.mark.few(1)
def test_co_simulation_is_the_motion_that_python_integrates(
    flavour: str, fmi: int, torque_driven: Callable[..., Path]
) -> None:
    """With loads that jump between two samples, held inputs, and every output."""
    inputs = {"time": [0.0, 1.2], "crank_torque": [11.0, 11.0], "wind_force": [-7.0, -7.0]}
    path, state = torque_driven("motor", flavour, fmi), {"crank_angle": 0.4, "crank_speed": 3.0}
    run = kinfmu.simulate(path, start=0.0, stop=1.2, step=0.1, inputs=inputs, state=state, tolerance=1e-12)
    exact = same_motion(motor(), 1.2, 0.1, inputs={"crank_torque": 11.0, "wind_force": -7.0}, state=state)
    assert [event.text for event in run.events] == [event.text for event in exact.events]
    assert all("a step of 0.01 s would" in event.text for event in run.events)
    fine = {"start": 0.0, "stop": 0.2, "step": 0.01, "inputs": inputs, "state": state}
    assert not kinfmu.simulate(path, **fine).events
    assert not kinfmu.simulate(path, **fine, rate=5.0).events  # the samples are chosen
    for name in (*run.force_names, *(f"crank_{noun}" for noun in ("angle", "speed", "acceleration")), "coupler.ax"):
        np.testing.assert_allclose(run[name], exact[name], rtol=1e-9, atol=1e-9, err_msg=name)
    np.testing.assert_allclose(run["crank.torque"], 11.0, rtol=1e-9)
    loose = kinfmu.simulate(path, start=0.0, stop=1.2, step=0.1, inputs=inputs, state=state, tolerance=1e-5)
    error = np.abs(loose["crank_angle"] - exact["crank_angle"]).max()
    assert 1e-10 < error < 1e-3


@of_each_flavour
def test_one_step_of_the_host_is_as_good_as_many(flavour: str, fmi: int, start: Callable[..., Host]) -> None:
    """The integrator restarts where the load jumps, at 0.35 and 0.45 s."""
    one, many = (start("motor", flavour, fmi, crank_speed=3.0, integrator__tolerance=1e-12) for _ in range(2))
    assert one.step(0.0, 0.7) == OK
    steps(many, 70)
    assert one.get("crank_angle", "crank_speed") == pytest.approx(many.get("crank_angle", "crank_speed"), rel=1e-10)


def test_a_pendulum_follows_the_elliptic_functions(start: Callable[..., Host]) -> None:
    """sin(theta / 2) = k sn(K(k) - omega t, k), theta from the lowest point, released from the horizontal."""
    host = start("pendulum", "native", 2, crank_angle=0.0, crank_speed=0.0, integrator__tolerance=1e-12)
    omega, k = math.sqrt(G / 0.5), math.sin(math.pi / 4)
    quarter = mpmath.ellipk(k * k)
    for number in range(25):
        assert host.step(number * 0.16, 0.16) == OK
        swing = mpmath.ellipfun("sn", quarter - omega * (number + 1) * 0.16, m=k * k)
        assert host.get("crank_angle")[0] == pytest.approx(2 * math.asin(k * swing) - math.pi / 2, abs=1e-11)


def test_a_flywheel_turns_by_the_integral_of_its_torque(start: Callable[..., Host]) -> None:
    """Efforts hold during a step and act at once: a get after a set has the new acceleration."""
    mechanism = "pendulum"
    host = start(mechanism, "native", 2, crank_angle=-math.pi / 2, crank_speed=0.0)
    inertia = 2.0 * 0.5**2
    assert host.get("crank_acceleration")[0] == pytest.approx(0.0, abs=1e-12)
    host.set({"crank_torque": 3.0})
    assert host.get("crank_acceleration", "crank.torque") == pytest.approx([3.0 / inertia, 3.0], rel=1e-12)


@of_each_flavour
@pytest.mark.few(1)
def test_two_drivers_keep_the_energy(flavour: str, fmi: int, start: Callable[..., Host]) -> None:
    if (flavour, fmi) == ("native", 2):
        pytest.skip("the same code as in FMI 3.0")
    host = start("arms", flavour, fmi, integrator__tolerance=1e-12)
    energies = []
    for k in range(20):
        energies.append(sum(host.get("kinetic_energy", "potential_energy")))
        assert host.step(0.1 * k, 0.1) == OK
    assert host.get("kinetic_energy")[0] > 1.0
    np.testing.assert_allclose(energies, energies[0], rtol=0, atol=1e-9 * host.get("kinetic_energy")[0])
    exact = same_motion(MECHANISMS["arms"](), 2.0, 2.0)
    names = ("shoulder_angle", "elbow_angle", "shoulder_speed", "elbow_speed")
    assert host.get(*names) == pytest.approx([exact[name][-1] for name in names], abs=1e-8)


@pytest.mark.parametrize(
    ("flavour", "tolerance"), [("native", 1e-5), ("native", 1e-9), ("native", 1e-12), ("python", 1e-9)]
)
@pytest.mark.few(1)
def test_a_motion_ends_at_its_limit_and_stays_before_it(
    flavour: str, tolerance: float, start: Callable[..., Host]
) -> None:
    """The step is discarded with the reason and the time; a smaller one reaches up to the limit."""
    host = start("rocker", flavour, 2, crank_angle=0.5, crank_speed=0.1, integrator__tolerance=tolerance)
    limit = -math.acos((2.0**2 + 1.0**2 - (0.9 + 1.5) ** 2) / (2 * 2.0 * 1.0))
    steps(host, 69)
    before = host.get("crank_angle", "crank_speed")
    host.messages.clear()
    assert host.step(0.69, 0.01) == DISCARD
    (message,) = [text for status, text in host.messages if status == DISCARD]
    assert message.startswith("at t = 0.693189 s: the motion ends at a limit: crank = -1.7619")
    assert "the limit is crank = -1.7619584733 rad" in message
    assert "\n" not in message
    assert host.fmu.getRealStatus(LAST_SUCCESSFUL_TIME) == 0.69
    assert host.count("solver.status") == Status.OUTSIDE
    assert host.message().startswith("the motion ends at a limit: crank = -1.7619")
    assert host.get("crank_angle", "crank_speed") == before
    assert host.step(0.69, 0.003) == OK
    assert limit < host.get("crank_angle")[0] < before[0]
    assert host.count("solver.status") == Status.NEAR_SINGULAR
    assert host.step(0.693, 0.01) == DISCARD


def test_the_run_of_a_limit_ends_with_one_event(torque_driven: Callable[..., Path]) -> None:
    state = {"crank_angle": 0.5, "crank_speed": 0.1}
    run = kinfmu.simulate(torque_driven("rocker", "native", 2), start=0.0, stop=3.0, step=0.01, state=state)
    (event,) = run.events
    assert event.level == "error"
    assert "the motion ends at a limit" in event.text
    assert run.status.tolist()[-2:] == [Status.OK, Status.OUTSIDE]


def test_model_exchange_ends_at_the_limit_too(
    torque_driven: Callable[..., Path], capfd: pytest.CaptureFixture[str]
) -> None:
    """fmpy would keep a logger of its caller for every later FMU of the process, after it is gone; so it prints."""
    found = simulate_fmu(
        str(torque_driven("rocker", "native", 2)),
        fmi_type="ModelExchange",
        stop_time=3.0,
        relative_tolerance=1e-9,
        output_interval=0.01,
        start_values={"crank_angle": 0.5, "crank_speed": 0.1},
        output=["crank_angle"],
    )
    assert found["time"][-1] == pytest.approx(0.693, abs=0.01)
    assert found["crank_angle"].min() > -1.7619585
    assert "the motion ends at a limit" in capfd.readouterr().out


@pytest.mark.parametrize("fmi", [2, 3])
def test_hosts_integrate_the_states_in_model_exchange(fmi: int, torque_driven: Callable[..., Path]) -> None:
    """CVode of fmpy; the events of the load are its time events."""
    found = simulate_fmu(
        str(torque_driven("motor", "native", fmi)),
        fmi_type="ModelExchange",
        stop_time=1.0,
        relative_tolerance=1e-10,
        output_interval=0.1,
        start_values={"crank_angle": 0.4, "crank_speed": 3.0, "crank_torque": 11.0, "wind_force": -7.0},
        output=["crank_angle", "crank_speed", "crank.torque"],
    )
    state = {"crank_angle": 0.4, "crank_speed": 3.0}
    exact = same_motion(motor(), 1.0, 0.1, inputs={"crank_torque": 11.0, "wind_force": -7.0}, state=state)
    rows = [int(np.flatnonzero(np.isclose(found["time"], t, rtol=0, atol=1e-9))[-1]) for t in exact.t]
    for name in ("crank_angle", "crank_speed"):
        np.testing.assert_allclose(found[name][rows], exact[name], rtol=0, atol=2e-6, err_msg=name)
    assert {0.35, 0.45} <= {round(t, 9) for t in found["time"].tolist()}


@pytest.mark.parametrize("flavour", ["native", "python"])
@pytest.mark.few(1)
def test_it_passes_change_points_over_bridges(flavour: str, start: Callable[..., Host]) -> None:
    """The reduced inertia of a parallelogram is constant, and so is its speed."""
    host = start("parallelogram", flavour, 2, crank_speed=7.0)
    first = host.get("crank_angle")[0]
    seen = set()
    for k in range(100):
        assert host.step(k * WINDOW, WINDOW) == OK
        seen.add(host.count("solver.status"))
        assert math.isfinite(host.get("crank.reduced_inertia")[0])
    assert Status.BRIDGED in seen
    assert host.get("crank_angle")[0] - first == pytest.approx(7.0 * 1.0, abs=1e-9)


@of_each_flavour
def test_a_restored_state_gives_the_same_bits(flavour: str, fmi: int, start: Callable[..., Host]) -> None:
    """In the same instance, and in another one through bytes."""
    host, other = (start("motor", flavour, fmi, crank_speed=3.0) for _ in range(2))
    names = ("crank_angle", "crank_speed", "crank_acceleration", "coupler.ax", "crank.torque")
    host.set({"crank_torque": 4.0})
    steps(host, 10)
    kept = host.state()
    saved = host.serialize(kept)
    steps(host, 10, first=10)
    exact = host.get(*names)
    host.set({"crank_torque": -40.0})
    steps(host, 5, first=20)
    host.restore(kept)
    steps(host, 10, first=10)
    assert host.get(*names) == exact
    other.restore(other.deserialize(saved))
    steps(other, 10, first=10)
    assert other.get(*names) == exact
    host.fmu.reset()
    host.set({"crank_speed": 3.0, "crank_torque": 4.0})
    host.initialize(0.0)
    steps(host, 20)
    assert host.get(*names) == exact


@pytest.mark.parametrize("fmi", [2, 3])
def test_directional_derivatives_are_those_of_the_outputs(fmi: int, start: Callable[..., Host]) -> None:
    """Of states, efforts and loads, by central differences of fresh instances."""
    knowns = ["crank_angle", "crank_speed", "crank_torque", "wind_force"]
    unknowns = ["crank_acceleration", "coupler.x", "coupler.vx", "coupler.ax", "crank.torque", "crank.bias_torque"]
    at = {"crank_angle": 0.6, "crank_speed": 2.5, "crank_torque": 5.0, "wind_force": -3.0}
    host = start("motor", "native", fmi, model_exchange=True, **at)
    h = 1e-4
    for known in knowns:
        found = host.slopes(unknowns, [known], [1.0])
        sides = [start("motor", "native", fmi, **at | {known: at[known] + by}).get(*unknowns) for by in (-h, h)]
        expected = (np.array(sides[1]) - np.array(sides[0])) / (2 * h)
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-5, err_msg=known)
    inertia = host.get("crank.reduced_inertia")[0]
    of_torque = host.slopes(["crank_acceleration"], ["crank_torque"], [1.0])
    assert of_torque == pytest.approx([1.0 / inertia], rel=1e-12)


@of_each_flavour
def test_the_description_is_valid_and_declares_the_states(
    flavour: str, fmi: int, torque_driven: Callable[..., Path]
) -> None:
    path = torque_driven("motor", flavour, fmi)
    assert validate_fmu(str(path)) == []
    from fmpy import read_model_description

    about = read_model_description(str(path))
    places = {variable.name: variable for variable in about.modelVariables}
    assert [one.variable.name for one in about.derivatives] == ["crank_speed", "crank_acceleration"]
    assert [one.variable.derivative.name for one in about.derivatives] == ["crank_angle", "crank_speed"]
    assert about.numberOfContinuousStates == 2
    assert places["crank_torque"].causality == places["wind_force"].causality == "input"
    assert "driven_by_time" not in places
    on = {one.variable.name: {two.name for two in one.dependencies} for one in about.outputs}
    moved = {"crank_angle", "crank_speed", "crank_torque", "wind_force"}
    if fmi == 3:  # with time and tunable parameters
        moved |= {"time", *(constant.name for constant in motor().load_constants)}
    assert on["crank_acceleration"] == on["coupler.ax"] == moved
    assert on["coupler.x"] == on["crank.reduced_inertia"] == {"crank_angle"}
    assert on["coupler.vx"] == on["kinetic_energy"] == {"crank_angle", "crank_speed"}
    assert "crank_torque" not in on["crank.bias_torque"]


@of_each_flavour
def test_wrong_values_are_refused(flavour: str, fmi: int, start: Callable[..., Host]) -> None:
    host = start("motor", flavour, fmi)
    for values, text in (
        ({"crank_angle": 1.0}, r"crank_angle = 1(\.0)? comes too late: it is a state"),
        ({"crank_acceleration": 1.0}, r"crank_acceleration .*that can be set"),
        ({"crank_torque": math.nan}, r"crank_torque = nan is not a finite number"),
        ({"crank_torque": 1e101}, r"crank_torque = 1e\+101 is too large: at most 1e\+100 is taken; 0(\.0)? stays"),
        ({"integrator.tolerance": 0.1}, r"integrator.tolerance = 0.1 must be 1e-13 to 0.0001"),
    ):
        assert re.search(text, host.refusal(values))
        assert host.step_after_refusal(0.0, 0.0) == OK


def test_a_mechanism_that_no_effort_determines_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RequestError, match=r"mechanism 'fourbar_general' has no masses, so that efforts"):
        kinfmu.build(fourbar(2.0, 0.7, 1.9, 1.5), tmp_path / "a.fmu", drive="torque", flavour="native")


@of_each_flavour
@pytest.mark.few(1)
def test_the_driver_without_reduced_inertia_is_named(flavour: str, fmi: int, tmp_path: Path) -> None:
    heavy_crank = pendulum()
    light = Mechanism(
        "light",
        [*heavy_crank.bodies, Body("wheel", {"W": (0, 0)}, (1, 1, 0))],
        [*heavy_crank.joints, Revolute("W", ("ground.W", "wheel.W"))],
        [*heavy_crank.drivers, AngleDriver("second", "wheel", ConstantValue(0.0))],
    )
    path = kinfmu.build(light, tmp_path / "a.fmu", flavour=flavour, fmi=fmi, drive="torque")
    with pytest.raises(KinfmuError, match="driver second: its reduced inertia is 0"):
        kinfmu.simulate(path)


@pytest.mark.long
def test_a_four_bar_keeps_its_energy_over_a_thousand_turns(tmp_path: Path) -> None:
    path = kinfmu.build(heavy(fourbar(2.0, 0.7, 1.9, 1.5)), tmp_path / "a.fmu", flavour="native", drive="torque")
    run = kinfmu.simulate(path, stop=950.0, step=1.0, state={"crank_speed": 7.0}, tolerance=1e-13)
    assert run["crank_angle"][-1] > 1000 * 2 * math.pi
    assert np.abs(run["kinetic_energy"] / run["kinetic_energy"][0] - 1).max() < 2e-10


def test_settings_of_a_torque_driven_fmu_are_for_these_alone(torque_driven: Callable[..., Path]) -> None:
    path = torque_driven("rocker", "native", 2)
    with pytest.raises(RequestError, match=r"crank_speed = '3 mm': unit 'mm' must be one of rad/s"):
        kinfmu.simulate(path, state={"crank_speed": "3 mm"})  # type: ignore[dict-item]
    with pytest.raises(RequestError, match=r"integrator.tolerance = 0.1 must be at least 1e-13, at most 0.0001"):
        kinfmu.simulate(path, tolerance=0.1)
    with pytest.raises(RequestError, match="there is no parameter 'crank_sped'; did you mean 'crank_speed'"):
        kinfmu.simulate(path, state={"crank_sped": 1.0})


@of_each_flavour
@pytest.mark.few(1)
def test_a_mass_on_a_crank_turns_in_closed_form(
    flavour: str, fmi: int, opened: Callable[..., Host], tmp_path: Path
) -> None:
    """theta = T t^2 / (2 m r^2), with a parameter as mass, without forces among the outputs."""
    mechanism = replace(
        pendulum(gravity=(0.0, 0.0)),
        name="flywheel",
        parameters={"rim": "2 kg"},
        bodies=tuple(body if body.is_ground else replace(body, mass="rim") for body in pendulum().bodies),
    )
    path = kinfmu.build(mechanism, tmp_path / "a.fmu", flavour=flavour, fmi=fmi, drive="torque", outputs=["rod.phi"])
    host = opened(path)
    assert not {"crank.torque", "kinetic_energy"} & set(host.references)
    host.set({"rim": 8.0, "crank_torque": 3.0})
    host.initialize(0.0)
    inertia = 8.0 * 0.5**2
    for k in range(5):
        assert host.step(0.4 * k, 0.4) == OK
    found = host.get("crank_angle", "crank_speed", "crank_acceleration", "rod.phi")
    assert found == pytest.approx([3.0 * 2.0 / inertia, 3.0 * 2.0 / inertia, 3.0 / inertia, 3.0], rel=1e-12)


@pytest.mark.parametrize("flavour", ["native", "python"])
def test_the_tolerance_of_the_host_is_that_of_the_integrator(
    flavour: str, torque_driven: Callable[..., Path], opened: Callable[..., Host]
) -> None:
    host = opened(torque_driven("motor", flavour, 2))
    taken = []
    for tolerance in (1e-6, 1e-20, 1.0):
        host.fmu.setupExperiment(startTime=0.0, tolerance=tolerance)
        taken += host.get("integrator.tolerance")
    assert taken == [1e-6, 1e-13, 1e-4]
