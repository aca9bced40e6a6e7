"""Mechanisms with each joint and driver, compared with closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import kinfmu
from kinfmu import (
    Angle,
    AngleDriver,
    Body,
    ConstantSpeed,
    Coordinate,
    CoordinateDriver,
    DistanceDriver,
    Fixed,
    Gear,
    Mechanism,
    PointOnLine,
    RackAndPinion,
    RelativeAngle,
    RelativeAngleDriver,
    Revolute,
    SlideDriver,
    Translational,
)
from tests.oracle import largest_error, slider_crank


def quick_return(start: float = 0.0) -> Mechanism:
    """Return a crank whose pin runs in a slot of a lever."""
    return Mechanism(
        "quick_return",
        [
            Body("ground", {"O": (0, 1), "C": (0, -1)}),
            Body("crank", {"O": (0, 0), "P": (0.5, 0)}, (0, 1, 0.4)),
            Body("lever", {"C": (0, 0)}, (0, -1, 1.4)),
        ],
        [
            Revolute("O", ("ground.O", "crank.O")),
            Revolute("C", ("ground.C", "lever.C")),
            PointOnLine("slot", ("lever.C", "crank.P")),
        ],
        [AngleDriver("crank", "crank", ConstantSpeed(start, 1.0))],
    )


def crank_and_slider(*, offset: float = 0.25, drivers: tuple[object, ...] = ()) -> Mechanism:
    """Crank 1, rod 3, and a block that slides along y = offset."""
    start = 0.7
    lean = math.asin((offset - math.sin(start)) / 3.0)
    x = math.cos(start) + 3.0 * math.cos(lean)
    return Mechanism(
        "crank_and_slider",
        [
            Body("ground", {"O": (0, 0), "slot": (0, offset)}),
            Body("crank", {"O": (0, 0), "P": (1, 0)}, (0, 0, start)),
            Body("rod", {"P": (0, 0), "S": (3, 0)}, (math.cos(start), math.sin(start), lean)),
            Body("block", {"S": (0, 0)}, (x, offset, 0)),
        ],
        [
            Revolute("O", ("ground.O", "crank.O")),
            Revolute("P", ("crank.P", "rod.P")),
            Revolute("S", ("rod.S", "block.S")),
            Translational("slot", ("ground.slot", "block.S")),
        ],
        drivers or [AngleDriver("crank", "crank", ConstantSpeed(start, 1.0))],  # type: ignore[arg-type]
    )


def test_a_translational_joint_makes_a_slider_crank() -> None:
    u = np.linspace(-3.0, 9.0, 60)
    run = kinfmu.solve(crank_and_slider(), crank_angle=u)
    exact = slider_crank(1, 3, "0.25", list(u))
    for name, expected in zip(("block.x", "block.vx", "block.ax"), exact, strict=True):
        assert largest_error(run[name], expected[:, -1]) < 1e-13
    assert run.fixed["block.y"] == 0.25
    assert run.fixed["block.phi"] == 0.0


@pytest.mark.parametrize(
    "driver",
    [SlideDriver("ram", ("ground.slot", "block.S")), CoordinateDriver("ram", "block.S", "x")],
    ids=["slide", "coordinate"],
)
def test_driven_at_the_block_the_crank_follows_the_inverse_motion(driver: object) -> None:
    u = np.linspace(0.5, 2.5, 30)
    forwards = kinfmu.solve(crank_and_slider(), crank_angle=u)
    back = kinfmu.solve(
        crank_and_slider(drivers=(driver,)),
        ram_position=forwards["block.x"],
        ram_speed=forwards["block.vx"],
        ram_acceleration=forwards["block.ax"],
    )
    np.testing.assert_allclose(back["crank.phi"], u, atol=1e-12)
    np.testing.assert_allclose(back["crank.omega"], 1.0, atol=1e-11)
    np.testing.assert_allclose(back["crank.alpha"], 0.0, atol=1e-10)


def test_a_cylinder_lifts_an_arm_by_the_law_of_cosines() -> None:
    arm = Mechanism(
        "arm",
        [Body("ground", {"O": (0, 0), "C": (1, 0)}), Body("arm", {"O": (0, 0), "Q": (2, 0)}, (0, 0, 1.0))],
        [Revolute("O", ("ground.O", "arm.O"))],
        [DistanceDriver("cylinder", ("ground.C", "arm.Q"), ConstantSpeed(1.7, 0.1))],
    )
    length = np.linspace(1.2, 2.8, 40)
    run = kinfmu.solve(arm, cylinder_length=length)
    cos = (5.0 - length**2) / 4.0
    sin = np.sqrt(1.0 - cos**2)
    np.testing.assert_allclose(run["arm.phi"], np.arccos(cos), atol=1e-13)
    np.testing.assert_allclose(run["arm.omega"], length / (2.0 * sin), atol=1e-12)
    limits = kinfmu.check(arm).range
    assert limits is not None
    assert limits.low == pytest.approx(1.0, abs=1e-10)
    assert limits.high == pytest.approx(3.0, abs=1e-10)


def test_a_pin_in_a_slot_gives_a_quick_return_mechanism() -> None:
    lever = quick_return()
    u = np.linspace(0.0, 7.0, 50)
    run = kinfmu.solve(lever, crank_angle=u)
    np.testing.assert_allclose(run["lever.phi"], np.arctan2(2 + 0.5 * np.sin(u), 0.5 * np.cos(u)), atol=1e-14)


def test_gears_on_a_moving_carrier_make_a_planetary() -> None:
    gears = Mechanism(
        "planetary",
        [
            Body("ground", {"O": (0, 0)}),
            Body("arm", {"O": (0, 0), "A": (3, 0)}),
            Body("planet", {"A": (0, 0)}, (3, 0, 0)),
        ],
        [
            Revolute("O", ("ground.O", "arm.O")),
            Revolute("A", ("arm.A", "planet.A")),
            Gear("mesh", ("ground", "planet"), ratio=-2.0, carrier="arm"),  # a fixed sun of twice the teeth
        ],
        [AngleDriver("arm", "arm")],
    )
    run = kinfmu.solve(gears, arm_angle=[0.0, 0.5, 4.0])
    np.testing.assert_allclose(run["planet.phi"], [0.0, 1.5, 12.0], atol=1e-14)
    assert kinfmu.check(gears).mobility == 1


def test_the_travel_of_a_rack_is_the_arc_length_rolled_by_the_pinion() -> None:
    rack = Mechanism(
        "rack",
        [
            Body("ground", {"O": (0, 0), "R": (0, -2)}),
            Body("pinion", {"O": (0, 0)}),
            Body("rack", {"R": (0, 0)}, (0, -2, 0)),
        ],
        [
            Revolute("O", ("ground.O", "pinion.O")),
            Translational("slide", ("ground.R", "rack.R")),
            RackAndPinion("mesh", ("ground.R", "rack.R"), "pinion", radius=2.0, offset=0.5),
        ],
        [AngleDriver("pinion", "pinion")],
    )
    run = kinfmu.solve(rack, pinion_angle=[0.0, 1.0, -3.0], pinion_speed=0.5)
    np.testing.assert_allclose(run["rack.x"], [0.5, 2.5, -5.5], atol=1e-14)
    np.testing.assert_allclose(run["rack.vx"], 1.0, atol=1e-14)


def test_welded_and_turned_together_bodies_move_as_one() -> None:
    weld = Mechanism(
        "weld",
        [
            Body("ground", {"O": (0, 0)}),
            Body("bar", {"O": (0, 0), "A": (2, 0)}),
            Body("plate", {"A": (0, 0), "tip": (1, 0)}, (2, 0, 0.5)),
            Body("pointer", {"tip": (0, 0)}, (3, 0, 0.8)),
        ],
        [
            Revolute("O", ("ground.O", "bar.O")),
            Fixed("weld", ("bar.A", "plate.A"), angle=0.5),
            Revolute("tip", ("plate.tip", "pointer.tip")),
            RelativeAngle("along", ("plate", "pointer"), 0.3),
        ],
        [AngleDriver("bar", "bar")],
    )
    run = kinfmu.solve(weld, bar_angle=[0.2])
    assert run["pointer.phi"][0] == pytest.approx(1.0, abs=1e-14)
    assert run["pointer.x"][0] == pytest.approx(2 * math.cos(0.2) + math.cos(0.7), abs=1e-14)
    assert kinfmu.check(weld).plan is not None


def test_an_elliptic_trammel_and_a_motor_between_moving_bodies() -> None:
    trammel = Mechanism(
        "trammel",
        [Body("ground"), Body("bar", {"A": (-1, 0), "B": (1, 0), "P": (3, 0)}, (0.5, 0.5, 2.0))],
        [Coordinate("x", "bar.A", "x"), Coordinate("y", "bar.B", "y")],
        [AngleDriver("bar", "bar")],
        points={"P": "bar.P"},
    )
    u = np.linspace(0.0, 6.0, 20)
    run = kinfmu.solve(trammel, bar_angle=u)
    np.testing.assert_allclose(run["P.x"], 4 * np.cos(u), atol=1e-14)
    np.testing.assert_allclose(run["P.y"], 2 * np.sin(u), atol=1e-14)

    arm = Mechanism(
        "arm",
        [
            Body("ground", {"O": (0, 0)}),
            Body("upper", {"O": (0, 0), "E": (1, 0)}),
            Body("fore", {"E": (0, 0)}, (1, 0, 0)),
            Body("level", {"L": (0, 0)}),
        ],
        [
            Revolute("O", ("ground.O", "upper.O")),
            Revolute("E", ("upper.E", "fore.E")),
            Revolute("L", ("upper.E", "level.L")),
            Angle("level", "level", 0.25),
        ],
        [AngleDriver("shoulder", "upper"), RelativeAngleDriver("elbow", ("upper", "fore"))],
    )
    moved = kinfmu.solve(arm, shoulder_angle=[0.3], elbow_angle=[0.4], shoulder_speed=2.0, elbow_speed=-1.0)
    assert moved["fore.phi"][0] == pytest.approx(0.7)
    assert moved["fore.omega"][0] == pytest.approx(1.0)
    assert moved["level.phi"][0] == 0.25
