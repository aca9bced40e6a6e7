"""Grashof's class: which links of a four-bar or slider-crank can make a full turn, from lengths alone."""

from __future__ import annotations

from dataclasses import dataclass

SAME_LENGTH = 1e-12  # of the sum of lengths; sums that differ by less are equal, such as 0.7 + 0.1 and 0.5 + 0.3


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
