"""Start poses: the rough pose and the driver values that a mechanism is assembled from, as the file gives them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.joints.cam import Cam
from kinfmu.plan.equations.system import System

ROUGH = 0.1  # sizes; poses read off a sketch close the joints more narrowly
DRAWN = 1e-3  # sizes; points in coordinates of the world close the joints to the digits of the drawing
_MOST_LISTED = 3  # joints in a message


class StartValues(NamedTuple):
    """Where assembly begins: a rough pose q (n,) and driver values u (d,).

    is_followed: True if the start poses and the laws give different driver values; is_moved: True if those of the laws
    were taken, because they cannot be reached from those of the start poses.
    """

    q: FloatArray
    u: FloatArray
    is_followed: bool = False
    is_moved: bool = False


def law_targets(system: System) -> FloatArray:
    """Return the driver values at which the laws start, (d,)."""
    mechanism = system.mechanism
    return np.array([driver.law.at(mechanism.run.start) for driver in mechanism.drivers], dtype=float)


def start_from_poses(system: System) -> StartValues:
    """Return the start poses and the driver values in them, angles moved by whole turns to the start of the laws.

    A driver whose value the start poses leave out is at the start of its law.
    """
    bodies = system.mechanism.moving_bodies
    given = [value is not None for body in bodies for value in body.start]
    q = np.array([value or 0.0 for body in bodies for value in body.start])
    measured, law = system.measure(q), law_targets(system)
    targets = law.copy()
    turns = np.zeros(len(law))
    for k, driver in enumerate(system.mechanism.drivers):
        member = system.members[len(system.mechanism.joints) + k]
        (seen,) = system.gradients(member, member.coordinates(q)) != 0.0
        if all(given[column] for column, used in zip(member.columns, seen, strict=True) if used):
            if driver.quantity.kind == "angle":
                turns[k] = math.tau * round((law[k] - measured[k]) / math.tau)
            targets[k] = measured[k] + turns[k]
    return StartValues(with_angles(system, q, turns), targets, is_followed=not np.array_equal(targets, law))


def with_angles(system: System, q: FloatArray, change: FloatArray) -> FloatArray:
    """Return a rough pose with driven angles changed by `change` (d,); driven lengths are left to assembly."""
    q = q.copy()
    for k, driver in enumerate(system.mechanism.drivers):
        if driver.quantity.kind == "angle" and change[k] != 0.0:
            member = system.members[len(system.mechanism.joints) + k]
            (slopes,) = system.gradients(member, member.coordinates(q))
            turned = int(np.abs(slopes).argmax())
            q[member.columns[turned]] += change[k] / slopes[turned]
    return q


def distance_from_start(system: System, start: StartValues, pose: FloatArray) -> float:
    """Return how far a pose (n,) is from what the start poses give, in radians (without whole turns) and sizes."""
    largest = 0.0
    is_given = (value is not None for body in system.mechanism.moving_bodies for value in body.start)
    for name, counts, value, q in zip(system.coordinates, is_given, start.q, pose, strict=True):
        if counts:
            off = float(q) - float(value)
            off = math.remainder(off, math.tau) if name.is_angle else off / system.size
            largest = max(largest, abs(off))
    return largest


class OpenJoint(NamedTuple):
    """A joint that start poses given for all its bodies leave open, by a gap [length]."""

    name: str
    gap: float


def is_in_world_coordinates(mechanism: Mechanism) -> bool:
    """Return True if the frames of several bodies coincide with that of the world in the start poses."""
    bodies = mechanism.moving_bodies
    return len(bodies) > 1 and all(value == 0.0 for body in bodies for value in body.start)


def open_joints(system: System, q: FloatArray) -> list[OpenJoint]:
    """Return the joints that complete start poses leave open by more than what a sketch is rounded by, widest first.

    Where all points are in coordinates of the world, more than the digits of a drawing counts.

    q: (n,) the start poses, as in StartValues.
    """
    mechanism = system.mechanism
    complete = {body.name for body in mechanism.moving_bodies if all(value is not None for value in body.start)}
    gaps = system.gaps(system.residual(q, np.zeros(len(mechanism.drivers))))
    computed = {path[1] for path in mechanism.expressions if path[0] in {"bodies", "joints"}}  # change with parameters
    is_drawn = is_in_world_coordinates(mechanism)
    found = []
    for member in system.members[: len(mechanism.joints)]:
        lengths = [gaps[k] for k in member.rows if system.rows[k].kind == "length"]
        gap = math.hypot(*lengths)
        is_exact = is_drawn and not isinstance(member.owner, Cam)
        is_exact = is_exact and computed.isdisjoint({*member.owner.bodies(), member.owner.name})
        allowed = (DRAWN if is_exact else ROUGH) * system.size
        if member.bodies and complete.issuperset(member.bodies) and gap > allowed:
            found.append(OpenJoint(member.owner.name, gap))
    return sorted(found, key=lambda one: -one.gap)


def open_joints_text(system: System, q: FloatArray) -> str:
    """Return 'joint B has a gap of 82 mm' for the joints that complete start poses leave open; '' if there are none."""
    found, unit = open_joints(system, q), system.mechanism.length_unit
    shown = [f"joint {one.name} has a gap of {one.gap:.4g} {unit}" for one in found[:_MOST_LISTED]]
    more = len(found) - len(shown)
    return ", ".join([*shown, *([f"and {more} more"] if more else [])])
