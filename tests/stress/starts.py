"""Starts anywhere: laws that begin at any driver value of a branch, and rough start poses, whole turns away too."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tests.stress.branch import TURN, BranchPath, Floats, Interval
from tests.stress.drawn import Drawn
from tests.stress.families import Draw

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
