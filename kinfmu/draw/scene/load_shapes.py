"""Shapes of loads: springs, dampers and gas springs between their points, forces and torques where they act."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from functools import partial

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import palette, symbols
from kinfmu.draw.scene.instant import Instant
from kinfmu.draw.scene.shape import Shape
from kinfmu.draw.scene.symbols import Strip
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.drivers import DistanceDriver
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

_Ring = Callable[[float], tuple[Strip, ...]]  # the lines of a symbol about a pin, from what is added to its radii
BETWEEN = (Spring, Damper, GasSpring, ForceBetween)  # classes of loads between two points
_TORSION: dict[type[Load], _Ring] = {TorsionSpring: symbols.spiral, TorsionDamper: symbols.dashpot}
_SAME = 1e-6  # of the size; pins that are nearer are one place
_ARGUMENTS = 200  # of a law, in which its largest effort is looked for
_BARREL, _OF_SHORTEST = 0.62, 0.92  # length of a barrel: of the usual length, and at most of the shortest one
EFFORT_UNITS = {"force": "N", "torque": "N m"}
_TURNS, _FEWEST_MOST = 18.0, (4, 14)  # of a spring as long as the mechanism; limits of other springs


def load_shapes(shown: Instant, box: FloatArray) -> Iterator[Shape]:
    """Yield the symbols of loads on bodies whose poses are known; box: corners (2, 2) of the mechanism as drawn.

    A force points where its largest effort over the run does, and pushes its point if that is towards the middle. A
    constant force of 0 has no direction and no symbol. Symbols about one pin have different radii.
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
        elif load.name in rings:
            yield rings[load.name]


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
        return symbols.PITCH * (place // 2 + 1) * (-1.0) ** place
    return symbols.PITCH * (place - 0.5 * (count - 1))


def _between(shown: Instant, load: Spring | Damper | GasSpring | ForceBetween, off: float, size: float) -> Shape:
    if isinstance(load, Spring):
        length = float(np.hypot(*(shown.point(load.between[1]) - shown.point(load.between[0]))))
        strips = symbols.spring(int(np.clip(round(_TURNS * length / (size or 1.0)), *_FEWEST_MOST)), off)
    elif isinstance(load, ForceBetween):
        strips = symbols.arrows_apart(_sense(shown, load))
    else:
        is_damper = isinstance(load, Damper)
        tube, rod, distance = _telescope(shown, load.between, *(symbols.IN_CUP if is_damper else symbols.IN_TUBE))
        strips = (symbols.damper if is_damper else symbols.gas_spring)(rod, tube, off)
        if distance:
            strips = symbols.stretched(strips, distance)
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
    strips = symbols.arrow(pushes=pushes)
    yield _shape(load, body_of(load.at), shown.at(load.at)[None], strips, direction=towards, other=load.axes)


def _rings(shown: Instant, size: float) -> dict[str, Shape]:
    """Return the symbols about pins, by load: of torques, torsion springs and torsion dampers on known bodies.

    Those about one pin have different radii, springs the smallest ones. size: of the mechanism as drawn [length].
    """
    wanted: list[tuple[Load, tuple[str, str], _Ring]] = []
    for load in shown.mechanism.loads:
        if not shown.poses.keys() >= {*load.bodies()}:
            continue
        if isinstance(load, TorsionSpring | TorsionDamper):
            wanted.append((load, load.between[::-1], _TORSION[type(load)]))
        elif isinstance(load, TorqueOn):
            wanted.append((load, (load.on, load.against), partial(symbols.turn, _sense(shown, load))))
    found: dict[str, Shape] = {}
    for load, bodies, ring in sorted(wanted, key=lambda one: symbols.radii(one[2](0.0))):
        found[load.name] = _about(shown, load, bodies, ring, found.values(), size)
    return found


def _about(
    shown: Instant,
    load: Load,
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
    strips = ring(symbols.beyond([other.strips for other in same], ring(0.0)))
    return _shape(load, body, at[None], strips, direction=np.array([1.0, 0.0]))


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
