"""What a designer would see in a mechanism: parts without use or motion, links out of proportion, toggle positions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from itertools import combinations, pairwise
from typing import NamedTuple

from kinfmu.analysis.loops import FourBar, Place, SliderCrank
from kinfmu.analysis.named import NamedLoop
from kinfmu.analysis.way import Way
from kinfmu.analysis.written import written
from kinfmu.equations.system import size_of
from kinfmu.errors import listed
from kinfmu.joints import Fixed, Revolute
from kinfmu.measures.placement import body_of
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.solver.python import Pose

TOO_SHORT = 1e-3  # of the shortest neighbour; a link that short is probably in another unit
_STILL = 1e-9  # [rad, sizes] that a body which does not move goes at most
_SAME = 1e-9  # of the size; points nearer than that are one place
_LOOKS = 201  # times of the run at which a driver is looked at
_HALVINGS = 40
_EDGE = 1e-6  # of the run's way; what lies nearer to its ends is not crossed


def part_notes(mechanism: Mechanism) -> Iterator[str]:
    """Yield one line for each unused point, for joints in one place, for a link that is much too short, and for a
    step longer than the run.
    """
    yield from _unused_points(mechanism)
    yield from _joints_in_one_place(mechanism)
    yield from _short_links(mechanism)
    run = mechanism.run
    if run.stop > run.start and run.step > run.stop - run.start:
        yield (
            f"[run] step = {run.step:.6g} s is longer than the run, {run.start:.6g} to {run.stop:.6g} s: "
            "it has one sample"
        )


def motion_notes(mechanism: Mechanism, ways: Sequence[Way], loops: Sequence[NamedLoop]) -> Iterator[str]:
    """Yield one line on bodies that no driver moves, and one for each toggle position that the run crosses.

    ways: of all drivers, one each.
    """
    if len(ways) == len(mechanism.drivers):
        yield from _still_bodies(mechanism, ways)
    for way in ways:
        yield from _toggles(mechanism, way, loops)


def _unused_points(mechanism: Mechanism) -> Iterator[str]:
    used = set(mechanism.points.values())
    for member in (*mechanism.joints, *mechanism.drivers):
        for entry in fields(member):  # type: ignore[arg-type]  # all members are dataclasses
            value = getattr(member, entry.name)
            used |= {value} if isinstance(value, str) else {*value} if isinstance(value, tuple) else set()
    unused = [name for name in mechanism.body_points if name not in used]
    if unused:
        one = len(unused) == 1
        yield (
            f"point{'' if one else 's'} {listed(unused)} {'is' if one else 'are'} used by no joint, driver or point of "
            "interest"
        )


def _joints_in_one_place(mechanism: Mechanism) -> Iterator[str]:
    """Joints that hold the same two bodies at the same points."""
    near, points = _SAME * size_of(mechanism), mechanism.body_points
    pinned = [joint for joint in mechanism.joints if isinstance(joint, Revolute | Fixed)]
    for first, second in combinations(pinned, 2):
        ends = {body_of(point): points[point] for point in first.between}
        others = {body_of(point): points[point] for point in second.between}
        if ends.keys() == others.keys() and all(math.dist(ends[body], others[body]) <= near for body in ends):
            yield f"joints {first.name}, {second.name} hold {listed(ends)} in one place: one of them is enough"


def _short_links(mechanism: Mechanism) -> Iterator[str]:
    """Moving bodies that are much shorter between their joints than every neighbour."""
    held: dict[str, list[str]] = {}
    neighbours: dict[str, set[str]] = {}
    for joint in mechanism.joints:
        for point in getattr(joint, "between", ()):
            if point in mechanism.body_points:
                held.setdefault(body_of(point), []).append(point)
        for body in joint.bodies():
            neighbours.setdefault(body, set()).update(joint.bodies())
    lengths = {body: _longest(mechanism.body_points, names) for body, names in held.items()}
    for body, length in lengths.items():
        beside = [lengths.get(other, 0.0) for other in neighbours[body] - {body}]
        beside = [other for other in beside if other > 0.0]
        if body != GROUND_NAME and length > 0.0 and beside and length <= TOO_SHORT * min(beside):
            unit = mechanism.length_unit
            yield (
                f"{body} is {length:.4g} {unit} long between its joints, its neighbours at least {min(beside):.4g} "
                f"{unit}: are its points in another unit?"
            )


def _longest(points: Mapping[str, tuple[float, float]], names: Sequence[str]) -> float:
    return max((math.dist(points[a], points[b]) for a, b in combinations(names, 2)), default=0.0)


def _still_bodies(mechanism: Mechanism, ways: Sequence[Way]) -> Iterator[str]:
    """Bodies that no driver moves, but for those that are welded to the ground."""
    size = size_of(mechanism)
    moves: set[str] = set()
    for way in ways:
        first = way.coordinates(way.poses[0])
        for pose in way.poses[1:]:
            now = way.coordinates(pose)
            moves |= {
                name.rpartition(".")[0]
                for name, value in now.items()
                if abs(value - first[name]) > _STILL * (1.0 if name.endswith(".phi") else size)
            }
    welded = _welded(mechanism)
    still = [body.name for body in mechanism.moving_bodies if body.name not in moves and body.name not in welded]
    if still:
        one = len(still) == 1
        yield (
            f"{listed(still)} {'does' if one else 'do'} not move with any driver: look at the points of "
            f"{'its' if one else 'their'} joints, or weld {'it' if one else 'them'} to the ground (type 'fixed')"
        )


def _welded(mechanism: Mechanism) -> set[str]:
    """Return the bodies that are welded to the ground."""
    found, count = {GROUND_NAME}, 0
    while len(found) > count:
        count = len(found)
        for joint in mechanism.joints:
            if isinstance(joint, Fixed) and found.intersection(joint.bodies()):
                found |= {*joint.bodies()}
    return found


def _toggles(mechanism: Mechanism, way: Way, loops: Sequence[NamedLoop]) -> Iterator[str]:
    """Positions within the run where two links of a loop fall in line, or a rod stands across its slide, and the motion
    goes on.

    A run of a whole turn takes every crank over them, which is what it is for.
    """
    driver = next(one for one in mechanism.drivers if one.name == way.name)
    run = mechanism.run
    values = [float(driver.law.at(run.start + (run.stop - run.start) * k / (_LOOKS - 1))) for k in range(_LOOKS)]
    low, high = min(values), max(values)
    if way.kind == "angle" and high - low >= math.tau * (1.0 - 1e-9):
        return
    edge = _EDGE * (high - low)
    for named in loops:
        for toggle in _toggles_of(named.loop):
            for before, after in pairwise(way.poses):
                if _sine(way, before, toggle) * _sine(way, after, toggle) < 0.0:
                    at = _within(way, _crossing(way, toggle, before, after), low)
                    if low + edge < at < high - edge:
                        value = written(at, mechanism.length_unit, way.kind)
                        yield f"the run crosses a toggle position: {toggle.happens} at {way.name} = {value}"


class _Toggle(NamedTuple):
    """What falls in line in a toggle position.

    places: of three pins, or of a rod's two pins, the second of which slides; across: direction at right angles to the
    slide [rad], along which the rod lies then; happens: the position in words.
    """

    places: tuple[Place, ...]
    across: float
    happens: str


def _toggles_of(loop: FourBar | SliderCrank) -> tuple[_Toggle, _Toggle]:
    first, second, *last = loop.links
    in_line = _Toggle(loop.pins[:3], 0.0, f"{first}, {second} fall in line")
    if isinstance(loop, SliderCrank):
        rod = loop.rod.name
        return in_line, _Toggle(loop.pins[1:], loop.direction + math.pi / 2.0, f"{rod} stands across the slide")
    return in_line, _Toggle(loop.pins[1:], 0.0, f"{second}, {last[0]} fall in line")


def _within(way: Way, u: float, low: float) -> float:
    """A driver value moved by whole periods, where the mechanism comes back, to the first one from `low` on."""
    if way.turns is None:
        return u
    period = way.turns * math.tau
    return low + (u - low) % period


def _sine(way: Way, pose: Pose, toggle: _Toggle) -> float:
    """Sine of the angle between the two links, or between the rod and what is across its slide."""
    q = way.coordinates(pose)
    (ax, ay), (bx, by), *third = (_world(place, q) for place in toggle.places)
    cx, cy = third[0] if third else (bx + math.cos(toggle.across), by + math.sin(toggle.across))
    return ((bx - ax) * (cy - by) - (by - ay) * (cx - bx)) / (
        math.hypot(bx - ax, by - ay) * math.hypot(cx - bx, cy - by)
    )


def _crossing(way: Way, toggle: _Toggle, low: Pose, high: Pose) -> float:
    """The driver value between two poses where a sine vanishes, by bisection."""
    at_low = _sine(way, low, toggle)
    for _ in range(_HALVINGS):
        middle = way.solver.solve(low, (0.5 * (low.u[0] + high.u[0]),))
        if not middle.good or middle.u[0] in (low.u[0], high.u[0]):
            break
        if (_sine(way, middle, toggle) < 0.0) == (at_low < 0.0):
            low = middle
        else:
            high = middle
    return 0.5 * (low.u[0] + high.u[0])


def _world(place: Place, q: Mapping[str, float]) -> tuple[float, float]:
    """World coordinates of a place."""
    if place.body == GROUND_NAME:
        return place.x, place.y
    x, y, phi = (q[f"{place.body}.{axis}"] for axis in ("x", "y", "phi"))
    c, s = math.cos(phi), math.sin(phi)
    return x + c * place.x - s * place.y, y + s * place.x + c * place.y
