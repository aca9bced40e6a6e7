"""Redundant and inconsistent rows, found along the motion and never at one pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kinfmu.equations.assembly import assemble, motion_samples, rough_start
from kinfmu.equations.system import FloatArray, Row, System

CONSISTENT = 1e-11  # gap relative to the mechanism's size up to which a dependent row counts as consistent
_IN_SPAN = 1e-7  # part of a gradient outside the span of the others that counts as zero
_SAMPLES = 6


@dataclass(frozen=True)
class DependentRow:
    """A row of Phi_K whose gradient is a combination of the others' at every pose of the motion that they leave.

    implied_by: names of the rows in that combination; any of them could be set aside in its place. gap: by how much the
    row is open there, as a length or in radians: 0 (within CONSISTENT) makes it redundant, anything else inconsistent.
    """

    row: Row
    index: int
    implied_by: tuple[str, ...]
    gap: float
    is_consistent: bool

    @property
    def implied_by_joints(self) -> tuple[str, ...]:
        """Names of the joints to which the implying rows belong, without its own."""
        owners = dict.fromkeys(name.rpartition(".")[0] for name in self.implied_by)
        return tuple(owner for owner in owners if owner != self.row.owner)


@dataclass(frozen=True)
class Redundancy:
    """What the joint rows leave: mobility = coordinates - independent rows; rows set aside, by index into System.rows.

    kept: independent joint rows; dependent: those set aside, redundant or inconsistent.
    """

    mobility: int
    kept: tuple[int, ...]
    dependent: tuple[DependentRow, ...]

    @property
    def redundant(self) -> tuple[DependentRow, ...]:
        return tuple(row for row in self.dependent if row.is_consistent)

    @property
    def inconsistent(self) -> tuple[DependentRow, ...]:
        return tuple(row for row in self.dependent if not row.is_consistent)


def find_redundancy(system: System) -> Redundancy:
    """Test every joint row without itself, later rows first.

    A row is dependent if its gradient lies in the span of the other rows' gradients at every sampled pose of the motion
    that the others leave. A loss of rank at one pose only is a singular point and does not count. Haug (1989) judges
    rank at one pose; along the motion, a parallel third crank shows as redundant and a stretched linkage does not.
    """
    assembled = assemble(system)
    start = rough_start(system) if assembled is None else assembled.q
    kept = list(range(system.joint_row_count))
    free = len(system.coordinates)
    if free - len(kept) == len(system.mechanism.drivers) and _independent_somewhere(system, start, kept):
        return Redundancy(free - len(kept), tuple(kept), ())
    dependent: list[DependentRow] = []
    for index in reversed(range(system.joint_row_count)):
        others = [k for k in kept if k != index]
        poses = motion_samples(system, start, others, _SAMPLES)
        if not poses or not all(_in_span(system, pose, index, others) for pose in poses):
            continue
        kept = others
        u = np.zeros(len(system.mechanism.drivers))
        residuals = [system.residual(pose, u) for pose in poses]
        gap = max((float(system.gaps(phi)[index]) for phi in residuals), key=abs)
        implied_by = _implied_by(system, poses, index, others)
        consistent = all(system.relative_gaps(phi)[index] <= CONSISTENT for phi in residuals)
        dependent.insert(0, DependentRow(system.rows[index], index, implied_by, gap, consistent))
    return Redundancy(free - len(kept), tuple(kept), tuple(dependent))


def _independent_somewhere(system: System, start: FloatArray, rows: Sequence[int]) -> bool:
    """True if all rows close together and are independent at one pose of their motion: then none is redundant."""
    for pose in motion_samples(system, start, rows, _SAMPLES):
        singular = np.linalg.svd(system.scaled_jacobian(pose)[list(rows)], compute_uv=False)
        if len(singular) == 0 or singular[-1] > 1e-4 * singular[0]:
            return True
    return False


def _in_span(system: System, pose: FloatArray, index: int, others: Sequence[int]) -> bool:
    jacobian = system.scaled_jacobian(pose)
    gradient = jacobian[index]
    weights = np.linalg.lstsq(jacobian[list(others)].T, gradient, rcond=1e-9)[0]
    outside = gradient - jacobian[list(others)].T @ weights
    return bool(np.linalg.norm(outside) <= _IN_SPAN * max(1.0, float(np.linalg.norm(gradient))))


def _implied_by(system: System, poses: Sequence[FloatArray], index: int, others: Sequence[int]) -> tuple[str, ...]:
    used = np.zeros(len(others), dtype=bool)
    for pose in poses:
        jacobian = system.scaled_jacobian(pose)
        weights = np.linalg.lstsq(jacobian[list(others)].T, jacobian[index], rcond=1e-9)[0]
        used |= np.abs(weights) > 1e-6
    return tuple(system.rows[k].name for k, is_used in zip(others, used, strict=True) if is_used)
