"""Families of random mechanisms: each draws a sketch, from a random generator."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import partial
from random import Random

import numpy as np

from kinfmu import (
    AngleBetween,
    AngleDriver,
    ConstantSpeed,
    Coupling,
    Distance,
    DistanceDriver,
    Gear,
    PointOnLine,
    SlideDriver,
    Translational,
)
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.joints import Joint
from tests.stress.drawn import TURN, DrawnLaw, Frame, Pose, Sketch, framed, standing, world
from tests.stress.inverse import driven_at
from tests.stress.jets import LONG, Array, Exact, Jet, Numbers, Value, Vector, turned
from tests.stress.loops import Closing, between, in_slot, on_arm, on_level, on_slide

ENDS = (0.0, math.pi)  # of an arm: stretched toward its pivot and away from it
_HEADINGS = [  # exact directions
    (x * Fraction(a, c), y * Fraction(b, c))
    for a, b, c in ((1, 0, 1), (0, 1, 1), (3, 4, 5), (4, 3, 5), (5, 12, 13), (12, 5, 13), (20, 21, 29))
    for x in (1, -1)
    for y in (1, -1)
]
KINDS = ("double crank", "crank-rocker", "double rocker", "rocker-crank", "triple rocker")
ORIGIN: tuple[Exact, Exact] = (0, 0)
Poses = Callable[[Numbers, Sequence[Jet], Closing], dict[str, Pose]]


class RedrawError(Exception):
    """What was drawn is no mechanism of its family."""


class Draw(Random):
    """A random generator, and the parts of a unit that it draws lengths in."""

    parts = 1000
    finest = 11  # decimals of a small difference


def drawn_length(rng: Draw, low: float, high: float) -> Fraction:
    """A length in thousandths, or whatever parts are drawn in."""
    return Fraction(rng.randint(math.ceil(rng.parts * low), math.floor(rng.parts * high)), rng.parts)


def _place(rng: Draw, reach: float) -> tuple[Fraction, Fraction]:
    return drawn_length(rng, -reach, reach), drawn_length(rng, -reach, reach)


def _side(rng: Draw) -> int:
    return rng.choice((1, -1))


def _turns(body: str) -> Callable[[Frame, Sequence[float]], tuple[Driver, ...]]:
    return lambda _, start: (AngleDriver("drive", body, ConstantSpeed(start[0], 1.0)),)


def _turn_each(*bodies: str) -> Callable[[Frame, Sequence[float]], tuple[Driver, ...]]:
    return lambda _, start: tuple(
        AngleDriver(f"drive_{body}", body, ConstantSpeed(value, 1.0)) for body, value in zip(bodies, start, strict=True)
    )


# ---------------------------------------------------------------------------------------------------- four-bars


def grashof(rng: Draw, kind: str) -> tuple[Fraction, ...]:
    """Ground, crank, coupler and rocker of one of Grashof's kinds."""
    while True:
        shortest, second, third = sorted(drawn_length(rng, 0.3, 3.0) for _ in range(3))
        edge = second + third - shortest  # of the longest: beyond it the linkage is not Grashof's any more
        is_triple = kind == "triple rocker"
        low, high = (max(third, edge), edge + 2 * shortest) if is_triple else (third, edge)
        if high - low < Fraction(1, 100) or len({shortest, second, third}) < 3:
            continue
        longest = low + (high - low) * Fraction(rng.randint(20, 980), 1000)
        others = [second, third, Fraction(round(longest * rng.parts), rng.parts)]
        rng.shuffle(others)
        place = rng.randrange(4) if is_triple else KINDS.index(kind)
        return (*others[:place], shortest, *others[place:])


def changing(rng: Draw) -> tuple[Fraction, ...]:
    """Ground, crank, coupler and rocker of a four-bar with change points: shortest + longest = the other two."""
    shape = rng.choice(("parallelogram", "rhombus", "kite", "any", "any"))
    a, b = drawn_length(rng, 0.3, 2.0), drawn_length(rng, 0.3, 2.0)
    if shape == "rhombus":
        return a, a, a, a
    if a == b:
        raise RedrawError
    if shape == "parallelogram":
        return a, b, a, b
    if shape == "kite":
        return rng.choice(((a, a, b, b), (a, b, b, a)))
    middle = a + b + drawn_length(rng, 0.0, 1.0)
    bars = [a, b, middle, a + b - middle if rng.random() < 0.5 else middle + abs(a - b)]
    if min(bars) <= Fraction(1, 20):
        bars = [a, middle, b, a + middle - b]  # a + middle = b + last
    if min(bars) <= Fraction(1, 20) or not _changes(bars):
        raise RedrawError
    rng.shuffle(bars)
    return tuple(bars)


def _changes(bars: Sequence[Fraction]) -> bool:
    return 2 * (min(bars) + max(bars)) == sum(bars)


def fourbar(bars: Sequence[Fraction], driven: str, side: int, frame: tuple[Exact, Exact] = ORIGIN) -> Sketch:
    """A four-bar between (0, 0) and (ground, 0), driven at one of its three bars; frame: of the coupler's pin P."""
    g, a, b, c = bars

    def poses(numbers: Numbers, u: Sequence[Jet], closing: Closing) -> dict[str, Pose]:
        if driven == "crank":
            way = on_arm(closing, (g, a, b, c), side, u[0])
            crank, coupler, rocker = u[0], way.first.heading(), way.second.heading()
            p = turned(u[0], numbers.number(a))
        elif driven == "coupler":
            way = on_arm(closing, (g, b, a, c), side, u[0])
            crank, coupler, rocker = way.first.heading(), u[0], way.second.heading()
            p = way.first
        else:  # the rocker's own way is that of an arm half a turn on
            way = on_arm(closing, (g, c, a, b), side, u[0] + numbers.pi)
            crank, coupler, rocker = way.first.heading(), (-way.second.x, -way.second.y), u[0]
            coupler = Vector(*coupler).heading()
            p = way.first
        zero = u[0] * numbers.number(0)
        return {
            "crank": Pose(Vector(0, 0), crank),
            "coupler": framed(numbers, p, coupler, frame),
            "rocker": Pose(Vector(zero + numbers.number(g), zero), rocker),
        }

    points = {
        "ground": {"O": ORIGIN, "C": (g, 0)},
        "crank": {"O": ORIGIN, "P": (a, 0)},
        "coupler": {"P": frame, "Q": (frame[0] + b, frame[1])},
        "rocker": {"C": ORIGIN, "Q": (c, 0)},
    }
    return Sketch(points, poses, _turns(driven), marks=ENDS)


def _driven(rng: Draw) -> str:
    return rng.choice(("crank", "crank", "coupler", "rocker"))


def _shifted(rng: Draw) -> tuple[Exact, Exact]:
    return ORIGIN if rng.random() < 0.5 else _place(rng, 1.0)


def four_bars(rng: Draw) -> Sketch:
    return fourbar(grashof(rng, rng.choice(KINDS)), _driven(rng), _side(rng), _shifted(rng))


def change_points(rng: Draw) -> Sketch:
    return fourbar(changing(rng), _driven(rng), _side(rng), _shifted(rng))


def near_change_points(rng: Draw) -> Sketch:
    bars = list(changing(rng))
    bars[rng.randrange(4)] += _gap(rng)
    return fourbar(bars, _driven(rng), _side(rng))


def _gap(rng: Draw) -> Fraction:
    """A small difference, 1e-11 to 1e-2, either way; no finer than doubles tell apart where it stands."""
    return Fraction(_side(rng) * rng.randint(1, 9), 10 ** rng.randint(3, rng.finest))


# ------------------------------------------------------------------------------------------------- slider-cranks


def slider_crank(
    lengths: tuple[Fraction, Fraction, Fraction], driven: str, side: int, *, has_block: bool = True
) -> Sketch:
    """A crank about (0, 0) and a rod whose end stays on y = offset, in a block or as a pin in a slot."""
    a, b, offset = lengths

    def poses(numbers: Numbers, u: Sequence[Jet], closing: Closing) -> dict[str, Pose]:
        if driven == "crank":
            rod = on_level(closing, a, b, offset, side, u[0])
            crank = turned(u[0], numbers.number(a))
            angles = u[0], rod.heading()
        elif driven == "rod":
            crank = on_level(closing, b, a, offset, side, u[0])
            rod = turned(u[0], numbers.number(b))
            angles = crank.heading(), u[0]
        else:
            way = on_slide(closing, a, b, offset, side, u[0])
            crank, rod = way.first, way.second.times(-1)
            angles = crank.heading(), rod.heading()
        moving = {"crank": Pose(Vector(0, 0), angles[0]), "rod": Pose(crank, angles[1])}
        if has_block:
            end = crank + rod
            zero = u[0] * numbers.number(0)
            moving["block"] = Pose(Vector(end.x, zero + numbers.number(offset)), zero)
        return moving

    def joints(frame: Frame) -> tuple[Joint, ...]:
        if has_block:
            return (Translational("slide", ("ground.way", "block.S"), frame.angle, frame.angle),)
        return (PointOnLine("slot", ("ground.way", "rod.S"), frame.angle),)

    def drivers(frame: Frame, start: Sequence[float]) -> tuple[Driver, ...]:
        law = ConstantSpeed(start[0], 1.0)
        if driven == "slide":
            return (SlideDriver("drive", ("ground.way", "block.S" if has_block else "rod.S"), frame.angle, law),)
        return (AngleDriver("drive", driven, law),)

    points: dict[str, dict[str, tuple[Exact, Exact]]] = {
        "ground": {"O": ORIGIN, "way": (0, offset)},
        "crank": {"O": ORIGIN, "P": (a, 0)},
        "rod": {"P": ORIGIN, "S": (b, 0)},
    }
    if has_block:
        points["block"] = {"S": ORIGIN}
    if driven == "slide":
        far = float(a + b)
        return Sketch(points, poses, drivers, joints, ("length",), (0.0,), reach=(-far, far))
    return Sketch(points, poses, drivers, joints, marks=(-0.5 * math.pi, 0.5 * math.pi))


def slider_cranks(rng: Draw) -> Sketch:
    lengths = drawn_length(rng, 0.2, 2.0), drawn_length(rng, 0.5, 4.0), drawn_length(rng, -1.5, 1.5)
    driven = rng.choice(("crank", "crank", "rod", "slide"))
    if lengths[0] == lengths[1] and driven == "slide":
        raise RedrawError
    return slider_crank(lengths, driven, _side(rng), has_block=rng.random() < 0.6)


def crank_and_rod(rng: Draw) -> Sketch:
    """Slider-cranks with change points, or close to them: crank = rod in line, or as much apart as the offset."""
    a = drawn_length(rng, 0.3, 2.0)
    offset = Fraction(0) if rng.random() < 0.5 else _side(rng) * drawn_length(rng, 0.1, 1.0)
    b = a + abs(offset)
    driven = rng.choice(("crank", "rod", "slide")) if offset else "crank"
    if driven == "rod":
        a, b = b, a
    if rng.random() < 0.3:
        b += _gap(rng)
    return slider_crank((a, b, offset), driven, _side(rng), has_block=rng.random() < 0.6)


def pins_in_slots(rng: Draw) -> Sketch:
    """Inverted slider-cranks: the crank's pin in a slot of a lever, at times with change points."""
    g, a, e = drawn_length(rng, 0.3, 2.0), drawn_length(rng, 0.3, 2.0), drawn_length(rng, 0.0, 0.8)
    chance = rng.random()
    if chance < 0.2:
        e = abs(g - a)
    elif chance < 0.3:
        e = abs(g - a) + _gap(rng)
    elif chance < 0.4:
        g, e = a, Fraction(0)
    elif chance < 0.6:
        e = Fraction(0)
    if e == 0 and g == a and chance >= 0.4:
        raise RedrawError
    side, has_block = _side(rng), rng.random() < 0.5

    def poses(numbers: Numbers, u: Sequence[Jet], closing: Closing) -> dict[str, Pose]:
        lever = in_slot(closing, g, a, e, side, u[0]).heading()
        zero = u[0] * numbers.number(0)
        moving = {
            "crank": Pose(Vector(0, 0), u[0]),
            "lever": Pose(Vector(zero + numbers.number(g), zero), lever),
        }
        if has_block:
            moving["block"] = Pose(turned(u[0], numbers.number(a)), lever)
        return moving

    def joints(_: Frame) -> tuple[Joint, ...]:
        if has_block:
            return (Translational("slide", ("lever.slot", "block.P")),)
        return (PointOnLine("slot", ("lever.slot", "crank.P")),)

    points: dict[str, dict[str, tuple[Exact, Exact]]] = {
        "ground": {"O": ORIGIN, "C": (g, 0)},
        "crank": {"O": ORIGIN, "P": (a, 0)},
        "lever": {"C": ORIGIN, "slot": (0, e)},
    }
    if has_block:
        points["block"] = {"P": ORIGIN}
    return Sketch(points, poses, _turns("crank"), joints, marks=ENDS)


# ----------------------------------------------------------------------------------------------------- six-bars


def _any_bars(rng: Draw) -> tuple[Fraction, ...]:
    return changing(rng) if rng.random() < 0.25 else grashof(rng, rng.choice(KINDS))


def watt_six_bars(rng: Draw) -> Sketch:
    """Watt I: a four-bar with two more bars, from a third pin of its coupler and of its rocker."""
    return _watt(rng, _driven(rng))


def _watt(rng: Draw, driven: str) -> Sketch:
    bars, side = _any_bars(rng), _side(rng)
    r, s, t = _place(rng, 2.0), _place(rng, 2.0), (drawn_length(rng, 0.5, 4.0), drawn_length(rng, 0.5, 4.0))
    base, second = fourbar(bars, driven, side), _side(rng)

    def poses(numbers: Numbers, u: Sequence[Jet], closing: Closing) -> dict[str, Pose]:
        moving = base.poses(numbers, u, closing)
        at_r, at_s = world(numbers, moving["coupler"], r), world(numbers, moving["rocker"], s)
        way = between(closing, at_r, (numbers.number(t[0]), numbers.number(t[1])), at_s, second)
        return {**moving, "left": Pose(at_r, way.first.heading()), "right": Pose(at_s, way.second.heading())}

    points = {body: dict(given) for body, given in base.points.items()}
    points["coupler"]["R"], points["rocker"]["S"] = r, s
    points["left"] = {"R": ORIGIN, "T": (t[0], 0)}
    points["right"] = {"S": ORIGIN, "T": (t[1], 0)}
    return Sketch(points, poses, _turns(driven), marks=ENDS)


def stephenson_six_bars(rng: Draw) -> Sketch:
    """Stephenson III: a four-bar with a link from a third pin of its coupler to an output on a third ground pivot."""
    return _stephenson(rng, _driven(rng))


def _stephenson(rng: Draw, driven: str) -> Sketch:
    bars, side = _any_bars(rng), _side(rng)
    r, d, t = _place(rng, 2.0), _place(rng, 3.0), (drawn_length(rng, 0.5, 4.0), drawn_length(rng, 0.5, 4.0))
    base, second = fourbar(bars, driven, side), _side(rng)

    def poses(numbers: Numbers, u: Sequence[Jet], closing: Closing) -> dict[str, Pose]:
        moving = base.poses(numbers, u, closing)
        at_d, at_r = standing(numbers, *d, u[0]), world(numbers, moving["coupler"], r)
        way = between(closing, at_r, (numbers.number(t[0]), numbers.number(t[1])), at_d, second)
        return {**moving, "link": Pose(at_r, way.first.heading()), "output": Pose(at_d, way.second.heading())}

    points = {body: dict(given) for body, given in base.points.items()}
    points["ground"]["D"], points["coupler"]["R"] = d, r
    points["link"] = {"R": ORIGIN, "T": (t[0], 0)}
    points["output"] = {"D": ORIGIN, "T": (t[1], 0)}
    return Sketch(points, poses, _turns(driven), marks=ENDS)


def six_bars_driven_at_the_end(rng: Draw) -> Sketch:
    """Watt's and Stephenson's driven at their last bar: no loop of them closes alone."""
    if rng.random() < 0.5:
        sketch, body = _watt(rng, "crank"), rng.choice(("left", "right"))
    else:
        sketch, body = _stephenson(rng, "crank"), rng.choice(("link", "output"))
    driven = driven_at(sketch, body, rng.random())
    if driven is None:
        raise RedrawError
    return replace(driven, drivers=_turns(body))


# ------------------------------------------------------------------------------------------------- several loops


def chains(rng: Draw) -> Sketch:
    """Two to five four-bars in a row: the rocker of each is the crank of the next, parallelograms first."""
    count = rng.randint(2, 5)
    parallel = rng.choice((0, 0, 1, count - 1, count))
    stages: list[tuple[tuple[Fraction, ...], int]] = []
    for k in range(count):
        if k < parallel:
            g, a = drawn_length(rng, 0.5, 2.0), drawn_length(rng, 0.5, 2.0)
            stages.append(((g, a, g, a), 0))
        elif k == parallel == count - 1:
            stages.append((_any_bars(rng), _side(rng)))
        else:
            stages.append((grashof(rng, rng.choice(("double crank", "crank-rocker"))), _side(rng)))
    if all(bars[0] == bars[1] for bars, _ in stages):
        raise RedrawError

    def poses(numbers: Numbers, u: Sequence[Jet], closing: Closing) -> dict[str, Pose]:
        theta, x = u[0], Fraction(0)
        moving = {"crank": Pose(Vector(0, 0), theta)}
        for k, ((g, a, b, c), side) in enumerate(stages):
            p = turned(theta, numbers.number(a)) + standing(numbers, x, 0, theta)
            if side:
                way = on_arm(closing, (g, a, b, c), side, theta)
                coupler, theta = way.first.heading(), way.second.heading()
            else:  # a parallelogram that stays one
                closing.sines.append(theta.sin_cos()[0].d0)
                coupler = theta * numbers.number(0)
            x += g
            moving[f"coupler{k}"] = Pose(p, coupler)
            moving[f"rocker{k}"] = Pose(standing(numbers, x, 0, theta), theta)
        return moving

    points: dict[str, dict[str, tuple[Exact, Exact]]] = {"ground": {"O": ORIGIN}, "crank": {"O": ORIGIN}}
    x, last = Fraction(0), "crank"
    for k, ((g, a, b, c), _) in enumerate(stages):
        x += g
        points["ground"][f"C{k}"] = (x, 0)
        points[last][f"P{k}"] = (a, 0)
        points[f"coupler{k}"] = {f"P{k}": ORIGIN, f"Q{k}": (b, 0)}
        points[f"rocker{k}"] = {f"C{k}": ORIGIN, f"Q{k}": (c, 0)}
        last = f"rocker{k}"
    return Sketch(points, poses, _turns("crank"), marks=ENDS)


def geared_five_bars(rng: Draw) -> Sketch:
    """Two cranks geared together, and two bars between their ends."""
    ratio = Fraction(rng.choice((-3, -2, -1, 1, 2, 3)), rng.choice((1, 1, 2)))
    offset = drawn_length(rng, -3.0, 3.0)
    g, a, b, c, e = (drawn_length(rng, 0.3, 2.0) for _ in range(5))
    side = _side(rng)

    def poses(numbers: Numbers, u: Sequence[Jet], closing: Closing) -> dict[str, Pose]:
        other = u[0] * numbers.number(ratio) + numbers.number(offset)
        at_c = standing(numbers, g, 0, u[0])
        p, q = turned(u[0], numbers.number(a)), at_c + turned(other, numbers.number(e))
        way = between(closing, p, (numbers.number(b), numbers.number(c)), q, side)
        return {
            "crank": Pose(Vector(0, 0), u[0]),
            "gear": Pose(at_c, other),
            "left": Pose(p, way.first.heading()),
            "right": Pose(q, way.second.heading()),
        }

    def joints(frame: Frame) -> tuple[Joint, ...]:
        turn = frame.angle * (1.0 - float(ratio)) + float(offset)
        return (Gear("gears", ("crank", "gear"), float(ratio), offset=turn),)

    points: dict[str, dict[str, tuple[Exact, Exact]]] = {
        "ground": {"O": ORIGIN, "C": (g, 0)},
        "crank": {"O": ORIGIN, "P": (a, 0)},
        "gear": {"C": ORIGIN, "Q": (e, 0)},
        "left": {"P": ORIGIN, "T": (b, 0)},
        "right": {"Q": ORIGIN, "T": (c, 0)},
    }
    return Sketch(points, poses, _turns("crank"), joints)


def redundant_parallelograms(rng: Draw) -> Sketch:
    """Parallel cranks with a third bar, as a distance or as a body, that adds no freedom and takes none.

    Away from the line of the cranks it carries the coupler where they are stretched: no branches cross.
    """
    g, a = drawn_length(rng, 0.3, 2.0), drawn_length(rng, 0.3, 2.0)
    third = (drawn_length(rng, -2.0, 3.0), Fraction(0) if rng.random() < 0.6 else drawn_length(rng, -1.0, 1.0))
    if third[0] in (0, g):
        raise RedrawError
    is_body = rng.random() < 0.5

    def poses(numbers: Numbers, u: Sequence[Jet], closing: Closing) -> dict[str, Pose]:
        across = [np.abs(turned(u[0], numbers.number(x), numbers.number(-y)).y.d0) for x, y in ((g, 0), third)]
        closing.sines.append(np.maximum(*across) if third[1] else across[0])
        moving = {
            "crank": Pose(Vector(0, 0), u[0]),
            "coupler": Pose(turned(u[0], numbers.number(a)), u[0] * numbers.number(0)),
            "rocker": Pose(standing(numbers, g, 0, u[0]), u[0]),
        }
        if is_body:
            moving["bar"] = Pose(standing(numbers, *third, u[0]), u[0])
        return moving

    def joints(frame: Frame) -> tuple[Joint, ...]:
        return () if is_body else (Distance("AB", ("ground.B", "coupler.A"), frame.length(a)),)

    points: dict[str, dict[str, tuple[Exact, Exact]]] = {
        "ground": {"O": ORIGIN, "C": (g, 0), "B": third},
        "crank": {"O": ORIGIN, "P": (a, 0)},
        "coupler": {"P": ORIGIN, "Q": (g, 0), "A": third},
        "rocker": {"C": ORIGIN, "Q": (a, 0)},
    }
    if is_body:
        points["bar"] = {"B": ORIGIN, "A": (a, 0)}
    return Sketch(points, poses, _turns("crank"), joints, marks=ENDS)


def translating_tables(rng: Draw) -> Sketch:
    """A table on parallel legs, one of them a driven crank, the others bars or distances: its angle rests.

    With all pins in line it has change points; away from the line a leg carries the table where the others are in line.
    Some carry a second table on a crank with a driver of its own, or a driven arm.
    """
    points: dict[str, dict[str, tuple[Exact, Exact]]] = {"ground": {}}
    legs: list[tuple[str, str, Fraction, tuple[Fraction, Fraction], bool]] = []
    tops = rng.choice(("", "", "table", "arm"))
    stages = [(drawn_length(rng, 0.2, 1.0), rng.random() < 0.3), (drawn_length(rng, 0.2, 1.0), False)]
    for k, (a, is_in_line) in enumerate(stages if tops == "table" else stages[:1]):
        below = f"table{k - 1}" if k else "ground"
        pins = [(drawn_length(rng, 0.3, 2.0), Fraction(0)), _place(rng, 2.0)]
        if is_in_line:
            pins = pins[:1] if rng.random() < 0.5 else [pins[0], (-pins[0][0] / 2, Fraction(0))]
        elif abs(pins[1][1]) < max(Fraction(1, 5), abs(pins[1][0]) / 4):
            raise RedrawError  # nearly in line
        points[below][f"O{k}"], points[f"crank{k}"] = ORIGIN, {f"O{k}": ORIGIN, f"P{k}": (a, 0)}
        points[f"table{k}"] = {f"P{k}": ORIGIN}
        for name, pin in zip("BC", pins, strict=False):
            is_body = rng.random() < 0.4
            legs.append((f"{name}{k}", below, a, pin, is_body))
            points[below][f"{name}{k}"] = points[f"table{k}"][f"{name.lower()}{k}"] = pin
            if is_body:
                points[f"leg{name}{k}"] = {f"{name}{k}": ORIGIN, f"{name.lower()}{k}": (a, 0)}
    if tops == "arm":
        points["table0"]["S"] = (drawn_length(rng, 0.3, 1.0), Fraction(0))
        points["arm"] = {"S": ORIGIN}

    def poses(numbers: Numbers, u: Sequence[Jet], closing: Closing) -> dict[str, Pose]:
        at, zero = {"ground": standing(numbers, 0, 0, u[0])}, u[0] * numbers.number(0)
        moving = {}
        for k in range(len(u) if tops != "arm" else 1):
            below, a = f"table{k - 1}" if k else "ground", stages[k][0]
            moving[f"crank{k}"] = Pose(at[below], u[k])
            at[f"table{k}"] = at[below] + turned(u[k], numbers.number(a))
            moving[f"table{k}"] = Pose(at[f"table{k}"], zero)
            sines = []
            for name, under, _, pin, is_body in legs:
                if under != below:
                    continue
                far = abs(complex(*map(float, pin)))
                sines.append(np.abs(turned(u[k], *(numbers.number(part) for part in (pin[0], -pin[1]))).y.d0) / far)
                if is_body:
                    moving[f"leg{name}"] = Pose(at[below] + standing(numbers, *pin, u[0]), u[k])
            closing.sines.append(np.maximum.reduce(sines))
        if tops == "arm":
            moving["arm"] = Pose(world(numbers, moving["table0"], points["table0"]["S"]), u[1])
        return moving

    def joints(frame: Frame) -> tuple[Joint, ...]:
        ends = [(name, (f"{below}.{name}", f"table{name[1]}.{name[0].lower()}{name[1]}")) for name, below, *_ in legs]
        return tuple(
            Distance(f"leg{name}", pair, frame.length(a))
            for (name, pair), (_, _, a, _, is_body) in zip(ends, legs, strict=True)
            if not is_body
        )

    bodies = ("crank0", *{"": (), "table": ("crank1",), "arm": ("arm",)}[tops])
    return Sketch(points, poses, _turn_each(*bodies), joints, kinds=("angle",) * len(bodies), marks=ENDS)


def resting_slides(rng: Draw) -> Sketch:
    """A crank and a rod of its length, a distance, to a block on a line through the pivot, on which the block rests.

    Some have an arm next to them with a driver of its own.
    """
    a, with_arm = drawn_length(rng, 0.3, 2.0), rng.random() < 0.4
    points: dict[str, dict[str, tuple[Exact, Exact]]] = {
        "ground": {"O": ORIGIN, "way": ORIGIN},
        "crank": {"O": ORIGIN, "P": (a, 0)},
        "block": {"S": ORIGIN},
    }
    if with_arm:
        points["ground"]["W"] = _place(rng, 2.0)
        points["arm"] = {"W": ORIGIN}

    def poses(numbers: Numbers, u: Sequence[Jet], closing: Closing) -> dict[str, Pose]:
        closing.sines.append(u[0].sin_cos()[1].d0)
        zero = u[0] * numbers.number(0)
        moving = {"crank": Pose(Vector(0, 0), u[0]), "block": Pose(Vector(zero, zero), zero)}
        if with_arm:
            moving["arm"] = Pose(standing(numbers, *points["ground"]["W"], u[1]), u[1])
        return moving

    def joints(frame: Frame) -> tuple[Joint, ...]:
        return (
            Translational("slide", ("ground.way", "block.S"), frame.angle, frame.angle),
            Distance("rod", ("crank.P", "block.S"), frame.length(a)),
        )

    bodies = ("crank", "arm") if with_arm else ("crank",)
    marks, kinds = (-0.5 * math.pi, 0.5 * math.pi), ("angle",) * len(bodies)
    return Sketch(points, poses, _turn_each(*bodies), joints, kinds=kinds, marks=marks)


def coupled_wheels(rng: Draw) -> Sketch:
    """Equal wheels in a row, each coupled to the next by two rods whose pins are not in line with the wheel's centre.

    One rod of a pair is redundant, and carries the wheels where the other is in its dead centre: regular everywhere.
    Rods are bodies or distances; some have an arm next to them with a driver of its own.
    """
    return _wheels(rng)


def mismatched_wheels(rng: Draw) -> Sketch:
    """Coupled wheels of which one rod is longer or shorter by as little as counts as consistent."""
    return _wheels(rng, _side(rng) * Fraction(rng.randint(1, 3), 10 ** rng.randint(12, 14)))


def _wheels(rng: Draw, part: Fraction = Fraction(0)) -> Sketch:
    pitch, pairs, with_arm = drawn_length(rng, 0.5, 2.0), rng.randrange(1, 4), rng.random() < 0.3
    points: dict[str, dict[str, tuple[Exact, Exact]]] = {"ground": {}}
    bars: list[tuple[int, str, tuple[Fraction, Fraction], bool]] = []  # (wheel, name, pin, whether it is a body)
    for k in range(pairs + 1):
        points["ground"][f"O{k}"] = (k * pitch, 0)
        points[f"wheel{k}"] = {f"O{k}": ORIGIN}
    for k in range(pairs):
        first, second = (
            (radius * c, radius * s)
            for radius, (c, s) in zip(
                (drawn_length(rng, 0.2, 1.0), drawn_length(rng, 0.2, 1.0)), rng.sample(_HEADINGS, 2), strict=True
            )
        )
        across = abs(first[0] * second[1] - first[1] * second[0])
        if across**2 < Fraction(1, 16) * (first[0] ** 2 + first[1] ** 2) * (second[0] ** 2 + second[1] ** 2):
            raise RedrawError  # less than 15 degrees between them
        for name, pin in (("A", first), ("B", second)):
            bars.append((k, f"{name}{k}", pin, rng.random() < 0.5))
            for wheel, letter in ((k, "P"), (k + 1, "Q")):
                points[f"wheel{wheel}"][f"{letter}{name}{k}"] = pin
            if bars[-1][-1]:
                points[f"rod{name}{k}"] = {f"P{name}{k}": ORIGIN, f"Q{name}{k}": (pitch, 0)}
    gap, loose = part * pitch, [bar for bar in bars if not bar[-1]][-1:]
    if gap and not loose:
        raise RedrawError
    if with_arm:
        points["ground"]["S"] = (0, drawn_length(rng, 1.0, 2.0))
        points["arm"] = {"S": ORIGIN}

    def poses(numbers: Numbers, u: Sequence[Jet], closing: Closing) -> dict[str, Pose]:
        moving = {f"wheel{k}": Pose(standing(numbers, k * pitch, 0, u[0]), u[0]) for k in range(pairs + 1)}
        heights = []
        for wheel, name, pin, is_body in bars:
            at = turned(u[0], *map(numbers.number, pin))
            heights.append(np.abs(at.y.d0))  # 0 at the rod's dead centre
            if is_body:
                moving[f"rod{name}"] = Pose(at + standing(numbers, wheel * pitch, 0, u[0]), u[0] * numbers.number(0))
        closing.sines += [np.maximum(*pair) for pair in zip(heights[::2], heights[1::2], strict=True)]
        if with_arm:
            moving["arm"] = Pose(standing(numbers, *points["ground"]["S"], u[1]), u[1])
        return moving

    def joints(frame: Frame) -> tuple[Joint, ...]:
        return tuple(
            Distance(bar[1], (f"wheel{bar[0]}.P{bar[1]}", f"wheel{bar[0] + 1}.Q{bar[1]}"), frame.length(length))
            for bar in bars
            for length in ([pitch + gap] if bar in loose else [pitch])
            if not bar[-1]
        )

    bodies = ("wheel0", "arm") if with_arm else ("wheel0",)
    return Sketch(points, poses, _turn_each(*bodies), joints, kinds=("angle",) * len(bodies), gap=gap)


# ------------------------------------------------------------------------------------- cylinders, several drivers


def five_bars(rng: Draw) -> Sketch:
    """Two driven cranks, and two bars between their ends."""
    g, a, b, c, e = (drawn_length(rng, 0.4, 2.0) for _ in range(5))
    side = _side(rng)

    def poses(numbers: Numbers, u: Sequence[Jet], closing: Closing) -> dict[str, Pose]:
        at_c = standing(numbers, g, 0, u[0])
        p, q = turned(u[0], numbers.number(a)), at_c + turned(u[1], numbers.number(e))
        way = between(closing, p, (numbers.number(b), numbers.number(c)), q, side)
        return {
            "left": Pose(Vector(0, 0), u[0]),
            "right": Pose(at_c, u[1]),
            "forearm": Pose(p, way.first.heading()),
            "strut": Pose(q, way.second.heading()),
        }

    def drivers(_: Frame, start: Sequence[float]) -> tuple[Driver, ...]:
        return (
            AngleDriver("shoulder", "left", ConstantSpeed(start[0], 1.0)),
            AngleDriver("elbow", "right", ConstantSpeed(start[1], 1.0)),
        )

    points = {
        "ground": {"O": ORIGIN, "C": (g, 0)},
        "left": {"O": ORIGIN, "P": (a, 0)},
        "right": {"C": ORIGIN, "Q": (e, 0)},
        "forearm": {"P": ORIGIN, "T": (b, 0)},
        "strut": {"Q": ORIGIN, "T": (c, 0)},
    }
    return Sketch(points, poses, drivers, kinds=("angle", "angle"))


def robots(rng: Draw) -> Sketch:
    """Two driven cranks with two bars between their ends; at times a third crank, with two bars from its end to theirs.

    Samples lead to singular poses and back: see patterns.
    """
    base = five_bars(rng)
    if rng.random() < 0.5:
        return base
    points = {body: dict(given) for body, given in base.points.items()}
    reach = points["forearm"]["T"]
    d, f, h, i = _place(rng, 2.0), *(drawn_length(rng, 0.4, 2.0) for _ in range(3))
    side = _side(rng)

    def poses(numbers: Numbers, u: Sequence[Jet], closing: Closing) -> dict[str, Pose]:
        moving = base.poses(numbers, u, closing)
        at_d, at_e = standing(numbers, *d, u[0]), world(numbers, moving["forearm"], reach)
        at_f = at_d + turned(u[2], numbers.number(f))
        way = between(closing, at_e, (numbers.number(h), numbers.number(i)), at_f, side)
        return {
            **moving,
            "third": Pose(at_d, u[2]),
            "link": Pose(at_e, way.first.heading()),
            "brace": Pose(at_f, way.second.heading()),
        }

    def drivers(frame: Frame, start: Sequence[float]) -> tuple[Driver, ...]:
        return (*base.drivers(frame, start), AngleDriver("wrist", "third", ConstantSpeed(start[2], 1.0)))

    points["ground"]["D"], points["forearm"]["E"] = d, reach
    points["third"] = {"D": ORIGIN, "F": (f, 0)}
    points["link"] = {"E": ORIGIN, "X": (h, 0)}
    points["brace"] = {"F": ORIGIN, "X": (i, 0)}
    return Sketch(points, poses, drivers, kinds=("angle",) * 3)


def two_machines(rng: Draw) -> Sketch:
    """A linkage and a four-bar next to it, each with its own driver; sometimes an arm on the linkage with a third.

    Each may have change points, which depend on its own driver alone.
    """
    first = rng.choice((change_points, change_points, four_bars, near_change_points, crank_and_rod, watt_six_bars))(rng)
    other = fourbar(changing(rng) if rng.random() < 0.6 else grashof(rng, rng.choice(KINDS)), _driven(rng), _side(rng))
    if first.kinds != ("angle",):
        raise RedrawError
    aside, has_arm = (drawn_length(rng, 3.0, 6.0), drawn_length(rng, -2.0, 2.0)), rng.random() < 0.5
    carrier, wrist = "rod" if "rod" in first.points else "coupler", (drawn_length(rng, 0.2, 1.0), Fraction(0))
    points = {body: dict(given) for body, given in first.points.items()}
    for body, given in other.points.items():
        if body == "ground":
            points[body] |= {f"{name}2": (x + aside[0], y + aside[1]) for name, (x, y) in given.items()}
        else:
            points[f"{body}2"] = {f"{name}2": point for name, point in given.items()}
    if has_arm:
        points[carrier]["W"] = wrist
        points["arm"] = {"W": ORIGIN}

    def poses(numbers: Numbers, u: Sequence[Jet], closing: Closing) -> dict[str, Pose]:
        moving = first.poses(numbers, u[:1], closing)
        moved = standing(numbers, *aside, u[1])
        for body, pose in other.poses(numbers, u[1:2], closing).items():
            moving[f"{body}2"] = Pose(pose.at + moved, pose.phi)
        if has_arm:
            moving["arm"] = Pose(world(numbers, moving[carrier], wrist), u[2])
        return moving

    def drivers(frame: Frame, start: Sequence[float]) -> tuple[Driver, ...]:
        (one,), (two,) = first.drivers(frame, start[:1]), other.drivers(frame, start[1:2])
        found = (one, AngleDriver("drive2", f"{two.of}2", ConstantSpeed(start[1], 1.0)))
        return (*found, AngleDriver("wrist", "arm", ConstantSpeed(start[2], 1.0))) if has_arm else found

    kinds = ("angle",) * (3 if has_arm else 2)
    return Sketch(points, poses, drivers, first.joints, kinds, tuple({*first.marks, *other.marks}))


def machines_with_a_robot(rng: Draw) -> Sketch:
    """A four-bar, often with change points, and a robot whose bars depend on several drivers.

    The robot is a five-bar next to the four-bar, or a driven arm and two bars from its end to that of the rocker.
    """
    bars = changing(rng) if rng.random() < 0.7 else grashof(rng, rng.choice(KINDS))
    first, robot = fourbar(bars, _driven(rng), _side(rng)), five_bars(rng)
    at, is_carried = (drawn_length(rng, 0.5, 5.0), drawn_length(rng, -3.0, 3.0)), rng.random() < 0.6
    arm, link, strut = drawn_length(rng, 0.3, 1.5), drawn_length(rng, 1.0, 4.0), drawn_length(rng, 1.0, 4.0)
    side = _side(rng)
    points = {body: dict(given) for body, given in first.points.items()}
    if is_carried:
        points["ground"]["T"] = at
        points |= {"arm": {"T": ORIGIN, "U": (arm, 0)}, "strut": {"U": ORIGIN, "S": (strut, 0)}}
        points["rocker"]["D"] = points["rocker"]["Q"]
        points["link"] = {"D": ORIGIN, "S": (link, 0)}
    else:
        for body, given in robot.points.items():
            if body == "ground":
                points[body] |= {f"{name}2": (x + at[0], y + at[1]) for name, (x, y) in given.items()}
            else:
                points[f"{body}2"] = {f"{name}2": point for name, point in given.items()}

    def poses(numbers: Numbers, u: Sequence[Jet], closing: Closing) -> dict[str, Pose]:
        moving = first.poses(numbers, u[:1], closing)
        pivot = standing(numbers, *at, u[1])
        if not is_carried:
            carried = robot.poses(numbers, u[1:], closing)
            return moving | {f"{body}2": Pose(pose.at + pivot, pose.phi) for body, pose in carried.items()}
        d = world(numbers, moving["rocker"], points["rocker"]["D"])
        end = pivot + turned(u[1], numbers.number(arm))
        way = between(closing, d, (numbers.number(link), numbers.number(strut)), end, side)
        moving["arm"] = Pose(pivot, u[1])
        return moving | {"link": Pose(d, way.first.heading()), "strut": Pose(end, way.second.heading())}

    def drivers(frame: Frame, start: Sequence[float]) -> tuple[Driver, ...]:
        found = first.drivers(frame, start[:1])
        if is_carried:
            return (*found, AngleDriver("arm", "arm", ConstantSpeed(start[1], 1.0)))
        others = robot.drivers(frame, start[1:])
        return (*found, *(replace(driver, of=f"{driver.of}2") for driver in others))

    return Sketch(points, poses, drivers, kinds=("angle",) * (2 if is_carried else 3), marks=first.marks)


def cylinders(rng: Draw) -> Sketch:
    """A boom raised by a cylinder; at times with a stick on it, moved by a second one."""
    has_stick = rng.random() < 0.5
    base = (drawn_length(rng, 0.3, 1.5), drawn_length(rng, -1.0, 0.5))
    boom, tip = (drawn_length(rng, 0.5, 2.0), drawn_length(rng, -0.3, 0.5)), (drawn_length(rng, 1.5, 3.0), Fraction(0))
    rear, nose = (drawn_length(rng, 0.3, 1.2), drawn_length(rng, 0.1, 0.8)), drawn_length(rng, 0.3, 0.9)
    side, second = _side(rng), _side(rng)
    arm_squared = boom[0] ** 2 + boom[1] ** 2
    if arm_squared == base[0] ** 2 + base[1] ** 2:
        raise RedrawError

    def poses(numbers: Numbers, u: Sequence[Jet], closing: Closing) -> dict[str, Pose]:
        arm = numbers.sqrt(numbers.array([numbers.number(arm_squared)]))[0]
        lean = numbers.angle(boom)
        o, m = standing(numbers, 0, 0, u[0]), standing(numbers, *base, u[0])
        way = between(closing, o, (arm, u[0]), m, side)
        moving = {"boom": Pose(Vector(0, 0), way.first.heading() - lean)}
        if has_stick:
            raised = Pose(o, moving["boom"].phi)
            at_s, at_m = world(numbers, raised, tip), world(numbers, raised, rear)
            stick = between(closing, at_s, (numbers.number(nose), u[1]), at_m, second)
            moving["stick"] = Pose(at_s, stick.first.heading())
        return moving

    def drivers(_: Frame, start: Sequence[float]) -> tuple[Driver, ...]:
        first = DistanceDriver("lift", ("ground.M", "boom.N"), ConstantSpeed(start[0], 1.0))
        if not has_stick:
            return (first,)
        return (first, DistanceDriver("crowd", ("boom.R", "stick.E"), ConstantSpeed(start[1], 1.0)))

    points: dict[str, dict[str, tuple[Exact, Exact]]] = {
        "ground": {"O": ORIGIN, "M": base},
        "boom": {"O": ORIGIN, "N": boom, "S": tip, "R": rear},
    }
    if has_stick:
        points["stick"] = {"S": ORIGIN, "E": (nose, 0)}
    kinds = ("length", "length") if has_stick else ("length",)
    return Sketch(points, poses, drivers, kinds=kinds, reach=(0.1, 4.0))


def led_by_laws(rng: Draw) -> Sketch:
    """A four-bar whose crank follows rises and dwells over the angle of a cam, or of a rocker that swings."""
    other = fourbar(grashof(rng, rng.choice(KINDS)), "crank", _side(rng))
    is_swinging = rng.random() < 0.5
    law = DrawnLaw(rng, 1e-4 if is_swinging else 2e-7)  # the angle of a rocker is rounded
    first = fourbar(grashof(rng, "crank-rocker"), "crank", _side(rng)) if is_swinging else None
    leader, reach = "rocker" if is_swinging else "cam", (0.0, TURN)
    places = np.linspace(*reach, 2000)

    def led(numbers: Numbers, u: Jet, closing: Closing) -> dict[str, Pose]:
        return {leader: Pose(Vector(0, 0), u)} if first is None else first.poses(numbers, [u], closing)

    def argument(u: Array) -> Array:
        return np.asarray(led(LONG, Value(LONG, LONG.array(u)), Closing())[leader].phi.d0)

    angles = argument(places)
    if np.abs(np.diff(angles)).max() > 1.0:
        raise RedrawError  # an angle that jumps by a turn
    law.placed(rng, float(angles.min()), float(angles.max()))
    marks = [*_turning(argument, places), *_crossing(argument, places, law.marks)]
    points = {} if first is None else {body: dict(given) for body, given in first.points.items()}
    points = points or {"ground": {"K": ORIGIN}, "cam": {"K": ORIGIN}}
    aside = drawn_length(rng, 3.0, 6.0), drawn_length(rng, -2.0, 2.0)
    for body, given in other.points.items():
        if body == "ground":
            points[body] |= {f"{name}2": (x + aside[0], y + aside[1]) for name, (x, y) in given.items()}
        else:
            points[f"{body}2"] = {f"{name}2": point for name, point in given.items()}

    def poses(numbers: Numbers, u: Sequence[Jet], closing: Closing, later: float = 0.0) -> dict[str, Pose]:
        moving = led(numbers, u[0], closing)
        followed = law.value(numbers, moving[leader].phi, later)
        moved = standing(numbers, *aside, u[0])
        for body, pose in other.poses(numbers, [followed], closing).items():
            moving[f"{body}2"] = Pose(pose.at + moved, pose.phi)
        return moving

    def joints(_: Frame) -> tuple[Joint, ...]:
        return (Coupling("law", AngleBetween(leader), AngleBetween("crank2"), law.law),)

    driven = "cam" if first is None else "crank"
    return Sketch(
        points,
        poses,
        _turns(driven),
        joints,
        marks=tuple(marks),
        period=0,
        reach=reach,
        is_level=True,
        later=lambda by: partial(poses, later=by),
    )


def _turning(function: Callable[[Array], Array], places: Array) -> list[float]:
    """Where a function over rising places turns back."""
    found = []
    values = function(places)
    for k in range(1, len(places) - 1):
        if (values[k] - values[k - 1]) * (values[k + 1] - values[k]) < 0.0:
            low, high, sign = places[k - 1], places[k + 1], np.sign(values[k] - values[k - 1])
            for _ in range(60):
                near = np.linspace(low, high, 9)
                best = int(np.argmax(sign * function(near)))
                low, high = near[max(best - 1, 0)], near[min(best + 1, 8)]
            found.append(float(0.5 * (low + high)))
    return found


def _crossing(function: Callable[[Array], Array], places: Array, levels: Sequence[float]) -> list[float]:
    """Where a function over rising places passes levels."""
    found = []
    values = function(places)
    for level in levels:
        for k in np.flatnonzero((values[:-1] - level) * (values[1:] - level) <= 0.0):
            low, high, rises = places[k], places[k + 1], values[k + 1] > values[k]
            for _ in range(55):
                middle = 0.5 * (low + high)
                is_past = (function(np.array([middle]))[0] > level) == rises
                low, high = (low, middle) if is_past else (middle, high)
            found.append(float(low))
    return found


STARTS_ANYWHERE = "starts anywhere"


def starts_anywhere(rng: Draw) -> Sketch:
    """A mechanism of any other family; its law and its start poses are drawn in kinfmu's way: see starts.py."""
    (name,) = rng.choices(_STARTED, [FAMILIES[name][1] for name in _STARTED])
    return FAMILIES[name][0](rng)


_STARTED = (  # new families go last: a seed is a mechanism
    "four-bars",
    "change points",
    "near change points",
    "slider-cranks",
    "crank = rod",
    "pins in slots",
    "watt six-bars",
    "stephenson six-bars",
    "six-bars driven at the end",
    "chains",
    "geared five-bars",
    "redundant parallelograms",
    "five-bars",
    "cylinders",
)
FAMILIES: dict[str, tuple[Callable[[Draw], Sketch], int]] = {  # and how often of a hundred
    "four-bars": (four_bars, 16),
    "change points": (change_points, 10),
    "near change points": (near_change_points, 9),
    "slider-cranks": (slider_cranks, 8),
    "crank = rod": (crank_and_rod, 9),
    "pins in slots": (pins_in_slots, 7),
    "watt six-bars": (watt_six_bars, 7),
    "stephenson six-bars": (stephenson_six_bars, 7),
    "six-bars driven at the end": (six_bars_driven_at_the_end, 2),
    "chains": (chains, 6),
    "geared five-bars": (geared_five_bars, 4),
    "redundant parallelograms": (redundant_parallelograms, 5),
    "coupled wheels": (coupled_wheels, 4),
    "five-bars": (five_bars, 4),
    "robots": (robots, 4),
    "two machines": (two_machines, 4),
    "cylinders": (cylinders, 4),
    STARTS_ANYWHERE: (starts_anywhere, 5),
    "machines with a robot": (machines_with_a_robot, 4),
    "led by laws": (led_by_laws, 4),
    "translating tables": (translating_tables, 4),
    "resting slides": (resting_slides, 1),
    "mismatched wheels": (mismatched_wheels, 2),
}
