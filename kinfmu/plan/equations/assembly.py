"""Assembly: the closed pose near the start poses, regular and at the start of the drivers' laws."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import AssemblyError, listed
from kinfmu.plan.equations.blocks import Ordered, ordered_blocks
from kinfmu.plan.equations.closing import (
    CLOSED,
    affordable,
    branches,
    close,
    closed_up_to,
    dependent_rows,
    followed,
    margin,
    offset_rounding,
    reaches,
)
from kinfmu.plan.equations.part import Part
from kinfmu.plan.equations.reach import cannot_close
from kinfmu.plan.equations.start_poses import (
    StartValues,
    distance_from_start,
    law_targets,
    start_from_poses,
    with_angles,
)
from kinfmu.plan.equations.system import System

SINGULAR = 1e-6  # margin below which a start pose counts as singular: double roots are known to half the digits
COMFORTABLE = 0.03  # margin below which a pose near the start is a better anchor
COMFORTABLE_WITHOUT_BRIDGES = 1e-3  # the same with several drivers: solved to round-off over the margin
OFFSET = 0.1  # [rad, sizes]; distance from a singular start pose at which the anchor is sought
MOST_DENSE = 900  # coordinates; with more, methods on all rows at once take minutes
NEAR = 0.5  # [rad, sizes]; a pose within this distance of the start poses is accepted
RESTARTS = 60  # random values of open start poses; blocks that close in two ways need a few each
RESTARTS_TO_COME_NEARER = 15  # if the first pose is regular and only not near the start poses
DENSE_RESTARTS = 8
_LOOKS = 4  # random poses at which the structure of the rows is determined
_TRUST = 10.0  # a correction of a prediction must be this much smaller than the margin: other branches are farther away
_PARTS = (1.0, 0.3, 0.1, 0.03, 0.01)  # of OFFSET, at which branches near a singular start pose are sought
_LEAST_PARTS = 2
_NEARBY_STARTS = 6  # poses tried near a start that almost closes
_SPREAD = 0.3  # [rad, sizes]; their distance from the start pose
_NEARLY = 0.01  # residual of a pose that almost closes


class Assembled(NamedTuple):
    """A closed pose: coordinates q (n,), driver values u (d,), and its margin.

    margin: the smallest over the blocks of smallest over largest singular value of the scaled Jacobian; 0 at a singular
    pose.
    """

    q: FloatArray
    u: FloatArray
    margin: float


class AssembledStart(NamedTuple):
    """Where a mechanism starts: the rough pose and driver values, and the closed pose found from them (None: none)."""

    start: StartValues
    pose: Assembled | None


def find_assembly(system: System) -> AssembledStart:
    """Return the start values of a mechanism and its assembled pose.

    The start poses' driver values are tried first (driven angles moved by whole turns to the start of the laws). From
    there the pose is followed to the start of the laws. If the pose does not close, or a limit lies between, the
    mechanism is assembled at the start of the laws.

    The pose is the closed one nearest to the start values. If it is singular or nearly so, it is the most regular one
    of it and of poses near it.

    Raise an AssemblyError if the mechanism has more than MOST_DENSE coordinates and does not assemble block by block.
    """
    given, law = start_from_poses(system), law_targets(system)
    found = _assembled(system, given)
    if not given.is_followed or len(system.coordinates) > MOST_DENSE:
        return AssembledStart(given, found)
    if found is not None:
        q, u = followed(system, found.q, found.u, law)
        if np.array_equal(u, law):
            if not SINGULAR < margin(system, q) <= comfortable(system):
                return AssembledStart(given, found)
            # Between two limits close to each other the last step may skip what no pose closes.
            near = StartValues(q, law, is_followed=True)
            return AssembledStart(near, _assembled(system, near))
    if found is None and len(system.rows) > len(system.coordinates):
        return AssembledStart(given, None)  # contradictory joints may close at isolated poses by chance
    moved = StartValues(with_angles(system, given.q, law - given.u), law, is_followed=True, is_moved=True)
    there = _assembled(system, moved)
    return (
        AssembledStart(moved, there) if there is not None and there.margin > SINGULAR else AssembledStart(given, found)
    )


def closed_start(system: System, q: FloatArray, u: FloatArray) -> AssembledStart:
    """Return the start of a mechanism that closes in a pose q (n,) at driver values u (d,) as it is."""
    pose = _without_spare_rows(system, q, u) or Assembled(q, u, margin(system, q))
    return AssembledStart(StartValues(q, u), pose)


def start_values(system: System) -> StartValues:
    """Return the start values of `find_assembly`; nothing is assembled if start poses and laws agree."""
    given = start_from_poses(system)
    return find_assembly(system).start if given.is_followed else given


def _assembled(system: System, start: StartValues) -> Assembled | None:
    """Return the closed pose nearest to a rough pose at its driver values.

    Block by block where rows and coordinates allow an order; all rows at once where they do not, or where a block does
    not close or is singular. None if the rows, all together, do not close near the rough pose.
    """
    u = start.u
    order = in_order(system)
    found, trouble = _assembled_in_order(system, u, start.q, order)
    if found is None and len(system.coordinates) <= MOST_DENSE and cannot_close(Part(system), u):
        return None
    if order.blocks and (found is None or distance_from_start(system, start, found.q) > NEAR):
        found = assemble_from_random_starts(system, start, found, order)
    if found is not None:
        return found
    if len(system.coordinates) > MOST_DENSE:
        raise AssemblyError(
            f"a mechanism of {len(system.coordinates)} coordinates (more than {MOST_DENSE}) must assemble block by "
            f"block from its start pose, but {trouble}"
        )
    q, gap = close(system, start.q, u)
    if gap > closed_up_to(system):
        found = _assembled_nearby(system, start) if gap < _NEARLY else None
        return found if found or order.blocks else assemble_from_random_starts(system, start, None, order)
    found = _without_spare_rows(system, q, u) or Assembled(q, u, margin(system, q))
    if found.margin > comfortable(system) or (found.margin > SINGULAR and not len(u)):
        return found  # without drivers it stays where it is
    nearby = []
    for side in (1.0, -1.0):
        if found.margin > SINGULAR:
            there, at = followed(system, q, u, u + side * OFFSET * reaches(system), trust=_TRUST)
            nearby.append(Assembled(there, at, margin(system, there)))
            continue
        near = _nearby(system, found, side)
        nearby += [] if near is None else [near]
    return max([found, *nearby], key=lambda pose: pose.margin)


def closes_nearby(system: System, singular: Assembled) -> bool:
    """Return True if a closed pose is found near a singular one; of a large system few are sought."""
    return any(_nearby(system, singular, side) is not None for side in (1.0, -1.0))


def _nearby(system: System, singular: Assembled, side: float) -> Assembled | None:
    """Return a closed pose on one side of a singular one, at the first distance of _PARTS that has one.

    Of a large system only the largest distances are tried.
    """
    for part in _PARTS[: max(_LEAST_PARTS, affordable(len(singular.q)))]:
        u = singular.u + side * part * OFFSET * reaches(system)
        near = next(iter(branches(system, singular.q, u)), None)
        if near is not None:
            return Assembled(near, u, margin(system, near))
    return None


def _assembled_nearby(system: System, start: StartValues) -> Assembled | None:
    """Return the pose nearest to the start poses, at slightly other driver values, that leads to the start, if any.

    Near a change point a rough pose may lie between the branches, where no row closes by a small gap; with redundant
    rows poses near it are tried too.
    """
    rng = np.random.default_rng(1989)
    nearby: list[tuple[float, Assembled]] = []
    for trial in range(_NEARBY_STARTS if len(system.rows) > len(system.coordinates) else 1):
        spread = _SPREAD * system.column_scales * rng.uniform(-1.0, 1.0, len(start.q)) if trial else 0.0
        for side in (1.0, -1.0):
            u = start.u + side * OFFSET * reaches(system)
            q, gap = close(system, start.q + spread, u)
            near = Assembled(q, u, margin(system, q) if gap <= closed_up_to(system) else 0.0)
            if near.margin > SINGULAR and np.array_equal(followed(system, q, u, start.u)[1], start.u):
                nearby.append((distance_from_start(system, start, near.q), near))
    return min(nearby, key=lambda pose: pose[0])[1] if nearby else None


def comfortable(system: System) -> float:
    """Return the margin from which a pose is a good anchor: with one driver, outside a bridge's window."""
    return COMFORTABLE if len(system.mechanism.drivers) == 1 else COMFORTABLE_WITHOUT_BRIDGES


def _without_spare_rows(system: System, q: FloatArray, u: FloatArray) -> Assembled | None:
    """Return a closed pose with its margin by blocks, without rows that depend on earlier ones there.

    None if that leaves no order of solving, as at a singular pose, or a block that is nearly singular.
    """
    joints = Part(system, range(system.joint_row_count))
    spare = dependent_rows(joints.jacobian(q))
    rows = [k for k in range(len(system.rows)) if k not in spare]
    order = in_order(system, rows) if len(rows) == len(system.coordinates) else Ordered(())
    if not order.blocks:
        return None
    blocks = [(Part(system, members, columns, q), list(columns)) for members, columns in order.blocks]
    least = min(_block_margin(part.jacobian(q[columns])) for part, columns in blocks)
    return Assembled(q, u, least) if least > comfortable(system) else None


def in_order(system: System, rows: Sequence[int] | None = None) -> Ordered:
    """Return the order of solving rows (all if None), by index into System.rows.

    A row meets the coordinates along which its gradient does not vanish at every one of some random poses: at one pose
    a cam that dwells does not show which coordinate it moves.
    """
    rng = np.random.default_rng(1989)
    poses = rng.uniform(-3.0, 3.0, (_LOOKS, len(system.coordinates))) * system.column_scales
    meets: list[list[int]] = []
    for member in system.members:
        meets += [[member.columns[k] for k in met] for met in system.columns_met(member, poses[:, member.columns])]
    chosen = range(len(meets)) if rows is None else rows
    of_drivers = sum(row >= system.joint_row_count for row in chosen)
    order = ordered_blocks([meets[row] for row in chosen], len(system.coordinates), of_drivers)
    return Ordered(
        tuple((tuple(chosen[k] for k in members), columns) for members, columns in order.blocks),
        tuple(chosen[k] for k in order.unmatched_rows),
        order.unmatched_columns,
    )


def assemble_from_random_starts(
    system: System, start: StartValues, first: Assembled | None, order: Ordered
) -> Assembled | None:
    """Return the pose nearest to the start poses, among a first pose and poses from random starts.

    Random starts have seeded random values for what the start poses leave open. The first pose within NEAR is taken,
    else the nearest of all.
    """
    u = start.u
    is_open = np.array([value is None for body in system.mechanism.moving_bodies for value in body.start])
    if not is_open.any():
        return first
    middle = np.mean(system.mechanism.ground_points or [(0.0, 0.0)], axis=0)
    centre = np.tile([*middle, 0.0], len(is_open) // 3)
    spread = np.tile([1.5 * system.size, 1.5 * system.size, np.pi], len(is_open) // 3)
    rng = np.random.default_rng(1989)
    if len(is_open) > MOST_DENSE:
        return first
    nearest = first
    restarts = DENSE_RESTARTS if not order.blocks else RESTARTS if first is None else RESTARTS_TO_COME_NEARER
    for _ in range(restarts):
        rough = np.where(is_open, centre + spread * rng.uniform(-1.0, 1.0, len(is_open)), start.q)
        if order.blocks:
            found, _ = _assembled_in_order(system, u, rough, order)
        else:
            q, gap = close(system, rough, u)
            found = Assembled(q, u, margin(system, q)) if gap <= closed_up_to(system) else None
        if found is None or found.margin <= comfortable(system):
            continue
        poses = [found] if nearest is None else [nearest, found]
        nearest = min(poses, key=lambda pose: distance_from_start(system, start, pose.q))
        if distance_from_start(system, start, nearest.q) <= NEAR:
            break
    return nearest


def _assembled_in_order(
    system: System, u: FloatArray, start: FloatArray, order: Ordered
) -> tuple[Assembled, str] | tuple[None, str]:
    """Return a rough pose closed block by block, or None and the reason.

    The pose is never nearly singular.
    """
    if order.unmatched_columns:
        return None, f"nothing determines {listed(system.coordinates[k] for k in order.unmatched_columns[:5])}"
    if order.unmatched_rows:
        return None, f"there are rows to spare: {listed(system.rows[k].name for k in order.unmatched_rows[:5])}"
    q, least = start.copy(), 1.0
    for rows, columns in order.blocks:
        part = Part(system, rows, columns, q)
        q[list(columns)], gap = close(part, q[list(columns)], u)
        if gap > CLOSED:
            return None, f"the rows {listed(system.rows[k].name for k in rows[:5])} do not close"
        least = min(least, _block_margin(part.jacobian(q[list(columns)])))
        if least <= comfortable(system):
            return None, f"the rows {listed(system.rows[k].name for k in rows[:5])} are singular there or nearly so"
    whole = Part(system)
    open_rows = np.flatnonzero(np.abs(whole.residual(q, u)) - offset_rounding(whole, q) > CLOSED)
    if open_rows.size:  # a cam that dwells at every random pose does not show what it moves
        return None, f"the rows {listed(system.rows[k].name for k in open_rows[:5])} open when others close"
    return Assembled(q, u, least), ""


def _block_margin(jacobian: FloatArray) -> float:
    """Return the smallest over the largest singular value; of a single row its slope."""
    if jacobian.size == 1:
        return min(1.0, abs(float(jacobian[0, 0])))
    singular = np.linalg.svd(jacobian, compute_uv=False)
    return float(singular[-1] / singular[0])
