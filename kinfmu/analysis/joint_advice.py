"""Advice where drivers and degrees of freedom do not match: missing pins, an unneeded body, fixed joints too many."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.joints import Fixed, Revolute
from kinfmu.mechanism.quantities.placement import body_of, point_of
from kinfmu.plan.equations.closing import null_space
from kinfmu.plan.equations.redundancy import Redundancy, find_redundancy
from kinfmu.plan.equations.system import System, placement

_SAME = 1e-3  # of the size; points of two bodies that are nearer in the start pose are one pin
_RANK = 1e-3  # of the free directions; a pin that holds less holds nothing new
_MOST_POINTS = 400  # every pair is compared


def missing_pins(system: System, start: FloatArray, pose: FloatArray, free: FloatArray) -> Iterator[Revolute]:
    """Yield pins that are probably missing: points at one place, or of one name if a start pose is incomplete.

    Args:
        system: The equations of a mechanism with more degrees of freedom than drivers.
        start: (n,) rough start pose.
        pose: (n,) pose of the motion that joints and drivers leave.
        free: (n, k) free directions there.

    Yields:
        Pins that together hold two of the free directions each.

    """
    mechanism = system.mechanism
    taken = {joint.name for joint in mechanism.joints}
    for a, b in _pairs(mechanism, start, _SAME * system.size):
        if free.shape[1] < 2:
            return
        name = point_of(a) if point_of(a) == point_of(b) else f"{point_of(a)}_{point_of(b)}"
        while name in taken:
            name += "_2"
        pin = Revolute(name, (a, b))
        probe = System(replace(mechanism, joints=(pin,), drivers=(), measures=()), system.size)
        holds = probe.scaled_jacobian(pose) @ free  # (2, k)
        if np.linalg.svd(holds, compute_uv=False)[-1] <= _RANK:
            continue
        taken.add(name)
        yield pin
        free = free @ null_space(holds)


def _pairs(mechanism: Mechanism, start: FloatArray, near: float) -> list[tuple[str, str]]:
    """Return pairs of points that are probably one pin, of which at least one is in no joint; the likeliest first."""
    joined = {point for joint in mechanism.joints for point in getattr(joint, "between", ()) if "." in str(point)}
    points = list(mechanism.body_points)
    if len(points) > _MOST_POINTS:
        return []
    at = placement(mechanism, start.tolist())
    places = {point: np.array(at.point(point)) for point in points}
    is_open = {body.name: None in body.start for body in mechanism.moving_bodies} | {GROUND_NAME: False}
    linked = {frozenset(joint.bodies()) for joint in mechanism.joints}
    found = []
    for a, b in combinations(points, 2):
        bodies = body_of(a), body_of(b)
        if bodies[0] == bodies[1] or {a, b} <= joined or frozenset(bodies) in linked:
            continue
        is_same = point_of(a) == point_of(b)
        is_near = float(np.hypot(*(places[a] - places[b]))) <= near
        if is_near or (is_same and (is_open[bodies[0]] or is_open[bodies[1]])):
            found.append((not is_same, not is_near, len({a, b} & joined), a, b))
    return [(a, b) for *_, a, b in sorted(found, key=lambda one: one[:3])]


def idle_body(mechanism: Mechanism, loose: tuple[str, ...], missing: int) -> str | None:
    """Return the only body that can still move if several joints hold it, such as a roller on its pin; else None.

    loose: bodies that can still move; missing: number of missing drivers.
    """
    if missing != 1 or len(loose) != 1:
        return None
    others = [set(joint.bodies()) - {*loose} for joint in mechanism.joints if loose[0] in joint.bodies()]
    return loose[0] if len(others) > 1 else None


def stiff_joints(mechanism: Mechanism, redundancy: Redundancy) -> tuple[str, ...]:
    """Return names of fixed joints each of which, as a revolute joint, would give every driver a degree of freedom."""
    wanted = len(mechanism.drivers)
    if redundancy.mobility >= wanted:
        return ()
    found = []
    for joint in mechanism.joints:
        if isinstance(joint, Fixed):
            pin = Revolute(joint.name, joint.between)
            joints = tuple(pin if one is joint else one for one in mechanism.joints)
            if find_redundancy(System(replace(mechanism, joints=joints))).mobility == wanted:
                found.append(joint.name)
    return tuple(found)
