"""Gears and belts as pitch circles, racks with their pinions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kinfmu.joints import Gear, RackAndPinion
from kinfmu.measures.placement import body_of, unit_vector
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.run import FloatArray
from kinfmu.scene.instant import Instant
from kinfmu.scene.placing import seen_from

_BELT = 0.3  # of the distance of the axles: radius of a belt's larger pulley, since files state only the ratio


@dataclass(frozen=True, eq=False)
class WheelShape:
    """A pitch circle of a body, in the world as drawn: centre (2,), radius [length]."""

    body: str
    centre: FloatArray
    radius: float


@dataclass(frozen=True, eq=False)
class GearPair:
    """Two wheels that mesh, or pulleys with a belt, on the body that carries both; meets: point of contact, (2,)."""

    joint: str
    wheels: tuple[WheelShape, WheelShape]
    carrier: str
    is_belt: bool
    meets: FloatArray

    def belt(self) -> FloatArray:
        """Return the ends (2, 2, 2) of the straight parts of an open belt around the two."""
        (a, r), (b, s) = ((wheel.centre, wheel.radius) for wheel in self.wheels)
        d = b - a
        lean = np.arccos((r - s) / np.hypot(*d))  # angle between the line of axles and the radius where the belt leaves
        angles = np.arctan2(d[1], d[0]) + lean * np.array([1.0, -1.0])
        off = np.column_stack([np.cos(angles), np.sin(angles)])
        return np.stack([a + r * off, b + s * off], axis=1)


@dataclass(frozen=True, eq=False)
class RackPair:
    """A rack and its pinion: ends (2, 2) of the rack's pitch line; towards: unit vector from the teeth to its back."""

    joint: str
    rack: str
    ends: FloatArray
    towards: FloatArray
    pinion: WheelShape
    contact: FloatArray


def gear_pairs(shown: Instant) -> list[GearPair]:
    """Return all gear pairs and belts whose axles are pinned on their carrier."""
    found = [_pair(shown, joint) for joint in shown.joints if isinstance(joint, Gear)]
    return [pair for pair in found if pair is not None]


def rack_pairs(shown: Instant) -> list[RackPair]:
    """Return all racks whose pinion is pinned on the body that holds both."""
    found = [_rack(shown, joint) for joint in shown.joints if isinstance(joint, RackAndPinion)]
    return [pair for pair in found if pair is not None]


def _pair(shown: Instant, joint: Gear) -> GearPair | None:
    """Return two wheels with radii from the distance of their axles and their ratio."""
    a, b = (shown.axle(gear, joint.carrier) for gear in joint.between)
    if a is None or b is None:
        return None
    distance = float(np.hypot(*(b - a)))
    if distance == 0.0:
        return None
    ratio = joint.ratio
    is_belt = ratio == 1.0 or (ratio > 0.0 and GROUND_NAME not in joint.between)
    if is_belt:
        larger = _BELT * distance
        radii = (larger, larger / ratio) if ratio >= 1.0 else (larger * ratio, larger)
    else:
        second = distance / abs(1.0 - ratio)
        radii = (abs(ratio) * second, second)
    first, last = map(WheelShape, joint.between, (a, b), radii)
    towards = (b - a) / distance
    meets = a + towards * (radii[0] if ratio < 0.0 or is_belt or radii[0] > radii[1] else -radii[0])
    return GearPair(joint.name, (first, last), joint.carrier, is_belt, meets)


def _rack(shown: Instant, joint: RackAndPinion) -> RackPair | None:
    """Return the pinion, and the rack over its path in the run."""
    holder, rack = map(body_of, joint.between)
    centre = shown.axle(joint.pinion, holder)
    if centre is None:
        return None
    e_x, e_y = unit_vector(joint.axis)
    base = shown.placed(holder, np.array([[0.0, 0.0], [e_x, e_y]]))
    along = base[1] - base[0]
    across = np.array([-along[1], along[0]]) * (-1.0 if joint.radius > 0.0 else 1.0)
    radius = abs(joint.radius)
    contact = centre + radius * across
    way = seen_from(shown.poses[holder], shown.track(joint.between[1])) @ np.array([e_x, e_y])
    way = way - way[0]
    end = 0.35 * radius  # additional length at both ends of the rack
    first, last = -np.nanmax(way) - end, -np.nanmin(way) + end  # part that passes the pinion, relative to the rack now
    ends = np.array([contact + first * along, contact + last * along])
    return RackPair(joint.name, rack, ends, across, WheelShape(joint.pinion, centre, radius), contact)
