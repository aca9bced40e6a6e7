"""Symbols of loads: springs, dampers, gas springs, arrows of forces and torques, spirals, as lines for every picture.

A point of a line is (part, length, along, across): it lies at `part` of the distance of the symbol's two ends, plus a
length of the mechanism, plus details along and across, whose size follows from the picture (see `details`). A symbol at
one point has parts and lengths of 0, and its direction is its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray

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
_SPIRAL = (3.5, 12.0, 2.25)  # radii of a torsion spring, and its turns
_DASHPOT = (14.0, 21.0)  # radii of a torsion damper's cup
_CUP_ANGLES, _ROD_ANGLES, _STEM = (100.0, 215.0), (150.0, 20.0), 0.5  # [deg], and of the stem behind the cup [rad]
_STEP = math.radians(15.0)  # between the corners of an arc
_APART = 3.0  # between two symbols about one pin


class Strip(NamedTuple):
    """A line of a symbol: points (k, 4), as above.

    is_area: True for a closed line that covers what is below it; is_solid: True for one filled with its own colour.
    """

    points: FloatArray
    is_area: bool = False
    is_solid: bool = False


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
        _at_end(_LAST, _box(-rod, 0.0, off, _ROD), is_area=True),
        _at_end(_FIRST, [*end, (0.0, off), (start, off)]),
        _at_end(_FIRST, _box(start, tube, off, _TUBE), is_area=True),
        _at_end(_LAST, [(-rod, off - _TUBE), (-rod, off + _TUBE)]),
        *([_at_end(_LAST, [(0.0, off), *end])] if off else []),
    )


def stretched(strips: Iterable[Strip], distance: float) -> tuple[Strip, ...]:
    """Return a symbol whose lengths are those at a distance of its points and change with it."""
    found = []
    for strip in strips:
        part, length, along, across = strip.points.T
        found.append(strip._replace(points=np.column_stack([part + length / distance, 0.0 * length, along, across])))
    return tuple(found)


def arrow(*, pushes: bool) -> tuple[Strip, ...]:
    """Return the arrow of a force along its direction; pushes: True if its tip is at the point, else its tail is."""
    return _arrow(_FIRST, -_CLEAR - _ARROW, -_CLEAR) if pushes else _arrow(_FIRST, 0.0, _ARROW)


def arrows_apart(sense: float) -> tuple[Strip, ...]:
    """Return a line between two points with arrows that push them apart or, with a sense of -1.0, together."""
    line = _line([(_FIRST, 0.0, 0.0, 0.0), (_LAST, 0.0, 0.0, 0.0)])
    return (line, *_arrow(_FIRST, 0.0, -sense * _ARROW), *_arrow(_LAST, 0.0, sense * _ARROW))


def turn(sense: float, out: float = 0.0) -> tuple[Strip, ...]:
    """Return the circular arrow of a torque; sense: 1.0 counter-clockwise, -1.0 clockwise; out: added to its radius."""
    radius, first, last = _TURN[0] + out, *_TURN[1:]
    tip = last + _HEAD / radius
    arc = _polar(radius, _angles(first, last))
    base, point = arc[-1], _polar(radius, np.array([tip]))[0]
    way = (point - base) / np.hypot(*(point - base))  # the head lies along the chord
    across = _HALF_HEAD * np.array([-way[1], way[0]])
    mirror = np.array([1.0, sense])
    return _flat(arc * mirror), _flat(np.array([point, base + across, base - across]) * mirror, is_head=True)


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


def _arrow(part: float, tail: float, tip: float) -> tuple[Strip, ...]:
    """Return a straight arrow along the direction, from `tail` to `tip` in details."""
    base = tip - math.copysign(_HEAD, tip - tail)
    head = [(tip, 0.0), (base, _HALF_HEAD), (base, -_HALF_HEAD)]
    return (
        _line((part, 0.0, along, 0.0) for along in (tail, base)),
        _line(((part, 0.0, along, across) for along, across in head), is_area=True, is_solid=True),
    )


def _box(first: float, last: float, off: float, half: float) -> list[tuple[float, float]]:
    return [(first, off - half), (last, off - half), (last, off + half), (first, off + half)]


def _at_end(part: float, points: Iterable[tuple[float, float]], *, is_area: bool = False) -> Strip:
    """Return a strip that keeps its length, fixed at one of two points; points: (length, across)."""
    return _line(((part, length, 0.0, across) for length, across in points), is_area=is_area)


def _polar(radius: float | FloatArray, angles: FloatArray) -> FloatArray:
    """Return points (k, 2) on a circle or spiral."""
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles)])


def _flat(points: FloatArray, *, is_head: bool = False) -> Strip:
    """Return a strip at one point; points: (k, 2) in details."""
    return Strip(np.column_stack([0.0 * points, points]), is_head, is_head)


def _angles(first: float, last: float) -> FloatArray:
    return np.linspace(first, last, max(round(abs(last - first) / _STEP), 2) + 1)


def _line(
    points: Iterable[tuple[float, float, float, float]], *, is_area: bool = False, is_solid: bool = False
) -> Strip:
    return Strip(np.array(list(points), dtype=float), is_area, is_solid)
