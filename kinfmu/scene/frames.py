"""Frames that move shapes: bodies, and what lies between two bodies."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from kinfmu.drivers import DistanceDriver, Driver
from kinfmu.joints import Coordinate, Distance, PointOnLine
from kinfmu.joints.joint import Joint
from kinfmu.measures.placement import body_of
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.run import FloatArray
from kinfmu.scene.placing import world


def bar_frame(joint: str) -> str:
    """Return the frame of a bar, which begins at its first point and lies along it."""
    return f"bar.{joint}"  # names of bodies hold no dot


def cylinder_frames(driver: str) -> tuple[str, str]:
    """Return the frames of a cylinder's barrel and rod, each at its own pin and along the cylinder."""
    return f"cylinder.{driver}.barrel", f"cylinder.{driver}.rod"


def die_frame(joint: str) -> str:
    """Return the frame of the block of a pin, which moves with the pin and does not turn."""
    return f"die.{joint}"


def frames(poses: Mapping[str, FloatArray], mechanism: Mechanism) -> dict[str, FloatArray]:
    """Return poses (n, 3) of x, y [length], phi [rad] of all frames, from those of bodies, the ground included."""
    found, points = dict(poses), mechanism.body_points

    def track(point: str) -> FloatArray:
        return world(poses[body_of(point)], points[point])

    members: list[Joint | Driver] = [*mechanism.joints, *mechanism.drivers]
    for member in members:
        if not poses.keys() >= set(member.bodies()):
            continue
        if isinstance(member, Distance | DistanceDriver):
            a, b = map(track, member.between)
            angle = np.arctan2(b[:, 1] - a[:, 1], b[:, 0] - a[:, 0])
            at_a, at_b = np.column_stack([a, angle]), np.column_stack([b, angle])
            if isinstance(member, Distance):
                found[bar_frame(member.name)] = at_a
            else:
                found |= zip(cylinder_frames(member.name), (at_a, at_b), strict=True)
        elif isinstance(member, Coordinate):
            found[die_frame(member.name)] = _upright(track(member.of))
        elif isinstance(member, PointOnLine) and body_of(member.between[0]) == GROUND_NAME:
            found[die_frame(member.name)] = _upright(track(member.between[1]))
    return found


def _upright(track: FloatArray) -> FloatArray:
    """Return poses (n, 3) at points (n, 2) that do not turn, NaN where the points are unknown."""
    return np.column_stack([track, 0.0 * track[:, 0]])
