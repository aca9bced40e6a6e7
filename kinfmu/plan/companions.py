"""Companions: redundant rows solved with a block, by least squares, where the kept rows alone would be singular.

A row that is redundant as a constraint may still be what keeps a mechanism regular: of two rods that couple two wheels,
a quarter turn apart, each is in its dead centre where the other is not. Set aside, it would leave singular points that
the mechanism does not have. Such a row joins the block that it meets; where its combination of rows runs through
several blocks, these become one block.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.plan.equations.part import Part
from kinfmu.plan.equations.redundancy import Redundancy
from kinfmu.plan.equations.system import System
from kinfmu.units import CoordinateName

_POSES = 64  # of the motion at which a block is looked at; with their steps, one turn each way
_STEP = 0.2  # [rad, sizes]; between them
_WALKS = 4  # in random directions where there are as many degrees of freedom: one alone may pass no singular pose
_LOOKS = 3  # poses at which the combination of rows is found that equals a redundant row
_IN_SPAN = 1e-7  # part of a gradient outside the span of the others, or weight in a combination, that counts as zero
_CLOSED = 1e-9  # residual relative to the size up to which a sampled pose counts as closed
_SINGULAR = 1e-6  # singular value over the largest below which rows count as dependent
_ITERATIONS = 12
_CARRIES = 0.1  # least singular value without a row, as a part of that with it, below which the row carries the block


@dataclass(frozen=True)
class BlockStructure:
    """Rows solved together, by index into System.rows.

    assigned: (coordinate, row) in the order of evaluation: the row gives the coordinate outright. unknowns: coordinates
    left for Newton, with their rows; companions: redundant rows solved with them by least squares.
    """

    assigned: tuple[tuple[CoordinateName, int], ...]
    unknowns: tuple[CoordinateName, ...]
    rows: tuple[int, ...]
    companions: tuple[int, ...] = ()

    @property
    def coordinates(self) -> tuple[CoordinateName, ...]:
        return (*(name for name, _ in self.assigned), *self.unknowns)

    @property
    def all_rows(self) -> tuple[int, ...]:
        """Rows of the assigned coordinates and of the unknowns, then companions."""
        return (*(index for _, index in self.assigned), *self.rows, *self.companions)


def with_companions(
    system: System,
    meets: Callable[[int], Iterable[str]],
    blocks: Sequence[BlockStructure],
    redundancy: Redundancy,
    pose: FloatArray,
) -> list[BlockStructure]:
    """Add to each block the redundant rows without which it would be singular somewhere on the motion.

    Args:
        system: The equations.
        meets: The coordinates that a row meets, constants apart.
        blocks: In the order of solving, from the kept rows alone.
        redundancy: Its redundant rows are the candidates.
        pose: A closed pose, (n,), from which the motion is sampled.

    Returns:
        The blocks in an order of solving; some of them may have become one.

    """
    if not redundancy.redundant:
        return list(blocks)
    found = list(blocks)
    owners = {system.rows[index].owner for index in redundancy.kept}
    implying = _combinations(system, redundancy, pose)
    for dependent in redundancy.redundant:
        index = dependent.index
        home: dict[str, int] = {name: k for k, block in enumerate(found) for name in block.coordinates}
        met = {home[name] for name in meets(index) if name in home}
        if not met:
            continue
        own = {k for k, block in enumerate(found) if implying[index] & set(block.all_rows)}
        needs = _needs(found, home, meets)
        members = {k for k in met | own if found[k].unknowns}
        hull = _hull(members | {k for k in met if _behind({k}, needs) & members}, needs)
        last, carries = found[max(met)], False
        if last.unknowns:
            joined = replace(last, companions=(*last.companions, index))
            before = [found[k] for k in _behind(met, needs) - {max(met)}]
            is_axis = system.rows[index].owner in owners  # of a pin: the other alone is singular in places
            carries = not is_axis and _regular_only_with(system, [last], [joined], before, pose)
            if is_axis or carries:
                found[max(met)] = joined
        if len(hull) > 1 or (hull and not last.unknowns):
            whole = _whole([found[k] for k in hull], index)
            before = [found[k] for k in _behind({*hull, *met}, needs) - set(hull)]
            walks = 1 if carries else _WALKS  # what carries the last block need not carry those before it
            if _regular_only_with(system, [found[k] for k in hull], [whole], before, pose, walks):
                found = _merged(found, hull, needs, whole)
    return found


def _combinations(system: System, redundancy: Redundancy, pose: FloatArray) -> dict[int, set[int]]:
    """Return for each redundant row the kept rows whose gradients give its own.

    The kept rows are independent, so there is only one such combination, and none at a pose where they are singular.
    """
    spare = [dependent.index for dependent in redundancy.redundant]
    found: dict[int, set[int]] = {index: set() for index in spare}
    for q in _motion(Part(system, range(system.joint_row_count)), pose, len(redundancy.kept), _LOOKS):
        gradients = Part(system, [*redundancy.kept, *spare]).jacobian(q)
        kept, others = gradients[: -len(spare)].T, gradients[-len(spare) :].T
        weights = np.linalg.lstsq(kept, others, rcond=_IN_SPAN)[0]
        outside = np.linalg.norm(others - kept @ weights, axis=0)
        for index, column, left in zip(spare, weights.T, outside, strict=True):
            if left <= _IN_SPAN:
                used = np.abs(column) > _IN_SPAN * np.abs(column).max(initial=1.0)
                found[index] |= {row for row, is_used in zip(redundancy.kept, used, strict=True) if is_used}
    return found


def _needs(
    blocks: Sequence[BlockStructure], home: dict[str, int], meets: Callable[[int], Iterable[str]]
) -> list[set[int]]:
    """Return for each block the blocks whose coordinates its rows meet."""
    return [
        {home[name] for index in block.all_rows for name in meets(index) if name in home} - {k}
        for k, block in enumerate(blocks)
    ]


def _hull(members: set[int], needs: Sequence[set[int]]) -> list[int]:
    """Return the members and every block on a path between two of them, in order."""
    if not members:
        return []
    behind: list[bool] = []  # a member, or needs one, directly or through others
    for k, needed in enumerate(needs):
        behind.append(k in members or any(behind[other] for other in needed))
    ahead, found = set(members), []  # members, and what they need
    for k in reversed(range(len(needs))):
        if k in ahead:
            ahead |= needs[k]
            if behind[k]:
                found.append(k)
    return found[::-1]


def _behind(members: set[int], needs: Sequence[set[int]]) -> set[int]:
    """Return blocks with those that they need, directly or through others."""
    found = set(members)
    for k in reversed(range(len(needs))):
        found |= needs[k] if k in found else set()
    return found


def _whole(blocks: Sequence[BlockStructure], index: int) -> BlockStructure:
    """Return blocks as one, with a row among its companions."""
    companions = dict.fromkeys(row for block in blocks for row in block.companions)
    return BlockStructure(
        tuple(pair for block in blocks for pair in block.assigned),
        tuple(name for block in blocks for name in block.unknowns),
        tuple(row for block in blocks for row in block.rows),
        tuple(companions | {index: None}),
    )


def _merged(
    blocks: Sequence[BlockStructure], hull: Sequence[int], needs: Sequence[set[int]], whole: BlockStructure
) -> list[BlockStructure]:
    """Return the blocks with `whole` in place of those of the hull."""
    later = set(hull)  # what needs the hull
    for k, needed in enumerate(needs):
        if needed & later:
            later.add(k)
    before = [block for k, block in enumerate(blocks) if k not in later]
    after = [block for k, block in enumerate(blocks) if k in later and k not in hull]
    return [*before, whole, *after]


def _regular_only_with(
    system: System,
    without: Sequence[BlockStructure],
    joined: Sequence[BlockStructure],
    before: Sequence[BlockStructure],
    pose: FloatArray,
    walks: int = _WALKS,
) -> bool:
    """Return True if blocks are singular somewhere on the motion where one more companion makes them regular.

    Only the bodies that the blocks' joints join move, and all joints between them hold. There is no gain where a block
    before them is singular too.
    """
    rows = [row for block in joined for row in block.all_rows]
    touched = {column for row in rows for column in system.members[system.member_of[row]].columns}
    part = Part(
        system, [row for row in range(system.joint_row_count) if _only(system, row, touched)], sorted(touched), pose
    )
    rank = int(np.linalg.matrix_rank(part.jacobian(pose[part.columns]), rtol=_SINGULAR))
    if rank == len(part.columns):
        return False
    joined = [*joined, *(block for block in before if all(_only(system, row, touched) for row in block.all_rows))]
    walks = min(len(part.columns) - rank, walks)
    last: list[tuple[FloatArray, list[float]]] = []
    for q in (q for seed in range(walks) for q in _motion(part, pose[part.columns], rank, _POSES, seed)):
        poses = [q]
        alone = _jacobians(system, without, part.whole(q))
        determinants = [float(np.linalg.det(one)) for one in alone if one.shape[0] == one.shape[1]]
        for other, values in last:
            for a, b in zip(values, determinants, strict=True):
                between = _closed(part, other + a / (a - b) * (q - other), rank) if a * b < 0.0 else None
                poses += [] if between is None else [between]  # close to where a block is singular
        for one in poses:
            at = part.whole(one)
            if _least(_jacobians(system, without, at)) < _CARRIES * _least(_jacobians(system, joined, at)):
                return True
        last = [(q, determinants)]
    return False


def _motion(part: Part, q: FloatArray, rank: int, count: int, seed: int = 0) -> Iterator[FloatArray]:
    """Yield poses along the motion that rows of a rank leave free: in one direction, then in the other.

    Directions are random (seeded) with several degrees of freedom. It ends where all rows together are singular.
    """
    rng = np.random.default_rng(1989 + seed)
    free = _free(part, q, rank)
    start = free @ rng.standard_normal(free.shape[1])
    for direction in (start, -start):
        here: FloatArray | None = q
        while here is not None and count > 0:
            yield here
            count -= 1
            free = _free(part, here, rank)
            direction = free @ (free.T @ direction) + 0.3 * free @ rng.standard_normal(free.shape[1])
            direction /= np.abs(direction).max()
            here = _closed(part, here + _STEP * part.column_scales * direction, rank)


def _free(part: Part, q: FloatArray, rank: int) -> FloatArray:
    """Return the directions that rows of a rank leave free, (n, n - rank)."""
    return np.asarray(np.linalg.svd(part.jacobian(q))[2][rank:].T)


def _closed(part: Part, q: FloatArray, rank: int) -> FloatArray | None:
    """Return the near pose where all rows hold, by Gauss-Newton steps of their rank on the motion; None if none.

    Off the motion redundant rows contradict each other a little: what they add to the rank there must not count.
    """
    u = np.zeros(len(part.system.mechanism.drivers))
    for _ in range(_ITERATIONS):
        residual = part.residual(q, u)
        if np.abs(residual).max() <= _CLOSED:
            return q
        left, singular, right = np.linalg.svd(part.jacobian(q), full_matrices=False)
        if singular[rank - 1] < _SINGULAR * singular[0]:
            return None
        q = q - part.column_scales * (right[:rank].T @ (left[:, :rank].T @ residual / singular[:rank]))
    return None


def _jacobians(system: System, blocks: Sequence[BlockStructure], pose: FloatArray) -> list[FloatArray]:
    """Return for each block the Jacobian of all its rows over its coordinates, scaled to pure numbers."""
    place = {name: k for k, name in enumerate(system.coordinates)}
    columns = [[place[name] for name in block.coordinates] for block in blocks]
    return [
        Part(system, block.all_rows, own, pose).jacobian(pose[own]) for block, own in zip(blocks, columns, strict=True)
    ]


def _only(system: System, row: int, columns: set[int]) -> bool:
    """Return True if a row meets no other columns."""
    return columns.issuperset(system.members[system.member_of[row]].columns)


def _least(jacobians: Sequence[FloatArray]) -> float:
    """Return the least singular value of all."""
    return min(float(np.linalg.svd(jacobian, compute_uv=False)[-1]) for jacobian in jacobians)
