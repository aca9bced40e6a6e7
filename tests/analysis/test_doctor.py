"""Advice on mechanisms that do not move as meant: after each change the mechanism moves."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import kinfmu
from kinfmu import AngleDriver, Body, ConstantSpeed, Distance, Fixed, Mechanism, Revolute, Translational
from kinfmu.analysis.doctor import Advice, advice
from kinfmu.mechanism.edits import Put, Remove, edited
from kinfmu.mechanism.gallery.chains import fourbar_chain
from kinfmu.mechanism.toml_document import document_of
from kinfmu.mechanism.toml_file import mechanism_of, parse
from kinfmu.mechanism.toml_text import text
from kinfmu.plan import compile_plan
from tests.analysis.test_check import with_arm
from tests.mechanisms import five_bar, fourbar
from tests.stress.slips import KINDS, treated


def followed(mechanism: Mechanism, one: Advice) -> Mechanism:
    """Return a mechanism after an advice."""
    return mechanism_of(edited(document_of(text(mechanism), "file"), one.edits), None)


def checked(mechanism: Mechanism) -> tuple[Advice, ...]:
    """Return the advice on a mechanism, after which there is a plan."""
    found = kinfmu.check(mechanism).advice
    assert 1 <= len(found) <= 3
    for one in found:
        compile_plan(followed(mechanism, one))
    return found


@pytest.mark.parametrize("name", ["crank_rocker", "toggle_press", "five_bar", "parallel_jaw", "cam_roller"])
def test_a_sound_mechanism_gets_no_advice(name: str) -> None:
    mechanism = kinfmu.load(name)
    assert kinfmu.check(mechanism).advice == ()
    assert advice(mechanism) == []


@pytest.mark.parametrize("left_out", ["P", "Q", "C"])
def test_points_in_one_place_are_joined(left_out: str) -> None:
    whole = fourbar(4, 1, 3.5, 3)
    mechanism = replace(whole, joints=tuple(joint for joint in whole.joints if joint.name != left_out))
    first, *_ = checked(mechanism)
    (joint,) = (joint for joint in whole.joints if joint.name == left_out)
    assert isinstance(joint, Revolute)
    (edit,) = first.edits
    assert edit == Put(("joints", left_out), {"type": "revolute", "between": list(joint.between)})
    assert first.text == f"join {' and '.join(joint.between)}: they are in the same place and nothing connects them"
    assert first.leads_to == "mobility 1, driven by crank; it moves over the whole run"


def test_the_lines_of_toml_can_be_pasted() -> None:
    whole = fourbar(4, 1, 3.5, 3)
    mechanism = replace(whole, joints=tuple(joint for joint in whole.joints if joint.name != "Q"))
    report = kinfmu.check(mechanism)
    shown = str(report).partition("  advice  ")[2].splitlines()
    pasted = "\n".join(line.strip() for line in shown if re.match(r"\s+(\[|type|between)", line))
    assert pasted == '[joints.Q]\ntype = "revolute"\nbetween = ["coupler.Q", "rocker.Q"]'
    assert kinfmu.check(parse(f"{text(mechanism)}\n{pasted}\n")).problem is None


def test_advice_is_plain_data_too() -> None:
    linkage = fourbar(4, 1, 3.5, 3)
    two = AngleDriver("two", "rocker", ConstantSpeed(1.9, 1.0))
    found = kinfmu.check(replace(linkage, drivers=(*linkage.drivers, two))).as_json()["advice"]
    assert json.loads(json.dumps(found[0])) == {
        "text": "remove driver two: there are more drivers than degrees of freedom",
        "edits": [{"remove": ["drivers", "two"]}],
        "leads_to": "mobility 1, driven by crank; it moves over the whole run",
    }


def test_numbers_in_tables_are_written_with_their_table() -> None:
    edits = (
        Put(("bodies", "rod", "points", "P"), [1.0, 0.0]),
        Put(("bodies", "rod", "start", "phi"), "60 deg"),
        Put(("joints", "bar", "length"), 2.5),
        Remove(("joints", "P")),
    )
    assert Advice("", edits, "").toml_lines() == [
        "[bodies.rod]",
        "points.P = [1, 0]",
        'start.phi = "60 deg"',
        "[joints.bar]",
        "length = 2.5",
        "# remove [joints.P]",
    ]


@pytest.mark.parametrize("count", [0, 1])
def test_missing_drivers_are_added_all_at_once(count: int) -> None:
    first, *_ = checked(replace(five_bar(), drivers=five_bar().drivers[:count]))
    assert len(first.edits) == 2 - count
    assert first.text.startswith("drive ")


def test_a_body_without_joints_could_be_driven_by_its_angle_and_a_point() -> None:
    first, *_ = checked(Mechanism("block", [Body("block", {"P": (1, 0)})]))
    assert first.text == "drive block and drive block.P along x and drive block.P along y: these are free"


def test_an_arm_that_hangs_is_removed_or_driven() -> None:
    texts = [one.text for one in checked(with_arm())]
    assert texts[0] == "remove arm: it hangs from ground and nothing follows it"
    assert "drive arm: what it drives is free" in texts


def test_a_roller_as_a_body_of_its_own_is_welded() -> None:
    linkage = fourbar(4, 1, 3.5, 3)
    roller = Body("roller", {"Q": (0, 0), "R": (0, 0)}, (3, 3, 0))
    joints = [joint for joint in linkage.joints if joint.name != "Q"]
    joints += [Revolute("Q", ("coupler.Q", "roller.Q")), Revolute("R", ("roller.R", "rocker.Q"))]
    first, *_ = checked(replace(linkage, bodies=(*linkage.bodies, roller), joints=tuple(joints)))
    assert first.text == "weld joint R of roller and rocker: roller moves alone and no other body follows"


@pytest.mark.parametrize("name", ["P", "Q"])
def test_a_pin_written_as_fixed_becomes_a_pin(name: str) -> None:
    whole = fourbar(4, 1, 3.5, 3)
    joints = [Fixed(name, joint.between, 1.0) if joint.name == name else joint for joint in whole.joints]
    first, *_ = checked(replace(whole, joints=joints))
    assert first.text.startswith(f"make joint {name} revolute: ")


def test_a_slide_is_driven_along_its_axis() -> None:
    bodies = [Body("ground", {"G": (0, 0)}), Body("block", {"P": (0, 0)})]
    first, *_ = checked(Mechanism("slide", bodies, [Translational("rail", ("ground.G", "block.P"), 0.5 * math.pi)]))
    keys = {"type": "slide", "between": ["ground.G", "block.P"], "axis": "90 deg", "law": "constant_speed"}
    assert first.edits == (Put(("drivers", "rail"), keys | {"speed": 0.1}),)
    assert 'axis = "90 deg"' in first.toml_lines()


@pytest.mark.parametrize("apart", [0.0, 0.05])
def test_pins_next_to_each_other_are_joined_before_drivers_are_added(apart: float) -> None:
    whole = fourbar(4, 1, 3.5, 3)
    joints = tuple(joint for joint in whole.joints if joint.name != "Q")
    bodies = [
        replace(body, points=body.points | {"Q": (body.points["Q"][0] + apart, body.points["Q"][1])})
        if body.name == "rocker"
        else body
        for body in whole.bodies
    ]
    first, *_ = checked(replace(whole, bodies=tuple(bodies), joints=joints, drivers=()))
    assert first.text == "join coupler.Q and rocker.Q and drive crank: these are free"
    assert 'speed = "60 rpm"' in first.toml_lines()  # a turn in the run


def test_two_drivers_on_one_freedom_one_drives_the_other_freedom() -> None:
    first, *_ = checked(with_arm(AngleDriver("two", "rocker", ConstantSpeed(1.9, 1.0))))
    assert first.text == "drive arm in place of rocker"


@pytest.mark.parametrize("factor", [1000.0, 25.4])
@pytest.mark.few(1)
def test_a_length_in_another_unit_is_scaled_back(factor: float) -> None:
    linkage = kinfmu.load("parallel_jaw")
    joints = tuple(
        replace(joint, length=joint.length / factor)
        if isinstance(joint, Distance) and joint.name == "left_rod"
        else joint
        for joint in linkage.joints
    )
    first, *_ = checked(replace(linkage, joints=joints))
    assert first.text == f"multiply by {factor:g} the length of left_rod: it is in another unit than mm"


def test_two_points_that_are_swapped_are_swapped_back() -> None:
    document = document_of(text(kinfmu.load("toggle_press")), "file")
    points = document["bodies"]["ground"]["points"]
    points["T"], points["G"] = points["G"], points["T"]
    texts = [one.text for one in checked(mechanism_of(document, None))]
    assert "swap points T and G of ground" in texts


def test_a_point_that_misses_a_bar_is_pinned_to_it() -> None:
    document = document_of(text(kinfmu.load("slider_crank")), "file")
    points = document["bodies"]["crank"]["points"]
    points["end"] = [90.0, 0.0]
    del document["joints"]["P"]
    points["P"] = [500.0, 0.0]
    texts = [one.text for one in checked(mechanism_of(document, None))]
    assert any(line.startswith("pin rod.P to crank: it is ") for line in texts)


def test_a_start_angle_of_the_wrong_sign_is_turned() -> None:
    document = document_of(text(kinfmu.load("watt_six_bar")), "file")
    document["bodies"]["right"]["start"]["phi"] = "-173 deg"
    document["bodies"]["left"]["start"]["phi"] = "-78 deg"
    report = kinfmu.check(mechanism_of(document, None))
    assert report.problem is None
    for one in report.advice:
        assert one.text.startswith("start ")


def test_a_driver_named_after_another_body_than_it_drives() -> None:
    document = document_of(text(kinfmu.load("crank_rocker")), "file")
    document["drivers"]["crank"]["of"] = "coupler"
    first, *_ = checked(mechanism_of(document, None))
    assert first.text == "drive crank in place of coupler"
    assert followed(mechanism_of(document, None), first) == kinfmu.load("crank_rocker")


def test_advice_on_a_file_with_repeated_parts_can_be_made_in_it() -> None:
    path = Path(__file__).parents[2] / "examples" / "scissor_lift" / "mechanism.toml"
    document: dict[str, Any] = document_of(path.read_text(), "file")
    document["bodies"]["stray"] = {"points": {"A": [0, 0]}, "start": {"x": 5.0, "y": 9.0, "phi": 0.0}}
    first, *_ = advice(document)
    assert first.edits == (Remove(("bodies", "stray")),)
    assert kinfmu.check(mechanism_of(edited(document, first.edits), None)).problem is None


def test_a_large_mechanism_is_searched_in_part() -> None:
    chain = fourbar_chain(8)
    brace = Distance("brace", ("ground.O_1", "coupler_3.P"), math.sqrt(3.0))
    first, *_ = checked(replace(chain, joints=(*chain.joints, brace)))
    assert first.edits == (Remove(("joints", "brace")),)


def test_nothing_is_advised_where_no_small_change_helps() -> None:
    linkage = fourbar(40, 1, 3.5, 3)
    report = kinfmu.check(linkage)
    assert report.problem is not None
    assert report.advice == ()


@pytest.mark.parametrize("number", range(len(KINDS)), ids=list(KINDS))
@pytest.mark.few(5)
def test_a_slip_is_undone(number: int) -> None:
    """A few slips of `tests.stress.slips`, one of each kind, drawn with a seed."""
    slip = treated(len(KINDS) * 78 + number)
    assert slip.runs[0], (slip.name, slip.texts)
