"""Breaks of laws over a quantity of the pose, such as a cam's dwell: where a step of an integrator crosses them.

A step across a break of the law, which moves by g(q), has the order of neither side. So it ends shortly before the
break, and a short Taylor step leads just past it:

    u + ud h + 1/2 udd h^2,   ud + udd h        with udd before the break; |g| grows by WINDOW at most
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import ceil, floor, inf
from typing import NamedTuple

WINDOW = 1e-6  # [rad, sizes] before a break, from which the short step starts
PAST = 1e-12  # [rad, sizes] beyond it, where that step ends
ROUNDED_G = 1e-15  # of g: it is known so well
LONGEST = 1e-4  # [rad, sizes] that a driver moves in the short step at most: g does not rest there
CUTS = 12  # times that a step is shortened, until it ends before a break
_TRIALS = 60
_HEAD = 4  # numbers of a law before its breaks: g, its turn (0: none), the unit of WINDOW, the period (0: none)

Moved = Callable[[float], "float | None"]  # change of g until a time, or None where the pose is not reached


class Crossing(NamedTuple):
    """The first break in a step: where its law's numbers begin, the change of g to it, and that in the whole step."""

    place: int
    away: float
    moved: float
    window: float
    past: float


def moved_by(before: Sequence[float], after: Sequence[float], place: int) -> float:
    """Return the change of a law's argument; one that jumps back after a turn changes by less than half of it."""
    change, turn = after[place] - before[place], before[place + 1]
    return change - turn * floor(change / turn + 0.5) if turn > 0.0 else change


def wraps(counts: Sequence[int], numbers: Sequence[float]) -> bool:
    """Return whether the argument of a law jumps back after a turn."""
    place = 0
    for count in counts:
        if numbers[place + 1] > 0.0:
            return True
        place += _HEAD + count
    return False


def first_crossing(counts: Sequence[int], before: Sequence[float], after: Sequence[float]) -> Crossing | None:
    """Return the first break between two poses; None: there is none.

    Args:
        counts: Number of breaks of each law.
        before: Numbers of the laws, one after another: g, turn, unit, period, breaks.
        after: The same at the end.

    """
    found, least, place = None, inf, 0
    for count in counts:
        moved = moved_by(before, after, place)
        unit, period = before[place + 2], before[place + 3]
        for level in before[place + _HEAD : place + _HEAD + count] if moved else ():
            away = level - before[place]
            if period > 0.0:
                away -= period * (floor(away / period) if moved > 0.0 else ceil(away / period))
            share = away / moved
            if 0.0 < share <= 1.0 and share < least:
                least = share
                past = PAST * unit + ROUNDED_G * abs(before[place])
                found = Crossing(place, away, moved, WINDOW * unit, past)
        place += _HEAD + count
    return found


def landing(crossing: Crossing, moved: Moved, first: float, last: float) -> float | None:
    """Return the time within a step at which it has to end, in the window before the break; None: not found.

    The secant's end that stays is given half its weight (Illinois), so that both ends close in.
    """
    side = 1.0 if crossing.moved > 0.0 else -1.0
    target = crossing.away - 0.5 * side * crossing.window
    low, high, of_low, of_high, stayed = first, last, -target, crossing.moved - target, 0
    for _ in range(_TRIALS):
        t = high - of_high * (high - low) / (of_high - of_low)
        change = moved(t)
        if change is None:
            return None
        error = change - target
        if abs(error) <= 0.3 * crossing.window:
            return t
        if error * of_high > 0.0:
            high, of_high = t, error
            of_low *= 0.5 if stayed < 0 else 1.0
            stayed = -1
        else:
            low, of_low = t, error
            of_high *= 0.5 if stayed > 0 else 1.0
            stayed = 1
    return None


def hop(crossing: Crossing, moved: Moved, speed: float, last: float) -> float | None:
    """Return the length of the short step that ends just past the break; None: it would be too long.

    Args:
        crossing: Within its window.
        moved: Change of g in a short step of some length.
        speed: Of the fastest driver [rad/s, sizes/s].
        last: The largest length [s].

    """
    side = 1.0 if crossing.moved > 0.0 else -1.0
    longest = min(LONGEST / speed, last) if speed > 0.0 else 0.0
    h = 0.1 * longest
    for _ in range(_TRIALS):
        change = moved(h) if 0.0 < h <= longest else None
        if change is None or not side * change > 0.0:
            return None
        past = side * (change - crossing.away)
        if 0.0 < past <= 4.0 * crossing.past:
            return h
        h *= (crossing.away + 2.0 * side * crossing.past) / change
    return None
