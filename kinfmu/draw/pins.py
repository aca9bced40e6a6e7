"""Pins, welds, loose points and points of interest, with their names."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.names import Mark, Name
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.details import box
from kinfmu.draw.scene.instant import Instant
from kinfmu.draw.scene.load_shapes import BETWEEN
from kinfmu.draw.scene.slides import slides
from kinfmu.draw.sheet import BAR, INK, PAPER, Sheet
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.drivers import DistanceDriver
from kinfmu.mechanism.joints import CamRoller, Distance, Fixed, PointOnLine, Revolute, Translational
from kinfmu.mechanism.quantities.placement import body_of, point_of

_SAME = 1e-6  # of the size; points that are nearer are one place
_ORDER = ("loose", "slide", "weld", "pin")  # kinds of places; if one place has several, the last one is drawn


@dataclass(eq=False)
class _Place:
    """The content of one place: kinds of _ORDER, names of joints, of points, and of points of interest."""

    at: FloatArray
    kinds: set[str] = field(default_factory=set)
    joints: list[str] = field(default_factory=list)
    points: list[str] = field(default_factory=list)
    interest: dict[str, palette.Colour] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Pin(Mark):
    """One place with a name: a pin, a weld, a loose point of a body, or only a point of interest.

    colour: of the point of interest at this place, None if there is none.
    """

    at: FloatArray
    kind: str
    text: str
    colour: palette.Colour | None

    def extent(self) -> FloatArray:
        return self.at[None]

    def draw(self, sheet: Sheet) -> list[Name]:
        size = BAR * sheet.fine * sheet.point
        if self.kind == "pin":
            sheet.circle(self.at, 0.34 * size, 1.1, INK, fill=PAPER, matters=2.0)
        elif self.kind == "weld":
            square = box(self.at, np.array([1.0, 0.0]), 0.32 * size, 0.32 * size)
            sheet.line(square, 0.5, INK, closed=True, fill=INK, matters=2.0)
        elif self.kind == "loose":
            sheet.circle(self.at, 0.14 * size, 0.5, INK, fill=INK, matters=1.0)
        if self.colour is not None:
            colour = palette.darker(self.colour)
            sheet.circle(self.at, (0.17 if self.kind == "pin" else 0.24) * size, 0.5, colour, fill=colour, matters=2.0)
        colour = INK if self.colour is None else palette.darker(self.colour)
        clearance = 0.5 * BAR * sheet.fine + 1.0
        return [Name(self.text, self.at[None], clearance, colour, rank=0)] if self.text else []


@dataclass(frozen=True, eq=False)
class PathMark(Mark):
    """The path of a point of interest over the run: points (n, 2), NaN in gaps."""

    points: FloatArray
    colour: palette.Colour

    def extent(self) -> FloatArray:
        return self.points[np.isfinite(self.points).all(axis=1)]

    def draw(self, sheet: Sheet) -> list[Name]:
        sheet.track(self.points, 0.9, self.colour)
        return []


def paths(shown: Instant) -> list[Mark]:
    """Return the paths of the points of interest."""
    first = len(shown.mechanism.moving_bodies)
    return [
        PathMark(shown.track(point)[1:], palette.body(first + index))
        for index, point in enumerate(shown.mechanism.points.values())
        if len(shown.track(point)) > 1
    ]


def pins(shown: Instant) -> list[Mark]:
    """Return all places that have a name."""
    mechanism = shown.mechanism
    names = list(shown.body_points)
    where = np.array([shown.point(name) for name in names]).reshape(-1, 2)
    near = _SAME * (float(np.ptp(where, axis=0).max(initial=0.0)) or 1.0)
    home: dict[str, _Place] = {}
    for k, (name, at) in enumerate(zip(names, where, strict=True)):
        same = np.flatnonzero(np.hypot(*(where[:k] - at).T) <= near)
        home[name] = home[names[int(same[0])]] if len(same) else _Place(at)
    places = list(dict.fromkeys(home.values()))
    _note_joints(shown, home)
    used = {name for place in places for name in place.points}
    held = {joint.between[0] for joint in mechanism.joints if isinstance(joint, Translational | PointOnLine)}
    for name in names:
        if name not in used and name not in held and body_of(name) != GROUND_NAME:
            home[name].kinds.add("loose")
            home[name].points.append(name)
    for index, (name, point) in enumerate(mechanism.points.items()):
        home[point].interest[name] = palette.body(len(mechanism.moving_bodies) + index)
    return [_pin(place) for place in places if place.kinds or place.interest]


def _note_joints(shown: Instant, home: dict[str, _Place]) -> None:
    """Add joints, cylinders and springs to the places of their points."""
    for member in (*shown.joints, *shown.drivers):
        if not isinstance(member, Revolute | Fixed | Distance | DistanceDriver):
            continue
        for point in member.between:
            place = home[point]
            place.kinds.add("weld" if isinstance(member, Fixed) else "pin")
            place.points.append(point)
            if isinstance(member, Revolute | Fixed) and member.name not in place.joints:
                place.joints.append(member.name)
    for load in shown.mechanism.loads:
        if isinstance(load, BETWEEN) and shown.poses.keys() >= {*load.bodies()}:
            for point in load.between:
                home[point].kinds.add("pin")
                home[point].points.append(point)
    for joint in shown.joints:
        if isinstance(joint, CamRoller):
            home[joint.between[1]].kinds.add("pin")
            home[joint.between[1]].points.append(joint.between[1])
    for slide in slides(shown):
        home[slide.point].kinds.add("pin" if slide.turns else "slide")
        home[slide.point].points.append(slide.point)


def _pin(place: _Place) -> Pin:
    """Return the mark of a place; its names are those of its joints, else of its points, then of points of interest."""
    kind = max(place.kinds, key=_ORDER.index, default="")
    points = [point_of(name) for name in place.points]
    if kind == "slide" or (kind == "loose" and place.interest):
        points = []
    texts = dict.fromkeys([*(place.joints or points), *place.interest])
    return Pin(place.at, kind, ", ".join(texts), next(iter(place.interest.values()), None))
