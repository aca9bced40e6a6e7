"""Dead centres: the proof that a branch turns back at the end of a driver's range."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from kinfmu.analysis.certified.bounds import closing
from kinfmu.analysis.certified.cells import Prover
from kinfmu.analysis.certified.certificate import DeadCentre, PathEnd
from kinfmu.analysis.certified.cover import Cover, cover
from kinfmu.analysis.certified.intervals import Intervals
from kinfmu.arrays import FloatArray
from kinfmu.plan.equations.graph import symbols
from kinfmu.solver.python.limit import Limit
from kinfmu.solver.python.solver import TOLERANCE

_ENCLOSED = 2e-10  # [rad, sizes] of the driver, about; how closely a dead centre is enclosed
_WINDOWS = (0.03, 0.003, 0.0003)  # [rad, sizes] from a dead centre along the path, where cells over that way begin
_PARTS = 6  # of the way to a dead centre


def dead_centre(prover: Prover, found: Cover, limit: Limit, *, is_high: bool) -> tuple[DeadCentre, PathEnd] | str:
    """Return a dead centre and the path to it, with the proof that the branch turns back there; or why there is none.

    Near it the driver is a function of the way x along the direction in which the unknowns move there. Cells over x
    prove the only curve through a window; its second derivative has one sign in all cells, and its first derivative
    changes its sign within the one whose values of the driver are returned. The curve begins at a pose of the proved
    cells.
    """
    found_there: tuple[DeadCentre, PathEnd] | str = ""
    for within in _WINDOWS:
        found_there = _dead_centre(prover, found, limit, within, is_high=is_high)
        if not isinstance(found_there, str):
            break
    return found_there


def _dead_centre(
    prover: Prover, found: Cover, limit: Limit, within: float, *, is_high: bool
) -> tuple[DeadCentre, PathEnd] | str:
    """Return what `dead_centre` does, for cells over the way that begin within a distance."""
    if prover.formulas.varied:
        return "a dead centre, whose place depends on the tolerances"
    if limit.block < 0 or limit.crosses or limit.pole >= 0 or not len(found.cells):
        return "the path ends: not at a dead centre"
    formulas = prover.formulas
    block = formulas.blocks[limit.block]
    own = slice(block.place, block.place + block.size)
    toward = 1.0 if is_high else -1.0
    speeds = np.linalg.norm(found.cells.path[1, own] / prover.unit[own, None], axis=0)
    ways = 2.0 * abs(limit.u[0] - found.cells.u) * speeds
    first, last = found.pieces[-1 if is_high else 0]
    near = first + np.flatnonzero(ways[first : last + 1] < within)
    if not len(near):
        return "a dead centre: cells end before it"
    k = int(near[np.argmax(ways[near])])
    cell = found.cells[k : k + 1]
    unscaled = cell.path[1, own, 0] / prover.unit[own] * toward
    way = float(ways[k])
    if not (unscaled.any() and way > 0.0):
        return "a dead centre: the block does not move before it"
    direction = unscaled / np.linalg.norm(unscaled) / prover.unit[own]
    turned = Prover(formulas.turned(limit.block, direction.tolist(), cell.path[0, own, 0].tolist()))
    solved = [formulas.blocks[number] for number in formulas.behind(limit.block)]
    places = [place for one in solved for place in range(one.place, one.place + one.size)]
    u0, apart = float(cell.u[0]), limit.u[0] - float(cell.u[0])

    def guess(x: FloatArray) -> FloatArray:
        rows = np.repeat(cell.path[0, places], len(x), 1)
        rows[-block.size :] += direction[:, None] * prover.unit[own, None] ** 2 * x
        return np.vstack((u0 + apart * (1.0 - (1.0 - x / way) ** 2), rows))

    top = way
    for _ in range(8):
        at, converged = turned.cells(np.array([top]), np.array([top]), guess(np.array([top])))
        if not converged[0] or at.path[2, 0, 0] == 0.0:
            return "a dead centre: Newton does not converge there"
        top -= float(at.path[1, 0, 0] / at.path[2, 0, 0])
    if not 0.2 * way < top < 5.0 * way:
        return "a dead centre: the path does not turn back where it was expected"
    bend_there = abs(float(at.path[2, 0, 0])) / turned.unit[0]
    small = min(math.sqrt(_ENCLOSED / bend_there), 0.1 * top)
    edges = np.array([*np.linspace(0.0, top - small, _PARTS), *np.linspace(top + small, 2.0 * top, _PARTS)])
    window = cover(turned, edges, guess, 0.01 * small)
    if window.pieces != [(0, len(window.cells) - 1)] or window.cells.low[0] != 0.0:
        return "a dead centre: the path through it is not proved"
    bend = (Intervals(window.cells.path[2, 0]) + window.tubes.accelerations[0]) * -toward
    begins = turned_rate(window, window.cells.low) * toward
    ends = turned_rate(window, window.cells.high) * toward
    inner = int(np.searchsorted(window.cells.low, top, "right")) - 1
    if not ((bend.low > 0.0).all() and begins.low[inner] > 0.0 and ends.high[inner] < 0.0):
        return "a dead centre: its curvature is not proved"
    pose = window.cells.at(Intervals(window.cells.low) - window.cells.u) + window.tubes.narrow
    if not _lies_in(pose[:, :1], found, k, places):
        return "a dead centre: the path to it is not joined to the cells"
    known = {turned.formulas.x, *turned.formulas.unknowns, *turned.formulas.constants}
    rows = [node for node in formulas.redundant.values() if {symbol.name for symbol in symbols([node])} <= known]
    if rows:
        to_it = slice(inner + 1)
        _, is_open, is_unsure = closing(turned, window.cells[to_it], window.tubes[to_it], rows, TOLERANCE)
        if (is_open | is_unsure).any():
            return "a dead centre: redundant rows are not shown to close on the path to it"
    value = window.cells.at(window.cells.s) + window.tubes.narrow
    centre = DeadCentre(float(value.low[0, inner]), float(value.high[0, inner]), is_high)
    return centre, PathEnd(turned, window, inner)


def turned_rate(window: Cover, x: FloatArray) -> Intervals:
    """Return the driver's rate along the way, at one place of each cell."""
    cells = window.cells
    return Intervals(cells.path[1, 0]) + Intervals(cells.path[2, 0]) * (Intervals(x) - cells.u) + window.tubes.rates[0]


def _lies_in(pose: Intervals, found: Cover, k: int, places: Sequence[int]) -> bool:
    """Return whether a driver value with its unknowns lies in the tube of a cell."""
    cell = found.cells[k : k + 1]
    u = pose[0]
    if not (cell.low[0] <= u.low[0] and u.high[0] <= cell.high[0]):
        return False
    off = pose[1:] - cell.at(u - cell.u)[places]
    return bool(off.is_inside(found.tubes[k : k + 1].wide[places]).all())
