"""Bounds of quantities of the pose over proved cells."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kinfmu.analysis.certify.cells import Cells, Prover, Tubes
from kinfmu.analysis.certify.intervals import Interval, enclosed
from kinfmu.plan.equations.graph import Node

_HALVINGS = 40
_TIGHT = 1e-9  # of the largest value; a bound is not sought closer


class Bounds(NamedTuple):
    """What a quantity is at least and at most; each as an interval that contains the exact extreme.

    Attributes:
        least: Encloses the smallest value.
        most: Encloses the largest value.

    """

    least: tuple[float, float]
    most: tuple[float, float]


def bounds(prover: Prover, cells: Cells, tubes: Tubes, node: Node, order: int) -> Bounds:
    """Return the bounds of a quantity (order 0), of its rate (1) or acceleration (2) over cells.

    Parts of cells that may contain an extreme are halved, until their bounds are close or the tubes' widths are met.

    Args:
        prover: What has proved the cells.
        cells: The cells.
        tubes: What is proved of them.
        node: The quantity, of the graph of the prover's formulas.
        order: Of the derivative with respect to the driver, or to time.

    """
    quantity = _Quantity(prover, node, order)
    most = _most(quantity, cells, tubes, 1.0)
    least = _most(quantity, cells, tubes, -1.0)
    return Bounds((-least[1], -least[0]), most)


def _most(quantity: _Quantity, cells: Cells, tubes: Tubes, sign: float) -> tuple[float, float]:
    """Return the interval of the largest value of a quantity times a sign."""
    which = np.arange(len(cells))
    low, high = cells.s.low.copy(), cells.s.high.copy()
    ends = [quantity.at(cells, tubes, Interval(end)) * sign for end in (low, high)]
    best = float(max(end.low.max() for end in ends))  # known lower bound of the maximum
    sure = -np.inf  # upper bound of the parts given up
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        at = quantity.at(cells[which], tubes[which], Interval(middle)) * sign
        best = max(best, float(at.low.max()))
        part = quantity.at(cells[which], tubes[which], Interval(low, high)) * sign
        open_ = part.high > best
        close = part.high - best <= _TIGHT * max(abs(best), 1e-300)
        spread = at.high - at.low
        close |= part.high - at.high <= 0.1 * spread  # as wide as the tube itself
        sure = max(sure, float(part.high[open_ & close].max(initial=-np.inf)))
        open_ &= ~close
        if not open_.any():
            return best, max(best, sure)
        rest = float(part.high[open_].max())
        which, low, high, middle = which[open_], low[open_], high[open_], middle[open_]
        which = np.concatenate((which, which))
        low, high = np.concatenate((low, middle)), np.concatenate((middle, high))
    return best, max(best, sure, rest)


class _Quantity:
    """A quantity or its derivative, evaluated by its series in each cell with what the tube adds."""

    def __init__(self, prover: Prover, node: Node, order: int) -> None:
        formulas = prover.formulas
        self.prover = prover
        self.order = order
        self.series = formulas.along([node], order + 2)[0][order:]
        self.slopes = [formulas.gradient([self.series[0]], name)[0] for name in formulas.unknowns]
        self.first = [formulas.gradient([node], name)[0] for name in formulas.unknowns]

    def at(self, cells: Cells, tubes: Tubes, s: Interval) -> Interval:
        """Return the quantity at driver values s from the centres, an interval for each cell."""
        shape = (len(cells),)
        thin, _, _ = self.prover.enclosures(cells)
        broad = self.prover.over(cells, s)
        moving = self.prover.deviated(broad, tubes)
        if self.order == 2:  # the tube of accelerations is as wide as a cell: no series
            return enclosed([self.series[0]], moving, shape)[0]
        start, rate = enclosed(self.series[:2], thin, shape)
        (curvature,) = enclosed([self.series[2]], broad, shape)
        (first,) = enclosed([self.series[1]], broad, shape)
        value = (start + rate * s + curvature * (s.square() * 0.5)).intersection(start + first * s)
        for deviations, nodes in [(tubes.narrow, self.slopes), *([(tubes.rates, self.first)] if self.order else [])]:
            used = [k for k, node in enumerate(nodes) if node.constant != 0.0]
            for k, slope in zip(used, enclosed([nodes[k] for k in used], moving, shape), strict=True):
                value = value + slope * deviations[k]
        return value.intersection(enclosed([self.series[0]], moving, shape)[0])

