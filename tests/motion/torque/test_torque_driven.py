"""Torque-driven motion, over breaks of cams too."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar, Literal

import mpmath
import numpy as np
import pytest
from scipy.integrate import romb

import kinfmu
from kinfmu import (
    AngleBetween,
    AngleDriver,
    Body,
    ConstantSpeed,
    ConstantValue,
    Damper,
    ForceAlong,
    Mechanism,
    Revolute,
    Run,
    TorqueOn,
)
from kinfmu.errors import KinfmuError, RequestError
from kinfmu.mechanism.laws import External, Harmonic, MotionSequence, Segment
from kinfmu.mechanism.measures import Maximum, PeakSpeed
from kinfmu.solver.python.pose import Status
from tests.mechanisms import five_bar, fourbar
from tests.motion.test_breaks import tappet
from tests.motion.torque import andrews
from tests.run.test_lagrange import squeezed

G = 9.81  # [m/s2]


def heavy(mechanism: Mechanism, *, gravity: tuple[float, float] | None = None, **changes: Any) -> Mechanism:
    bodies = tuple(
        body if body.is_ground else replace(body, mass=1.0 + 0.3 * k, center_of_mass=(0.3, 0.1), inertia=0.2)
        for k, body in enumerate(mechanism.bodies)
    )
    return replace(mechanism, bodies=bodies, gravity=gravity, **changes)


def pendulum(length: float = 0.5, **changes: Any) -> Mechanism:
    """A point mass on a rod, measured from the horizontal."""
    return Mechanism(
        "pendulum",
        [
            Body("ground", {"O": (0, 0), "W": (1, 1)}),
            Body("rod", {"O": (0, 0), "T": (length, 0)}, (0, 0, 0), mass=2.0, center_of_mass=(length, 0)),
        ],
        [Revolute("O", ("ground.O", "rod.O"))],
        [AngleDriver("crank", "rod", ConstantValue(0.0))],
        **({"gravity": (0, -G)} | changes),
    )


def simulated(mechanism: Mechanism, stop: float, count: int, **arguments: Any) -> Run:
    return kinfmu.simulate(mechanism, drive="torque", start=0.0, stop=stop, step=stop / count, **arguments)


def energy(run: Run) -> Any:
    return run["kinetic_energy"] + run["potential_energy"]


def test_energy_is_constant_without_a_torque() -> None:
    run = simulated(heavy(fourbar(2.0, 0.7, 1.9, 1.5)), 19.0, 100, state={"crank_speed": 7.0}, tolerance=1e-13)
    assert run["crank_angle"][-1] > 20 * 2 * math.pi
    assert np.abs(run["kinetic_energy"] / run["kinetic_energy"][0] - 1).max() < 1e-11
    assert np.abs(run["crank.torque"]).max() < 1e-12


def test_a_motion_after_a_thousand_turns_is_as_exact_as_at_first() -> None:
    crank = heavy(fourbar(2.0, 0.7, 1.9, 1.5))
    state = {"crank_angle": 2000 * math.pi, "crank_speed": 7.0}
    far = simulated(crank, 1.0, 2, state=state, tolerance=1e-6)  # relative to the angle it would be 8e-6
    assert np.abs(far["kinetic_energy"] / far["kinetic_energy"][0] - 1).max() < 3e-6


def test_it_passes_change_points_over_bridges() -> None:
    """The reduced inertia of a parallelogram is constant, and so is its speed."""
    run = simulated(heavy(kinfmu.load("fourbar")), 5.0, 40, state={"crank_speed": 7.0}, tolerance=1e-10)
    np.testing.assert_allclose(run["crank_angle"] - run["crank_angle"][0], 7.0 * run.t, rtol=0, atol=1e-8)
    assert not run.events


def test_a_pendulum_follows_the_elliptic_functions() -> None:
    """sin(theta / 2) = k sn(K(k) - omega t, k), theta from the lowest point, released from the horizontal."""
    length = 0.5
    run = simulated(pendulum(length), 4.0, 25, state={"crank_angle": 0.0, "crank_speed": 0.0}, tolerance=1e-12)
    omega, k = math.sqrt(G / length), math.sin(math.pi / 4)
    quarter = mpmath.ellipk(k * k)
    exact = [2 * math.asin(k * mpmath.ellipfun("sn", quarter - omega * t, m=k * k)) - math.pi / 2 for t in run.t]
    np.testing.assert_allclose(run["crank_angle"], exact, rtol=0, atol=1e-10)


@pytest.mark.parametrize(
    ("method", "tolerance", "error"),
    [
        ("DOP853", 1e-4, 1e-2),
        ("DOP853", 1e-6, 1e-4),
        ("DOP853", 1e-8, 1e-6),
        ("DOP853", 1e-11, 1e-9),
        ("Radau", 1e-8, 1e-8),
    ],
)
@pytest.mark.few(2)
def test_andrews_squeezer_converges_to_the_published_solution(method: str, tolerance: float, error: float) -> None:
    run = squeezed(method, tolerance)
    for column, order in (("phi", 0), ("omega", 1)):
        exact = [sum(andrews.AT_END[name][order] for name in names) for names in andrews.BODIES.values()]
        found = [run[f"{body}.{column}"][-1] for body in andrews.BODIES]
        np.testing.assert_allclose(found, exact, rtol=0, atol=error * np.abs(exact).max())


def test_work_of_efforts_is_the_change_of_energy() -> None:
    """Motor with a torque that falls with the speed, an external force and a damper."""
    mechanism = heavy(
        fourbar(2.0, 0.7, 1.9, 1.5),
        gravity=(0, -G),
        loads=(
            Damper("oil", ("ground.O", "rocker.Q"), 3.0),
            ForceAlong("wind", "coupler.Q", External(), 0.4),
        ),
    )
    run = simulated(
        mechanism,
        1.0,
        512,
        state={"crank_speed": 3.0},
        inputs={
            "crank_torque": lambda t, state: 40.0 - 2.0 * state["crank_speed"],  # noqa: ARG005
            "wind_force": lambda t: 5.0 * math.sin(4.0 * t),
        },
        tolerance=1e-11,
    )
    np.testing.assert_allclose(run["crank.torque"], 40.0 - 2.0 * run["crank_speed"], rtol=0, atol=1e-10)
    phi, omega, angle = (run[name] for name in ("coupler.phi", "coupler.omega", "rocker.phi"))
    q_x, q_y = run["coupler.vx"] - 1.9 * np.sin(phi) * omega, run["coupler.vy"] + 1.9 * np.cos(phi) * omega
    x, y = 2.0 + 1.5 * np.cos(angle), 1.5 * np.sin(angle)
    closing = (x * q_x + y * q_y) / np.hypot(x, y)
    power = run["crank.torque"] * run["crank_speed"] - 3.0 * closing**2
    power += 5.0 * np.sin(4.0 * run.t) * (math.cos(0.4) * q_x + math.sin(0.4) * q_y)
    assert romb(power, dx=run.t[1]) == pytest.approx(energy(run)[-1] - energy(run)[0], rel=1e-10)


def test_two_drivers_keep_the_energy_and_give_back_their_torques() -> None:
    inputs = {"shoulder_torque": Harmonic(0.0, 3.0, 2.0), "elbow_torque": lambda t: 1.0 - t}
    free = simulated(heavy(five_bar(), gravity=(0, -G)), 2.0, 20, tolerance=1e-12)
    assert np.abs(energy(free) - energy(free)[0]).max() < 1e-9 * free["kinetic_energy"].max()
    run = simulated(heavy(five_bar()), 0.5, 20, inputs=inputs, tolerance=1e-10)
    law = inputs["shoulder_torque"]
    np.testing.assert_allclose(run["shoulder.torque"], [law.at(t) for t in run.t], rtol=0, atol=1e-10)
    np.testing.assert_allclose(run["elbow.torque"], 1.0 - run.t, rtol=0, atol=1e-10)


@pytest.mark.parametrize("tolerance", [1e-5, 1e-9, 1e-12])
def test_a_mechanism_that_falls_to_its_limit_stops_there_with_one_line(tolerance: float) -> None:
    """The crank of a triple rocker stops where coupler and rocker are in line; a run over the angle ends there too."""
    ground, crank, coupler, rocker = 2.0, 1.0, 0.9, 1.5
    mechanism = heavy(fourbar(ground, crank, coupler, rocker), gravity=(0, -G))
    run = simulated(mechanism, 3.0, 300, state={"crank_angle": 0.5, "crank_speed": 0.1}, tolerance=tolerance)
    limit = -math.acos((ground**2 + crank**2 - (coupler + rocker) ** 2) / (2 * ground * crank))
    assert run.status.tolist() == [Status.OK] * (len(run) - 2) + [run.status[-2], Status.OUTSIDE]
    assert np.isnan(run.values[-1]).all()
    assert run["crank_angle"][-1] == pytest.approx(limit, abs=2e-6)
    (event,) = run.events
    assert event.t == run.t[-1] == pytest.approx(0.693188896, abs=1e2 * tolerance + 1e-8)
    assert event.level == "error"
    assert event.text.startswith(f"at t = {event.t:.9g} s the motion ends at a limit: crank = -1.7619")
    assert "the limit is crank = -1.7619584733 rad" in event.text
    assert "\n" not in event.text
    before = energy(run)[:-1]
    assert np.abs(before - before[0]).max() < 1e3 * tolerance * run["kinetic_energy"][:-1].max()


def test_two_drivers_end_at_the_stretched_arms() -> None:
    """The arms of a five-bar are stretched where the distance of their pins P and Q is the sum of their lengths."""
    whole = five_bar()
    shorter = {
        "left": replace(whole.bodies[1], start=(0, 0, 0.8)),
        "right": replace(whole.bodies[2], start=(3, 0, 2.3)),
        "forearm": replace(whole.bodies[3], points={"P": (-0.75, 0), "T": (0.75, 0)}, start=(1.22, 1.255, 0.8)),
        "strut": replace(whole.bodies[4], points={"Q": (0, 0), "T": (1.2, 0)}, start=(2.334, 0.746, 2.085)),
    }
    drivers = (AngleDriver("shoulder", "left", ConstantValue(0.8)), AngleDriver("elbow", "right", ConstantValue(2.3)))
    mechanism = replace(heavy(replace(whole, bodies=(whole.bodies[0], *shorter.values()))), drivers=drivers)
    run = simulated(mechanism, 3.0, 300, inputs={"shoulder_torque": 8.0, "elbow_torque": -8.0}, tolerance=1e-9)
    (event,) = run.events
    assert event.level == "error"
    assert "the limit is" in event.text
    assert run.good.tolist() == [True] * (len(run) - 1) + [False]
    left, right = run["shoulder_angle"][-1], run["elbow_angle"][-1]
    distance = math.hypot(3.0 + math.cos(right) - math.cos(left), math.sin(right) - math.sin(left))
    assert distance == pytest.approx(1.5 + 1.2, abs=1e-5)


def test_it_restarts_where_a_law_jumps() -> None:
    """A free flywheel under a torque of pieces: the speed is the integral of the torque over the inertia."""
    law = MotionSequence((Segment("dwell", 0.3), Segment("simple_harmonic", 0.1, 2.0), Segment("dwell", 1.0)))
    run = simulated(pendulum(gravity=None), 1.0, 7, inputs={"crank_torque": law}, tolerance=1e-9)
    area = 0.5 * 0.1 * 2.0 + 0.6 * 2.0  # the rise is odd about its middle
    assert run["crank_speed"][-1] == pytest.approx(area / (2.0 * 0.5**2), rel=1e-10)


def test_tables_are_linear_between_their_times() -> None:
    run = simulated(pendulum(gravity=None), 1.0, 7, inputs={"time": [0.0, 0.33, 1.0], "crank_torque": [0.0, 3.0, 0.0]})
    assert run["crank_speed"][-1] == pytest.approx(1.5 / (2.0 * 0.5**2), rel=1e-12)


def test_the_run_is_one_over_time() -> None:
    """It has the columns of a solved one, whose values it equals where the law has the same motion."""

    class Sink:
        calls: ClassVar[list[tuple[str, int]]] = []

        def begin(self, run: Run) -> None:
            self.calls.append(("begin", len(run)))

        def add(self, run: Run) -> None:
            self.calls.append(("add", len(run)))

        def end(self, run: Run, reason: str) -> None:
            self.calls.append((f"end{reason}", len(run)))

    wheel = pendulum(gravity=None)
    driven = replace(wheel, drivers=(AngleDriver("crank", "rod", ConstantSpeed(0.2, 3.0)),))
    run = simulated(driven, 1.0, 10, sink=Sink())
    assert Sink.calls == [("begin", 0), ("add", 11), ("end", 11)]
    solved = kinfmu.solve(driven, run.t)
    assert run.axis == "time"
    assert [column.name for column in run.columns()] == [column.name for column in solved.columns()]
    for column in solved.columns():
        np.testing.assert_allclose(run[column.name], column.values, rtol=0, atol=1e-12, err_msg=column.name)


def test_a_run_of_one_sample_has_the_accelerations_of_its_start() -> None:
    run = kinfmu.simulate(pendulum(), drive="torque", start=0.0, stop=0.0, step=0.1)
    assert run["crank_acceleration"].tolist() == pytest.approx([-G / 0.5])


def test_a_turn_shortly_before_a_limit_is_none() -> None:
    """Pulled back by gravity 1e-3 rad before its dead centre, the crank returns to where it was released."""
    mechanism = heavy(fourbar(2.0, 1.0, 0.9, 1.5), gravity=(0, G))
    run = simulated(mechanism, 3.0, 30, state={"crank_angle": 0.5, "crank_speed": 0.0}, tolerance=1e-11)
    assert not run.events
    assert np.abs(energy(run) - energy(run)[0]).max() < 1e-8 * run["kinetic_energy"].max()
    assert run["crank_angle"].min() >= 0.5 - 1e-9


def test_measures_are_read_from_the_run() -> None:
    """A pendulum released from the horizontal: extremes between the samples by the balance of energy."""
    readings = (PeakSpeed("speed", "rod.phi"), Maximum("fastest", "kinetic_energy"))
    run = simulated(pendulum(0.5, measures=readings), 0.6, 20, tolerance=1e-11)
    found = {name: found.value for name, found in kinfmu.measure(run).items()}
    assert found["speed"] == pytest.approx(math.sqrt(2 * G / 0.5), rel=1e-6)
    assert found["fastest"] == pytest.approx(2.0 * G * 0.5, rel=1e-6)


def test_three_cylinders_keep_the_energy() -> None:
    digger = replace(kinfmu.load("excavator_loaded"), loads=())
    run = simulated(digger, 0.3, 6, tolerance=1e-9)
    assert np.abs(energy(run) - energy(run)[0]).max() < 1e-9 * run["kinetic_energy"].max()
    assert run["kinetic_energy"].max() > 1e3


def test_laws_of_loads_are_over_the_time_of_the_run() -> None:
    blown = pendulum(gravity=None, loads=(TorqueOn("wind", "rod", Harmonic(0.0, 3.0, 2.0)),))
    run = simulated(blown, 1.0, 5, tolerance=1e-11)
    same = simulated(pendulum(gravity=None), 1.0, 5, inputs={"crank_torque": Harmonic(0.0, 3.0, 2.0)}, tolerance=1e-11)
    np.testing.assert_allclose(run.values, same.values, rtol=0, atol=1e-12)
    np.testing.assert_allclose(run["crank.torque"], 0.0, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"inputs": {"crank_force": 1.0}}, r"input 'crank_force' is not known; did you mean 'crank_torque'\?"),
        ({"inputs": {"crank_torque": "much"}}, r"crank_torque = 'much' must be a number, a law of time, a function"),
        ({"inputs": {"crank_torque": lambda t: math.nan}}, r"crank_torque = nan at t = 0 s must be a finite number"),  # noqa: ARG005
        ({"inputs": {"crank_torque": [1.0, 2.0]}}, r"crank_torque = \[1.0, 2.0\] must be"),
        ({"inputs": {"time": [0, 1], "crank_torque": [1.0]}}, r"crank_torque must have 2 finite numbers"),
        ({"inputs": {"time": [0, 0], "crank_torque": [1.0, 1.0]}}, r"time must be finite numbers that increase"),
        ({"state": {"angle": 1.0}}, r"state 'angle' is not known; .*states: crank_angle, crank_speed"),
        ({"state": {"crank_speed": math.inf}}, r"crank_speed = inf must be a finite number"),
        ({"tolerance": 0.1}, r"tolerance = 0.1 must be 1e-13 to 0.0001"),
        ({"method": "RK45"}, r"method 'RK45' is not known.*DOP853, Radau"),
        ({"rate": 3.0}, r"wrap, channels, rate and files of inputs are for FMUs"),
    ],
)
def test_wrong_input_gets_one_line(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(RequestError, match=message) as caught:
        simulated(pendulum(), 1.0, 10, **arguments)
    assert "\n" not in str(caught.value)


def test_a_mechanism_that_no_effort_determines_is_refused() -> None:
    with pytest.raises(RequestError, match=r"mechanism 'fourbar_general' has no masses"):
        simulated(fourbar(2.0, 0.7, 1.9, 1.5), 1.0, 10)
    point = pendulum()
    massless = [replace(body, mass=2.0 * body.is_ground, center_of_mass=(0, 0)) for body in point.bodies]
    with pytest.raises(KinfmuError):
        simulated(replace(point, bodies=tuple(massless)), 1.0, 10)
    central = replace(point.bodies[1], center_of_mass=(0, 0))
    with pytest.raises(RequestError, match=r"driver crank: its reduced inertia is 0"):
        simulated(replace(point, bodies=(point.bodies[0], central)), 1.0, 10)


def test_states_outside_the_limits_are_refused() -> None:
    with pytest.raises(RequestError, match=r"the initial state: crank = 2.5 rad .* cannot be reached"):
        simulated(heavy(fourbar(2.0, 1.0, 0.9, 1.5)), 1.0, 10, state={"crank_angle": 2.5})


def test_samples_too_coarse_to_show_the_motion_are_noted_with_a_step_that_would_do() -> None:
    state = {"crank_angle": -1.2, "crank_speed": 0.0}
    (event,) = simulated(pendulum(), 10.0, 10, state=state).events
    assert event.level == "info"
    found = re.fullmatch(r"samples 1 s apart do not show the motion: .*crank .*; a step of (\S+) s would", event.text)
    assert found, event.text
    assert not simulated(pendulum(), 10.0, round(10.0 / float(found[1])), state=state).events
    spun = simulated(pendulum(gravity=None), 1.0, 4, state={"crank_angle": 0.0, "crank_speed": 20.0})
    assert [one.text.partition(": ")[2] for one in spun.events] == [
        "crank turns by up to 286 deg from one to the next; a step of 0.005 s would"
    ]


# ------------------------------------------------------------------------------------------------------- breaks of cams


def heavy_tappet(law: str) -> Mechanism:
    """A cam of 0.02 kg m2 that lifts 2 kg against gravity, with two dwells."""
    plain = tappet(law)
    bodies = [replace(body, mass=1.0, inertia=0.02) if body.name == "cam" else body for body in plain.bodies]
    return replace(plain, bodies=tuple(bodies))


def energy_error(run: Run, torque: float) -> float:
    """Return what the change of energy misses of the torque's work, relative to the work or the kinetic energy."""
    energy = run["kinetic_energy"] + run["potential_energy"]
    work = torque * (run["cam_angle"] - run["cam_angle"][0])
    size = max(float(np.abs(work).max()), float(run["kinetic_energy"].max()))
    return float(np.abs(energy - energy[0] - work).max()) / size


@pytest.mark.parametrize("law", ["cycloidal", "simple_harmonic"])
@pytest.mark.parametrize("tolerance", [1e-6, 1e-9, 1e-11])
@pytest.mark.few(2)
def test_the_error_follows_the_tolerance_over_breaks(law: str, tolerance: float) -> None:
    """Ten turns in few long steps; the harmonic law jumps in its second derivative, the cycloidal one in its third."""
    run = kinfmu.simulate(
        heavy_tappet(law),
        drive="torque",
        start=0.0,
        stop=2.0,
        step=1.0,
        inputs={"cam_torque": 0.4},
        state={"cam_angle": 0.0, "cam_speed": 10.0},
        tolerance=tolerance,
    )
    assert run["cam_angle"][-1] > 9 * 2 * np.pi
    assert energy_error(run, 0.4) < 5.0 * tolerance


@pytest.mark.parametrize(("flavour", "fmi"), [("native", 3), ("python", 2)])
@pytest.mark.few(1)
def test_an_fmu_restarts_at_breaks_too(
    flavour: Literal["native", "python"], fmi: Literal[2, 3], tmp_path: Path
) -> None:
    path = kinfmu.build(
        heavy_tappet("simple_harmonic"), tmp_path / "tappet.fmu", flavour=flavour, fmi=fmi, drive="torque"
    )
    for tolerance in (1e-6, 1e-9, 1e-11):
        run = kinfmu.simulate(
            path,
            start=0.0,
            stop=2.0,
            step=0.5,
            inputs={"time": [0.0, 2.0], "cam_torque": [0.4, 0.4]},
            state={"cam_angle": 0.0, "cam_speed": 10.0},
            tolerance=tolerance,
        )
        assert energy_error(run, 0.4) < 5.0 * tolerance


def test_a_motion_that_turns_round_crosses_the_same_break_twice() -> None:
    state = {"cam_angle": 0.6, "cam_speed": 3.0}  # the rise begins at 40 deg = 0.698 rad
    run = kinfmu.simulate(
        heavy_tappet("simple_harmonic"),
        drive="torque",
        start=0.0,
        stop=0.4,
        step=0.05,
        inputs={"cam_torque": -0.4},
        state=state,
        tolerance=1e-11,
    )
    assert run["cam_angle"].max() > 0.75
    assert run["cam_angle"][-1] < 0.6
    assert energy_error(run, -0.4) < 1e-10


def test_a_torque_over_the_angle_is_the_change_of_kinetic_energy() -> None:
    """Three pieces over the angle: the work of each rise of the torque is its mean, by symmetry."""
    law = MotionSequence((Segment("dwell", 1.0), Segment("simple_harmonic", 0.5, 6.0), Segment("dwell", 9.0)))
    wheel = pendulum(gravity=None, loads=(TorqueOn("push", "rod", law, over=AngleBetween("rod")),))
    state = {"crank_angle": 0.0, "crank_speed": 2.0}
    run = kinfmu.simulate(wheel, drive="torque", start=0.0, stop=2.0, step=2.0, state=state, tolerance=1e-10)
    last = run["crank_angle"][-1]
    assert last > 1.5
    work = 0.5 * 6.0 * 0.5 + 6.0 * (last - 1.5)
    assert float(np.ptp(run["kinetic_energy"])) == pytest.approx(work, rel=5e-10)
