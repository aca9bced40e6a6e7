"""Operations that move pins: all points held together move, and the numbers of joints and drivers follow."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from kinfmu.errors import MechanismError, listed
from kinfmu.mechanism.body import GROUND_NAME
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
from kinfmu.mechanism.loads import Load
from kinfmu.mechanism.members import LENGTH
from kinfmu.mechanism.quantities.placement import Placement, body_of
from kinfmu.page.editor.drawing import Spot
from kinfmu.page.editor.pen import OperationArguments, Pen
from kinfmu.page.editor.tables import references

_KEYS = {Distance: "length", Coordinate: "value", RackAndPinion: "offset", CamTranslating: "offset"}
_SQUARE = 1e-9  # cosine of lines at right angles
_CHANGED = 1e-12  # of the size; numbers that differ by less stay as they are written


def move(pen: Pen, values: OperationArguments) -> None:
    """Move a point with all that is pinned to it."""
    point = pen.drawing.point(values.text("point"), f"{values.name}: point")
    to = values.spot("to")
    if values.truth("exact") and not pen.is_same(near := _on_lines(pen, _moved_with(pen, point), to), to):
        place = ", ".join(f"{x:.6g}" for x in near)
        raise values.error(f"{point} slides on a line, on which {place} is the nearest place; move that line first")
    carry(pen, point, to)


def length(pen: Pen, values: OperationArguments) -> None:
    """Move one of two points to a distance from the other: not the one on the ground, and first one that slides.

    It moves along the line of both, with a slot that nothing else holds; else along the line on which it slides.
    """
    first, second = (pen.drawing.point(one, f"{values.name}: between") for one in values.texts("between", 2))
    value, pins = values.number("value"), pen.drawing.pins
    if not value > 0.0:
        raise values.error(f"value = {value!r} must be positive")
    if second in pins[first] or pen.is_same(pen.spot(first), pen.spot(second)):
        raise values.error(f"{first} and {second} are in one place, so their line has no direction")

    def rank(end: str) -> tuple[bool, bool]:
        return GROUND_NAME in map(body_of, pins[end]), not _lines_under(pen, pins[end])

    end, other = (first, second) if rank(first) < rank(second) else (second, first)
    lines = _lines_under(pen, pins[end])
    if len(lines) > 1:
        raise values.error(f"{end} slides on the lines of joints {listed(line.joint for line in lines)}; free it first")
    (x, y), (to_x, to_y) = pen.spot(other), pen.spot(end)
    part = value / math.dist((x, y), (to_x, to_y))
    to = (x + part * (to_x - x), y + part * (to_y - y))
    places = {}
    for line in lines:
        places = _slot_through(pen, line, to)
        if not places:
            foot, across = line.split(pen.spot(other))
            if value < abs(across):
                text = f"{abs(across):.6g} {pen.drawing.mechanism.length_unit} from {other}"
                raise values.error(f"{end} slides on the line of joint '{line.joint}', {text}; move that line first")
            half, now = math.sqrt(value * value - across * across), line.split(pen.spot(end))[0]
            to = line.place(min((foot + half, foot - half), key=lambda along: abs(along - now)))
    _put_places(pen, dict.fromkeys(pins[end], to) | places)


class _Line(NamedTuple):
    """A line on which a point slides: of a joint and a body, through a place, in a direction of the world."""

    joint: str
    body: str
    through: Spot
    along: Spot

    def split(self, spot: Spot) -> Spot:
        """Return how far a place is along the line from where it begins, and across it."""
        (x, y), (e_x, e_y) = self.through, self.along
        d_x, d_y = spot[0] - x, spot[1] - y
        return d_x * e_x + d_y * e_y, d_y * e_x - d_x * e_y

    def place(self, along: float, across: float = 0.0) -> Spot:
        """Return the place so far along the line and across it."""
        (x, y), (e_x, e_y) = self.through, self.along
        return x + along * e_x - across * e_y, y + along * e_y + across * e_x


def _lines_under(pen: Pen, group: frozenset[str]) -> list[_Line]:
    """Return the lines on which points slide, and which begin in other points."""
    found = []
    for joint in pen.drawing.mechanism.joints:
        if isinstance(joint, PointOnLine | Translational):
            origin, held = joint.between
            if isinstance(joint, Translational) and body_of(held) == GROUND_NAME:
                origin, held = held, origin
            if held in group and origin not in group:
                found.append(_Line(joint.name, body_of(origin), pen.spot(origin), _direction(pen, joint)))
    return found


def _slot_through(pen: Pen, line: _Line, to: Spot) -> dict[str, Spot]:
    """Return places of the points of a slot that is moved to a place; none if it is on the ground or holds others."""
    mechanism = pen.drawing.mechanism
    splits = {one: line.split(pen.spot(one)) for one in mechanism.body_points if body_of(one) == line.body}
    own = {one: along for one, (along, across) in splits.items() if pen.is_same((0.0, across), (0.0, 0.0))}
    members: list[Joint | Driver | Load] = [*mechanism.joints, *mechanism.drivers, *mechanism.loads]
    holding = (one for one in members if one.name != line.joint and not _slides_across(pen, one, line.along))
    held = {one for member in holding for one in references(member)}
    if line.body == GROUND_NAME or held & own.keys():
        return {}
    return {one: line.place(along, line.split(to)[1]) for one, along in own.items()}


def _slides_across(pen: Pen, member: Joint | Driver | Load, along: Spot) -> bool:
    """Return whether a joint is a slide at right angles to a direction."""
    if not isinstance(member, PointOnLine | Translational):
        return False
    e_x, e_y = _direction(pen, member)
    return abs(e_x * along[0] + e_y * along[1]) <= _SQUARE


def _direction(pen: Pen, joint: PointOnLine | Translational) -> Spot:
    """Return the direction of the line of a slide in the world."""
    e_x, e_y = pen.drawing.placement.direction(body_of(joint.between[0]), float(joint.axis))
    return float(e_x), float(e_y)


def carry(pen: Pen, point: str, to: Spot) -> None:
    """Move a point to a place, with all that is pinned to it; lengths, offsets and drivers follow."""
    moved = _moved_with(pen, point)
    _put_places(pen, dict.fromkeys(moved, _on_lines(pen, moved, to)))


def _put_places(pen: Pen, places: dict[str, Spot]) -> None:
    """Move points to places, pins on lines whose points move with them; lengths, offsets and drivers follow."""
    drawing, moved = pen.drawing, frozenset(places)
    for joint in drawing.mechanism.joints:
        if isinstance(joint, PointOnLine | Translational):
            origin, held = joint.between
            if origin in moved and held not in moved:
                n_x, n_y = drawing.placement.direction(body_of(origin), float(joint.axis) + 0.5 * math.pi)
                (x, y), (to_x, to_y), (was_x, was_y) = pen.spot(held), places[origin], pen.spot(origin)
                across = float(n_x) * (to_x - was_x) + float(n_y) * (to_y - was_y)
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
    for line in _lines_under(pen, moved):
        return line.place(line.split(to)[0])
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
