"""Solver: poses, rates and accelerations of one generated model."""

from __future__ import annotations

from math import inf, isfinite
from typing import Any

from .advance import CLOSE, GIVE_UP, NEAR_SINGULAR, SHORTEST_STEP, advance
from .estimate import estimated_errors, margin_of, with_driver_errors
from .limit import MOST_STEPS, NO_BLOCK, TOO_FAR, Limit, is_beyond, limit_beyond, limit_message
from .message import place
from .pose import ALONE, Model, Pose, Vector, evaluated, failed, tangent_of, with_map
from .singularity_map import restored_map
from .span import REGULAR
from .status import Status
from .survey import surveyed
from .tracks import MIXED, Track, on_track, rates_in_time, tracks_of
from .trusted_step import BENT, LONGEST_STEP, keeps_branch, straight_path, trusted_step

TOLERANCE = 1e-9  # residual relative to the size above which a sample is not ok


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
        u, z = model.ANCHOR
        self.anchor = Pose(u, evaluated(model, u, z, held=0)) if anchor is None else anchor
        self._one = len(u) == 1
        tracks = () if self._one else tracks_of(model, u, self.anchor.z)
        self._tracks = tuple([None if track is None else _solver_of(track, self.anchor) for track in tracks])
        mixes = any(self._tracks) and MIXED in model.BLOCK_DRIVERS
        self._mixed: Any = Track(model, MIXED, u, self.anchor.z) if mixes else None
        self._longest: float = LONGEST_STEP * model.REACH[0] if self._one else 0.0

    def solve(self, start: Pose, u: Vector) -> Pose:
        """Return the pose at driver values u, followed from a good pose in a straight line of the driver values."""
        if self._tracks:
            return self._by_tracks(start, u)
        if start.base is not None and u != start.u:
            start = start.base
        if u == start.u:
            return self._again(start)
        singularities = start.singularities
        if self._one:  # most samples: one trusted step, away from all that is singular
            s = u[0] - start.u[0]
            is_apart = singularities is None or singularities.low <= u[0] <= singularities.high
            if is_apart and -self._longest <= s <= self._longest:
                near = trusted_step(self.model, start, ALONE, s, u)
                if near is not None and near.watch <= self.tolerance >= near.residual:
                    margin = near.margin
                    if margin >= REGULAR:
                        return near
                    if margin > NEAR_SINGULAR and (margin >= CLOSE or keeps_branch(self.model, start, near, ALONE, s)):
                        singularities = surveyed(self.model, start, near)
                        if singularities is start.singularities:  # nothing new there
                            return near
        if not isfinite(sum(u)):
            return failed(start, u, Status.OUTSIDE, f"{place(self.model, u)} is not a finite number")
        if any(u[driver] < 0.0 for driver, *_ in self.model.DISTANCES):
            return failed(start, u, Status.OUTSIDE, f"{place(self.model, u)}: a distance cannot be negative")
        pose = advance(self.model, start, u, singularities)
        if isinstance(pose, Limit):
            return failed(start, u, Status.OUTSIDE, limit_message(self.model, pose, u))
        return self._checked(pose)

    def _by_tracks(self, start: Pose, u: Vector) -> Pose:
        """Return the pose that consists of the poses of the tracks, each followed along its own driver."""
        if u == start.u and (start.tracks or start.singularities):
            return start
        near = self._near(start, u)  # most samples: one trusted step of all drivers
        if near is not None:
            return near
        if not isfinite(sum(u)):
            return failed(start, u, Status.OUTSIDE, f"{place(self.model, u)} is not a finite number")
        if self._mixed is not None and any(u[driver] < 0.0 for driver, *_ in self._mixed.DISTANCES):
            return failed(start, u, Status.OUTSIDE, f"{place(self.model, u)}: a distance cannot be negative")
        pose = self._assembled(start, u, u, start.z) if self._mixed is None else self._followed(start, u)
        return self._checked(pose) if pose.good else pose

    def _assembled(self, start: Pose, u: Vector, target: Vector, z: Vector) -> Pose:
        """Return the pose of the tracks at u, on the path from `start` to `target`; all other blocks are as in z."""
        known = {track.driver: own for track, own in start.tracks}
        parts = []
        for k, solver in enumerate(self._tracks):
            if solver is None:
                continue
            before = known.get(k) or on_track(solver.model, start)
            own = solver.solve(before, (u[k],))
            if not own.good and u is not target:  # the message names the target
                beyond = solver.solve(before, (target[k],))
                own = own if beyond.good else beyond
            if not own.good:
                return failed(start, target, Status(own.status), own.message)
            z = solver.model.put(own.z, z)
            parts.append((solver.model, own))
        try:
            pose = Pose(u, evaluated(self.model, u, z))
        except (ArithmeticError, ValueError):  # an assigned coordinate has no value there
            return failed(start, target, Status.OUTSIDE, limit_message(self.model, Limit(start.u, NO_BLOCK), target))
        pose.tracks = tuple(parts)
        maps = {track.driver: own.singularities for track, own in parts}
        pose.singularities = tuple([maps.get(k) for k in range(len(u))])
        pose.iterations = sum([own.iterations for _, own in parts])
        statuses = [own.status for _, own in parts]
        if Status.NEAR_SINGULAR in statuses:
            pose.status = Status.NEAR_SINGULAR
        elif Status.BRIDGED in statuses:
            pose.status = Status.BRIDGED
        return pose

    def _followed(self, start: Pose, target: Vector) -> Pose:
        """Return the pose at `target`; blocks that depend on several drivers follow the tracks in trusted steps.

        The path is straight, as in `advance`, but at each step the tracks are solved first, and the other blocks are
        predicted along the chord of the tracks: they need no rates of the tracks, which may be singular.
        """
        model, pose = self.model, start
        if start.base is not None:
            pose = self._assembled(start, start.base.u, start.base.u, start.base.z)
            if not pose.good:
                return failed(start, target, Status(pose.status), pose.message)
        direction, distance = straight_path(model, pose.u, target)
        if distance > MOST_STEPS * LONGEST_STEP:
            return failed(start, target, Status.OUTSIDE, limit_message(model, Limit(pose.u, TOO_FAR), target))
        before, regular, limit = pose, pose, None
        step, iterations = LONGEST_STEP, 0
        for _ in range(MOST_STEPS):
            whole = distance <= step
            s = distance if whole else step
            u = target if whole else tuple([a + s * d for a, d in zip(pose.u, direction, strict=True)])
            trial = None if whole and pose is start else self._near(pose, u)
            if trial is None:
                trial = self._mixed_step(pose, u, target)
            if trial is not None:
                if not trial.good:
                    return failed(start, target, Status(trial.status), trial.message)
                iterations += trial.iterations
                margin = min([abs(trial.determinants[k]) for k in self._mixed.blocks])
                if whole:
                    trial.iterations = iterations
                    if margin < NEAR_SINGULAR:
                        trial.status = Status.NEAR_SINGULAR
                        trial.base = regular
                    return trial
                before, pose = pose, trial
                if margin >= NEAR_SINGULAR:
                    regular = pose
                distance -= s
                step = min(2.0 * step, LONGEST_STEP)
                continue
            step = 0.5 * s
            if step < SHORTEST_STEP * LONGEST_STEP:
                limit = limit or self._mixed_limit(before, pose, direction)
                if step < GIVE_UP * LONGEST_STEP or is_beyond(target, limit.u, direction, s):
                    break
        else:
            limit = Limit(pose.u, TOO_FAR)
        return failed(start, target, Status.OUTSIDE, limit_message(self._mixed, limit, target))

    def _mixed_step(self, pose: Pose, u: Vector, target: Vector) -> Pose | None:
        """Return one step of all blocks, or a failed pose if the tracks end before it.

        None if the blocks that depend on several drivers cannot be trusted to stay on their branch.
        """
        there = self._assembled(pose, u, target, pose.z)
        if not there.good:
            return there
        model, chord = self.model, tuple([b - a for a, b in zip(pose.z, there.z, strict=True)])
        if max([abs(a) / scale for a, scale in zip(chord, model.UNKNOWN_SCALES, strict=True)]) > BENT:
            return None
        mixed = self._mixed.with_rest(there.z, chord)
        path = tuple([b - a for a, b in zip(pose.u, u, strict=True)])
        start = on_track(mixed, pose)
        trial = trusted_step(mixed, start, path, 1.0, u)
        if trial is None or (trial.margin < REGULAR and not keeps_branch(mixed, start, trial, path, 1.0)):
            return None
        tracks, singularities, status, iterations = there.tracks, there.singularities, there.status, there.iterations
        there = Pose(u, evaluated(model, u, mixed.put(trial.z, there.z)), singularities)
        there.tracks, there.status, there.iterations = tracks, status, iterations + trial.iterations
        return there

    def _mixed_limit(self, before: Pose, pose: Pose, direction: Vector) -> Limit:
        """Return where the path of the blocks that depend on several drivers ends, just beyond a pose."""
        slopes, _ = rates_in_time(self.model, pose, direction, (0.0,) * len(direction))
        mixed = self._mixed.with_rest(pose.z, slopes)
        return limit_beyond(mixed, on_track(mixed, before), on_track(mixed, pose), direction)

    def _near(self, start: Pose, u: Vector) -> Pose | None:
        """Return the pose one trusted step away, or None if a track is near a singular point there."""
        if start.status or start.base is not None or not self._is_apart(start):
            return None
        direction, distance = straight_path(self.model, start.u, u)
        if not 0.0 < distance <= LONGEST_STEP:
            return None
        if start.singularities is not None:
            for singularities, value in zip(start.singularities, u, strict=True):
                if singularities is not None and not singularities.low <= value <= singularities.high:
                    return None
        near = trusted_step(self.model, start, direction, distance, u)
        if near is None or not self._is_apart(near) or not near.watch <= self.tolerance >= near.residual:
            return None
        if near.margin < REGULAR and not keeps_branch(self.model, start, near, direction, distance):
            return None
        near.singularities = start.singularities or (None,) * len(u)
        return near

    def _is_apart(self, pose: Pose) -> bool:
        """Return whether the blocks of all tracks are regular, and the others not near singular."""
        margin: float = pose.margin
        if margin >= REGULAR or self._mixed is None:
            return margin >= REGULAR
        of_tracks = [abs(pose.determinants[k]) for k, by in enumerate(self.model.BLOCK_DRIVERS) if by != MIXED]
        return margin >= NEAR_SINGULAR and min(of_tracks) >= REGULAR

    def _again(self, start: Pose) -> Pose:
        """Return the pose at the driver values of `start`: `start` itself, or its checked copy if it is the anchor."""
        pose = start
        if start.margin < REGULAR and start.status == Status.OK and start.singularities is None:
            singularities = surveyed(self.model, start, start) if self._one else None
            found = start if singularities is None else advance(self.model, start, start.u, singularities)
            if not isinstance(found, Limit):
                pose = found
            if pose is start and pose.margin < NEAR_SINGULAR:
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
            )
            return
        open_rows = zip(self.model.WATCHES, self.watch(pose), strict=True)
        name, value = max(open_rows, key=lambda row: abs(row[1]))
        gap = abs(value) * self.model.SIZE
        pose.status = Status.INCONSISTENT
        pose.message = (
            f"{place(self.model, pose.u)}: redundant row {name} does not close: gap {gap:.3g} {self.model.LENGTH_UNIT}"
        )

    def _first(self, pose: Pose, ud: Vector) -> Vector:
        """Return the argument of the model's rates: z' = dz/du with one driver, else zd."""
        if self._one:
            return tangent_of(self.model, pose)[0]
        return (
            self._both(pose, ud, (0.0,) * len(ud))[0]
            if pose.is_bridged
            else tuple(self.model.velocity(pose.values, ud))
        )

    def _both(self, pose: Pose, ud: Vector, udd: Vector) -> tuple[Vector, Vector]:
        """Return the arguments of the model's accelerations: z' and z'' with one driver, else zd and zdd."""
        if self._one:
            return tangent_of(self.model, pose)
        return rates_in_time(self.model, pose, ud, udd)

    def outputs(self, pose: Pose) -> Vector:
        """Return positions of the model's OUTPUTS."""
        return self.model.outputs(pose.values)  # type: ignore[no-any-return]  # generated code has no types

    def rates(self, pose: Pose, ud: Vector) -> Vector:
        """Return rates of the OUTPUTS at driver speeds ud."""
        return self.model.rates(pose.values, ud, self._first(pose, ud))  # type: ignore[no-any-return]

    def accelerations(self, pose: Pose, ud: Vector, udd: Vector) -> Vector:
        """Return accelerations of the OUTPUTS at driver speeds ud and accelerations udd."""
        first, second = self._both(pose, ud, udd)
        return self.model.accelerations(pose.values, ud, udd, first, second)  # type: ignore[no-any-return]

    def motion(self, pose: Pose, ud: Vector, udd: Vector) -> Vector:
        """Return positions, rates and accelerations of the OUTPUTS in one row; common terms are computed once."""
        if self._one and pose.tangent is None:  # the rule in an FMU: each pose is read once, before the next step
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
        if self._tracks:
            maps = pose.singularities and [None if one is None else one.dump() for one in pose.singularities]
            parts = [self._tracks[track.driver].dump(own) for track, own in pose.tracks]
            base = None if pose.base is None else [list(pose.base.u), list(pose.base.z)]
            return [list(pose.u), list(pose.z), pose.iterations, int(pose.status), pose.message, maps, parts, base]
        known = None if pose.singularities is None else pose.singularities.dump()
        number = -1 if pose.bridge is None else pose.singularities.bridges.index(pose.bridge)
        base = None if pose.base is None else self.dump(pose.base)
        return [list(pose.u), list(pose.z), pose.iterations, int(pose.status), pose.message, known, number, base]

    def restore(self, data: list[Any]) -> Pose:
        """Return the pose that `dump` gave as plain numbers."""
        if self._tracks:
            return self._restored(*data)
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

    def _restored(
        self,
        u: list[float],
        z: list[float],
        iterations: int,
        status: int,
        message: str,
        maps: Any,
        parts: list[Any],
        base: list[list[float]] | None,
    ) -> Pose:
        """Return the same of a pose that consists of tracks."""
        pose = Pose(tuple(u), evaluated(self.model, tuple(u), tuple(z)))
        pose.iterations, pose.status, pose.message = iterations, status, message
        if base is not None:
            there, unknowns = map(tuple, base)
            pose.base = Pose(there, evaluated(self.model, there, unknowns))
        solvers = [solver for solver in self._tracks if solver is not None]
        if parts:
            pose.tracks = tuple([(s.model, s.restore(own)) for s, own in zip(solvers, parts, strict=True)])
        if maps is not None:
            models = [None if solver is None else solver.model for solver in self._tracks]
            pose.singularities = tuple(
                [
                    None if data is None else restored_map(model, data).around(value)
                    for model, data, value in zip(models, maps, u, strict=True)
                ]
            )
        return pose


def _solver_of(track: Track, anchor: Pose) -> Solver:
    """Return a solver of a track alone; the tolerance applies to the whole pose only."""
    return Solver(track, inf, on_track(track, anchor))
