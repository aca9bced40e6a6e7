"""Marks that only figures and animations have: pins and points with names, an open gap, gravity; values of drivers."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.names import Mark, Name
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.instant import Instant, gravity_direction
from kinfmu.draw.scene.joints import slides
from kinfmu.draw.scene.loads import BETWEEN
from kinfmu.draw.scene.strokes import STROKES
from kinfmu.draw.sheet import GREY, INK, Sheet
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.drivers import DistanceDriver, Driver
from kinfmu.mechanism.joints import CamRoller, Distance, Fixed, PointOnLine, Revolute, Translational
from kinfmu.mechanism.quantities.placement import body_of, point_of
from kinfmu.plan.equations.system import size_of

_SAME = 1e-6  # of the size; points that are nearer are one place
_ORDER = ("loose", "slide", "weld", "pin")  # kinds of places; if one place has several, the last one is drawn
_RED = palette.STATUS[3]
_BOX, _LENGTH = 44.0, 26.0  # [pt]; side of the free square, length of the arrow
_SMALL, _LETTER = 22.0, 8.0  # [pt]; length of the arrow in the margin of an animation, distance of its letter
_CORNERS = ((0.0, 1.0), (0.0, 0.0), (1.0, 0.0), (1.0, 1.0))  # of the sheet; the note is in the last one
_EDGE, _BELOW_NOTE = 4.0, 14.0  # [pt] from the edge of the sheet
_GRAVITY_HEAD = np.array([6.0, 2.4])  # [pt]


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

    def draw(self, sheet: Sheet) -> list[Name]:
        if self.kind in STROKES:
            sheet.dot(self.kind, self.at)
        if self.colour is not None:
            sheet.dot("point", self.at, self.colour)
        colour = INK if self.colour is None else palette.darker(self.colour)
        clearance = 0.5 * sheet.bar + 1.0
        return [Name(self.text, self.at[None], clearance, colour, rank=0)] if self.text else []


@dataclass(frozen=True, eq=False)
class PathMark(Mark):
    """The path of a point of interest over the run: points (n, 2), NaN in gaps."""

    at: FloatArray
    colour: palette.Colour

    def extent(self) -> FloatArray:
        return self.at[np.isfinite(self.at).all(axis=1)]

    def draw(self, sheet: Sheet) -> list[Name]:
        sheet.track(self.at, STROKES["path"][0].width, self.colour)
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


def value_text(shown: Instant, driver: Driver, value: float) -> str:
    """Return a driver's value with its unit, to a tenth of a degree or to four digits of the mechanism's size."""
    if driver.quantity.kind == "angle":
        return f"{round(math.degrees(value), 1) + 0.0:.6g}\N{DEGREE SIGN}"
    finest = 4 - math.ceil(math.log10(size_of(shown.mechanism)))
    return f"{round(value, finest) + 0.0:.6g} {shown.mechanism.length_unit}"


def _arrow(
    sheet: Sheet, route: FloatArray, stroke: float, head: FloatArray, colour: palette.Colour, matters: float
) -> None:
    """Draw a line (k, 2) with an arrow head at its end.

    stroke: width of the line [pt]; head: length and half width of the head [length].
    """
    tip, before = route[-1], route[-2]
    along = (tip - before) / np.hypot(*(tip - before))
    across = head[1] * np.array([-along[1], along[0]])
    base = tip - head[0] * along
    sheet.line([*route[:-1], base], stroke, colour, matters=matters)
    sheet.line([tip, base + across, base - across], 0.4, colour, closed=True, fill=colour, matters=matters)


@dataclass(frozen=True, eq=False)
class GapMark(Mark):
    """A gap between two points (2, 2), and its name."""

    at: FloatArray
    text: str

    def draw(self, sheet: Sheet) -> list[Name]:
        sheet.line(self.at, 2.2, _RED, matters=2.0)
        return [Name(self.text, self.at.mean(axis=0)[None], 0.5 * sheet.bar + 1.0, _RED, rank=0)]


def gaps(shown: Instant) -> Iterator[GapMark]:
    """Yield the mark of the open joint, if it joins two points."""
    for joint in shown.joints:
        if shown.open_gap is not None and joint.name == shown.open_gap.joint:
            points = [point for point in getattr(joint, "between", ()) if point in shown.body_points]
            if len(points) == 2:
                yield GapMark(np.array([shown.point(point) for point in points]), shown.open_gap.text)


def gap_note(shown: Instant) -> str:
    """Return a sentence on the gap of a mechanism that does not close; '' for one that does."""
    gap = shown.open_gap
    return "" if gap is None else f"does not close: {gap.text} at {gap.joint}"


def gravity(sheet: Sheet, mechanism: Mechanism) -> list[Name]:
    """Draw the direction of gravity, if bodies have masses and a corner of the sheet is free, and return its name."""
    along = gravity_direction(mechanism)
    if along is None:
        return []
    for corner in map(np.array, _CORNERS):
        inside = (0.5 * _BOX + _EDGE) * (1.0 - 2.0 * corner)
        middle = corner * sheet.to_paper(sheet.high) + inside - [0.0, _BELOW_NOTE * (corner == 1.0).all()]  # [pt]
        near = np.abs(sheet.covered[:, :2] - middle) < 0.5 * _BOX
        if not near.all(axis=1).any():
            _gravity_arrow(sheet, middle, _LENGTH * along)
            return [Name("g", sheet.low + middle[None] * sheet.point, 4.0, GREY, italic=True, rank=5)]
    return []


def gravity_in_margin(sheet: Sheet, mechanism: Mechanism) -> None:
    """Draw the direction of gravity with its letter in the margin of an animation, which the linkage never enters."""
    along = gravity_direction(mechanism)
    if along is None:
        return
    top = float(sheet.to_paper(sheet.high)[1])
    middle = np.array([_EDGE, top - _EDGE]) + 0.5 * _SMALL * np.array([1.0, -1.0])
    _gravity_arrow(sheet, middle, _SMALL * along)
    aside = np.array([1.0, 0.0]) if abs(along[1]) >= abs(along[0]) else np.array([0.0, -1.0])
    sheet.text(middle + _LETTER * aside, "g", GREY, italic=True)


def _gravity_arrow(sheet: Sheet, middle: FloatArray, arrow: FloatArray) -> None:
    """Draw an arrow (2,) about its middle [pt]."""
    route = sheet.low + np.array([middle - 0.5 * arrow, middle + 0.5 * arrow]) * sheet.point
    _arrow(sheet, route, 1.0, _GRAVITY_HEAD * sheet.point, GREY, 1.0)
