"""What a body looks like: a link through its points, with pins where joints hold it."""

from __future__ import annotations

import numpy as np

from kinfmu.joints import CamRoller, Coordinate, Distance, Fixed, PointOnLine, Revolute
from kinfmu.joints.joint import Joint
from kinfmu.mechanism.body import Body
from kinfmu.run import FloatArray

FLAT = 1e-6  # of the points' extent; points nearer to a line than that count as a line


def points_of(body: Body) -> FloatArray:
    """Return body-fixed points (p, 2); the frame's origin for a body without points."""
    return np.array([tuple(point) for point in body.points.values()] or [(0.0, 0.0)])


def rim(points: FloatArray) -> tuple[FloatArray, bool]:
    """Return the corners (k, 2) of a link with these points (p, 2), and True if they are a closed line.

    Points on one line are all corners, in order; other points give their convex hull, counter-clockwise.
    """
    points = np.unique(points, axis=0)
    if len(points) < 3:
        return points, False
    centred = points - points.mean(axis=0)
    _, extents, directions = np.linalg.svd(centred, full_matrices=False)
    if extents[1] <= FLAT * extents[0]:
        return points[np.argsort(centred @ directions[0])], False
    return points[_hull(points)], True


def outline(points: FloatArray) -> FloatArray:
    """Return the polyline (k, 2) of a link with points (p, 2): along them, or their hull with lines to inner points."""
    corners, is_closed = rim(points)
    if not is_closed:
        return corners
    inside = [point for point in np.unique(points, axis=0) if not (corners == point).all(axis=1).any()]
    nearest = [int(np.argmin(np.hypot(*(corners - point).T))) for point in inside]
    route = []
    for k, corner in enumerate(corners):
        route.append(corner)
        for point, home in zip(inside, nearest, strict=True):
            if home == k:
                route += [point, corner]  # a line to the inner point and back
    return np.array([*route, corners[0]])


def _hull(points: FloatArray) -> list[int]:
    """Return indices of the convex hull of points sorted by x, then y; counter-clockwise (Andrew's monotone chain)."""

    def chain(order: range) -> list[int]:
        kept: list[int] = []
        for index in order:
            while len(kept) > 1:
                (a_x, a_y), (b_x, b_y) = points[kept[-1]] - points[kept[-2]], points[index] - points[kept[-2]]
                if a_x * b_y - a_y * b_x > 0.0:
                    break
                kept.pop()
            kept.append(index)
        return kept[:-1]

    return chain(range(len(points))) + chain(range(len(points) - 1, -1, -1))


def pins_of(joint: Joint) -> tuple[str, ...]:
    """Points 'body.point' where a joint has a pin; those of a revolute joint coincide, a block that slides has none."""
    if isinstance(joint, Revolute | Fixed):
        return joint.between[:1]
    if isinstance(joint, Distance):
        return joint.between
    if isinstance(joint, PointOnLine | CamRoller):
        return joint.between[1:]
    return (joint.of,) if isinstance(joint, Coordinate) else ()


def supported(joint: Joint) -> tuple[str, ...]:
    """Points 'body.point' that a joint loads, each on its own body: supports, where they are the ground's."""
    return joint.between if isinstance(joint, Revolute | Fixed) else pins_of(joint)
