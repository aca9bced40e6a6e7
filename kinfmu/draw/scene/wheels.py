"""Gears and belts as pitch circles, racks with their pinions."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene.instant import Instant
from kinfmu.draw.scene.placing import seen_from
from kinfmu.draw.scene.shape import Shape
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.joints import Gear, RackAndPinion
from kinfmu.mechanism.quantities.placement import body_of, unit_vector

_BELT = 0.3  # of the distance of the axles: radius of a belt's larger pulley, since files state only the ratio
_BEYOND = 0.35  # of the pinion's radius, additional length at both ends of a rack


def wheels(shown: Instant) -> Iterator[Shape]:
    """Yield gears, pulleys, belts and racks, in the world as drawn, whose axles are pinned on their carrier."""
    for joint in shown.joints:
        if isinstance(joint, Gear):
            yield from _pair(shown, joint)
        elif isinstance(joint, RackAndPinion):
            yield from _rack(shown, joint)


def _pair(shown: Instant, joint: Gear) -> Iterator[Shape]:
    """Yield two wheels with radii from the distance of their axles and their ratio."""
    a, b = (shown.axle(gear, joint.carrier) for gear in joint.between)
    if a is None or b is None or (distance := float(np.hypot(*(b - a)))) == 0.0:
        return
    ratio = joint.ratio
    is_belt = ratio == 1.0 or (ratio > 0.0 and GROUND_NAME not in joint.between)
    if is_belt:
        larger = _BELT * distance
        radii = (larger, larger / ratio) if ratio >= 1.0 else (larger * ratio, larger)
    else:
        second = distance / abs(1.0 - ratio)
        radii = (abs(ratio) * second, second)
    for body, centre, radius in zip(joint.between, (a, b), radii, strict=True):
        yield from _wheel(shown, joint.name, body, centre, radius)
    if is_belt:
        for ends in _belt(a, b, radii):
            yield Shape("belt", joint.name, joint.carrier, ends)
    reach = radii[0] if ratio < 0.0 or is_belt or radii[0] > radii[1] else -radii[0]
    yield Shape("contact", joint.name, joint.carrier, (a + (b - a) / distance * reach)[None])


def _belt(a: FloatArray, b: FloatArray, radii: tuple[float, float]) -> FloatArray:
    """Return the ends (2, 2, 2) of the straight parts of an open belt around two pulleys at a and b."""
    d = b - a
    lean = np.arccos((radii[0] - radii[1]) / np.hypot(*d))  # from the line of axles to the radius where the belt leaves
    angles = np.arctan2(d[1], d[0]) + lean * np.array([1.0, -1.0])
    off = np.column_stack([np.cos(angles), np.sin(angles)])
    return np.stack([a + radii[0] * off, b + radii[1] * off], axis=1)


def _rack(shown: Instant, joint: RackAndPinion) -> Iterator[Shape]:
    """Yield the rack over its path in the run, and the pinion."""
    holder, rack = map(body_of, joint.between)
    centre = shown.axle(joint.pinion, holder)
    if centre is None:
        return
    e = np.array(unit_vector(joint.axis))
    base = shown.placed(holder, np.array([[0.0, 0.0], e]))
    along = base[1] - base[0]
    across = np.array([-along[1], along[0]]) * (-1.0 if joint.radius > 0.0 else 1.0)
    radius = abs(joint.radius)
    contact = centre + radius * across
    way = seen_from(shown.poses[holder], shown.track(joint.between[1])) @ e
    way = way - way[0]
    end = _BEYOND * radius
    first, last = -np.nanmax(way) - end, -np.nanmin(way) + end  # part that passes the pinion, relative to the rack now
    ends = np.array([contact + first * along, contact + last * along])
    yield Shape("rack", joint.name, rack, ends, shown.colour(rack), direction=across)
    yield from _wheel(shown, joint.name, joint.pinion, centre, radius)
    yield Shape("contact", joint.name, rack, contact[None])


def _wheel(shown: Instant, joint: str, body: str, centre: FloatArray, radius: float) -> Iterator[Shape]:
    angle, colour = shown.angle(body), shown.colour(body)
    end = centre + radius * np.array([np.cos(angle), np.sin(angle)])
    yield Shape("wheel", joint, body, centre[None], colour, radius=radius)
    yield Shape("spoke", joint, body, np.array([centre, end]), colour)
