"""Choice of the pose in which links hide one another least."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from kinfmu.joints import Distance, Translational
from kinfmu.measures.placement import body_of, unit_vector
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.run import FloatArray
from kinfmu.scene.outline import points_of, rim
from kinfmu.scene.placing import world

ENOUGH = 0.04  # of all links; if no more is covered, no other pose is looked for
_CANDIDATES = 24  # poses of a run that are compared
_DOTS = np.linspace(0.12, 0.88, 9)  # along each link, without the ends near its pins
_NEAR = 0.025  # of the size; a dot nearer to another link is covered
_SAME = 1e-6  # of the size; points that are nearer are one pin
_PIN = 0.05  # cost of a pin that covers a link of another joint
_MOST_LINKS = 60  # with more links no pose is clearly better than the start


def is_clear(mechanism: Mechanism, poses: Mapping[str, FloatArray]) -> bool:
    """Return whether links do not hide one another in the only pose (1, 3) of each body."""
    owners, links = _links(mechanism, poses)
    return not 1 < len(owners) <= _MOST_LINKS or round(_covered(owners, links[0]), 6) <= ENOUGH


def clearest(mechanism: Mechanism, poses: Mapping[str, FloatArray]) -> int:
    """Return the row of poses (n, 3) by body in which links hide one another least, or the first clear one."""
    rows = np.unique(np.linspace(0, len(poses[GROUND_NAME]) - 1, _CANDIDATES + 1).astype(int))
    rows = np.array([row for row in rows if all(np.isfinite(pose[row]).all() for pose in poses.values())])
    owners, links = _links(mechanism, {body: pose[rows] for body, pose in poses.items()})  # (r, links, 2, 2)
    if not 1 < len(owners) <= _MOST_LINKS:
        return int(rows[0])
    covered = []
    for ends in links:
        covered.append(round(_covered(owners, ends), 6))
        if covered[-1] <= ENOUGH:
            return int(rows[len(covered) - 1])
    return int(rows[int(np.argmin(covered))])


def _links(mechanism: Mechanism, poses: Mapping[str, FloatArray]) -> tuple[list[str], FloatArray]:
    """Return the owners of all straight edges, and their ends (r, links, 2, 2) in the world."""
    owners: list[str] = []
    ends: list[FloatArray] = []

    def add(owner: str, a: FloatArray, b: FloatArray) -> None:
        owners.append(owner)
        ends.append(np.stack([a, b], axis=1))  # (r, 2, 2)

    for body in mechanism.moving_bodies:
        corners, is_closed = rim(points_of(body))
        tracks = [world(poses[body.name], (x, y)) for x, y in corners]
        for k in range(len(tracks) - (not is_closed)):
            add(body.name, tracks[k], tracks[(k + 1) % len(tracks)])
    points = mechanism.body_points
    for joint in mechanism.joints:
        if isinstance(joint, Distance):
            a, b = (world(poses[body_of(end)], points[end]) for end in joint.between)
            add(joint.name, a, b)
        elif isinstance(joint, Translational) and body_of(joint.between[0]) == GROUND_NAME:
            origin = np.array(points[joint.between[0]])
            along = np.array(unit_vector(joint.axis))
            track = world(poses[body_of(joint.between[1])], points[joint.between[1]])
            way = (track - origin) @ along
            first, last = (np.tile(origin + end * along, (len(track), 1)) for end in (way.min(), way.max()))
            add(body_of(joint.between[1]), first, last)  # a rail may lie under its own slider
    return owners, np.stack(ends, axis=1) if ends else np.empty((0, 0, 2, 2))


def _covered(owners: list[str], ends: FloatArray) -> float:
    """Return the part of all links, with pins, that covers links of other bodies; ends: (links, 2, 2)."""
    names = np.array(owners)
    size = float(np.ptp(ends.reshape(-1, 2), axis=0).max())
    dots = (ends[:, :1] + (ends[:, 1:] - ends[:, :1]) * _DOTS[:, None]).reshape(-1, 2)  # (links * dots, 2)
    is_own = np.repeat(names, len(_DOTS))[:, None] == names[None, :]
    hidden = np.where(is_own, np.inf, _distances(dots, ends)).min(axis=1) < _NEAR * size
    pins = ends.reshape(-1, 2)
    apart = np.hypot(*(pins[:, None] - pins[None]).transpose(2, 0, 1)) > _SAME * size  # (pins, pins)
    is_held = np.array([[not apart[k][np.repeat(names, 2) == name].all() for name in owners] for k in range(len(pins))])
    lies_on = np.where(is_held, np.inf, _distances(pins, ends)).min(axis=1) < _NEAR * size
    return float(hidden.mean() + _PIN * lies_on.sum())


def _distances(dots: FloatArray, ends: FloatArray) -> FloatArray:
    """Return distances (k, links) of dots (k, 2) from straight links."""
    a, d = ends[:, 0], ends[:, 1] - ends[:, 0]
    part = ((dots[:, None] - a[None]) * d[None]).sum(axis=2) / np.maximum((d * d).sum(axis=1), 1e-30)
    nearest = a[None] + np.clip(part, 0.0, 1.0)[:, :, None] * d[None]
    return np.asarray(np.hypot(*(dots[:, None] - nearest).transpose(2, 0, 1)))
