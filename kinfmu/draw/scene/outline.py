"""What a body looks like: a link through its points, with pins where joints hold it."""

from __future__ import annotations

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.mechanism.body import Body
from kinfmu.mechanism.joints import CamRoller, Coordinate, Distance, Fixed, PointOnLine, Revolute
from kinfmu.mechanism.joints.joint import Joint

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


def ribs(points: FloatArray) -> FloatArray:
    """Return lines (r, 2, 2) from the rim of a link with points (p, 2) to each point inside."""
    corners, is_closed = rim(points)
    inside = [point for point in np.unique(points, axis=0) if not (corners == point).all(axis=1).any()]
    if not is_closed:
        return np.empty((0, 2, 2))
    return np.array([[corners[np.argmin(np.hypot(*(corners - at).T))], at] for at in inside]).reshape(-1, 2, 2)


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
    """Return points 'body.point' where a joint has a pin; those of a revolute joint coincide."""
    if isinstance(joint, Revolute | Fixed):
        return joint.between[:1]
    if isinstance(joint, Distance):
        return joint.between
    if isinstance(joint, PointOnLine | CamRoller):
        return joint.between[1:]
    return (joint.of,) if isinstance(joint, Coordinate) else ()
