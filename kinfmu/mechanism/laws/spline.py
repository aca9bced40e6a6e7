from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Any, ClassVar

from kinfmu.errors import MechanismError, listed, suggestion
from kinfmu.mechanism.laws.law import NEARLY, TURN, Constant, ConstantPath, Jumps, Law, LawQuantity, jumping_breaks
from kinfmu.mechanism.quantities.arithmetic import Value, curve, split_periods
from kinfmu.mechanism.quantities.placement import Reference
from kinfmu.solver.python.curve import CurveData, Piece

NOT_A_KNOT, NATURAL, PERIODIC = ENDS = ("not_a_knot", "natural", "periodic")
FEWEST = {NOT_A_KNOT: 4, NATURAL: 3, PERIODIC: 4}
STEPS = 2.0  # over a width in which a cubic bends by a sixth of the table's range; a point out of line is seen in 12
EDGE = 1e-12  # of the table's width; times k h that miss the last point by rounding still belong to the table
SAME = 1e-9  # of the largest value; by how much the ends of a periodic table may differ
_X, _U = LawQuantity("argument"), LawQuantity("led")


@dataclass(frozen=True)
class Spline(Law):
    """The cubic spline through the points of a table.

        u = u_k + b_k s + c_k s^2 + d_k s^3,   s = x - x_k,        u'' continuous

    Unless the spline is periodic, u keeps the first value before the table and the last one after it.
    De Boor, A Practical Guide to Splines, chapter IV.
    """

    type: ClassVar[str] = "spline"

    points: Annotated[tuple[tuple[float, float], ...], "(x_k, u_k), x ascending"]
    ends: Annotated[
        str,
        Reference("choice", ENDS),
        "'not_a_knot' (the first two pieces are one cubic, and the last two), 'natural' (u'' = 0 at both ends) or "
        "'periodic' (repeats after the table's width, with continuous u' and u'')",
    ] = NOT_A_KNOT

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", tuple(_pair(point) for point in self.points))

    def numbers(self) -> dict[ConstantPath, Constant]:
        return self._numbers

    @cached_property
    def _numbers(self) -> dict[ConstantPath, Constant]:
        return {
            ("points", k, i): Constant(point[i], measured)
            for k, point in enumerate(self.points)
            for i, measured in enumerate((_X, _U))
        }

    def with_numbers(self, values: Mapping[ConstantPath, Any]) -> Spline:
        points = tuple(
            tuple(values.get(("points", k, i), point[i]) for i in (0, 1)) for k, point in enumerate(self.points)
        )
        return replace(self, points=points)

    def constants(self) -> dict[str, Constant]:
        return {}

    @cached_property
    def data(self) -> CurveData:
        """The spline as a curve."""
        return spline_data(self.points, self.ends)

    def target(self, x: Value, **constants: Value) -> Value:  # noqa: ARG002  it has none
        if self.ends == PERIODIC:
            first, last = self.points[0][0], self.points[-1][0]
            x = split_periods(x, first, last, -first)[1]
        return curve(x, self.data)

    @cached_property
    def _steps(self) -> CurveData:
        """`fewest_steps` in the table, from 0: over a width w a piece bends by d w^3, a part of the table's range.

        So dense tables of smooth curves are not seen point by point, but one point out of line is.
        """
        values = [u for _, u in self.points]
        extent = max(values) - min(values) or 1.0
        inner = self.data[1] if self.ends == PERIODIC else self.data[1][1:-1]
        knots = [x for x, _ in self.points]
        total, pieces = 0.0, list[Piece]()
        for (_, (d, *_), *_), (begin, end) in zip(inner, pairwise(knots), strict=True):
            density = STEPS * (6.0 * abs(d) / extent) ** (1.0 / 3.0)
            pieces.append((begin, (density, total), 0.0, 0.0, 0.0))
            total += density * (end - begin)
        before, after = (0.0, (0.0,), 0.0, 0.0, 0.0), (0.0, (total,), 0.0, 0.0, 0.0)
        return tuple(knots), (before, *pieces, after)

    def fewest_steps(self, x: Value, **constants: Value) -> Value:  # noqa: ARG002  it has none
        if self.ends != PERIODIC:
            return curve(x, self._steps)
        first, last = self.points[0][0], self.points[-1][0]
        times, x = split_periods(x, first, last, -first)
        return times * self._steps[1][-1][1][0] + curve(x, self._steps)

    def most_steps(self, **constants: Value) -> Value:  # noqa: ARG002  it has none
        return max(slope for _, (slope, *_), *_ in self._steps[1])

    def most_added(self, **constants: Value) -> Value:  # noqa: ARG002  it has none
        first, last = self.points[0][0], self.points[-1][0]
        return abs(first) + abs(last)

    def breaks(self, order: int, /, **constants: Value) -> Jumps:  # noqa: ARG002  it has none
        if self.ends != PERIODIC:
            return Jumps(jumping_breaks(self.data, order))
        first, width = self.points[0][0], self.points[-1][0] - self.points[0][0]
        breaks, pieces = self.data
        origin, *last = pieces[-1]
        before: Piece = (origin - width, *last)  # type: ignore[assignment]  # four parts
        return Jumps(jumping_breaks(((first, *breaks), (before, *pieces)), order), width)

    def check(self, where: str) -> None:
        if self.ends not in ENDS:
            near = suggestion(str(self.ends), ENDS)
            raise MechanismError(f"{where} ends = {self.ends!r} is not known{near}; known: {listed(ENDS)}")
        fewest = FEWEST[self.ends]
        if len(self.points) < fewest:
            raise MechanismError(
                f"{where} points: {len(self.points)} points are too few for ends = '{self.ends}'; at least {fewest}"
            )
        if any(
            not isinstance(value, float) or hasattr(value, "expression") for point in self.points for value in point
        ):
            raise MechanismError(f"{where} points must be numbers; a table cannot hold expressions of parameters")
        for k, ((x, _), (following, _)) in enumerate(pairwise(self.points), start=2):
            if not following > x:
                why = "appears twice" if following == x else f"comes after {x!r}"
                raise MechanismError(f"{where} points: x = {following!r} of point {k} {why}; x must ascend")
        if self.ends == PERIODIC:
            first, last = self.points[0][1], self.points[-1][1]
            if abs(last - first) > SAME * max(abs(u) for _, u in self.points):
                raise MechanismError(
                    f"{where} points: the last value {last!r} must be the first, {first!r}, with ends = 'periodic'"
                )

    @property
    def repeats(self) -> bool:
        return self.ends == PERIODIC

    @property
    def period(self) -> float:
        return float(self.points[-1][0] - self.points[0][0]) if self.repeats else 0.0

    def why_not_periodic(self) -> str:
        if self.ends != PERIODIC:
            return "its table does not repeat; set ends = 'periodic'"
        width = self.points[-1][0] - self.points[0][0]
        times = round(TURN / width)
        if times < 1 or abs(width * times - TURN) > NEARLY * TURN:
            return f"its table spans {math.degrees(width):.9g} deg, not a turn of 360 deg or a whole part of it"
        return ""


def _pair(point: Any) -> tuple[Any, Any]:
    try:
        x, u = tuple(point) if not isinstance(point, str) else ()
    except (TypeError, ValueError):
        raise MechanismError(f"points of a spline: {point!r} must be two numbers [x, u]") from None
    return x, u


def spline_data(points: Sequence[tuple[float, float]], ends: str) -> CurveData:
    """Return the cubic spline through the points, from its second derivatives m_k at them.

    h_k-1 m_k-1 + 2 (h_k-1 + h_k) m_k + h_k m_k+1 = 6 ((u_k+1 - u_k) / h_k - (u_k - u_k-1) / h_k-1)
    """
    x = [point[0] for point in points]
    u = [point[1] for point in points]
    if ends == PERIODIC:
        u[-1] = u[0]
    h = [b - a for a, b in pairwise(x)]
    slope = [(b - a) / width for (a, b), width in zip(pairwise(u), h, strict=True)]
    if ends == NATURAL:
        m = [0.0, *tridiagonal(*_rows(h, slope)), 0.0]
    else:
        m = _periodic(h, slope) if ends == PERIODIC else _not_a_knot(h, slope)
    pieces: list[Piece] = []
    for k, width in enumerate(h):
        b = slope[k] - width * (2.0 * m[k] + m[k + 1]) / 6.0
        pieces.append((x[k], ((m[k + 1] - m[k]) / (6.0 * width), 0.5 * m[k], b, u[k]), 0.0, 0.0, 0.0))
    if ends == PERIODIC:
        return tuple(x[1:-1]), tuple(pieces)
    edge = EDGE * (x[-1] - x[0])
    before, after = (0.0, (u[0],), 0.0, 0.0, 0.0), (0.0, (u[-1],), 0.0, 0.0, 0.0)
    return (x[0] - edge, *x[1:-1], x[-1] + edge), (before, *pieces, after)


def _rows(h: Sequence[float], slope: Sequence[float]) -> tuple[list[float], list[float], list[float], list[float]]:
    """Return lower, main and upper diagonal and right side for the inner points 1 to n - 1."""
    inner = range(1, len(h))
    main = [2.0 * (h[k - 1] + h[k]) for k in inner]
    right = [6.0 * (slope[k] - slope[k - 1]) for k in inner]
    return [h[k - 1] for k in inner], main, [h[k] for k in inner], right


def _not_a_knot(h: Sequence[float], slope: Sequence[float]) -> list[float]:
    """m_0 lies on the line through m_1 and m_2, so that the first two pieces are one cubic; likewise at the end."""
    lower, main, upper, right = _rows(h, slope)
    first, last = h[0] / h[1], h[-1] / h[-2]
    main[0] += h[0] * (1.0 + first)
    upper[0] -= h[0] * first
    main[-1] += h[-1] * (1.0 + last)
    lower[-1] -= h[-1] * last
    m = tridiagonal(lower, main, upper, right)
    return [(1.0 + first) * m[0] - first * m[1], *m, (1.0 + last) * m[-1] - last * m[-2]]


def _periodic(h: Sequence[float], slope: Sequence[float]) -> list[float]:
    """m_0 = m_n: the row of point 0 reaches round to the last piece; m = y - m_0 z with y, z from the inner rows."""
    lower, main, upper, right = _rows(h, slope)
    y = tridiagonal(lower, main, upper, right)
    z = tridiagonal(lower, main, upper, [h[0], *(0.0 for _ in right[2:]), h[-1]])
    whole = 2.0 * (h[-1] + h[0]) - h[-1] * z[-1] - h[0] * z[0]
    m_0 = (6.0 * (slope[0] - slope[-1]) - h[-1] * y[-1] - h[0] * y[0]) / whole
    return [m_0, *(a - m_0 * b for a, b in zip(y, z, strict=True)), m_0]


def tridiagonal(
    lower: Sequence[float], main: Sequence[float], upper: Sequence[float], right: Sequence[float]
) -> list[float]:
    """Solve a tridiagonal system with a dominant main diagonal, (n,); lower[0] and upper[n - 1] are unused."""
    pivots, sides = [main[0]], [right[0]]
    for k in range(1, len(main)):
        factor = lower[k] / pivots[-1]
        pivots.append(main[k] - factor * upper[k - 1])
        sides.append(right[k] - factor * sides[-1])
    solution = [sides[-1] / pivots[-1]]
    for k in range(len(main) - 2, -1, -1):
        solution.append((sides[k] - upper[k] * solution[-1]) / pivots[k])
    return solution[::-1]
