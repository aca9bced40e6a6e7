"""What operations write: names, places in frames of bodies, units, comments; what depends on what."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import pytest

from kinfmu.analysis import check
from kinfmu.errors import KinfmuError, MechanismError
from kinfmu.mechanism import gallery
from kinfmu.mechanism.gallery.load import folder
from kinfmu.mechanism.toml_text import text
from kinfmu.page.editor import Drawing, answer, changed, view
from kinfmu.page.editor.tables import references
from tests.page.editor.drawn import FOURBAR, Operation, bar, drawn, empty, ground, interest, put

LINKAGE = Path(__file__).parents[2] / "mechanism" / "imports" / "linkage" / "slider_crank.linkage2"


def text_of(name: str) -> str:
    """Return the file of a mechanism of the gallery."""
    return (folder() / name / "mechanism.toml").read_text("utf-8")


def drawing_of(name: str) -> Drawing:
    return Drawing.of(text_of(name), Path())


def test_a_fourbar_is_written_as_one_writes_it() -> None:
    assert (
        drawn(*FOURBAR).text
        == """name = "drawn"

[units]
length = "mm"

[bodies.ground]
points = { A = [0, 0], B = [100, 0] }

[bodies.crank]
points = { A = [0, 0], C = [0, 40] }
start = { x = 0, y = 0, phi = 0 }

[bodies.coupler]
points = { C = [0, 40], D = [120, 80] }
start = { x = 0, y = 0, phi = 0 }

[bodies.rocker]
points = { D = [120, 80], B = [100, 0] }
start = { x = 0, y = 0, phi = 0 }

[joints]
A = { type = "revolute", between = ["ground.A", "crank.A"] }
C = { type = "revolute", between = ["crank.C", "coupler.C"] }
D = { type = "revolute", between = ["coupler.D", "rocker.D"] }
B = { type = "revolute", between = ["ground.B", "rocker.B"] }

[drivers.motor]
type = "angle"
of = "crank"
law = "constant_speed"
start = "0 deg"
speed = "30 rpm"

[run]
start = 0
stop = 2
step = 0.01
"""
    )


@pytest.mark.parametrize("count", range(len(FOURBAR) + 1))
def test_every_state_has_a_sketch_with_the_keys_of_a_page(count: int) -> None:
    found = answer(drawn(*FOURBAR[:count]))
    full = answer(drawn(*FOURBAR))["sketch"]
    assert found["sketch"].keys() == full.keys()
    assert found["badge"]["isComplete"] == (count == len(FOURBAR))
    assert found["isViewComing"] == (count > 2)  # a view, or changes that were tried
    lines = [shape["name"] for shape in found["sketch"]["shapes"] if shape["kind"] == "link"]
    assert lines == ["crank", "coupler", "rocker"][: max(count - 2, 0)]


@pytest.mark.parametrize(
    ("operations", "mobility", "text"),
    [
        ((), 0, "nothing drawn yet"),
        ((bar((0, 0), (9, 0)),), 3, "3 more joints or drivers"),
        ((bar(("ground", 0, 0), (9, 0)),), 1, "1 more joint or driver"),
        ((*FOURBAR, {"do": "motor", "body": "rocker"}), 1, "1 driver too many"),
        ((*FOURBAR, bar("crank.C", "ground.B")), 0, "1 driver too many"),
        ((*FOURBAR[:-1], bar("crank.C", "ground.B")), 0, "a structure: nothing moves"),
        ((*FOURBAR,), 1, "complete"),
    ],
)
def test_the_badge_sets_mobility_against_drivers(operations: tuple[Operation, ...], mobility: int, text: str) -> None:
    badge = answer(drawn(*operations))["badge"]
    assert (badge["mobility"], badge["text"]) == (mobility, text)


def test_what_is_missing_can_be_added_by_the_operations_of_a_finding() -> None:
    drawing = drawn(*FOURBAR[:-1])
    (finding,) = answer(drawing)["findings"]
    assert finding["kind"] == "problem"
    assert [edit["text"] for edit in finding["edits"]] == ["add a motor to crank", "add a motor to rocker"]
    for edit in finding["edits"]:
        assert answer(changed(drawing, edit["operations"]))["badge"]["isComplete"]


def test_points_in_one_place_that_are_not_joined_are_pinned_by_a_finding() -> None:
    drawing = drawn(bar(("ground", 0, 0), (30, 0), "a"), bar((30, 0), (50, 20), "b"))
    (note,) = (finding for finding in answer(drawing)["findings"] if finding["kind"] == "note")
    assert note["text"] == "a.B and b.C are in one place and not joined"
    after = changed(drawing, note["edits"][0]["operations"])
    assert [joint.between for joint in after.mechanism.joints] == [("ground.A", "a.A"), ("a.B", "b.C")]


def test_a_pin_that_is_dropped_next_to_its_partner_comes_first_also_among_what_was_tried() -> None:
    drawing = drawn(*FOURBAR[:4], bar((123, 78), "ground.B", "rocker"))
    pin = {"text": "pin coupler.D and rocker.E", "operations": [{"do": "pin", "points": ["coupler.D", "rocker.E"]}]}
    for found in (answer(drawing), view(drawing)):
        problem, note, *_ = found["findings"]
        assert problem["edits"][0] == pin
        assert (note["text"], note["edits"]) == ("coupler.D and rocker.E are 3.6 mm apart and not joined", [pin])
    assert found["view"] is None
    _, tried, *_ = problem["edits"]
    assert tried["text"].startswith("join coupler.D and rocker.E and drive crank: ")
    assert answer(changed(drawing, tried["operations"]))["badge"]["isComplete"]
    after = changed(drawing, pin["operations"])  # type: ignore[arg-type]
    assert after.at("coupler.D") == after.at("rocker.E") == (120, 80)


def test_what_an_import_has_left_out_is_a_finding_as_long_as_the_file_has_it() -> None:
    text = LINKAGE.read_text("utf-8").replace("</linkage2>", "<mystery/></linkage2>")
    imported = changed(empty(), [{"do": "replace", "text": text, "name": LINKAGE.name}])
    for found in (answer(imported), view(imported)):
        notes = [one["text"] for one in found["findings"] if one["text"].startswith("import: ")]
        assert notes
        assert any("mystery" in note for note in notes)
    assert not [one for one in answer(drawn(*FOURBAR))["findings"] if one["text"].startswith("import: ")]


@pytest.mark.parametrize("kind", ["roller", "flat_face"])
@pytest.mark.parametrize("follower", ["lever", "tappet"])
def test_a_cam_as_it_is_drawn_can_be_made(kind: str, follower: str) -> None:
    lever = (bar(("ground", 90, 0), (25, 45), "lever"),)
    slider = {"do": "slider", "point": "tappet.C", "along": [0, 1], "block": True}
    tappet = (bar((0, 50), (0, 90), "tappet"), slider)
    drawing = drawn(
        bar(("ground", 0, 0), (20, 0), "cam"),
        *(lever if follower == "lever" else tappet),
        {"do": "cam", "body": "cam", "follower": "lever.D" if follower == "lever" else "tappet.C", "kind": kind},
        {"do": "motor", "body": "cam"},
    )
    assert check(drawing.mechanism).problem is None
    assert "cam" in {shape["kind"] for shape in answer(drawing)["sketch"]["shapes"]}


def test_a_large_mechanism_is_answered_too() -> None:
    large = Drawing.of(text(gallery.load("fourbar_chain:150"), as_written=True), Path())
    assert answer(large)["badge"]["isComplete"]
    badge = answer(changed(large, [bar((1, 2), (3, 4))]))["badge"]
    assert (badge["text"], badge["isComplete"]) == ("cannot be solved", False)


@pytest.mark.parametrize("name", gallery.names())
@pytest.mark.few(8)
def test_files_of_the_gallery_are_edited_without_another_change(name: str) -> None:
    drawing = drawing_of(name)
    longer = changed(drawing, [bar((1, 2), (3, 4)), {"do": "delete", "place": ["bodies", "link_1"]}])
    assert longer.text == drawing.text
    comments = [line for line in drawing.text.splitlines() if "#" in line]
    added = drawn(bar((1, 2), (3, 4), "added"), begin=drawing)
    assert [line for line in added.text.splitlines() if "#" in line] == comments
    assert tomllib.loads(added.text)["bodies"].keys() == {*tomllib.loads(drawing.text)["bodies"], "added"}


@pytest.mark.parametrize("name", gallery.names())
@pytest.mark.few(6)
def test_a_moved_pin_moves_all_that_is_held_there_and_no_body(name: str) -> None:
    drawing = drawing_of(name)
    pins = [point for point, group in drawing.pins.items() if len(group) > 1 and not point.startswith("ground")]
    for point in pins[:3]:
        x, y = drawing.at(point)
        by = 0.01 * drawing.size
        try:
            moved = changed(drawing, [{"do": "move", "point": point, "to": [x + by, y + 0.5 * by]}])
        except MechanismError as refusal:
            assert "set its parameters, or put a number there" in str(refusal)  # noqa: PT017
            continue
        for body, pose in drawing.poses.items():
            assert math.dist(moved.poses[body], pose) < 1e-8 * max(1.0, drawing.size)
        places = {moved.at(one) for one in drawing.pins[point]}
        assert all(math.dist(place, moved.at(point)) < 1e-9 * drawing.size for place in places)


def test_the_lengths_of_bars_and_cylinders_follow_a_moved_pin() -> None:
    drawing = drawn(
        bar(("ground", 0, 0), (30, 0), "arm"),
        {"do": "cylinder", "from": {"at": [0, -40]}, "to": {"point": "arm.B"}},
        {"do": "move", "point": "arm.B", "to": [30, 40]},
    )
    assert drawing.document["drivers"]["cylinder_1"]["start"] == pytest.approx(math.hypot(30, 80), rel=1e-14)
    assert answer(drawing)["badge"]["isComplete"]


def test_numbers_keep_their_units_and_parameters_are_not_overwritten() -> None:
    text = drawn(*FOURBAR).text.replace("C = [0, 40] }", 'C = [0, "4 cm"] }').replace("C = [0, 40]", 'C = [0, "4 cm"]')
    drawing = drawn({"do": "move", "point": "crank.C", "to": [5, 45]}, begin=Drawing.of(text, Path()))
    assert 'C = [5, "4.5 cm"]' in drawing.text
    with_parameter = text.replace('"4 cm"', '"height"').replace("[units]", "[parameters]\nheight = 40\n\n[units]")
    with pytest.raises(MechanismError, match=r"\[bodies\.crank\] points\.C is 'height': set its parameters"):
        drawn({"do": "move", "point": "crank.C", "to": [5, 45]}, begin=Drawing.of(with_parameter, Path()))


def test_a_slider_that_is_moved_takes_its_line_along() -> None:
    begin = (bar(("ground", 0, 0), (30, 0), "crank"), bar("crank.B", (120, 0), "rod"))
    slider = {"do": "slider", "point": "rod.C", "along": [1, 0]}
    drawing = drawn(*begin, slider, {"do": "motor", "body": "crank"}, {"do": "move", "point": "rod.C", "to": [110, 15]})
    assert drawing.at("rod.C") == drawing.at("ground.C") == (110, 15)
    assert answer(drawing)["badge"]["isComplete"]


SLIDER_CRANK = (
    bar(("ground", 0, 0), (30, 0), "crank"),
    bar("crank.B", (120, 40), "rod"),
    {"do": "slider", "point": "rod.C", "along": [1, 1]},
    {"do": "motor", "body": "crank"},
)
LEVER = (
    bar(("ground", 0, 100), (40, 100), "crank"),
    bar(("ground", 0, 0), (80, 200), "lever"),
    {"do": "slot", "point": "crank.B", "body": "lever", "from": [0, 0], "to": [80, 200]},
    {"do": "motor", "body": "crank"},
)
YOKE = (
    bar(("ground", 0, 0), (40, 0), "crank"),
    bar((40, -60), (40, 60), "yoke"),
    {"do": "slot", "point": "crank.B", "body": "yoke", "from": [40, -60], "to": [40, 60]},
    {"do": "slider", "point": {"body": "yoke", "at": [40, -20]}, "along": [1, 0], "block": True},
    {"do": "motor", "body": "crank"},
)


def length(a: str, b: str, value: float) -> Operation:
    return {"do": "length", "between": [a, b], "value": value}


@pytest.mark.parametrize("ends", [("rod.B", "rod.C"), ("rod.C", "rod.B")])
def test_a_typed_length_moves_the_slider_and_not_its_rail(ends: tuple[str, str]) -> None:
    before = drawn(*SLIDER_CRANK)
    after = drawn(length(*ends, 110), begin=before)
    assert math.dist(after.at("rod.B"), after.at("rod.C")) == pytest.approx(110, rel=1e-12)
    for point in ("ground.C", "crank.B"):
        assert after.at(point) == before.at(point)
    (x, y), (x0, y0) = after.at("rod.C"), after.at("ground.C")
    assert y - y0 == pytest.approx(x - x0, abs=1e-9)
    assert answer(after)["badge"]["isComplete"]


def test_a_typed_length_moves_the_end_that_is_not_on_the_ground() -> None:
    after = drawn(length("rocker.D", "rocker.B", 90), begin=drawn(*FOURBAR))
    assert after.at("rocker.B") == (100, 0)
    assert math.dist(after.at("rocker.D"), (100, 0)) == pytest.approx(90, rel=1e-12)


def test_a_typed_length_moves_a_pin_along_its_slot_or_the_slot_if_nothing_else_holds_it() -> None:
    before = drawn(*LEVER)
    after = drawn(length("crank.A", "crank.B", 50), begin=before)
    assert math.dist(after.at("crank.A"), after.at("crank.B")) == pytest.approx(50, rel=1e-12)
    assert [after.at(f"lever.{name}") for name in "CD"] == [before.at(f"lever.{name}") for name in "CD"]
    yoke = drawn(*YOKE, length("crank.A", "crank.B", 30))
    assert yoke.at("crank.B") == (30, 0)
    assert [yoke.at(f"yoke.{name}") for name in "CDE"] == [(30, -60), (30, 60), (30, -20)]
    assert answer(after)["badge"]["isComplete"]
    assert answer(yoke)["badge"]["isComplete"]


@pytest.mark.parametrize(
    ("operation", "text"),
    [
        (
            length("crank.A", "crank.B", 20),
            "length: crank.B slides on the line of joint 'B', 37.1391 mm from crank.A; move that line first",
        ),
        (
            {"do": "move", "point": "crank.B", "to": [50, 100], "exact": True},
            "move: crank.B slides on a line, on which 41.3793, 103.448 is the nearest place; move that line first",
        ),
    ],
)
def test_what_is_typed_and_a_line_forbids_is_one_line(operation: Operation, text: str) -> None:
    with pytest.raises(MechanismError) as raised:
        drawn(operation, begin=drawn(*LEVER))
    assert str(raised.value) == text


@pytest.mark.parametrize(
    "slide",
    [
        {"do": "slider", "point": "crank.C", "on": "lever", "along": [2, 5]},
        {"do": "slot", "point": "crank.C", "body": "lever", "from": [0, 0], "to": [80, 200]},
    ],
    ids=["slider", "slot"],
)
def test_a_pin_that_is_to_slide_along_its_own_link_is_freed_from_it(slide: Operation) -> None:
    drawing = drawn(bar((0, 0), (80, 200), "lever"), bar((0, 100), ("lever", 40, 100), "crank"), slide)
    assert [joint.type for joint in drawing.mechanism.joints] == ["point_on_line"]
    assert drawn_lines(drawing, "slot") == [([[0, 0], [80, 200]], None)]


def drawn_lines(drawing: Drawing, kind: str) -> list[Any]:
    """Return the points and the directions of the shapes of a kind."""
    shapes = [shape for shape in answer(drawing)["sketch"]["shapes"] if shape["kind"] == kind]
    return [(shape["points"], shape.get("direction")) for shape in shapes]


def test_slots_are_drawn_from_end_to_end_and_sliders_along_their_rails() -> None:
    assert drawn_lines(drawn(*LEVER), "slot") == [([[0, 0], [80, 200]], None)]
    assert drawn_lines(drawn(*YOKE), "slot") == [([[40, -60], [40, 60]], None)]
    ((_, direction),) = drawn_lines(drawn(*SLIDER_CRANK), "die")
    assert direction == pytest.approx([math.sqrt(0.5)] * 2, abs=1e-6)
    along = {"do": "slider", "point": "crank.B", "on": "lever", "along": [2, 5]}
    assert drawn_lines(drawn(*LEVER[:2], along), "slot") == [([[0, 0], [80, 200]], None)]
    on_ground = {"do": "slot", "point": "crank.B", "body": "ground", "from": [20, 100], "to": [70, 100]}
    ((ends, _),) = drawn_lines(drawn(LEVER[0], on_ground), "rail")
    assert ends == [[20, 100], [70, 100]]


@pytest.mark.parametrize(
    ("foot", "rise"), [((0, -60), 29), ((-50, 0), -24), ((-90, -68), -41)], ids=["free", "near", "next to it"]
)
def test_the_stroke_of_a_cylinder_stays_away_from_a_dead_centre(foot: tuple[float, float], rise: float) -> None:
    arm = (100, 0) if rise > 0 else (40, 30)
    to = {"do": "cylinder", "from": {"at": list(foot)}, "to": {"point": "arm.B"}}
    drawing = drawn(bar(("ground", 0, 0), arm, "arm"), to)
    assert drawing.document["drivers"]["cylinder_1"]["rise"] == rise
    assert check(drawing.mechanism).notes == ()


def test_a_second_pin_at_a_place_has_the_next_letter() -> None:
    drawing = drawn(*FOURBAR[:4], bar("crank.C", (60, -20)))
    assert [joint.name for joint in drawing.mechanism.joints] == ["A", "C", "F"]


def test_pins_that_are_apart_are_brought_together() -> None:
    drawing = drawn(
        bar(("ground", 0, 0), (30, 0), "a"), bar((50, 0), (80, 0), "b"), {"do": "pin", "points": ["a.B", "b.C"]}
    )
    assert drawing.at("a.B") == drawing.at("b.C") == (30, 0)


@pytest.mark.parametrize("name", gallery.names())
@pytest.mark.few(6)
def test_a_deleted_body_takes_all_that_depends_on_it(name: str) -> None:
    drawing = drawing_of(name)
    for body in drawing.mechanism.moving_bodies:
        after = changed(drawing, [{"do": "delete", "place": ["bodies", body.name]}])
        members = (getattr(after.mechanism, table) for table in ("joints", "drivers", "loads"))
        named = {reference for table in members for member in table for reference in references(member)}
        named |= {*after.mechanism.points.values()}
        assert body.name not in {reference.partition(".")[0] for reference in named}
        answer(after)


@pytest.mark.parametrize("name", gallery.names())
@pytest.mark.few(6)
def test_a_renamed_member_is_renamed_wherever_it_is_named(name: str) -> None:
    drawing = drawing_of(name)
    mechanism = drawing.mechanism
    body = mechanism.moving_bodies[-1]
    places = [["bodies", body.name], ["bodies", body.name, "points", next(iter(body.points))]]
    for table in ("joints", "drivers", "loads"):
        places += [[table, member.name] for member in getattr(mechanism, table)[:1]]
    places += [["points", point] for point in list(mechanism.points)[:1]]
    for place in places:
        there = changed(drawing, [{"do": "rename", "place": place, "name": "renamed"}])
        back = changed(there, [{"do": "rename", "place": [*place[:-1], "renamed"], "name": place[-1]}])
        assert there.text != drawing.text
        assert back.text == drawing.text
        assert len(there.mechanism.joints) == len(mechanism.joints)


def test_values_set_in_the_page_are_written_where_they_are() -> None:
    drawing = drawing_of("engine")
    numbers = {
        ".".join(map(str, (*place[:-1], "xy"[place[-1]] if isinstance(place[-1], int) else place[-1]))): float(value)
        for place, value, _ in drawing.mechanism.members.numbers()
        if "law" not in place and place not in drawing.mechanism.expressions
    }
    assert changed(drawing, [{"do": "values", "values": numbers}]).text == drawing.text
    driver = drawing.mechanism.drivers[0].name
    faster = changed(drawing, [{"do": "values", "values": {f"{driver}.speed": 7.5}}])
    assert float(faster.mechanism.drivers[0].law.speed) == pytest.approx(7.5, rel=1e-14)
    with pytest.raises(MechanismError, match=r"values: there is no number 'crank\.sped'"):
        changed(drawing, [{"do": "values", "values": {"crank.sped": 1}}])


def test_values_that_turn_bodies_leave_the_file_closed_in_the_drawn_pose() -> None:
    drawing = drawn(*FOURBAR)
    other = changed(drawing, [{"do": "values", "values": {"bodies.crank.points.C.y": 45}}])
    starts = {body.name: body.start for body in other.mechanism.moving_bodies}
    assert starts["crank"].phi == 0.0
    assert starts["coupler"].phi == pytest.approx(other.poses["coupler"][2], abs=1e-12)
    assert starts["coupler"].phi != 0.0
    assert other.at("crank.C") == pytest.approx(other.at("coupler.C"), abs=1e-9)


def test_files_and_links_of_other_programs_can_take_the_place_of_the_text() -> None:
    drawing = changed(empty(), [{"do": "replace", "text": LINKAGE.read_text("utf-8"), "name": LINKAGE.name}])
    assert drawing.mechanism.moving_bodies
    with pytest.raises(MechanismError, match=r"x\.dxf: is not a link of PMKS\+") as raised:
        changed(empty(), [{"do": "replace", "text": "0\n", "name": "x.dxf"}])
    assert "\n" not in str(raised.value)


def test_operations_on_repeated_parts_point_to_the_text() -> None:
    text = """name = "chain"
counts = { n = 2 }

[repeat.k]
to = "n"
bodies."left_{k}".points = { A = [0, 0], B = [1, 0] }
"""
    drawing = Drawing.of(text, Path())
    operations: tuple[dict[str, Any], ...] = (
        {"do": "point", "body": "left_1", "at": [0.5, 1]},
        {"do": "move", "point": "left_1.B", "to": [2, 0]},
        {"do": "values", "values": {"bodies.left_1.points.B.x": 2}},
        {"do": "delete", "place": ["bodies", "left_1"]},
        {"do": "rename", "place": ["bodies", "left_1"], "name": "x"},
    )
    for operation in operations:
        with pytest.raises(MechanismError, match=r"in a repeated part|of a repeated part|is not in the file"):
            changed(drawing, [operation])
    assert "[bodies.link_1]" in changed(drawing, [bar("left_1.B", (2, 2))]).text


def test_joints_in_tables_of_their_own_get_another_one() -> None:
    text = drawn(*FOURBAR[:3]).text
    head, _, _ = text.partition("[joints]")
    table = '[joints.A]\ntype = "revolute"  # a pin\nbetween = ["ground.A", "crank.A"]\n'
    after = drawn(FOURBAR[3], begin=Drawing.of(head + table, Path()))
    assert table in after.text
    assert {joint.name for joint in after.mechanism.joints} == {"A", "C"}


def test_a_list_of_operations_is_made_whole_or_not_at_all() -> None:
    drawing = drawn(*FOURBAR)
    with pytest.raises(KinfmuError, match="there is no body 'none'"):
        changed(drawing, [ground(5, 5), put("title", value="x"), {"do": "motor", "body": "none"}])
    assert drawing.text == drawn(*FOURBAR).text


def test_a_point_of_interest_gets_the_name_of_its_point() -> None:
    drawing = drawn(
        *FOURBAR, interest("coupler.D", "tip"), {"do": "interest", "at": {"body": "coupler", "at": [50, 90]}}
    )
    assert dict(drawing.mechanism.points) == {"tip": "coupler.D", "E": "coupler.E"}
