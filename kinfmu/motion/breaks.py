"""Breaks of laws, where pieces join whose derivatives differ: along a run, and in a motion, which is split there.

A polynomial across a break follows neither side. So the limits at a break are those of polynomials through samples of
one side, and nothing else is computed across it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray, IntArray
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.joints import CamRoller
from kinfmu.mechanism.joints.joint import Joint
from kinfmu.mechanism.laws import External, Law
from kinfmu.mechanism.laws.law import Constant, Jumps
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.motion.history import History
from kinfmu.plan.equations.system import placement
from kinfmu.plan.equations.taylor import Taylor
from kinfmu.run import Run
from kinfmu.run.axis import TIME

AT_SAMPLE = 1e-6  # of the step between samples; a break that is nearer to a sample is at it


class FollowedLaw(NamedTuple):
    """A law with its argument over a run: the joint that follows it, or None for a driver over time."""

    law: Law
    argument: FloatArray  # (n,), continuous
    joint: Joint | None


class LawBreak(NamedTuple):
    """A break of a law within a run.

    place: where, in samples: 2.25 is after the third sample; number: of the law; level: the value of its argument.
    """

    place: float
    number: int
    level: float


def followed_laws(run: Run, mechanism: Mechanism) -> list[FollowedLaw]:
    """Return the laws of joints, and in runs over time those of drivers; the run must hold all coordinates."""
    columns = [np.asarray(run[name], dtype=float) for name in mechanism.coordinate_names]
    at = placement(mechanism, columns)
    found: list[FollowedLaw] = []
    for joint in mechanism.joints:
        follower = joint.led_by(at)
        if follower is not None:
            law, argument = follower[0], np.broadcast_to(np.asarray(follower[1], dtype=float), (len(run),))
            found.append(FollowedLaw(law, np.unwrap(argument) if isinstance(joint, CamRoller) else argument, joint))
    if run.axis == TIME:
        found += [FollowedLaw(one.law, run.t, None) for one in mechanism.drivers if not isinstance(one.law, External)]
    return found


def breaks_of(laws: list[FollowedLaw], order: int) -> list[LawBreak]:
    """Return where a law's value or a derivative up to an order jumps; places are those of a straight argument."""
    found: list[LawBreak] = []
    for number, (law, argument, _) in enumerate(laws):
        jumps = law.own_breaks(order)
        period = float(jumps.period)
        for at in map(float, jumps.at):
            along = (argument - at) / (period or 1.0)
            piece = np.floor(along) if period else np.where(along >= 0.0, 0.0, -1.0)
            known = np.isfinite(along[:-1]) & np.isfinite(along[1:])
            for k in np.flatnonzero(known & (np.diff(piece) != 0.0)).tolist():
                low, high = sorted((int(piece[k]), int(piece[k + 1])))
                for turn in range(low + 1, high + 1):
                    place = k + (turn - along[k]) / (along[k + 1] - along[k])
                    found.append(LawBreak(float(place), number, at + turn * period))
    return found


def bracket(place: float, side: int) -> tuple[int, int]:
    """Return the two samples between which a side of a place is: -1 before it, 1 after it."""
    nearest = round(place)
    if abs(place - nearest) < AT_SAMPLE:
        return (nearest - 1, nearest) if side < 0 else (nearest, nearest + 1)
    return math.floor(place), math.floor(place) + 1


@dataclass(frozen=True, eq=False)
class OneSided(Law):
    """A law at arguments that are Taylor numbers, with the limits of its derivatives at breaks.

    law: the law; side: (n,) -1 where the limit is that from below, 1 from above.
    """

    type: ClassVar[str] = "one_sided"

    law: Law
    side: FloatArray

    def constants(self) -> dict[str, Constant]:
        return self.law.constants()

    def target(self, x: Value, **constants: Value) -> Value:
        found = self.law.target(Taylor(x.c, self.side) if isinstance(x, Taylor) else x, **constants)
        return Taylor(found.c) if isinstance(found, Taylor) else found


ORDER = 5  # derivatives up to this one count: those of the polynomials between samples
_SAME = 1e-6  # of the distance of samples; a break that is closer to a sample is at it
_LEAST = 2  # samples of one side; with fewer a break is not split
_HERMITE, _PLAIN = 3, 8  # samples of one side: with rates and accelerations, and without
_ORDERS = 3  # value, rate and acceleration


class Break(NamedTuple):
    """A place x at which a derivative of a law jumps; is_jump: already the value, first or second derivative."""

    x: float
    is_jump: bool


class _Limit(NamedTuple):
    """A sample of one side of a break: its number in the new samples, and what it is computed from.

    near: numbers of the old samples of this side, the nearest first; shift: their turns of the period;
    at: the old sample at the break that is the limit too; None: it is extrapolated.
    """

    number: int
    x: float
    near: IntArray
    shift: IntArray
    at: int | None


@dataclass(frozen=True, eq=False)
class Splitting:
    """How the samples of a motion are split at its breaks.

    x: (n,) old arguments; x_split: new ones, in which each break is twice; source: the old sample of each new one, for
    breaks between two samples the one before; is_seamed: the ends of a motion that goes round are a break.
    """

    x: FloatArray
    x_split: FloatArray
    source: IntArray
    is_seamed: bool
    _limits: tuple[_Limit, ...]

    @property
    def is_empty(self) -> bool:
        """True if no sample is added."""
        return not self._limits

    def tables(self, tables: tuple[FloatArray, FloatArray, FloatArray]) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return values, rates and accelerations (n, m) at the new samples."""
        found = [table[self.source] for table in tables]
        values = tables[0]
        turn = values[-1] - values[0]
        for limit in self._limits:
            if limit.at is not None:
                continue
            near, shift = limit.near[:_HERMITE], limit.shift[:_HERMITE]
            base = values[near[0]] + shift[0] * turn
            changes = values[near] + shift[:, None] * turn - base
            weights = _weights(self._distance(limit, _HERMITE), _ORDERS)  # (3, 3 k)
            limits = weights @ np.concatenate([changes, tables[1][near], tables[2][near]])
            for table, row in zip(found, (limits[0] + base, limits[1], limits[2]), strict=True):
                table[limit.number] = row
        return found[0], found[1], found[2]

    def samples(self, values: FloatArray, *, is_smooth: bool = True) -> FloatArray:
        """Return a quantity of which only samples (n,) are known at the new samples; one that has bends: of the old."""
        found = values[self.source]
        for limit in self._limits if is_smooth else ():
            if limit.at is None:
                base = values[limit.near[0]]
                weights = _weights(self._distance(limit, _PLAIN), 1)[0]
                found[limit.number] = base + weights @ (values[limit.near] - base)
        return found

    def driver(self, history: History) -> History:
        """Return the history of a driver at the new samples; a constant speed stays constant to the last bit."""
        if history.is_linear:
            rate = np.full_like(self.x_split, history.rate[0])
            return History(self.x_split, history.at(self.x_split)[0], rate, 0.0 * rate, history.is_closed)
        value, rate, acceleration = (row[:, None] for row in history.rows)
        rows = [row[:, 0] for row in self.tables((value, rate, acceleration))]
        return History(self.x_split, rows[0], rows[1], rows[2], history.is_closed)

    def _distance(self, limit: _Limit, most: int) -> tuple[float, ...]:
        """Return where the samples of a limit are, as seen from it."""
        near, shift = limit.near[:most], limit.shift[:most]
        return tuple((self.x[near] + shift * (self.x[-1] - self.x[0]) - limit.x).tolist())


class _Place(NamedTuple):
    """A break among the samples: the last sample before it, the first one after it, and the sample at it, if any."""

    x: float
    is_jump: bool
    before: int
    after: int
    at: int | None


def split_at(x: FloatArray, breaks: Iterable[Break], *, is_closed: bool) -> Splitting:
    """Return how samples are split at breaks.

    Breaks with fewer than two samples on a side, up to the next break, are not split: in the table of a cam with a
    point for every sample the polynomials between samples are those of the table.

    x: (n,) ascending arguments. breaks: Between the first and the last sample, in order. is_closed: The motion goes
    round.
    """
    last = len(x) - 1
    places = [_place(x, one) for one in breaks]
    is_seamed = is_closed and any(place.at in (0, last) for place in places)
    places = [place for place in places if place.at not in (0, last)]
    wraps = is_closed and not is_seamed
    firsts = [-last if wraps else 0, *(place.after for place in places)]  # of the samples that a side may use
    finals = [*(place.before for place in places), 2 * last if wraps else last]
    if wraps and places:
        firsts[0], finals[-1] = places[-1].after - last, places[0].before + last
    source: list[int] = []
    x_split: list[float] = []
    limits: list[_Limit] = []
    for place, first, final in zip(places, firsts[:-1], finals[1:], strict=True):
        sides = np.arange(place.before, first - 1, -1)[:_PLAIN], np.arange(place.after, final + 1)[:_PLAIN]
        if min(map(len, sides)) < _LEAST:
            continue
        old = range(source[-1] + 1 if source else 0, place.before + 1)
        source += [*old, *(2 * [place.before if place.at is None else place.at])]
        x_split += [*x[old.start : old.stop].tolist(), place.x, place.x]
        for k, side in enumerate(sides):
            shift = side // last if wraps else 0 * side
            at = None if place.is_jump else place.at
            limits.append(_Limit(len(source) - 2 + k, place.x, side - shift * last, shift, at))
    rest = range(source[-1] + 1 if source else 0, len(x))
    return Splitting(
        x, np.array([*x_split, *x[rest.start :].tolist()]), np.array([*source, *rest]), is_seamed, tuple(limits)
    )


def _place(x: FloatArray, one: Break) -> _Place:
    """Return where a break is among the samples."""
    k = int(np.clip(np.searchsorted(x, one.x, "right") - 1, 0, len(x) - 2))
    near = _SAME * (x[k + 1] - x[k])
    for at in (k, k + 1):
        if abs(one.x - x[at]) <= near:
            return _Place(float(x[at]), one.is_jump, at - 1, at + 1, at)
    return _Place(one.x, one.is_jump, k, k + 1, None)


@lru_cache(maxsize=256)
def _weights(distances: tuple[float, ...], orders: int) -> FloatArray:
    """Return the weights (orders, orders k) by which the derivatives of k samples give those at the limit.

    They are exact for polynomials of degree orders k - 1: sum_j w_j d_j^p = p! if p is the order of the limit, else 0.
    """
    size = max(map(abs, distances))
    d = np.array(distances) / size
    powers = np.arange(orders * len(d))
    columns = []
    for order in range(orders):
        factor = np.array([math.perm(p, order) for p in powers.tolist()], dtype=float)
        columns.append(factor[:, None] * d[None, :] ** np.maximum(powers - order, 0)[:, None])
    wanted = np.zeros((len(powers), orders))
    for order in range(orders):
        wanted[order, order] = math.factorial(order)
    scales = [size**order for order in range(orders)]
    found = np.linalg.solve(np.concatenate(columns, axis=1), wanted).T
    return np.asarray(found * np.repeat(scales, len(d)) / np.array(scales)[:, None])


def law_breaks(history: History, jumps: Jumps, sharp: Jumps) -> list[Break]:
    """Return where the argument of a law takes the values at which the law has breaks.

    history: The argument over the motion; angles from an arc tangent may jump by whole turns. jumps: Where derivatives
    up to `ORDER` jump. sharp: Those of them at which already the value, first or second derivative jumps.
    """
    value, period = np.unwrap(history.value), float(jumps.period)
    along = History(history.x, value, history.rate, history.acceleration)
    low, high = float(value.min()), float(value.max())
    margin = _SAME * float(np.abs(np.diff(value)).max(initial=0.0))
    found = []
    for one in map(float, jumps.at):
        is_jump = any(abs(one - float(other)) <= margin for other in sharp.at)
        turns = range(1)
        if period > 0.0:
            turns = range(math.ceil((low - margin - one) / period), math.floor((high + margin - one) / period) + 1)
        for level in (one + k * period for k in turns):
            ends = [history.x[k] for k in (0, -1) if abs(value[k] - level) <= margin]
            found += [Break(float(x), is_jump) for x in (*ends, *along.crossings(np.asarray(level))[1].tolist())]
    return found


def has_breaks(mechanism: Mechanism, *, over_time: bool) -> bool:
    """Return True if derivatives of a law of a joint, or of a driver that follows its law, jump."""
    laws = [driver.law for driver in mechanism.drivers] if over_time else []
    laws += [law for law in (getattr(joint, "law", None) for joint in mechanism.joints) if law is not None]
    return any(law.own_breaks(ORDER).at for law in laws)


def distinct(breaks: Iterable[Break], x: FloatArray) -> list[Break]:
    """Return breaks in order, those at the same place once."""
    near = _SAME * float(np.diff(x).min())
    found: list[Break] = []
    for one in sorted(breaks):
        if found and one.x - found[-1].x <= near:
            found[-1] = Break(found[-1].x, found[-1].is_jump or one.is_jump)
        else:
            found.append(one)
    return found
