"""Reach: proof by the triangle inequality that rows close in no pose."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.joints import Held, Revolute
from kinfmu.mechanism.quantities import AngleBetween, DistanceBetween, PoseQuantity
from kinfmu.mechanism.quantities.placement import body_of
from kinfmu.plan.equations.part import Part
from kinfmu.plan.equations.system import System

_CERTAIN = 1e-6  # of the size; two points are too far apart by more
_MOST_POINTS = 300  # with more, the search for short ways takes longer than that for a pose

Pose = tuple[float, float, float]


def cannot_close(part: Part, u: FloatArray) -> bool:
    """Return True if rows close in no pose, because two points are further apart than the way between them.

    Two points have a known distance if they are on one body, on bodies whose poses are known, or joined by a pin or a
    bar. In a closed pose

        |ab| <= |ac| + |cb|        for all points, so |ab| <= the length of the shortest way from a to b

    Known poses are those of the ground, of bodies that are not among the coordinates of the part, and of bodies pinned
    to these with an angle that is held or driven. Of a body whose angle alone is among them the origin is known.

    False proves nothing.

    u: Driver values, (d,).
    """
    system = part.system
    whole, chosen = part.whole(np.zeros(len(part.columns))), set(part.rows)
    members = [system.members[number] for number in sorted({system.member_of[row] for row in part.rows})]
    members = [member for member in members if chosen.issuperset(member.rows)]
    pins = [member.owner.between for member in members if isinstance(member.owner, Revolute)]
    targets: list[tuple[PoseQuantity, float]] = []
    for member in members:
        if member.driver is not None:
            targets.append((member.owner.measured(), float(u[member.driver])))  # type: ignore[union-attr]  # a driver
        elif isinstance(member.owner, Held):
            targets.append(member.owner.measured())
    bars = [(quantity.between, abs(target)) for quantity, target in targets if isinstance(quantity, DistanceBetween)]
    columns = set(part.columns)
    poses = _known_poses(system, whole, columns, targets, pins)
    origins = _known_origins(system, whole, columns)
    names = list(dict.fromkeys(name for between in (*pins, *(ends for ends, _ in bars)) for name in between))
    names += [origin for origin in origins if body_of(origin) not in poses]
    if not 1 < len(names) <= _MOST_POINTS:
        return False
    distances = _distances(system, names, poses, origins)
    place = {name: k for k, name in enumerate(names)}
    least, most = distances.copy(), distances.copy()  # two bars may join the same points
    for (a, b), length in (*((pin, 0.0) for pin in pins), *bars):
        for i, j in ((place[a], place[b]), (place[b], place[a])):
            least[i, j] = min(least[i, j], length)
            most[i, j] = length if math.isinf(most[i, j]) else max(most[i, j], length)
    for k in range(len(names)):  # Floyd and Warshall
        least = np.minimum(least, least[:, k, None] + least[k])
    return bool((most[np.isfinite(most)] > least[np.isfinite(most)] + _CERTAIN * system.size).any())


def _known_poses(
    system: System,
    q: FloatArray,
    columns: set[int],
    targets: Iterable[tuple[PoseQuantity, float]],
    pins: Sequence[tuple[str, str]],
) -> dict[str, Pose]:
    """Return the poses (x, y, phi) that are known; q: (n,), in which those outside of `columns` are."""
    angles, poses = {GROUND_NAME: 0.0}, {GROUND_NAME: (0.0, 0.0, 0.0)}
    for k, moving in enumerate(system.mechanism.moving_bodies):
        x, y, phi = (3 * k + axis for axis in range(3))
        if phi not in columns:
            angles[moving.name] = float(q[phi])
            if x not in columns and y not in columns:
                poses[moving.name] = (float(q[x]), float(q[y]), float(q[phi]))
    turned = [(of.of, of.to or GROUND_NAME, target) for of, target in targets if isinstance(of, AngleBetween)]
    for _ in turned:  # each pass finds at least one more
        for of, to, target in turned:
            if to in angles:
                angles.setdefault(of, angles[to] + target)
            elif of in angles:
                angles[to] = angles[of] - target
    count = 0
    while count < len(poses):  # until a pass finds no more
        count = len(poses)
        for known, pinned in (*pins, *((b, a) for a, b in pins)):
            body = body_of(pinned)
            if body_of(known) in poses and body in angles and body not in poses:
                (r_x, r_y), (s_x, s_y) = (
                    _world(system, known, poses[body_of(known)]),
                    _turned(system, pinned, angles[body]),
                )
                poses[body] = (r_x - s_x, r_y - s_y, angles[body])
    return poses


def _known_origins(system: System, q: FloatArray, columns: set[int]) -> dict[str, tuple[float, float]]:
    """Return where the origins of frames are that are known, by 'body.': those outside of `columns`."""
    bodies = enumerate(system.mechanism.moving_bodies)
    known = [(body.name, 3 * k) for k, body in bodies if not {3 * k, 3 * k + 1} & columns]
    return {f"{name}.": (float(q[x]), float(q[x + 1])) for name, x in known}


def _distances(
    system: System, names: Sequence[str], poses: dict[str, Pose], origins: dict[str, tuple[float, float]]
) -> FloatArray:
    """Return the distances (k, k) of points on one body, or whose places are known; infinite for others."""
    fixed: list[tuple[int, tuple[float, float]]] = []
    of_bodies: dict[str, list[tuple[int, tuple[float, float]]]] = {}
    for k, name in enumerate(names):
        body = body_of(name)
        if body in poses:
            fixed.append((k, _world(system, name, poses[body])))
            continue
        if name in origins:
            fixed.append((k, origins[name]))
        of_bodies.setdefault(body, []).append((k, system.mechanism.body_points.get(name, (0.0, 0.0))))
    distances = np.full((len(names), len(names)), np.inf)
    for group in (fixed, *of_bodies.values()):
        numbers, places = [k for k, _ in group], np.array([place for _, place in group]).reshape(-1, 2)
        apart = places[:, None] - places
        distances[np.ix_(numbers, numbers)] = np.hypot(apart[..., 0], apart[..., 1])
    return distances


def _world(system: System, name: str, pose: Pose) -> tuple[float, float]:
    """Return a point of a body in the world."""
    s_x, s_y = _turned(system, name, pose[2])
    return pose[0] + s_x, pose[1] + s_y


def _turned(system: System, name: str, angle: float) -> tuple[float, float]:
    """Return the vector from the origin of a body's frame to a point, in the world's directions."""
    (x, y), c, s = system.mechanism.body_points[name], math.cos(angle), math.sin(angle)
    return c * x - s * y, s * x + c * y
