"""Cells of a driver's range: a predicted path in each, and the proof that exactly one pose lies in a tube around it.

In a cell, |s| <= h around its centre u, the path is predicted by

    zp(s) = z + z' s + z'' s^2 / 2

and the unknowns are zp(s) + w. With Y close to the inverse of the Jacobian J at the centre, Krawczyk's operator on
a box W of deviations w, 0 among them,

    K(W) = -Y r(zp) + (1 - Y J(zp + W)) W,

lies in the interior of W only if each s of the cell has exactly one w in W with r = 0, and that w lies in K(W)
(Krawczyk, 1969; Neumaier, Interval Methods for Systems of Equations, 1990, section 5.1). r(zp) is enclosed by its
series in s with the remainder of third order over the whole cell, or of second order where a law's curvature jumps.

Of a block with redundant rows Y is near the pseudo-inverse at the centre. The same test is that of Y r = 0, as many
equations as unknowns, which hold in every pose that closes all rows; how far these close is bounded apart.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from kinfmu.analysis.certified.formulas import BlockFormulas, Formulas
from kinfmu.analysis.certified.intervals import (
    Intervals,
    approximate,
    around,
    enclosed,
    interval,
    joined_intervals,
    jumping,
)
from kinfmu.arrays import FloatArray
from kinfmu.plan.equations.graph import Node

WIDEST_TUBE = 0.1  # [rad, sizes]
_CONTRACTION = 0.4  # of a tube by Krawczyk's operator, aimed at
_TRIES = 8  # of narrower tubes
_CONTRACTIONS = 3  # of a proved tube
_NEWTON = 6  # corrections of a predicted pose
_LARGEST_CONTRACTION = 1.0 - 1e-6  # by which rates are bounded
_SLACK = 1.02  # of a tube over what it must hold


@dataclass(frozen=True)
class Cells:
    """Cells with their predicted paths; every array has one place (the last axis) for each cell.

    Attributes:
        low: Lower ends.
        high: Upper ends: neighbours share them to the bit.
        u: The driver about which the path is predicted.
        path: z, z' and z'' at the centres, (3, n, cells).

    """

    low: FloatArray
    high: FloatArray
    u: FloatArray
    path: FloatArray

    def __len__(self) -> int:
        return len(self.u)

    def __getitem__(self, which: Any) -> Cells:
        return Cells(*(getattr(self, field.name)[..., which] for field in fields(self)))

    @classmethod
    def joined(cls, parts: Sequence[Cells]) -> Cells:
        """Return cells of several parts."""
        return cls(*(np.concatenate([getattr(part, field.name) for part in parts], -1) for field in fields(cls)))

    @property
    def s(self) -> Intervals:
        """The driver from the centre."""
        return Intervals((Intervals(self.low) - self.u).low, (Intervals(self.high) - self.u).high)

    def at(self, s: Any) -> Intervals:
        """Return the predicted unknowns at driver values from the centre, (n, cells)."""
        s = interval(s)
        z, rate, acceleration = self.path
        found: Intervals = Intervals(z) + Intervals(rate) * s + Intervals(0.5 * acceleration) * s.square()
        return found


@dataclass(frozen=True)
class Tubes:
    """What is proved of cells; deviations from the predicted path, each (n, cells).

    Attributes:
        is_proved: Where exactly one pose was found.
        wide: Where it is the only one.
        narrow: Where it is.
        rates: Deviations of z' of the poses from that of the predicted path.
        accelerations: The same of z''.
        contraction: The largest row sum of |1 - Y J| on the narrow tube, for each block and cell.
        sign: Of the determinant of J, for each block and cell; 0 of a block with redundant rows.

    """

    is_proved: Any
    wide: Intervals
    narrow: Intervals
    rates: Intervals
    accelerations: Intervals
    contraction: FloatArray
    sign: FloatArray

    def __getitem__(self, which: Any) -> Tubes:
        return Tubes(*(getattr(self, field.name)[..., which] for field in fields(self)))

    @classmethod
    def joined(cls, parts: Sequence[Tubes]) -> Tubes:
        """Return the tubes of several parts."""
        columns: list[Any] = [[getattr(part, field.name) for part in parts] for field in fields(cls)]
        found: list[Any] = [
            joined_intervals(c) if isinstance(c[0], Intervals) else np.concatenate(c, -1) for c in columns
        ]
        return cls(*found)


class Prover:
    """Proves cells of a plan.

    Args:
        formulas: Of the plan.
        box: Intervals of constants, by the names of their symbols. Default: as written.

    """

    def __init__(self, formulas: Formulas, box: Mapping[str, Intervals] | None = None) -> None:
        self.formulas = formulas
        self.box = {name: interval(value) for name, value in formulas.constants.items()} | dict(box or {})
        self.middle = {name: float(value.middle) for name, value in self.box.items()}
        self.unit = np.array(formulas.units)

    # ---- predicted paths, in ordinary arithmetic

    def cells(self, low: FloatArray, high: FloatArray, guess: FloatArray) -> tuple[Cells, Any]:
        """Return cells with Newton's poses near guesses (n, cells), and where Newton converged."""
        u = 0.5 * (low + high)
        z = np.array(guess, dtype=float)
        path = np.zeros((3, *z.shape))
        converged = np.ones(len(u), dtype=bool)
        with np.errstate(all="ignore"):
            for block in self.formulas.blocks:
                own = slice(block.place, block.place + block.size)
                last = np.full(len(u), np.inf)
                for _ in range(_NEWTON):
                    step = -self._solved(block, self._values(u, z), block.rows[0])
                    last = (abs(step) / self.unit[own, None]).max(axis=0)
                    z[own] += step
                    if not (last > 1e-13).any():
                        break
                converged &= last < 1e-9
            path[0] = z
            for order in (1, 2):
                for block in self.formulas.blocks:
                    own = slice(block.place, block.place + block.size)
                    path[order, own] = -self._solved(block, self._values(u, *path), block.rows[order])
        return Cells(low, high, u, path), converged & np.isfinite(path).all(axis=(0, 1))

    def _values(self, u: FloatArray, *path: FloatArray) -> dict[str, FloatArray]:
        values = {self.formulas.x: u} | {name: np.full_like(u, value) for name, value in self.middle.items()}
        for order, numbers in enumerate(path):
            for name, of in zip(self.formulas.unknowns, numbers, strict=True):
                values[self.formulas.names[name][order - 1] if order else name] = of
        return values

    def _solved(self, block: BlockFormulas, values: Mapping[str, FloatArray], rows: tuple[Node, ...]) -> FloatArray:
        """Return J^-1 rows, (n, cells)."""
        shape = values[self.formulas.x].shape
        found = np.array(approximate([*rows, *block.jacobian], values, shape))
        inverse = _inverse(found[len(rows) :], block)
        return np.asarray(np.einsum("cij,jc->ic", inverse, found[: len(rows)]))

    # ---- proofs

    def prove(self, cells: Cells, radii: FloatArray | None = None) -> Tubes:
        """Return the tubes of cells, block after block.

        Args:
            cells: The cells.
            radii: Of the wide tubes, for each block and cell [rad, sizes]. Default: as wide as possible.

        """
        n, count = len(self.formulas.unknowns), len(cells)
        wide, narrow, rates, accelerations = (Intervals(np.zeros((n, count)), np.zeros((n, count))) for _ in range(4))
        motion = (narrow, rates, accelerations)
        proved = np.ones(count, dtype=bool)
        contractions, signs = [], []
        with np.errstate(all="ignore"):
            thin, broad, plain = self.enclosures(cells)
            for number, block in enumerate(self.formulas.blocks):
                own = slice(block.place, block.place + block.size)
                y = _inverse(np.array(approximate(block.jacobian, plain, (count,))), block)
                moved = _times(y, self._rest(cells, block, thin, broad, narrow))
                given = None if radii is None else radii[number]
                found = self._tube(cells, block, broad, narrow, y, moved, given)
                proved &= found[0]
                for tube, part in ((wide, found[1]), (narrow, found[2])):
                    tube.low[own], tube.high[own] = part.low, part.high
                contractions.append(found[3])
                signs.append(np.zeros(count) if block.is_tall else np.sign(np.linalg.det(y)))
                for order in (1, 2):
                    rest = self._rest_of_rates(cells, block, thin, broad, motion, order)
                    part = _within(_times(y, rest), found[3], self.unit[own, None])
                    motion[order].low[own], motion[order].high[own] = part.low, part.high
        shape = (len(contractions), count)
        return Tubes(
            proved, wide, narrow, rates, accelerations, np.reshape(contractions, shape), np.reshape(signs, shape)
        )

    def most_along(self, cells: Cells) -> float:
        """Return a bound of all residuals along predicted paths, relative to the size."""
        found, blocks = 0.0, (block for block in self.formulas.plan.blocks if block.unknowns)
        still = Intervals(*np.zeros((2, len(self.formulas.unknowns), len(cells))))
        with np.errstate(all="ignore"):
            thin, broad, _ = self.enclosures(cells)
            for block, formulas in zip(blocks, self.formulas.blocks, strict=True):
                rows = self._rest(cells, formulas, thin, broad, still)
                for row, scale in zip(rows, block.row_scales, strict=True):
                    found = max(found, float(row.magnitude.max()) / scale)
            shape, s = (len(cells),), cells.s
            for position, rate, acceleration in self.formulas.along([*self.formulas.redundant.values()], 2):
                start = enclosed([position, rate], thin, shape)
                bend = enclosed([acceleration], broad, shape)[0]
                found = max(found, float((start[0] + start[1] * s + bend * (s.square() * 0.5)).magnitude.max()))
        return found

    def closer(self, cells: Cells, tubes: Tubes, s: Intervals) -> Tubes:
        """Return the tubes with closer enclosures of rates and accelerations at driver values s from the centres."""
        count, n = len(cells), len(self.formulas.unknowns)
        plain = self.enclosures(cells)[2]
        symbols = self.over(cells, s)
        motion = [tubes.narrow, *(Intervals(np.zeros((n, count)), np.zeros((n, count))) for _ in range(2))]
        for number, block in enumerate(self.formulas.blocks):
            own = slice(block.place, block.place + block.size)
            y = _inverse(np.array(approximate(block.jacobian, plain, (count,))), block)
            for order in (1, 2):
                tube = self._moving_at(symbols, motion, block, order)
                rest = enclosed(block.rows[order], tube, (count,))
                part = _within(_times(y, rest), tubes.contraction[number], self.unit[own, None])
                part = part.intersection((tubes.rates, tubes.accelerations)[order - 1][own])
                motion[order].low[own], motion[order].high[own] = part.low, part.high
        return replace(tubes, rates=motion[1], accelerations=motion[2])

    def _moving_at(
        self, symbols: Mapping[str, Intervals], motion: Sequence[Intervals], block: BlockFormulas, order: int
    ) -> dict[str, Intervals]:
        """Return the symbols of a block's rows of an order, its own derivative of this order as predicted."""
        until = block.place + block.size
        narrow, rates, accelerations = motion
        tube = self._tubes_at(symbols, narrow, until)
        for number, name in enumerate(self.formulas.unknowns[:until]):
            rate, acceleration = self.formulas.names[name]
            if order == 2 or number < block.place:
                tube[rate] = symbols[rate] + rates[number]
            if number < block.place:
                tube[acceleration] = symbols[acceleration] + accelerations[number]
        return tube

    def _rest_of_rates(
        self,
        cells: Cells,
        block: BlockFormulas,
        thin: Mapping[str, Intervals],
        broad: Mapping[str, Intervals],
        motion: Sequence[Intervals],
        order: int,
    ) -> list[Intervals]:
        """Return what the rates (order 1) or accelerations (2) of the predicted path leave of the rows' derivatives.

        The derivative of order n of r(z(x)) is 0, and linear in that of z: J w_n = -rest, w_n its deviation.
        """
        shape, s, k = (len(cells),), cells.s, len(block.rows[0])
        if order == 2:
            return enclosed(block.rows[2], self._moving_at(broad, motion, block, 2), shape)
        narrow, rates, _ = motion
        tube = self._tubes_at(broad, narrow, block.place + block.size)
        flat = enclosed([*block.rows[1], *block.rows[2]], thin, shape)
        last = enclosed([*block.rows[2], *block.rows[3]], broad, shape)
        half = s.square() * 0.5
        rest = [(flat[i] + last[i] * s).intersection(flat[i] + flat[k + i] * s + last[k + i] * half) for i in range(k)]
        slopes: list[tuple[Mapping[Any, tuple[Node, ...]], Intervals]] = [(block.earlier, rates), (block.rates, narrow)]
        for gradients, deviations in slopes:
            for place, nodes in gradients.items():
                off = deviations[place] if isinstance(place, int) else broad[place] - self.middle[place]
                if off.magnitude.any():
                    for i, slope in enumerate(enclosed(nodes, tube, shape)):
                        rest[i] = rest[i] + slope * off
        return rest

    def enclosures(self, cells: Cells) -> tuple[dict[str, Intervals], dict[str, Intervals], dict[str, FloatArray]]:
        """Return the symbols on the predicted path: at the centres, over the cells, and at the centres as numbers."""
        plain = self._values(cells.u, *cells.path)
        return {name: Intervals(value) for name, value in plain.items()}, self.over(cells, cells.s), plain

    def over(self, cells: Cells, s: Intervals) -> dict[str, Intervals]:
        """Return the symbols on the predicted path at driver values s from the centres, and the box of constants."""
        symbols = {self.formulas.x: Intervals(cells.u) + s}
        predicted = cells.at(s)
        for k, name in enumerate(self.formulas.unknowns):
            rate, acceleration = cells.path[1:, k]
            symbols[name] = predicted[k]
            names = self.formulas.names[name]
            symbols[names[0]] = Intervals(rate) + Intervals(acceleration) * s
            symbols[names[1]] = Intervals(acceleration)
        count = len(cells)
        return symbols | {
            name: Intervals(np.full(count, value.low), np.full(count, value.high)) for name, value in self.box.items()
        }

    def deviated(self, symbols: Mapping[str, Intervals], tubes: Tubes) -> dict[str, Intervals]:
        """Return symbols on the predicted path moved by all deviations: those of the poses."""
        found = dict(symbols)
        for k, name in enumerate(self.formulas.unknowns):
            for symbol, deviations in zip(
                (name, *self.formulas.names[name]), (tubes.narrow, tubes.rates, tubes.accelerations), strict=True
            ):
                found[symbol] = symbols[symbol] + deviations[k]
        return found

    def _rest(
        self,
        cells: Cells,
        block: BlockFormulas,
        thin: Mapping[str, Intervals],
        broad: Mapping[str, Intervals],
        narrow: Intervals,
    ) -> list[Intervals]:
        """Return the residuals of a block along the predicted path, with what earlier blocks and parameters may add."""
        shape, s = (len(cells),), cells.s
        squared = s.square() * 0.5
        cubed = s * squared * (1.0 / 3.0)
        cubed = cubed.hull(-cubed)
        k = len(block.rows[0])
        flat = enclosed([node for row in block.rows[:3] for node in row], thin, shape)
        last = enclosed([*block.rows[2], *block.rows[3]], broad, shape)
        rest = []
        for i in range(k):
            start = flat[i] + flat[k + i] * s
            rest.append(
                (start + last[i] * squared).intersection(start + flat[2 * k + i] * squared + last[k + i] * cubed)
            )
        tube = self._tubes_at(broad, narrow, block.place)
        for place, nodes in block.earlier.items():
            for i, slope in enumerate(enclosed(nodes, tube, shape)):
                rest[i] = rest[i] + slope * narrow[place]
        for name, nodes in block.parameters.items():
            off = broad[name] - self.middle[name]
            if off.magnitude.any():
                for i, slope in enumerate(enclosed(nodes, tube, shape)):
                    rest[i] = rest[i] + slope * off
        return rest

    def _tubes_at(self, broad: Mapping[str, Intervals], deviations: Intervals, until: int) -> dict[str, Intervals]:
        """Return the symbols over cells with deviations of the unknowns before a place."""
        names = self.formulas.unknowns[:until]
        return {**broad, **{name: broad[name] + deviations[k] for k, name in enumerate(names)}}

    def _tube(
        self,
        cells: Cells,
        block: BlockFormulas,
        broad: Mapping[str, Intervals],
        narrow: Intervals,
        y: FloatArray,
        moved: list[Intervals],
        given: FloatArray | None,
    ) -> tuple[Any, Intervals, Intervals, FloatArray]:
        """Return where a block is proved, its wide and narrow tubes, and its contraction; given: radii to prove."""
        count = len(cells)
        unit = self.unit[block.place : block.place + block.size, None]
        needed = np.max([part.magnitude / of for part, of in zip(moved, unit, strict=True)], axis=0) * _SLACK
        radius = np.where(np.isfinite(needed), np.maximum(WIDEST_TUBE, 1.5 * needed), WIDEST_TUBE)
        radius = radius if given is None else given.copy()
        proved = np.zeros(count, dtype=bool)
        shape = (block.size, count)
        wide, narrow_own = Intervals(np.zeros(shape), np.zeros(shape)), Intervals(np.zeros(shape), np.zeros(shape))
        contraction = np.full(count, np.inf)
        todo = np.flatnonzero(np.isfinite(needed) & np.isfinite(y).all(axis=(1, 2)))
        for _ in range(_TRIES if given is None else 1):
            if not len(todo):
                break
            w = around(np.zeros((block.size, len(todo))), radius[todo] * unit)
            image, off = self._image(block, broad, narrow, y, moved, w, todo)
            jumps = self._jumping(block, broad, narrow, w, todo)
            inside = image.is_inside(w).all(axis=0) & ~jumps
            done = todo[inside]
            proved[done] = True
            wide.low[:, done], wide.high[:, done] = w.low[:, inside], w.high[:, inside]
            least = image[:, inside]
            short = around(np.zeros_like(least.low), 2.0 * np.array([part.magnitude[done] for part in moved]) + 1e-300)
            again, _ = self._image(block, broad, narrow, y, moved, short, done)
            holds = (again.is_inside(short) & short.is_inside(w[:, inside])).all(axis=0)  # the only pose lies in it
            least = _with_zero(
                Intervals(np.where(holds, again.low, least.low), np.where(holds, again.high, least.high))
            )
            for _ in range(_CONTRACTIONS):
                again, contraction[done] = self._image(block, broad, narrow, y, moved, least, done)
                least = _with_zero(least.intersection(again))
            narrow_own.low[:, done], narrow_own.high[:, done] = least.low, least.high
            shrink = np.minimum(_CONTRACTION / np.maximum(off[~inside], 1e-300), np.where(jumps[~inside], 0.03, 0.5))
            todo = todo[~inside]
            radius[todo] = np.where(np.isfinite(shrink), radius[todo] * shrink, radius[todo] * 0.1)
            todo = todo[(radius[todo] > needed[todo]) & (radius[todo] > 1e-15)]
        return proved, wide, narrow_own, contraction

    def _jumping(
        self, block: BlockFormulas, broad: Mapping[str, Intervals], narrow: Intervals, w: Intervals, which: Any
    ) -> Any:
        """Return where a law or an angle in the rows may jump within the tubes of some cells."""
        values = {name: value[which] for name, value in self._tubes_at(broad, narrow, block.place).items()}
        for k, name in enumerate(block.names):
            values[name] = values[name] + w[k]
        return jumping(block.rows[0], values, (len(which),))

    def _image(
        self,
        block: BlockFormulas,
        broad: Mapping[str, Intervals],
        narrow: Intervals,
        y: FloatArray,
        moved: list[Intervals],
        w: Intervals,
        which: Any,
    ) -> tuple[Intervals, FloatArray]:
        """Return K(W) for some cells, and the largest row sum of |1 - Y J|, lengths in sizes."""
        values = {name: value[which] for name, value in self._tubes_at(broad, narrow, block.place).items()}
        for k, name in enumerate(block.names):
            values[name] = values[name] + w[k]
        entries = enclosed(block.jacobian, values, (len(which),))
        unit = self.unit[block.place : block.place + block.size]
        off = np.zeros(len(which))
        rows = []
        for i in range(block.size):
            row = -moved[i][which]
            total = np.zeros(len(which))
            for j in range(block.size):
                product = interval(1.0 if i == j else 0.0)
                for k in range(len(block.rows[0])):
                    product = product - Intervals(y[which, i, k]) * entries[k * block.size + j]
                row = row + product * w[j]
                total = total + product.magnitude * (unit[j] / unit[i])
            off = np.maximum(off, total)
            rows.append(row)
        return Intervals(np.array([row.low for row in rows]), np.array([row.high for row in rows])), off


def _inverse(entries: FloatArray, block: BlockFormulas) -> FloatArray:
    """Return approximate inverses of Jacobians given by their entries, (cells, n, rows); if tall, pseudo-inverses."""
    matrices = np.moveaxis(entries.reshape(len(block.rows[0]), block.size, -1), -1, 0)
    finite = np.isfinite(matrices).all(axis=(1, 2), keepdims=True)
    if not block.is_tall:
        with suppress(np.linalg.LinAlgError):  # one of them is singular to the bit
            return np.asarray(np.linalg.inv(np.where(finite, matrices, np.nan)))
    return np.where(finite, np.linalg.pinv(np.where(finite, matrices, 0.0)), np.nan)


def _with_zero(w: Intervals) -> Intervals:
    """Return deviations with 0 among them: slopes between the predicted path and a pose are those of all between."""
    return Intervals(np.minimum(w.low, 0.0), np.maximum(w.high, 0.0))


def _within(image: list[Intervals], contraction: FloatArray, unit: FloatArray) -> Intervals:
    """Return the solutions w of (Y J) w = -image, if |1 - Y J| <= contraction < 1 in units of the unknowns."""
    largest = np.max([part.magnitude / of for part, of in zip(image, unit, strict=True)], axis=0)
    contracts = contraction < _LARGEST_CONTRACTION
    largest, contraction = np.where(contracts, largest, np.inf), np.where(contracts, contraction, 0.5)
    solution = Intervals(largest) / (interval(1.0) - Intervals(contraction))
    spread = (solution * Intervals(contraction)).magnitude * _SLACK * unit
    within = [-part + around(np.zeros_like(of), of) for part, of in zip(image, spread, strict=True)]
    return Intervals(np.array([part.low for part in within]), np.array([part.high for part in within]))


def _times(y: FloatArray, rows: list[Intervals]) -> list[Intervals]:
    """Return Y times a column of intervals."""
    found = []
    for i in range(y.shape[1]):
        total = interval(0.0)
        for j, row in enumerate(rows):
            total = total + Intervals(y[:, i, j]) * row
        found.append(total)
    return found
