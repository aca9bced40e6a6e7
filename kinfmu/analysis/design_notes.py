"""Notes on the design: unused or fixed parts, links of improbable length, toggle positions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Any, NamedTuple

from kinfmu.analysis.driver_path import DriverPath, law_values
from kinfmu.analysis.loops import FourBar, Place, SliderCrank
from kinfmu.analysis.transmission import NamedLoop
from kinfmu.errors import listed
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.drivers import SAMPLES_PER_TURN
from kinfmu.mechanism.joints import Fixed, Revolute
from kinfmu.mechanism.quantities.placement import body_of
from kinfmu.plan.equations.system import size_of

TOO_LONG = 50.0  # medians of all links; a link that long is probably in another unit
TOO_SHORT = 1e-3  # of the shortest neighbour; a link that short is probably in another unit
NEAR_PIVOTS = 1e-2  # of the shortest body there; pivots so close are probably in another unit
_LEAST_LINKS = 4  # fewer have no usual length
_STILL = 1e-9  # [rad, sizes]; a body that moves less does not move
_SAME = 1e-9  # of the size; points closer than this coincide
_IN_LINE = 1e-9  # sine of the angle between links that are in line at a pose
_FEWEST_STEPS = 36.0  # of a cycle, for smooth curves
_EDGE = 1e-6  # of the run's range; positions closer to its ends are not crossed


def part_notes(mechanism: Mechanism) -> Iterator[str]:
    """Yield lines for unused points, coinciding joints, links much too short, and too long a step of the run."""
    if unused := unused_points(mechanism):
        yield unused
    yield from _joints_in_one_place(mechanism)
    yield from _short_links(mechanism)
    run = mechanism.run
    if run.stop > run.start and run.step > run.stop - run.start:
        yield (
            f"[run] step = {run.step:.6g} s is longer than the run, {run.start:.6g} to {run.stop:.6g} s: "
            "it has one sample"
        )
    fastest = min((driver for driver in mechanism.drivers if driver.cycle), key=lambda one: one.cycle, default=None)
    if fastest is not None and run.step < run.stop - run.start and fastest.cycle < _FEWEST_STEPS * run.step:
        yield (
            f"[run] step = {run.step:.6g} s takes {fastest.cycle / run.step:.3g} samples of a cycle of {fastest.name}: "
            f"step = {fastest.cycle / SAMPLES_PER_TURN:.4g} takes {SAMPLES_PER_TURN}"
        )


@dataclass(frozen=True)
class TogglePosition:
    """A position that the run crosses with two links in line, or with a rod perpendicular to its slide.

    driver, value: where [rad or length]; kind: 'angle' or 'length'; happens: the position in words.
    """

    driver: str
    value: float
    kind: str
    happens: str

    def as_json(self) -> dict[str, Any]:
        """Return the position as plain data."""
        return {"driver": self.driver, "value": self.value, "position": self.happens}


def motion_notes(mechanism: Mechanism, paths: Sequence[DriverPath]) -> Iterator[str]:
    """Yield one line on bodies that no driver moves; paths: of all drivers, one each."""
    if len(paths) == len(mechanism.drivers):
        yield from _still_bodies(mechanism, paths)


def unused_points(mechanism: Mechanism, *, of_joints: bool = False) -> str:
    """Return a line on the points of bodies that nothing of the mechanism names; '' if there are none.

    of_joints: ends of rods and corners of plates, which only place the mass, do not count as named.
    """
    used = {*mechanism.named_points}
    if not of_joints:
        used |= {f"{body.name}.{end}" for body in mechanism.bodies for end in body.rod or body.plate or ()}
    unused = [name for name in mechanism.body_points if name not in used]
    if not unused:
        return ""
    points = f"point {unused[0]} is" if len(unused) == 1 else f"points {listed(unused)} are"
    return f"{points} used by no joint, driver, load, measure or point of interest"


def _joints_in_one_place(mechanism: Mechanism) -> Iterator[str]:
    """Yield a line for joints that connect the same two bodies at the same points."""
    near, points = _SAME * size_of(mechanism), mechanism.body_points
    pinned = [joint for joint in mechanism.joints if isinstance(joint, Revolute | Fixed)]
    for first, second in combinations(pinned, 2):
        ends = {body_of(point): points[point] for point in first.between}
        others = {body_of(point): points[point] for point in second.between}
        if ends.keys() == others.keys() and all(math.dist(ends[body], others[body]) <= near for body in ends):
            yield f"joints {first.name}, {second.name} connect {listed(ends)} at the same point: one of them is enough"


def _short_links(mechanism: Mechanism) -> Iterator[str]:
    """Yield a line for moving bodies that are much shorter between their joints than every neighbour."""
    held: dict[str, list[str]] = {}
    neighbours: dict[str, set[str]] = {}
    for joint in mechanism.joints:
        for point in getattr(joint, "between", ()):
            if point in mechanism.body_points:
                held.setdefault(body_of(point), []).append(point)
        for body in joint.bodies():
            neighbours.setdefault(body, set()).update(joint.bodies())
    lengths = {body: _longest(mechanism.body_points, names) for body, names in held.items()}
    yield from _long_links({body: length for body, length in lengths.items() if length > 0.0}, mechanism.length_unit)
    for body, length in lengths.items():
        others = [lengths.get(other, 0.0) for other in neighbours[body] - {body}]
        others = [other for other in others if other > 0.0]
        if body != GROUND_NAME and length > 0.0 and others and length <= TOO_SHORT * min(others):
            unit = mechanism.length_unit
            yield (
                f"{body} is {length:.4g} {unit} long between its joints, its neighbours at least {min(others):.4g} "
                f"{unit}: are its points in another unit?"
            )


def near_pivots(mechanism: Mechanism) -> Iterator[str]:
    """Yield a line for each two joints on the ground that are much closer than the bodies there are long.

    Small offsets are sound, so this is for mechanisms that do not close.
    """
    points, unit = mechanism.body_points, mechanism.length_unit
    at: dict[str, set[str]] = {}  # bodies by point of the ground
    held: dict[str, list[str]] = {}
    for joint in mechanism.joints:
        between = [point for point in getattr(joint, "between", ()) if point in points]
        for point in between:
            held.setdefault(body_of(point), []).append(point)
            if body_of(point) == GROUND_NAME:
                at.setdefault(point, set()).update(body_of(other) for other in between if other != point)
    for first, second in combinations(at, 2):
        lengths = [_longest(points, held[body]) for body in at[first] | at[second]]
        apart, shortest = math.dist(points[first], points[second]), min(filter(None, lengths), default=0.0)
        if 0.0 < apart <= NEAR_PIVOTS * shortest:
            yield (
                f"{first} and {second} are {apart:.4g} {unit} apart, the bodies there at least {shortest:.4g} {unit} "
                "long: are their points in another unit?"
            )


def _long_links(lengths: Mapping[str, float], unit: str) -> Iterator[str]:
    """Yield a line for moving bodies that are much longer between their joints than most."""
    if len(lengths) < _LEAST_LINKS:
        return
    usual = sorted(lengths.values())[
        (len(lengths) - 1) // 2
    ]  # the lower median: of four links two may be in another unit
    for body, length in lengths.items():
        if body != GROUND_NAME and length > TOO_LONG * usual:
            yield (
                f"{body} is {length:.4g} {unit} long between its joints, the median of all is {usual:.4g} {unit}: "
                "are its points in another unit?"
            )


def _longest(points: Mapping[str, tuple[float, float]], names: Sequence[str]) -> float:
    return max((math.dist(points[a], points[b]) for a, b in combinations(names, 2)), default=0.0)


def _still_bodies(mechanism: Mechanism, paths: Sequence[DriverPath]) -> Iterator[str]:
    """Yield a line for bodies that no driver moves, except those welded to the ground or at rest by a law."""
    size = size_of(mechanism)
    moves: set[str] = set()
    for path in paths:
        first, *others = path.pose_coordinates
        for now in others:
            moves |= {
                name.owner
                for name in path.plan.outputs
                if name.owner not in moves and abs(now[name] - first[name]) > _STILL * (1.0 if name.is_angle else size)
            }
    welded = _welded(mechanism)
    resting = _resting(mechanism, moves)
    still = [body.name for body in mechanism.moving_bodies if body.name not in moves | welded | resting]
    if still:
        one = len(still) == 1
        yield (
            f"{listed(still)} {'does' if one else 'do'} not move with any driver: check the points of "
            f"{'its' if one else 'their'} joints, or weld {'it' if one else 'them'} to the ground (type 'fixed')"
        )


def _resting(mechanism: Mechanism, moves: set[str]) -> set[str]:
    """Return the bodies at rest that a law joins to moving ones, such as a cam's follower, and what these carry."""
    found, count = set[str](), -1
    while len(found) > count:
        count = len(found)
        for joint in mechanism.joints:
            bodies = {*joint.bodies()} - {GROUND_NAME}
            if bodies & (found if getattr(joint, "law", None) is None else found | moves):
                found |= bodies - moves
    return found


def _welded(mechanism: Mechanism) -> set[str]:
    """Return the bodies that are welded to the ground."""
    found, count = {GROUND_NAME}, 0
    while len(found) > count:
        count = len(found)
        for joint in mechanism.joints:
            if isinstance(joint, Fixed) and found.intersection(joint.bodies()):
                found |= {*joint.bodies()}
    return found


def toggle_positions(
    mechanism: Mechanism, paths: Sequence[DriverPath], loops: Sequence[NamedLoop]
) -> tuple[TogglePosition, ...]:
    """Return the toggle positions that the run crosses, each once, in the order of the drivers and their values."""
    found: list[TogglePosition] = []
    for path in paths:
        driver = next(one for one in mechanism.drivers if one.name == path.name)
        values = law_values(driver, mechanism.run)
        low, high = min(values), max(values)
        is_whole = path.turns is not None and high - low >= path.turns * math.tau * (1.0 - _EDGE)
        edge = -math.inf if is_whole else _EDGE * (high - low)
        here = {
            (toggle.happens, round(at, 6)): TogglePosition(path.name, at, path.kind, toggle.happens)
            for named in loops
            for toggle in _toggles_of(named.loop)
            for at in (path.within_cycle(u, low) for u in _in_line_at(path, toggle))
            if low + edge < at < high - edge
        }
        found += sorted(here.values(), key=lambda position: (position.value, position.happens))
    return tuple(found)


def _in_line_at(path: DriverPath, toggle: _Toggle) -> Iterator[float]:
    """Yield the driver values on a path at which the sine of a toggle position is 0."""
    sines = [_sine(toggle, q) for q in path.pose_coordinates]
    for pose, sine in zip(path.poses, sines, strict=True):
        if abs(sine) <= _IN_LINE:
            yield pose.u[0]
    for (before, after), (one, other) in zip(pairwise(path.poses), pairwise(sines), strict=True):
        if one * other < 0.0 and min(abs(one), abs(other)) > _IN_LINE:
            yield path.zero(lambda pose: _sine(toggle, path.coordinates(pose)), before, after).u[0]


class _Toggle(NamedTuple):
    """A toggle position.

    places: of three pins, or of a rod's two pins, the second of which slides; across: direction perpendicular to the
    slide [rad], which is then that of the rod; happens: the position in words.
    """

    places: tuple[Place, ...]
    across: float
    happens: str


def _toggles_of(loop: FourBar | SliderCrank) -> tuple[_Toggle, _Toggle]:
    first, second, *last = loop.links
    in_line = _Toggle(loop.pins[:3], 0.0, f"{first}, {second} fall in line")
    if isinstance(loop, SliderCrank):
        rod = loop.rod.name
        return in_line, _Toggle(loop.pins[1:], loop.direction + math.pi / 2.0, f"{rod} is perpendicular to the slide")
    return in_line, _Toggle(loop.pins[1:], 0.0, f"{second}, {last[0]} fall in line")


def _sine(toggle: _Toggle, q: Mapping[str, float]) -> float:
    """Return the sine of the angle between the two links, or between the rod and the normal of its slide."""
    (ax, ay), (bx, by), *third = (place.world(q) for place in toggle.places)
    cx, cy = third[0] if third else (bx + math.cos(toggle.across), by + math.sin(toggle.across))
    return ((bx - ax) * (cy - by) - (by - ay) * (cx - bx)) / (
        math.hypot(bx - ax, by - ay) * math.hypot(cx - bx, cy - by)
    )
