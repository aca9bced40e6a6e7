"""Jerk: third derivatives of a run's motion, from the constraint equations differentiated once more than for gamma."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import RequestError, listed, valid_names
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.joints.cam import Cam, CamFlatFace, CamRoller
from kinfmu.mechanism.joints.joint import Joint
from kinfmu.mechanism.laws import External
from kinfmu.mechanism.quantities.placement import Placement
from kinfmu.motion.breaks import OneSided
from kinfmu.plan.equations.system import System, placement
from kinfmu.plan.equations.taylor import Taylor
from kinfmu.run import Run
from kinfmu.run.axis import TIME
from kinfmu.solver.python.pose import Status
from kinfmu.units import CoordinateName

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
