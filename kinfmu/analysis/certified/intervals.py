"""Arrays of intervals: every operation of the graph with its result rounded outward.

An operation on intervals encloses all results of the operation on numbers from them, in exact arithmetic. Sums,
products, quotients and roots of floats are rounded to the nearest float (IEEE 754), so that the next float in either
direction is a bound. Sine and cosine are computed here, since libraries state no bound that holds on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.mechanism.laws.law import jumping_breaks
from kinfmu.plan.equations.graph import Node, reachable
from kinfmu.solver.python.curve import CurveData, Piece
from kinfmu.solver.python.curve import curve as curve_value

_LARGEST_ANGLE = 1e6  # [rad]; of larger ones sine and cosine are only known to be in [-1, 1]
_ARC_MARGIN = 1e-12  # [rad]
_SINE_ERROR = 2.0**-50  # of `_sine_and_cosine`
# pi / 2 in four parts; whole numbers up to 2^20 times one of the first three are exact
_QUARTER = (1.5707963267341256, 6.077100506303966e-11, 2.0222662487111665e-21, 8.4784276603689e-32)
_SINE = tuple((-1.0) ** k / math.factorial(2 * k + 1) for k in range(9))
_COSINE = tuple((-1.0) ** k / math.factorial(2 * k) for k in range(10))


class Intervals:
    """Closed intervals [low, high], one for each place of two arrays.

    Args:
        low: Lower bounds, or numbers.
        high: Upper bounds. Default: the lower ones.

    """

    __slots__ = ("high", "low")
    __array_priority__ = 100.0  # numpy's arrays leave operations to this class

    def __init__(self, low: Any, high: Any = None) -> None:
        self.low: FloatArray = np.asarray(low, dtype=float)
        self.high: FloatArray = self.low if high is None else np.asarray(high, dtype=float)

    def __repr__(self) -> str:
        return f"Intervals({self.low!r}, {self.high!r})"

    def __getitem__(self, place: Any) -> Intervals:
        return Intervals(self.low[place], self.high[place])

    @property
    def middle(self) -> FloatArray:
        """A number in the middle of each interval."""
        return np.asarray(0.5 * self.low + 0.5 * self.high)

    @property
    def radius(self) -> FloatArray:
        """At least the distance of both bounds from `middle`."""
        middle = self.middle
        return np.asarray(_up(np.maximum(middle - self.low, self.high - middle)))

    @property
    def magnitude(self) -> FloatArray:
        """The largest absolute value."""
        return np.maximum(abs(self.low), abs(self.high))

    @property
    def mignitude(self) -> FloatArray:
        """The smallest absolute value: 0 where an interval contains 0."""
        return np.maximum(np.maximum(self.low, -self.high), 0.0)

    def is_inside(self, other: Intervals) -> Any:
        """Return where each interval lies in the interior of the other one."""
        return (other.low < self.low) & (self.high < other.high)

    def hull(self, other: Intervals) -> Intervals:
        """Return the smallest intervals that contain both."""
        return Intervals(np.minimum(self.low, other.low), np.maximum(self.high, other.high))

    def intersection(self, other: Intervals) -> Intervals:
        """Return what two enclosures of the same numbers have in common."""
        return Intervals(np.maximum(self.low, other.low), np.minimum(self.high, other.high))

    def __neg__(self) -> Intervals:
        return Intervals(-self.high, -self.low)

    def __add__(self, other: Any) -> Intervals:
        other = interval(other)
        return _known(_down(self.low + other.low), _up(self.high + other.high))

    def __sub__(self, other: Any) -> Intervals:
        other = interval(other)
        return _known(_down(self.low - other.high), _up(self.high - other.low))

    def __rsub__(self, other: Any) -> Intervals:
        return interval(other) - self

    def __mul__(self, other: Any) -> Intervals:
        other = interval(other)
        a, b, c, d = self.low * other.low, self.low * other.high, self.high * other.low, self.high * other.high
        low = np.minimum(np.minimum(a, b), np.minimum(c, d))
        high = np.maximum(np.maximum(a, b), np.maximum(c, d))
        return _known(_down(low), _up(high))

    __radd__ = __add__
    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Intervals:
        other = interval(other)
        with np.errstate(divide="ignore", invalid="ignore"):
            a, b, c, d = self.low / other.low, self.low / other.high, self.high / other.low, self.high / other.high
            low = np.minimum(np.minimum(a, b), np.minimum(c, d))
            high = np.maximum(np.maximum(a, b), np.maximum(c, d))
        has_zero = (other.low <= 0.0) & (other.high >= 0.0)
        return _known(np.where(has_zero, -np.inf, _down(low)), np.where(has_zero, np.inf, _up(high)))

    def __rtruediv__(self, other: Any) -> Intervals:
        return interval(other) / self

    def square(self) -> Intervals:
        """Return the squares."""
        small, large = self.mignitude, self.magnitude
        return _known(np.maximum(_down(small * small), 0.0), _up(large * large))


def interval(x: Any) -> Intervals:
    """Return numbers as intervals; intervals as they are."""
    return x if isinstance(x, Intervals) else Intervals(x)


def joined_intervals(parts: Sequence[Intervals]) -> Intervals:
    """Return the intervals of several parts, along the last axis."""
    return Intervals(*(np.concatenate([getattr(part, end) for part in parts], -1) for end in ("low", "high")))


def around(middle: FloatArray, radius: FloatArray) -> Intervals:
    """Return the intervals within a radius of numbers."""
    return Intervals(_down(middle - radius), _up(middle + radius))


def _down(x: Any) -> Any:
    return np.nextafter(x, -np.inf)


def _up(x: Any) -> Any:
    return np.nextafter(x, np.inf)


def _known(low: Any, high: Any) -> Intervals:
    """Return intervals from bounds; where one is no number (infinite minus infinite), nothing is known."""
    return Intervals(np.fmax(low, -np.inf), np.fmin(high, np.inf))


# ---- functions


def sine(x: Intervals) -> Intervals:
    """Return the sine of angles [rad]."""
    return _wave(x, _at_ends(x), *_WAVES["sin"])


def cosine(x: Intervals) -> Intervals:
    """Return the cosine of angles [rad]."""
    return _wave(x, _at_ends(x), *_WAVES["cos"])


_WAVES = {"sin": (0, 0.5), "cos": (1, 0.0)}  # number in `_at_ends`; highest value [half turns]
_Pair = tuple[FloatArray, FloatArray]


def _at_ends(x: Intervals) -> tuple[_Pair, _Pair]:
    """Return sine and cosine of the lower ends, and of the upper ones."""
    left = _sine_and_cosine(x.low)
    return left, left if x.high is x.low else _sine_and_cosine(x.high)


def _wave(x: Intervals, at_ends: tuple[_Pair, _Pair], which: int, highest: float) -> Intervals:
    """Return the sine (which = 0) or cosine (1), whose largest values are at highest + 2 k half turns.

    Extremes are at whole numbers of half turns from there. A margin covers the rounding of t: taking one that lies just
    outside only widens the result.
    """
    left, right = at_ends[0][which], at_ends[1][which]
    low = np.maximum(np.minimum(left, right) - 2.0 * _SINE_ERROR, -1.0)
    high = np.minimum(np.maximum(left, right) + 2.0 * _SINE_ERROR, 1.0)
    with np.errstate(invalid="ignore"):
        begin, end = x.low / math.pi - highest, x.high / math.pi - highest
        margin = 1e-14 * (1.0 + abs(begin) + abs(end))
        first = np.ceil(begin - margin)
        has_one, has_two = first <= end + margin, first + 1.0 <= end + margin
        is_even = np.remainder(first, 2.0) == 0.0
    has_high = has_two | (has_one & is_even)
    has_low = has_two | (has_one & ~is_even)
    large = ~(x.magnitude <= _LARGEST_ANGLE)
    return Intervals(np.where(has_low | large, -1.0, low), np.where(has_high | large, 1.0, high))


def _sine_and_cosine(x: FloatArray) -> _Pair:
    """Return sine and cosine of angles up to 1e6 rad, each within 2^-50 of the exact value.

    x = k pi/2 + r with |r| <= pi/4 (1 + 1e-9). k C, C one of the first three parts of pi/2, is exact for |k| < 2^20;
    the first difference is exact, the other three are rounded by at most 2^-54 each, and what is left out of pi/2 is
    less than 2^-100 k. So r is within 2^-52. The series stop at r^17 and r^18, with terms below 1e-19 left out. Of
    Horner's sums the last two operations are rounded by at most 2^-53 each, the ones before contribute less than
    2^-53: altogether less than 2^-50.
    """
    k = np.rint(np.where(abs(x) <= _LARGEST_ANGLE, x, 0.0) * (2.0 / math.pi))
    r = np.where(abs(x) <= _LARGEST_ANGLE, x, 0.0)
    for part in _QUARTER:
        r = r - k * part
    squared = r * r
    s, c = np.zeros_like(r), np.zeros_like(r)
    for a in reversed(_SINE):
        s = s * squared + a
    for a in reversed(_COSINE):
        c = c * squared + a
    s = s * r
    quarter = np.remainder(k, 4.0)
    odd = np.remainder(k, 2.0) == 1.0
    of_sine, of_cosine = np.where(odd, c, s), np.where(odd, s, c)
    return (
        np.where(quarter >= 2.0, -of_sine, of_sine),
        np.where((quarter == 1.0) | (quarter == 2.0), -of_cosine, of_cosine),
    )


def root(x: Intervals) -> Intervals:
    """Return the square roots of the parts that are not negative; nothing is known where there is none."""
    with np.errstate(invalid="ignore"):
        low, high = np.maximum(_down(np.sqrt(np.maximum(x.low, 0.0))), 0.0), _up(np.sqrt(x.high))
    return _known(np.where(x.low < 0.0, -np.inf, low), np.where(x.low < 0.0, np.inf, high))


def whole(x: Intervals) -> Intervals:
    """Return the largest whole number not above x; nothing is known where it changes: it jumps."""
    low, high = np.floor(x.low), np.floor(x.high)
    jumps = ~(low == high)
    return Intervals(np.where(jumps, -np.inf, low), np.where(jumps, np.inf, high))


def angle(y: Intervals, x: Intervals) -> Intervals:
    """Return the angle of vectors (x, y) in [-pi, pi]; nothing is known where it jumps: at the negative x axis."""
    corners = [_angle_at(b, a) for a in (x.low, x.high) for b in (y.low, y.high)]
    low = np.minimum.reduce([corner.low for corner in corners])
    high = np.maximum.reduce([corner.high for corner in corners])
    jumps = ~((x.low > 0.0) | (y.low > 0.0) | (y.high < 0.0))
    return Intervals(np.where(jumps, -np.inf, low), np.where(jumps, np.inf, high))


def _angle_at(y: FloatArray, x: FloatArray) -> Intervals:
    """Return the angles of single vectors: t of a library, and how far the vector is turned from it.

    The vector turned by -t is (p, q); its angle is asin(q / |(p, q)|), which is at most 2 |q| / p.
    """
    t = np.arctan2(y, x)
    s, c = sine(Intervals(t)), cosine(Intervals(t))
    ahead, across = c * x + s * y, c * y - s * x
    off = (2.0 * Intervals(across.magnitude) / ahead).magnitude
    return around(t, off)


def curve(x: Intervals, data: CurveData, order: int = 0) -> Intervals:
    """Return a derivative (0: the value) of a piecewise function.

    Nothing is known where an interval contains a break at which a lower derivative jumps: there is no derivative.
    """
    breaks, pieces = data
    ends = (-np.inf, *breaks, np.inf)
    found = Intervals(np.full_like(x.low, np.inf), np.full_like(x.low, -np.inf))
    for piece, begin, end in zip(pieces, ends[:-1], ends[1:], strict=True):
        meets = (x.low <= end) & (x.high >= begin)
        if not meets.any():
            continue
        part = Intervals(np.clip(x.low, begin, end), np.clip(x.high, begin, end))
        safe = Intervals(np.where(meets, part.low, 0.0), np.where(meets, part.high, 0.0))
        value = _piece(piece, order, safe)
        more = found.hull(value)
        found = Intervals(np.where(meets, more.low, found.low), np.where(meets, more.high, found.high))
    if order:
        jumps = np.zeros(x.low.shape, dtype=bool)
        for at in jumping_breaks(data, order - 1):
            jumps |= (x.low <= at) & (x.high >= at)
        found = Intervals(np.where(jumps, -np.inf, found.low), np.where(jumps, np.inf, found.high))
    lost = ~(found.low <= found.high)  # of what is no number
    return Intervals(np.where(lost, -np.inf, found.low), np.where(lost, np.inf, found.high))


def _piece(piece: Piece, order: int, x: Intervals) -> Intervals:
    """Return a derivative of one piece: within the first-order bound around the middle, and within the plain one."""
    middle = x.middle
    plain = _plain_piece(piece, order, x)
    centred = _plain_piece(piece, order, Intervals(middle)) + _plain_piece(piece, order + 1, x) * (x - middle)
    return plain.intersection(centred)


def _plain_piece(piece: Piece, order: int, x: Intervals) -> Intervals:
    origin, coefficients, a, w, p = piece
    s = x - origin
    value = Intervals(np.zeros_like(x.low))
    degree = len(coefficients) - 1
    for k, c in enumerate(coefficients[: degree - order + 1] if degree >= order else ()):
        value = value * s + Intervals(c) * float(math.perm(degree - k, order))
    if a:
        phase = s * w + p
        wave = cosine(phase) if order % 2 else sine(phase)
        factor = interval(a if order % 4 < 2 else -a)
        for _ in range(order):
            factor = factor * w
        value = value + factor * wave
    return value


# ---- the graph


_OPERATIONS: dict[str, Callable[..., Intervals]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a.square() if a is b else a * b,
    "/": lambda a, b: a / b,
    "neg": lambda a: -a,
    "sqrt": root,
    "floor": whole,
    "atan2": angle,
}


def enclosed(targets: Sequence[Node], values: Mapping[str, Intervals], shape: tuple[int, ...]) -> list[Intervals]:
    """Return enclosures of the targets, given intervals for each symbol by name.

    Args:
        targets: Nodes of one graph.
        values: Intervals by the names of symbols, each of the shape.
        shape: Of all results.

    """
    at = _evaluated(reachable(targets), values, shape)
    return [at[target] for target in targets]


def _evaluated(order: Sequence[Node], values: Mapping[str, Intervals], shape: tuple[int, ...]) -> dict[Node, Intervals]:
    """Return enclosures of nodes, each after its arguments."""
    at: dict[Node, Intervals] = {}
    ends: dict[Node, tuple[_Pair, _Pair]] = {}
    for node in order:
        if node.constant is not None:
            at[node] = Intervals(np.full(shape, node.constant))
        elif node.op == "symbol":
            at[node] = values[node.name]
        elif node.op == "curve":
            at[node] = curve(at[node.args[0]], *node.curve)
        elif node.op in _WAVES:  # sine and cosine of an angle are mostly needed together
            (arg,) = node.args
            if arg not in ends:
                ends[arg] = _at_ends(at[arg])
            at[node] = _wave(at[arg], ends[arg], *_WAVES[node.op])
        else:
            at[node] = _OPERATIONS[node.op](*(at[arg] for arg in node.args))
    return at


def jumping(targets: Sequence[Node], values: Mapping[str, Intervals], shape: tuple[int, ...]) -> Any:
    """Return where a floor or an angle in the targets may jump: derivatives do not show it."""
    found = np.zeros(shape, dtype=bool)
    nodes = [node for node in reachable(targets) if node.op in ("floor", "atan2")]
    for value in enclosed(nodes, values, shape):
        found = found | ~(np.isfinite(value.low) & np.isfinite(value.high))
    return found


_NUMBERS: dict[str, Callable[..., Any]] = {
    "+": np.add,
    "-": np.subtract,
    "*": np.multiply,
    "/": np.divide,
    "neg": np.negative,
    "sin": np.sin,
    "cos": np.cos,
    "sqrt": np.sqrt,
    "floor": np.floor,
    "atan2": np.arctan2,
}


def approximate(targets: Sequence[Node], values: Mapping[str, FloatArray], shape: tuple[int, ...]) -> list[FloatArray]:
    """Return numbers for the targets in ordinary arithmetic, given arrays for each symbol by name."""
    at: dict[Node, Any] = {}
    for node in reachable(targets):
        if node.constant is not None:
            at[node] = np.full(shape, node.constant)
        elif node.op == "symbol":
            at[node] = values[node.name]
        elif node.op == "curve":
            data, derivative = node.curve
            x = np.asarray(at[node.args[0]])
            numbers = (curve_value(data, derivative, value) if math.isfinite(value) else math.nan for value in x.flat)
            at[node] = np.fromiter(numbers, float, x.size).reshape(x.shape)
        else:
            at[node] = _NUMBERS[node.op](*(at[arg] for arg in node.args))
    return [at[target] for target in targets]


# ---- contraction


def contracted(
    targets: Sequence[Node], values: Mapping[str, Intervals], names: Sequence[str]
) -> tuple[list[Intervals], Any]:
    """Return intervals of some symbols without parts in which no target can be 0, and where nothing is left.

    Each operation is evaluated forward, then solved for its arguments backward (Benhamou et al., 1999, algorithm HC4).

    Args:
        targets: Nodes of one graph.
        values: Intervals by the names of symbols; arrays that broadcast.
        names: Of the symbols to contract.

    Returns:
        Their intervals; True where they are empty.

    """
    order = reachable(targets)
    at = _evaluated(order, values, (1,))
    moving: set[Node] = set()
    for node in order:
        if (node.op == "symbol" and node.name in names) or not moving.isdisjoint(node.args):
            moving.add(node)
    is_empty = np.zeros(1, dtype=bool)
    for target in targets:
        at[target] = at[target].intersection(interval(0.0))
        is_empty = is_empty | (at[target].low > at[target].high)
    for node in reversed(order):
        for arg, solved in _solved_for(node, at) if node in moving and node.args else ():
            if arg in moving:
                at[arg] = at[arg].intersection(solved)
                is_empty = is_empty | (at[arg].low > at[arg].high)
    by_name = {node.name: at[node] for node in order if node.op == "symbol"}
    return [by_name.get(name, values[name]) for name in names], is_empty


def _solved_for(node: Node, at: Mapping[Node, Intervals]) -> list[tuple[Node, Intervals]]:
    """Return enclosures of the arguments of an operation from its result and its other argument."""
    whole, a, b = at[node], node.args[0], node.args[-1]
    x, y = at[a], at[b]
    if node.op == "+":
        return [(a, whole - y), (b, whole - x)]
    if node.op == "-":
        return [(a, whole + y), (b, x - whole)]
    if node.op == "neg":
        return [(a, -whole)]
    if node.op == "*" and a is b:
        most = _up(np.sqrt(np.maximum(whole.high, 0.0)))
        return [(a, Intervals(-most, most))]
    if node.op == "*":
        return [(a, whole / y), (b, whole / x)]
    if node.op == "/":
        return [(a, whole * y), (b, x / whole)]
    if node.op == "sqrt":
        return [(a, Intervals(np.maximum(whole.low, 0.0), np.maximum(whole.high, 0.0)).square())]
    if node.op == "sin":
        return [(a, _angles_of_sine(whole, x))]
    if node.op == "cos":
        quarter = Intervals(0.5 * math.pi, _up(0.5 * math.pi))
        return [(a, _angles_of_sine(whole, x + quarter) - quarter)]
    return []


def _angles_of_sine(s: Intervals, x: Intervals) -> Intervals:
    """Return the hull of the angles of intervals x whose sine is in s.

    They are within [a, b] or [pi - b, pi - a], whole turns added, if sin(a) <= s <= sin(b) in [-pi/2, pi/2]. Of a
    library's arc sine this is tested. Margins cover the rounding of turns.
    """
    quarter = 0.5 * math.pi
    low = np.arcsin(np.clip(s.low, -1.0, 1.0)) - _ARC_MARGIN
    high = np.arcsin(np.clip(s.high, -1.0, 1.0)) + _ARC_MARGIN
    low = np.where((low > -quarter) & (sine(Intervals(low)).high <= s.low), low, -quarter) - _ARC_MARGIN
    high = np.where((high < quarter) & (sine(Intervals(high)).low >= s.high), high, quarter) + _ARC_MARGIN
    begin, end = np.full_like(x.low + low, np.inf), np.full_like(x.low + low, -np.inf)
    for first, last in ((low, high), (math.pi - high - _ARC_MARGIN, math.pi - low + _ARC_MARGIN)):
        margin = _ARC_MARGIN * (1.0 + x.magnitude)
        before = np.ceil((x.low - margin - last) / math.tau) * math.tau + first - margin
        after = np.floor((x.high + margin - first) / math.tau) * math.tau + last + margin
        begin, end = np.minimum(begin, before), np.maximum(end, after)
    is_plain = x.magnitude <= _LARGEST_ANGLE
    return Intervals(np.where(is_plain, begin, -np.inf), np.where(is_plain, end, np.inf))
