"""Small changes of a mechanism file that may make it move, each with a cost; which of them do is found by trying."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from functools import cached_property
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.drivers import AngleDriver, CoordinateDriver, Driver, RelativeAngleDriver, SlideDriver
from kinfmu.mechanism.edits import Edit, Put, Remove
from kinfmu.mechanism.joints import Distance, Fixed, Joint, PointOnLine, Revolute, Translational
from kinfmu.mechanism.members import texts_of
from kinfmu.mechanism.quantities.placement import Placement, body_of, point_of
from kinfmu.mechanism.toml_document import document_of
from kinfmu.mechanism.toml_text import text
from kinfmu.plan.equations.closing import motion_samples, null_space
from kinfmu.plan.equations.part import Part
from kinfmu.plan.equations.redundancy import Redundancy
from kinfmu.plan.equations.start_poses import ROUGH, law_targets, start_from_poses
from kinfmu.plan.equations.system import System, placement

LARGEST = 600  # coordinates; a larger mechanism takes too long
NEAR = 0.1  # of the size; points that are nearer may be one pin
_APART = 30.0  # cost of a distance between points to be joined, by the size
_COINCIDE = 1e-3  # of the size; points that are nearer are in one place
_NEXT_TO = 0.05  # of the size; points without joints that are nearer belong in one place
_SLIDES = 0.1  # of the size, in the run: the travel of a slide without a speed
_MOST_POINTS = 400  # every pair is compared
_MOST_PAIRS = 40  # the nearest ones are tried
_FACTORS = (1000.0, 0.001, 25.4, 1.0 / 25.4)  # slips between m and mm, and between inches and mm
_FRAMES = ("frame", "base", "chassis", "housing", "stand", "fixed", "gestell", "support", "mount")
_LATE = 0.5  # of the cost; what is last in the file was probably added last
_MOVES = 1e-6  # part of a free direction; a coordinate with more counts as moving
_FITS = 0.05  # [rad]; a law that starts nearer to where a body is was written for it
_ROUND = 6  # digits of lengths, of the size

Document = Mapping[str, Any]


class Remedy(NamedTuple):
    """A change that may make a mechanism move: what it is in words, its edits, and its cost.

    The cost is the smaller the less it changes, and the more often beginners make the slip that it undoes.
    """

    text: str
    edits: tuple[Edit, ...]
    cost: float


class Case:
    """A mechanism that does not move as meant: its tables, and what its joints and drivers leave free.

    document: the tables of its file, numbers as written; q: (n,) the pose nearest to the start poses in which its
    independent joints close, or the start poses; free: (n, k) directions of motion there. at_start: the start poses,
    with 0 for what they leave out, or that pose if joints are wide open in them.
    """

    def __init__(self, mechanism: Mechanism, system: System, redundancy: Redundancy) -> None:
        self.mechanism, self.system, self.redundancy = mechanism, system, redundancy
        self.document: dict[str, Any] = document_of(text(mechanism, as_written=True), mechanism.name)
        self.size = system.size
        start = start_from_poses(system).q
        self.q = next(iter(motion_samples(Part(system, redundancy.kept), start, 1)), start)
        self.at = placement(system.mechanism, self.q.tolist())
        self.open = open_at_start(system, list(redundancy.kept))
        is_closed = self.open <= ROUGH
        self.at_start = placement(system.mechanism, start.tolist()) if is_closed else self.at
        rows = [*redundancy.kept, *range(system.joint_row_count, len(system.rows))]
        self.free = null_space(system.scaled_jacobian(self.q)[rows])  # (n, k)
        self.joints_of: dict[str, list[Joint]] = {body.name: [] for body in mechanism.bodies}
        for joint in mechanism.joints:
            for body in dict.fromkeys(joint.bodies()):
                self.joints_of[body].append(joint)
        of_joints = set[object]().union(*map(texts_of, mechanism.joints))
        others = (*mechanism.drivers, *mechanism.loads, *mechanism.measures)
        self.joined = {point for point in mechanism.body_points if point in of_joints}
        pins = [joint for joint in mechanism.joints if isinstance(joint, Revolute | Fixed | Distance)]
        self.pinned = {str(point) for joint in pins for point in joint.between}
        self.named = {*map(str, set[object]().union(mechanism.points.values(), *map(texts_of, others)))}
        self.driven = {body for driver in mechanism.drivers for body in driver.bodies()}

    @cached_property
    def loose(self) -> set[str]:
        """Names of the bodies that can still move."""
        moving = np.abs(self.free).max(axis=1, initial=0.0) > _MOVES
        return {name.owner for name, moves in zip(self.system.coordinates, moving, strict=True) if moves}

    @cached_property
    def wanted(self) -> set[str]:
        """Names of bodies of which a driver, a load, a measure or a point of interest names something."""
        return {body_of(name) for name in self.named}

    @cached_property
    def is_open(self) -> dict[str, bool]:
        """Whether the start pose of each body leaves something out."""
        return {body.name: None in body.start and not body.is_ground for body in self.mechanism.bodies}

    def neighbours(self, driver: Driver) -> set[str]:
        """Return the bodies that joints connect to those that a driver drives, and these."""
        bodies = [body for body in driver.bodies() if body != GROUND_NAME]
        return {name for body in bodies for joint in self.joints_of[body] for name in joint.bodies()}

    def distance(self, a: str, b: str) -> float:
        """Return how far apart two points are at the start or with the joints closed, whichever is less."""
        return min(math.dist(at.point(a), at.point(b)) for at in (self.at_start, self.at))

    def rounded(self, length: float) -> float:
        """Return a length with the digits that people write."""
        return round(length, _ROUND - math.ceil(math.log10(self.size))) + 0.0

    def length_text(self, length: float) -> str:
        return f"{length:.2g} {self.mechanism.length_unit}"

    def angle_between(self, i: str, j: str) -> float:
        """Return the angle of body j relative to body i at the start [rad]."""
        at = self.at_start.poses
        return float(math.remainder(at[j].phi - at[i].phi, math.tau))

    def lateness(self, table: str, name: str) -> float:
        """Return where an entry is in its table, as a cost: 0 for the last one."""
        names = list(self.document.get(table, {}))
        return _LATE * (1.0 - (names.index(name) + 1) / len(names))

    def new_name(self, name: str, table: str) -> str:
        """Return the name, longer if the table has an entry of this name."""
        taken = {*self.document.get(table, {})}
        while name in taken:
            name += "_2"
        return name

    def with_body_removed(self, body: str) -> tuple[Edit, ...]:
        """Return the removal of a body and of all that names it."""
        edits: list[Edit] = [Remove(("bodies", body))]
        for table in ("joints", "drivers", "loads", "points", "measures"):
            edits += [
                Remove((table, name)) for name, entry in self.document.get(table, {}).items() if _names(entry, body)
            ]
        coordinates = self.document["outputs"]["coordinates"]
        if isinstance(coordinates, list):
            kept = [name for name in coordinates if body_of(name) != body]
            edits += [Put(("outputs", "coordinates"), kept)] if kept != coordinates else []
        return tuple(edits)


def open_at_start(system: System, rows: Sequence[int] | None = None) -> float:
    """Return the widest gap of joint rows in the start poses, with 0 for what these leave out [sizes, rad]."""
    gaps = system.gaps(system.residual(start_from_poses(system).q, np.zeros(len(system.mechanism.drivers))))
    sizes = [1.0 if row.kind == "angle" else system.size for row in system.rows[: system.joint_row_count]]
    relative = np.abs(gaps) / np.array(sizes)
    return float((relative if rows is None else relative[rows]).max(initial=0.0))


def _names(entry: Any, body: str) -> bool:
    """Return whether an entry of a file names a body or something of it."""
    if isinstance(entry, str):
        return body_of(entry) == body
    below = entry.values() if isinstance(entry, dict) else entry if isinstance(entry, list) else ()
    return any(_names(one, body) for one in below)


def degrees_text(angle: float) -> str:
    """Return an angle [rad] as a mechanism file has it, such as '60 deg'."""
    return f"{round(math.degrees(angle), 4) + 0.0:.7g} deg"


def additions(case: Case) -> Iterator[Remedy]:
    """Yield what may hold the bodies that are loose: joints, bars, welds, drivers, or to leave them out."""
    count = case.free.shape[1]
    yield from _new_pins(case)
    yield from other_ends(case)
    yield from _loose_bodies(case)
    if count == 1:
        yield from _bars(case)
        yield from _welded_pins(case)
    if count == 2:
        yield from _ground_pins(case)
    if count == 3:
        yield from _grounded_bodies(case)
    yield from new_drivers(case)


def removals(case: Case) -> Iterator[Remedy]:
    """Yield what may free a mechanism that is held too much: a joint, a driver or a body less, a weld that is a pin."""
    mechanism = case.mechanism
    surplus = len(mechanism.drivers) > 1
    motors = {_what(driver) for driver in candidates(mechanism) if GROUND_NAME in driver.bodies()}
    motors |= {body for joint in case.joints_of[GROUND_NAME] if isinstance(joint, Revolute) for body in joint.bodies()}
    for driver in mechanism.drivers if surplus else ():
        is_usual = _what(driver) in motors or not isinstance(driver, AngleDriver)
        cost = 1.0 + case.lateness("drivers", driver.name) + 0.4 * is_usual
        yield Remedy(
            f"remove driver {driver.name}: there are more drivers than degrees of freedom",
            (Remove(("drivers", driver.name)),),
            cost,
        )
    for joint in mechanism.joints:
        late = case.lateness("joints", joint.name)
        if isinstance(joint, Fixed):
            turn = case.angle_between(*joint.bodies())
            fits = abs(math.remainder(turn - joint.angle, math.tau)) <= _FITS
            cost = 0.6 if not fits else 1.3 if joint.angle == 0.0 else 0.8
            yield Remedy(
                f"make joint {joint.name} revolute: fixed, it lets {' and '.join(joint.bodies())} not turn against "
                "each other",
                (Put(("joints", joint.name), {"type": "revolute", "between": list(joint.between)}),),
                cost + 0.3 * late,
            )
        cost = 1.2 if len(joint.labels) == 1 else 1.5
        yield Remedy(
            f"remove joint {joint.name}: without it the drivers can move the mechanism",
            (Remove(("joints", joint.name)),),
            cost + late,
        )
    for body in mechanism.moving_bodies:
        joints = case.joints_of[body.name]
        if len(joints) > 1 and body.name not in case.wanted:
            cost = 1.2 + 0.2 * (len(joints) - 2) + 2.0 * case.lateness("bodies", body.name)
            yield Remedy(
                f"remove {body.name}: without it the drivers can move the mechanism",
                case.with_body_removed(body.name),
                cost,
            )
    yield from other_ends(case)


def _pairs(case: Case) -> list[tuple[float, str, str]]:
    """Return pairs of points that may be one pin, the likeliest first, with the cost of joining them."""
    points = list(case.mechanism.body_points)
    if len(points) > _MOST_POINTS:
        return []
    linked = {frozenset(joint.bodies()) for joint in case.mechanism.joints}
    found = []
    for a, b in combinations(points, 2):
        bodies = body_of(a), body_of(b)
        if bodies[0] == bodies[1] or frozenset(bodies) in linked or not case.loose & {*bodies}:
            continue
        apart = case.distance(a, b) / case.size
        is_named = point_of(a) == point_of(b)
        is_guessed = is_named and (case.is_open[bodies[0]] or case.is_open[bodies[1]])
        if apart <= NEAR or is_guessed:
            free = len({a, b} - case.joined)
            cost = (1.0, 0.4, 0.0)[free] + _APART * min(apart, NEAR if is_guessed else apart) - 0.2 * is_named
            found.append((cost, a, b))
    return sorted(found)[:_MOST_PAIRS]


def _new_pins(case: Case) -> Iterator[Remedy]:
    """Yield joints between points that are near each other and have none: pins, and welds where a body has no joint."""
    for cost, a, b in _pairs(case):
        name = case.new_name(_pin_name(a, b), "joints")
        apart = case.distance(a, b)
        where = "in the same place" if apart <= 1e-9 * case.size else f"{case.length_text(apart)} apart"
        reason = f"they are {where} and nothing connects them"
        pin = Put(("joints", name), {"type": "revolute", "between": [a, b]})
        yield Remedy(f"join {a} and {b}: {reason}", (pin,), 0.6 + cost)
        i, j = body_of(a), body_of(b)
        if apart <= _COINCIDE * case.size and case.free.shape[1] > 2:
            turn = case.angle_between(i, j)
            weld = Put(("joints", name), _weld(a, b, turn))
            yield Remedy(f"weld {a} and {b}: {reason}", (weld,), 0.8 + cost + 0.2 * (abs(turn) > 1e-6))
    yield from _onto_bars(case)


def _weld(a: str, b: str, turn: float) -> dict[str, Any]:
    weld: dict[str, Any] = {"type": "fixed", "between": [a, b]}
    return weld if abs(turn) < 1e-9 else {**weld, "angle": degrees_text(turn)}


def _pin_name(a: str, b: str) -> str:
    return point_of(a) if point_of(a) == point_of(b) else f"{point_of(a)}_{point_of(b)}"


def _onto_bars(case: Case) -> Iterator[Remedy]:
    """Yield pins of unused points that miss a bar between two points of another body: a new point there."""
    points = [point for point in case.mechanism.body_points if point not in case.joined]
    for point in points if len(points) <= _MOST_PAIRS else ():
        for body in case.mechanism.bodies:
            if (
                body.name == body_of(point)
                or len(body.points) < 2
                or body.is_ground
                or not {body.name, body_of(point)} & case.loose
            ):
                continue
            px, py = _seen_from(case.at_start, body.name, case.at_start.point(point))
            for a, b in combinations(body.points.values(), 2):
                (ax, ay), (dx, dy) = a, (b[0] - a[0], b[1] - a[1])
                length = math.hypot(dx, dy)
                if length == 0.0:
                    continue
                along = ((px - ax) * dx + (py - ay) * dy) / length
                miss = abs((px - ax) * dy - (py - ay) * dx) / length
                if miss > NEAR * case.size or not NEAR * case.size < along < length - NEAR * case.size:
                    continue
                if any(math.dist((px, py), other) <= 2.0 * NEAR * case.size for other in body.points.values()):
                    continue
                foot = [case.rounded(ax + along * dx / length), case.rounded(ay + along * dy / length)]
                new = point_of(point)
                while new in body.points:
                    new += "_2"
                name = case.new_name(point_of(point), "joints")
                edits = (
                    Put(("bodies", body.name, "points", new), foot),
                    Put(("joints", name), {"type": "revolute", "between": [point, f"{body.name}.{new}"]}),
                )
                reason = f"it is {case.length_text(miss)} from it and no joint uses it"
                yield Remedy(f"pin {point} to {body.name}: {reason}", edits, 1.2 + _APART * miss / case.size)


def _seen_from(at: Placement, body: str, place: tuple[float, float]) -> tuple[float, float]:
    """Return a place of the world in the frame of a body."""
    frame = at.poses[body]
    x, y = place[0] - frame.x, place[1] - frame.y
    return frame.c * x + frame.s * y, frame.c * y - frame.s * x


def other_ends(case: Case) -> Iterator[Remedy]:
    """Yield joints with an unused point near one of their ends in place of that end."""
    unused = [point for point in case.mechanism.body_points if point not in case.joined]
    for joint in case.mechanism.joints:
        between = getattr(joint, "between", ())
        if len(between) != 2 or not {*between} <= case.joined:
            continue
        for end, other in (0, 1), (1, 0):
            for point in unused:
                if body_of(point) in map(body_of, between):
                    continue
                apart = case.distance(between[end], point) / case.size
                if apart > NEAR:
                    continue
                changed = [point, between[other]] if end == 0 else [between[other], point]
                table = {**case.document["joints"][joint.name], "between": changed}
                yield Remedy(
                    f"join {point} in place of {between[end]} at joint {joint.name}: no joint uses it, and it is there",
                    (Put(("joints", joint.name), table),),
                    0.9 + _APART * apart,
                )


def _loose_bodies(case: Case) -> Iterator[Remedy]:
    """Yield the removal of bodies that are left over or hang from one other body."""
    for body in case.mechanism.moving_bodies:
        joints = case.joints_of[body.name]
        others = {name for joint in joints for name in joint.bodies()} - {body.name}
        if len(others) > 1 or body.name in case.driven or body.name not in case.loose:
            continue
        reason = f"it hangs from {next(iter(others))} and nothing follows it" if others else "no joint holds it"
        cost = 0.9 + 1.5 * (body.name in case.wanted) + 0.5 * case.lateness("bodies", body.name)
        yield Remedy(f"remove {body.name}: {reason}", case.with_body_removed(body.name), cost)


def _bars(case: Case) -> Iterator[Remedy]:
    """Yield bars between two points of which one at least has no pin, in place of a link that is missing."""
    points = list(case.mechanism.body_points)
    unused = [point for point in points if point not in case.pinned]
    found: list[Remedy] = []
    for a in unused if len(points) <= _MOST_POINTS else ():
        for b in points:
            bodies = {body_of(a), body_of(b)}
            is_second = b in case.pinned
            if len(bodies) < 2 or not bodies & case.loose or (b in unused and unused.index(b) < unused.index(a)):
                continue
            length = case.rounded(math.dist(case.at.point(a), case.at.point(b)))
            if length <= _COINCIDE * case.size or any(bodies <= {*joint.bodies()} for joint in case.mechanism.joints):
                continue
            bar = {"type": "distance", "between": [a, b], "length": length}
            cost = 0.7 + 0.25 * len({a, b} & case.named) + 0.1 * len({a, b} & case.joined - case.pinned)
            cost += (0.35 + 0.2 * (body_of(b) != GROUND_NAME)) * is_second + 0.1 * length / case.size
            reason = f"no joint is at {a}" if is_second else "no joint is at these points"
            put = Put(("joints", case.new_name("bar", "joints")), bar)
            found.append(Remedy(f"put a bar between {a} and {b}: {reason}", (put,), cost))
    yield from sorted(found, key=lambda one: one.cost)[:_MOST_PAIRS]


def _welded_pins(case: Case) -> Iterator[Remedy]:
    """Yield pins as welds: of a body that moves alone, of a frame that turns on the ground, then any."""
    on_ground = {name for joint in case.joints_of[GROUND_NAME] for name in joint.bodies()} - {GROUND_NAME}
    for joint in case.mechanism.joints:
        if not isinstance(joint, Revolute) or not {*joint.bodies()} & case.loose:
            continue
        i, j = joint.bodies()
        turn = case.angle_between(i, j)
        table = _weld(*joint.between, turn)
        alone = [body for body in (i, j) if case.loose == {body} and len(case.joints_of[body]) > 1]
        ends = [body for body in (i, j) if len(case.joints_of[body]) == 1]
        cost, reason = 1.2 if abs(turn) <= 1e-6 else 1.6, "then the two are one part"
        if GROUND_NAME in (i, j):
            (body,) = {i, j} - {GROUND_NAME}
            cost = 2.6
            is_level = _is_frame(body) or abs(turn) <= 1e-6
            if on_ground == {body} and len(case.joints_of[body]) > 2 and body not in case.driven and is_level:
                cost, reason = 0.8 - 0.3 * _is_frame(body), f"{body} alone is on the ground and can turn there"
        elif alone:
            cost, reason = 0.7, f"{alone[0]} moves alone and no other body follows"
        elif ends:
            cost, reason = 1.2 - 0.2 * (ends[0] in case.wanted), f"nothing else holds {ends[0]}"
        cost += 0.3 * (abs(turn) > 1e-6) + 0.4 * case.lateness("joints", joint.name)
        yield Remedy(f"weld joint {joint.name} of {i} and {j}: {reason}", (Put(("joints", joint.name), table),), cost)


def _is_frame(body: str) -> bool:
    return any(word in body.lower() for word in _FRAMES)


def _ground_pins(case: Case) -> Iterator[Remedy]:
    """Yield pins on the ground for points that nothing joins."""
    for point in case.mechanism.body_points:
        if point not in case.joined and body_of(point) in case.loose and body_of(point) != GROUND_NAME:
            edits = _pinned(case, point, "revolute", 0.0)
            yield Remedy(f"pin {point} to the ground: no joint uses it", edits, 2.2 + 0.5 * (point in case.named))


def _pinned(case: Case, point: str, kind: str, turn: float) -> tuple[Edit, ...]:
    """Return a joint between a point and the ground, with a point of the ground there."""
    new = point_of(point)
    while new in case.document["bodies"].get(GROUND_NAME, {}).get("points", {}):
        new += "_2"
    name = case.new_name(new, "joints")
    between = [f"{GROUND_NAME}.{new}", point]
    table = _weld(between[0], point, turn) if kind == "fixed" else {"type": kind, "between": between}
    place = [case.rounded(value) for value in case.at_start.point(point)]
    return Put(("bodies", GROUND_NAME, "points", new), place), Put(("joints", name), table)


def _grounded_bodies(case: Case) -> Iterator[Remedy]:
    """Yield bodies welded to the ground, where nothing is on it: that one of them is the frame."""
    if any(GROUND_NAME in joint.bodies() for joint in case.mechanism.joints):
        return
    for body in case.mechanism.moving_bodies:
        if not body.points or len(case.joints_of[body.name]) < 2:
            continue
        x, y, phi = body.start
        cost = 1.0 - 0.4 * _is_frame(body.name) + 0.3 * (body.name in case.driven) + 0.2 * bool(phi)
        cost -= 0.1 * (len(case.joints_of[body.name]) > 2) + 0.1 * (not x and not y)
        cost -= 0.2 * any(case.driven & {*joint.bodies()} for joint in case.joints_of[body.name])
        turn = case.at_start.poses[body.name].phi
        edits = _pinned(case, f"{body.name}.{next(iter(body.points))}", "fixed", turn)
        yield Remedy(f"fix {body.name} to the ground: nothing of the mechanism is on it", edits, cost)


def new_drivers(case: Case) -> Iterator[Remedy]:
    """Yield drivers for what is free: each alone if it suffices, else as many together as are needed, after pins."""
    count, has_none = case.free.shape[1], not case.mechanism.drivers
    if count == 1:
        offered = 0
        for driver in candidates(case.mechanism):
            if np.linalg.norm(_gradient(case, driver) @ case.free) > 1e-3:
                put = _driver_put(case, driver, [])
                nothing = "nothing drives the mechanism" if has_none else "what it drives is free"
                is_motor = isinstance(driver, AngleDriver | SlideDriver) and GROUND_NAME in case.neighbours(driver)
                cost = 0.9 if has_none else 1.8 - 0.5 * is_motor
                yield Remedy(f"drive {_what(driver)}: {nothing}", (put,), cost + 0.05 * offered)
                offered += 1
        return
    edits, words = completion(case)
    yield Remedy(f"{' and '.join(words)}: these are free", edits, 2.0 + 0.6 * len(edits) - 1.2 * has_none)


def completion(case: Case) -> tuple[tuple[Edit, ...], list[str]]:
    """Return pins of points in one place, then drivers, that together hold all that is free, and them in words."""
    free, edits, words = case.free, list[Edit](), list[str]()
    for _, a, b in _pairs(case):
        reach = _NEXT_TO if not {a, b} & case.joined else _COINCIDE
        if free.shape[1] < 2 or case.distance(a, b) > reach * case.size:
            continue
        probe = System(
            replace(case.system.mechanism, joints=(Revolute("pin", (a, b)),), drivers=(), measures=()), case.size
        )
        holds = probe.scaled_jacobian(case.q) @ free  # (2, k)
        if np.linalg.svd(holds, compute_uv=False)[-1] > 1e-3:
            name = case.new_name(_pin_name(a, b), "joints")
            edits.append(Put(("joints", name), {"type": "revolute", "between": [a, b]}))
            words.append(f"join {a} and {b}")
            free = free @ null_space(holds)
    for driver in candidates(case.mechanism):
        if free.shape[1] == 0:
            break
        gradient = _gradient(case, driver) @ free  # component along each free direction
        if np.linalg.norm(gradient) > 1e-3:
            edits.append(_driver_put(case, driver, edits))
            words.append(f"drive {_what(driver)}")
            free = free @ null_space(gradient[None, :])
    return tuple(edits), words


def other_drivers(case: Case, drivers: Iterable[Driver]) -> Iterator[Remedy]:
    """Yield motors on the ground and slides that drivers could drive in place of what they drive.

    A law that starts where the body is that it drives now starts where the other one is; else it stays.
    """
    for driver in drivers:
        law_start = float(law_targets(case.system)[case.mechanism.drivers.index(driver)])
        is_own_start = abs(_off(driver, law_start - _value(case, driver))) <= _FITS
        taken = {_what(other) for other in case.mechanism.drivers}
        for number, candidate in enumerate(candidates(case.mechanism)):
            if not isinstance(candidate, AngleDriver | SlideDriver) or _what(candidate) in taken:
                continue
            if case.free.shape[1] and np.linalg.norm(_gradient(case, candidate) @ case.free) <= 1e-3:
                continue
            is_same, keys, start = candidate.type == driver.type, _keys(candidate), _value(case, candidate)
            written = case.document["drivers"][driver.name]
            table = {**written, **keys, "law": driver.law.type} if is_same else keys | _speed(case, candidate)
            cost = 1.3 + 0.3 * (not is_same) - 0.5 * (driver.name in candidate.bodies()) + 0.01 * number
            cost += 0.3 * (abs(_off(candidate, law_start - start)) > _FITS and not is_own_start)
            if "start" in table and is_own_start:
                table["start"] = degrees_text(start) if candidate.quantity.kind == "angle" else case.rounded(start)
            text_of_driver = f"drive {_what(candidate)} in place of {_what(driver)}"
            yield Remedy(text_of_driver, (Put(("drivers", driver.name), table),), cost)


def _off(driver: Driver, difference: float) -> float:
    """Return a difference of driver values, of angles without whole turns."""
    return math.remainder(difference, math.tau) if driver.quantity.kind == "angle" else difference


def _what(driver: Driver) -> str:
    """Return what a driver drives, in words."""
    bodies = [body for body in driver.bodies() if body != GROUND_NAME]
    if isinstance(driver, AngleDriver):
        return bodies[0]
    if isinstance(driver, RelativeAngleDriver):
        return f"{bodies[-1]} against {bodies[0]}"
    if isinstance(driver, CoordinateDriver):
        return f"{driver.of} along {driver.axis}"
    return (
        f"{bodies[-1]} along its slide"
        if isinstance(driver, SlideDriver)
        else f"the distance of {' and '.join(bodies)}"
    )


def candidates(mechanism: Mechanism) -> Iterator[Driver]:
    """Yield drivers in order of preference: motors on the ground, slides, motors between bodies, then any."""
    pinned = [joint for joint in mechanism.joints if isinstance(joint, Revolute)]
    slides = [joint for joint in mechanism.joints if isinstance(joint, Translational)]
    slots = [joint for joint in mechanism.joints if isinstance(joint, PointOnLine)]
    rigid = {body for joint in mechanism.joints if isinstance(joint, Fixed) for body in joint.bodies()[1:]}
    for pin in pinned:
        if GROUND_NAME in pin.bodies():
            (name,) = (name for name in pin.bodies() if name != GROUND_NAME)
            yield AngleDriver(name, name)
    for on_ground in (True, False):
        for slide in slides:
            if (GROUND_NAME in slide.bodies()) is on_ground:
                yield SlideDriver(slide.name, slide.between, slide.axis)
    for pin in pinned:
        if GROUND_NAME not in pin.bodies():
            i, j = pin.bodies()
            yield RelativeAngleDriver(pin.name, (i, j))
    for slot in slots:
        yield SlideDriver(slot.name, slot.between, slot.axis)
    for body in mechanism.moving_bodies:
        if body.name not in rigid:
            yield AngleDriver(body.name, body.name)
            for point in body.points:
                for axis in ("x", "y"):
                    yield CoordinateDriver(f"{body.name}_{axis}", f"{body.name}.{point}", axis)


def _gradient(case: Case, driver: Driver) -> FloatArray:
    """Return the gradient of the driven quantity with respect to the scaled coordinates, (n,)."""
    probe = System(replace(case.system.mechanism, joints=(), drivers=(driver,), measures=()), case.size)
    gradient = probe.jacobian(case.q)[0] * case.system.column_scales
    length = float(np.linalg.norm(gradient))
    return np.asarray(gradient / length) if length > 0.0 else gradient


def _keys(driver: Driver) -> dict[str, Any]:
    """Return the keys of a driver's table, with the simplest law and without defaults."""
    keys: dict[str, Any] = {"type": driver.type}
    for field in fields(driver):  # type: ignore[arg-type]  # every leaf is a dataclass, unknown to the contract
        value = getattr(driver, field.name)
        if field.name not in ("name", "law") and value != field.default:
            keys[field.name] = list(value) if isinstance(value, tuple) else value
    if isinstance(driver, SlideDriver) and "axis" in keys:
        keys["axis"] = f"{math.degrees(keys['axis']):.12g} deg"
    keys["law"] = driver.law.type
    return keys


def _speed(case: Case, driver: Driver) -> dict[str, Any]:
    """Return the speed of a new driver: one turn, or a tenth of the size, over the run."""
    run = case.mechanism.run
    duration = run.stop - run.start
    if driver.quantity.kind == "angle":
        return {"speed": f"{60.0 / duration:.6g} rpm"}
    return {"speed": float(f"{_SLIDES * case.size / duration:.2g}")}


def _value(case: Case, driver: Driver) -> float:
    """Return the value of a driven quantity at the start."""
    return float(driver.measured().value(case.at_start))


def _driver_put(case: Case, driver: Driver, others: Sequence[Edit]) -> Put:
    """Return a new driver that starts where the mechanism is; others: edits that may add drivers."""
    keys, start = _keys(driver), _value(case, driver)
    if abs(start) > 1e-6:
        keys["start"] = degrees_text(start) if driver.quantity.kind == "angle" else case.rounded(start)
    keys |= _speed(case, driver)
    taken = {edit.place[1] for edit in others}
    name = case.new_name(driver.name, "drivers")
    while name in taken:
        name += "_2"
    return Put(("drivers", name), keys)


def swaps(case: Case) -> Iterator[Remedy]:
    """Yield two points of a body that are swapped."""
    for name, body in case.document["bodies"].items():
        points = body.get("points", {})
        for a, b in combinations([point for point in points if f"{name}.{point}" in case.joined], 2):
            if points[a] != points[b]:
                edits = Put(("bodies", name, "points", a), points[b]), Put(("bodies", name, "points", b), points[a])
                yield Remedy(f"swap points {a} and {b} of {name}", edits, 1.3)


def scalings(case: Case) -> Iterator[Remedy]:
    """Yield points and lengths that may be in another unit of length than the file."""
    unit = case.mechanism.length_unit
    for name, body in case.document["bodies"].items():
        points = {point: xy for point, xy in body.get("points", {}).items() if f"{name}.{point}" in case.joined}
        for factor in _FACTORS:
            word = _factor_text(factor)
            changed = {point: _scaled(xy, factor) for point, xy in points.items() if _is_length_pair(xy)}
            if len(changed) > 1:
                scaled = tuple(Put(("bodies", name, "points", point), xy) for point, xy in changed.items())
                yield Remedy(f"{word} the points of {name}: they are in another unit than {unit}", scaled, 1.2)
            for point, xy in changed.items():
                put = Put(("bodies", name, "points", point), xy)
                yield Remedy(f"{word} point {point} of {name}: it is in another unit than {unit}", (put,), 1.1)
    for joint in case.mechanism.joints:
        if isinstance(joint, Distance) and isinstance(case.document["joints"][joint.name]["length"], float):
            for factor in _FACTORS:
                put = Put(("joints", joint.name, "length"), joint.length * factor)
                text_of_slip = f"{_factor_text(factor)} the length of {joint.name}: it is in another unit than {unit}"
                yield Remedy(text_of_slip, (put,), 1.0)


def _factor_text(factor: float) -> str:
    return f"multiply by {factor:.6g}" if factor > 1.0 else f"divide by {1.0 / factor:.6g}"


def _is_length_pair(xy: Sequence[object]) -> bool:
    return any(xy) and all(isinstance(value, float) for value in xy)


def _scaled(xy: Sequence[float], factor: float) -> list[float]:
    return [float(f"{value * factor:.12g}") for value in xy]


def other_starts(case: Case) -> Iterator[Remedy]:
    """Yield start poses with an angle or a coordinate of the other sign, an angle turned by 180 degrees."""
    for body in case.mechanism.moving_bodies:
        start = body.start
        if start.phi is not None:
            turned = math.remainder(start.phi + math.pi, math.tau)
            for phi in dict.fromkeys((-start.phi, turned, -turned)):
                if abs(math.remainder(phi - start.phi, math.tau)) > 1e-9:
                    put = Put(("bodies", body.name, "start", "phi"), degrees_text(phi))
                    was = degrees_text(start.phi)
                    word = f"start {body.name} at phi = {degrees_text(phi)} in place of {was}"
                    yield Remedy(f"{word}: its joints then meet", (put,), 1.0 if phi == -start.phi else 1.2)
        for axis in ("x", "y"):
            value = getattr(start, axis)
            if value:
                put = Put(("bodies", body.name, "start", axis), -float(value))
                word = f"start {body.name} at {axis} = {-value:.6g} in place of {value:.6g}"
                yield Remedy(f"{word}: its joints then meet", (put,), 1.1)


def law_starts(case: Case) -> Iterator[Remedy]:
    """Yield laws that start where the start poses are, in place of where the mechanism cannot be."""
    law = law_targets(case.system)
    for number, driver in enumerate(case.mechanism.drivers):
        value = _value(case, driver)
        off = value - float(law[number])
        off = math.remainder(off, math.tau) if driver.quantity.kind == "angle" else off / case.size
        if "start" in case.document["drivers"][driver.name] and abs(off) > 1e-3:
            is_angle = driver.quantity.kind == "angle"
            start = degrees_text(value) if is_angle else case.rounded(value)
            put = Put(("drivers", driver.name, "start"), start)
            yield Remedy(f"start {driver.name} at {start}, where the start poses are", (put,), 1.4)
