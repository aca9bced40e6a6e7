"""Marks and loads in figures."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu import (
    AngleDriver,
    Body,
    ConstantSpeed,
    DistanceDriver,
    Gear,
    Mechanism,
    RackAndPinion,
    Revolute,
    RunSettings,
    SlideDriver,
    Translational,
    load,
)
from kinfmu.arrays import FloatArray
from kinfmu.draw import animate, animation, figure
from kinfmu.draw.drawing import placed, sheet_of
from kinfmu.draw.instant import instant
from kinfmu.draw.marks import Pin, pins
from kinfmu.draw.names import LEADER
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.instant import Instant
from kinfmu.draw.scene.joints import slides
from kinfmu.draw.scene.shape import Shape
from kinfmu.draw.scene.shapes import shapes
from kinfmu.draw.scene.strokes import symbol
from kinfmu.draw.sheet import Sheet, ink
from tests.draw.picture import picture
from tests.gallery_members import every_member
from tests.mechanism.joints.test_mechanisms import crank_and_slider, quick_return
from tests.mechanism.loads.every_load import every_load
from tests.mechanism.loads.every_load import fourbar as loaded_fourbar
from tests.mechanisms import fourbar

EDGE = (0.0, 1.5)  # [pt]; that much of a text's box is above and below its letters
COVERED = 2.0  # of what is drawn, less than a pin, that a name may touch
TURN = RunSettings(0.0, 2.0 * math.pi, math.pi / 60.0)


def geared(ratio: float, *, sun: str = "ground", carrier: str = "arm") -> Mechanism:
    """Two wheels whose axles are 3 apart, on an arm or on the ground."""
    bodies = [
        Body("ground", {"O": (0, 0), "A": (3, 0)}),
        Body("arm", {"O": (0, 0), "A": (3, 0)}),
        Body("sun", {"O": (0, 0)}),
        Body("planet", {"A": (0, 0)}, (3, 0, 0)),
    ]
    joints = [
        Revolute("O", ("ground.O", "arm.O")),
        Revolute("S", (f"{carrier}.O", "sun.O")),
        Revolute("A", (f"{carrier}.A", "planet.A")),
        Gear("mesh", (sun, "planet"), ratio=ratio, carrier=carrier),
    ]
    return Mechanism("geared", bodies, joints, [AngleDriver("arm", "arm"), AngleDriver("sun", "sun")])


def drawn(shown: Instant, *kinds: str) -> list[Shape]:
    """The shapes of some kinds, in the world as drawn."""
    return [shape for shape in placed(shown, shapes(shown)) if shape.kind in kinds]


def test_a_figure_shows_the_start_pose_of_the_file() -> None:
    shown = instant(load("fourbar"))  # its law begins at 0, its bodies are at 60 degrees
    np.testing.assert_allclose(shown.point("crank.P"), [0.5, math.sqrt(0.75)], atol=1e-12)
    np.testing.assert_allclose(shown.point("coupler.A"), [2.5, math.sqrt(0.75)], atol=1e-12)
    assert shown.value("crank") == pytest.approx(math.pi / 3, abs=1e-12)
    path = shown.track("coupler.A")[1:]
    np.testing.assert_allclose(np.hypot(path[:, 0] - 2.0, path[:, 1]), 1.0, atol=1e-12)


def test_a_mechanism_far_from_the_origin_is_drawn_at_its_place() -> None:
    near, far = instant(fourbar(4.0, 1.0, 3.5, 3.0)), instant(fourbar(4.0, 1.0, 3.5, 3.0, at=(1000.0, -500.0)))
    np.testing.assert_allclose(far.track("coupler.Q") - near.track("coupler.Q"), [[1000.0, -500.0]] * 102, atol=1e-9)


def test_a_support_is_below_its_pin_or_on_a_free_side() -> None:
    standing = drawn(instant(load("fourbar")), "support")
    assert [(tuple(shape.points[0]), tuple(shape.towards)) for shape in standing] == [
        ((0.0, 0.0), (0.0, -1.0)),
        ((1.0, 0.0), (0.0, -1.0)),
        ((2.0, 0.0), (0.0, -1.0)),
    ]
    (hanging,) = drawn(instant(load("double_pendulum")), "support")
    assert tuple(hanging.towards) == (0.0, 1.0)


def test_a_rail_is_as_long_as_the_path_of_its_block() -> None:
    mechanism = crank_and_slider()
    shown = instant(Mechanism("slider", mechanism.bodies, mechanism.joints, mechanism.drivers, run=TURN))
    (rail,), (block,) = drawn(shown, "rail"), drawn(shown, "slot", "block", "die")
    dead_centres = [[math.sqrt(2.0**2 - 0.25**2), 0.25], [math.sqrt(4.0**2 - 0.25**2), 0.25]]
    np.testing.assert_allclose(rail.points, dead_centres, atol=2e-3)  # no sample of the run is exactly there
    assert tuple(rail.towards) == (0.0, -1.0)
    np.testing.assert_allclose(block.points[0], shown.point("block.S"), atol=1e-15)


def test_a_pin_runs_in_a_slot_of_its_link() -> None:
    shown = instant(replace(quick_return(0.5 * math.pi), run=TURN))
    (slot,) = drawn(shown, "slot", "block", "die")
    lengths = [np.hypot(*(end - shown.point("lever.C"))) for end in slot.points]
    np.testing.assert_allclose(sorted(lengths), [1.5, 2.5], atol=1e-9)
    (rod,) = (shape for shape in shapes(shown) if shape.kind == "rod")  # from its pivot to the end of the slot
    assert rod.frame == "lever"
    np.testing.assert_allclose(rod.points, [[0.0, 0.0], [2.5, 0.0]], atol=1e-9)
    assert drawn(shown, "rail", "bed") == []


def test_a_block_on_a_rod_is_the_body_without_extent() -> None:
    def inverted(between: tuple[str, str]) -> Mechanism:
        return Mechanism(
            "inverted",
            [
                Body("ground", {"O": (0, 0), "C": (3, 0)}),
                Body("crank", {"O": (0, 0), "P": (1, 0)}, (0, 0, 0.9)),
                Body("block", {"P": (0, 0)}, (0.6, 0.8, 2.8)),
                Body("rod", {"C": (0, 0), "E": (3.5, 0)}, (3, 0, 2.8)),
            ],
            [
                Revolute("O", ("ground.O", "crank.O")),
                Revolute("P", ("crank.P", "block.P")),
                Revolute("C", ("ground.C", "rod.C")),
                Translational("slide", between),
            ],
            [AngleDriver("crank", "crank")],
            run=TURN,
        )

    for between in (("rod.C", "block.P"), ("block.P", "rod.C")):
        (slide,) = slides(instant(inverted(between)))
        assert (slide.holder, slide.slider) == ("rod", "block")
        np.testing.assert_allclose(slide.ends, [[2.0, 0.0], [4.0, 0.0]], atol=2e-3)


@pytest.mark.parametrize(
    ("ratio", "radii"),
    [(-2.0, (2.0, 1.0)), (3.0, (4.5, 1.5)), (0.25, (1.0, 4.0))],
    ids=["outer", "planet inside", "sun inside"],
)
def test_pitch_circles_touch_and_keep_the_ratio(ratio: float, radii: tuple[float, float]) -> None:
    found = {wheel.radius: wheel.points[0] for wheel in drawn(instant(geared(ratio)), "wheel")}
    assert sorted(found) == pytest.approx(sorted(radii))
    assert tuple(found[radii[0]]) == (0.0, 0.0)
    assert found[radii[1]] == pytest.approx([3.0, 0.0])


def test_wheels_on_the_ground_that_turn_equally_have_a_belt() -> None:
    shown = instant(geared(2.0, sun="sun", carrier="arm"))
    belt = drawn(shown, "belt")
    assert len(belt) == 2
    sun, planet = sorted(drawn(shown, "wheel"), key=lambda wheel: wheel.radius)
    assert planet.radius == pytest.approx(2.0 * sun.radius)
    assert planet.radius + sun.radius < 3.0
    for a, b in (part.points for part in belt):  # each a tangent of both
        along = (b - a) / np.hypot(*(b - a))
        for wheel in (sun, planet):
            off = min((end - wheel.points[0] for end in (a, b)), key=lambda way: float(np.hypot(*way)))
            assert np.hypot(*off) == pytest.approx(wheel.radius)
            assert along @ off == pytest.approx(0.0, abs=1e-12)


def test_a_rack_touches_its_pinion_on_the_side_that_rolls() -> None:
    for radius, height in ((2.0, -2.0), (-2.0, 2.0)):
        rack = Mechanism(
            "rack",
            [
                Body("ground", {"O": (0, 0), "R": (0, height)}),
                Body("pinion", {"O": (0, 0)}),
                Body("rack", {"R": (0, 0)}, (0, height, 0)),
            ],
            [
                Revolute("O", ("ground.O", "pinion.O")),
                Translational("slide", ("ground.R", "rack.R")),
                RackAndPinion("mesh", ("ground.R", "rack.R"), "pinion", radius=radius),
            ],
            [AngleDriver("pinion", "pinion")],
        )
        shown = instant(rack)
        (teeth,) = drawn(shown, "rack")
        np.testing.assert_allclose(teeth.points[:, 1], height, atol=1e-12)
        assert tuple(teeth.towards) == pytest.approx((0.0, math.copysign(1.0, height)))
        assert drawn(shown, "slot", "block", "die") == []  # the rack is its own block


def test_drivers_are_cylinders_and_arrows_with_the_value_of_the_start() -> None:
    arm = Mechanism(
        "arm",
        [Body("ground", {"O": (0, 0), "C": (1, 0)}), Body("arm", {"O": (0, 0), "Q": (2, 0)}, (0, 0, 1.0))],
        [Revolute("O", ("ground.O", "arm.O"))],
        [DistanceDriver("cylinder", ("ground.C", "arm.Q"), ConstantSpeed(1.7, -0.1))],
        length_unit="mm",
    )
    shown = instant(arm)
    length = 1.7  # where the law starts, not where the start pose is: 1.685
    assert "cylinder = 1.7 mm" in texts(sheet_of(shown))
    assert drawn(shown, "driver") == []
    (barrel,), (shaft,) = drawn(shown, "barrel"), drawn(shown, "shaft")
    ends = [shown.point("ground.C"), shown.point("arm.Q")]
    np.testing.assert_allclose([barrel.points[0], shaft.points[1]], ends, atol=1e-12)
    assert 0.3 * length <= np.hypot(*(barrel.points[1] - barrel.points[0])) <= 0.62 * length + 1e-12

    shown = instant(fourbar(4.0, 1.0, 3.5, 3.0))
    assert "crank = 57.3°" in texts(sheet_of(shown))
    (turn,) = drawn(shown, "driver")
    np.testing.assert_allclose(turn.points, [[0.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(turn.towards, [math.cos(1.0), math.sin(1.0)], atol=1e-12)  # ahead of the crank
    (arc, _) = (points for _, points in symbol(turn, 0.01))
    assert (np.diff(np.unwrap(np.arctan2(*arc.T[::-1]))) > 0.0).all()  # the way it turns

    ram = SlideDriver("ram", ("ground.slot", "block.S"), law=ConstantSpeed(3.5, -0.1))
    (push,) = drawn(instant(crank_and_slider(drivers=(ram,))), "driver")
    np.testing.assert_allclose(push.towards, (-1.0, 0.0), atol=1e-12)


def test_a_place_is_named_once_by_its_joint_and_its_points_of_interest() -> None:
    shown = instant(load("fourbar"))
    found = {tuple(np.round(mark.at, 3)): mark for mark in pins(shown) if isinstance(mark, Pin)}
    assert [mark.text for mark in found.values()] == ["O", "C", "B", "P", "Q", "A"]
    assert {mark.kind for mark in found.values()} == {"pin"}
    shown = instant(load("double_pendulum"))  # the joint is called hinge, the points tip and hinge
    assert [mark.text for mark in pins(shown) if isinstance(mark, Pin)] == ["O", "hinge", "tip"]


@every_member
@pytest.mark.few(2)
def test_names_do_not_overlap_stay_on_the_sheet_and_leave_links_and_paths_free(name: str) -> None:
    pytest.importorskip("matplotlib")
    sheet = sheet_of(instant(load(name)))
    boxes = [text.get_window_extent() for text in sheet.axes.texts]
    for one, other in combinations(boxes, 2):
        assert not one.overlaps(other)
    page = sheet.axes.get_window_extent().expanded(1.02, 1.02)
    assert all(page.x0 < box.x0 and box.x1 < sheet.figure.bbox.x1 for box in boxes)  # right of the axes is free paper
    assert all(page.containsy(box.y0) and page.containsy(box.y1) for box in boxes)
    dots = sheet.covered
    to_world = sheet.axes.transData.inverted()
    for text in sheet.axes.texts:
        low, high = sheet.to_paper(to_world.transform(text.get_window_extent().get_points()))
        inside = (dots[:, :2] > low + EDGE) & (dots[:, :2] < high - EDGE)
        assert dots[inside.all(axis=1), 2].sum() < COVERED, text.get_text()
    leaders = [line for line in sheet.axes.patches if line.get_edgecolor()[:3] == ink(LEADER)]
    for leader in leaders:
        route = sheet.axes.transData.transform(leader.get_path().interpolated(40).vertices)
        for text in sheet.axes.texts:
            low, high = text.get_window_extent().get_points()  # one pixel is one pt
            assert not ((route > low + EDGE) & (route < high - EDGE)).all(axis=1).any(), text.get_text()


def test_far_names_have_leader_lines() -> None:
    pytest.importorskip("matplotlib")
    patches = sheet_of(instant(load("rack_steering"))).axes.patches
    assert sum(line.get_edgecolor()[:3] == ink(LEADER) for line in patches) >= 2


def test_a_list_of_names_that_does_not_fit_on_one_line_is_wrapped() -> None:
    pytest.importorskip("matplotlib")
    texts = {text.get_text() for text in sheet_of(instant(load("jansen_leg"))).axes.texts}
    assert {"X_upper,\nX_lower", "bottom, ankle"} <= texts


def test_a_clearer_pose_replaces_a_start_pose_in_which_links_hide_one_another() -> None:
    flat = crank_and_slider(offset=0.0, drivers=(AngleDriver("crank", "crank"),))
    bodies = [Body(body.name, body.points) for body in flat.bodies]
    shown = instant(Mechanism("flat", bodies, flat.joints, flat.drivers, run=TURN))
    assert 0.25 * math.pi < abs(shown.angle("crank") - shown.angle("rod")) < 0.75 * math.pi
    standing = instant(Mechanism("flat", bodies, flat.joints, flat.drivers, run=RunSettings(0.0, 0.0)))
    assert standing.angle("crank") == pytest.approx(0.0, abs=0.11)  # a run of one sample has no better


def test_a_pose_of_the_run_replaces_a_rough_start_pose_away_from_the_run() -> None:
    mechanism = fourbar(4.0, 1.0, 3.5, 3.0)
    law = AngleDriver("crank", "crank", ConstantSpeed(2.0, 1.0))
    shown = instant(Mechanism("late", mechanism.bodies, mechanism.joints, [law], run=RunSettings(0.0, 0.5)))
    assert shown.angle("crank") == pytest.approx(2.0, abs=1e-12)
    np.testing.assert_array_equal(shown.track("coupler.Q")[0], shown.track("coupler.Q")[1])


def test_a_pin_on_a_link_of_another_joint_does_not_make_a_pose_unclear() -> None:
    shown = instant(load("double_crank"))  # at 0 its crank lies on the pivot of its follower
    assert shown.angle("crank") > 0.1
    pivot, tip = shown.point("follower.C"), shown.point("crank.P")
    assert abs(tip[0] * pivot[1] - tip[1] * pivot[0]) / np.hypot(*tip) > 2.0  # [mm]


# ---------------------------------------------------------------------------------------------------------------- loads


image = pytest.importorskip("PIL.Image")
pytest.importorskip("matplotlib")
VIOLET = "#7e22ce"


def lines(sheet: Sheet) -> list[FloatArray]:
    """The lines of loads on a sheet, in the world."""
    patches = (one for one in sheet.axes.patches if hasattr(one, "get_edgecolor"))
    found = [one for one in patches if one.get_edgecolor()[:3] == ink(palette.LOAD)]
    return [np.asarray(one.get_path().vertices) for one in found]


def texts(sheet: Sheet) -> dict[str, FloatArray]:
    """The texts on a sheet with their places in the world."""
    return {text.get_text(): np.array(text.get_position()) for text in sheet.axes.texts}


def test_a_figure_names_every_load_next_to_its_symbol() -> None:
    mechanism = every_load()
    shown = instant(mechanism)
    sheet = sheet_of(shown)
    found = texts(sheet)
    wanted = {"coil", "oil", "strut", "muscle (input)", "weight = 50 N", "wind (input)", "brake = 2 N m", "clock"}
    assert wanted | {"grease"} <= set(found)
    drawn = lines(sheet)
    for name in ("coil", "strut", "weight = 50 N", "clock"):
        nearest = min(np.hypot(*(line - found[name]).T).min() for line in drawn)
        assert nearest < 45.0 * sheet.point, name
    ends = [(line[0], line[-1]) for line in drawn if len(line) > 12 and np.ptp(line, axis=0).max() > 100.0]
    (a, b) = ends[0]  # the zigzag
    np.testing.assert_allclose(a, shown.point("ground.D"), atol=1e-9)
    np.testing.assert_allclose(b, shown.point("coupler.M"), atol=1e-9)


def test_a_figure_without_loads_and_masses_has_no_symbols_and_no_gravity() -> None:
    bare = loaded_fourbar(has_gravity=True)
    massless = Mechanism(
        "bare", [kinfmu.Body(b.name, b.points, b.start) for b in bare.bodies], bare.joints, bare.drivers
    )
    sheet = sheet_of(instant(massless))
    assert lines(sheet) == []
    assert "g" not in texts(sheet)
    assert "g" in texts(sheet_of(instant(bare)))
    assert "g" not in texts(sheet_of(instant(loaded_fourbar())))


@pytest.mark.parametrize(("pull", "way"), [((0.0, -9.81), (0.0, -1.0)), ((5.0, 0.0), (1.0, 0.0))])
def test_the_arrow_of_gravity_points_its_way_in_a_free_corner(
    pull: tuple[float, float], way: tuple[float, float]
) -> None:
    sheet = sheet_of(instant(replace(loaded_fourbar(), gravity=kinfmu.mechanism.body.Gravity(*pull))))
    at = texts(sheet)["g"]
    near = [np.asarray(one.get_path().vertices) for one in sheet.axes.patches]
    arrow = [line for line in near if np.hypot(*(line - at).T).max() < 45.0 * sheet.point]
    head = next(line for line in arrow if len(line) == 4)
    shaft = next(line for line in arrow if len(line) == 2)
    np.testing.assert_allclose((head[0] - shaft[0]) / np.hypot(*(head[0] - shaft[0])), way, atol=1e-9)


def test_a_committed_kind_of_svg_has_the_violet_lines(tmp_path: Path) -> None:
    figure(kinfmu.load("toggle_press"), tmp_path / "press.svg")
    shapes = [shape for shape in picture(tmp_path / "press.svg").shapes if VIOLET in shape.look]
    assert max(len(shape.points) for shape in shapes) > 20  # the spring of the ram
    assert len(shapes) == 3  # and the two parts of the arrow of the press force
    figure(kinfmu.load("slider_crank"), tmp_path / "none.svg")
    assert VIOLET not in (tmp_path / "none.svg").read_text("utf-8")


@every_member
@pytest.mark.few(2)
def test_loads_are_the_only_violet_lines_of_the_gallery(name: str) -> None:
    mechanism = kinfmu.load(name)
    assert bool(lines(sheet_of(instant(mechanism)))) == bool(mechanism.loads)


def test_an_animation_shows_the_spring_as_it_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(animation, "MOST", 4)
    spring = '[loads.coil]\ntype = "spring"\nbetween = ["ground.E", "rocker.Q"]\nstiffness = 1\nfree_length = 0\n'
    animate(kinfmu.solve(loaded_fourbar(spring)), tmp_path / "run.gif")
    widths = []
    with image.open(tmp_path / "run.gif") as pictures:
        for k in range(pictures.n_frames):
            pictures.seek(k)
            page = np.asarray(pictures.convert("RGB"), dtype=int)
            violet = (page == np.array(palette.LOAD)).all(axis=2)
            assert violet.sum() > 50
            widths.append(int(np.ptp(np.flatnonzero(violet.any(axis=0)))))
    assert max(widths) > 1.3 * min(widths)


@pytest.mark.parametrize(("pull", "side"), [((0.0, -9.81), 1), ((0.0, 9.81), -1), ((0.0, 0.0), 0)])
@pytest.mark.few(1)
def test_an_animation_shows_the_direction_of_gravity_at_one_place(
    pull: tuple[float, float], side: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(animation, "MOST", 4)
    animate(kinfmu.solve(replace(loaded_fourbar(), gravity=kinfmu.mechanism.body.Gravity(*pull))), tmp_path / "run.gif")
    corners = []
    with image.open(tmp_path / "run.gif") as pictures:
        for k in range(pictures.n_frames):
            pictures.seek(k)
            page = np.asarray(pictures.convert("L"), dtype=int)
            corners.append(page[28:70, 10:31])  # [px] below the title, left of the letter
    for corner in corners[1:]:
        np.testing.assert_array_equal(corner, corners[0])
    rows, columns = np.nonzero(corners[0] < 200)
    assert bool(len(rows)) == bool(side)
    if side:  # the head is the widest part, at the end to which gravity pulls
        widths = {row: np.ptp(columns[rows == row]) + 1 for row in np.unique(rows)}
        widest = max(widths, key=lambda row: widths[row])
        assert np.sign(widest - 0.5 * (rows.min() + rows.max())) == side


def test_small_arrows_keep_their_colour_in_an_animation_of_many_colours(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(animation, "MOST", 4)
    animate(kinfmu.solve(kinfmu.load("excavator_loaded"), np.linspace(0.0, 5.0, 21)), tmp_path / "run.gif")
    with image.open(tmp_path / "run.gif") as pictures:
        assert (np.asarray(pictures.convert("RGB")) == np.array(palette.LOAD)).all(axis=2).sum() > 20


def test_gravity_is_left_out_where_no_corner_is_free() -> None:
    corners = {"A": (0.0, 0.0), "B": (4.0, 0.0), "C": (4.0, 3.0), "D": (0.0, 3.0)}
    plate = kinfmu.Body("plate", corners, mass=1.0)
    held = kinfmu.Revolute("A", ("ground.A", "plate.A"))
    mechanism = kinfmu.Mechanism(
        "plate",
        [kinfmu.Body("ground", {"A": (0.0, 0.0)}), plate],
        [held],
        [kinfmu.AngleDriver("plate", "plate", kinfmu.ConstantSpeed(0.0, 1.0))],
        run=kinfmu.RunSettings(0.0, 0.01),
        gravity=(0.0, -9.81),
    )
    assert "g" not in texts(sheet_of(instant(mechanism)))
