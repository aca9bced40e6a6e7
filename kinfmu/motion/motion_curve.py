"""A quantity with its first three derivatives: at the samples of a run, and on both sides of each break of a law.

The jerk comes from the constraint equations, differentiated once more than for gamma.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray
from kinfmu.errors import RequestError, listed, valid_names
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.joints.cam import Cam, CamFlatFace, CamRoller
from kinfmu.mechanism.joints.joint import Joint
from kinfmu.mechanism.laws import External
from kinfmu.mechanism.laws.law import TURN
from kinfmu.mechanism.quantities.placement import Placement
from kinfmu.motion.breaks import AT_SAMPLE, FollowedLaw, OneSided, bracket, breaks_of, followed_laws
from kinfmu.plan.equations.system import System, placement
from kinfmu.plan.equations.taylor import Taylor
from kinfmu.run import Column, Run
from kinfmu.run.axis import TIME, rates_per
from kinfmu.run.tables import in_degrees
from kinfmu.solver.python.pose import Status
from kinfmu.units import CoordinateName, Quantity, unit_of

SAME = 1e-9  # of the largest value; by how much inputs may differ from the law of their driver


def motion_of(run: Run, name: str) -> tuple[FloatArray, str]:
    """Return a coordinate with its first three derivatives, and its kind: 'length' or 'angle'.

        Phi_q qddd = delta,   delta = -Phi''' along q + qd t + qdd t^2 / 2, u(t)

    Derivatives are by what the rates of the run are derivatives by. They are exact to round-off times the condition
    number; rows of samples that are bridged, near a singular point or without numbers hold NaN.

    Args:
        run: A run that holds its mechanism and the positions, velocities and accelerations of all coordinates.
        name: A coordinate such as 'slider.x', a point of interest's, or a cam joint for its follower's lift: of
            cam_roller the radius of the pitch curve at the roller, of cam_flat_face the distance of the face.

    Returns:
        (n, 4) values, rates, accelerations and jerks; the kind.

    Raises:
        RequestError: The name is unknown, or the third derivative of a driver's input is not known.
        KinfmuError: The run does not hold a column.
        MechanismError: The run's mechanism cannot be read.

    """
    mechanism = run.mechanism
    if mechanism is None:
        raise RequestError("the run does not hold its mechanism, from whose equations the jerk is computed")
    places = [place for place in mechanism.coordinate_names if place in {*run.outputs, *run.fixed}]
    missing = [place for place in mechanism.coordinate_names if place not in places]
    if missing:
        raise RequestError(f"the jerk needs all coordinates, and the run does not hold {listed(missing)}")
    columns = [tuple(np.asarray(run[place.derivative(k)], dtype=float) for k in range(3)) for place in places]
    along = [Taylor.of(3, *(np.where(run.good, column, 0.0) for column in one)) for one in columns]
    jerks, margin = MotionEquations(mechanism, len(run)).solved(along, targets_at(run, mechanism), 3)
    is_known = run.good & (run.status != Status.BRIDGED) & (margin > LEAST_MARGIN)
    full = [Taylor((*number.c[:3], jerks[:, k] / 6.0)) for k, number in enumerate(along)]
    table, kind = quantity_table(mechanism, mechanism.joints, name, full, len(run))
    table[~run.good] = np.nan
    table[~is_known, 3] = np.nan
    return table, kind


def quantity_table(
    mechanism: Mechanism, joints: Sequence[Joint], name: str, q: Sequence[Taylor], count: int
) -> tuple[FloatArray, str]:
    """Return a coordinate or the lift of a cam, from the coordinates q at n poses, as `motion_of` does."""
    value, kind = _quantity(mechanism, joints, name, placement(mechanism, q))
    return np.stack([derivative(value, order, count) for order in range(4)], -1), kind


def _quantity(mechanism: Mechanism, joints: Sequence[Joint], name: str, at: Placement) -> tuple[Any, str]:
    """Return a coordinate or the lift of a cam as a Taylor number, and its kind."""
    cams = {joint.name: joint for joint in joints if isinstance(joint, Cam | CamRoller | CamFlatFace)}
    cam = cams.get(name)
    if isinstance(cam, Cam):
        return cam.follower().value(at) - cam.offset, cam.led
    if cam is not None:
        law, argument = cam.led_by(at)
        return law.at(argument), cam.law_kinds[0]
    of_points = [CoordinateName(point, axis) for point in mechanism.points for axis in "xy"]
    coordinates = [*mechanism.coordinate_names, *of_points]
    coordinate = next((one for one in coordinates if one == name), None)
    if coordinate is None:
        known = [*cams, *coordinates]
        raise RequestError(f"'{name}' is neither a coordinate nor a cam{valid_names(name, known)}")
    kind = coordinate.quantity().kind
    if coordinate.is_angle:
        return at.angle(coordinate.owner), kind
    pose = at.poses.get(coordinate.owner)
    xy = (pose.x, pose.y) if pose is not None else at.point(mechanism.points[coordinate.owner])
    return xy["xy".index(coordinate.axis)], kind


def targets_at(
    run: Run, mechanism: Mechanism, place: FloatArray | None = None, side: FloatArray | None = None
) -> list[Taylor]:
    """Return the values of all drivers with three derivatives; raise a RequestError if a third derivative is not known.

    place: (n,) where, in samples. Default: at the samples. side: (n,) -1: before these places, 1: after them.
    """
    samples = np.arange(len(run))
    found = []
    for driver in mechanism.drivers:
        given = [np.asarray(run[name], dtype=float) for name in driver.inputs()]
        given = [np.where(np.isfinite(column), column, 0.0) for column in given]
        if run.axis == TIME and not isinstance(driver.law, External):
            of_law = _lifted(driver.law.at(Taylor.of(3, run.t, 1.0)))
            within = [SAME * max(float(np.abs(column).max(initial=0.0)), 1e-300) for column in given]
            apart = [np.abs(column - of_law.derivative(order)) for order, column in enumerate(given)]
            if all(bool(np.all(gap <= most)) for gap, most in zip(apart, within, strict=True)):
                if place is not None:
                    t = np.interp(place, samples, run.t)
                    law = driver.law if side is None else OneSided(driver.law, side)
                    of_law = _lifted(law.at(Taylor.of(3, t, 1.0)))
                found.append(of_law)
                continue
        if given[2].any():
            raise RequestError(
                f"the jerk is not known: driver '{driver.name}' has accelerations that are not those of the law in the "
                "mechanism file, so their rate of change is unknown; run it by its law, or at constant speed"
            )
        found.append(Taylor.of(3, *(one if place is None else np.interp(place, samples, one) for one in given)))
    return found


def _lifted(value: Any) -> Taylor:
    return value if isinstance(value, Taylor) else Taylor.of(3, value)


LEAST_MARGIN = 1e-6  # 1 / condition of the scaled Jacobian; below it a third derivative has no digits


class MotionEquations:
    """The constraint equations of a mechanism at n poses, in Taylor numbers.

        Phi_q q^(k) = -Phi^(k) along q + qd t + ... without q^(k), u(t)

    joints: Its joints, those with other laws in place of the mechanism's own. Default: its own.
    """

    def __init__(self, mechanism: Mechanism, count: int, joints: Sequence[Joint] = ()) -> None:
        self.mechanism = mechanism
        self.joints = tuple(joints) or mechanism.joints
        self.count = count
        self.system = System(mechanism)

    def solved(self, q: Sequence[Taylor], targets: Sequence[Taylor], order: int) -> tuple[FloatArray, FloatArray]:
        """Return what a derivative of the coordinates lacks to satisfy the equations, (n, coordinates), to be added.

        It also returns (n,) 1 / condition of the scaled Jacobian. q: The coordinates; derivatives below the order
        satisfy the equations, or are close to that for order 0. targets: The drivers' values. order: 0 to 3.
        """
        delta = -self._columns(self._evaluate(q, targets), order)  # (n, rows)
        u, sizes, v = self._decomposed(q, targets)
        solved = np.einsum("nij,ni->nj", u, delta / self.system.scales / self.system.size)
        with np.errstate(divide="ignore", invalid="ignore"):
            missing = np.einsum("nij,ni->nj", v, solved / sizes) * self.system.column_scales
            margin = sizes[:, -1] / sizes[:, 0]
        return missing, margin

    def slopes(self, q: Sequence[Taylor], targets: Sequence[Taylor]) -> FloatArray:
        """Return the rates of the coordinates (n, coordinates) that follow from those of the drivers."""
        return self.solved([Taylor.of(3, one.c[0]) for one in q], targets, 1)[0]

    def _decomposed(self, q: Sequence[Taylor], targets: Sequence[Taylor]) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the singular values and vectors of the scaled Jacobian."""
        at_rest = [Taylor((target.c[0], 0.0)) for target in targets]
        units = ([Taylor((one.c[0], float(j == k))) for j, one in enumerate(q)] for k in range(len(q)))
        jacobian = np.stack([self._columns(self._evaluate(unit, at_rest), 1) for unit in units], -1)
        scaled = jacobian / self.system.scales[:, None] * self.system.column_scales / self.system.size
        u, sizes, v = np.linalg.svd(np.nan_to_num(scaled), full_matrices=False)
        return u, sizes, v

    def _evaluate(self, q: Sequence[Taylor], targets: Sequence[Taylor]) -> list[Any]:
        at = placement(self.mechanism, q)
        phi = [value for joint in self.joints for value in joint.residual(at)]
        return phi + [one.residual(at, u) for one, u in zip(self.mechanism.drivers, targets, strict=True)]

    def _columns(self, values: Sequence[Any], order: int) -> FloatArray:
        return np.stack([derivative(value, order, self.count) for value in values], -1)


def derivative(value: Any, order: int, count: int) -> FloatArray:
    """Return a derivative of a Taylor number or a float at all of `count` poses."""
    found = value.derivative(order) if isinstance(value, Taylor) else (0.0 if order else value)
    return np.broadcast_to(np.asarray(found, dtype=float), (count,)).copy()


def with_derivative(number: Taylor, order: int, value: FloatArray) -> Taylor:
    """Return a number with a value added to a derivative."""
    added = Taylor.of(3, *(value if k == order else 0.0 for k in range(order + 1)))
    return Taylor((number + added).c, number.side)


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
