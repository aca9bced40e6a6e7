"""Patterns of steps: the orders in which driver values are asked for, and starts anywhere on a branch."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from random import Random
from typing import Any

import numpy as np

from tests.stress.branch import BranchPath, Floats, Interval
from tests.stress.drawn import TURN, Drawn
from tests.stress.families import Draw

Values = list[float]
OUTSIDE_SAMPLES = 5  # at most, to a mechanism: each is walked to a limit
FAR = 20  # turns of a big jump


def _span(branch: Interval) -> tuple[float, float]:
    start = branch.drawn.start[0]
    return (start - 2.0 * TURN, start + 2.0 * TURN) if branch.is_free else (branch.low, branch.high)


def _unit(branch: Interval) -> float:
    return 1.0 if branch.drawn.sketch.kinds == ("angle",) else float(branch.drawn.frame.scale)


def forward(rng: Random, branch: Interval) -> Values:
    """Even steps of 0.01 to 170 degrees, or as parts of a radian's length, from anywhere."""
    low, high = _span(branch)
    step = math.radians(10.0 ** rng.uniform(-2.0, math.log10(170.0))) * _unit(branch)
    first = rng.uniform(low, high)
    return [first + k * step for k in range(rng.randint(10, 40))]


def back(rng: Random, branch: Interval) -> Values:
    return forward(rng, branch)[::-1]


def there_and_back(rng: Random, branch: Interval) -> Values:
    ahead = forward(rng, branch)
    return ahead + ahead[::-2]


def jumps(rng: Random, branch: Interval) -> Values:
    """Anywhere; where an angle goes round, many turns away."""
    low, high = _span(branch)
    if branch.is_free:
        low, high = low - FAR * TURN, high + FAR * TURN
    return [rng.uniform(low, high) for _ in range(12)]


def unordered(rng: Random, branch: Interval) -> Values:
    found = forward(rng, branch)
    rng.shuffle(found)
    return found


def tiny(rng: Random, branch: Interval) -> Values:
    """Steps of 1e-15 to 1e-4 about a place, that may be a singular one."""
    low, high = _span(branch)
    here = rng.choice([*_places(rng, branch), rng.uniform(low, high), rng.uniform(low, high)])
    step = 10.0 ** rng.uniform(-15.0, -4.0) * _unit(branch)
    return [here + (k - 10) * step for k in range(20)]


def singular(rng: Random, branch: Interval) -> Values:
    """Exactly at singular points, and 1e-1 to 1e-15 on either side."""
    found = []
    for place in rng.sample(_places(rng, branch), k=min(2, len(_places(rng, branch)))):
        found.append(place)
        found += [place + rng.choice((1, -1)) * 10.0 ** -rng.uniform(1.0, 15.0) * _unit(branch) for _ in range(8)]
        found.append(place)
    if rng.random() < 0.5:
        rng.shuffle(found)
    return found


def leaving(rng: Random, branch: Interval) -> Values:
    """Out of the range and back into it, again and again."""
    low, high = _span(branch)
    beyond = [10.0 ** rng.uniform(-9.0, 0.5) * _unit(branch) for _ in range(2)]
    outside = [low - beyond[0], high + beyond[1]]
    found = []
    for _ in range(4):
        found += [rng.uniform(low, high), rng.choice(outside)]
    return [*found, rng.uniform(low, high), rng.uniform(low, high)]


def wrapped(rng: Random, branch: Interval) -> Values:
    """An angle that jumps from a turn to 0, which is a way back."""
    if branch.drawn.sketch.kinds != ("angle",):
        return jumps(rng, branch)
    low, _ = _span(branch)
    return [low + (value - low) % TURN for value in forward(rng, branch)]


def many_turns(rng: Random, branch: Interval) -> Values:
    """Hundreds of turns away, and back: seldom, as it takes its time."""
    if not branch.is_free or rng.random() > 0.1:
        return jumps(rng, branch)
    start = branch.drawn.start[0]
    return [start, start + rng.uniform(100.0, 500.0) * TURN, start, start - 30.0 * TURN, start + 1.0]


def _places(rng: Random, branch: Interval) -> Values:
    """Singular points and limits; where an angle goes round, some turns away too."""
    ends = [(branch.low, branch.low_is_limit), (branch.high, branch.high_is_limit)]
    places = branch.marks + [end for end, is_limit in ends if is_limit]
    if branch.is_free:
        places = [place + rng.randint(-1, 1) * TURN for place in places]
    return places or [rng.uniform(*_span(branch))]


PATTERNS: dict[str, Callable[[Random, Interval], Values]] = {
    "forward": forward,
    "back": back,
    "there and back": there_and_back,
    "jumps": jumps,
    "unordered": unordered,
    "tiny": tiny,
    "singular": singular,
    "leaving": leaving,
    "wrapped": wrapped,
    "many turns": many_turns,
}


def drawn_steps(rng: Random, branch: Interval | BranchPath) -> tuple[list[str], Floats]:
    """Names of three patterns, and their driver values (n, d) one after the other."""
    if isinstance(branch, BranchPath):
        names, steps = ["ways", "to limits and back"], [_ways(rng, branch), _to_limits(rng, branch)]
        if branch.marks:
            names, steps = [*names, "over change points"], [*steps, _over_marks(rng, branch)]
        return names, np.concatenate(steps)
    names = rng.sample(sorted(PATTERNS), 3)
    steps: list[float] = []
    outside = 0
    for name in names:
        for value in PATTERNS[name](rng, branch):
            is_inside = branch.is_free or branch.low <= value <= branch.high
            if not is_inside and not (branch.low_is_limit if value < branch.low else branch.high_is_limit):
                continue  # beyond the examined range
            outside += not is_inside
            if is_inside or outside <= OUTSIDE_SAMPLES:
                steps.append(value)
    return names, np.array(steps or [branch.drawn.start[0]])[:, None]


def _ways(rng: Random, branch: BranchPath) -> Floats:
    """Of several drivers: steps, jumps and tiny steps, from place to place."""
    drawn = branch.drawn
    units = np.array([1.0 if kind == "angle" else float(drawn.frame.scale) for kind in drawn.sketch.kinds])
    generator = np.random.default_rng(rng.getrandbits(64))
    here = np.array(drawn.start)
    found: list[Any] = []
    for _ in range(12):
        reach = 10.0 ** generator.uniform(-8.0, 0.4)
        found.append(here + reach * units * generator.uniform(-1.0, 1.0, len(units)))
        if generator.uniform() < 0.5:
            found.append(here)
        if reach < 0.5:
            here = found[-1]
    return np.array(found)


def _to_limits(rng: Random, branch: BranchPath) -> Floats:
    """Of several drivers: straight to 1e-1 ... 1e-6 before a limit and back, by the same places or by others."""
    drawn = branch.drawn
    units = np.array([1.0 if kind == "angle" else float(drawn.frame.scale) for kind in drawn.sketch.kinds])
    generator = np.random.default_rng(rng.getrandbits(64))
    here = np.array(drawn.start)
    found = [here]
    for _ in range(3):
        direction = units * generator.uniform(-1.0, 1.0, len(units))
        limit = branch.limit(here, direction)
        if limit is None:
            continue
        gaps = np.sort(10.0 ** generator.uniform(-6.0, -1.0, 6))[::-1]
        back = gaps[-2::-1] if generator.uniform() < 0.5 else np.sort(10.0 ** generator.uniform(-6.0, -1.0, 4))
        found += [here + (limit - gap) * direction for gap in [*gaps, *back] if gap < limit]
        found.append(here)
    return np.array(found)


def _over_marks(rng: Random, branch: BranchPath) -> Floats:
    """Of several drivers: even steps of each there and back, in order or not; and close to change points of some."""
    generator = np.random.default_rng(rng.getrandbits(64))
    start = np.array(branch.drawn.start)
    steps = np.radians(10.0 ** generator.uniform(-1.0, 1.5, len(start))) * generator.choice((-1.0, 1.0), len(start))
    ahead = start + steps * np.arange(1, 25)[:, None]
    if generator.uniform() < 0.3:
        generator.shuffle(ahead)
    near = []
    for _ in range(8):
        place = start + generator.uniform(-0.5, 0.5, len(start))
        for k in range(len(start)):
            if generator.uniform() < 0.6:
                off = generator.choice((-1.0, 0.0, 1.0)) * 10.0 ** -generator.uniform(1.0, 12.0)
                place[k] = generator.choice(branch.marks) + off
        near.append(place)
    return np.concatenate([ahead, ahead[::-2], np.array(near), [start]])


# --------------------------------------------------------------------------------------------------------------- starts


NEAREST = 8.0  # decimals; so close to a limit or a change point a law may start
NOISE = 0.03  # [rad, lengths]; by so much rough start poses are off


@dataclass(frozen=True)
class Started:
    """How a mechanism is started.

    drawn: with its law and its start poses; law_start: (d,); is_there: True if the start poses are those of the start
    of the law, but for noise, False if they are those of a regular pose elsewhere on the branch.
    """

    drawn: Drawn
    law_start: Floats
    is_there: bool


def started(rng: Draw, branch: Interval | BranchPath) -> Started:
    """Return a mechanism started anywhere on its branch."""
    drawn = branch.drawn
    start = np.array(drawn.start)
    unit = float(drawn.frame.scale)
    if isinstance(branch, Interval):
        own = 1.0 if drawn.sketch.kinds == ("angle",) else unit
        law = np.array([_law_start(rng, branch, float(start[0]), own)])
    else:
        law = start
    is_there = rng.random() < 0.5
    at = law if is_there else start
    exact = drawn.positions(at[None]).columns
    turned = branch.expected(law[None], np.array([True])).angles if is_there else drawn.starts
    rough = {}
    for name, column in exact.items():
        is_angle = name.endswith(".phi")
        value = float(np.atleast_1d(turned[name])[0]) if is_angle else float(column.d0[0])
        rough[name] = value + rng.uniform(-NOISE, NOISE) * (1.0 if is_angle else unit)
    driven = drawn.sketch.drivers(drawn.frame, drawn.start)
    for driver in driven:
        body = getattr(driver, "of", None)
        if driver.quantity.kind == "angle" and body is not None:
            rough[f"{body}.phi"] += TURN * rng.choice((0, 0, -3, -1, 1, 2))
    return Started(replace(drawn, law_start=tuple(law.tolist()), rough=rough), law, is_there)


def _law_start(rng: Draw, branch: Interval, start: float, unit: float) -> float:
    """A driver value on the branch, less than half a turn from the start: anywhere, or near what is singular."""
    reach = 0.49 * TURN if branch.drawn.sketch.kinds == ("angle",) else np.inf
    low, high = max(branch.low, start - reach), min(branch.high, start + reach)
    special = [low] * branch.low_is_limit * (low == branch.low) + [high] * branch.high_is_limit * (high == branch.high)
    special += [mark for mark in branch.marks if low < mark < high]
    if special and rng.random() < 0.6:
        near = rng.choice(special) + rng.choice((1, -1)) * unit * 10.0 ** -rng.uniform(1.0, NEAREST)
        if low < near < high:
            return float(near)
    return rng.uniform(low, high)
