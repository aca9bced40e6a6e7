"""Operations that move pins: all points held together move, and the numbers of joints and drivers follow."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from kinfmu.errors import MechanismError
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.edits import Place
from kinfmu.mechanism.joints import (
    CamFlatFace,
    CamRoller,
    CamTranslating,
    Coordinate,
    Distance,
    PointOnLine,
    RackAndPinion,
    Translational,
)
from kinfmu.mechanism.joints.joint import Joint
from kinfmu.mechanism.laws import ConstantValue, Law, Polynomial
from kinfmu.mechanism.members import LENGTH
from kinfmu.mechanism.quantities.placement import Placement, body_of
from kinfmu.page.editor.drawing import Spot
from kinfmu.page.editor.pen import OperationArguments, Pen

_KEYS = {Distance: "length", Coordinate: "value", RackAndPinion: "offset", CamTranslating: "offset"}
_CHANGED = 1e-12  # of the size; numbers that differ by less stay as they are written


def move(pen: Pen, values: OperationArguments) -> None:
    """Move a point with all that is pinned to it."""
    point = pen.drawing.point(values.text("point"), f"{values.name}: point")
    to = values.spot("to")
    kept = []
    if values.has("keep"):
        for pair in values.entries("keep"):
            if not isinstance(pair, list) or len(pair) != 2 or not all(isinstance(one, str) for one in pair):
                raise values.wrong("keep", "a list of pairs of points")
            kept.append([pen.drawing.point(one, f"{values.name}: keep") for one in pair])
    carry(pen, point, _kept(pen, values, point, to, kept))


def length(pen: Pen, values: OperationArguments) -> None:
    """Move the second of two points along their line, to a distance from the first."""
    first, second = (pen.drawing.point(one, f"{values.name}: between") for one in values.texts("between", 2))
    value = values.number("value")
    if not value > 0.0:
        raise values.error(f"value = {value!r} must be positive")
    a, b = pen.spot(first), pen.spot(second)
    if second in _moved_with(pen, first) or pen.is_same(a, b):
        raise values.error(f"{first} and {second} are in one place, so their line has no direction")
    part = value / math.dist(a, b)
    carry(pen, second, (a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])))


def _kept(pen: Pen, values: OperationArguments, point: str, to: Spot, kept: list[list[str]]) -> Spot:
    """Return the place nearest to another one at which lengths from points that do not move stay."""
    moved = _moved_with(pen, point)
    circles: dict[Spot, float] = {}
    for a, b in kept:
        if (a in moved) != (b in moved):
            fixed, end = map(pen.spot, (b, a) if a in moved else (a, b))
            circles.setdefault(fixed, math.dist(fixed, end))
    if len(circles) > 2:
        raise values.error(f"{point} is held by {len(circles)} lengths that stay, so it cannot move; release one")
    if not circles:
        return to
    (centre, radius), *others = circles.items()
    spot = pen.spot(point)
    if not others:
        away = math.dist(centre, to)
        if away == 0.0:
            return spot
        part = radius / away
        return centre[0] + part * (to[0] - centre[0]), centre[1] + part * (to[1] - centre[1])
    other = others[0][0]
    d_x, d_y = other[0] - centre[0], other[1] - centre[1]
    across = 2.0 * ((spot[0] - centre[0]) * -d_y + (spot[1] - centre[1]) * d_x) / math.dist(centre, other) ** 2
    mirrored = spot[0] + across * d_y, spot[1] - across * d_x
    return min(spot, mirrored, key=lambda place: math.dist(place, to))  # two lengths allow these two places


def carry(pen: Pen, point: str, to: Spot) -> None:
    """Move a point to a place, with all that is pinned to it; lengths, offsets and drivers follow."""
    drawing = pen.drawing
    moved = _moved_with(pen, point)
    to = _on_lines(pen, moved, to)
    places = dict.fromkeys(moved, to)
    shift = (to[0] - pen.spot(point)[0], to[1] - pen.spot(point)[1])
    for joint in drawing.mechanism.joints:  # pins on a line whose point moves
        if isinstance(joint, PointOnLine | Translational):
            origin, held = joint.between
            if origin in moved and held not in moved:
                n_x, n_y = drawing.placement.direction(body_of(origin), float(joint.axis) + 0.5 * math.pi)
                across = float(n_x) * shift[0] + float(n_y) * shift[1]
                x, y = pen.spot(held)
                places |= dict.fromkeys(_moved_with(pen, held) - moved, (x + across * n_x, y + across * n_y))
    local = {one: drawing.seen_from(body_of(one), spot) for one, spot in places.items()}
    for one in drawing.mechanism.body_points:  # in the order of the file
        if one in local:
            _put_point(pen, one, local[one])
    _follow(pen, local)


def _moved_with(pen: Pen, point: str) -> frozenset[str]:
    """Return the points that move with a point: pinned to it, and of slides that begin in its place."""
    pins, found, open_ones = pen.drawing.pins, set[str](), [point]
    lines = [one for one in pen.drawing.mechanism.joints if isinstance(one, PointOnLine | Translational)]
    while open_ones:
        group = pins[open_ones.pop()] - found
        found |= group
        for joint in lines:
            a, b = joint.between
            for one, other in ((a, b), (b, a)):
                if one in group and other not in found and pen.is_same(pen.spot(a), pen.spot(b)):
                    open_ones.append(other)
    return frozenset(found)


def _on_lines(pen: Pen, moved: frozenset[str], to: Spot) -> Spot:
    """Return the place on the line of a slide, elsewhere than in its point, on which a moved point stays."""
    for joint in pen.drawing.mechanism.joints:
        if isinstance(joint, PointOnLine | Translational):
            origin, held = joint.between
            if held in moved and origin not in moved:
                e_x, e_y = pen.drawing.placement.direction(body_of(origin), float(joint.axis))
                x, y = pen.spot(origin)
                along = (to[0] - x) * float(e_x) + (to[1] - y) * float(e_y)
                return x + along * float(e_x), y + along * float(e_y)
    return to


def _put_point(pen: Pen, point: str, spot: Spot) -> None:
    body, _, name = point.partition(".")
    place = ("bodies", body, "points", name)
    if name not in pen.document.get("bodies", {}).get(body, {}).get("points", {}):
        raise MechanismError(f"point {point} is in a repeated part of the file; change its text")
    old = pen.drawing.mechanism.body_points[point]
    values = [
        was if abs(value - float(was)) <= _CHANGED * abs(float(was)) else value
        for was, value in zip(old, spot, strict=True)
    ]
    if any(value is not was for value, was in zip(values, old, strict=True)):
        written = pen.document["bodies"][body]["points"][name]
        new = [
            written[k] if value is was else pen.written((*place, k), was, value, LENGTH)
            for k, (value, was) in enumerate(zip(values, old, strict=True))
        ]
        pen.put(place, new)


def _follow(pen: Pen, local: Mapping[str, Spot]) -> None:
    """Change the numbers of joints and drivers by what moved points open; local: new coordinates of points."""
    drawing = pen.drawing
    old = drawing.placement
    new = Placement(old.poses, {**old.points, **local})
    owners: list[Joint | Driver] = [*drawing.mechanism.joints, *drawing.mechanism.drivers]
    for owner in owners:
        if isinstance(owner, Driver):
            by = float(owner.measured().value(new)) - float(owner.measured().value(old))
            _shift_law(pen, ("drivers", owner.name), owner.law, by)
        elif isinstance(owner, Distance | Coordinate):
            by = float(owner.measured()[0].value(new)) - float(owner.measured()[0].value(old))
            _shift(pen, ("joints", owner.name, _KEYS[type(owner)]), getattr(owner, _KEYS[type(owner)]), by)
        elif isinstance(owner, RackAndPinion | CamTranslating):
            by = float(owner.residual(new)[0]) - float(owner.residual(old)[0])
            _shift(pen, ("joints", owner.name, "offset"), owner.offset, by)
        elif isinstance(owner, CamRoller | CamFlatFace):
            by = float(owner.residual(new)[0]) - float(owner.residual(old)[0])
            _shift_law(pen, ("joints", owner.name), owner.law, by)


def _shift(pen: Pen, place: Place, old: Any, by: float) -> None:
    if abs(by) > _CHANGED * pen.drawing.size:
        pen.put(place, pen.written(place, old, float(old) + by, LENGTH))


def _shift_law(pen: Pen, owner: Place, law: Law, by: float) -> None:
    """Shift the values of a law that is a length, if it has a number for that."""
    if isinstance(law, ConstantValue):
        _shift(pen, (*owner, "level"), law.level, by)
    elif isinstance(law, Polynomial):
        if abs(by) > _CHANGED * pen.drawing.size:
            first = pen.written((*owner, "coefficients"), law.coefficients[0], float(law.coefficients[0]) + by, LENGTH)
            table: Any = pen.document
            for key in owner:
                table = table[key]
            pen.put((*owner, "coefficients"), [first, *table["coefficients"][1:]])
    elif hasattr(law, "start"):
        _shift(pen, (*owner, "start"), law.start, by)
