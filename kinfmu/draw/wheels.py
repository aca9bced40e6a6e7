"""Gears and belts as pitch circles, racks with their pinions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kinfmu.draw.instant import Instant
from kinfmu.draw.mark import Mark
from kinfmu.draw.names import Name
from kinfmu.draw.sheet import PAPER, Sheet, box
from kinfmu.joints import Gear, RackAndPinion
from kinfmu.joints.placement import body_of, unit_vector
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.run import FloatArray
from kinfmu.shapes import palette
from kinfmu.shapes.placing import seen_from

_BELT = 0.3  # radius of the larger pulley of a belt beside the distance of the axles, where only the ratio is known
_TEETH = 9.0  # [pt] from tooth to tooth of a rack, where there is room
_TOOTH, _BACK = 4.0, 6.0  # [pt]; half height of the teeth, thickness of the rack behind them
DASHES = (0, (7.0, 2.0, 1.5, 2.0))  # of a pitch circle


@dataclass(frozen=True, eq=False)
class Wheel(Mark):
    """A gear or pulley: its pitch circle, with a spoke that turns with it; angle: of the spoke [rad]."""

    centre: FloatArray
    radius: float
    angle: float
    colour: palette.Colour
    filled: bool = True

    def extent(self) -> FloatArray:
        return np.array([self.centre - self.radius, self.centre + self.radius])

    def draw(self, sheet: Sheet) -> list[Name]:
        edge = palette.darker(self.colour)
        light = palette.lighter(palette.lighter(palette.lighter(self.colour))) if self.filled else None
        sheet.circle(self.centre, self.radius, 1.0, edge, fill=light, style=DASHES, matters=0.6)
        spoke = self.centre + self.radius * np.array([np.cos(self.angle), np.sin(self.angle)])
        sheet.line([self.centre, spoke], 1.0, edge, matters=0.4)
        return []


@dataclass(frozen=True, eq=False)
class Belt(Mark):
    """The open belt around two pulleys."""

    centres: FloatArray  # (2, 2)
    radii: tuple[float, float]

    def extent(self) -> FloatArray:
        return self.centres

    def draw(self, sheet: Sheet) -> list[Name]:
        (a, b), (r, s) = self.centres, self.radii
        d = b - a
        distance = float(np.hypot(*d))
        lean = np.arccos((r - s) / distance)  # of the radius to where the belt leaves, against the line of the axles
        for side in (1.0, -1.0):
            angle = np.arctan2(d[1], d[0]) + side * lean
            off = np.array([np.cos(angle), np.sin(angle)])
            sheet.line([a + r * off, b + s * off], 1.6, palette.darker(palette.GROUND), matters=0.6)
        return []


@dataclass(frozen=True, eq=False)
class Rack(Mark):
    """A toothed bar: ends (2, 2) of its pitch line; towards: unit vector from the teeth to its back."""

    ends: FloatArray
    towards: FloatArray
    colour: palette.Colour

    def extent(self) -> FloatArray:
        return self.ends

    def draw(self, sheet: Sheet) -> list[Name]:
        size = sheet.ornament
        along = self.ends[1] - self.ends[0]
        length = float(np.hypot(*along))
        along = along / length
        count = max(round(length / (_TEETH * size)), 2)
        pitch = length / count
        profile = ((0.0, 1.0), (0.25, 1.0), (0.4, -1.0), (0.6, -1.0), (0.75, 1.0))  # of one tooth: part of pitch, depth
        teeth = [
            self.ends[0] + (k + part) * pitch * along + depth * _TOOTH * size * self.towards
            for k in range(count)
            for part, depth in profile
        ]
        back = (_TOOTH + _BACK) * size * self.towards
        corners = [*teeth, self.ends[1] + _TOOTH * size * self.towards, self.ends[1] + back, self.ends[0] + back]
        edge, fill = palette.darker(self.colour), palette.lighter(self.colour)
        room = box(self.ends.mean(axis=0), along, length / 2.0, (_TOOTH + 2.0) * size)  # where the body's own bar lies
        sheet.line(room, 0.0, PAPER, closed=True, fill=PAPER, matters=0.0)
        sheet.line(corners, 0.9, edge, closed=True, fill=fill)
        sheet.line(self.ends, 0.7, edge, style=DASHES, matters=0.0)
        return []


@dataclass(frozen=True, eq=False)
class MeshName(Mark):
    """The name of a pair of wheels, of a rack and its pinion, or of a cam and its follower, where they meet."""

    name: str
    at: FloatArray

    def extent(self) -> FloatArray:
        return self.at[None]

    def draw(self, sheet: Sheet) -> list[Name]:  # noqa: ARG002  it is only a name
        return [Name(self.name, self.at[None], 3.0, palette.darker(palette.GROUND), italic=True, rank=4)]


def wheels(shown: Instant) -> list[Mark]:
    """Gear pairs and belts; larger wheels below smaller ones."""
    marks = [mark for joint in shown.mechanism.joints if isinstance(joint, Gear) for mark in _pair(shown, joint)]
    return sorted(marks, key=lambda mark: -mark.radius if isinstance(mark, Wheel) else 0.0)


def racks(shown: Instant) -> list[Mark]:
    """Racks and their pinions; over the links, for a rack is often a link too."""
    joints = shown.mechanism.joints
    return [mark for joint in joints if isinstance(joint, RackAndPinion) for mark in _rack(shown, joint)]


def _pair(shown: Instant, joint: Gear) -> list[Mark]:
    """Two wheels, from the distance of their axles and their ratio."""
    a, b = (shown.axle(gear, joint.carrier) for gear in joint.between)
    if a is None or b is None:
        return []
    distance = float(np.hypot(*(b - a)))
    if distance == 0.0:
        return []
    ratio, is_belt = joint.ratio, joint.ratio > 0.0 and GROUND_NAME not in joint.between
    is_belt = is_belt or ratio == 1.0
    if is_belt:
        larger = _BELT * distance
        radii = (larger, larger / ratio) if ratio >= 1.0 else (larger * ratio, larger)
    else:
        second = distance / abs(1.0 - ratio)
        radii = (abs(ratio) * second, second)
    marks: list[Mark] = [
        Wheel(centre, radius, shown.angle(gear), shown.colour(gear))
        for gear, centre, radius in zip(joint.between, (a, b), radii, strict=True)
    ]
    if is_belt:
        marks.append(Belt(np.array([a, b]), radii))
    towards = (b - a) / distance
    meets = a + towards * (radii[0] if ratio < 0.0 or is_belt or radii[0] > radii[1] else -radii[0])
    return [*marks, MeshName(joint.name, meets)]


def _rack(shown: Instant, joint: RackAndPinion) -> list[Mark]:
    """The pinion, and the rack along its way over the run."""
    holder, rack = map(body_of, joint.between)
    centre = shown.axle(joint.pinion, holder)
    if centre is None:
        return []
    e_x, e_y = unit_vector(joint.axis)
    base = shown.placed(holder, np.array([[0.0, 0.0], [e_x, e_y]]))
    along = base[1] - base[0]
    across = np.array([-along[1], along[0]]) * (-1.0 if joint.radius > 0.0 else 1.0)
    radius = abs(joint.radius)
    contact = centre + radius * across
    way = seen_from(shown.poses[holder], shown.track(joint.between[1])) @ np.array([e_x, e_y])
    way = way - way[0]
    end = 0.35 * radius  # of the rack beyond where it is needed
    first, last = -np.nanmax(way) - end, -np.nanmin(way) + end  # what passes the pinion, against the rack's place now
    ends = np.array([contact + first * along, contact + last * along])
    return [
        Rack(ends, across, shown.colour(rack)),
        Wheel(centre, radius, shown.angle(joint.pinion), shown.colour(joint.pinion), filled=False),
        MeshName(joint.name, contact),
    ]
