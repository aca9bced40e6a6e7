"""Mechanisms written in Python are checked like files, and are values."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError, replace
from typing import Any

import numpy as np
import pytest

from kinfmu.errors import MechanismError
from kinfmu.mechanism import Body, Mechanism, Point, RunSettings, Start, gallery
from kinfmu.mechanism.drivers import AngleDriver
from kinfmu.mechanism.joints import Coordinate, Distance, Joint, Revolute
from kinfmu.mechanism.laws import ConstantSpeed
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
