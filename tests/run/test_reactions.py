"""Reactions of cams and of redundant joints, and sizes of forces."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu import Mechanism, Run
from kinfmu.arrays import FloatArray
from kinfmu.draw.plots import stacks_of
from kinfmu.errors import KinfmuError, RequestError
from kinfmu.log import read, write_mcap
from kinfmu.log.record import description
from kinfmu.log.table import columns_of, write_table
from kinfmu.mechanism.joints import Revolute, Translational
from kinfmu.mechanism.quantities.placement import body_of
from kinfmu.mechanism.toml_file import parse
from kinfmu.plan import compile_plan
from kinfmu.plan.undetermined import undetermined_reactions
from kinfmu.run.channels import select
from kinfmu.run.tables import csv_lines
from tests.analysis.test_lift_off import HEAD, JOINTS, SLIDING
from tests.mechanisms import wheels
from tests.motion.cams.followers import lifted_face, lifted_roller, swung_face, swung_roller
from tests.reports import unwrapped
from tests.run.test_forces import loaded

QUARTER = math.pi / 2
LOCOMOTIVE = {"A": (0, 1, 0.0), "B": (0, 1, QUARTER)}
ROW = {f"{name}{k}": (k, k + 1, turn + 0.035 * k) for k in range(3) for name, turn in (("A", 0.0), ("B", QUARTER))}
MASS, CENTER, GRAVITY = 1.7, (0.3, 0.11), (0.6, -9.81)
SPEED, ACCELERATION = 2.0, -3.0
RADIUS, LENGTH = 0.5, 2.0  # of the pins of the wheels; of the rods


def coupled(rods: dict[str, tuple[int, int, float]]) -> Mechanism:
    mechanism = wheels(rods)
    bodies = [
        body if body.is_ground else replace(body, mass=MASS, center_of_mass=CENTER, inertia=0.2)
        for body in mechanism.bodies
    ]
    return replace(mechanism, bodies=tuple(bodies), gravity=GRAVITY)


@pytest.mark.parametrize("rods", [LOCOMOTIVE, ROW])
@pytest.mark.parametrize(("engine", "count"), [("python", 3), ("python", 29), ("native", 401)])
@pytest.mark.few(2)
def test_determined_reactions_of_coupled_wheels_are_exact(
    rods: dict[str, tuple[int, int, float]], engine: str, count: int
) -> None:
    """Closed form: rods move on circles without turning, so Newton and Euler give the forces across them.

    Along the rods, any tension of a pair may be added.
    """
    mechanism = coupled(rods)
    angles = np.linspace(0.0, 2.0 * np.pi, count)  # with the dead centres of both rods
    run = kinfmu.solve(mechanism, engine=engine, crank_angle=angles, crank_speed=SPEED, crank_acceleration=ACCELERATION)
    assert (run.status == 0).all()
    undetermined = undetermined_reactions(compile_plan(mechanism))
    for name, (_, _, turn) in rods.items():
        c, s = RADIUS * np.cos(angles + turn), RADIUS * np.sin(angles + turn)
        x = MASS * (-s * ACCELERATION - c * SPEED**2 - GRAVITY[0])
        y = MASS * (c * ACCELERATION - s * SPEED**2 - GRAVITY[1])
        last = (CENTER[0] * y - CENTER[1] * x) / LENGTH
        for pin, exact in ((f"P{name}", y - last), (f"Q{name}", last)):
            np.testing.assert_allclose(run[f"{pin}.force_y"], exact, rtol=0, atol=1e-12 * np.abs(y).max())
            assert f"{pin}.force_x" in undetermined
            assert np.isnan(run[f"{pin}.force_x"]).all()
    count_of_masses = len(mechanism.moving_bodies)
    weight_and_thrust = sum(run[f"O{k}.force_y"] for k in range(max(last for _, last, _ in rods.values()) + 1))
    centers = np.zeros(len(angles))  # sum of the vertical accelerations of the centres of mass
    for body in mechanism.moving_bodies:
        phi, omega, alpha = (run[f"{body.name}.{axis}"] for axis in ("phi", "omega", "alpha"))
        arm = (
            np.cos(phi) * CENTER[0] - np.sin(phi) * CENTER[1],
            np.sin(phi) * CENTER[0] + np.cos(phi) * CENTER[1],
        )
        centers += run[f"{body.name}.ay"] + alpha * arm[0] - omega**2 * arm[1]
    whole = MASS * (centers - count_of_masses * GRAVITY[1])
    np.testing.assert_allclose(weight_and_thrust, whole, rtol=0, atol=1e-12 * np.abs(whole).max())


# ---------------------------------------------------------------------------------------------------------- force sizes


SIZES = ("O.force", "P.force", "S.force", "shaking_force")


@pytest.fixture(scope="module")
def run() -> Run:
    return kinfmu.solve(loaded("slider_crank"), np.linspace(0.0, 0.5, 21))


def header(run: Run, *columns: str) -> list[str]:
    """The names in the first line of a CSV table, without those that are always there."""
    (names,) = csv.reader([next(csv_lines(columns_of(run, columns)))])
    return [name for name in names if name not in ("time", "solver.status")]


@pytest.mark.parametrize("name", SIZES)
def test_a_size_is_a_column_after_its_components(run: Run, name: str) -> None:
    x, y = run[f"{name}_x"], run[f"{name}_y"]
    assert np.ptp(y) > 0.0
    np.testing.assert_allclose(run[name], np.sqrt(x**2 + y**2), rtol=1e-14)
    columns = list(run.columns())
    names = [column.name for column in columns]
    place = names.index(name)
    assert names[place - 2 : place] == [f"{name}_x", f"{name}_y"]
    assert columns[place].unit == run.column_units()[name] == "N"
    np.testing.assert_array_equal(run.to_pandas()[name], run[name])


def test_only_forces_with_two_components_have_a_size(run: Run) -> None:
    assert tuple(run.force_sizes) == SIZES
    assert [column.name for column in run.columns()].count("bore.force") == 1
    assert not kinfmu.solve(kinfmu.load("fourbar"), [0.0]).force_sizes
    with pytest.raises(KinfmuError, match=r"no column 'O\.forces'; did you mean 'O\.force'\?"):
        run["O.forces"]


def test_a_size_is_computed_when_it_is_read() -> None:
    run = kinfmu.solve(loaded("slider_crank"), np.linspace(0.0, 0.5, 21))
    assert run["shaking_force"].any()
    assert callable(run.__dict__["reactions"])  # the shaking force needs none of the others


def test_tables_hold_the_sizes_that_are_chosen(run: Run, tmp_path: Path) -> None:
    assert header(run, "O.force") == ["O.force"]
    assert header(run, "O.*") == ["O.force_x", "O.force_y", "O.force"]
    assert header(run, "O.force_y", "shaking_force") == ["O.force_y", "shaking_force"]
    assert header(run, "reactions", "-O.force*", "-[PS]*", "-bore*") == [
        "shaking_force_x",
        "shaking_force_y",
        "shaking_force",
        "shaking_moment",
    ]
    assert set(SIZES) <= set(header(run, "all"))
    write_table(run, tmp_path / "run.npz", ["O.force"])
    with np.load(tmp_path / "run.npz") as file:
        assert file["kinfmu.columns"].tolist() == ["time", "O.force", "solver.status"]
        np.testing.assert_array_equal(file["O.force"], run["O.force"])


def test_a_parquet_file_describes_the_columns_that_it_holds(run: Run, tmp_path: Path) -> None:
    pq = pytest.importorskip("pyarrow.parquet")
    write_table(run, tmp_path / "run.parquet", ["O.force"])
    table = pq.read_table(tmp_path / "run.parquet")
    assert table.column_names == json.loads(table.schema.metadata[b"kinfmu.columns"])
    assert table.column_names == ["time", "O.force", "solver.status"]
    assert table.schema.field("O.force").metadata[b"unit"] == b"N"


def test_a_record_keeps_the_components_alone(run: Run, tmp_path: Path) -> None:
    assert not set(SIZES) & set(json.loads(description(run)["columns"]))
    write_mcap(run, tmp_path / "all.mcap")
    np.testing.assert_array_equal(read(tmp_path / "all.mcap")["O.force"], run["O.force"])
    write_mcap(run, tmp_path / "one.mcap", channels=["O.force"])
    kept = read(tmp_path / "one.mcap")
    np.testing.assert_array_equal(kept["O.force"], run["O.force"])
    names = [column.name for column in kept.columns()]
    assert names == ["time", "O.force_x", "O.force_y", "O.force", "solver.status"]
    with pytest.raises(KinfmuError, match=r"the run does not hold 'shaking_force_x'"):
        kept["shaking_force"]


def test_a_size_goes_with_its_components(run: Run) -> None:
    left = select(run, ["reactions", "-O.force_x"])
    assert {"O.force_x", "O.force"} <= left.absent
    assert not {"O.force_y", "P.force", "P.force_x"} & left.absent
    assert "P.force" in run.without(["P.force_y"]).absent


def test_an_fmu_gives_its_run_the_sizes(run: Run, tmp_path: Path) -> None:
    kinfmu.build(loaded("slider_crank"), tmp_path / "crank.fmu", flavour="python")
    stepped = kinfmu.simulate(tmp_path / "crank.fmu", stop=0.5, step=0.025, channels=["O.force"])
    np.testing.assert_allclose(stepped["O.force"], run["O.force"], rtol=1e-9)


def test_plots_show_sizes(run: Run) -> None:
    (stack,) = stacks_of(run, ["O.force"])
    assert [(panel.column, panel.label, panel.unit) for panel in stack.panels] == [("O.force", "force", "N")]
    (stack,) = stacks_of(run, ["O.*"])
    assert [panel.label for panel in stack.panels] == ["force_x", "force_y", "force"]


# -------------------------------------------------------------------------------------------------------- cam reactions
# Points and normals of the contact are those of the profile, which knows nothing of forces.


CAM_MASS, INERTIA = 0.7, 3.1e-4  # [kg], [kg m2]
CAM_CENTER, CAM_GRAVITY = (-20.0, -4.0), (3000.0, -9810.0)  # [mm], [mm/s2]
LED = {"roller": lambda: lifted_roller(8.0), "face": lifted_face, "lever": swung_roller, "lever with face": swung_face}


def heavy(mechanism: Mechanism, order: int, *, is_carried: bool) -> Mechanism:
    """Return cam and follower with masses; order: of the bodies of the bearings; is_carried: an arm holds them."""
    bodies = [
        body if body.is_ground else replace(body, mass=CAM_MASS, inertia=INERTIA, center_of_mass=CAM_CENTER)
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
        gravity=CAM_GRAVITY,
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
        arm = turned(np.array(CAM_CENTER), phi)
        self.center = np.column_stack([run[f"{name}.x"], run[f"{name}.y"]]) + arm
        across = np.column_stack([-arm[:, 1], arm[:, 0]])
        a = (
            np.column_stack([run[f"{name}.ax"], run[f"{name}.ay"]])
            + alpha[:, None] * across
            - omega[:, None] ** 2 * arm
        )
        self.force = -CAM_MASS * (a - CAM_GRAVITY) * 1e-3
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
    assert f"{line}O.force_y, guide.force, guide.moment" in unwrapped(report)
    assert report.loading is not None
    (contact,) = report.as_json()["forces"]["unknown_contacts"]
    assert contact["reactions"] == list(hidden)
    words = (
        r"outputs: 'guide.force' is undetermined: \[joints.lift\] gives no contact force: the key 'roller_radius' or"
    )
    with pytest.raises(RequestError, match=words):
        kinfmu.build(mechanism, "no.fmu", outputs=["guide.force"], flavour="python")
