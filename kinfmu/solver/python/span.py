"""Span: interpolation across a singular point from six regular poses around it, by two-sided Hermite polynomials."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

from .pose import Model, Pose, Vector, evaluated, tangent_of

FunctionValues = tuple[float, float, float]  # f, f', f'' at a point

REGULAR = 0.19  # determinant from which a block is regular; less than the sine at a bridge's last node
PLACES = (-4.0, -2.0, -1.0, 1.0, 2.0, 4.0)  # of the nodes, in half widths
_INNER = PLACES[1:5]
_OUTER = (*PLACES[:2], *PLACES[4:])


class Hermite:
    """The polynomial of degree 3 n - 1 with given f, f', f'' at n nodes, in Newton's form on repeated nodes.

        p(x) = sum_i c_i prod_{j<i} (x - x_j),   every node three times

    c are divided differences, where a difference over equal nodes is the derivative over its factorial.
    """

    __slots__ = ("_terms",)

    def __init__(self, nodes: tuple[float, ...], samples: tuple[FunctionValues, ...]) -> None:
        repeated = [x for x in nodes for _ in range(3)]
        known = [sample for sample in samples for _ in range(3)]
        column = [sample[0] for sample in known]
        coefficients = [column[0]]
        for order in range(1, len(repeated)):
            new = []
            for i in range(len(repeated) - order):
                a, b = repeated[i], repeated[i + order]
                if a == b:  # three equal nodes at most: order 1 or 2
                    new.append(known[i][1] if order == 1 else 0.5 * known[i][2])
                else:
                    new.append((column[i + 1] - column[i]) / (b - a))
            column = new
            coefficients.append(column[0])
        self._terms = tuple(zip(reversed(coefficients), reversed(repeated), strict=True))  # as they are evaluated

    def __call__(self, x: float, per_x: float = 1.0) -> FunctionValues:
        """Return p and its two derivatives with respect to u at x; per_x: dx/du."""
        value = slope = curve = 0.0
        for coefficient, node in self._terms:
            d = x - node
            curve = curve * d + 2.0 * slope
            slope = slope * d + value
            value = value * d + coefficient
        return value, slope * per_x, curve * per_x * per_x


@cache  # few combinations of nodes and places are ever asked for
def weights(nodes: tuple[float, ...], x: float) -> tuple[FunctionValues, ...]:
    """Return the weights of f, f' and f'' of each node in the value of the interpolating polynomial at x."""
    zero: FunctionValues = (0.0, 0.0, 0.0)
    unit: tuple[FunctionValues, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    rows = []
    for k in range(len(nodes)):
        column = []
        for one in unit:
            samples = tuple(one if j == k else zero for j in range(len(nodes)))
            column.append(Hermite(nodes, samples)(x)[0])
        rows.append((column[0], column[1], column[2]))
    return tuple(rows)


class Span:
    """The unknowns of singular blocks around `centre`, for a single driver.

    nodes: six poses at -4, -2, -1, 1, 2, 4 half widths; held: one bit for each block, set if it is interpolated; -1 for
    all blocks.
    The inner four nodes give the numbers; their difference from the outer four is the error estimate.
    """

    __slots__ = ("_inner", "_middle", "_outer", "centre", "half", "held", "model", "nodes")

    def __init__(self, model: Model, centre: float, half: float, nodes: Sequence[Pose]) -> None:
        self.model = model
        self.centre = centre
        self.half = half
        self.nodes = nodes
        self.held = 0
        for block in range(len(model.BLOCKS)):
            before, after = nodes[2].determinants[block], nodes[3].determinants[block]
            if before * after <= 0.0 or min(abs(before), abs(after)) < REGULAR:  # steep ones are regular at both ends
                self.held |= 1 << block
        if self.held == (1 << len(model.BLOCKS)) - 1:
            self.held = -1
        self._inner: list[Hermite] | None = None  # made when first read: many bridges are only crossed
        self._outer: list[Hermite] | None = None
        self._middle: tuple[Vector, Vector] | None = None

    def read(self, x: float) -> tuple[Vector, Vector, Vector]:
        """Return z and its two derivatives with respect to the driver at x = (u - centre) / half."""
        if self._inner is None:
            self._inner = _polynomials(self.model, self.half, _INNER, self.nodes[1:5])
        return _read(self._inner, x, self.half)

    def difference(self, x: float) -> tuple[Vector, Vector, Vector]:
        """Return the difference of inner and outer nodes, in z and its two derivatives: the error estimate."""
        if self._outer is None:
            self._outer = _polynomials(self.model, self.half, _OUTER, [*self.nodes[:2], *self.nodes[4:]])
        a, b = self.read(x), _read(self._outer, x, self.half)
        z, zd, zdd = (tuple([p - q for p, q in zip(v, w, strict=True)]) for v, w in zip(a, b, strict=True))
        return z, zd, zdd

    def middle(self) -> tuple[Vector, Vector]:
        """Return z at the centre by the inner nodes, and by the outer ones."""
        if self._middle is None:
            inner = combined(self.model, self.half, weights(_INNER, 0.0), self.nodes[1:5])
            outer = combined(self.model, self.half, weights(_OUTER, 0.0), [*self.nodes[:2], *self.nodes[4:]])
            self._middle = inner, outer
        return self._middle

    def apart(self) -> float:
        """Return the largest difference of the two at the centre, in radians and sizes."""
        inner, outer = self.middle()
        scales = self.model.UNKNOWN_SCALES
        return float(max([abs(a - b) / c for a, b, c in zip(inner, outer, scales, strict=True)]))

    def dump(self) -> list[Any]:
        """Return plain numbers from which `restored_span` makes an equal span."""
        return [self.centre, self.half, [[list(node.u), list(node.z)] for node in self.nodes]]


def restored_span(model: Model, data: list[Any]) -> Span:
    """Return the span that `dump` gave as plain numbers."""
    centre, half, nodes = data
    return Span(model, centre, half, [Pose(tuple(u), evaluated(model, tuple(u), tuple(z))) for u, z in nodes])


def combined(model: Model, half: float, by: Sequence[Vector], poses: Sequence[Pose]) -> Vector:
    """Return z of the Hermite polynomials through poses, at a place with known weights."""
    total = [0.0] * len(model.UNKNOWNS)
    for pose, (w0, w1, w2) in zip(poses, by, strict=True):
        zd, zdd = tangent_of(model, pose)
        w1, w2 = w1 * half, w2 * half * half
        total = [t + w0 * a + w1 * b + w2 * c for t, a, b, c in zip(total, pose.z, zd, zdd, strict=True)]
    return tuple(total)


def _polynomials(model: Model, half: float, places: tuple[float, ...], poses: Sequence[Pose]) -> list[Hermite]:
    """Return one polynomial for each unknown, over x = (u - centre) / half; the derivatives are with respect to x."""
    tangents = [tangent_of(model, pose) for pose in poses]
    return [
        Hermite(
            places,
            tuple(
                (pose.z[k], zd[k] * half, zdd[k] * half * half) for pose, (zd, zdd) in zip(poses, tangents, strict=True)
            ),
        )
        for k in range(len(model.UNKNOWNS))
    ]


def _read(polynomials: list[Hermite], x: float, half: float) -> tuple[Vector, Vector, Vector]:
    """Return z and its two derivatives with respect to the driver at x."""
    per_x = 1.0 / half
    z, zd, zdd = zip(*[polynomial(x, per_x) for polynomial in polynomials], strict=True)
    return z, zd, zdd
