"""Names in the viewer: supports are named as in figures, and names do not cover one another."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

import kinfmu
from kinfmu import Mechanism
from kinfmu.draw.scene.forces import arrows
from kinfmu.draw.scene.scene import Scene, drawable, scene
from kinfmu.log import write_rrd
from kinfmu.log.viewer.card import card
from kinfmu.log.viewer.ground import dots, places_below, shown_names
from kinfmu.log.viewer.marks import legend_start
from kinfmu.mechanism.toml_file import parse
from tests.gallery_members import every_member
from tests.log.viewer.test_rerun_file import statics

SLIDER_FIRST = """
name = "slider_first"
[bodies.ground]
points = { O = [0, 0], way = [0, -1] }
[bodies.crank]
points = { O = [0, 0], P = [1, 0] }
[bodies.rod]
points = { P = [0, 0], S = [3, 0] }
start = { x = 1, phi = -0.3 }
[bodies.slider]
points = { S = [0, 0], tip = [1, 0] }
start = { x = 4, y = -1 }
[joints]
main = { type = "revolute", between = ["ground.O", "crank.O"] }
P = { type = "revolute", between = ["crank.P", "rod.P"] }
S = { type = "revolute", between = ["rod.S", "slider.S"] }
guide = { type = "translational", between = ["slider.S", "ground.way"] }
[drivers.crank]
type = "angle"
of = "crank"
law = "constant_speed"
speed = 1
"""


def scene_of(mechanism: Mechanism) -> Scene:
    run = kinfmu.solve(mechanism, np.linspace(mechanism.run.start, mechanism.run.stop, 41))
    found, _ = drawable(run)
    assert found
    return found


@every_member
def test_names_of_supports_do_not_cover_each_other(name: str) -> None:
    scene = scene_of(kinfmu.load(name))
    places, names = places_below(scene) * dots(scene), list(scene.supports)
    for k, at in enumerate(places):
        for other, text in zip(places[:k], names, strict=False):
            assert abs(at - other)[1] > 16.0 or abs(at - other)[0] > 3.2 * (len(text) + len(names[k]))


def test_a_name_that_would_cover_another_is_shown_only_when_pointed_at() -> None:
    mechanism = kinfmu.load("fourbar")
    assert {"crank", "coupler", "rocker"} <= shown_names(scene_of(mechanism))
    scene = scene_of(mechanism)
    (crank,) = (shape for shape in scene.shapes if (shape.kind, shape.name) == ("link", "crank"))
    twins = replace(scene, shapes=(*scene.shapes, replace(crank, name="other")))
    assert "other" not in shown_names(twins)
    assert "crank" in shown_names(twins)


def test_supports_have_the_names_of_all_joints_at_their_place() -> None:
    assert list(scene_of(parse(SLIDER_FIRST, "slider.toml")).supports) == ["main"]
    assert "pin_upper, pin_lower" in scene_of(kinfmu.load("jansen_leg")).supports


def test_the_block_of_the_ground_through_which_a_slider_moves_is_drawn(tmp_path: Path) -> None:
    mechanism = parse(SLIDER_FIRST, "slider.toml")
    write_rrd(kinfmu.solve(mechanism, np.linspace(0.0, 1.0, 11)), tmp_path / "run.rrd")
    (block,) = statics(tmp_path / "run.rrd", "/linkage/ground/blocks", "LineStrips2D:strips")
    np.testing.assert_allclose(np.mean(block, axis=0), [0.0, -1.0], atol=1e-6)
    (radius,) = statics(tmp_path / "run.rrd", "/linkage/ground/blocks", "LineStrips2D:radii")
    assert radius > 0.01  # as wide as a block, not a thin line
    assert "guide" in statics(tmp_path / "run.rrd", "/linkage/ground/blocks", "LineStrips2D:labels")


def test_the_card_states_the_tool_that_made_the_fmu_but_not_its_token() -> None:
    run = kinfmu.solve(kinfmu.load("fourbar"), [0.0])
    of_fmu = replace(run, info={"name": "fourbar", "generation_tool": "kinfmu 1", "token": "{12ab}", "parameters": ""})
    assert "{12ab}" not in card(of_fmu)
    assert "token" not in card(of_fmu)
    assert "| FMU made by | kinfmu 1 |" in card(of_fmu)
    assert "parameters set" not in card(of_fmu)


def test_the_scale_of_forces_keeps_off_the_names_of_supports() -> None:
    for name in ("fourbar_loaded", "excavator_loaded", "jansen_leg_loaded", "toggle_press"):
        mechanism = kinfmu.load(name)
        run = kinfmu.solve(mechanism)
        found = scene(run, mechanism)
        drawn = arrows(run, mechanism, found)
        assert drawn is not None
        middle = legend_start(found, drawn.length) + 0.5 * drawn.length
        near = [at for at in found.supports.values() if at[1] < found.low[1] + 0.2 * found.size]
        assert all(abs(at[0] - middle) > 0.1 * found.size for at in near), name
