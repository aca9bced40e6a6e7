"""Missing and surplus drivers: named, with what could be driven instead."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

import kinfmu
from kinfmu import AngleDriver, Body, ConstantSpeed, Fixed, Mechanism, Revolute, Translational
from kinfmu.errors import AssemblyError, MobilityError
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text
from tests.mechanisms import five_bar, fourbar


def with_arm(*drivers: kinfmu.AngleDriver) -> Mechanism:
    """A crank-rocker with an arm of its own on the rocker's pivot, two degrees of freedom."""
    linkage = fourbar(4, 1, 3.5, 3)
    arm = Body("arm", {"C": (0, 0), "end": (1, 0)}, (4, 0, 0.3))
    return replace(
        linkage,
        bodies=(*linkage.bodies, arm),
        joints=(*linkage.joints, Revolute("arm", ("ground.C", "arm.C"))),
        drivers=(*linkage.drivers, *drivers),
    )


def test_a_missing_driver_is_reported_with_what_is_loose_and_what_could_be_driven() -> None:
    report = kinfmu.check(with_arm())
    assert report.advice is not None
    assert (report.advice.missing, report.advice.loose, report.advice.surplus) == (1, ("arm.phi",), ())
    text = str(report)
    assert "  loose       arm.phi: 1 more driver needed" in text
    assert '  could add   [drivers] arm = { type = "angle", of = "arm", law = "constant_speed" }' in text


@pytest.mark.parametrize("count", [0, 1])
def test_suggested_drivers_make_the_mechanism_move(count: int) -> None:
    mechanism = replace(five_bar(), drivers=five_bar().drivers[:count])
    advice = kinfmu.check(mechanism).advice
    assert advice is not None
    assert len(advice.suggestions) == advice.missing == 2 - count
    pasted = "\n".join(str(suggestion).replace("[drivers] ", "drivers.") for suggestion in advice.suggestions)
    assert kinfmu.check(parse(pasted + "\n" + text(mechanism))).problem is None


def test_a_body_in_the_open_could_be_driven_by_its_angle_and_a_point() -> None:
    advice = kinfmu.check(Mechanism("block", [Body("block", {"P": (1, 0)})])).advice
    assert advice is not None
    assert [suggestion.keys["type"] for suggestion in advice.suggestions] == ["angle", "coordinate", "coordinate"]


@pytest.mark.parametrize("left_out", ["P", "Q", "C"])
def test_a_pin_that_is_missing_is_proposed_first_and_completes_the_mechanism(left_out: str) -> None:
    whole = fourbar(4, 1, 3.5, 3)
    mechanism = replace(whole, joints=tuple(joint for joint in whole.joints if joint.name != left_out))
    report = kinfmu.check(mechanism)
    assert report.advice is not None
    (suggestion,) = report.advice.suggestions
    (joint,) = (joint for joint in whole.joints if joint.name == left_out)
    assert isinstance(joint, Revolute)
    assert f"  could add   {suggestion}" in str(report)
    assert (suggestion.table, set(suggestion.keys["between"])) == ("joints", set(joint.between))
    pasted = str(suggestion).replace("[joints] ", "joints.")
    assert kinfmu.check(parse(pasted + "\n" + text(mechanism))).problem is None


def test_a_roller_as_a_body_of_its_own_could_be_left_out() -> None:
    linkage = fourbar(4, 1, 3.5, 3)
    roller = Body("roller", {"Q": (0, 0), "R": (0, 0)}, (3, 3, 0))
    ground = Body("ground", {"O": (0, 0), "C": (4, 0)})
    mechanism = replace(
        linkage,
        bodies=(ground, *(body for body in linkage.bodies if not body.is_ground), roller),
        joints=(
            *(joint for joint in linkage.joints if joint.name != "Q"),
            Revolute("Q", ("coupler.Q", "roller.Q")),
            Revolute("R", ("roller.R", "rocker.Q")),
        ),
    )
    report = kinfmu.check(mechanism)
    assert "  could omit  [bodies.roller]: it moves alone and no other body follows" in str(report)
    assert "; or leave out roller, which no other body follows" in str(report.problem)


def test_a_pendulum_is_no_idle_body() -> None:
    advice = kinfmu.check(with_arm()).advice
    assert advice is not None
    assert advice.idle is None


@pytest.mark.parametrize("name", ["P", "Q"])
def test_a_pin_written_as_fixed_is_named_where_no_motion_is_left(name: str) -> None:
    whole = fourbar(4, 1, 3.5, 3)
    joints = [Fixed(name, joint.between, 1.0) if joint.name == name else joint for joint in whole.joints]
    report = kinfmu.check(replace(whole, joints=joints))
    assert str(report.problem).endswith(f"there is nothing to drive; is {name} a revolute joint?")
    assert f'  could be    [joints.{name}] type = "revolute" in place of "fixed"' in str(report)


def test_a_slide_could_be_driven_along_its_axis() -> None:
    bodies = [Body("ground", {"G": (0, 0)}), Body("block", {"P": (0, 0)})]
    advice = kinfmu.check(Mechanism("slide", bodies, [Translational("rail", ("ground.G", "block.P"), 0.5)])).advice
    assert advice is not None
    (suggestion,) = advice.suggestions
    assert str(suggestion) == (
        '[drivers] rail = { type = "slide", between = ["ground.G", "block.P"], axis = 0.5, law = "constant_speed" }'
    )


def test_a_driver_too_many_is_named_with_the_one_it_fights() -> None:
    linkage = fourbar(4, 1, 3.5, 3)
    two = AngleDriver("two", "rocker", ConstantSpeed(1.9, 1.0))
    report = kinfmu.check(replace(linkage, drivers=(*linkage.drivers, two)))
    assert report.advice is not None
    assert report.advice.surplus == (("two", ("crank",)),)
    assert "  surplus     driver two: crank and the joints determine what it drives; remove it" in str(report)
    assert report.as_json()["advice"]["surplus"] == [{"name": "two", "implied_by": ["crank"]}]


def test_two_drivers_on_one_freedom_while_another_is_free_are_reported() -> None:
    report = kinfmu.check(with_arm(AngleDriver("two", "rocker", ConstantSpeed(1.9, 1.0))))
    assert isinstance(report.problem, MobilityError)
    assert str(report.problem) == (
        "[drivers.two] drives what crank and the joints determine, while arm can still move; "
        'drive, for example, [drivers] arm = { type = "angle", of = "arm", law = "constant_speed" }'
    )


def test_a_driver_of_a_coordinate_that_a_joint_holds_is_reported() -> None:
    bodies = [Body("ground", {"G": (0, 0)}), Body("block", {"P": (0, 0)})]
    stuck = Mechanism("stuck", bodies, [Fixed("weld", ("ground.G", "block.P"))], [AngleDriver("turn", "block")])
    assert "  surplus     driver turn: the joints alone determine what it drives; remove it" in str(kinfmu.check(stuck))


def test_drivers_that_match_need_no_advice() -> None:
    report = kinfmu.check(five_bar())
    assert report.advice is None
    assert report.as_json()["advice"] is None


@pytest.mark.parametrize(("lengths", "end"), [((8, 1, 3.5, 3), ""), ((6, 2, 5, 2), " is weld a revolute joint?")])
def test_too_many_joints_that_do_not_close_are_no_advice_to_remove_drivers(
    lengths: tuple[float, ...], end: str
) -> None:
    linkage = fourbar(*lengths)
    weld = Fixed("weld", ("crank.P", "coupler.P"), math.pi)
    report = kinfmu.check(replace(linkage, joints=(*linkage.joints, weld)))
    assert report.mobility == -2
    assert isinstance(report.problem, AssemblyError)
    assert str(report.problem).startswith("the mechanism does not close near its start pose (")
    assert str(report.problem).endswith(f"; 11 rows of the joints hold 9 coordinates: is a joint too many?{end}")
    assert "remove" not in str(report)
    assert "  mobility    none: the joints do not close, driven by crank" in str(report)
