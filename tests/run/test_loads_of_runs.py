"""Forces of loads by closed forms: laws over time and over quantities, external loads, parameters, redundant bars."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu import Mechanism
from kinfmu.log import read, write_mcap
from kinfmu.mechanism.measures import Maximum, Peak
from kinfmu.mechanism.toml_file import parse
from tests.fmu.test_forces import press
from tests.mechanism.loads.every_load import LOADS, fourbar
from tests.mechanisms import reference_fourbar
from tests.run.test_forces import loaded

PENDULUM = """
name = "pendulum"
[units]
length = "LENGTH"
[parameters]
m = "2 kg"
[bodies.ground]
points = { O = [0, 0], way = [0, "-500 mm"] }
[bodies.arm]
points = { O = [0, 0], P = ["300 mm", 0] }
start = { x = 0, y = 0, phi = 0.4 }
mass = "m"
center_of_mass = ["200 mm", 0]
inertia = "0.05 kg m2"
[bodies.block]
points = { S = [0, 0] }
start = { x = "100 mm", y = "-500 mm", phi = 0 }
mass = "3*m"
[gravity]
x = 0
y = "-9.81 m/s2"
[joints.O]
type = "revolute"
between = ["ground.O", "arm.O"]
[joints.slide]
type = "translational"
between = ["ground.way", "block.S"]
[drivers.swing]
type = "angle"
of = "arm"
law = "constant_speed"
start = 0.4
speed = "0.7 rad/s"
[drivers.push]
type = "slide"
between = ["ground.way", "block.S"]
law = "polynomial"
coefficients = ["100 mm", "200 mm/s", "50 mm/s2"]
[loads.wind]
type = "force_along"
at = "arm.P"
angle = "90 deg"
axes = "arm"
law = "external"
[loads.brake]
type = "torque"
on = "arm"
law = "polynomial"
coefficients = ["3 N m", "-2 N m/s"]
[loads.cutting]
type = "force_along"
at = "block.S"
angle = "180 deg"
law = "constant_speed"
start = "4 N"
speed = "30 N/m"
over = { measure = "coordinate", of = "block.S", axis = "x" }
"""
G, ARM, INERTIA, REACH = 9.81, 0.2, 0.05, 0.3
T = np.linspace(0.0, 1.2, 13)


def run_of(length: str, **given: Any) -> kinfmu.Run:
    return kinfmu.compile(parse(PENDULUM.replace("LENGTH", length))).solve(T, **given)


@pytest.mark.parametrize("length", ["m", "mm"])
@pytest.mark.parametrize("mass", [2.0, 3.5])
def test_efforts_of_a_pendulum_and_a_block_follow_their_formulas(length: str, mass: float) -> None:
    """Torque in N m and force in N in any unit of length; masses by a parameter, one load by an input."""
    wind = 5.0 + T
    run = run_of(length, parameters={"m": mass}, wind_force=wind)
    phi = 0.4 + 0.7 * T
    torque = mass * G * ARM * np.cos(phi) - REACH * wind - (3.0 - 2.0 * T)
    np.testing.assert_allclose(run["swing.torque"], torque, rtol=0, atol=1e-13 * np.abs(torque).max())
    np.testing.assert_allclose(run["swing.reduced_inertia"], INERTIA + mass * ARM**2, rtol=1e-14)
    x = 0.1 + 0.2 * T + 0.05 * T**2
    force = 3.0 * mass * 0.1 + (4.0 + 30.0 * x)
    np.testing.assert_allclose(run["push.force"], force, rtol=1e-13)
    np.testing.assert_allclose(run["push.reduced_inertia"], 3.0 * mass, rtol=1e-14)
    np.testing.assert_allclose(run["swing.reduced_inertia.push"], 0.0, atol=1e-15)
    np.testing.assert_allclose(run["push.power"], force * (0.2 + 0.1 * T), rtol=1e-13)
    np.testing.assert_allclose(run["slide.force"], 3.0 * mass * G, rtol=1e-13)


@pytest.mark.parametrize("engine", ["python", "native"])
def test_external_loads_are_columns_of_the_run_in_records_and_measures(engine: str, tmp_path: Path) -> None:
    mechanism, t = press(), np.linspace(0.0, 1.0, 41)
    given = -200.0 * (1.0 + np.sin(9.0 * t))
    run = kinfmu.solve(mechanism, t, engine=engine, work_force=given)
    assert run.force_names[-1] == "work_force"
    np.testing.assert_array_equal(run["work_force"], given)
    assert next(column.unit for column in run.columns() if column.name == "work_force") == "N"
    write_mcap(run, tmp_path / "run.mcap", channels=["work_force"])
    np.testing.assert_array_equal(read(tmp_path / "run.mcap")["work_force"], given)
    (found,) = kinfmu.measure(run, [Peak("peak", of="work_force")]).values()
    assert found.value == pytest.approx(400.0, rel=1e-3)
    driven = kinfmu.simulate(kinfmu.build(mechanism, tmp_path / "press.fmu", flavour="python"),
                             inputs={"time": t, "work_force": given}, step=t[1])  # fmt: skip
    np.testing.assert_allclose(driven["work_force"], given, rtol=1e-12)


def test_an_external_load_that_is_not_given_is_zero() -> None:
    np.testing.assert_array_equal(run_of("m")["swing.torque"], run_of("m", wind_force=0.0)["swing.torque"])


MASS, CENTER, TURNING = 1.5, (0.3, 0.2), 0.07


def heavy() -> Mechanism:
    """The reference four-bar: its bars turn as the crank does, and its coupler does not turn."""
    mechanism = reference_fourbar()
    bodies = [
        body if body.is_ground else replace(body, mass=MASS, center_of_mass=CENTER, inertia=TURNING)
        for body in mechanism.bodies
    ]
    return replace(mechanism, bodies=tuple(bodies), gravity=(0.4, -9.81))


@pytest.mark.parametrize("engine", ["python", "native"])
def test_torque_of_the_reference_fourbar_is_exact_through_its_change_points(engine: str) -> None:
    """Closed form: crank and rocker have equal angles, the coupler moves on a circle; two places are bridged."""
    angles = np.radians(np.concatenate([np.arange(-30.0, 400.0, 5.0), [359.999, 360.0, 540.0]]))
    speed, acceleration = 1.3, -0.8
    run = kinfmu.solve(heavy(), engine=engine, crank_angle=angles, crank_speed=speed, crank_acceleration=acceleration)
    assert run.good.all()
    assert (run.status == 2).any()
    c, s = np.cos(angles), np.sin(angles)
    turning = 2 * (TURNING + MASS * (CENTER[0] ** 2 + CENTER[1] ** 2)) * acceleration
    turning += 2 * MASS * (9.81 * (c * CENTER[0] - s * CENTER[1]) + 0.4 * (s * CENTER[0] + c * CENTER[1]))
    coupler = MASS * (acceleration + 9.81 * c + 0.4 * s)  # on a circle of radius 1
    np.testing.assert_allclose(
        run["crank.torque"], turning + coupler, rtol=0, atol=1e-11 * np.abs(turning + coupler).max()
    )
    regular = run.status == 0
    np.testing.assert_allclose(
        run["crank.torque"][regular], (turning + coupler)[regular], rtol=0, atol=1e-12 * np.abs(turning + coupler).max()
    )


@pytest.mark.parametrize("count", [1, 90])  # one by one, and as arrays
def test_shaking_force_of_the_reference_fourbar_is_known_where_its_reactions_are_not(count: int) -> None:
    """Closed form from the momentum, through a change point and with the redundant bar."""
    angles = np.radians(np.linspace(180.0, 90.0, count))[:7][::-1]
    mechanism, speed, acceleration = heavy(), 1.3, -0.8
    run = kinfmu.solve(mechanism, crank_angle=angles, crank_speed=speed, crank_acceleration=acceleration)
    assert run.status[-1] == 2
    assert np.isnan(run["AB.force"]).all()
    turn = np.exp(1j * angles) * (1j * acceleration - speed**2)
    moving = ("crank", "coupler", "rocker")
    centers = {name: turn * complex(*CENTER) if name != "coupler" else turn * 1.0 for name in moving}
    at = {name: run[f"{name}.x"] + 1j * run[f"{name}.y"] + np.exp(1j * run[f"{name}.phi"]) * complex(*CENTER)
          for name in moving}  # fmt: skip
    pushed = {name: MASS * (complex(0.4, -9.81) - one) for name, one in centers.items()}
    force = sum(pushed.values())
    moment = sum((at[name].conj() * pushed[name]).imag for name in moving) - 2 * TURNING * acceleration
    np.testing.assert_allclose(run["shaking_force_x"] + 1j * run["shaking_force_y"], force, rtol=1e-11)
    np.testing.assert_allclose(run["shaking_moment"], moment, rtol=0, atol=1e-11 * np.abs(moment).max())


def test_reactions_that_share_a_load_with_the_redundant_bar_are_undetermined() -> None:
    run = kinfmu.solve(heavy(), crank_angle=np.radians([40.0, 75.0, 130.0]))
    determined = [name for name in run.reaction_names if not np.isnan(run[name]).any()]
    undetermined = [name for name in run.reaction_names if np.isnan(run[name]).all()]
    assert len(determined) + len(undetermined) == len(run.reaction_names)
    assert any(name.startswith("AB.") for name in undetermined)
    assert kinfmu.check(heavy()).redundant


def test_nothing_is_left_over_a_turn_at_constant_speed() -> None:
    """The work of a conservative system over a turn is 0; the rule for periodic functions converges with all digits."""
    mechanism = kinfmu.load("crank_rocker")
    metre = 0.001 if mechanism.length_unit == "mm" else 1.0
    bodies = [
        body
        if body.is_ground
        else replace(body, mass=1.0 + k, center_of_mass=(0.02 / metre, 0.01 / metre), inertia=0.003)
        for k, body in enumerate(mechanism.bodies)
    ]
    point = next(f"{body.name}.{name}" for body in reversed(bodies) for name in body.points)
    other = next(f"{body.name}.{name}" for body in bodies[1:2] for name in list(body.points)[-1:])
    spring = kinfmu.Spring("spring", (point, other), 150.0, 0.01 / metre)
    loads = (spring, kinfmu.TorsionSpring("torsion", ("ground", bodies[-1].name), 3.0))
    heavy_one = replace(mechanism, bodies=tuple(bodies), gravity=(0.3 / metre, -9.81 / metre), loads=loads)
    angles = 2.0 * math.pi * np.arange(256) / 256
    run = kinfmu.solve(heavy_one, crank_angle=angles, crank_speed=2.0, crank_acceleration=0.0)
    torque = run["crank.torque"]
    assert np.abs(torque).max() > 0.1
    assert abs(torque.mean()) < 1e-12 * np.abs(torque).max()


def test_the_shaking_force_is_computed_without_the_reactions() -> None:
    """Over bridges, limits and parts of a run, for a column and for a whole table."""
    mechanism = loaded("double_pendulum")
    run, again = (kinfmu.solve(mechanism, crank_angle=np.linspace(3.0, 7.0, 81), crank_speed=2.0) for _ in range(2))
    part = run.part(slice(10, 60))
    names = ("shaking_force_x", "shaking_force_y", "shaking_moment")
    alone = np.stack([run[name] for name in names], axis=1)
    assert callable(vars(run)["reactions"])
    assert again.reactions is not None
    assert np.isfinite(alone).any(axis=0).all()
    assert np.isnan(alone).any()
    assert callable(vars(again)["shaking"])
    np.testing.assert_allclose(alone, again.reactions[:, -3:], rtol=1e-13, atol=1e-12)
    np.testing.assert_array_equal(np.stack([part[name] for name in names], axis=1), alone[10:60])
    assert callable(vars(part)["reactions"])


ENDS = {  # of the loads of every kind: what they join
    "coil": ("ground.D", "coupler.M"),
    "slack": ("ground.D", "coupler.M"),
    "oil": ("ground.D", "coupler.M"),
    "strut": ("ground.E", "rocker.Q"),
}


@pytest.mark.parametrize("unit", ["mm", "m"])
@pytest.mark.parametrize("how", ["python", "native", "python FMU", "native FMU", "record"])
@pytest.mark.few(2)
def test_springs_and_dampers_have_columns_of_force_and_length(unit: str, how: str, tmp_path: Path) -> None:
    """Force positive where it pushes the points apart; length in the file's unit, angle in rad."""
    slack = '[loads.slack]\ntype = "spring"\nbetween = ["ground.D", "coupler.M"]\nstiffness = 30\nfree_length = 0\n'
    mechanism = fourbar(LOADS + slack, has_gravity=True)
    if unit == "m":
        mechanism = mechanism.in_metres()
    run = kinfmu.solve(mechanism, np.linspace(0.0, 1.0, 101), engine="native" if how == "native" else "python")
    if how.endswith("FMU"):
        flavour = how.partition(" ")[0]
        run = kinfmu.simulate(kinfmu.build(mechanism, tmp_path / "a.fmu", flavour=flavour), step=0.01, stop=1.0)
    elif how == "record":
        write_mcap(run, tmp_path / "run.mcap")
        run = read(tmp_path / "run.mcap")
    metre = 1e-3 if unit == "mm" else 1.0
    places = mechanism.body_points

    def at(name: str) -> tuple[np.ndarray, np.ndarray]:
        """World coordinates [m] of a point and its velocity."""
        body, (x, y) = name.partition(".")[0], places[name]
        if body == "ground":
            return metre * np.array([[x], [y]]), np.zeros((2, 1))
        phi, omega = run[f"{body}.phi"], run[f"{body}.omega"]
        arm = np.array([x * np.cos(phi) - y * np.sin(phi), x * np.sin(phi) + y * np.cos(phi)])
        spot = np.array([run[f"{body}.x"], run[f"{body}.y"]]) if f"{body}.x" in run.outputs else None
        rate = np.array([run[f"{body}.vx"], run[f"{body}.vy"]]) if spot is not None else np.zeros((2, 1))
        spot = np.array([[run.fixed[f"{body}.x"]], [run.fixed[f"{body}.y"]]]) if spot is None else spot
        return metre * (spot + arm), metre * (rate + omega * np.array([-arm[1], arm[0]]))

    for name, (first, second) in ENDS.items():
        (p, v), (q, w) = at(first), at(second)
        length = np.hypot(*(q - p))
        rate = ((q - p) * (w - v)).sum(axis=0) / length
        force = {
            "coil": -100.0 * (length - 0.05),
            "slack": -30.0 * length,
            "oil": -10.0 * rate,
            "strut": 100.0 + 50.0 / 0.25 * (0.4 - length),
        }[name]
        np.testing.assert_allclose(run[f"{name}.length"], length / metre, rtol=1e-12)
        np.testing.assert_allclose(run[f"{name}.force"], force, rtol=1e-10, atol=1e-12)
    turn, slip = run["crank.phi"], run["rocker.phi"] - run["coupler.phi"]
    np.testing.assert_allclose(run["clock.angle"], turn, rtol=1e-13)
    np.testing.assert_allclose(run["clock.torque"], -turn, rtol=1e-13)
    np.testing.assert_allclose(run["grease.angle"], slip, rtol=0, atol=1e-12)
    np.testing.assert_allclose(run["grease.torque"], run["coupler.omega"] - run["rocker.omega"], rtol=0, atol=1e-10)
    units = {column.name: column.unit for column in run.columns()}
    assert [units[name] for name in ("coil.force", "coil.length", "clock.torque", "clock.angle")] == [
        *("N", unit),
        *("N m", "rad"),
    ]
    (longest,) = kinfmu.measure(run, [Maximum("longest", of="coil.length")]).values()
    assert longest.value == pytest.approx(run["coil.length"].max(), rel=1e-3)
    assert longest.unit == unit


def test_a_spring_and_a_joint_of_one_name_are_refused() -> None:
    with pytest.raises(kinfmu.KinfmuError, match=r"\[loads.Q\]: a joint has this name already"):
        fourbar(LOADS.replace("loads.coil", "loads.Q"))
