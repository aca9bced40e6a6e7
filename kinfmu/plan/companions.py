"""Companions: redundant rows solved with a block, by least squares, where the kept rows alone would be singular.

A row that is redundant as a constraint may still be what keeps a mechanism regular: of two rods that couple two wheels,
a quarter turn apart, each is in its dead centre where the other is not. Set aside, it would leave singular points that
the mechanism does not have. Such a row joins the block that it meets; where its combination of rows runs through
several blocks, these become one block.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
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
_REGULAR = 0.02  # least singular value, as a part of its largest, above which a block counts as regular
_SPARSE = 8  # of so many poses one shows how large singular values become
_REFINEMENTS = 2  # of a singular pose between two sampled ones, by secants
_ITERATIONS = 12
_CARRIES = 0.1  # a row carries a block where its least singular value is below this part of that with the row


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
    moving = {name for block in blocks for name in block.coordinates}
    implying = _combinations(system, redundancy, pose)
    for dependent in redundancy.redundant:
        index = dependent.index
        home: dict[str, int] = {name: k for k, block in enumerate(found) for name in block.coordinates}
        met = {home[name] for name in meets(index) if name in home}
        if not met:
            continue
        own = {k for k, block in enumerate(found) if implying[index] & set(block.all_rows)}
        needs = _needs(found, home, meets)
        members = {k for k in own or met if found[k].unknowns}  # a row cannot carry rows that have no weight in it
        hull = _hull(members | {k for k in met if _behind({k}, needs) & members}, needs)
        last, carries = found[max(met)], False
        solved = [found[k] for k in sorted({*hull, max(met)})]
        rows = {index, *implying[index]}.union(*(block.all_rows for block in solved))
        loop = _Loop(system, rows, moving, solved, pose)
        if last.unknowns:
            is_axis = system.rows[index].owner in owners  # of a pin: the other alone is singular in places
            carries = not is_axis and loop.is_carried(index, [last])
            if is_axis or carries:
                found[max(met)] = replace(last, companions=(*last.companions, index))
        if len(hull) > 1 or (hull and not last.unknowns):
            walks = 1 if carries else _WALKS  # what carries the last block need not carry those before it
            if loop.is_carried(index, [found[k] for k in hull], walks):
                found = _merged(found, hull, needs, _whole([found[k] for k in hull], index))
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


class _Loop:
    """Bodies that rows join, with all joints between them, moved about a closed pose.

    solved: blocks whose coordinates follow from the others of these bodies and from the drivers among their rows.
    """

    def __init__(
        self,
        system: System,
        rows: Iterable[int],
        moving: Collection[str],
        solved: Sequence[BlockStructure],
        pose: FloatArray,
    ) -> None:
        self._place = {name: k for k, name in enumerate(system.coordinates) if name in moving}
        touched = {column for row in rows for column in system.members[system.member_of[row]].columns}
        columns = sorted(touched & set(self._place.values()))
        still = set(range(len(system.coordinates))) - set(self._place.values())
        joints = range(system.joint_row_count)
        self._part = Part(system, [row for row in joints if _meets_only(system, row, still | touched)], columns, pose)
        self._start = pose[columns]
        self._rank = int(np.linalg.matrix_rank(self._part.jacobian(self._start), rtol=_SINGULAR))
        follow = {self._place[name] for block in solved for name in block.coordinates}
        self._leading = [k for k, column in enumerate(columns) if column not in follow]
        self._drivers = Part(
            system, [row for one in solved for row in one.all_rows if row not in joints], columns, pose
        )

    def is_carried(self, index: int, blocks: Sequence[BlockStructure], walks: int = _WALKS) -> bool:
        """Return True if a redundant row carries one of some blocks, in the order of solving, somewhere on the motion.

        It carries none that it is singular with, however long its lever. There is no gain where the motion turns back:
        what leads it is at a limit there.
        """
        walks = min(len(self._part.columns) - self._rank, walks)
        return any(self._is_carried_on(walk, index, blocks) for walk in range(walks))

    def _is_carried_on(self, walk: int, index: int, blocks: Sequence[BlockStructure]) -> bool:
        """Return True if a redundant row carries one of some blocks where this is singular on one walk."""
        poses, found = [], []
        last: list[tuple[FloatArray, list[float]]] = []
        for q in _motion(self._part, self._start, self._rank, _POSES, walk):
            determinants = [self._determinant(q, block) for block in blocks]
            poses.append(q)
            for other, values in last:
                for block, a, b in zip(blocks, values, determinants, strict=True):
                    between = self._singular_pose(block, (other, a), (q, b)) if a * b < 0.0 else None
                    found += [] if between is None else [self._singular_values(between, index, blocks)]
            last = [(q, determinants)]
        if not found:
            return False
        largest = np.max([self._singular_values(q, index, blocks) for q in poses[::_SPARSE]], axis=0)
        alone, carried, leads = np.moveaxis(np.array(found) / largest, 2, 0)
        with_row = np.minimum(carried, leads)
        return bool(((alone < _CARRIES * with_row) & (with_row > _REGULAR)).any())

    def _determinant(self, q: FloatArray, block: BlockStructure) -> float:
        """Return the determinant of a block without its companions."""
        rows = block.all_rows[: len(block.coordinates)]
        return float(np.linalg.det(self._jacobian(q, rows, block.coordinates)))

    def _singular_pose(
        self, block: BlockStructure, low: tuple[FloatArray, float], high: tuple[FloatArray, float]
    ) -> FloatArray | None:
        """Return a pose close to where a block is singular between two with its determinants of either sign."""
        found = None
        for _ in range(_REFINEMENTS):
            (p, a), (q, b) = low, high
            between = _closed(self._part, p + a / (a - b) * (q - p), self._rank)
            if between is None:  # too close to where all rows are singular
                break
            found, c = between, self._determinant(between, block)
            low, high = (low, (found, c)) if a * c < 0.0 else ((found, c), high)
        return found

    def _singular_values(
        self, q: FloatArray, index: int, blocks: Sequence[BlockStructure]
    ) -> list[tuple[float, float, float]]:
        """Return for each block, from the last, its least singular value, that with a redundant row, that of the lead.

        A block's coordinates take up all rows but as many combinations as there are rows to spare: what these have left
        for the coordinates of an earlier block may carry it.
        """
        free = _free(self._part, q, self._rank)
        leads = _least(np.vstack([free[self._leading], self._drivers.jacobian(q) @ free]))
        names = [name for block in blocks for name in block.coordinates]
        over, found = self._jacobian(q, [index], names), []
        for block in reversed(blocks):
            before = over.shape[1] - len(block.coordinates)
            together = np.vstack([self._jacobian(q, block.all_rows, names)[:, : over.shape[1]], over])
            left, singular, _ = np.linalg.svd(together[:, before:])
            found.append((_least(together[: -len(over), before:]), float(singular[-1]), leads))
            over = left[:, len(block.coordinates) :].T @ together[:, :before]
        return found

    def _jacobian(self, q: FloatArray, rows: Sequence[int], names: Iterable[CoordinateName]) -> FloatArray:
        """Return the Jacobian of rows over coordinates, scaled to pure numbers."""
        columns, pose = [self._place[name] for name in names], self._part.whole(q)
        return Part(self._part.system, rows, columns, pose).jacobian(pose[columns])


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


def _meets_only(system: System, row: int, columns: set[int]) -> bool:
    """Return True if a row meets no other columns."""
    return columns.issuperset(system.members[system.member_of[row]].columns)


def _least(jacobian: FloatArray) -> float:
    """Return the least singular value."""
    return float(np.linalg.svd(jacobian, compute_uv=False)[-1])
