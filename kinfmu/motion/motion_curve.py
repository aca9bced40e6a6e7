"""A quantity with its first three derivatives: at the samples of a run, and on both sides of each break of a law."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.joints import CamRoller
from kinfmu.mechanism.laws.law import TURN
from kinfmu.motion.breaks import AT_SAMPLE, FollowedLaw, OneSided, bracket, breaks_of, followed_laws
from kinfmu.motion.jerk import (
    LEAST_MARGIN,
    MotionEquations,
    derivative,
    motion_of,
    quantity_table,
    targets_at,
    with_derivative,
)
from kinfmu.plan.equations.system import placement
from kinfmu.plan.equations.taylor import Taylor
from kinfmu.run import Column, Run
from kinfmu.run.axis import TIME, rates_per
from kinfmu.run.tables import in_degrees
from kinfmu.solver.python.pose import Status
from kinfmu.units import Quantity, unit_of

_STEPS = 12  # of Newton at most
_CLOSE = 1e-11  # of the size, of a step between samples; a smaller correction ends Newton
_ORDER = 3  # derivatives up to this one count


@dataclass(frozen=True, eq=False)
class MotionCurve:
    """A quantity along a run, in ascending order of the samples.

    kind: 'length' or 'angle'; place: (m,) where, in samples: 2.25 is after the third one; side: (m,) 0: a sample,
    -1: the limit before a break, 1: the limit after it; t: (m,) time; drive: (m, d) values of the drivers;
    table: (m, 4) value, rate, acceleration and jerk.
    """

    kind: str
    place: FloatArray
    side: NDArray[np.int64]
    t: FloatArray
    drive: FloatArray
    table: FloatArray

    def drawn(self) -> NDArray[np.int64]:
        """Return the rows of a curve: all but the samples at a break, which has limits in their place."""
        at_break = np.isin(self.place, self.place[self.side != 0])
        return np.flatnonzero((self.side != 0) | ~at_break)


def motion_curve(run: Run, name: str) -> MotionCurve:
    """Return a coordinate or the lift of a cam along a run, with its limits at the breaks of laws.

    The limits are those of the constraint equations in the pose at the break, with the derivatives of the law on one
    side of it; they do not depend on the samples. A break next to a sample that is bridged or without numbers has none.

    Args:
        run: The run, as for `motion_of`.
        name: The name, as for `motion_of`.

    Raises:
        RequestError, KinfmuError, MechanismError: As `motion_of`.

    """
    table, kind = motion_of(run, name)
    mechanism = run.mechanism
    assert mechanism is not None  # noqa: S101  # for the type; the jerk was computed from it
    limits = _Limits.of(run, mechanism)
    place, side = np.arange(len(run), dtype=float), np.zeros(len(run), np.int64)
    drive = run.inputs[:, ::3]
    if limits is not None:
        at_break, its_side, driven, found = limits.quantity(name)
        place, side = np.append(place, at_break), np.append(side, its_side)
        drive, table = np.concatenate([drive, driven]), np.concatenate([table, found])
        order = np.lexsort((side, place))
        place, side, drive, table = place[order], side[order], drive[order], table[order]
    return MotionCurve(kind, place, side, np.interp(place, np.arange(len(run)), run.t), drive, table)


class _Limits:
    """The sides of breaks within a run: place (m,), side (m,), and the coordinates there as Taylor numbers."""

    def __init__(
        self, run: Run, mechanism: Mechanism, laws: list[FollowedLaw], sides: list[tuple[float, int, int, float]]
    ) -> None:
        self._run, self._mechanism = run, mechanism
        place, side, number, level = (np.array(column) for column in zip(*sides, strict=True))
        self.place, self.side = place.astype(float), side.astype(float)
        self._low, self._high = np.array([bracket(p, s) for p, s in zip(place, side, strict=True)]).T
        ways = [self.side * np.sign(law.argument[self._high] - law.argument[self._low]) for law in laws]
        sided = {
            law.joint.name: replace(law.joint, law=OneSided(law.law, way))  # type: ignore[type-var]
            for law, way in zip(laws, ways, strict=True)
            if law.joint is not None
        }
        self._joints = [sided.get(joint.name, joint) for joint in mechanism.joints]
        self._equations = MotionEquations(mechanism, len(place), self._joints)
        self._crossings = [
            (law.joint, np.flatnonzero(number == k), level)
            for k, law in enumerate(laws)
            if law.joint is not None and (number == k).any()
        ]
        self._q, self._is_found = self._pose()

    @classmethod
    def of(cls, run: Run, mechanism: Mechanism) -> _Limits | None:
        """Return the limits of a run that are between two of its samples with numbers; None without any."""
        laws = followed_laws(run, mechanism)
        is_good = run.good & (run.status != Status.BRIDGED)
        sides = []
        for one in breaks_of(laws, _ORDER):
            for side in (-1, 1):
                low, high = bracket(one.place, side)
                if low >= 0 and high < len(run) and is_good[low] and is_good[high]:
                    sides.append((one.place, side, one.number, one.level))
        return cls(run, mechanism, laws, sides) if sides else None

    def _pose(self) -> tuple[list[Taylor], NDArray[np.bool_]]:
        """Move the places to the breaks; return the coordinates there, and which are found."""
        run, size = self._run, self._equations.system.column_scales
        step = self._argument_steps()
        q = self._between(step)  # (m, coordinates)
        first = q.copy()
        for _ in range(_STEPS):
            targets = targets_at(run, self._mechanism, self.place, self.side)
            missing, margin = self._equations.solved(_numbers(q), targets, 0)
            q = q + missing
            rates = self._equations.slopes(_numbers(q), targets)
            moved = self._to_break(q, rates, step)
            q = q + rates * (moved * step)[:, None]
            self.place = self.place + moved
            gap = np.maximum(np.abs(missing / size).max(axis=1), np.abs(moved))
            if not (gap > _CLOSE).any():
                break
        width = np.abs(self._columns(0)[self._high] - self._columns(0)[self._low]) / size
        strayed = np.abs((q - first) / size).max(axis=1) > width.max(axis=1) + _CLOSE
        return _numbers(q), (gap <= _CLOSE) & (margin > LEAST_MARGIN) & ~strayed

    def _to_break(self, q: FloatArray, rates: FloatArray, step: FloatArray) -> FloatArray:
        """Return by how many samples each place misses its break."""
        at = placement(self._mechanism, [Taylor.of(1, *pair) for pair in zip(q.T, rates.T, strict=True)])
        moved = np.zeros(len(q))
        for joint, rows, level in self._crossings:
            led: Any = joint.led_by(at)
            value, rate = (derivative(led[1], order, len(q))[rows] for order in (0, 1))
            missing = level[rows] - value
            if isinstance(joint, CamRoller):  # its polar angle is known up to whole turns
                missing = np.remainder(missing + math.pi, TURN) - math.pi
            with np.errstate(divide="ignore", invalid="ignore"):
                moved[rows] = np.nan_to_num(missing / (rate * step[rows]), nan=0.0, posinf=0.0, neginf=0.0)
        return np.asarray(np.clip(self.place + moved, self._low, self._high) - self.place)

    def _argument_steps(self) -> FloatArray:
        """Return what rates are derivatives by, from one sample of each bracket to the other; 0 if unknown."""
        run = self._run
        if run.axis == TIME:
            return np.asarray(run.t[self._high] - run.t[self._low])
        way = run.inputs[self._high, ::3] - run.inputs[self._low, ::3]
        speed = 0.5 * (run.inputs[self._high, 1::3] + run.inputs[self._low, 1::3])
        fastest = np.argmax(np.abs(speed), axis=1)[:, None]
        way, speed = (np.take_along_axis(one, fastest, 1)[:, 0] for one in (way, speed))
        return np.divide(way, speed, out=np.zeros_like(way), where=speed != 0.0)

    def _columns(self, order: int) -> FloatArray:
        """Return a derivative of all coordinates at the samples, (n, coordinates)."""
        names = self._mechanism.coordinate_names
        return np.stack([np.asarray(self._run[name.derivative(order)], dtype=float) for name in names], -1)

    def _between(self, step: FloatArray) -> FloatArray:
        """Return the coordinates at the places by cubic polynomials between samples, from which Newton starts."""
        values, rates = self._columns(0), self._columns(1)
        s = ((self.place - self._low) / (self._high - self._low))[:, None]
        f, g = values[self._low], values[self._high]
        v, w = (rates[k] * step[:, None] for k in (self._low, self._high))
        cubic = f + s * (v + s * (3.0 * (g - f) - 2.0 * v - w + s * (2.0 * (f - g) + v + w)))
        return np.asarray(np.where(step[:, None] == 0.0, f + s * (g - f), cubic))

    def quantity(self, name: str) -> tuple[FloatArray, NDArray[np.int64], FloatArray, FloatArray]:
        """Return place, side, values of the drivers (m, d) and table (m, 4) of a quantity; coinciding breaks once."""
        targets = targets_at(self._run, self._mechanism, self.place, self.side)
        q = self._q
        for order in (1, 2, 3):
            missing, _ = self._equations.solved(q, targets, order)
            q = [with_derivative(one, order, missing[:, k]) for k, one in enumerate(q)]
        table, _ = quantity_table(self._mechanism, self._joints, name, q, len(self.place))
        drive = np.stack([derivative(target, 0, len(self.place)) for target in targets], -1)
        nearest = np.round(self.place)
        place = np.where(np.abs(self.place - nearest) < AT_SAMPLE, nearest, self.place)
        kept = np.array([], np.int64)
        for way in (-1.0, 1.0):
            rows = np.flatnonzero(self._is_found & (self.side == way))
            rows = rows[np.argsort(place[rows], kind="stable")]
            kept = np.append(kept, rows[np.diff(place[rows], prepend=-1.0) > AT_SAMPLE])
        return place[kept], self.side[kept].astype(np.int64), drive[kept], table[kept]


def _numbers(q: FloatArray) -> list[Taylor]:
    return [Taylor.of(3, column) for column in q.T]


NAMES = ("position", "velocity", "acceleration", "jerk")


def units_of(run: Run, curve: MotionCurve) -> list[str]:
    """Return the units of displacement, velocity, acceleration and jerk."""
    per = rates_per(run)
    return [unit_of(Quantity(curve.kind, order, per), run.length_unit) for order in range(4)]


def svaj_columns(run: Run, name: str, *, degrees: bool = False) -> list[Column]:
    """Return time, values of the drivers, position, velocity, acceleration, jerk and side of a quantity.

    There is a row for each sample, of side 0. At each break of a law two more rows hold the limits before it in the
    order of the run, of side -1, and after it, of side 1. A sample exactly at a break has the value of the piece on the
    right of the law, which is before the break where the law's argument falls. Without time on the axis of the run
    there is no column of it. Numbers that are not known are NaN.

    Args:
        run: The run, as for `motion_of`.
        name: A coordinate or a cam joint, as for `motion_of`.
        degrees: True: angles, and their rates in time, in deg.

    Raises:
        RequestError, KinfmuError, MechanismError: As `motion_of`.

    """
    curve = motion_curve(run, name)
    found = [Column("time", "s", curve.t)] if run.axis == TIME else []
    for k, driven in enumerate(run.input_names[::3]):
        found.append(Column(str(driven), unit_of(driven.quantity, run.length_unit), curve.drive[:, k]))
    for order, unit in enumerate(units_of(run, curve)):
        found.append(Column(NAMES[order], unit, curve.table[:, order]))
    if degrees:
        found = [*map(in_degrees, found)]
    found = [column._replace(values=column.values + 0.0) for column in found]  # no -0.0
    return [*found, Column("side", "1", curve.side)]
