"""Loads and forces of a scene: their arrows, symbols and sizes."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kinfmu
from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import loads as symbols
from kinfmu.draw.scene import strokes
from kinfmu.draw.scene.forces import LONGEST, arrows
from kinfmu.draw.scene.instant import Instant
from kinfmu.draw.scene.loads import load_text
from kinfmu.draw.scene.placing import poses_of, world
from kinfmu.draw.scene.scene import Scene, scene
from kinfmu.draw.scene.shape import Shape
from kinfmu.draw.scene.shapes import shapes
from kinfmu.mechanism.loads import LOADS as CLASSES
from kinfmu.mechanism.loads import ForceAt, Load, Spring
from kinfmu.mechanism.toml_file import parse
from kinfmu.run import Run
from tests.analysis.test_loading import ARM
from tests.gallery_members import every_member
from tests.mechanism.loads.every_load import every_load, fourbar, mechanisms
from tests.motion.cams.followers import ALL
from tests.run.test_forces import loaded


@pytest.fixture(scope="module")
def run() -> Run:
    return kinfmu.solve(loaded("slider_crank"))


def test_arrows_are_the_forces_to_the_scale_of_the_legend(run: Run) -> None:
    assert run.mechanism is not None
    shown = scene(run, run.mechanism)
    found = arrows(run, run.mechanism, shown)
    assert found is not None
    assert set(found.along) == {"joints.O", "joints.P", "joints.S", "joints.bore"}
    newtons = found.along["joints.P"] * found.newton / found.length
    np.testing.assert_allclose(newtons, np.column_stack([run["P.force_x"], run["P.force_y"]]), rtol=1e-12)
    bore = found.along["joints.bore"] * found.newton / found.length
    np.testing.assert_allclose(bore[:, 0], 0.0, atol=1e-12)  # the bore is along x
    np.testing.assert_allclose(bore[:, 1], run["bore.force"], rtol=1e-12)
    np.testing.assert_allclose(found.at["joints.P"], np.column_stack([run["rod.x"], run["rod.y"]]), atol=1e-9)
    longest = max(float(np.hypot(*along.T).max()) for along in found.along.values())
    assert longest == pytest.approx(LONGEST * shown.size, rel=0.02)
    assert found.legend == "1000 N"


def test_undetermined_reactions_and_those_not_kept_have_no_arrow(run: Run) -> None:
    fourbar = kinfmu.solve(loaded("fourbar"), np.arange(5.0))
    assert fourbar.mechanism is not None
    assert run.mechanism is not None
    assert arrows(fourbar, fourbar.mechanism, scene(fourbar, fourbar.mechanism)) is None
    part = run.without(["P.force_x"])
    found = arrows(part, run.mechanism, scene(part, run.mechanism))
    assert found is not None
    assert set(found.along) == {"joints.O", "joints.S", "joints.bore"}


def test_joints_between_bodies_have_no_arrow() -> None:
    lever = """[bodies.lever]
points = { E = [0, 0] }
mass = 1
[joints.E]
type = "revolute"
between = ["ground.O", "lever.E"]
[joints.lobe]
type = "cam_oscillating"
between = ["ground", "lever"]
cam = "arm"
law = "harmonic"
amplitude = "10 deg"
frequency = 1
"""
    mechanism = parse(ARM + lever, "lever.toml")
    run = kinfmu.solve(mechanism)
    found = arrows(run, mechanism, scene(run, mechanism))
    assert found is None  # the bearings depend on the contact, which is unknown


@pytest.mark.parametrize("follower", ALL)
@pytest.mark.few(5)
def test_the_force_of_a_cam_starts_at_the_contact_and_is_that_on_its_axle(follower: str) -> None:
    """The cam has no weight, so its axle carries the contact force alone."""
    mechanism = ALL[follower]()
    mechanism = replace(
        mechanism,
        bodies=tuple(
            replace(body, mass=1.0, center_of_mass=(-20.0, 0.0)) if body.name == "follower" else body
            for body in mechanism.bodies
        ),
        gravity=(0.0, -9810.0),
    )
    run = kinfmu.solve(mechanism, np.linspace(0.0, 0.9, 7))
    shown = scene(run, mechanism)
    found = arrows(run, mechanism, shown)
    assert found is not None
    newtons = found.along["joints.lift"] * found.newton / found.length
    np.testing.assert_allclose(newtons, np.column_stack([run["O.force_x"], run["O.force_y"]]), rtol=1e-9, atol=1e-9)
    x, y = found.at["joints.lift"].T
    moment = x * newtons[:, 1] - y * newtons[:, 0]  # about the axle, in N mm
    np.testing.assert_allclose(moment, 1e3 * run["cam.torque"], rtol=1e-8, atol=1e-8)


LOADS = """
[loads.weight]
type = "force"
at = "arm.O"
y = "-50 N"

[loads.push]
type = "force_along"
at = "arm.O"
axes = "arm"
law = "constant"
level = "30 N"

[loads.wind]
type = "force_along"
at = "arm.O"
law = "external"

[loads.brake]
type = "torque"
on = "arm"
law = "constant"
level = "-3 N m"
"""
SPRING = """
[loads.spring]
type = "spring"
between = ["ground.far", "arm.tip"]
stiffness = "200 N/m"
free_length = 100
"""


def test_loads_have_arrows_where_they_act() -> None:
    text = ARM.replace("{ O = [0, 0] }, mass", "{ O = [0, 0], tip = [300, 0] }, mass")
    text = text.replace("ground.points = { O = [0, 0] }", "ground.points = { O = [0, 0], far = [900, 0] }")
    mechanism = parse(text + LOADS + SPRING, "arm.toml")
    run = kinfmu.solve(mechanism)
    found = arrows(run, mechanism, scene(run, mechanism))
    assert found is not None
    assert set(found.along) == {"joints.O", "loads.weight", "loads.push", "loads.spring"}
    newtons = {name: along * found.newton / found.length for name, along in found.along.items()}
    np.testing.assert_allclose(newtons["loads.weight"], np.tile([0.0, -50.0], (len(run), 1)), atol=1e-11)
    phi = run["arm.phi"]
    turning = np.column_stack([np.cos(phi), np.sin(phi)])
    np.testing.assert_allclose(newtons["loads.push"], 30.0 * turning, atol=1e-11)
    tip = 300.0 * turning
    np.testing.assert_allclose(found.at["loads.spring"], tip, atol=1e-9)
    away = np.array([900.0, 0.0]) - tip
    length = np.hypot(*away.T)[:, None]
    np.testing.assert_allclose(newtons["loads.spring"], 200.0 * (length - 100.0) * 1e-3 * away / length, atol=1e-10)


# ---------------------------------------------------------------------------------------------------------- load shapes


SIZE = 0.5  # [mm] of a unit of details


def scene_of(mechanism: kinfmu.Mechanism) -> Scene:
    return scene(kinfmu.solve(mechanism), mechanism)


def lines(found: Scene, name: str, row: int = 0) -> list[FloatArray]:
    """The lines of the symbol of a load at a sample, in the world [mm]."""
    (shape,) = (one for one in found.shapes if one.is_load and one.name == name)
    placed = shape.placed({frame: pose[row] for frame, pose in found.frames.items()})
    return [points for _, points in strokes.symbol(placed, SIZE)]


def point(found: Scene, name: str, row: int = 0) -> FloatArray:
    body, _, _ = name.partition(".")
    x, y = every_load().body_points[name]
    return np.asarray(world(found.frames[body][row][None], (x, y))[0])


@pytest.fixture(scope="module")
def found() -> Scene:
    return scene_of(every_load())


def test_every_kind_of_load_has_a_symbol(found: Scene) -> None:
    drawn = {shape.kind: shape.name for shape in found.shapes if shape.is_load}
    assert drawn == {load.type: load.name for load in every_load().loads}
    assert set(drawn) == {cls.type for cls in CLASSES}


@every_member
@pytest.mark.few(4)
def test_a_mechanism_without_loads_has_no_symbols(name: str) -> None:
    mechanism = kinfmu.load(name)
    shown = [shape.name for shape in scene_of(replace(mechanism, loads=())).shapes if shape.is_load]
    assert shown == []
    assert [shape.name for shape in scene_of(mechanism).shapes if shape.is_load] == [
        one.name for one in mechanism.loads
    ]


@pytest.mark.parametrize("row", [0, 30, 77])
@pytest.mark.parametrize(
    ("name", "first", "last"),
    [("coil", "ground.D", "coupler.M"), ("strut", "ground.E", "rocker.Q"), ("muscle", "ground.F", "rocker.T")],
)
def test_a_load_between_two_points_reaches_from_one_to_the_other(
    found: Scene, name: str, first: str, last: str, row: int
) -> None:
    everything = np.vstack(lines(found, name, row))
    for end in (first, last):
        assert np.hypot(*(everything - point(found, end, row)).T).min() < (2.0 * SIZE if name == "strut" else 1e-9)


def test_a_spring_between_free_points_is_a_zigzag_on_their_line() -> None:
    alone = fourbar(
        '[loads.coil]\ntype = "spring"\nbetween = ["ground.D", "coupler.M"]\nstiffness = 1\nfree_length = 0\n'
    )
    shown = scene_of(alone)
    for row in (0, 40):
        (zigzag,) = lines(shown, "coil", row)
        a, b = point(shown, "ground.D", row), point(shown, "coupler.M", row)
        np.testing.assert_allclose([zigzag[0], zigzag[-1]], [a, b], atol=1e-9)
        along = (b - a) / np.hypot(*(b - a))
        across = (zigzag - a) @ np.array([-along[1], along[0]])
        np.testing.assert_allclose(np.abs(across[2:-2]), 6.0 * SIZE, atol=1e-9)
        assert (across[2:-3] * across[3:-2] < 0.0).all()  # from side to side
        assert (np.diff((zigzag - a) @ along) > 0.0).all()


def piston_in_cup(mechanism: kinfmu.Mechanism) -> tuple[FloatArray, FloatArray]:
    """The length of the cup of the damper 'oil' over a turn, and the place of its piston in it, 0 to 1."""
    shown, cups, places = scene_of(mechanism), [], []
    for row in range(0, 101, 5):
        _, cup, _, piston = lines(shown, "oil", row)
        end, bottom = cup[0], cup[1]
        cups.append(float(np.hypot(*(end - bottom))))
        along = (end - bottom) / cups[-1]
        places.append(float((piston.mean(axis=0) - bottom) @ along) / cups[-1])
    return np.array(cups), np.array(places)


def test_a_damper_keeps_its_cup_and_its_piston_moves_in_it() -> None:
    cups, places = piston_in_cup(
        fourbar('[loads.oil]\ntype = "damper"\nbetween = ["ground.F", "rocker.T"]\ndamping = 10\n')
    )
    np.testing.assert_allclose(cups, cups[0], rtol=1e-9)
    assert 0.0 < places.min() < places.max() < 1.0
    assert np.ptp(places) > 0.3


def test_a_damper_whose_stroke_does_not_fit_into_its_shortest_length_is_stretched() -> None:
    cups, places = piston_in_cup(
        fourbar('[loads.oil]\ntype = "damper"\nbetween = ["ground.D", "coupler.M"]\ndamping = 10\n')
    )
    assert cups.max() > 1.5 * cups.min()
    np.testing.assert_allclose(places, places[0], rtol=1e-9)
    assert 0.3 < places[0] < 0.7


def test_loads_at_one_pair_of_points_are_drawn_next_to_each_other(found: Scene) -> None:
    a, b = point(found, "ground.D"), point(found, "coupler.M")
    across = np.array([a[1] - b[1], b[0] - a[0]]) / np.hypot(*(b - a))
    middles = [float(np.mean((np.vstack(lines(found, name)) - a) @ across)) for name in ("coil", "oil")]
    assert middles[0] * middles[1] < 0.0
    (zigzag,) = lines(found, "coil")
    cup = lines(found, "oil")[1]
    gap = np.abs(((zigzag[1:-1] - a) @ across)[:, None] - ((cup - a) @ across)[None]).min()
    assert gap > 2.0 * SIZE


def test_a_load_near_a_cylinder_is_next_to_it() -> None:
    mechanism = kinfmu.load("excavator")
    assist = Spring("assist", ("ground.boom_foot", "boom.boom_eye"), 1.0, 1.0)
    shown = scene_of(replace(mechanism, loads=(assist,)))
    (shape,) = (one for one in shown.shapes if one.is_load)
    assert np.abs(shape.strips[0].points[2:-2, 3]).min() >= symbols.PITCH - 6.0


def test_a_constant_force_points_where_it_acts_and_one_of_zero_is_not_drawn(found: Scene) -> None:
    shaft, head = lines(found, "weight")
    np.testing.assert_allclose(shaft[:, 0], point(found, "coupler.M")[0], atol=1e-9)
    tip = head[0]
    assert tip[1] < shaft[:, 1].min()  # downwards
    assert tip[1] > point(found, "coupler.M")[1]  # it pushes from above: the mechanism is below
    mechanism = every_load()
    free = replace(mechanism, loads=(ForceAt("weight", "coupler.M"),))
    assert [shape for shape in scene_of(free).shapes if shape.is_load] == []


def test_a_force_turns_with_the_body_of_its_axes(found: Scene) -> None:
    for row in (0, 25, 50):
        shaft, head = lines(found, "wind", row)
        along = head[0] - shaft[0]
        turn = found.frames["rocker"][row][2] - 0.5 * np.pi
        np.testing.assert_allclose(along / np.hypot(*along), [np.cos(turn), np.sin(turn)], atol=1e-9)


def test_a_force_by_a_law_points_where_its_largest_value_does() -> None:
    for sign in (1.0, -1.0):
        shown = scene_of(
            fourbar(
                f'[loads.gas]\ntype = "force_along"\nat = "coupler.M"\nlaw = "spline"\npoints = [[0, {1.0 * sign}], '
                f"[0.5, {-9.0 * sign}], [0.8, 0], [1, 0]]\n"
            )
        )
        shaft, head = lines(shown, "gas")
        assert np.sign(head[0][0] - shaft[0][0]) == -sign


def test_a_force_over_a_quantity_points_where_its_largest_value_in_the_run_does() -> None:
    law = 'law = "harmonic"\namplitude = 5\nfrequency = 1\nstart = -10\n'
    over = 'over = { measure = "angle", of = "rocker" }\n'
    shown = scene_of(fourbar(f'[loads.gas]\ntype = "force_along"\nat = "coupler.M"\n{law}{over}'))
    shaft, head = lines(shown, "gas")
    assert head[0][0] < shaft[0][0]


def test_a_torque_turns_the_way_of_its_law_about_the_pin_of_its_body(found: Scene) -> None:
    arc, head = lines(found, "brake")
    centre = point(found, "rocker.C")
    np.testing.assert_allclose(np.hypot(*(arc - centre).T), 14.0 * SIZE, rtol=1e-9)
    angles = np.unwrap(np.arctan2(*(arc - centre).T[::-1]))
    assert angles[-1] < angles[0]  # clockwise
    ahead = head[0] - arc[-1]
    assert ahead @ (arc[-1] - arc[-2]) > 0.0


def test_torsion_springs_and_dampers_are_about_the_pin_between_their_bodies(found: Scene) -> None:
    (spiral,) = lines(found, "clock")
    radii = np.hypot(*(spiral - point(found, "crank.O")).T)
    assert (np.diff(radii) > 0.0).all()
    around = np.vstack(lines(found, "grease"))
    assert (np.hypot(*(around - point(found, "rocker.Q")).T) <= 21.0 * SIZE + 1e-9).all()


def test_torques_springs_and_dampers_about_one_pin_have_different_radii() -> None:
    about = [
        '[loads.motor]\ntype = "torque"\non = "crank"\nlaw = "constant"\nlevel = 2\n',
        '[loads.brake]\ntype = "torque"\non = "crank"\nlaw = "constant"\nlevel = -1\n',
        '[loads.clock]\ntype = "torsion_spring"\nbetween = ["ground", "crank"]\nstiffness = 1\nfree_angle = 0\n',
        '[loads.clock_2]\ntype = "torsion_spring"\nbetween = ["ground", "crank"]\nstiffness = 1\nfree_angle = 0\n',
        '[loads.grease]\ntype = "torsion_damper"\nbetween = ["ground", "crank"]\ndamping = 1\n',
        '[loads.other]\ntype = "torque"\non = "rocker"\nlaw = "constant"\nlevel = 2\n',
    ]
    for order in (about, about[::-1]):
        made = scene_of(fourbar("".join(order)))
        rings = {}
        for name in ("motor", "brake", "clock", "clock_2", "grease"):
            radii = np.hypot(*(np.vstack(lines(made, name)) - point(made, "crank.O")).T) / SIZE
            rings[name] = (radii.min(), radii.max())
        spans = sorted(rings.values())
        assert all(after[0] > before[1] + 2.5 for before, after in pairwise(spans))
        other = np.hypot(*(lines(made, "other")[0] - point(made, "rocker.C")).T) / SIZE
        np.testing.assert_allclose(other, 14.0, rtol=1e-9)  # another pin


def test_the_ground_end_of_a_spring_has_a_support_within_the_bounds(found: Scene) -> None:
    assert {"D", "E", "F"} <= set(found.supports)
    assert found.low[1] <= -70.0
    assert found.high[0] >= 330.0
    bare = scene_of(fourbar())
    assert not {"D", "E", "F"} & set(bare.supports)
    assert bare.low[1] == pytest.approx(-50.0, abs=1.0)  # of the crank


def test_loads_of_bodies_that_a_run_does_not_hold_are_left_out() -> None:
    mechanism = every_load()
    run = kinfmu.solve(mechanism).without(["rocker.phi"])
    assert "rocker" not in poses_of(run, mechanism)[0]
    drawn = [shape.name for shape in scene(run, mechanism).shapes if shape.is_load]
    assert drawn == ["coil", "oil", "weight", "clock"]


def test_texts_state_the_constant_force_and_what_gives_other_ones() -> None:
    texts = [load_text(load) for load in every_load().loads]
    assert texts[:4] == ["coil", "oil", "strut", "muscle (input)"]
    assert texts[4:] == ["weight = 50 N", "wind (input)", "brake = 2 N m", "clock", "grease"]


def test_parts_of_a_cylinder_stay_between_its_ends() -> None:
    ends = np.array([[0.0, 0.0], [1.0, 0.0]])
    strut = Shape("gas_spring", "strut", "ground", ends, strips=symbols.gas_spring(3.0, 2.0), other="ground")
    everything = np.vstack([points for _, points in strokes.symbol(strut, 0.01)])
    assert (everything[:, 0] >= 0.0).all()
    assert (everything[:, 0] <= 1.0).all()


@pytest.mark.parametrize("cls", CLASSES, ids=lambda cls: cls.type)
@given(data=st.data())
@pytest.mark.few(2)
def test_any_load_has_a_symbol_of_finite_lines(cls: type[Load], data: st.DataObject) -> None:
    mechanism = data.draw(mechanisms(cls))
    poses = {body.name: np.zeros((2, 3)) for body in mechanism.bodies}
    drawn = [shape for shape in shapes(Instant(mechanism, poses, {})) if shape.is_load]
    (load,) = mechanism.loads
    assert [shape.name for shape in drawn] == [load.name] * (not isinstance(load, ForceAt) or bool(load.x or load.y))
    for shape in drawn:
        placed = shape.placed({frame: pose[0] for frame, pose in poses.items()})
        assert all(np.isfinite(points).all() for _, points in strokes.symbol(placed, SIZE))


def test_a_run_without_numbers_has_symbols_too() -> None:
    mechanism = fourbar(
        '[loads.gas]\ntype = "force_along"\nat = "coupler.M"\nlaw = "polynomial"\ncoefficients = [0, 1]\n'
        'over = { measure = "angle", of = "rocker" }\n'
    )
    poses = {body: np.full((3, 3), np.nan) for body in ("ground", "crank", "coupler", "rocker")}
    poses["ground"] = np.zeros((3, 3))
    drawn = [shape.name for shape in shapes(Instant(mechanism, poses, {"crank": 1.0})) if shape.is_load]
    assert drawn == ["gas"]
