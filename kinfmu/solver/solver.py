"""Solver: poses, rates and accelerations of one generated model."""

from __future__ import annotations

from math import inf, isfinite
from typing import Any

from .advance import (
    CLOSE,
    LONGEST_STEP,
    NEAR_SINGULAR,
    NO_BLOCK,
    Limit,
    advance,
    course,
    keeps_branch,
    limit_message,
    surveyed,
    trusted_step,
)
from .estimate import estimated_errors, margin_of, with_drive_errors
from .message import place
from .pose import ALONE, Model, Pose, Vector, evaluated, failed, on_road, tangent_of
from .road import laid
from .span import REGULAR
from .status import Status
from .tracks import Track, on_track, rates_in_time, tracks_of

TOLERANCE = 1e-9  # residual relative to the size above which a sample is not ok


class Solver:
    """Follows the branch of a mechanism that its anchor lies on. All methods are pure: state is in the poses.

    model: a module generated from a SolvePlan; tolerance: residual relative to the size above which the status of a
    sample is not ok (Newton always goes to round-off); anchor: a good pose to follow all others from, the model's own
    if None.
    """

    def __init__(self, model: Model, tolerance: float = TOLERANCE, anchor: Pose | None = None) -> None:
        self.model = model
        self.tolerance = tolerance
        u, z = model.ANCHOR
        self.anchor = Pose(u, evaluated(model, u, z, held=0)) if anchor is None else anchor
        self._one = len(u) == 1
        tracks = () if self._one else tracks_of(model, u, self.anchor.z)
        self._tracks = tuple([None if track is None else _solver_of(track, self.anchor) for track in tracks])
        self._longest: float = LONGEST_STEP * model.REACH[0] if self._one else 0.0

    def solve(self, start: Pose, u: Vector) -> Pose:
        """The pose at driver values u, followed from the good pose `start` in a straight line of the driver values."""
        if self._tracks:
            return self._by_tracks(start, u)
        if start.base is not None and u != start.u:
            start = start.base
        if u == start.u:
            return self._again(start)
        road = start.road
        if self._one:  # most samples: one trusted step, away from all that is singular
            s = u[0] - start.u[0]
            if -self._longest <= s <= self._longest and (road is None or road.low <= u[0] <= road.high):
                near = trusted_step(self.model, start, ALONE, s, u)
                if near is not None and near.watch <= self.tolerance >= near.residual:
                    margin = near.margin
                    if margin >= REGULAR:
                        return near
                    if margin > NEAR_SINGULAR and (margin >= CLOSE or keeps_branch(self.model, start, near, ALONE, s)):
                        road = surveyed(self.model, start, near)
                        if road is start.road:  # nothing new there
                            return near
        if not isfinite(sum(u)):
            return failed(start, u, Status.OUTSIDE, f"{place(self.model, u)} is not a finite number")
        if any(u[driver] < 0.0 for driver, *_ in self.model.DISTANCES):
            return failed(start, u, Status.OUTSIDE, f"{place(self.model, u)}: a distance cannot be negative")
        pose = advance(self.model, start, u, road)
        if isinstance(pose, Limit):
            return failed(start, u, Status.OUTSIDE, limit_message(self.model, pose, u))
        return self._checked(pose)

    def _by_tracks(self, start: Pose, u: Vector) -> Pose:
        """The pose put together from those of the tracks, each followed along its own driver."""
        if u == start.u and (start.tracks or start.road):
            return start
        if start.margin >= REGULAR and not start.is_bridged:  # most samples: one trusted step of all drivers
            near = self._near(start, u)
            if near is not None:
                return near
        if not isfinite(sum(u)):
            return failed(start, u, Status.OUTSIDE, f"{place(self.model, u)} is not a finite number")
        known = {track.driver: own for track, own in start.tracks}
        z, parts = start.z, []
        for k, solver in enumerate(self._tracks):
            if solver is None:
                continue
            own = solver.solve(known.get(k) or on_track(solver.model, start), (u[k],))
            if not own.good:
                return failed(start, u, Status(own.status), own.message)
            z = solver.model.put(own.z, z)
            parts.append((solver.model, own))
        try:
            pose = Pose(u, evaluated(self.model, u, z))
        except (ArithmeticError, ValueError):  # a coordinate that is given outright has no value there
            return failed(start, u, Status.OUTSIDE, limit_message(self.model, Limit(start.u, NO_BLOCK), u))
        pose.tracks = tuple(parts)
        roads = {track.driver: own.road for track, own in parts}
        pose.road = tuple([roads.get(k) for k in range(len(u))])
        pose.iterations = sum([own.iterations for _, own in parts])
        statuses = [own.status for _, own in parts]
        if Status.NEAR_SINGULAR in statuses:
            pose.status = Status.NEAR_SINGULAR
        elif Status.BRIDGED in statuses:
            pose.status = Status.BRIDGED
        return self._checked(pose)

    def _near(self, start: Pose, u: Vector) -> Pose | None:
        """The pose one trusted step away, if it and the step are far from all that is singular."""
        direction, distance = course(self.model, start.u, u)
        if not 0.0 < distance <= LONGEST_STEP:
            return None
        if start.road is not None:
            for road, value in zip(start.road, u, strict=True):
                if road is not None and not road.low <= value <= road.high:
                    return None
        near = trusted_step(self.model, start, direction, distance, u)
        if near is None or near.margin < REGULAR or not near.watch <= self.tolerance >= near.residual:
            return None
        near.road = start.road or (None,) * len(u)
        return near

    def _again(self, start: Pose) -> Pose:
        """The pose at the driver values of `start`: `start` itself, unless nothing has judged it yet, as the anchor."""
        pose = start
        if start.margin < REGULAR and start.status == Status.OK and start.road is None:
            road = surveyed(self.model, start, start) if self._one else None
            found = start if road is None else advance(self.model, start, start.u, road)
            if not isinstance(found, Limit):
                pose = found
            if pose is start and pose.margin < NEAR_SINGULAR:
                pose = on_road(start, None)
                pose.status = Status.NEAR_SINGULAR
        if pose.residual <= self.tolerance and pose.watch <= self.tolerance:
            return pose
        return self._checked(on_road(pose, pose.road))

    def _checked(self, pose: Pose) -> Pose:
        """The pose, rejected if its rows do not close or the rows set aside as redundant do not hold."""
        tolerance = self.tolerance
        if not (pose.residual <= tolerance and pose.watch <= tolerance):
            self._reject(pose)
        return pose

    def _reject(self, pose: Pose) -> None:
        """A pose counts only if its rows close and the rows set aside as redundant hold too."""
        if not pose.residual <= self.tolerance:
            pose.status = Status.NOT_CONVERGED
            pose.message = f"{place(self.model, pose.u)}: residual {pose.residual:.2g} of the size is left"
            return
        open_rows = zip(self.model.WATCHES, self.watch(pose), strict=True)
        name, value = max(open_rows, key=lambda row: abs(row[1]))
        gap = abs(value) * self.model.SIZE
        pose.status = Status.INCONSISTENT
        pose.message = (
            f"{place(self.model, pose.u)}: the redundant row {name} is open by {gap:.3g} {self.model.LENGTH_UNIT}"
        )

    def _first(self, pose: Pose, ud: Vector) -> Vector:
        """What the model's rates start from: z' = dz/du with one driver, else zd."""
        if self._one:
            return tangent_of(self.model, pose)[0]
        return (
            self._both(pose, ud, (0.0,) * len(ud))[0]
            if pose.is_bridged
            else tuple(self.model.velocity(pose.values, ud))
        )

    def _both(self, pose: Pose, ud: Vector, udd: Vector) -> tuple[Vector, Vector]:
        """What the model's accelerations start from: z' and z'' with one driver, else zd and zdd."""
        if self._one:
            return tangent_of(self.model, pose)
        return rates_in_time(self.model, pose, ud, udd)

    def outputs(self, pose: Pose) -> Vector:
        """Positions of the model's OUTPUTS."""
        return self.model.outputs(pose.values)  # type: ignore[no-any-return]  # generated code has no types

    def rates(self, pose: Pose, ud: Vector) -> Vector:
        """Rates of the OUTPUTS at driver speeds ud."""
        return self.model.rates(pose.values, ud, self._first(pose, ud))  # type: ignore[no-any-return]

    def accelerations(self, pose: Pose, ud: Vector, udd: Vector) -> Vector:
        """Accelerations of the OUTPUTS at driver speeds ud and accelerations udd."""
        first, second = self._both(pose, ud, udd)
        return self.model.accelerations(pose.values, ud, udd, first, second)  # type: ignore[no-any-return]

    def motion(self, pose: Pose, ud: Vector, udd: Vector) -> Vector:
        """Positions, rates and accelerations of the OUTPUTS in one row: what they share is computed once."""
        if self._one and pose.tangent is None:  # the rule in an FMU: each pose is read once, and before the next step
            pose.tangent, row = self.model.first_motion(pose.values, ud, udd)
            return row  # type: ignore[no-any-return]
        first, second = pose.tangent or self._both(pose, ud, udd)
        return self.model.motion(pose.values, ud, udd, first, second)  # type: ignore[no-any-return]

    def watch(self, pose: Pose) -> Vector:
        """Rows set aside as redundant, relative to the size."""
        return tuple(self.model.watches(pose.values))

    def margin(self, pose: Pose) -> float:
        """Return the smallest over the blocks of 1 / cond of the equilibrated block; see margin_of."""
        return margin_of(self.model, pose)

    def errors(
        self, pose: Pose, ud: Vector, udd: Vector, off: tuple[Vector, Vector] | None = None
    ) -> tuple[float, float, float]:
        """Estimated errors of q, qd, qdd at driver speeds ud and accelerations udd, the largest among the outputs.

        In radians, and relative to the size for lengths; see estimate. off: by how much ud and udd may be off
        themselves; None if they are exact.
        """
        errors = estimated_errors(self.model, pose, ud, udd)
        return errors if off is None else with_drive_errors(self.model, pose, ud, udd, off, errors)

    def dump(self, pose: Pose) -> list[Any]:
        """A pose as plain numbers; `restore` gives one that behaves the same to the bit."""
        if self._tracks:
            roads = None if pose.road is None else [None if road is None else road.dump() for road in pose.road]
            parts = [self._tracks[track.driver].dump(own) for track, own in pose.tracks]
            return [list(pose.u), list(pose.z), pose.iterations, int(pose.status), pose.message, roads, parts]
        road = None if pose.road is None else pose.road.dump()
        standing = -1 if pose.bridge is None else pose.road.bridges.index(pose.bridge)
        base = None if pose.base is None else self.dump(pose.base)
        return [list(pose.u), list(pose.z), pose.iterations, int(pose.status), pose.message, road, standing, base]

    def restore(self, data: list[Any]) -> Pose:
        """The pose that was dumped."""
        if self._tracks:
            return self._restored(*data)
        u, z, iterations, status, message, dumped, standing, base = data
        road = None if dumped is None else laid(self.model, dumped)
        if road is not None and standing >= 0:
            pose: Pose = road.bridges[standing].pose(tuple(u))
        else:
            pose = Pose(tuple(u), evaluated(self.model, tuple(u), tuple(z)))
        pose.road = None if road is None else road.around(pose.u[0])
        pose.iterations, pose.status, pose.message = iterations, status, message
        pose.base = None if base is None else self.restore(base)
        return pose

    def _restored(
        self, u: list[float], z: list[float], iterations: int, status: int, message: str, roads: Any, parts: list[Any]
    ) -> Pose:
        """The same of a pose that is put together from tracks."""
        pose = Pose(tuple(u), evaluated(self.model, tuple(u), tuple(z)))
        pose.iterations, pose.status, pose.message = iterations, status, message
        solvers = [solver for solver in self._tracks if solver is not None]
        if parts:
            pose.tracks = tuple([(s.model, s.restore(own)) for s, own in zip(solvers, parts, strict=True)])
        if roads is not None:
            models = [None if solver is None else solver.model for solver in self._tracks]
            pose.road = tuple(
                [
                    None if data is None else laid(model, data).around(value)
                    for model, data, value in zip(models, roads, u, strict=True)
                ]
            )
        return pose


def _solver_of(track: Track, anchor: Pose) -> Solver:
    """A solver of a track alone; the whole is what counts for the tolerance."""
    return Solver(track, inf, on_track(track, anchor))
