"""The robot description of a record: links, the parts that joints add, and their frames."""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np
import pytest

import kinfmu
from kinfmu.draw.scene.scene import scene
from kinfmu.log.urdf import link_poses, robot_description
from kinfmu.run import Run
from kinfmu.run.driving import run_times
from kinfmu.units import METRES
from tests.draw.test_dxf import with_loads
from tests.gallery_members import every_member


def solved(name: str) -> Run:
    mechanism = kinfmu.load(name)
    return kinfmu.solve(mechanism, run_times(mechanism.run)[::20])


def described(name: str) -> dict[str, list[tuple[float, float, float, float]]]:
    """By link its boxes: x, y of the middle, angle, length [m, rad]."""
    run = solved(name)
    drawn = scene(run.part(slice(0, 1)), kinfmu.load(name))
    robot = ET.fromstring(robot_description(name, drawn, METRES[run.length_unit]))  # noqa: S314  ours
    found = {}
    for link in robot.iter("link"):
        boxes = []
        for visual in link.iter("visual"):
            box, origin = visual.find("geometry/box"), visual.find("origin")
            if box is not None and origin is not None:
                x, y, _ = map(float, origin.get("xyz", "").split())
                angle, length = float(origin.get("rpy", "").split()[2]), float(box.get("size", "").split()[0])
                boxes.append((x, y, angle, length))
        found[link.get("name", "")] = boxes
    return found


@every_member
@pytest.mark.few(6)
def test_every_link_of_the_description_has_a_frame_and_every_frame_a_link(name: str) -> None:
    moving = link_poses(solved(name), kinfmu.load(name))
    assert {*described(name)} == {"ground", *moving}
    assert all(np.isfinite(pose).all() for pose in moving.values())


def test_loads_springs_and_gravity_are_not_in_the_description() -> None:
    texts = []
    for mechanism in with_loads("excavator_loaded"):
        drawn = scene(kinfmu.solve(mechanism, [0.0]), mechanism)
        texts.append(robot_description("excavator", drawn, METRES[mechanism.length_unit]))
    assert texts[0] == texts[1]


def test_a_cam_is_drawn_round_its_body_and_its_roller_on_the_follower() -> None:
    found = described("cam_roller")
    drawn = scene(solved("cam_roller").part(slice(0, 1)), kinfmu.load("cam_roller"))
    (profile,) = (shape for shape in drawn.shapes if shape.kind == "cam")
    edge = np.array([(x, y) for x, y, _, _ in found["cam"]])
    assert len(edge) >= 24
    ways = np.hypot(*(edge[:, None] - 1e-3 * profile.points[None]).transpose(2, 0, 1)).min(axis=1)
    assert ways.max() < 0.03 * np.ptp(1e-3 * profile.points)  # the middle of a chord lies inside the edge
    assert len(found["lever"]) > 20  # the roller


@pytest.mark.parametrize(("name", "body"), [("geared_five_bar", "gear"), ("parallel_jaw", "left_crank")])
def test_wheels_are_drawn_with_their_bodies(name: str, body: str) -> None:
    assert len(described(name)[body]) > 24


def test_a_cylinder_is_a_barrel_and_a_rod_that_move_between_its_pins() -> None:
    mechanism, run = kinfmu.load("excavator"), solved("excavator")
    found, moving = described("excavator"), link_poses(run, mechanism)
    (driver, *_) = mechanism.drivers
    barrel, rod = moving[f"cylinder.{driver.name}.barrel"], moving[f"cylinder.{driver.name}.rod"]
    length = np.hypot(*(rod - barrel)[:, :2].T)
    np.testing.assert_allclose(length, run[driver.inputs()[0]], rtol=1e-12)
    np.testing.assert_array_equal(barrel[:, 2], rod[:, 2])
    ((x, y, angle, reach),) = found[f"cylinder.{driver.name}.barrel"]
    assert (x, y, angle) == pytest.approx((reach / 2, 0.0, 0.0))
    ((x, y, angle, back),) = found[f"cylinder.{driver.name}.rod"]
    assert (x, y, angle) == pytest.approx((-back / 2, 0.0, 0.0))
    assert (reach + back > length).all()  # the rod never leaves the barrel


def test_parts_whose_size_does_not_follow_from_one_pose_are_left_out() -> None:
    run = solved("inverted_slider_crank")
    drawn = scene(run.part(slice(0, 1)), kinfmu.load("inverted_slider_crank"))
    assert {"rod", "rail"} < {shape.kind for shape in drawn.shapes}
    found = described("inverted_slider_crank")
    assert found["ground"] == []
    assert len(found["lever"]) == 1  # its link, without the rod in the block
