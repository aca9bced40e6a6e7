"""Bearings of cams with a lift law carry the contact force: free bodies, and the same cams given by their curves.

Points and normals of the contact are those of the profile, which knows nothing of forces.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import kinfmu
from kinfmu import Mechanism
from kinfmu.arrays import FloatArray
from kinfmu.errors import RequestError
from kinfmu.mechanism.joints import Revolute, Translational
from kinfmu.mechanism.quantities.placement import body_of
from kinfmu.mechanism.toml_file import parse
from kinfmu.run import Run
from tests.analysis.test_lift_off import HEAD, JOINTS, SLIDING
from tests.motion.cams.followers import lifted_face, lifted_roller, swung_face, swung_roller

MASS, INERTIA = 0.7, 3.1e-4  # [kg], [kg m2]
CENTER, GRAVITY = (-20.0, -4.0), (3000.0, -9810.0)  # [mm], [mm/s2]
LED = {"roller": lambda: lifted_roller(8.0), "face": lifted_face, "lever": swung_roller, "lever with face": swung_face}


def heavy(mechanism: Mechanism, order: int, *, is_carried: bool) -> Mechanism:
    """Return cam and follower with masses; order: of the bodies of the bearings; is_carried: an arm holds them."""
    bodies = [
        body if body.is_ground else replace(body, mass=MASS, inertia=INERTIA, center_of_mass=CENTER)
        for body in mechanism.bodies
    ]
    joints, drivers = list(mechanism.joints), list(mechanism.drivers)
    for k in (0, 1):
        joint = joints[k]
        if order:
            joints[k] = (
                Translational(joint.name, joint.between[::-1], joint.axis)
                if isinstance(joint, Translational)
                else Revolute(joint.name, joint.between[::-1])  # type: ignore[attr-defined]
            )
    if is_carried:
        ground, *moving = bodies
        arm = replace(ground, name="arm")

        def on_arm(names: tuple[str, ...]) -> tuple[str, ...]:
            return tuple(name.replace("ground", "arm") for name in names)

        joints = [replace(joint, between=on_arm(joint.between)) for joint in joints]  # type: ignore[attr-defined, call-arg]
        bodies = [kinfmu.Body("ground", {"Z": (0, 0)}), arm, *moving]
        joints.append(Revolute("Z", ("ground.Z", "arm.O")))
        drivers = [
            kinfmu.AngleDriver("cam", "cam", kinfmu.ConstantSpeed(0.3, 8.0)),
            kinfmu.AngleDriver("arm", "arm", kinfmu.ConstantSpeed(0.4, 3.0)),
        ]
    return replace(
        mechanism,
        bodies=tuple(bodies),
        joints=tuple(joints),
        drivers=tuple(drivers),
        gravity=GRAVITY,
        coordinates="all",
    )


def turned(vector: FloatArray, phi: FloatArray) -> FloatArray:
    c, s = np.cos(phi), np.sin(phi)
    x, y = np.broadcast_to(vector, (len(phi), 2)).T
    return np.column_stack([c * x - s * y, s * x + c * y])


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


class FreeBody:
    """The forces on a body: their sum and moment about its centre of mass, in N and N mm."""

    def __init__(self, run: Run, name: str) -> None:
        self.run, self.name = run, name
        phi, omega, alpha = (run[f"{name}.{axis}"] for axis in ("phi", "omega", "alpha"))
        arm = turned(np.array(CENTER), phi)
        self.center = np.column_stack([run[f"{name}.x"], run[f"{name}.y"]]) + arm
        across = np.column_stack([-arm[:, 1], arm[:, 0]])
        a = (
            np.column_stack([run[f"{name}.ax"], run[f"{name}.ay"]])
            + alpha[:, None] * across
            - omega[:, None] ** 2 * arm
        )
        self.force = -MASS * (a - GRAVITY) * 1e-3
        self.moment = -INERTIA * alpha * 1e3

    def add(self, force: FloatArray, at: FloatArray, moment: FloatArray | float = 0.0) -> None:
        self.force = self.force + force
        self.moment = self.moment + cross(at - self.center, force) + moment

    def joint(self, joint: Revolute | Translational, mechanism: Mechanism) -> None:
        """Add the reaction of a bearing."""
        run, sense = self.run, 1.0 if body_of(joint.between[1]) == self.name else -1.0
        ends = [point(run, mechanism, name) for name in joint.between]
        if isinstance(joint, Revolute):
            force, moment = np.column_stack([run[f"{joint.name}.force_x"], run[f"{joint.name}.force_y"]]), 0.0
        else:
            side = turned(np.array([-math.sin(joint.axis), math.cos(joint.axis)]), angle(run, joint.between[0]))
            force, moment = run[f"{joint.name}.force"][:, None] * side, 1e3 * run[f"{joint.name}.moment"]
        self.add(sense * force, ends[1], sense * moment)


def angle(run: Run, point: str) -> FloatArray:
    body = body_of(point)
    return np.zeros(len(run)) if body == "ground" else run[f"{body}.phi"]


def point(run: Run, mechanism: Mechanism, name: str) -> FloatArray:
    body = body_of(name)
    arm = turned(np.array(mechanism.body_points[name]), angle(run, name))
    return arm if body == "ground" else arm + np.column_stack([run[f"{body}.x"], run[f"{body}.y"]])


@pytest.mark.parametrize(("order", "is_carried"), [(0, False), (1, True)])
@pytest.mark.parametrize("follower", LED)
@pytest.mark.few(2)
def test_cam_and_follower_are_in_balance_with_the_contact_force(follower: str, order: int, is_carried: bool) -> None:
    mechanism = heavy(LED[follower](), order, is_carried=is_carried)
    run = kinfmu.solve(mechanism, np.linspace(0.0, 0.9, 29))
    axle, guide, lift = mechanism.joints[:3]
    profile = kinfmu.cam_profile(mechanism, "lift", (run["cam.phi"] - angle(run, axle.between[order])) % math.tau)
    along = turned(profile.face, run["cam.phi"])
    normal = np.column_stack([along[:, 1], -along[:, 0]])
    touching = turned(profile.profile, run["cam.phi"]) + np.column_stack([run["cam.x"], run["cam.y"]])
    if isinstance(guide, Translational):
        axis = turned(np.array([0.0, 1.0]), angle(run, lift.between[0]))
        size = run["lift.force"] / (normal * axis).sum(axis=1)
    else:
        pivot = point(run, mechanism, guide.between[0])
        size = 1e3 * run["lift.moment"] / cross(touching - pivot, normal)
    contact = size[:, None] * normal
    led, cam = FreeBody(run, "follower"), FreeBody(run, "cam")
    led.joint(guide, mechanism)
    led.add(contact, touching)
    cam.joint(axle, mechanism)
    cam.add(-contact, touching, 1e3 * run["cam.torque"])
    largest = np.abs(contact).max()
    assert largest > 2.0
    for body in (led, cam):
        np.testing.assert_allclose(body.force, 0.0, atol=1e-11 * largest)
        np.testing.assert_allclose(body.moment, 0.0, atol=1e-9 * largest)


@pytest.mark.parametrize(("led", "given"), [("up", "roller"), ("face", "flat")])
@pytest.mark.parametrize("count", [29, 401])
@pytest.mark.few(2)
def test_reactions_are_those_of_the_same_cam_given_by_its_curve(led: str, given: str, count: int) -> None:
    """401 samples are solved by the native engine, 29 in Python."""
    theta = np.linspace(0.1, math.tau, count)
    one, other = (
        kinfmu.solve(
            parse(HEAD + JOINTS[name] + SLIDING),
            engine="native" if count > 100 else "python",
            cam_angle=theta,
            cam_speed=60.0,
        )
        for name in (led, given)
    )
    assert np.abs(one["O.force_y"]).max() > 40.0
    side = "guide.force" if led == "up" else "guide.moment"  # of a flat face the contact wanders
    assert np.abs(one[side]).max() > 0.1
    for name in one.reaction_names:
        if led == "up" and name == "lift.force":
            continue  # along the lift; that of the curve is along the radius, here the same
        scale = np.abs(other["O.force_y"]).max()
        np.testing.assert_allclose(one[name], other[name], rtol=0, atol=1e-12 * scale, err_msg=name)


def test_reactions_that_are_constants_are_those_of_every_sample() -> None:
    """A lever with its centre of mass in its pivot."""
    lever = swung_roller()
    bodies = tuple(replace(body, mass=2.0) if body.name == "follower" else body for body in lever.bodies)
    run = kinfmu.solve(replace(lever, bodies=bodies, gravity=(0.0, -9810.0)), np.linspace(0.0, 0.9, 5))
    np.testing.assert_allclose(run["C.force_y"], 19.62, rtol=1e-15)
    np.testing.assert_array_equal(run["lift.moment"], 0.0)


def test_bearings_have_no_value_where_the_contact_is_unknown() -> None:
    text = (HEAD + JOINTS["up"] + SLIDING).replace("roller_radius = 0.01", "")
    mechanism = parse(text)
    run = kinfmu.solve(mechanism)
    hidden = ("O.force_x", "O.force_y", "guide.force", "guide.moment")
    assert [name for name in run.reaction_names if np.isnan(run[name]).all()] == list(hidden)
    rest = [*run.force_names, "lift.force", "shaking_force_x", "shaking_force_y", "shaking_moment"]
    assert all(np.isfinite(run[name]).all() for name in rest)
    report = kinfmu.check(mechanism)
    line = "lift: contact force unknown, the key 'roller_radius' or 'normal' is missing; without a value: O.force_x, "
    assert f"{line}O.force_y, guide.force, guide.moment" in str(report)
    assert report.loading is not None
    (contact,) = report.as_json()["forces"]["unknown_contacts"]
    assert contact["reactions"] == list(hidden)
    words = (
        r"outputs: 'guide.force' is undetermined: \[joints.lift\] gives no contact force: the key 'roller_radius' or"
    )
    with pytest.raises(RequestError, match=words):
        kinfmu.build(mechanism, "no.fmu", outputs=["guide.force"], flavour="python")
