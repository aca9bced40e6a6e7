"""Two-sided Hermite interpolation of a function from its value and two derivatives at several nodes."""

from __future__ import annotations

from functools import cache

FunctionValues = tuple[float, float, float]  # f, f', f'' at a point


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

    def __call__(self, x: float) -> FunctionValues:
        """Return p, p', p'' at x."""
        value = slope = curve = 0.0
        for coefficient, node in self._terms:
            d = x - node
            curve = curve * d + 2.0 * slope
            slope = slope * d + value
            value = value * d + coefficient
        return value, slope, curve


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
