"""Mixed: blocks that depend on several drivers, where others depend on one."""

from __future__ import annotations

from .advance import Path
from .limit import Limit, limit_beyond, limit_message
from .pose import Pose, Vector, evaluated, failed
from .span import REGULAR
from .status import Status
from .tracks import TrackModel, Tracks, on_track, rates_in_time
from .trusted_step import BENT, FALL, TRUST, keeps_branch, trusted_step


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
    slopes, _ = rates_in_time(tracks.model, pose, direction, (0.0,) * len(direction))
    mixed = mixed.with_rest(pose.z, slopes)
    return limit_beyond(mixed, on_track(mixed, path.before), on_track(mixed, pose), direction)
