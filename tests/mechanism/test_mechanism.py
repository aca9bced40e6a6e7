"""Mechanisms built in Python: their members, and bodies of uniform plates and rods."""

from __future__ import annotations

import dataclasses
import math
import re
from dataclasses import FrozenInstanceError, replace
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu.errors import MechanismError
from kinfmu.mechanism import Body, Mechanism, Point, RunSettings, Start, drivers, gallery, joints, laws, loads
from kinfmu.mechanism.drivers import DRIVERS, AngleDriver
from kinfmu.mechanism.joints import JOINTS, Coordinate, Distance, Joint, Revolute
from kinfmu.mechanism.laws import LAWS, ConstantSpeed
from kinfmu.mechanism.loads import LOADS
from kinfmu.mechanism.toml_document import table_keys
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text
from kinfmu.mechanism.valid import LONGEST, quoted

GROUND = Body("ground", {"O": Point(0.0, 0.0)})
BAR = Body("bar", {"P": Point(1.0, 0.0)})


def message_of(*joints: Joint, **changes: Any) -> str:
    """Return the message about a ground and a bar with these joints."""
    with pytest.raises(MechanismError) as caught:
        Mechanism(**{"name": "a", "bodies": (GROUND, BAR), "joints": joints, **changes})
    message = str(caught.value)
    assert message.splitlines() == [message]
    return message


def test_the_ground_is_added_when_it_is_missing() -> None:
    assert Mechanism("a", (BAR,)).bodies == (Body("ground"), BAR)


def test_names_of_coordinates_follow_the_bodies_in_file_order() -> None:
    mechanism = Mechanism("a", (BAR, GROUND, Body("arm")))
    assert mechanism.coordinate_names == ("bar.x", "bar.y", "bar.phi", "arm.x", "arm.y", "arm.phi")
    assert mechanism.body_points == {"bar.P": (1.0, 0.0), "ground.O": (0.0, 0.0)}


def test_a_mechanism_is_a_value() -> None:
    mechanism, again = gallery.load("fourbar"), gallery.load("fourbar")
    assert mechanism == again
    assert hash(mechanism) == hash(again)
    assert replace(mechanism, name="other") != mechanism
    with pytest.raises(FrozenInstanceError):
        mechanism.name = "other"  # type: ignore[misc]
    with pytest.raises(TypeError):
        mechanism.points["B"] = "coupler.A"  # type: ignore[index]
    with pytest.raises(TypeError):
        mechanism.bodies[0].points["X"] = Point(0.0, 0.0)  # type: ignore[index]


def test_lists_of_members_become_tuples() -> None:
    mechanism = Mechanism("a", [GROUND, BAR], [Revolute("O", ("ground.O", "bar.P"))])  # type: ignore[arg-type]
    assert mechanism == Mechanism("a", (GROUND, BAR), (Revolute("O", ("ground.O", "bar.P")),))


def test_members_with_the_same_name_are_refused() -> None:
    pin = Revolute("O", ("ground.O", "bar.P"))
    assert message_of(pin, pin) == "[joints] 'O' is defined twice"
    assert message_of(bodies=(BAR, BAR)) == "[bodies] 'bar' is defined twice"
    assert message_of(drivers=(AngleDriver("m", "bar"), AngleDriver("m", "bar"))) == "[drivers] 'm' is defined twice"


def test_points_of_a_joint_must_be_a_pair_of_names() -> None:
    two = "must be two points, ('body.point', 'body.point')"
    assert message_of(Revolute("O", ["ground.O", "bar.P"])) == (  # type: ignore[arg-type]
        f"[joints.O] between = ['ground.O', 'bar.P'] {two}"
    )
    assert message_of(Revolute("O", "ground.O")) == f"[joints.O] between = 'ground.O' {two}"  # type: ignore[arg-type]
    assert message_of(Revolute("O", ("ground.O", 5))) == "[joints.O] between = 5 must be text"  # type: ignore[arg-type]
    assert message_of(Coordinate("g", None, "x")) == "[joints.g] of = None must be text"  # type: ignore[arg-type]


def test_an_axis_must_be_x_or_y() -> None:
    assert message_of(Coordinate("guide", "bar.P", "z")) == "[joints.guide] axis = 'z' must be one of x, y"


@pytest.mark.parametrize(
    ("value", "why"),
    [
        (math.nan, "must be a finite number"),
        (math.inf, "must be a finite number"),
        (2e30, "is too large"),
        (10**400, "is too large"),
        (True, "must be a number"),
        (None, "must be a number"),
    ],
)
def test_a_value_that_is_not_a_number_is_reported_in_every_place(value: Any, why: str) -> None:
    def starts(message: str, where: str) -> bool:
        return message.startswith(f"{where} = {quoted(value)} {why}")

    assert starts(message_of(Coordinate("g", "bar.P", "x", value)), "[joints.g] value")
    assert starts(message_of(drivers=(AngleDriver("m", "bar", ConstantSpeed(0.0, value)),)), "[drivers.m] speed")
    if value is not None:  # None leaves a start coordinate to assembly
        assert starts(message_of(bodies=(Body("bar", {}, Start(value)),)), "[bodies.bar] start.x")
    with pytest.raises(MechanismError) as caught:
        RunSettings(stop=value)
    assert starts(str(caught.value), "[run] stop")


@pytest.mark.parametrize("point", [(1.0,), (1.0, 2.0, 3.0), 1.0, "ab", None])
def test_a_point_that_is_not_a_pair_of_numbers_is_refused(point: Any) -> None:
    with pytest.raises(MechanismError) as caught:
        Body("bar", {"P": point})
    assert str(caught.value) == f"[bodies.bar] points.P = {quoted(point)} must be two numbers [x, y]"


@pytest.mark.parametrize("length", [0.0, -1.0, 1e-200])
def test_a_distance_without_a_positive_length_is_reported_by_its_name(length: float) -> None:
    message = message_of(Distance("AB", ("ground.O", "bar.P"), length))
    assert message == f"[joints.AB] length = {length!r} must be a positive number, 1e-30 or more"


def test_text_without_a_unit_is_refused_where_units_exist() -> None:
    needed = "'1': text needs a unit, one of"
    assert message_of(Coordinate("g", "bar.P", "x", "1")).startswith(f"[joints.g] value = {needed} m, mm")  # type: ignore[arg-type]
    assert message_of(run=RunSettings(stop="1")).startswith(f"[run] stop = {needed} s, ms")  # type: ignore[arg-type]


def test_a_pair_of_bodies_must_be_two_bodies() -> None:
    two_points = Body("bar", {"P": Point(0.0, 0.0), "Q": Point(1.0, 0.0)})
    assert (
        message_of(Revolute("O", ("bar.P", "bar.Q")), bodies=(two_points,)) == "[joints.O] joins body 'bar' to itself"
    )
    assert message_of(Coordinate("g", "ground.O", "x")) == "[joints.g] acts on the ground only, which does not move"


def test_values_are_quoted_on_one_line_as_toml_has_them() -> None:
    assert quoted("a\nb") == r"'a\nb'"
    assert quoted(True) == "true"
    assert quoted([False, 1, 1.5]) == "[false, 1, 1.5]"
    assert quoted(np.float64(1.5)) == "1.5"
    assert len(quoted("a" * 10_000)) <= 100
    assert len(quoted([["x" * 1000] * 100] * 100)) == LONGEST
    assert quoted(-(10**5000)) == "a whole number of 16610 bits"


# -------------------------------------------------------------------------------------------------------------- members


EQUATIONS = (
    (joints, JOINTS, "Phi = "),
    (drivers, DRIVERS, "Phi = "),
    (loads, LOADS, "\n        e = "),
    (laws, LAWS, "u = "),
)
MEMBERS = [(cls, package, equation) for package, classes, equation in EQUATIONS for cls in classes]


@pytest.mark.parametrize(
    "classes", [classes for _, classes, _ in EQUATIONS], ids=["joints", "drivers", "loads", "laws"]
)
def test_types_are_all_different(classes: tuple[Any, ...]) -> None:
    assert len({cls.type for cls in classes}) == len(classes)


@pytest.mark.parametrize(("cls", "package", "equation"), MEMBERS, ids=[cls.__name__ for cls, *_ in MEMBERS])
def test_a_member_is_a_frozen_dataclass_that_is_exported_and_shows_its_equation(
    cls: Any, package: Any, equation: str
) -> None:
    assert dataclasses.is_dataclass(cls)
    assert cls.__dataclass_params__.frozen
    assert getattr(package, cls.__name__) is cls
    assert package is joints or cls.__name__ in kinfmu.__all__  # a joint may be added without it
    assert equation in (cls.__doc__ or "")
    if package is not laws:
        assert dataclasses.fields(cls)[0].name == "name"
    if package is joints:
        assert len(set(cls.labels)) == len(cls.labels) > 0


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.type)
def test_no_key_of_a_law_is_a_key_of_a_member_that_may_have_it(law: Any) -> None:
    theirs = {key for member in (*JOINTS, *DRIVERS, *LOADS) for key in table_keys(member) if key != "law"}
    assert not set(table_keys(law)) & (theirs | {"type", "law", "name"})


# -------------------------------------------------------------------------------------------------------------- uniform


STEEL = {"density": 7850.0, "thickness": 0.01}


def properties(points: list[tuple[float, float]], **given: object) -> np.ndarray:
    names = [f"P{k}" for k in range(len(points))]
    body = Body("body", dict(zip(names, points, strict=True)), plate=tuple(names), **given)  # type: ignore[arg-type]
    return np.array(body.mass_properties("m"))


@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize("away", [(0.0, 0.0), (100.0, -70.0)])
def test_a_triangle_and_a_rectangle_have_their_closed_forms(turn: int, away: tuple[float, float]) -> None:
    """I = m (a^2 + b^2 + c^2) / 36 of a triangle with these sides; m (a^2 + b^2) / 12 of a rectangle."""
    corners = [np.array(corner) for corner in ((0.0, 0.0), (0.5, 0.1), (0.2, 0.4))]
    mass = 78.5 * 0.5 * (0.5 * 0.4 - 0.2 * 0.1)
    sides = sum(float(np.sum((corners[k] - corners[k - 1]) ** 2)) for k in range(3))
    x, y = np.mean(corners, axis=0) + away
    found = properties([tuple(corner + away) for corner in corners][::turn], **STEEL)
    np.testing.assert_allclose(found, [mass, x, y, mass * sides / 36], rtol=1e-11)
    rectangle = [(away[0] + x, away[1] + y) for x, y in ((0.0, 0.0), (0.3, 0.0), (0.3, 0.2), (0.0, 0.2))]
    found = properties(rectangle[::turn], areal_density=50.0)
    np.testing.assert_allclose(found, [3.0, away[0] + 0.15, away[1] + 0.1, 3.0 * (0.09 + 0.04) / 12], rtol=1e-11)


def test_a_plate_with_a_notch_is_the_sum_of_its_rectangles() -> None:
    corners = [(0.0, 0.0), (0.4, 0.0), (0.4, 0.1), (0.1, 0.1), (0.1, 0.3), (0.0, 0.3)]
    parts = [(0.4 * 0.1, 0.2, 0.05, 0.4, 0.1), (0.1 * 0.2, 0.05, 0.2, 0.1, 0.2)]  # area, centre, sides
    mass = 2.0
    areas = np.array([part[0] for part in parts])
    centers = np.array([part[1:3] for part in parts])
    center = (areas[:, None] * centers).sum(axis=0) / areas.sum()
    masses = mass * areas / areas.sum()
    inertia = sum(
        m * ((a * a + b * b) / 12 + ((at - center) ** 2).sum())
        for m, at, (*_, a, b) in zip(masses, centers, parts, strict=True)
    )
    np.testing.assert_allclose(properties(corners, mass=mass), [mass, *center, inertia], rtol=1e-13)


PENDULUM = """
name = "pendulum"
[units]
length = "mm"
[parameters]
l = "400 mm"
rho = "2.7 g/cm3"
[gravity]
x = 0
y = "-9.81 m/s2"
[bodies.ground]
points = { O = [0, 0] }
[bodies.arm]
points = { O = [0, 0], P = ["l", 0], Q = ["l/2", "l/4"] }
SHAPE
[joints]
O = { type = "revolute", between = ["ground.O", "arm.O"] }
[drivers]
arm = { type = "angle", of = "arm", law = "harmonic", amplitude = "60 deg", frequency = "1 Hz" }
"""
WIDE = 'rod = ["O", "P"]\ndensity = "rho"\nthickness = "8 mm"\nwidth = "l/10"'
PLATE = 'plate = ["O", "P", "Q"]\ndensity = "rho"\nthickness = "8 mm"'


@pytest.mark.parametrize("shape", [WIDE, PLATE])
@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.few(2)
def test_lengths_and_densities_as_parameters_change_the_mass(shape: str, engine: str) -> None:
    mechanism = parse(PENDULUM.replace("SHAPE", shape), "pendulum")
    assert parse(text(mechanism), "again") == mechanism
    model = kinfmu.compile(mechanism, engine=engine)
    times = np.linspace(0.0, 1.0, 400 if engine == "native" else 21)
    for length, density in ((400.0, 2700.0), (300.0, 7850.0)):
        run = model.solve(times, parameters={"l": length, "rho": density})
        long = 1e-3 * length
        if shape is WIDE:
            mass, center = density * 0.008 * long * long / 10, np.array([long / 2, 0.0])
            inertia = mass * (long**2 + (long / 10) ** 2) / 12
        else:
            mass, center = density * 0.008 * long * long / 8, np.array([long / 2, long / 12])
            inertia = mass * (long**2 + 2 * (long**2 / 4 + long**2 / 16)) / 36
        assert run["arm.reduced_inertia"] == pytest.approx(inertia + mass * center @ center, rel=1e-12)
        arm = center[0] * np.cos(run["arm.phi"]) - center[1] * np.sin(run["arm.phi"])
        torque = (inertia + mass * center @ center) * run["arm.alpha"] + 9.81 * mass * arm
        np.testing.assert_allclose(run["arm.torque"], torque, rtol=0, atol=1e-12 * np.abs(torque).max())


def test_a_thin_rod_is_slender_and_a_width_alone_adds_its_inertia() -> None:
    body = Body("rod", {"A": Point(1.0, 2.0), "B": Point(4.0, 6.0)}, mass=3.0, rod=("A", "B"))
    assert body.mass_properties("m") == pytest.approx((3.0, 2.5, 4.0, 3.0 * 25.0 / 12.0), rel=1e-15)
    assert replace(body, width=0.6).mass_properties("m")[3] == pytest.approx(3.0 * 25.36 / 12.0, rel=1e-15)
    thin = replace(body, mass=0.0, width=1e-7, areal_density=3.0 / 5e-7)
    assert thin.mass_properties("m") == pytest.approx(body.mass_properties("m"), rel=1e-13)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ('plate = ["O", "P"]', "plate = ['O', 'P'] must be three or more points of the body, such as ['A', 'B', 'C']"),
        (PLATE.replace('"Q"', '"R"'), "plate: body 'arm' has no point 'R'"),
        (PLATE.replace('"Q"', '"O"'), "plate = ['O', 'P', 'O'] has no area; its corners must not lie on one line"),
        (PLATE + "\nmass = 2", "'density' and 'mass' exclude each other; remove one of the two keys"),
        (PLATE + '\nareal_density = "20 kg/m2"', "'areal_density' and 'density' exclude each other"),
        (PLATE + '\nrod = ["O", "P"]', "'plate' and 'rod' exclude each other"),
        (PLATE + '\ninertia = "1 kg m2"', "plate: 'inertia' follows from the plate; remove one of the two keys"),
        (
            'density = "rho"\nthickness = 3',
            "density needs a shape: plate = ['A', 'B', 'C'], or rod = ['A', 'B'] with a width",
        ),
        ('plate = ["O", "P", "Q"]\ndensity = "rho"', "density needs a thickness, such as thickness = '10 mm'"),
        ('plate = ["O", "P", "Q"]', "plate needs a mass, such as mass = '1.2 kg'"),
        ('rod = ["O", "P"]\nareal_density = 8', "areal_density: a rod needs a width, such as width = '30 mm'"),
        (WIDE.replace('"rho"', "-1"), "density = -1.0 must be positive"),
        (WIDE.replace('"rho"', '"3 kg"'), "density"),
        ("mass = 1\nwidth = 3", "width needs a rod, such as rod = ['A', 'B']"),
    ],
)
def test_wrong_keys_get_one_clear_line(keys: str, message: str) -> None:
    with pytest.raises(MechanismError, match=re.escape(message)) as error:
        parse(PENDULUM.replace("SHAPE", keys), "pendulum")
    assert "[bodies.arm]" in str(error.value)
    assert "\n" not in str(error.value)


def test_edges_of_a_plate_that_cross_are_named() -> None:
    keys = 'plate = ["O", "P", "Q", "S"]\nmass = 1'
    file = PENDULUM.replace("SHAPE", keys).replace('Q = ["l/2", "l/4"]', "Q = [0, 50], S = [400, 60]")
    message = "plate = ['O', 'P', 'Q', 'S']: its edges P-Q and S-O meet; list its corners in order around it"
    with pytest.raises(MechanismError, match=re.escape(message)):
        parse(file, "pendulum")
