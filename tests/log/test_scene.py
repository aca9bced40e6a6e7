"""What is drawn, against the closed form of the four-bar."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kinfmu.log.scene import Scene, drawable
from kinfmu.run import Run
from kinfmu.shapes.placing import world
from tests.log.runs import DEGREE


@pytest.fixture
def fourbar_scene(run: Run) -> Scene:
    found, note = drawable(run)
    assert found
    assert not note
    return found


def test_bodies_stand_where_their_coordinates_and_constants_say(fourbar_scene: Scene, run: Run) -> None:
    crank, coupler, rocker = fourbar_scene.bodies
    phi = DEGREE * run.t
    tip = np.column_stack([np.cos(phi), np.sin(phi)])
    np.testing.assert_allclose(world(crank.pose, (1.0, 0.0)), tip, atol=1e-15)
    np.testing.assert_allclose(world(coupler.pose, (-1.0, 0.0)), tip, atol=1e-15)
    np.testing.assert_allclose(world(rocker.pose, (1.0, 0.0)), tip + np.array([1.0, 0.0]), atol=1e-15)


def test_the_bar_keeps_its_length(fourbar_scene: Scene) -> None:
    (bar,) = fourbar_scene.bars
    assert bar.name == "AB"
    np.testing.assert_allclose(np.hypot(*(bar.ends[:, 1] - bar.ends[:, 0]).T), 1.0, rtol=1e-14)


def test_supports_are_the_points_of_the_ground_that_joints_use(fourbar_scene: Scene) -> None:
    assert fourbar_scene.supports == {"O": (0.0, 0.0), "C": (1.0, 0.0), "B": (2.0, 0.0)}


def test_a_revolute_joint_is_one_pin_and_a_bar_has_two(fourbar_scene: Scene, run: Run) -> None:
    assert fourbar_scene.pins.shape == (len(run), 6, 2)


def test_the_path_is_that_of_the_point_of_interest(fourbar_scene: Scene, run: Run) -> None:
    np.testing.assert_allclose(fourbar_scene.paths["A"], np.column_stack([run["A.x"], run["A.y"]]), atol=1e-15)


def test_the_frame_holds_everything(fourbar_scene: Scene) -> None:
    np.testing.assert_allclose(fourbar_scene.low, [-1.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(fourbar_scene.high, [3.0, 1.0], atol=1e-15)


def test_poses_in_a_gap_are_unknown_even_where_coordinates_are_constant(run_with_gap: Run) -> None:
    found, _ = drawable(run_with_gap)
    assert found
    assert np.isnan(found.bodies[0].pose[100:121]).all()
    assert np.isfinite(found.high).all()


def test_a_body_whose_coordinates_are_not_in_the_run_is_left_out_by_name(run: Run) -> None:
    less = dataclasses.replace(run, outputs=("crank.phi", "x", "y", "coupler.phi", "rocker.phi", "A.x", "A.y"))
    found, note = drawable(less)
    assert found
    assert [body.name for body in found.bodies] == ["crank", "rocker"]
    assert note == "Not drawn: coupler (the run does not hold coupler.x, coupler.y)."


def test_a_run_without_its_mechanism_says_so(run: Run) -> None:
    assert drawable(dataclasses.replace(run, mechanism_text="")) == (
        None,
        "Not drawn: the run does not hold its mechanism.",
    )
    found, note = drawable(dataclasses.replace(run, mechanism_text="name = ["))
    assert found is None
    assert note.startswith("Not drawn: the run's mechanism: not valid TOML")
