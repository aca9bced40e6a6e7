"""What is drawn of a mechanism: bodies, outlines, details and colours."""

from __future__ import annotations

import dataclasses
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.draw.overlay import MOST_CURVES, curve_colour
from kinfmu.draw.scene import palette, strokes
from kinfmu.draw.scene.placing import recomputed, world
from kinfmu.draw.scene.scene import Scene, drawable
from kinfmu.draw.scene.shape import Shape, ribs, rim
from kinfmu.errors import KinfmuError
from kinfmu.run import Run
from kinfmu.run.continued import continued
from kinfmu.run.driving import run_times
from tests.log.runs import DEGREE
from tests.test_every_way import LENGTHS, TIMES, linkage, side
from tests.test_every_way import drawn as drawn_lengths


@pytest.fixture
def fourbar_scene(run: Run) -> Scene:
    return everything_drawn(run)


def everything_drawn(run: Run) -> Scene:
    found, note = drawable(run)
    assert found
    assert not note
    return found


def test_bodies_have_the_poses_of_their_coordinates_and_constants(fourbar_scene: Scene, run: Run) -> None:
    assert fourbar_scene.bodies == {"crank": 0, "coupler": 1, "rocker": 2}
    crank, coupler, rocker = (fourbar_scene.frames[body] for body in fourbar_scene.bodies)
    phi = DEGREE * run.t
    tip = np.column_stack([np.cos(phi), np.sin(phi)])
    np.testing.assert_allclose(world(crank, (1.0, 0.0)), tip, atol=1e-15)
    np.testing.assert_allclose(world(coupler, (-1.0, 0.0)), tip, atol=1e-15)
    np.testing.assert_allclose(world(rocker, (1.0, 0.0)), tip + np.array([1.0, 0.0]), atol=1e-15)


def test_the_bar_keeps_its_length(fourbar_scene: Scene) -> None:
    (bar,) = (shape for shape in fourbar_scene.shapes if shape.kind == "bar")
    assert bar.name == "AB"
    np.testing.assert_array_equal(bar.points, [[0.0, 0.0], [1.0, 0.0]])
    ends = [world(fourbar_scene.frames[bar.frame], (x, y)) for x, y in bar.points]
    np.testing.assert_allclose(ends[1], world(fourbar_scene.frames["coupler"], (1.0, 0.0)), atol=1e-14)
    np.testing.assert_allclose(ends[0], np.tile([2.0, 0.0], (len(ends[0]), 1)), atol=1e-14)


def test_supports_are_the_points_of_the_ground_that_joints_use(fourbar_scene: Scene) -> None:
    found = {name: tuple(at) for name, at in fourbar_scene.supports.items()}
    assert found == {"O": (0.0, 0.0), "C": (1.0, 0.0), "B": (2.0, 0.0)}


def test_a_revolute_joint_is_one_pin_and_a_bar_has_two(fourbar_scene: Scene) -> None:
    pins = [pin for found in fourbar_scene.pins.values() for pin in found]
    assert sorted(name for name, _ in pins) == ["AB", "AB", "C", "O", "P", "Q"]


def test_the_path_is_the_motion_of_the_point_of_interest(fourbar_scene: Scene, run: Run) -> None:
    np.testing.assert_allclose(fourbar_scene.paths["A"], np.column_stack([run["A.x"], run["A.y"]]), atol=1e-15)


def test_the_bounds_hold_everything(fourbar_scene: Scene) -> None:
    np.testing.assert_allclose(fourbar_scene.low, [-1.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(fourbar_scene.high, [3.0, 1.0], atol=1e-15)


def test_poses_in_a_gap_are_unknown_even_where_coordinates_are_constant(run_with_gap: Run) -> None:
    found, _ = drawable(run_with_gap)
    assert found
    assert np.isnan(found.frames["crank"][100:121]).all()
    assert np.isfinite(found.high).all()


def test_a_body_whose_coordinates_are_not_in_the_run_is_left_out_by_name(run: Run) -> None:
    found, note = drawable(run.without(["coupler.x", "coupler.y"]))
    assert found
    assert [*found.bodies] == ["crank", "rocker"]
    assert {shape.frame for shape in found.shapes} == {"ground", "crank", "rocker"}
    assert note == (
        "Not drawn: coupler (the run does not hold coupler.x, coupler.y); "
        "keep them: --channels all, or q among its names."
    )


@pytest.mark.parametrize("name", ["crank_rocker", "fourbar", "parallel_jaw", "five_bar", "cam_roller", "excavator"])
@pytest.mark.few(2)
def test_a_run_of_few_outputs_is_drawn_as_one_of_all(name: str) -> None:
    mechanism = kinfmu.load(name)
    whole = solved(name)
    few = whole.names[-1:]
    for less in (
        kinfmu.solve(dataclasses.replace(mechanism, coordinates=few), whole.t),
        kinfmu.solve(mechanism, whole.t, outputs=few),
    ):
        assert set(less.outputs) < set(whole.outputs)
        check_equal_poses(less, whole)


def check_equal_poses(run: Run, expected: Run) -> None:
    """Check that everything of a run is drawn, in the poses of another run."""
    found, wanted = everything_drawn(run), everything_drawn(expected)
    assert found.frames.keys() == wanted.frames.keys()
    for frame, pose in found.frames.items():
        np.testing.assert_allclose(pose, wanted.frames[frame], atol=1e-9 * wanted.size)


def test_a_run_of_few_outputs_is_drawn_with_its_own_parameters() -> None:
    mechanism = kinfmu.load("jansen_leg")
    name, value = next((n, 1.02 * float(p.value)) for n, p in mechanism.parameters.items() if p.expression is None)
    whole = kinfmu.solve(mechanism, [0.0, 0.1], parameters={name: value})
    few = kinfmu.solve(mechanism, [0.0, 0.1], parameters={name: value}, outputs=whole.names[-1:])
    of_fmu = dataclasses.replace(
        few, mechanism_source=mechanism, info={"parameters": f"crank.speed = 1.0, {name} = {value!r}"}
    )
    for run in (few, of_fmu):
        check_equal_poses(run, whole)


def test_recomputed_bodies_that_contradict_the_run_are_left_out_with_the_remedy() -> None:
    run = kinfmu.solve(kinfmu.load("crank_rocker"), [0.0, 0.1], outputs=["rocker.phi"])
    other = dataclasses.replace(run, values=run.values + 0.1)
    _, note = drawable(other)
    assert note.endswith("; name them in [outputs] coordinates, or leave that out.")


def test_a_run_without_a_valid_mechanism_is_not_drawn(run: Run) -> None:
    assert drawable(dataclasses.replace(run, mechanism_source="")) == (
        None,
        "Not drawn: the run does not hold its mechanism.",
    )
    found, note = drawable(dataclasses.replace(run, mechanism_source="name = ["))
    assert found is None
    assert note.startswith("Not drawn: the run's mechanism: not valid TOML")


def solved(name: str) -> Run:
    mechanism = kinfmu.load(name)
    return kinfmu.solve(mechanism, run_times(mechanism.run)[::4])


def drawn(name: str) -> tuple[Scene, Run]:
    run = solved(name)
    return everything_drawn(run), run


def placed(scene: Scene, frame: str, kind: str) -> np.ndarray:
    """World coordinates (n, k, 2) of the line of the only shape of a kind in a frame."""
    (line,) = (shape.line for shape in scene.shapes if (shape.frame, shape.kind) == (frame, kind))
    return np.stack([world(scene.frames[frame], (x, y)) for x, y in line], axis=1)


def test_the_roller_touches_the_cam_over_the_whole_run() -> None:
    found, _ = drawn("cam_roller")
    profile, roller = placed(found, "cam", "cam"), placed(found, "lever", "roller")
    centre = roller[:, :-1].mean(axis=1)
    radius = np.hypot(*(roller[0, 0] - centre[0]))
    assert np.isfinite(roller).all()
    gaps = np.hypot(*np.moveaxis(profile - centre[:, None], 2, 0)).min(axis=1) - radius
    assert np.abs(gaps).max() < 0.02 * radius  # the profile has a corner each degree


def test_wheels_touch_while_they_turn() -> None:
    found, _ = drawn("geared_five_bar")
    rims = [placed(found, body, "wheel") for body in [*found.bodies][:2]]
    centres = [rim[:, :-1].mean(axis=1) for rim in rims]
    radii = [np.hypot(*(rim[:, 0] - centre).T) for rim, centre in zip(rims, centres, strict=True)]
    np.testing.assert_allclose(np.hypot(*(centres[1] - centres[0]).T), sum(radii), rtol=1e-9)


def test_cylinders_span_their_points_and_hold_their_rods() -> None:
    found, run = drawn("excavator")
    barrels, shafts = ([shape for shape in found.shapes if shape.kind == kind] for kind in ("barrel", "shaft"))
    assert [barrel.name for barrel in barrels] == ["boom_cylinder", "stick_cylinder", "bucket_cylinder"]
    for barrel, shaft in zip(barrels, shafts, strict=True):
        start, end = found.frames[barrel.frame], found.frames[shaft.frame]
        np.testing.assert_array_equal(start[:, 2], end[:, 2])
        lengths = np.hypot(*(end - start)[:, :2].T)
        np.testing.assert_allclose(lengths, run[f"{barrel.name}_length"], rtol=1e-12)
        within = lengths + shaft.points[0, 0]  # where the rod begins, from the barrel's pin
        assert within.min() > 0.0
        assert within.max() < barrel.points[1, 0] < lengths.min()
    assert {"O", "boom_foot"} == set(found.supports)


def test_slides_have_rails_blocks_and_slots_but_no_pin_on_their_line() -> None:
    found, _ = drawn("inverted_slider_crank")
    kinds = {shape.kind for shape in found.shapes}
    assert kinds == {"link", "rod", "block", "rail", "support", "driver"}
    assert "way" not in found.supports
    assert {shape.kind for shape in drawn("scotch_yoke")[0].shapes} >= {"rod", "slot", "block", "rail"}


def test_the_block_of_a_pin_on_a_line_of_the_ground_moves_with_the_pin_and_does_not_turn() -> None:
    found, run = drawn("offset_slider_crank")
    (die,) = (shape for shape in found.shapes if shape.kind == "die")
    pose = found.frames[die.frame]
    np.testing.assert_allclose(pose[:, :2], found.paths["slider"], atol=1e-9)
    assert not pose[:, 2].any()
    assert len(pose) == len(run)


# ------------------------------------------------------------------------------------------------------------- strokes


DOWN = np.array([0.0, -1.0])


def shape(kind: str, *points: tuple[float, float], direction: np.ndarray = DOWN) -> Shape:
    strips = {
        "support": strokes.support,
        "block": strokes.block,
        "rack": lambda: strokes.rack(10.0, 0.1),
    }.get(kind, lambda: strokes.rail(kind, 6.0, 0.1))()
    return Shape(kind, "name", "ground", np.array(points), direction=direction, strips=strips)


def lines(one: Shape, size: float = 0.1) -> dict[str, np.ndarray]:
    """The lines of a symbol by their row in the table of strokes."""
    return {strip.stroke: points for strip, points in strokes.symbol(one, size)}


@pytest.mark.parametrize("size", [0.01, 0.5])
def test_hatching_is_below_the_whole_line(size: float) -> None:
    found = lines(shape("rail", (4.0, 1.0), (-2.0, 1.0)), size)  # drawn to the right or to the left
    tops, ends, again = found["hatch"].reshape(-1, 3, 2).swapaxes(0, 1)
    np.testing.assert_array_equal(tops, again)
    np.testing.assert_allclose(tops[:, 1], found["ground"][0, 1])
    assert (ends[:, 1] < tops[:, 1]).all()
    gaps = np.diff(np.sort([*found["ground"][:, 0], *tops[:, 0]]))
    assert gaps.max() < 2.0 * np.median(gaps)


def test_a_rail_is_as_far_from_its_line_as_its_block_is_wide() -> None:
    line = lines(shape("rail", (0.0, 1.0), (5.0, 1.0)))["ground"]
    np.testing.assert_allclose(line[:, 1], 1.0 - 0.1 * strokes.BLOCK_WIDTH)
    assert np.ptp(line[:, 0]) > 5.0 + 2.0 * 0.1 * strokes.BLOCK
    assert lines(shape("bed", (0.0, 1.0), (5.0, 1.0)))["ground"][0, 1] < line[0, 1]


@pytest.mark.parametrize("towards", [(0.0, -1.0), (1.0, 0.0), (-0.6, 0.8)])
def test_a_support_ends_at_its_line_with_the_pin_at_its_tip(towards: tuple[float, float]) -> None:
    direction = np.array(towards)
    found = lines(shape("support", (2.0, 3.0), direction=direction))
    triangle, line = found["support"], found["ground"]
    np.testing.assert_array_equal(triangle[0], [2.0, 3.0])
    for point in (*triangle[1:], *line):
        assert (point - triangle[0]) @ direction == pytest.approx(0.1 * strokes.SUPPORT)
    np.testing.assert_allclose(line.mean(axis=0), triangle[1:].mean(axis=0))


def test_teeth_are_on_both_sides_of_the_pitch_line_and_the_back_on_that_of_the_direction() -> None:
    corners = lines(shape("rack", (0.0, 0.0), (10.0, 0.0)))["rack"]
    assert 0.0 < corners[:, 1].max() < -corners[:, 1].min()
    assert np.ptp(corners[:, 0]) == pytest.approx(10.0)


def test_a_shape_without_direction_is_reported() -> None:
    with pytest.raises(TypeError, match="a shape of kind 'link' has no direction"):
        _ = Shape("link", "crank", "crank", np.zeros((2, 2))).towards


def test_the_piston_of_a_cylinder_stays_in_its_barrel() -> None:
    found, excavated = drawn("excavator")
    for barrel in (one for one in found.shapes if one.kind == "barrel"):
        (shaft,) = (one for one in found.shapes if one.kind == "shaft" and one.name == barrel.name)
        assert [strip.stroke for strip in shaft.strips] == ["shaft", "piston"]
        first, last = (found.frames[frame][:, :2] for frame in (barrel.frame, shaft.frame))
        place = np.hypot(*(last - first).T) + shaft.points[0, 0]
        assert place.min() > 0.1 * barrel.points[1, 0]
        assert place.max() < 0.95 * barrel.points[1, 0]
    assert len(excavated)


def test_strokes_of_a_body_are_painted_together_its_edges_first() -> None:
    found, _ = drawn("scotch_yoke")
    painted = strokes.strokes_of(found.shapes, found.sizes)
    orders = [one.stroke.order for one in painted]
    assert orders == sorted(orders)
    yoke = [(one.key, one.stroke.line) for one in painted if one.shape.is_bar or one.shape.kind == "link"]
    assert {key for key, _ in yoke} <= {"plate", "arm", "link"}
    for body in found.bodies:
        roles = [one.stroke.line for one in painted if one.shape.frame == body and one.key in ("plate", "arm", "link")]
        assert roles == sorted(roles)  # 'edge', then 'fill'
    assert painted[0].colours()[0] == palette.tint(painted[0].stroke.line, painted[0].shape.colour)


def test_every_row_of_the_table_has_roles_of_the_palette_and_widths_that_are_seen() -> None:
    for rows in strokes.STROKES.values():
        for row in rows:
            assert {row.line, row.fill or row.line} <= palette.ROLES.keys()
            assert row.width + strokes.BAR * row.of_link > 0.0
    assert strokes.look()["strokes"].keys() == strokes.STROKES.keys()


def test_a_placed_shape_turns_with_its_frame() -> None:
    placed = shape("block", (1.0, 0.0), direction=np.array([1.0, 0.0])).placed(
        {"ground": np.array([2.0, 3.0, np.pi / 2])}
    )
    np.testing.assert_allclose(placed.points, [[2.0, 4.0]], atol=1e-15)
    np.testing.assert_allclose(placed.towards, [0.0, 1.0], atol=1e-15)


# ----------------------------------------------------------------------------------------------------------- completing


def test_a_run_with_parameters_set_is_completed_on_its_own_branch(tmp_path: Path) -> None:
    start = {"coupler": (0.5, 0.8, 2.0), "rocker": (4, 0, -0.4)}
    bodies = tuple(replace(body, start=start.get(body.name, body.start)) for body in linkage().bodies)
    mechanism = replace(linkage(), bodies=bodies, coordinates=("rocker.phi",))
    whole = replace(mechanism, coordinates="all")
    lengths = next(values for values in drawn_lengths(8, seed=22) if _differs(whole, values))
    set_ = {name: lengths[name] for name in LENGTHS}
    fmu = kinfmu.build(mechanism, tmp_path / "short.fmu", flavour="python")
    run = kinfmu.simulate(fmu, parameters=set_)
    columns = recomputed(run, mechanism)
    assert columns is not None
    followed = kinfmu.solve(continued(whole, set_).mechanism, run.t)
    for name in ("coupler.x", "coupler.phi", "rocker.phi"):
        assert columns[name] == pytest.approx(followed[name], abs=1e-11)


def _differs(mechanism: kinfmu.Mechanism, values: dict[str, float]) -> bool:
    """Whether the lengths assemble on another branch than the one that is followed to them."""
    lengths = {name: values[name] for name in LENGTHS}
    try:
        by_file = kinfmu.solve(mechanism.with_parameters(lengths), TIMES[:1])
        followed = continued(mechanism, lengths)
        run = kinfmu.solve(followed.mechanism, TIMES[:1])
    except KinfmuError:
        return False
    return not followed.message and bool(np.all(run.good)) and side(run) != side(by_file)


# -------------------------------------------------------------------------------------------------------------- outline


@pytest.mark.parametrize(
    ("points", "expected"),
    [
        ([(0, 0)], [(0, 0)]),
        ([(1, 0), (0, 0)], [(0, 0), (1, 0)]),
        ([(0, 0), (2, 2), (1, 1)], [(0, 0), (1, 1), (2, 2)]),
        ([(0, 0), (4, 0), (0, 4)], [(0, 0), (4, 0), (0, 4)]),
    ],
    ids=["point", "bar", "three-in-a-line", "triangle"],
)
def test_a_link_is_drawn_through_all_its_points(points: list[tuple[int, int]], expected: list[tuple[int, int]]) -> None:
    drawn, is_closed = rim(np.array(points, dtype=float))
    if not is_closed:  # a line has two directions
        drawn = drawn[np.lexsort(drawn.T)]
    np.testing.assert_array_equal(drawn, expected)
    assert not len(ribs(np.array(points, dtype=float)))


def test_a_point_inside_a_plate_is_joined_to_the_nearest_corner() -> None:
    points = np.array([(0.0, 0.0), (4.0, 0.0), (0.0, 4.0), (1.0, 1.0), (2.5, 1.0)])
    np.testing.assert_array_equal(ribs(points), [[(0, 0), (1, 1)], [(4, 0), (2.5, 1)]])


def test_the_rim_of_a_link_is_around_its_points_or_along_them() -> None:
    corners, is_closed = rim(np.array([(0.0, 4.0), (1.0, 1.0), (4.0, 0.0), (0.0, 0.0)]))
    assert is_closed
    np.testing.assert_array_equal(corners, [(0, 0), (4, 0), (0, 4)])
    corners, is_closed = rim(np.array([(2.0, 0.0), (1.0, 0.0), (1.0, 0.0)]))
    assert not is_closed
    np.testing.assert_array_equal(corners, [(1, 0), (2, 0)])


# -------------------------------------------------------------------------------------------------------------- palette


def test_the_first_bodies_have_the_plain_colours() -> None:
    assert tuple(map(palette.body, range(7))) == palette.BODIES


def test_twenty_one_bodies_have_different_colours_in_x_and_y() -> None:
    plain = [palette.body(index) for index in range(21)]
    found = [*plain, *map(palette.lighter, plain)]
    apart = [max(abs(a - b) for a, b in zip(one, other, strict=True)) for one in found for other in found]
    assert sorted(apart)[len(found)] > 8  # the smallest are of each with itself


def test_colours_are_repeated_without_end() -> None:
    assert palette.body(1021) == palette.body(1000)


def test_lines_on_white_paper_have_the_contrast_of_wcag() -> None:
    white = (255, 255, 255)
    assert palette.contrast((0, 0, 0), white) == 21.0
    assert palette.contrast((119, 119, 119), white) == pytest.approx(4.48, abs=0.005)  # the usual example of a grey
    for index in range(21):
        colour = palette.body(index)
        found = palette.on_white(colour)
        assert palette.contrast(found, white) >= 3.0
        assert (found == colour) == (palette.contrast(colour, white) >= 3.0)


def test_curves_of_a_panel_are_all_visible_and_all_different() -> None:
    colours = [curve_colour(index) for index in range(MOST_CURVES)]
    assert min(palette.contrast(colour, (255, 255, 255)) for colour in colours) >= 3.0
    assert len(set(colours)) == MOST_CURVES
