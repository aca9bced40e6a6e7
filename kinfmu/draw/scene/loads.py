"""Shapes of loads and drivers: springs between their points, forces, torques and motions where they act."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from functools import partial

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.instant import Instant
from kinfmu.draw.scene.shape import Shape, Strip
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.drivers import CoordinateDriver, DistanceDriver, Driver, SlideDriver
from kinfmu.mechanism.joints import Distance
from kinfmu.mechanism.laws import ConstantValue, External
from kinfmu.mechanism.loads import (
    Damper,
    Following,
    ForceAlong,
    ForceAt,
    ForceBetween,
    GasSpring,
    Load,
    Spring,
    TorqueOn,
    TorsionDamper,
    TorsionSpring,
)
from kinfmu.mechanism.quantities.placement import BodyFrame, Placement, body_of, unit_vector

PITCH = 17.0  # details between symbols of one pair of points
_FIRST, _LAST = 0.0, 1.0  # parts of the distance: the ends
_COIL = 6.0  # half width of a spring's turns
_STRAIGHT = 0.2  # of the distance, straight at both ends of a spring
_CUP, _PISTON, _TUBE, _ROD = 7.0, 5.2, 5.0, 1.6  # half widths of a damper's cup and piston, a gas spring's tube and rod
_BOTTOM, _TO_TUBE = 0.2, 0.08  # of the barrel's length, before the bottom of a damper's cup and a gas spring's tube
IN_CUP, IN_TUBE = (0.27, 0.92), (0.13, 0.95)  # of the barrel's length, between which the piston is in them
_ARROW, _HEAD, _HALF_HEAD = 26.0, 7.0, 3.0  # length of an arrow; its head
_CLEAR = 5.0  # from a point to the tip of an arrow that pushes it
_TURN = (14.0, math.radians(40.0), math.radians(310.0))  # radius of a torque's arrow, and its ends
_DRIVEN = (19.0, math.radians(25.0), math.radians(115.0))  # those of a driver, ahead of its body
_PUSH, _ASIDE = 15.0, 13.0  # half length of the arrow of a straight motion, and its distance from its point
_SPIRAL = (3.5, 12.0, 2.25)  # radii of a torsion spring, and its turns
_DASHPOT = (14.0, 21.0)  # radii of a torsion damper's cup
_CUP_ANGLES, _ROD_ANGLES, _STEM = (100.0, 215.0), (150.0, 20.0), 0.5  # [deg], and of the stem behind the cup [rad]
_STEP = math.radians(15.0)  # between the corners of an arc
_APART = 3.0  # between two symbols about one pin
_Ring = Callable[[float], tuple[Strip, ...]]  # the lines of a symbol about a pin, from what is added to its radii
BETWEEN = (Spring, Damper, GasSpring, ForceBetween)  # classes of loads between two points
_SAME = 1e-6  # of the size; pins that are nearer are one place
_ARGUMENTS = 200  # of a law, in which its largest effort is looked for
_BARREL, _OF_SHORTEST = 0.62, 0.92  # length of a barrel: of the usual length, and at most of the shortest one
EFFORT_UNITS = {"force": "N", "torque": "N m"}
_TURNS, _FEWEST_MOST = 18.0, (4, 14)  # of a spring as long as the mechanism; limits of other springs


def load_shapes(shown: Instant, box: FloatArray) -> Iterator[Shape]:
    """Yield the symbols of loads and drivers of bodies whose poses are known; box: corners (2, 2) as drawn.

    A force points where its largest effort over the run does, and pushes its point if that is towards the middle. A
    constant force of 0 has no direction and no symbol, and neither has a driven cylinder. Symbols about one pin have
    different radii.
    """
    taken = Counter(
        frozenset(member.between)
        for member in (*shown.joints, *shown.drivers)
        if isinstance(member, Distance | DistanceDriver)
    )
    sharing = Counter(frozenset(load.between) for load in shown.mechanism.loads if isinstance(load, BETWEEN))
    done: Counter[frozenset[str]] = Counter()
    rings = _rings(shown, float(np.ptp(box, axis=0).max()))
    for load in shown.mechanism.loads:
        if not shown.poses.keys() >= {*load.bodies()}:
            continue
        if isinstance(load, BETWEEN):
            pair = frozenset(load.between)
            off = _off(done[pair], sharing[pair], is_taken=bool(taken[pair]))
            done[pair] += 1
            yield _between(shown, load, off, float(np.ptp(box, axis=0).max()))
        elif isinstance(load, ForceAt | ForceAlong):
            yield from _force(shown, load, box.mean(axis=0))
        elif load in rings:
            yield rings[load]
    for driver in shown.drivers:
        if isinstance(driver, SlideDriver | CoordinateDriver):
            yield _pushed(shown, driver)
        elif driver in rings:
            yield rings[driver]


def _pushed(shown: Instant, driver: SlideDriver | CoordinateDriver) -> Shape:
    """Return the arrow of a driver next to its point."""
    if isinstance(driver, SlideDriver):
        axes, point, angle = body_of(driver.between[0]), driver.between[1], float(driver.axis)
    else:
        axes, point, angle = GROUND_NAME, driver.of, 0.0 if driver.axis == "x" else 0.5 * math.pi
    towards = shown.directions.get(driver.name, 1.0) * np.array(unit_vector(angle))
    strips = _arrow(_FIRST, -_PUSH, _PUSH, _ASIDE)
    frame, at = body_of(point), shown.at(point)[None]
    return Shape("driver", driver.name, frame, at, palette.DRIVER, direction=towards, strips=strips, other=axes)


def load_text(load: Load) -> str:
    """Return the name of a load as figures show it: with its size if it is constant, or with what gives its effort."""
    if isinstance(load, ForceAt):
        return f"{load.name} = {math.hypot(load.x, load.y):.6g} N"
    if isinstance(load, Following):
        if isinstance(load.law, ConstantValue):
            return f"{load.name} = {abs(float(load.law.level)):.6g} {EFFORT_UNITS[load.noun]}"
        return f"{load.name} ({'input' if isinstance(load.law, External) else 'law'})"
    return load.name


def _telescope(shown: Instant, between: tuple[str, str], lowest: float, highest: float) -> tuple[float, float, float]:
    """Return the lengths of barrel and rod of a cylinder between two points, and 0.0 or a distance of the points.

    The piston stays between two parts of the barrel over the run. Where the distance varies too much for this, barrel
    and rod are those at the returned distance and change with it.
    """
    lengths = lengths_between(shown, between)
    usual, shortest, longest = (float(of(lengths)) for of in (np.nanmedian, np.nanmin, np.nanmax))
    barrel = max(min(_BARREL * usual, _OF_SHORTEST * shortest), (longest - shortest) / (highest - lowest))
    if barrel <= _OF_SHORTEST * shortest:
        return barrel, longest - highest * barrel, 0.0
    barrel = _BARREL * usual
    return barrel, usual - 0.5 * (lowest + highest) * barrel, usual


def lengths_between(shown: Instant, between: tuple[str, str]) -> FloatArray:
    """Return the distances (n,) of two points over the run, or as drawn without a run."""
    tracks = [shown.track(end) for end in between]
    lengths: FloatArray = np.hypot(*(tracks[1] - tracks[0]).T)
    return lengths[1:] if np.isfinite(lengths[1:]).any() else lengths  # of the run, without the drawn pose


def _off(place: int, count: int, *, is_taken: bool) -> float:
    """Return the distance of a symbol from the line of its points, if several, or a bar or cylinder, share them."""
    if is_taken:
        return PITCH * (place // 2 + 1) * (-1.0) ** place
    return PITCH * (place - 0.5 * (count - 1))


def _between(shown: Instant, load: Spring | Damper | GasSpring | ForceBetween, off: float, size: float) -> Shape:
    if isinstance(load, Spring):
        length = float(np.hypot(*(shown.point(load.between[1]) - shown.point(load.between[0]))))
        strips = spring(int(np.clip(round(_TURNS * length / (size or 1.0)), *_FEWEST_MOST)), off)
    elif isinstance(load, ForceBetween):
        strips = arrows_apart(_sense(shown, load))
    else:
        is_damper = isinstance(load, Damper)
        tube, rod, distance = _telescope(shown, load.between, *(IN_CUP if is_damper else IN_TUBE))
        strips = (damper if is_damper else gas_spring)(rod, tube, off)
        if distance:
            strips = stretched(strips, distance)
    first, last = load.between
    ends = np.array([shown.at(first), shown.at(last)])
    return _shape(load, body_of(first), ends, strips, other=body_of(last))


def _force(shown: Instant, load: ForceAt | ForceAlong, middle: FloatArray) -> Iterator[Shape]:
    if isinstance(load, ForceAt):
        size = math.hypot(load.x, load.y)
        if size == 0.0:
            return
        towards = np.array([load.x, load.y], dtype=float) / size
    else:
        towards = _sense(shown, load) * np.array(unit_vector(float(load.angle)))
    ends = shown.placed(load.axes, np.array([[0.0, 0.0], towards]))
    pushes = bool((middle - shown.point(load.at)) @ (ends[1] - ends[0]) > 0.0)
    strips = arrow(pushes=pushes)
    yield _shape(load, body_of(load.at), shown.at(load.at)[None], strips, direction=towards, other=load.axes)


def _rings(shown: Instant, size: float) -> dict[Load | Driver, Shape]:
    """Return the symbols about pins: of torques, torsion springs and dampers, and turning drivers.

    Those about one pin have different radii, springs the smallest ones. size: of the mechanism as drawn [length].
    """
    rings: list[tuple[Load | Driver, tuple[str, str], _Ring]] = []
    for load in shown.mechanism.loads:
        if not shown.poses.keys() >= {*load.bodies()}:
            continue
        if isinstance(load, TorsionSpring | TorsionDamper):
            rings.append((load, load.between[::-1], spiral if isinstance(load, TorsionSpring) else dashpot))
        elif isinstance(load, TorqueOn):
            rings.append((load, (load.on, load.against), partial(turn, _sense(shown, load))))
    for driver in shown.drivers:
        if driver.quantity.kind == "angle":
            *held, body = driver.bodies()
            ring = partial(turn, shown.directions.get(driver.name, 1.0), ring=_DRIVEN)
            rings.append((driver, (body, held[0] if held else GROUND_NAME), ring))
    shapes: dict[Load | Driver, Shape] = {}
    for member, bodies, own in sorted(rings, key=lambda entry: radii(entry[2](0.0))):
        shapes[member] = _about(shown, member, bodies, own, shapes.values(), size)
    return shapes


def _about(
    shown: Instant,
    load: Load | Driver,
    bodies: tuple[str, str],
    ring: _Ring,
    others: Iterable[Shape],
    size: float,
) -> Shape:
    """Return a symbol about the pin of two bodies, that turns with the first; without a pin it is about its origin.

    others: symbols, of which those about the same pin keep their radii.
    """
    body, against = bodies if bodies[0] != GROUND_NAME else bodies[::-1]
    pin = shown.pivot(body, against)
    at = shown.at(pin) if pin else np.zeros(2)
    (place,) = shown.placed(body, at[None])
    same = [
        other for other in others if np.hypot(*(shown.placed(other.frame, other.points)[0] - place)) <= _SAME * size
    ]
    strips = ring(beyond([other.strips for other in same], ring(0.0)))
    if isinstance(load, Driver):
        angle = _heading(shown, body, at)
        towards = np.array([math.cos(angle), math.sin(angle)])
        return Shape("driver", load.name, body, at[None], palette.DRIVER, direction=towards, strips=strips)
    return _shape(load, body, at[None], strips, direction=np.array([1.0, 0.0]))


def _heading(shown: Instant, body: str, at: FloatArray) -> float:
    """Return the angle [rad], in its frame, of the line from a point of a body to the one furthest from it."""
    points = [shown.at(name) - at for name in shown.body_points if body_of(name) == body]
    furthest = max(points, key=lambda vector: float(np.hypot(*vector)), default=np.zeros(2))
    return math.atan2(furthest[1], furthest[0])


def _shape(
    load: Load,
    frame: str,
    points: FloatArray,
    strips: tuple[Strip, ...],
    *,
    direction: FloatArray | None = None,
    other: str = "",
) -> Shape:
    return Shape(load.type, load.name, frame, points, palette.LOAD, direction=direction, strips=strips, other=other)


def _sense(shown: Instant, load: Following) -> float:
    """Return 1.0 or -1.0, the sign of the largest effort of a load over the run; 1.0 for an input."""
    if isinstance(load.law, External):
        return 1.0
    run = shown.mechanism.run
    times = np.linspace(float(run.start), float(run.stop), _ARGUMENTS).tolist()
    arguments = times if load.over is None else list(_arguments(shown, load))
    efforts = [float(load.effort(argument)) for argument in arguments]
    return -1.0 if max(efforts, key=abs, default=1.0) < 0.0 else 1.0


def _arguments(shown: Instant, load: Following) -> Iterator[float]:
    """Yield the arguments of the law of a load over the run."""
    bodies = load.over.bodies() if load.over else ()
    rows = np.flatnonzero(np.isfinite(np.hstack([shown.poses[body] for body in bodies])).all(axis=1))
    for row in rows[:: max(-(-len(rows) // _ARGUMENTS), 1)].tolist():
        poses = {body: BodyFrame.of(*shown.poses[body][row].tolist()) for body in bodies}
        yield float(load.argument(Placement(poses, shown.body_points)) or 0.0)


def spring(turns: int, off: float = 0.0) -> tuple[Strip, ...]:
    """Return a zigzag between two points; off: its distance from their line, in details."""
    step = (1.0 - 2.0 * _STRAIGHT) / (2 * turns)
    corners = [(_STRAIGHT + step * (k + 0.5), off + _COIL * (-1.0) ** k) for k in range(2 * turns)]
    route = [(0.0, off), (_STRAIGHT, off), *corners, (1.0 - _STRAIGHT, off), (1.0, off)]
    ends = ([(0.0, 0.0)], [(1.0, 0.0)]) if off else ([], [])
    return (_line((part, 0.0, 0.0, across) for part, across in (*ends[0], *route, *ends[1])),)


def damper(rod: float, tube: float, off: float = 0.0) -> tuple[Strip, ...]:
    """Return a dashpot: a cup that is open towards the second point, from which a rod [length] holds the piston."""
    bottom, end = _BOTTOM * tube, [(0.0, 0.0)] if off else []
    cup = [(tube, off + _CUP), (bottom, off + _CUP), (bottom, off - _CUP), (tube, off - _CUP)]
    return (
        _at_end(_FIRST, [*end, (0.0, off), (bottom, off)]),
        _at_end(_FIRST, cup),
        _at_end(_LAST, [(-rod, off), (0.0, off), *end]),
        _at_end(_LAST, [(-rod, off - _PISTON), (-rod, off + _PISTON)]),
    )


def gas_spring(rod: float, tube: float, off: float = 0.0) -> tuple[Strip, ...]:
    """Return a cylinder from the first point, with a rod [length] from the second one."""
    start, end = _TO_TUBE * tube, [(0.0, 0.0)] if off else []
    return (
        _at_end(_LAST, _box(-rod, 0.0, off, _ROD), "case"),
        _at_end(_FIRST, [*end, (0.0, off), (start, off)]),
        _at_end(_FIRST, _box(start, tube, off, _TUBE), "case"),
        _at_end(_LAST, [(-rod, off - _TUBE), (-rod, off + _TUBE)]),
        *([_at_end(_LAST, [(0.0, off), *end])] if off else []),
    )


def stretched(strips: Iterable[Strip], distance: float) -> tuple[Strip, ...]:
    """Return a symbol whose lengths are those at a distance of its points and change with it."""
    scaled = []
    for strip in strips:
        part, length, along, across = strip.points.T
        scaled.append(strip._replace(points=np.column_stack([part + length / distance, 0.0 * length, along, across])))
    return tuple(scaled)


def arrow(*, pushes: bool) -> tuple[Strip, ...]:
    """Return the arrow of a force along its direction; pushes: True if its tip is at the point, else its tail is."""
    return _arrow(_FIRST, -_CLEAR - _ARROW, -_CLEAR) if pushes else _arrow(_FIRST, 0.0, _ARROW)


def arrows_apart(sense: float) -> tuple[Strip, ...]:
    """Return a line between two points with arrows that push them apart or, with a sense of -1.0, together."""
    line = _line([(_FIRST, 0.0, 0.0, 0.0), (_LAST, 0.0, 0.0, 0.0)])
    return (line, *_arrow(_FIRST, 0.0, -sense * _ARROW), *_arrow(_LAST, 0.0, sense * _ARROW))


def turn(sense: float, out: float = 0.0, ring: tuple[float, float, float] = _TURN) -> tuple[Strip, ...]:
    """Return a circular arrow; sense: -1.0 if it is clockwise, else 1.0; out: added to its radius; ring: as _TURN."""
    radius, first, last = ring[0] + out, *ring[1:]
    tip = last + _HEAD / radius
    arc = _polar(radius, _angles(first, last))
    base, point = arc[-1], _polar(radius, np.array([tip]))[0]
    way = (point - base) / np.hypot(*(point - base))  # the head lies along the chord
    across = _HALF_HEAD * np.array([-way[1], way[0]])
    mirror = np.array([1.0, sense])
    return _flat(arc * mirror), _flat(np.array([point, base + across, base - across]) * mirror, "head")


def spiral(out: float = 0.0) -> tuple[Strip, ...]:
    """Return the spiral of a torsion spring; out: added to its radii."""
    inner, outer, turns = _SPIRAL[0] + out, _SPIRAL[1] + out, _SPIRAL[2]
    angles = _angles(0.0, math.tau * turns)
    radii = inner + (outer - inner) * angles / angles[-1]
    return (_flat(np.vstack([_polar(radii, angles), [[0.0, outer + _CLEAR]]])),)


def dashpot(out: float = 0.0) -> tuple[Strip, ...]:
    """Return the curved dashpot of a torsion damper; out: added to its radii."""
    inner, outer = (radius + out for radius in _DASHPOT)
    middle = 0.5 * (inner + outer)
    cup, rod = (_angles(*map(math.radians, ends)) for ends in (_CUP_ANGLES, _ROD_ANGLES))
    piston = np.array([inner + 1.0, outer - 1.0])
    return (
        _flat(np.vstack([_polar(outer, cup), _polar(inner, cup[::-1])])),
        _flat(_polar(piston, np.full(2, rod[0]))),
        _flat(_polar(middle, rod)),
        _flat(_polar(middle, cup[-1] + np.array([0.0, _STEM]))),
    )


def beyond(others: Iterable[tuple[Strip, ...]], strips: tuple[Strip, ...]) -> float:
    """Return what to add to the radii of a symbol about a pin, so that it is clear of others about the same pin."""
    inner, outer = radii(strips)
    out = 0.0
    for low, high in sorted(map(radii, others)):
        if low - _APART < outer + out and inner + out < high + _APART:
            out = high + _APART - inner
    return out


def radii(strips: tuple[Strip, ...]) -> tuple[float, float]:
    """Return the smallest and largest distance of the corners of a symbol from its pin."""
    distances = np.concatenate([np.hypot(*strip.points[:, 2:].T) for strip in strips])
    return float(distances.min()), float(distances.max())


def _arrow(part: float, tail: float, tip: float, off: float = 0.0) -> tuple[Strip, ...]:
    """Return a straight arrow along the direction, from `tail` to `tip` in details, at a distance from its line."""
    base = tip - math.copysign(_HEAD, tip - tail)
    head = [(tip, off), (base, off + _HALF_HEAD), (base, off - _HALF_HEAD)]
    return (
        _line((part, 0.0, along, off) for along in (tail, base)),
        _line(((part, 0.0, along, across) for along, across in head), "head"),
    )


def _box(first: float, last: float, off: float, half: float) -> list[tuple[float, float]]:
    return [(first, off - half), (last, off - half), (last, off + half), (first, off + half)]


def _at_end(part: float, points: Iterable[tuple[float, float]], stroke: str = "symbol") -> Strip:
    """Return a strip that keeps its length, fixed at one of two points; points: (length, across)."""
    return _line(((part, length, 0.0, across) for length, across in points), stroke)


def _polar(radius: float | FloatArray, angles: FloatArray) -> FloatArray:
    """Return points (k, 2) on a circle or spiral."""
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles)])


def _flat(points: FloatArray, stroke: str = "symbol") -> Strip:
    """Return a strip at one point; points: (k, 2) in details."""
    return Strip(np.column_stack([0.0 * points, points]), stroke)


def _angles(first: float, last: float) -> FloatArray:
    return np.linspace(first, last, max(round(abs(last - first) / _STEP), 2) + 1)


def _line(points: Iterable[tuple[float, float, float, float]], stroke: str = "symbol") -> Strip:
    return Strip(np.array(list(points), dtype=float), stroke)
