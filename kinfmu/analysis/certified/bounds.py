"""ExtremeBounds of quantities of the pose over proved cells."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from kinfmu.analysis.certified.cells import Cells, Prover, Tubes
from kinfmu.analysis.certified.intervals import Intervals, enclosed
from kinfmu.arrays import FloatArray
from kinfmu.plan.equations.graph import Node

_CLOSE = 1e-5  # of the largest value; a bound is not sought closer
_MOST_PARTS = 5000  # of cells that may contain an extreme
_MOST_CLOSING = 20_000  # of cells in which a redundant row is bounded
_NARROWEST = 1e-9  # of the driver


class ExtremeBounds(NamedTuple):
    """What a quantity is at least and at most; each as an interval that contains the exact extreme.

    Attributes:
        least: Encloses the smallest value.
        most: Encloses the largest value.

    """

    least: tuple[float, float]
    most: tuple[float, float]


def bounds(prover: Prover, cells: Cells, tubes: Tubes, node: Node, order: int) -> ExtremeBounds:
    """Return the bounds of a quantity (order 0), of its rate (1) or acceleration (2) over cells.

    Cells that may contain an extreme are halved and proved again, until its bounds are close.

    Args:
        prover: What has proved the cells.
        cells: The cells.
        tubes: What is proved of them.
        node: The quantity, of the graph of the prover's formulas.
        order: Of the derivative with respect to the driver, or to time.

    """
    quantity = EnclosedQuantity(prover, node, order)
    most = _most(quantity, cells, tubes, 1.0)
    least = _most(quantity, cells, tubes, -1.0)
    return ExtremeBounds((-least[1], -least[0]), most)


def _most(quantity: EnclosedQuantity, cells: Cells, tubes: Tubes, sign: float) -> tuple[float, float]:
    """Return an interval that contains the largest value of a quantity times a sign."""
    best = sure = -np.inf  # a known lower bound of the maximum, and an upper one of it over the cells given up
    while True:
        ends = (Intervals(cells.low) - cells.u, Intervals(0.0 * cells.u), Intervals(cells.high) - cells.u)
        places = [quantity.at(cells, tubes, at) * sign for at in ends]
        best = max(best, *(float(place.low.max()) for place in places))
        high = (quantity.at(cells, tubes, cells.s) * sign).high
        rest = float(high.max())
        if max(rest, sure) - best <= _CLOSE * max(abs(best), abs(rest - best)):
            return best, max(best, rest, sure)
        open_ = high > best
        parts, part_tubes, given_up = _halved(quantity.prover, cells[open_], tubes[open_])
        sure = max(sure, float(high[open_][given_up].max(initial=-np.inf)))
        if not 0 < len(parts) <= _MOST_PARTS:
            return best, max(best, rest, sure)
        cells, tubes = parts, part_tubes


def closing(
    prover: Prover, cells: Cells, tubes: Tubes, nodes: Sequence[Node], enough: float
) -> tuple[FloatArray, Any, Any]:
    """Return bounds of the absolute values of rows where they are at most `enough`, and where they are not shown to be.

    Parts of cells are halved and proved again until all rows are at most `enough` there. The second array, (rows,
    cells), states where a row is more in some part, the third one where the halves of a part are given up.
    """
    quantities = [EnclosedQuantity(prover, node, 0) for node in nodes]
    of, bound = np.arange(len(cells)), np.zeros(len(nodes))
    is_open, is_unsure = np.zeros((2, len(nodes), len(cells)), dtype=bool)
    while len(cells):
        values = [quantity.at(cells, tubes, cells.s) for quantity in quantities]
        most = np.array([value.magnitude for value in values])
        for number, value in enumerate(values):
            is_open[number, of[value.mignitude > enough]] = True
        is_shown = (most <= enough).all(axis=0)
        bound = np.maximum(bound, most[:, is_shown].max(axis=1, initial=0.0))
        todo = ~is_shown & ~(is_open | is_unsure)[:, of].any(axis=0)
        most, of = most[:, todo], of[todo]
        cells, tubes, given_up = _halved(prover, cells[todo], tubes[todo])
        if len(cells) > _MOST_CLOSING:
            given_up[:] = True
            cells, tubes = cells[:0], tubes[:0]
        for number, value in enumerate(most):
            is_unsure[number, of[given_up & ~(value <= enough)]] = True
        of = np.tile(of[~given_up], 2)
    return bound, is_open, is_unsure & ~is_open


def _halved(prover: Prover, cells: Cells, tubes: Tubes) -> tuple[Cells, Tubes, Any]:
    """Return the halves of cells, proved again, and which cells are too narrow or have a half that is not proved.

    The pose in the middle of a half is that of its cell, since it lies in the tube in which that is the only one; so
    are the others, since both change continuously.
    """
    ends = [(cells.low, cells.u), (cells.u, cells.high)]
    halves = []
    failed = cells.high - cells.low <= _NARROWEST * (1.0 + abs(cells.u))
    for low, high in ends:
        middle = 0.5 * (low + high)
        part, converged = prover.cells(low, high, cells.at(Intervals(middle) - cells.u).middle)
        tube = prover.prove(part)
        pose = part.at(Intervals(np.zeros_like(part.u))) + tube.narrow
        inside = (pose - cells.at(Intervals(part.u) - cells.u)).is_inside(tubes.wide)
        failed = failed | ~(converged & tube.is_proved & inside.all(axis=0))
        halves.append((part, tube))
    return (
        Cells.joined([part[~failed] for part, _ in halves]),
        Tubes.joined([tube[~failed] for _, tube in halves]),
        failed,
    )


class EnclosedQuantity:
    """A quantity or its derivative, evaluated by its series in each cell with what the tube adds."""

    def __init__(self, prover: Prover, node: Node, order: int) -> None:
        formulas = prover.formulas
        self.prover = prover
        self.order = order
        self.series = formulas.along([node], order + 2)[0][order:]
        self.slopes = [formulas.gradient([self.series[0]], name)[0] for name in formulas.unknowns]
        self.varied = {name: formulas.gradient([self.series[0]], name)[0] for name in formulas.varied}
        self.first = [formulas.gradient([node], name)[0] for name in formulas.unknowns]

    def at(self, cells: Cells, tubes: Tubes, s: Intervals) -> Intervals:
        """Return the quantity at driver values s from the centres, an interval for each cell."""
        shape = (len(cells),)
        thin, _, _ = self.prover.enclosures(cells)
        broad = self.prover.over(cells, s.hull(Intervals(np.zeros_like(s.low))))  # from the centre to s
        if self.order:
            tubes = self.prover.closer(cells, tubes, s)
        moving = self.prover.deviated(self.prover.over(cells, s), tubes)
        if self.order == 2:
            return enclosed([self.series[0]], moving, shape)[0]
        start, rate = enclosed(self.series[:2], thin, shape)
        (curvature,) = enclosed([self.series[2]], broad, shape)
        (first,) = enclosed([self.series[1]], broad, shape)
        value = (start + rate * s + curvature * (s.square() * 0.5)).intersection(start + first * s)
        for deviations, nodes in [(tubes.narrow, self.slopes), *([(tubes.rates, self.first)] if self.order else [])]:
            used = [k for k, node in enumerate(nodes) if node.constant != 0.0]
            for k, slope in zip(used, enclosed([nodes[k] for k in used], moving, shape), strict=True):
                value = value + slope * deviations[k]
        for name, node in self.varied.items():
            if node.constant != 0.0:
                (slope,) = enclosed([node], moving, shape)
                value = value + slope * (moving[name] - self.prover.middle[name])
        return value.intersection(enclosed([self.series[0]], moving, shape)[0])
