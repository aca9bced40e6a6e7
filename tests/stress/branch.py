"""The branch that a drawn mechanism is on: how far it goes, and the turns of its angles, by a fine walk of the oracle.

Everything here is in long doubles and from the closed forms alone. A mechanism with one driver has an interval of
driver values around its start, ended by limits or by none; one with several is walked along the straight ways between
its samples.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.stress.drawn import TURN, Drawn
from tests.stress.jets import LONG, Array

INSIDE, OUTSIDE, EDGE = 0, 1, 2  # of the range; EDGE: so close to its end that either is right

FINE = 1440  # places to the period of an angle, or to the reach of a length
SHORT = 0.02  # [rad, lengths]; between places of a way of several drivers
COARSE = 600  # places of a stretch that does not go round
DEPTHS = np.concatenate([[0.0], 10.0 ** np.arange(-13.0, -1.0, 0.2)])  # from a mark, near which values change quickly
CLOSE = 10.0 ** np.arange(-13.0, -2.0, 0.5)  # the same, of several drivers
DIP = 0.05  # what must stay positive is looked at closely where it falls below
CLEAR = 1e-3  # nothing asks how much is left above
FLAT = 1.001  # places that differ by less have nothing between them
LIMIT = 1e-10  # [rad, sizes]; limits are promised to this
REGULAR = 0.02  # magnitudes are taken where what must stay positive is above
STILL = 1e-3  # of the largest of its kind: below, a column hardly moves
PASSES, PIECES = 14, 32
FAR, FAR_PLACES = 4.0, 400  # [rad, lengths] that limits of several drivers are looked for in

Floats = NDArray[np.float64]


class Expected(NamedTuple):
    """What is right for n samples: the side of the limits, angles by name to a turn, the tightest place passed."""

    side: NDArray[np.int64]
    angles: Mapping[str, Floats]
    tightest: Floats


class Magnitudes(NamedTuple):
    """Largest magnitude of each column: positions, rates at driver speed 1, second derivatives."""

    q: Mapping[str, float]
    qd: Mapping[str, float]
    qdd: Mapping[str, float]


def _each(limits: list[Array], count: int) -> Any:
    """What must stay positive, (limits, count); -1 where there is no number."""
    if not limits:
        return np.ones((1, count), dtype=np.longdouble)
    table = np.array([np.broadcast_to(values, count) for values in limits])
    return np.where(np.isnan(table), np.longdouble(-1.0), table)


def _lowest(limits: list[Array], count: int) -> Any:
    """What is least of what must stay positive; -1 where there is no number."""
    if not limits:
        return np.ones(count, dtype=np.longdouble)
    least = np.minimum.reduce(limits)
    return np.where(np.isnan(least), np.longdouble(-1.0), least)


def _magnitudes(
    drawn: Drawn, columns: Mapping[str, Any], angles: Mapping[str, Floats], regular: NDArray[np.bool_]
) -> Magnitudes:
    """Of columns; one that hardly moves counts with the largest of its kind, a kind with at least the driver's own."""
    scale = float(drawn.frame.scale)
    per = 1.0 if "angle" in drawn.sketch.kinds else scale
    tables: list[dict[str, float]] = []
    for order in range(3):
        found = {}
        for name, column in columns.items():
            values = angles[name] if order == 0 and name in angles else (column.d0, column.d1, column.d2)[order]
            found[name] = float(np.abs(np.asarray(values, dtype=float)[regular]).max(initial=0.0))
        for is_angle in (True, False):
            kind = [name for name in found if name.endswith(".phi") == is_angle]
            natural = (1.0 if is_angle else scale) / per**order
            largest = max([natural, *(table[name] for table in [*tables[1:], found] for name in kind)])
            for name in kind:
                found[name] = largest if found[name] < STILL * largest else found[name]
        tables.append(found)
    return Magnitudes(*tables)


@dataclass
class Interval:
    """The range of a single driver: low and high, each a limit or merely as far as was looked."""

    drawn: Drawn
    low: float
    high: float
    low_is_limit: bool
    high_is_limit: bool
    places: Floats  # rising, over one period or over the range
    lowest: Floats  # at the places, the least of what must stay positive
    angles: Mapping[str, Floats]
    gained: Mapping[str, int]  # turns to a period
    magnitudes: Magnitudes
    marks: list[float]  # where it is singular or nearly so, inside

    @property
    def is_free(self) -> bool:
        """True for an angle that goes round."""
        sketch = self.drawn.sketch
        return not (self.low_is_limit or self.high_is_limit) and sketch.kinds == ("angle",) and sketch.period > 0

    def expected(self, u: Floats, good: NDArray[np.bool_]) -> Expected:  # noqa: ARG002  BranchPath needs it
        """For samples (n, 1); which of them are good makes no difference here."""
        x = u[:, 0]
        start, period = self.drawn.start[0], TURN * self.drawn.sketch.period
        side = np.full(len(x), INSIDE)
        if self.is_free:
            turns = np.floor((x - start) / period)
            place = x - turns * period
            tightest = np.full(len(x), self.lowest.min())
        else:
            turns = np.zeros(len(x))
            place = np.clip(x, self.low, self.high)
            unit = 1.0 if self.drawn.sketch.kinds == ("angle",) else float(self.drawn.frame.scale)
            side[(x > self.high) | (x < self.low)] = OUTSIDE
            ends = [end for end, limits in ((self.low, self.low_is_limit), (self.high, self.high_is_limit)) if limits]
            for end in ends:
                side[np.abs(x - end) <= LIMIT * unit] = EDGE
            tightest = self._tightest(place)
        angles = {
            name: np.interp(place, self.places, values) + TURN * self.gained[name] * turns
            for name, values in self.angles.items()
        }
        return Expected(side, angles, tightest)

    def _tightest(self, place: Floats) -> Floats:
        """The least on the way from the start to each place, which itself is left out if a limit is near."""
        middle = int(np.searchsorted(self.places, self.drawn.start[0]))
        outward = np.concatenate(
            [np.minimum.accumulate(self.lowest[:middle][::-1])[::-1], np.minimum.accumulate(self.lowest[middle:])]
        )
        inner = np.searchsorted(self.places, place) - (place > self.drawn.start[0])
        return outward[np.clip(inner, 0, len(outward) - 1)]


def interval(drawn: Drawn) -> Interval:
    """The range of a mechanism with one driver, or ValueError if the start is none."""
    sketch, start = drawn.sketch, drawn.start[0]
    is_angle = sketch.kinds == ("angle",)
    scale = 1.0 if is_angle else float(drawn.frame.scale)
    if is_angle and not sketch.period:
        ends = sketch.reach[0] + drawn.frame.angle, sketch.reach[1] + drawn.frame.angle
        marks = list(sketch.marks)
    elif is_angle:
        period = TURN * sketch.period
        ends = start - period, start + period
        marks = _marks(drawn, *ends)
    else:
        ends = sketch.reach[0] * scale, sketch.reach[1] * scale
        marks = [mark * scale for mark in sketch.marks]
    near = [mark + side * depth * scale for mark in marks for depth in DEPTHS for side in (1, -1)]
    count = 2 * FINE + 1 if sketch.period else COARSE
    u = np.unique(np.concatenate([np.linspace(*ends, count), near, [start]]))
    u = u[(u >= ends[0]) & (u <= ends[1])]
    with np.errstate(all="ignore"):
        exact = drawn.positions(u[:, None])
        lowest = _lowest(exact.closing.limits, len(u))
        middle = int(np.searchsorted(u, start))
        if lowest[middle] <= 0.0:
            raise ValueError("the start does not close")
        lowest, dips = _with_dips(drawn, u, lowest)
        after = _first_bad(lowest[middle:])
        before = _first_bad(lowest[middle::-1])
        high = u[-1] if after is None else _end(drawn, u[middle + after - 1], u[middle + after], dips)
        low = u[0] if before is None else _end(drawn, u[middle - before + 1], u[middle - before], dips)
    is_free = is_angle and sketch.period > 0 and after is None and before is None
    inside = (u >= (start if is_free else low)) & (u <= high)
    u, lowest = u[inside], np.asarray(lowest[inside], dtype=float)
    columns = {name: _taken(column, inside) for name, column in exact.columns.items()}
    angles, gained = {}, {}
    at = int(np.searchsorted(u, start))
    for name, column in columns.items():
        if name.endswith(".phi"):
            values = np.asarray(column.d0, dtype=float)
            right, left = np.unwrap(values[at:]), np.unwrap(values[: at + 1][::-1])[::-1]
            angles[name] = np.concatenate([left[:-1], right])
            gained[name] = round(float(right[-1] - right[0]) / TURN) if is_free else 0
    regular = lowest > min(REGULAR, 0.5 * lowest.max())
    return Interval(
        drawn,
        float(low),
        float(high),
        before is not None,
        after is not None,
        u,
        lowest,
        angles,
        gained,
        _magnitudes(drawn, columns, angles, regular),
        [mark for mark in marks if low < mark < high],
    )


def _taken(column: Any, which: NDArray[np.bool_]) -> Any:
    d0, d1, d2 = (np.broadcast_to(part, which.shape)[which] for part in (column.d0, column.d1, column.d2))
    return type(column)(column.numbers, d0, d1, d2)


def _marks(drawn: Drawn, low: float, high: float) -> list[float]:
    """Driver angles where arms are stretched, as the nearest doubles."""
    theta = LONG.angle(drawn.frame.direction)
    whole = range(-drawn.sketch.period - 3, drawn.sketch.period + 4)
    found = [float(theta + LONG.pi * (mark / np.pi) + 2 * LONG.pi * k) for mark in drawn.sketch.marks for k in whole]
    return sorted({mark for mark in found if low <= mark <= high})


def _first_bad(values: Any) -> int | None:
    bad = np.flatnonzero(values <= 0.0)
    return int(bad[0]) if len(bad) else None


def _limits_at(drawn: Drawn, u: Any) -> Any:
    return _lowest(drawn.positions(u[:, None]).closing.limits, len(u))


def _with_dips(drawn: Drawn, u: Floats, lowest: Any) -> tuple[Any, dict[float, float]]:
    """The lowest, where it dips between places replaced by what it dips to; and by place where that is."""
    lowest = lowest.copy()
    dips: dict[float, float] = {}
    for k in range(1, len(u) - 1):
        neighbours = lowest[k - 1], lowest[k + 1]
        if 0.0 < lowest[k] < DIP and lowest[k] <= min(neighbours) and max(neighbours) > FLAT * lowest[k]:
            left, right = np.longdouble(u[k - 1]), np.longdouble(u[k + 1])
            for _ in range(PASSES):
                between = left + (right - left) * np.arange(PIECES + 1) / PIECES
                values = _limits_at(drawn, between)
                best = int(np.argmin(values))
                if values[best] < lowest[k]:
                    lowest[k], dips[u[k]] = values[best], float(between[best])
                left, right = between[max(best - 1, 0)], between[min(best + 1, PIECES)]
                if right - left < 1e-14 * abs(u[k]) + 1e-300:
                    break
    return lowest, dips


def _end(drawn: Drawn, good: float, bad: float, dips: Mapping[float, float]) -> Any:
    """The limit between two places."""
    left, right = np.longdouble(good), np.longdouble(dips.get(bad, bad))
    for _ in range(PASSES):
        between = left + (right - left) * np.arange(PIECES + 1) / PIECES
        values = _limits_at(drawn, between)
        values[-1] = -1.0
        first = _first_bad(values) or 1
        left, right = between[first - 1], between[first]
    return left


# ----------------------------------------------------------------------------------------------- several drivers


@dataclass
class BranchPath:
    """A mechanism with several drivers, followed along straight lines of driver values."""

    drawn: Drawn
    magnitudes: Magnitudes
    marks: tuple[float, ...] = ()  # of each driver that is an angle

    def expected(self, u: Floats, good: NDArray[np.bool_]) -> Expected:
        """For samples (n, d): each way begins at the last one before that was reached; good: where kinfmu has numbers.

        Samples that kinfmu calls unreachable are judged elsewhere; the next way does not begin there.
        """
        here = np.array(self.drawn.start)
        names = [name for name in self.drawn.places(here[None]).columns if name.endswith(".phi")]
        now = {name: self.drawn.starts[name] for name in names}
        side, tightest = np.full(len(u), INSIDE), np.empty(len(u))
        angles = {name: np.empty(len(u)) for name in names}
        units = np.array(
            [1.0 if kind == "angle" else float(self.drawn.frame.scale) for kind in self.drawn.sketch.kinds]
        )
        with np.errstate(all="ignore"):
            for k, target in enumerate(u):
                count = 2 + int(np.abs((target - here) / units).max() / SHORT)
                parts = self._places(here, target, count)
                exact = self.drawn.places(here + (target - here) * parts[:, None])
                lowest = self._least(here, target, parts, _each(exact.closing.limits, len(parts)))
                tightest[k] = lowest
                if lowest < -LIMIT or np.isnan(lowest):
                    side[k] = OUTSIDE
                elif lowest < LIMIT:
                    side[k] = EDGE
                for name in names:
                    values = np.asarray(exact.columns[name].d0, dtype=float)
                    angles[name][k] = np.unwrap(np.concatenate([[now[name]], values]))[-1]
                if side[k] != OUTSIDE and good[k]:
                    here = target
                    now = {name: angles[name][k] for name in names}
        return Expected(side, angles, tightest)

    def limit(self, here: Floats, direction: Floats) -> float | None:
        """How far a straight way goes before the first limit, in steps of `direction`; None if it goes far."""
        part = np.linspace(0.0, FAR, FAR_PLACES)
        with np.errstate(all="ignore"):
            for _ in range(PASSES):
                values = _lowest(self.drawn.closing(here + direction * part[:, None]).limits, len(part))
                bad = _first_bad(values)
                if bad is None or bad == 0:
                    return None
                part = np.linspace(part[bad - 1], part[bad], PIECES)
        return float(part[0])

    def _places(self, here: Floats, target: Floats, count: int) -> Any:
        """Parts of a way to look at: equal ones, and close to marks of a driver, where angles change quickly."""
        found = [np.linspace(np.longdouble(0.0), np.longdouble(1.0), count + 1)]
        for a, b, kind in zip(here, target, self.drawn.sketch.kinds, strict=True):
            if kind == "angle" and a != b:
                near = [mark + side * CLOSE for mark in self.marks for side in (1, -1)]
                found += [(np.asarray(places, dtype=np.longdouble) - a) / (np.longdouble(b) - a) for places in near]
        parts = np.unique(np.concatenate(found))
        return parts[(parts >= 0.0) & (parts <= 1.0)]

    def _least(self, here: Floats, target: Floats, parts: Any, limits: Any) -> float:
        """The least on the way: each of what must stay positive is looked at closely where it dips."""
        least, last = float(limits.min()), len(parts) - 1
        if least <= 0.0:
            return least
        for number, values in enumerate(limits):
            padded = np.pad(values, 1, constant_values=np.inf)
            for k in np.flatnonzero((values < DIP) & (values <= padded[:-2]) & (values <= padded[2:])):
                left, right = parts[max(k - 1, 0)], parts[min(k + 1, last)]
                for _ in range(PASSES):
                    part = left + (right - left) * np.arange(PIECES + 1) / PIECES
                    closing = self.drawn.closing(here + (target - here) * part[:, None])
                    found = _each(closing.limits, len(part))[number]
                    best = int(np.argmin(found))
                    least = min(least, float(found[best]))
                    if 0 < best < PIECES and 2 * found[best] - max(found[best - 1], found[best + 1]) > CLEAR:
                        break  # convex there, so it falls by less than it rises to its neighbours
                    left, right = part[max(best - 1, 0)], part[min(best + 1, PIECES)]
        return least


def branch_path(drawn: Drawn) -> BranchPath:
    """Return the path of a mechanism with several drivers, with magnitudes from 500 places."""
    places = np.random.default_rng(1).uniform(0.0, 1.0, (500, len(drawn.start)))
    units = [1.0 if kind == "angle" else float(drawn.frame.scale) for kind in drawn.sketch.kinds]
    low, high = (bound * np.array(units) for bound in drawn.sketch.reach)
    u = low + (high - low) * places
    with np.errstate(all="ignore"):
        zero, one = np.zeros_like(u), np.ones_like(u)
        exact = [drawn.exactly(LONG, u, ud, zero) for ud in (one, one * np.array([1.0, -1.0]))]
    regular = np.asarray(_lowest(exact[0].closing.limits, len(u)) > REGULAR)
    found = []
    for one_way in exact:
        angles = {name: np.asarray(c.d0, dtype=float) for name, c in one_way.columns.items() if name.endswith(".phi")}
        found.append(_magnitudes(drawn, one_way.columns, angles, regular))
    magnitudes = Magnitudes(
        *({name: max(table[name], other[name]) for name in table} for table, other in zip(*found, strict=True))
    )
    return BranchPath(drawn, magnitudes, tuple(_marks(drawn, -TURN, 2.0 * TURN)) if drawn.sketch.marks else ())


def branch_of(drawn: Drawn) -> Interval | BranchPath:
    """Return the branch of a drawn mechanism."""
    return interval(drawn) if len(drawn.start) == 1 else branch_path(drawn)
