"""Covering a range with proved cells, each joined to the next."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from kinfmu.analysis.certified.cells import Cells, Prover, Tubes
from kinfmu.analysis.certified.intervals import Intervals
from kinfmu.arrays import FloatArray

_GENERATIONS = 60  # of halved cells
MOST_CELLS = 20_000  # that fail in one generation

Guess = Callable[[FloatArray], FloatArray]  # unknowns (n, m) for m driver values; NaN where there are none


@dataclass(frozen=True)
class Cover:
    """Proved cells in the order of the driver, and where each is joined to the next.

    Attributes:
        cells: The cells.
        tubes: What is proved of them.
        is_joined: For each cell but the last, whether the pose at its upper end is that of the next cell.

    """

    cells: Cells
    tubes: Tubes
    is_joined: Any

    @property
    def pieces(self) -> list[tuple[int, int]]:
        """First and last cell of each piece whose cells are joined."""
        if not len(self.cells):
            return []
        ends = np.flatnonzero(~self.is_joined)
        return list(zip([0, *(ends + 1).tolist()], [*ends.tolist(), len(self.cells) - 1], strict=True))

    def with_poses(self, x: FloatArray, z: FloatArray) -> Cover:
        """Return the pieces in which poses lie, (n, m) at m driver values, without those that leave out one of them.

        A piece without such a pose may be another branch.
        """
        cells, kept = self.cells, np.zeros(len(self.cells), dtype=bool)
        for first, last in self.pieces:
            which = np.flatnonzero((x >= cells.low[first]) & (x <= cells.high[last]))
            k = np.clip(np.searchsorted(cells.low[first : last + 1], x[which], "right") - 1, 0, None) + first
            off = Intervals(z[:, which]) - cells[k].at(Intervals(x[which]) - cells.u[k])
            kept[first : last + 1] = len(which) and off.is_inside(self.tubes[k].wide).all()
        return joined([(cells[kept], self.tubes[kept])])


def cover(prover: Prover, edges: FloatArray, guess: Guess, least: float) -> Cover:
    """Return proved cells between edges; cells that fail, or are not joined, are halved down to a least width.

    Args:
        prover: Proves cells.
        edges: Ends of the first cells, in ascending order.
        guess: Poses near those of the mechanism.
        least: Width below which cells are given up.

    """
    found: list[tuple[Cells, Tubes]] = []
    low, high = edges[:-1], edges[1:]
    near = guess(0.5 * (low + high))
    for _ in range(_GENERATIONS):
        if not 0 < len(low) <= MOST_CELLS:
            break
        cells, converged = prover.cells(low, high, near)
        tubes = prover.prove(cells)
        good = tubes.is_proved & converged
        found.append((cells[good], tubes[good]))
        low, high, parent = _halved(low[~good], high[~good], least)
        at = 0.5 * (low + high)
        near = cells[~good][parent].at(at - cells.u[~good][parent]).middle
        lost = ~converged[~good][parent]
        near[:, lost] = guess(at[lost])
        if not len(low):
            whole = joined(found)
            apart = np.flatnonzero(~whole.is_joined & (whole.cells.high[:-1] == whole.cells.low[1:]))
            apart = np.unique([*apart, *(apart + 1)]).astype(int)
            apart = apart[whole.cells.high[apart] - whole.cells.low[apart] > 2.0 * least]
            if not len(apart):
                return whole
            kept = np.ones(len(whole.cells), dtype=bool)
            kept[apart] = False
            found = [(whole.cells[kept], whole.tubes[kept])]
            low, high, _ = _halved(whole.cells.low[apart], whole.cells.high[apart], least)
            near = guess(0.5 * (low + high))
    return joined(found)


def _halved(low: FloatArray, high: FloatArray, least: float) -> tuple[FloatArray, FloatArray, Any]:
    """Return both halves of the cells that are wide enough, and the number of the cell of each."""
    large = np.flatnonzero(high - low > 2.0 * least)
    low, high = low[large], high[large]
    middle = 0.5 * (low + high)
    return np.concatenate((low, middle)), np.concatenate((middle, high)), np.concatenate((large, large))


def joined(found: list[tuple[Cells, Tubes]]) -> Cover:
    """Return all cells in order, and which are joined."""
    cells = Cells.joined([cells for cells, _ in found])
    tubes = Tubes.joined([tubes for _, tubes in found])
    order = np.argsort(cells.u)
    cells, tubes = cells[order], tubes[order]
    if len(cells) < 2:
        return Cover(cells, tubes, np.zeros(max(len(cells) - 1, 0), dtype=bool))
    before, after = slice(None, -1), slice(1, None)
    meet = cells.high[before] == cells.low[after]
    ahead = meets(cells[before], tubes.narrow[:, before], cells[after], tubes.wide[:, after], cells.high[before])
    back = meets(cells[after], tubes.narrow[:, after], cells[before], tubes.wide[:, before], cells.high[before])
    return Cover(cells, tubes, meet & (ahead | back))


def meets(cells: Cells, narrow: Intervals, others: Cells, wide: Intervals, u: FloatArray) -> Any:
    """Return where the poses of cells at driver values lie in the tubes of others, in which there is only one pose."""
    inside = cells.at(Intervals(u) - cells.u) + narrow
    outside = others.at(Intervals(u) - others.u)
    return (inside - outside).is_inside(wide).all(axis=0)
