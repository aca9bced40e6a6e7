"""Tracks: blocks that depend on one driver alone are followed along that driver, independently of the others.

The blocks that depend on one driver, as those of two machines in one file do, are a mechanism with that driver: its
track. A track has singular points, bridges and limits of its own. A pose of the whole mechanism consists of one pose of
each track. Blocks that depend on several drivers come after the tracks: they follow both the drivers and the tracks.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from itertools import pairwise
from math import inf, sqrt
from typing import Any, Protocol

from .advance import NEAR, Path
from .limit import NO_BLOCK, Limit, limit_beyond, limit_message
from .linear import Matrix
from .pose import Found, Model, Pose, Status, Vector, evaluated, failed, tangent_of
from .singularity_map import restored_map
from .span import REGULAR
from .trusted_step import BENT, FALL, LONGEST_STEP, TRUST, keeps_branch, straight_path, trusted_step

MIXED = -1  # in place of a block's driver: it depends on several


class TrackModel:
    """The blocks of a model that depend on one of its drivers, as a model with that driver alone.

    driver: its index; MIXED: the blocks that depend on several drivers, as a model with all drivers. u, z: driver
    values and unknowns of an assembled pose: there the rest of the model stays.
    """

    def __init__(self, model: Model, driver: int, u: Vector, z: Vector) -> None:
        self._model = model
        self.driver = driver
        self._u, self._z = u, z
        self.blocks = tuple([k for k, by in enumerate(model.BLOCK_DRIVERS) if by == driver])
        self.places = tuple([place for k in self.blocks for place in range(*model.BLOCKS[k])])
        self._outside = sum([1 << k for k, by in enumerate(model.BLOCK_DRIVERS) if by != driver])
        self._along = tuple([float(k == driver) for k in range(len(u))])
        self._rest = (0.0,) * len(u)
        self._mixes = MIXED in model.BLOCK_DRIVERS
        self._slopes: Vector = (0.0,) * len(z)
        self.SIZE, self.OFFSET, self.LENGTH_UNIT = model.SIZE, model.OFFSET, model.LENGTH_UNIT
        self.ROW_OFFSET = model.ROW_OFFSET
        own = slice(None) if driver == MIXED else slice(driver, driver + 1)
        self.DRIVERS = tuple(model.DRIVERS[own])
        self.DRIVER_KINDS = tuple(model.DRIVER_KINDS[own])
        self.REACH = tuple(model.REACH[own])
        self.UNKNOWNS = self.of(model.UNKNOWNS)
        self.UNKNOWN_IS_ANGLE = self.of(model.UNKNOWN_IS_ANGLE)
        self.UNKNOWN_SCALES = self.of(model.UNKNOWN_SCALES)
        self.ROW_SCALES = tuple([model.ROW_SCALES[k] for k in self.blocks])
        at = {block: k for k, block in enumerate(self.blocks)}
        self.TALL = tuple([at[block] for block in model.TALL if block in at])
        self.DISTANCES = tuple(
            [
                (by if driver == MIXED else 0, at[block], *row)
                for by, block, *row in model.DISTANCES
                if block in at and driver in (by, MIXED)
            ]
        )
        self.ANCHOR = u[own], self.of(z)
        self.WATCHES = ()
        self.LAW_UNITS, self.LAW_TURNS, self.LAW_LENGTHS = model.LAW_UNITS, model.LAW_TURNS, model.LAW_LENGTHS
        if model.LAW_UNITS:
            self.law_positions = model.law_positions
            self.law_steps, self.law_slopes = model.law_steps, model.law_slopes
        ends = [0]
        for k in self.blocks:
            low, high = model.BLOCKS[k]
            ends.append(ends[-1] + high - low)
        self.BLOCKS = tuple(pairwise(ends))

    def with_rest(self, z: Vector, slopes: Vector) -> TrackModel:
        """Return the same blocks while the rest of the model is at other unknowns and moves.

        Args:
            z: Unknowns of the whole model; those of the track's own blocks are not used.
            slopes: Their derivatives along the path of the drivers; second derivatives are 0.

        """
        there = copy(self)
        there._z, there._slopes = z, slopes
        return there

    def of(self, whole: Sequence[Any]) -> tuple[Any, ...]:
        """Return the track's items of a sequence with one item for each unknown of the model."""
        return tuple([whole[k] for k in self.places])

    def put(self, own: Sequence[float], whole: Sequence[float]) -> Vector:
        """Return `whole`, one item for each unknown of the model, with the track's items replaced by `own`."""
        values = list(whole)
        for k, value in zip(self.places, own, strict=True):
            values[k] = value
        return tuple(values)

    def mask(self, held: int) -> int:
        """Return bits of the track's blocks as bits of the model's."""
        return sum([1 << block for k, block in enumerate(self.blocks) if held >> k & 1])

    def position(self, u: Vector, z: Vector, zd: Vector, zdd: Vector, s: float, held: int = 0, *enough: float) -> Found:
        """Return the same as a model's `position`."""
        still = (0.0,) * len(self._z)
        driven = u if self.driver == MIXED else (*self._u[: self.driver], u[0], *self._u[self.driver + 1 :])
        found = self._model.position(
            driven,
            self.put(z, self._z),
            self.put(zd, still),
            self.put(zdd, still),
            s,
            self._outside | self.mask(held),
            *enough,
        )
        determinants = tuple([found[1][k] for k in self.blocks])
        residual = found[3]
        if self._mixes:  # blocks that follow the track do not close while they rest
            rows = self._model.residuals(found[7])
            squares = [sum([r * r for r in rows[k]]) for k in self.blocks]
            residual = sqrt(max(squares) if sum(squares) < inf else sum(squares))  # a NaN stays
        return (
            self.of(found[0]),
            determinants,
            min([abs(determinant) for determinant in determinants]),
            residual,
            *found[4:6],
            0.0,
            found[7],
        )

    def tangent(self, values: Any) -> tuple[Vector, Vector]:
        """Return the same as a model's `tangent`."""
        zd = self.velocity(values, self._along)
        return zd, self.acceleration(values, self._along, self._rest, zd)

    def velocity(self, values: Any, ud: Vector, given: Vector = (), held: int = 0) -> Vector:
        """Return the same as a model's `velocity`."""
        whole = self.put(given or (0.0,) * len(self.places), self._slopes)
        driven = self._driven(ud)
        return self.of(self._model.velocity(values, driven, whole, self._outside | self.mask(held)))

    def acceleration(
        self, values: Any, ud: Vector, udd: Vector, zd: Vector, given: Vector = (), held: int = 0
    ) -> Vector:
        """Return the same as a model's `acceleration`."""
        still = (0.0,) * len(self._z)
        first, whole = self.put(zd, self._slopes), self.put(given or (0.0,) * len(self.places), still)
        mask = self._outside | self.mask(held)
        return self.of(self._model.acceleration(values, self._driven(ud), self._driven(udd), first, whole, mask))

    def law_motion(self, values: Any, ud: Vector, udd: Vector, zd: Vector, zdd: Vector) -> Vector:
        """Return the same as a model's `law_motion`."""
        first, second = self.put(zd, self._slopes), self.put(zdd, (0.0,) * len(self._z))
        return tuple(self._model.law_motion(values, self._driven(ud), self._driven(udd), first, second))

    def _driven(self, rate: Vector) -> Vector:
        return (*self._rest[: self.driver], rate[0], *self._rest[self.driver + 1 :]) if len(rate) == 1 else rate

    def jacobians(self, values: Any) -> list[Matrix]:
        """Return the same as a model's `jacobians`."""
        every = self._model.jacobians(values)
        return [every[k] for k in self.blocks]

    def residuals(self, values: Any) -> list[list[float]]:
        """Return the same as a model's `residuals`."""
        every = self._model.residuals(values)
        return [every[k] for k in self.blocks]


class TrackSolver(Protocol):
    """A solver of one track alone."""

    model: Any

    def solve(self, start: Pose, u: Vector) -> Pose:
        """Return the pose at a driver value, followed from a good pose."""

    def dump(self, pose: Pose) -> list[Any]:
        """Return a pose as plain numbers."""

    def restore(self, data: list[Any]) -> Pose:
        """Return the pose that `dump` gave as plain numbers."""


class Tracks:
    """The tracks of a model, each with a solver of its own.

    solvers: one for each driver, None where no block depends on it alone; mixed: the blocks that depend on several
    drivers, None if there are none.
    """

    def __init__(
        self, model: Model, tolerance: float, solvers: Sequence[TrackSolver | None], mixed: TrackModel | None
    ) -> None:
        self.model = model
        self.mixed = mixed
        self._tolerance = tolerance
        self._solvers = solvers

    def assembled(self, start: Pose, u: Vector, target: Vector, z: Vector) -> Pose:
        """Return the pose of the tracks at u, on the path from `start` to `target`; all other blocks are as in z."""
        known = {track.driver: own for track, own in start.tracks}
        parts = []
        for k, solver in enumerate(self._solvers):
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

    def near(self, start: Pose, u: Vector) -> Pose | None:
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
        if near is None or not self._is_apart(near) or not near.watch <= self._tolerance >= near.residual:
            return None
        if near.margin < REGULAR and not keeps_branch(self.model, start, near, direction, distance):
            return None
        near.singularities = start.singularities or (None,) * len(u)
        return near

    def _is_apart(self, pose: Pose) -> bool:
        """Return whether the blocks of all tracks are regular, and the others not near singular."""
        margin: float = pose.margin
        if margin >= REGULAR or self.mixed is None:
            return margin >= REGULAR
        of_tracks = [abs(pose.determinants[k]) for k, by in enumerate(self.model.BLOCK_DRIVERS) if by != MIXED]
        return margin >= NEAR and min(of_tracks) >= REGULAR

    def dump(self, pose: Pose) -> list[Any]:
        """Return a pose that consists of tracks as plain numbers."""
        maps = pose.singularities and [None if one is None else one.dump() for one in pose.singularities]
        solvers = [solver for solver in self._solvers if solver is not None]
        parts = [solver.dump(own) for solver, (_, own) in zip(solvers, pose.tracks, strict=False)]  # or no parts
        base = None if pose.base is None else [list(pose.base.u), list(pose.base.z)]
        return [list(pose.u), list(pose.z), pose.iterations, int(pose.status), pose.message, maps, parts, base]

    def restore(self, data: list[Any]) -> Pose:
        """Return the pose that `dump` gave as plain numbers."""
        u, z, iterations, status, message, maps, parts, base = data
        pose = Pose(tuple(u), evaluated(self.model, tuple(u), tuple(z)))
        pose.iterations, pose.status, pose.message = iterations, status, message
        if base is not None:
            there, unknowns = map(tuple, base)
            pose.base = Pose(there, evaluated(self.model, there, unknowns))
        solvers = [solver for solver in self._solvers if solver is not None]
        if parts:
            pose.tracks = tuple([(s.model, s.restore(own)) for s, own in zip(solvers, parts, strict=True)])
        if maps is not None:
            models = [None if solver is None else solver.model for solver in self._solvers]
            pose.singularities = tuple(
                [
                    None if known is None else restored_map(model, known).around(value)
                    for model, known, value in zip(models, maps, u, strict=True)
                ]
            )
        return pose


def tracks_of(model: Model, u: Vector, z: Vector) -> tuple[TrackModel | None, ...]:
    """Return the track of each driver, None where no block depends on it alone; an empty tuple if there is no track."""
    by = getattr(model, "BLOCK_DRIVERS", ())
    if not by or max(by) == MIXED:
        return ()
    return tuple([TrackModel(model, k, u, z) if k in by else None for k in range(len(u))])


def held_blocks(pose: Pose) -> int:
    """Return bits of the blocks that are interpolated at a pose."""
    held = 0 if pose.bridge is None else pose.bridge.span.held
    for track, own in pose.tracks:
        if own.bridge is not None:
            held |= track.mask(own.bridge.span.held)
    return held


def on_track(track: TrackModel, pose: Pose) -> Pose:
    """Return the track's part of a pose of the whole mechanism."""
    if track.driver == MIXED:
        determinants = tuple([pose.determinants[k] for k in track.blocks])
        margin = min([abs(determinant) for determinant in determinants])
        return Pose(pose.u, (track.of(pose.z), determinants, margin, pose.residual, 0, 0.0, 0.0, pose.values))
    u = (pose.u[track.driver],)
    singularities = None if pose.singularities is None else pose.singularities[track.driver]
    return Pose(u, evaluated(track, u, track.of(pose.z)), None if singularities is None else singularities.around(u[0]))


def rates_in_time(model: Model, pose: Pose, ud: Vector, udd: Vector | None) -> tuple[Vector, Vector]:
    """Return first and second derivative of the unknowns in time; interpolated blocks by the chain rule.

    The second one is empty without accelerations udd.
    """
    held = held_blocks(pose) if pose.is_bridged else 0
    if not held:
        zd = tuple(model.velocity(pose.values, ud))
        return zd, () if udd is None else tuple(model.acceleration(pose.values, ud, udd, zd))
    first = second = (0.0,) * len(pose.z)
    for track, own in pose.tracks:
        if own.bridge is not None:
            v, a = ud[track.driver], 0.0 if udd is None else udd[track.driver]
            zd, zdd = tangent_of(track, own)
            first = track.put([v * d for d in zd], first)
            second = track.put([v * v * dd + a * d for d, dd in zip(zd, zdd, strict=True)], second)
    zd = tuple(model.velocity(pose.values, ud, first, held))
    return zd, () if udd is None else tuple(model.acceleration(pose.values, ud, udd, zd, second, held))


def sample_rates(model: Model, pose: Pose, ud: Vector, udd: Vector) -> tuple[Vector, Vector, Vector]:
    """Return first and second derivative of the unknowns in time, and dz/du, for one driver after another."""
    if len(ud) == 1:
        slopes, second = tangent_of(model, pose)
        v, a = ud[0], udd[0]
        zd = tuple([d * v for d in slopes])
        return zd, tuple([dd * (v * v) + d * a for d, dd in zip(slopes, second, strict=True)]), slopes
    unit = [tuple([float(k == number) for k in range(len(ud))]) for number in range(len(ud))]
    slopes = tuple([d for speeds in unit for d in rates_in_time(model, pose, speeds, None)[0]])
    return *rates_in_time(model, pose, ud, udd), slopes


def advance_mixed(tracks: Tracks, mixed: TrackModel, start: Pose, target: Vector) -> Pose:
    """Return the pose at `target`; blocks that depend on several drivers follow the tracks in trusted steps.

    The path is straight, as in `advance`, but at each step the tracks are solved first, and the other blocks are
    predicted along the chord of the tracks: they need no rates of the tracks, which may be singular. Steps near a
    singular pose are so short that the tracks stay on their chord.
    """
    pose = start
    if start.base is not None:
        pose = tracks.assembled(start, start.base.u, start.base.u, start.base.z)
        if not pose.good:
            return failed(start, target, Status(pose.status), pose.message)
    path = Path(tracks.model, pose, target)
    for _ in range(path.most_steps):
        s, u = path.ahead()
        trial = None if u is target and path.pose is start else tracks.near(path.pose, u)
        if trial is None:
            trial = _mixed_step(tracks, mixed, path.pose, u, target)
        if trial is None:
            path.shorten(s, lambda: _mixed_limit(tracks, mixed, path))
        elif trial.good:
            path.iterations += trial.iterations
            path.accept(trial, s, min([abs(trial.determinants[k]) for k in mixed.blocks]))
        else:
            return failed(start, target, Status(trial.status), trial.message)
        if path.end is not None:
            break
    end = path.terminate()
    if isinstance(end, Limit):
        return failed(start, target, Status.OUTSIDE, limit_message(mixed, end, target))
    return end


def _mixed_step(tracks: Tracks, mixed: TrackModel, pose: Pose, u: Vector, target: Vector) -> Pose | None:
    """Return one step of all blocks, or a failed pose if the tracks end before it.

    None if the blocks that depend on several drivers cannot be trusted to stay on their branch, or if they may not
    close in between, because the tracks bend away from their chord there.
    """
    margin = min([abs(pose.determinants[k]) for k in mixed.blocks])
    middle = None
    if margin < REGULAR / FALL:  # the step may end at a pose that is not regular
        half = tuple([0.5 * (a + b) for a, b in zip(pose.u, u, strict=True)])
        middle = tracks.assembled(pose, half, half, pose.z)
    there = tracks.assembled(pose, u, target, pose.z)
    if not there.good:
        return there
    model, chord = tracks.model, tuple([b - a for a, b in zip(pose.z, there.z, strict=True)])
    if max([abs(a) / scale for a, scale in zip(chord, model.UNKNOWN_SCALES, strict=True)]) > BENT:
        return None
    mixed = mixed.with_rest(there.z, chord)
    path = tuple([b - a for a, b in zip(pose.u, u, strict=True)])
    start = on_track(mixed, pose)
    trial = trusted_step(mixed, start, path, 1.0, u)
    if trial is None or (trial.margin < REGULAR and not keeps_branch(mixed, start, trial, path, 1.0)):
        return None
    if middle is not None and middle.good:
        bends = zip(pose.z, middle.z, there.z, model.UNKNOWN_SCALES, strict=True)
        bent = max([abs(b - 0.5 * (a + c)) / scale for a, b, c, scale in bends])
        least = min(margin, trial.margin)
        if TRUST * bent > least * least:  # blocks close where the square of their sine is positive
            return None
    own, singularities, status, iterations = there.tracks, there.singularities, there.status, there.iterations
    there = Pose(u, evaluated(model, u, mixed.put(trial.z, there.z)), singularities)
    there.tracks, there.status, there.iterations = own, status, iterations + trial.iterations
    return there


def _mixed_limit(tracks: Tracks, mixed: TrackModel, path: Path) -> Limit:
    """Return where the path of the blocks that depend on several drivers ends, just beyond its last pose."""
    pose, direction = path.pose, path.direction
    slopes, _ = rates_in_time(tracks.model, pose, direction, None)
    mixed = mixed.with_rest(pose.z, slopes)
    return limit_beyond(mixed, on_track(mixed, path.before), on_track(mixed, pose), direction)
