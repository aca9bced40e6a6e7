"""Solver: poses, rates and accelerations of one generated model."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, isfinite
from typing import Any

from .advance import CLOSE, NEAR, advance
from .estimate import estimated_errors, margin_of, with_driver_errors
from .limit import Limit, limit_message, place, rounding_far_from_origin
from .pose import UNIT_SPEED, Model, Pose, Status, Vector, evaluated, failed, tangent_of, with_map
from .singularity_map import restored_map, surveyed
from .span import REGULAR
from .tracks import MIXED, TrackModel, Tracks, advance_mixed, on_track, rates_in_time, tracks_of
from .trusted_step import LONGEST_STEP, keeps_branch, straight_path, trusted_step

TOLERANCE = 1e-9  # residual relative to the size above which a sample is not ok
STEP_TOLERANCE = 1e-9  # error of a step of the integrators in rad, sizes, for fast speeds relative, if none is given
LEAST_TOLERANCE = 1e-13  # smaller ones are rounding
MOST_TOLERANCE = 1e-4  # larger ones do not tell a limit from a turn before it


class Solver:
    """A solver that follows the branch of its anchor. All methods are pure: state is in the poses.

    Args:
        model: Module generated from a SolvePlan.
        tolerance: Residual relative to the size above which a sample is not ok; Newton always goes to round-off.
        anchor: A good pose from which all others are followed; default: the model's own.

    """

    def __init__(self, model: Model, tolerance: float = TOLERANCE, anchor: Pose | None = None) -> None:
        self.model = model
        self.tolerance = tolerance
        self.anchor = _anchor_of(model) if anchor is None else anchor
        u = model.ANCHOR[0]
        self._has_one_driver = len(u) == 1
        tracks = () if self._has_one_driver else tracks_of(model, u, self.anchor.z)
        self._tracks: Tracks | None = None
        if tracks:  # the tolerance applies to the whole pose only
            solvers = [None if one is None else Solver(one, inf, on_track(one, self.anchor)) for one in tracks]
            mixed = TrackModel(model, MIXED, u, self.anchor.z) if MIXED in model.BLOCK_DRIVERS else None
            self._tracks = Tracks(model, tolerance, solvers, mixed)
        self._longest: float = LONGEST_STEP * model.REACH[0] if self._has_one_driver else 0.0

    def solve(self, start: Pose, u: Vector) -> Pose:
        """Return the pose at driver values u, followed from a good pose in a straight line of the driver values."""
        if self._tracks is not None:
            return self._by_tracks(self._tracks, start, u)
        if start.base is not None and u != start.u:
            start = start.base
        singularities = start.singularities
        longest = self._longest
        if longest:  # one driver; most samples: one trusted step, away from all that is singular
            here = u[0]
            s = here - start.u[0]
            if s == 0.0:
                return self._again(start)
            if -longest <= s <= longest and (singularities is None or singularities.low <= here <= singularities.high):
                near = trusted_step(self.model, start, UNIT_SPEED, s, u)
                if near is not None and near.watch <= self.tolerance >= near.residual:
                    margin = near.margin
                    if margin >= REGULAR:
                        return near
                    if margin > NEAR and (margin >= CLOSE or keeps_branch(self.model, start, near, UNIT_SPEED, s)):
                        singularities = surveyed(self.model, start, near)
                        if singularities is start.singularities:  # nothing new there
                            return near
        elif u == start.u:
            return self._again(start)
        refused = self._refused(start, u, self.model.DISTANCES)
        if refused is not None:
            return refused
        if not self._has_one_driver:  # most samples of several drivers: one trusted step, too
            direction, distance = straight_path(self.model, start.u, u)
            near = trusted_step(self.model, start, direction, distance, u) if distance <= LONGEST_STEP else None
            if near is not None and near.margin >= REGULAR and near.watch <= self.tolerance >= near.residual:
                return near
        pose = advance(self.model, start, u, singularities)
        if isinstance(pose, Limit):
            return failed(start, u, Status.OUTSIDE, limit_message(self.model, pose, u))
        return self._checked(pose)

    def _by_tracks(self, tracks: Tracks, start: Pose, u: Vector) -> Pose:
        """Return the pose that consists of the poses of the tracks, each followed along its own driver."""
        if u == start.u and (start.tracks or start.singularities):
            return start
        mixed = tracks.mixed
        near = tracks.near(start, u)  # most samples: one trusted step of all drivers
        if near is not None:
            return near
        refused = self._refused(start, u, mixed.DISTANCES if mixed is not None else ())
        if refused is not None:
            return refused
        pose = tracks.assembled(start, u, u, start.z) if mixed is None else advance_mixed(tracks, mixed, start, u)
        return self._checked(pose) if pose.good else pose

    def _refused(self, start: Pose, u: Vector, distances: Sequence[Sequence[Any]]) -> Pose | None:
        """Return a failed pose at driver values that no mechanism has: not finite, or a distance below 0."""
        if not isfinite(sum(u)):
            return failed(start, u, Status.OUTSIDE, f"{place(self.model, u)} is not a finite number")
        if distances and any(u[driver] < 0.0 for driver, *_ in distances):
            return failed(start, u, Status.OUTSIDE, f"{place(self.model, u)}: a distance cannot be negative")
        return None

    def _again(self, start: Pose) -> Pose:
        """Return the pose at the driver values of `start`: `start` itself, or its checked copy if it is the anchor."""
        pose = start
        if start.margin < REGULAR and start.status == Status.OK and start.singularities is None:
            singularities = surveyed(self.model, start, start) if self._has_one_driver else None
            found = start if singularities is None else advance(self.model, start, start.u, singularities)
            if not isinstance(found, Limit):
                pose = found
            if pose is start and pose.margin < NEAR:
                pose = with_map(start, None)
                pose.status = Status.NEAR_SINGULAR
        if pose.residual <= self.tolerance and pose.watch <= self.tolerance:
            return pose
        return self._checked(with_map(pose, pose.singularities))

    def _checked(self, pose: Pose) -> Pose:
        """Return the pose, rejected if its rows or its watches do not close."""
        tolerance = self.tolerance
        if not (pose.residual <= tolerance and pose.watch <= tolerance):
            self._reject(pose)
        return pose

    def _reject(self, pose: Pose) -> None:
        """Set status and message of a pose whose rows or watches do not close."""
        if not pose.residual <= self.tolerance:
            pose.status = Status.NOT_CONVERGED
            pose.message = (
                f"{place(self.model, pose.u)}: the rows do not close: residual {pose.residual:.2g} of the size"
                f"{rounding_far_from_origin(self.model)}"
            )
            return
        open_rows = zip(self.model.WATCHES, self.watch(pose), strict=True)
        name, value = max(open_rows, key=lambda row: abs(row[1]))
        gap = abs(value) * self.model.SIZE
        pose.status = Status.INCONSISTENT
        pose.message = (
            f"{place(self.model, pose.u)}: redundant row {name} does not close: gap {gap:.3g} {self.model.LENGTH_UNIT}"
        )

    def _both(self, pose: Pose, ud: Vector, udd: Vector) -> tuple[Vector, Vector]:
        """Return the arguments of the model's accelerations: z' and z'' with one driver, else zd and zdd."""
        if self._has_one_driver:
            return tangent_of(self.model, pose)
        return rates_in_time(self.model, pose, ud, udd)

    def outputs(self, pose: Pose) -> Vector:
        """Return positions of the model's OUTPUTS."""
        return self.model.outputs(pose.values)  # type: ignore[no-any-return]  # generated code has no types

    def rates(self, pose: Pose, ud: Vector) -> Vector:
        """Return rates of the OUTPUTS at driver speeds ud."""
        if self._has_one_driver:
            first = (pose.tangent or tangent_of(self.model, pose))[0]
        elif pose.is_bridged:
            first = self._both(pose, ud, (0.0,) * len(ud))[0]
        else:
            first = tuple(self.model.velocity(pose.values, ud))
        return self.model.rates(pose.values, ud, first)  # type: ignore[no-any-return]

    def accelerations(self, pose: Pose, ud: Vector, udd: Vector) -> Vector:
        """Return accelerations of the OUTPUTS at driver speeds ud and accelerations udd."""
        first, second = pose.tangent or self._both(pose, ud, udd)
        return self.model.accelerations(pose.values, ud, udd, first, second)  # type: ignore[no-any-return]

    def motion(self, pose: Pose, ud: Vector, udd: Vector) -> Vector:
        """Return positions, rates and accelerations of the OUTPUTS in one row; common terms are computed once."""
        if self._has_one_driver and pose.tangent is None:  # as a rule in an FMU: each pose is read once
            pose.tangent, row = self.model.first_motion(pose.values, ud, udd)
            return row  # type: ignore[no-any-return]
        first, second = pose.tangent or self._both(pose, ud, udd)
        return self.model.motion(pose.values, ud, udd, first, second)  # type: ignore[no-any-return]

    def watch(self, pose: Pose) -> Vector:
        """Return the residuals of the watches, relative to the size."""
        return tuple(self.model.watches(pose.values))

    def margin(self, pose: Pose) -> float:
        """Return the smallest over the blocks of 1 / cond of the equilibrated block; see margin_of."""
        return margin_of(self.model, pose)

    def errors(
        self, pose: Pose, ud: Vector, udd: Vector, off: tuple[Vector, Vector] | None = None
    ) -> tuple[float, float, float]:
        """Return estimated errors of q, qd, qdd, the largest of the outputs; see estimate.

        Args:
            pose: A good pose.
            ud: Speeds of the drivers.
            udd: Accelerations of the drivers.
            off: Errors of ud and udd; default: they are exact.

        Returns:
            Errors in radians, and relative to the size for lengths.

        """
        errors = estimated_errors(self.model, pose, ud, udd)
        return errors if off is None else with_driver_errors(self.model, pose, ud, udd, off, errors)

    def dump(self, pose: Pose) -> list[Any]:
        """Return a pose as plain numbers; `restore` gives one that behaves the same to the bit."""
        if self._tracks is not None:
            return self._tracks.dump(pose)
        known = None if pose.singularities is None else pose.singularities.dump()
        number = -1 if pose.bridge is None else pose.singularities.bridges.index(pose.bridge)
        base = None if pose.base is None else self.dump(pose.base)
        return [list(pose.u), list(pose.z), pose.iterations, int(pose.status), pose.message, known, number, base]

    def restore(self, data: list[Any]) -> Pose:
        """Return the pose that `dump` gave as plain numbers."""
        if self._tracks is not None:
            return self._tracks.restore(data)
        u, z, iterations, status, message, known, number, base = data
        singularities = None if known is None else restored_map(self.model, known)
        if singularities is not None and number >= 0:
            pose: Pose = singularities.bridges[number].pose(tuple(u))
        else:
            pose = Pose(tuple(u), evaluated(self.model, tuple(u), tuple(z)))
        pose.singularities = None if singularities is None else singularities.around(pose.u[0])
        pose.iterations, pose.status, pose.message = iterations, status, message
        pose.base = None if base is None else self.restore(base)
        return pose


def _anchor_of(model: Model) -> Pose:
    """Return the anchor; if Newton does not end there, with the residual left, so that it is not converged."""
    u, z = model.ANCHOR
    try:
        return Pose(u, evaluated(model, u, z, held=0))
    except ArithmeticError as error:
        pose = Pose(u, evaluated(model, u, z))
        pose.residual = error.args[1] if len(error.args) == 2 else inf
        return pose
