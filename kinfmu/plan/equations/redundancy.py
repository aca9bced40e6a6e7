"""Redundant and inconsistent rows, found along the motion and never at one pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.mechanism.joints import Distance, Revolute
from kinfmu.plan.equations.assembly import AssembledStart, comfortable, find_assembly
from kinfmu.plan.equations.closing import CONSISTENT, dependent_rows, motion_samples
from kinfmu.plan.equations.part import Part
from kinfmu.plan.equations.system import Row, System, lengths_of

_ROUNDING = 2e-14  # the least tolerance, of the mechanism's size: what rounding leaves open of a row that holds
_IN_SPAN = 1e-7  # part of a gradient outside the span of the others that counts as zero
_SAMPLES = 6


@dataclass(frozen=True)
class DependentRow:
    """A row of Phi_K whose gradient is a combination of the others' at every pose of the motion that they leave.

    implied_by: the rows in that combination; any of them could be set aside in its place. gap: by how much the
    row is open there, as a length or in radians, the median of the poses, as rounding counts for more where the others
    are nearly singular: 0 (within the tolerance) makes it redundant, anything else inconsistent. tolerance: CONSISTENT
    of the bar that a distance is, or of the shorter of the bodies that a pin joins, else of the mechanism's size; in
    radians CONSISTENT.
    """

    row: Row
    index: int
    implied_by: tuple[Row, ...]
    gap: float
    tolerance: float
    is_consistent: bool

    @property
    def implied_by_joints(self) -> tuple[str, ...]:
        """Names of the joints to which the implying rows belong, without its own."""
        owners = dict.fromkeys(row.owner for row in self.implied_by)
        return tuple(owner for owner in owners if owner != self.row.owner)


@dataclass(frozen=True)
class Redundancy:
    """What the joint rows leave: mobility = coordinates - independent rows; rows set aside, by index into System.rows.

    kept: independent joint rows; dependent: those set aside, redundant or inconsistent; assembly: the start of the
    mechanism with which the rows were judged, which the plan's anchor is taken from.
    """

    mobility: int
    kept: tuple[int, ...]
    dependent: tuple[DependentRow, ...]
    assembly: AssembledStart

    @property
    def redundant(self) -> tuple[DependentRow, ...]:
        return tuple(row for row in self.dependent if row.is_consistent)

    @property
    def inconsistent(self) -> tuple[DependentRow, ...]:
        return tuple(row for row in self.dependent if not row.is_consistent)


def find_redundancy(system: System, assembly: AssembledStart | None = None) -> Redundancy:
    """Find redundant and inconsistent joint rows: test every row without itself, later rows first.

    A row is dependent if its gradient lies in the span of the other rows' gradients at every sampled pose of the motion
    that the others leave. A loss of rank at one pose only is a singular point and does not count. Haug (1989) judges
    rank at one pose; along the motion, a parallel third crank shows as redundant and a stretched linkage does not.

    assembly: the start of the mechanism, if it is known. Default: it is assembled.
    """
    assembly = assembly or find_assembly(system)
    assembled = assembly.pose
    free, joint_rows = len(system.coordinates), range(system.joint_row_count)
    if assembled is not None and assembled.margin > comfortable(system) and len(system.rows) == free:
        return Redundancy(free - len(joint_rows), tuple(joint_rows), (), assembly)  # regular with its drivers
    start = assembly.start.q if assembled is None else assembled.q
    suspects = _suspects(system, None if assembled is None else assembled.q)
    kept = list(joint_rows)
    dependent: list[DependentRow] = []
    u = np.zeros(len(system.mechanism.drivers))
    for index, implying in reversed(suspects.items()):
        others = [k for k in kept if k != index]
        joints = {system.member_of[row] for row in (*implying, index)}
        of_joints = [k for k in others if system.member_of[k] in joints]  # some have no weight at a single pose
        groups = [implying, of_joints, others] if implying else [others]  # few rows first: they are tested faster
        found = next(filter(None, (_poses_of_dependence(system, start, index, rows) for rows in groups)), None)
        if found is None:
            continue
        poses, rows = found
        kept = others
        residuals = [system.residual(pose, u) for pose in poses]
        gaps = sorted((float(system.gaps(phi)[index]) for phi in residuals), key=abs)
        gap, tolerance = gaps[(len(gaps) - 1) // 2], _tolerance(system, index)
        implied_by = _implied_by(system, poses, index, rows)
        dependent.insert(0, DependentRow(system.rows[index], index, implied_by, gap, tolerance, abs(gap) <= tolerance))
    return Redundancy(free - len(kept), tuple(kept), tuple(dependent), assembly)


def _tolerance(system: System, index: int) -> float:
    """Return the gap up to which a dependent row counts as consistent, as a length or in radians."""
    if system.rows[index].kind == "angle":
        return CONSISTENT
    member, length = system.members[system.member_of[index]], system.size
    if isinstance(member.owner, Distance):
        length = member.owner.length
    elif isinstance(member.owner, Revolute):
        lengths = lengths_of(system.mechanism)
        length = min([lengths[body] for body in member.bodies if lengths[body] > 0.0], default=length)
    return max(CONSISTENT * length, _ROUNDING * system.size)


def _poses_of_dependence(
    system: System, start: FloatArray, index: int, others: Sequence[int]
) -> tuple[list[FloatArray], Sequence[int]] | None:
    """Return poses of the motion that other rows leave, if a row depends on them at all of these, and the rows.

    Only the bodies that these rows touch move: more rows only restrict the motion, so the dependence stays.
    """
    members = {system.member_of[row] for row in (*others, index)}
    columns = sorted({column for number in members for column in system.members[number].columns})
    part = Part(system, others, columns, start)
    poses = []
    for q in motion_samples(part, start[columns], _SAMPLES):
        poses.append(part.whole(q))
        if not _in_span(system, poses[-1], index, others):
            return None
    return (poses, others) if poses else None


def _suspects(system: System, closed: FloatArray | None) -> dict[int, list[int]]:
    """Return joint rows that may be dependent, each with the earlier rows that give its gradient at a closed pose.

    Where all rows hold together, what is dependent all along the motion is dependent there too. Where they do not
    close, all rows are suspects, and nothing is known of what implies them.
    """
    joint_rows = range(system.joint_row_count)
    if closed is None:
        return {index: [] for index in joint_rows}
    return dependent_rows(Part(system, joint_rows).jacobian(closed))


def _in_span(system: System, pose: FloatArray, index: int, others: Sequence[int]) -> bool:
    """Return whether the gradient of a row lies in the span of those of other rows at a pose."""
    _, gradient, outside = _combination(system, pose, index, others)
    return bool(np.linalg.norm(outside) <= _IN_SPAN * max(1.0, float(np.linalg.norm(gradient))))


def _implied_by(system: System, poses: Sequence[FloatArray], index: int, others: Sequence[int]) -> tuple[Row, ...]:
    """Return the other rows that have a weight in the combination at any of the poses."""
    used = np.zeros(len(others), dtype=bool)
    for pose in poses:
        used |= np.abs(_combination(system, pose, index, others)[0]) > 1e-6
    return tuple(system.rows[k] for k, is_used in zip(others, used, strict=True) if is_used)


def _combination(
    system: System, pose: FloatArray, index: int, others: Sequence[int]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return weights of the other rows whose sum is nearest to a row's gradient, that gradient, and the difference."""
    jacobian = Part(system, [*others, index]).jacobian(pose)
    weights = np.asarray(np.linalg.lstsq(jacobian[:-1].T, jacobian[-1], rcond=1e-9)[0])
    return weights, jacobian[-1], jacobian[-1] - jacobian[:-1].T @ weights
