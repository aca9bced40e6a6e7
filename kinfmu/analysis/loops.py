"""Loops that have a name, four-bars and slider-cranks, found among joints in any order and form; Grashof's class."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.joints import Angle, Coordinate, Distance, PointOnLine, Revolute, Translational
from kinfmu.mechanism.quantities.placement import body_of
from kinfmu.plan.equations.system import size_of

_SAME = 1e-12  # of the size; points of a body closer than this coincide
_ON_LINE = 1e-9  # [rad]; a point this close to a line is on it

_Point = tuple[float, float]
SAME_LENGTH = 1e-12  # of the sum of lengths; sums that differ by less are equal, such as 0.7 + 0.1 and 0.5 + 0.3


class Place(NamedTuple):
    """A point by its body and its coordinates in the body's frame [length]."""

    body: str
    x: float
    y: float

    def world(self, q: Mapping[str, float]) -> tuple[float, float]:
        """Return the world coordinates of the place; q: coordinates by name."""
        body, x, y = self
        if body == GROUND_NAME:
            return x, y
        of_x, of_y, of_phi = _names_of(body)
        phi = q[of_phi]
        c, s = math.cos(phi), math.sin(phi)
        return q[of_x] + c * x - s * y, q[of_y] + s * x + c * y

    def motion(self, q: Mapping[str, float], qd: Mapping[str, float]) -> tuple[float, float, float, float]:
        """Return the world coordinates of the place and their rates; qd: rates of the coordinates by name."""
        x, y = self.world(q)
        body = self.body
        if body == GROUND_NAME:
            return x, y, 0.0, 0.0
        of_x, of_y, of_phi = _names_of(body)
        omega = qd[of_phi]
        return x, y, qd[of_x] - omega * (y - q[of_y]), qd[of_y] + omega * (x - q[of_x])


@lru_cache(maxsize=1024)
def _names_of(body: str) -> tuple[str, str, str]:
    """Return the names of a body's coordinates, which are looked up at every pose."""
    return f"{body}.x", f"{body}.y", f"{body}.phi"


class Link(NamedTuple):
    """The connection of two pins of a loop: a body, or a distance joint."""

    name: str
    length: float


@dataclass(frozen=True)
class FourBar:
    """Ground and three moving links in one loop of four pins.

    frame: distance of the pins on the ground [length]; first and last are pinned to it, the coupler joins them. pins:
    the places O, P, Q, C, in the order of the loop (ground-first, first-coupler, coupler-last, last-ground).
    """

    frame: float
    first: Link
    coupler: Link
    last: Link
    pins: tuple[Place, Place, Place, Place]

    @property
    def lengths(self) -> tuple[float, float, float, float]:
        """Ground, first, coupler, last [length]."""
        return self.frame, self.first.length, self.coupler.length, self.last.length

    @property
    def links(self) -> tuple[str, str, str]:
        return self.first.name, self.coupler.name, self.last.name

    def turned_round(self) -> FourBar:
        """Return the same loop read from its other end."""
        return FourBar(self.frame, self.last, self.coupler, self.first, self.pins[::-1])

    def is_crossed(self, coordinates: Mapping[str, float]) -> bool:
        """Return True if two opposite sides of the loop cross in a pose; links that only touch do not."""
        o, p, q, c = (place.world(coordinates) for place in self.pins)
        return _cross(o, p, q, c) or _cross(p, q, c, o)


@dataclass(frozen=True)
class SliderCrank:
    """A crank pinned to the ground, and a rod whose other end is guided along a line fixed in the ground.

    offset: of the line from the crank's pivot, to the left of its direction [length]; direction: of the line [rad];
    pins: the places O, P, S; guide: name of the guiding joint; slider: the body that it guides, or the rod's name.
    """

    crank: Link
    rod: Link
    offset: float
    direction: float
    pins: tuple[Place, Place, Place]
    guide: str
    slider: str

    @property
    def links(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys((self.crank.name, self.rod.name, self.slider)))


@dataclass(frozen=True)
class Dyad:
    """Two links that meet at a pin, or a link with a point that is guided along a line fixed in the ground.

    first, second: the links; of a guided one, the second is the body that slides with it, or the guiding joint, with a
    length of 0. joint: the joint at which they meet, '' without one. pins: places on all bodies of each of its pins:
    the other pin of the first link, the common one, the other pin of the second link if it has one. direction: of the
    line [rad], None without one.
    """

    first: Link
    second: Link
    joint: str
    pins: tuple[tuple[Place, ...], ...]
    direction: float | None = None


class _Guide(NamedTuple):
    """A line in the ground along which a point is guided, by a joint, perhaps as part of a body that cannot turn."""

    x: float
    y: float
    direction: float
    joint: str
    slider: str | None


class _Edge(NamedTuple):
    link: Link
    end: int


def named_loops(
    mechanism: Mechanism, without: Iterable[str] = ()
) -> tuple[tuple[FourBar, ...], tuple[SliderCrank, ...]]:
    """Return the four-bars and slider-cranks of a mechanism, in the order of its ground pins and joints.

    A revolute joint counts as a pin, and so do two held coordinates of a point; a distance joint is a link of its own.
    without: names of joints to ignore, such as redundant ones.
    """
    net = _Net(mechanism, set(without))
    return tuple(net.four_bars()), tuple(net.slider_cranks())


def dyads(mechanism: Mechanism, without: Iterable[str] = ()) -> tuple[Dyad, ...]:
    """Return all pairs of links that meet at a moving pin, and all links with a guided point; `without` as above."""
    net = _Net(mechanism, set(without))
    return (*net.pairs(), *net.guided_links())


class _Net:
    """Pins as nodes, links as edges between them.

    A pin is a set of places, points of bodies that coincide in every pose.
    """

    def __init__(self, mechanism: Mechanism, without: set[str]) -> None:
        self.mechanism = mechanism
        self.points = mechanism.body_points
        self.grid = _SAME * size_of(mechanism)
        self.joints = [joint for joint in mechanism.joints if joint.name not in without]
        self.places: list[list[Place]] = []  # of each pin
        self._pin: dict[tuple[str, int, int], int] = {}
        for joint in self.joints:
            if isinstance(joint, Revolute):
                self._unite(*(self._place(point) for point in joint.between))
        pinned = [joint for joint in self.joints if isinstance(joint, Revolute)]
        self.names = {self._number(self._place(joint.between[0])): joint.name for joint in pinned}
        held = self._held_coordinates()
        for (point, axis), (x, _) in held.items():
            if axis == "x" and (point, "y") in held:  # both coordinates: a pin on the ground
                self._unite(Place(GROUND_NAME, x, held[point, "y"][0]), self._place(point))
        self.edges: dict[int, list[_Edge]] = {}
        for joint in self.joints:  # their ends are pins too
            if isinstance(joint, Distance):
                a, b = (self._number(self._place(point)) for point in joint.between)
                self._join(Link(joint.name, float(joint.length)), a, b)
        self.guides = self._guided()
        by_body: dict[str, list[tuple[int, Place]]] = {}
        for number, places in enumerate(self.places):
            for place in places:
                by_body.setdefault(place.body, []).append((number, place))
        self.ground = dict(by_body.pop(GROUND_NAME, ()))
        for body, pins in by_body.items():
            for k, (a, at_a) in enumerate(pins):
                for b, at_b in pins[k + 1 :]:
                    self._join(Link(body, _distance(at_a, at_b)), a, b)

    def four_bars(self) -> Iterator[FourBar]:
        """Yield each loop once, from its first end."""
        seen: set[frozenset[object]] = set()
        for o in self.ground:
            for first, p in self._moving_edges(o):
                for coupler, q in self._moving_edges(p):
                    for last, c in self.edges.get(q, ()):
                        names = {first.name, coupler.name, last.name}
                        key = frozenset({*names, o, p, q, c})
                        if c not in self.ground or c == o or q in (o, p) or len(names) < 3 or key in seen:
                            continue
                        seen.add(key)
                        frame = _distance(self.ground[o], self.ground[c])
                        pins = (self.ground[o], self._on(p, first, coupler), self._on(q, last, coupler), self.ground[c])
                        yield FourBar(frame, first, coupler, last, pins)

    def slider_cranks(self) -> Iterator[SliderCrank]:
        for o, pivot in self.ground.items():
            for crank, p in self._moving_edges(o):
                for rod, s in self._moving_edges(p):
                    for guide in self.guides.get(s, ()):
                        if rod.name == crank.name or s == o or guide.slider in (crank.name, rod.name):
                            continue
                        c, n = math.cos(guide.direction), math.sin(guide.direction)
                        offset = c * (guide.y - pivot.y) - n * (guide.x - pivot.x)
                        offset = 0.0 if abs(offset) <= self.grid else offset
                        pins = (pivot, self._on(p, crank, rod), self._on(s, rod, rod, guide.slider))
                        slider = guide.slider or rod.name
                        yield SliderCrank(crank, rod, offset, guide.direction, pins, guide.joint, slider)

    def pairs(self) -> Iterator[Dyad]:
        """Yield the pairs of links that meet at a pin which is not on the ground, one for each pair of other pins."""
        for q, edges in self.edges.items():
            links = [edge for edge in edges if edge.link.length > self.grid and q not in self.ground]
            for k, first in enumerate(links):
                for second in links[k + 1 :]:
                    if first.link.name != second.link.name and first.end != second.end:
                        pins = tuple(tuple(self.places[pin]) for pin in (first.end, q, second.end))
                        yield Dyad(first.link, second.link, self.names.get(q, ""), pins)

    def guided_links(self) -> Iterator[Dyad]:
        """Yield links with a guided point, one for each other pin."""
        for s, guides in self.guides.items():
            for rod in self.edges.get(s, ()):
                for guide in guides:
                    if rod.link.length > self.grid and rod.link.name != guide.slider:
                        slider = Link(guide.slider or guide.joint, 0.0)
                        pins = tuple(tuple(self.places[pin]) for pin in (rod.end, s))
                        yield Dyad(rod.link, slider, self.names.get(s, ""), pins, guide.direction)

    def _moving_edges(self, pin: int) -> Iterator[_Edge]:
        """Yield links from a pin to others that are not on the ground."""
        for edge in self.edges.get(pin, ()):
            if edge.end not in self.ground and edge.link.length > self.grid:
                yield edge

    def _on(self, pin: int, *wanted: Link | str | None) -> Place:
        """Return a pin as a point of the first of the wanted links that is a body, else of any."""
        names = [link.name if isinstance(link, Link) else link for link in wanted]
        return next((place for name in names for place in self.places[pin] if place.body == name), self.places[pin][0])

    def _place(self, point: str) -> Place:
        x, y = self.points[point]
        return Place(body_of(point), float(x), float(y))

    def _number(self, place: Place) -> int:
        """Return the number of the pin at a place; add one if there is none."""
        key = self._key(place)
        if key not in self._pin:
            self._pin[key] = len(self.places)
            self.places.append([place])
        return self._pin[key]

    def _key(self, place: Place) -> tuple[str, int, int]:
        return place.body, round(place.x / self.grid), round(place.y / self.grid)

    def _unite(self, a: Place, b: Place) -> None:
        into, gone = self._number(a), self._number(b)
        if into != gone:
            for place in self.places[gone]:
                self._pin[self._key(place)] = into
            self.places[into] += self.places[gone]
            self.places[gone] = []

    def _join(self, link: Link, a: int, b: int) -> None:
        self.edges.setdefault(a, []).append(_Edge(link, b))
        self.edges.setdefault(b, []).append(_Edge(link, a))

    def _held_coordinates(self) -> dict[tuple[str, str], tuple[float, str]]:
        """Return value and joint of each held coordinate of a point, by point and axis."""
        return {
            (joint.of, joint.axis): (float(joint.value), joint.name)
            for joint in self.joints
            if isinstance(joint, Coordinate)
        }

    def _guided(self) -> dict[int, list[_Guide]]:
        """Return the lines along which pins are guided, by pin."""
        held = self._held_coordinates()
        turns = {joint.of: float(joint.value) for joint in self.joints if isinstance(joint, Angle)}
        guides: dict[int, list[_Guide]] = {}
        for (point, axis), (value, name) in held.items():
            if (point, "y" if axis == "x" else "x") in held:
                continue
            x, y, direction = (value, 0.0, 0.5 * math.pi) if axis == "x" else (0.0, value, 0.0)
            body = body_of(point)
            if body in turns:
                self._guide_body(guides, _Guide(x, y, direction, name, body), self._place(point), turns[body])
            else:
                guides.setdefault(self._number(self._place(point)), []).append(_Guide(x, y, direction, name, None))
        for joint in self.joints:
            if isinstance(joint, PointOnLine | Translational) and GROUND_NAME in joint.bodies():
                self._guide_joint(guides, joint)
        return guides

    def _guide_joint(self, guides: dict[int, list[_Guide]], joint: PointOnLine | Translational) -> None:
        fixed, moving = (self._place(point) for point in joint.between)
        axis, turn = float(joint.axis), float(joint.angle) if isinstance(joint, Translational) else 0.0
        if fixed.body != GROUND_NAME:  # the line moves and the ground has the point
            if isinstance(joint, PointOnLine):
                return
            fixed, moving, axis, turn = moving, fixed, axis - turn, -turn
        if isinstance(joint, PointOnLine):
            guides.setdefault(self._number(moving), []).append(_Guide(fixed.x, fixed.y, axis, joint.name, None))
        else:
            self._guide_body(guides, _Guide(fixed.x, fixed.y, axis, joint.name, moving.body), moving, turn)

    def _guide_body(self, guides: dict[int, list[_Guide]], guide: _Guide, at: Place, turn: float) -> None:
        """Add a line for every pin of a body that cannot turn; the line of the place `at` is known."""
        c, s = math.cos(turn), math.sin(turn)
        for pin, places in enumerate(self.places):
            for place in places:
                if place.body == guide.slider:
                    dx, dy = place.x - at.x, place.y - at.y
                    moved = guide._replace(x=guide.x + c * dx - s * dy, y=guide.y + s * dx + c * dy)
                    guides.setdefault(pin, []).append(moved)


def _cross(a: _Point, b: _Point, c: _Point, d: _Point) -> bool:
    """Return True if the segments from a to b and from c to d cross."""

    def side(p: _Point, q: _Point, r: _Point) -> float:
        """Return on which side of the line from p to q a point is: 1.0, -1.0, or 0.0 on it."""
        area = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
        return 0.0 if abs(area) <= _ON_LINE * math.dist(p, q) * math.dist(p, r) else math.copysign(1.0, area)

    return side(a, b, c) * side(a, b, d) < 0.0 and side(c, d, a) * side(c, d, b) < 0.0


def _distance(a: Place, b: Place) -> float:
    return math.hypot(b.x - a.x, b.y - a.y)


@dataclass(frozen=True)
class Grashof:
    """A class and the sums that decide it.

    name: 'crank-rocker', 'double crank', 'rocker-crank', 'double rocker', 'triple rocker', 'change point' or 'does not
    close' (four-bars); 'crank turns', 'rod turns', 'nothing turns', 'change point' or 'does not close' (slider-cranks).
    shape: of a change point, 'parallelogram', 'antiparallelogram' (a crossed one), 'kite' or '', else ''; small, large:
    the two sides of the inequality, small <= large where a link can make a full turn [length].
    """

    name: str
    small: float
    large: float
    shape: str = ""


def four_bar_class(ground: float, first: float, coupler: float, last: float) -> Grashof:
    """Return Grashof's class of a four-bar; first is the driven link.

        s + l <= p + q        s, l: shortest and longest; p, q: the others

    holds where a link can make a full turn: the shortest, relative to all others. It turns (crank) where it is first or
    last, both its neighbours turn where it is the ground (double crank), and it turns between two that rock where it is
    the coupler (double rocker). Equality is a change point. No loop closes where l > s + p + q.
    """
    lengths = (ground, first, coupler, last)
    shortest, p, q, longest = sorted(lengths)
    small, large, same = shortest + longest, p + q, SAME_LENGTH * sum(lengths)
    if longest > shortest + p + q + same:
        return Grashof("does not close", longest, shortest + p + q)
    if abs(small - large) <= same:
        return Grashof("change point", small, large, _shape(lengths, same))
    if small > large:
        return Grashof("triple rocker", small, large)
    names = ("double crank", "crank-rocker", "double rocker", "rocker-crank")
    return Grashof(names[lengths.index(shortest)], small, large)


def _shape(lengths: tuple[float, float, float, float], same: float) -> str:
    a, b, c, d = lengths

    def equal(x: float, y: float) -> bool:
        return abs(x - y) <= same

    if equal(a, c) and equal(b, d):
        return "parallelogram"
    if (equal(a, b) and equal(c, d)) or (equal(b, c) and equal(a, d)):
        return "kite"
    return ""


def slider_crank_class(crank: float, rod: float, offset: float) -> Grashof:
    """Return which link of a slider-crank can make a full turn.

        crank + |offset| <= rod     the crank
        rod + |offset| <= crank     the rod, and the crank rocks

    Equality is a change point. No loop closes where |offset| > crank + rod.
    """
    offset, same = abs(offset), SAME_LENGTH * (crank + rod + abs(offset))
    if offset > crank + rod + same:
        return Grashof("does not close", offset, crank + rod)
    shorter, longer = sorted((crank, rod))
    small = shorter + offset
    if abs(small - longer) <= same:
        return Grashof("change point", small, longer)
    if small > longer:
        return Grashof("nothing turns", small, longer)
    return Grashof("crank turns" if crank < rod else "rod turns", small, longer)
