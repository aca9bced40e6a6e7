"""Efforts, inertias, energies and reactions against free-body diagrams and virtual work in 50 digits."""

from __future__ import annotations

import copy
import gc
import weakref
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import kinfmu
from benchmarks.forces import with_masses
from kinfmu import Body, Mechanism, Run
from kinfmu.mechanism import gallery, toml_file
from kinfmu.mechanism.joints import Distance, Fixed, PointOnLine, Revolute, Translational
from kinfmu.mechanism.measures import Peak
from kinfmu.units import METRES
from tests.gallery_members import every_member
from tests.mechanism.gallery.references import REFERENCES
from tests.power_series import Series, mp, sin_cos

GRAVITY = (0.6, -9.81)  # [m/s2], tilted so that both components count
FREE_BODIES = (Revolute, Translational, Fixed, Distance, PointOnLine)  # joints whose free-body diagram is below


@cache
def loaded(name: str) -> Mechanism:
    """A mechanism of the gallery whose bodies have masses away from their origins, without its own loads."""
    mechanism = gallery.load(name)
    metre = METRES[mechanism.length_unit]
    size = max(abs(value) for body in mechanism.bodies for point in body.points.values() for value in point)
    bodies = [
        body
        if body.is_ground
        else Body(
            body.name,
            body.points,
            body.start,
            mass=1.0 + 0.37 * k,
            center_of_mass=(size * (0.3 + 0.01 * k), size * (0.11 - 0.02 * k)),
            inertia=(0.4 + 0.1 * k) * (size * metre) ** 2,
        )
        for k, body in enumerate(mechanism.bodies)
    ]
    return replace(mechanism, bodies=tuple(bodies), gravity=(GRAVITY[0] / metre, GRAVITY[1] / metre), loads=())


def some_samples(run: Run, count: int = 7) -> list[int]:
    good = np.flatnonzero(run.good)
    return sorted({int(good[k]) for k in np.linspace(0, len(good) - 1, count + 2).round().astype(int)[1:-1]})


def efforts_in_50_digits(name: str, mechanism: Mechanism, run: Run, t: float) -> list[Any]:
    """Virtual work with coordinates, accelerations and velocity coefficients from the closed forms."""
    reference, metre = REFERENCES[name], mp.mpf(repr(METRES[mechanism.length_unit]))
    inputs = reference.inputs(t)
    motion = reference.motion(t)
    along = []  # coordinates over each driver alone
    for driven in inputs:
        alone = [Series([one.c[0], int(key == driven), 0]) for key, one in inputs.items()]
        along.append(reference.coordinates(*alone))

    def series(coordinates: dict[str, Any], coordinate: str) -> Series:
        value = coordinates.get(coordinate, run.fixed.get(coordinate))
        return value if isinstance(value, Series) else Series([value, 0, 0])

    efforts = [mp.mpf(0) for _ in inputs]
    for body in mechanism.moving_bodies:

        def center(coordinates: dict[str, Any], body: Any = body) -> tuple[Series, Series, Series]:
            x, y, phi = (series(coordinates, f"{body.name}.{axis}") for axis in ("x", "y", "phi"))
            s, c = sin_cos(phi)
            s_x, s_y = (mp.mpf(value) for value in body.center_of_mass)
            return (x + c * s_x - s * s_y) * metre, (y + s * s_x + c * s_y) * metre, phi

        x, y, phi = center(motion)
        for k, (driver, coordinates) in enumerate(zip(mechanism.drivers, along, strict=True)):
            per = 1 if driver.quantity.kind == "angle" else metre
            k_x, k_y, k_phi = (one.c[1] / per for one in center(coordinates))
            efforts[k] += mp.mpf(body.mass) * ((2 * x.c[2] - mp.mpf(GRAVITY[0])) * k_x)
            efforts[k] += mp.mpf(body.mass) * ((2 * y.c[2] - mp.mpf(GRAVITY[1])) * k_y)
            efforts[k] += mp.mpf(body.inertia) * 2 * phi.c[2] * k_phi
    return efforts


@pytest.mark.parametrize("at", ["some samples", pytest.param("every sample", marks=pytest.mark.long)])
@every_member
@pytest.mark.few(2)
def test_efforts_equal_virtual_work_in_50_digits(name: str, at: str) -> None:
    mechanism = loaded(name)
    run = kinfmu.solve(mechanism)
    columns = [f"{d.name}.{'torque' if d.quantity.kind == 'angle' else 'force'}" for d in mechanism.drivers]
    reference = REFERENCES[name]
    samples = some_samples(run) if at == "some samples" else np.flatnonzero(run.good).tolist()
    inside = [k for k in samples if reference.first <= k < len(run) - reference.first]
    assert inside
    for k in inside:
        for column, exact in zip(columns, efforts_in_50_digits(name, mechanism, run, float(run.t[k])), strict=True):
            assert run[column][k] == pytest.approx(float(exact), rel=0, abs=1e-12 * np.nanmax(np.abs(run[column])))


@every_member
def test_power_is_the_rate_of_energy(name: str) -> None:
    """sum m (a - g).v + sum I alpha omega, from the columns of the run."""
    mechanism = loaded(name)
    run, metre = kinfmu.solve(mechanism), METRES[mechanism.length_unit]
    rate = np.zeros(len(run))
    for body in mechanism.moving_bodies:
        velocity, acceleration = center_rates(run, body, metre)
        rate += body.mass * ((acceleration - np.array(GRAVITY)) * velocity).sum(axis=1)
        rate += body.inertia * run[f"{body.name}.omega"] * run[f"{body.name}.alpha"]
    power = sum(run[f"{driver.name}.power"] for driver in mechanism.drivers)
    usual = max(np.nanmax(np.abs(run[f"{driver.name}.power"])) for driver in mechanism.drivers) + np.nanmax(
        np.abs(rate)
    )
    np.testing.assert_allclose(power[run.good], rate[run.good], rtol=0, atol=1e-11 * usual)


def center_rates(run: Run, body: Any, metre: float) -> tuple[Any, Any]:
    """Velocity and acceleration of the centre of mass, (n, 2) in m."""
    phi, omega, alpha = (run[f"{body.name}.{axis}"] for axis in ("phi", "omega", "alpha"))
    s_x, s_y = body.center_of_mass
    arm = np.stack([np.cos(phi) * s_x - np.sin(phi) * s_y, np.sin(phi) * s_x + np.cos(phi) * s_y], axis=1)
    left = np.stack([-arm[:, 1], arm[:, 0]], axis=1)
    velocity = np.stack([run[f"{body.name}.vx"], run[f"{body.name}.vy"]], axis=1) + omega[:, None] * left
    acceleration = np.stack([run[f"{body.name}.ax"], run[f"{body.name}.ay"]], axis=1) + alpha[:, None] * left
    return velocity * metre, (acceleration - (omega**2)[:, None] * arm) * metre


def place(run: Run, mechanism: Mechanism, point: str) -> Any:
    """World place of a point, (n, 2)."""
    name, _, own = point.partition(".")
    s_x, s_y = next(body for body in mechanism.bodies if body.name == name).points[own]
    if name == "ground":
        return np.tile([s_x, s_y], (len(run), 1))
    phi = run[f"{name}.phi"]
    x = run[f"{name}.x"] + np.cos(phi) * s_x - np.sin(phi) * s_y
    return np.stack([x, run[f"{name}.y"] + np.sin(phi) * s_x + np.cos(phi) * s_y], axis=1)


def exerted(run: Run, mechanism: Mechanism, joint: Any) -> tuple[str, str, Any, Any, Any]:
    """First and second body, force on the second (n, 2), the place where it acts, and the moment besides (n,)."""
    a, b = (place(run, mechanism, point) for point in joint.between)
    first, second = (point.partition(".")[0] for point in joint.between)
    none, at = np.zeros(len(run)), b
    if isinstance(joint, Revolute | Fixed):
        force = np.stack([run[f"{joint.name}.force_x"], run[f"{joint.name}.force_y"]], axis=1)
        return first, second, force, at, run[f"{joint.name}.moment"] if isinstance(joint, Fixed) else none
    if isinstance(joint, Distance):
        along = (b - a) / np.linalg.norm(b - a, axis=1)[:, None]
        return first, second, run[f"{joint.name}.force"][:, None] * along, at, none
    turn = joint.axis + (0.0 if first == "ground" else run[f"{first}.phi"])
    normal = np.stack([-np.sin(turn) + none, np.cos(turn) + none], axis=1)
    moment = run[f"{joint.name}.moment"] if isinstance(joint, Translational) else none
    return first, second, run[f"{joint.name}.force"][:, None] * normal, at, moment


def is_free_body_diagram_known(name: str) -> bool:
    mechanism = gallery.load(name)
    is_redundant = bool(kinfmu.check(mechanism).redundant)
    crank_like = all(driver.type == "angle" for driver in mechanism.drivers)
    return crank_like and not is_redundant and all(isinstance(joint, FREE_BODIES) for joint in mechanism.joints)


@every_member
@pytest.mark.few(2)
def test_reactions_and_torques_balance_every_body(name: str) -> None:
    """Newton and Euler about the centre of mass of each body, at every sample."""
    if not is_free_body_diagram_known(name):
        pytest.skip("another kind of joint or driver, or redundant rows")
    mechanism = loaded(name)
    run, metre = kinfmu.solve(mechanism), METRES[mechanism.length_unit]
    force = {body.name: np.zeros((len(run), 2)) for body in mechanism.bodies}
    moment = {body.name: np.zeros(len(run)) for body in mechanism.bodies}  # about the centre of mass
    centers = {body.name: np.zeros((len(run), 2)) for body in mechanism.bodies}
    for body in mechanism.moving_bodies:
        phi, (s_x, s_y) = run[f"{body.name}.phi"], body.center_of_mass
        centers[body.name] = np.stack(
            [
                run[f"{body.name}.x"] + np.cos(phi) * s_x - np.sin(phi) * s_y,
                run[f"{body.name}.y"] + np.sin(phi) * s_x + np.cos(phi) * s_y,
            ],
            axis=1,
        )
    for joint in mechanism.joints:
        first, second, on_second, at, besides = exerted(run, mechanism, joint)
        for body, sign in ((first, -1.0), (second, 1.0)):
            arm = (at - centers[body]) * metre
            force[body] += sign * on_second
            moment[body] += sign * (arm[:, 0] * on_second[:, 1] - arm[:, 1] * on_second[:, 0] + besides)
    for driver in mechanism.drivers:
        for body, sign in ((driver.of, 1.0), ("ground", -1.0)):
            moment[body] += sign * run[f"{driver.name}.torque"]
    largest = max(np.nanmax(np.abs(run.reactions)), 1e-300)
    for body in mechanism.moving_bodies:
        _, acceleration = center_rates(run, body, metre)
        np.testing.assert_allclose(
            force[body.name][run.good],
            body.mass * (acceleration - np.array(GRAVITY))[run.good],
            rtol=0,
            atol=1e-12 * largest,
        )
        euler = body.inertia * run[f"{body.name}.alpha"]
        np.testing.assert_allclose(
            moment[body.name][run.good], euler[run.good], rtol=0, atol=1e-12 * largest + 1e-12 * np.abs(euler).max()
        )
    shaking = np.stack([run[f"shaking_{name}"] for name in ("force_x", "force_y", "moment")], axis=1)[run.good]
    on_ground = np.column_stack([force["ground"], moment["ground"]])[run.good]
    np.testing.assert_allclose(shaking, on_ground, rtol=0, atol=1e-12 * max(largest, np.abs(on_ground).max()))


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.parametrize("name", ["fourbar", "slider_crank", "jansen_leg", "double_pendulum"])
@pytest.mark.few(2)
def test_forces_of_a_driver_that_moves_are_those_of_one_that_rests_somewhere(name: str, engine: str) -> None:
    """Coefficients from rates, or solved where a speed is 0; bridges and limits are on the way."""
    model = kinfmu.compile(loaded(name), engine=engine)  # type: ignore[arg-type]
    (driver,) = model.plan.drivers
    value, speed, acceleration = driver.inputs
    inputs: dict[str, Any] = {value: np.linspace(0.1, 7.0, 200), acceleration: np.linspace(-3.0, 2.0, 200)}
    speeds = np.where(np.arange(200) == 0, 0.0, -0.7)
    moving, resting = model.solve(**inputs, **{speed: -0.7}), model.solve(**inputs, **{speed: speeds})
    assert moving.forces is not None
    assert resting.forces is not None
    np.testing.assert_array_equal(np.isnan(moving.forces), np.broadcast_to(~moving.good[:, None], moving.forces.shape))
    regular = moving.good & (moving.margin > 0.05)
    regular[0] = False
    assert regular.sum() > 20
    largest = np.abs(moving.forces[regular]).max(axis=0)
    np.testing.assert_allclose(moving.forces[regular] / largest, resting.forces[regular] / largest, rtol=0, atol=1e-13)


def test_a_run_with_forces_is_freed_when_it_is_no_longer_used() -> None:
    """Its tables are large: they must not wait for the collector of cycles."""
    model = kinfmu.compile(loaded("crank_rocker"), engine="python")
    gc.disable()
    try:
        for read in ("status", "forces", "reactions"):
            run = model.solve(crank_angle=np.linspace(0.0, 1.0, 5))
            getattr(run, read)
            gone = weakref.ref(run)
            del run
            assert gone() is None
    finally:
        gc.enable()


def test_what_presses_from_outside_reaches_the_ground_and_what_is_held_by_it_does_not() -> None:
    """An arm without mass far from the origin: a weight at its tip, a brake on the ground, a spring to the ground."""
    text = """
    name = "arm"
    [bodies.ground]
    points = { O = [2, 3], S = [2, 9] }
    [bodies.arm]
    points = { O = [0, 0], T = [0.5, 0] }
    start = { x = 2, y = 3 }
    [joints]
    O = { type = "revolute", between = ["ground.O", "arm.O"] }
    [drivers]
    arm = { type = "angle", of = "arm", law = "constant_speed", start = "30 deg", speed = 2 }
    [loads]
    weight = { type = "force", at = "arm.T", y = "-20 N" }
    brake = { type = "torque", on = "arm", law = "constant", level = "-7 N m" }
    spring = { type = "spring", between = ["ground.S", "arm.T"], stiffness = 30, free_length = 1 }
    """
    run = kinfmu.solve(toml_file.parse(text, "arm"), np.linspace(0.0, 3.0, 9))
    np.testing.assert_allclose(run["shaking_force_x"], 0.0, atol=1e-13)
    np.testing.assert_allclose(run["shaking_force_y"], -20.0, rtol=1e-14)
    np.testing.assert_allclose(run["shaking_moment"], -20.0 * (2.0 + 0.5 * np.cos(run["arm.phi"])), rtol=1e-13)
    assert np.ptp(run["arm.torque"]) > 10.0
    high = kinfmu.measure(run, [Peak("shaking", of="shaking_force"), Peak("tilting", of="shaking_moment")])
    assert [(value.value, value.unit) for value in high.values()] == [
        (pytest.approx(20.0), "N"),
        (pytest.approx(50.0, rel=1e-2), "N m"),
    ]


@pytest.mark.parametrize("count", [1, 130])  # of samples; whole blocks and a rest
def test_native_forces_of_repeated_numbers_equal_those_of_arrays(count: int) -> None:
    mechanism = with_masses(kinfmu.load("fourbar"))
    model = kinfmu.compile(mechanism, engine="native")
    angles = np.linspace(0.1, 6.0, count)
    single = model.solve(crank_angle=angles, crank_speed=2.0, crank_acceleration=0.5)
    whole = {"crank_speed": np.full(count, 2.0), "crank_acceleration": np.full(count, 0.5)}
    arrays = model.solve(crank_angle=angles, **whole)
    again = kinfmu.compile(mechanism, engine="python").solve(crank_angle=angles, **whole)
    assert single.forces.tobytes() == arrays.forces.tobytes()
    assert np.allclose(single.forces, again.forces, rtol=1e-12, atol=1e-12)
    assert np.allclose(single.reactions, again.reactions, rtol=1e-9, atol=1e-9, equal_nan=True)


MET = """
name = "met"
units.length = "mm"
gravity = { x = 0, y = "-9.81 m/s2" }
bodies.ground.points = { O = [0, 0], Z = [80, 0] }
bodies.crank.points = { O = [0, 0], P = [40, 0] }
bodies.rod = { mass = "1 kg", rod = ["P", "S"], points = { P = [0, 0], S = [120, 0] }, start = { x = 40 } }
bodies.slide = { mass = "2 kg", points = { S = [0, 0] }, start = { x = 160 } }
joints.O = { type = "revolute", between = ["ground.O", "crank.O"] }
joints.P = { type = "revolute", between = ["crank.P", "rod.P"] }
joints.S = { type = "revolute", between = ["rod.S", "slide.S"] }
joints.guide = { type = "translational", between = ["ground.O", "slide.S"] }
drivers.crank = { type = "angle", of = "crank", law = "constant_speed", speed = "60 rpm" }
loads.return = { type = "spring", between = ["ground.Z", "slide.S"], stiffness = "1 N/mm", free_length = 0 }
"""  # after half a second the slide is on Z
MEETING = [
    'type = "spring", stiffness = "1 N/mm", free_length = "10 mm"',
    'type = "spring", stiffness = "1 N/mm", free_length = 0, preload = "5 N"',
    'type = "spring", stiffness = "1 N/mm", free_length = "rest"',
    'type = "gas_spring", extended_length = 99, stroke = 99, extended_force = 3, compressed_force = 4',
    'type = "damper", damping = 3',
    'type = "force_between", law = "constant", level = 3',
]


def met(load: str) -> Mechanism:
    """The slider-crank with another load, whose ends meet after half a second."""
    first, _, _ = MET.partition("loads.return")
    start = "parameters = { rest = 0 }\n" if '"rest"' in load else ""
    return toml_file.parse(f'{start}{first}loads.return = {{ between = ["ground.Z", "slide.S"], {load} }}')


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.parametrize("count", [3, 41])
@pytest.mark.few(2)
def test_a_spring_without_free_length_acts_where_its_ends_meet(engine: str, count: int) -> None:
    """At the inner dead centre the slide does not move: the torque carries half of the rod's weight at P."""
    model = kinfmu.compile(toml_file.parse(MET), engine=engine)
    t = np.linspace(0.4, 0.6, count)
    run = model.solve(t)
    assert (run["slide.x"][count // 2] - 80.0) == pytest.approx(0.0, abs=1e-12)
    assert run["crank.torque"][count // 2] == pytest.approx(-0.5 * 9.81 * 0.04, rel=1e-9)
    assert run["potential_energy"][count // 2] == pytest.approx(0.0, abs=1e-15)
    assert np.isfinite(run.forces).all()
    assert np.isfinite(run.reactions).all()
    near = model.solve(t=[0.5 - 1e-6, 0.5 + 1e-6])  # 6e-6 rad away
    assert near["crank.torque"].mean() == pytest.approx(run["crank.torque"][count // 2], abs=1e-10)


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.parametrize("count", [3, 41])
@pytest.mark.parametrize("load", MEETING)
@pytest.mark.few(1)
def test_a_load_whose_ends_meet_has_no_direction_which_a_warning_says(load: str, count: int, engine: str) -> None:
    """What does not depend on it keeps its value: energies and the shaking force."""
    mechanism = met(load)
    run = kinfmu.compile(mechanism, engine=engine).solve(np.linspace(0.4, 0.6, count))
    nothing = np.arange(count) == count // 2
    np.testing.assert_array_equal(np.isnan(run["crank.torque"]), nothing)
    np.testing.assert_array_equal(np.isnan(run["S.force_x"]), nothing)
    for name in ("potential_energy", "kinetic_energy", "crank.reduced_inertia", "shaking_force_x"):
        assert np.isfinite(run[name]).all(), name
    kind = load.partition('"')[2].partition('"')[0].replace("_", " ")
    text = f"forces have no value: the ends of {kind} 'return' are in the same place, so that it has no direction"
    assert [(event.level, event.text) for event in run.events] == [("warning", text)]
    assert run.events[0].t == pytest.approx(0.5, abs=1e-12)
    assert not kinfmu.solve(mechanism, [0.4, 0.6], engine=engine).events
    chosen = kinfmu.compile(mechanism, ["crank.phi"], engine=engine).solve([0.5])
    assert [event.text for event in chosen.events] == [text]


def test_events_of_meeting_ends_follow_parts_and_copies() -> None:
    run = kinfmu.solve(met(MEETING[0]), [0.4, 0.5, 0.6])
    assert len(copy.copy(run).events) == 1
    assert len(run.replaced(axis="time").events) == 1
    assert run.part(slice(0, 2)).events == ()
