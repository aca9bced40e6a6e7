"""All closed poses of a plan at given driver values, block after block, with proof that there are no others.

Of each block all places of its unknowns are covered by boxes: angles within a turn, lengths within bounds that follow
from its rows. A box is contracted by the rows and by Krawczyk's operator, with Y near the inverse of the Jacobian J,

    K(X) = c - Y r(c) + (1 - Y J(X)) (X - c)        c in X

which contains all poses of X. So there is none if K(X) and X are disjoint, and exactly one if K(X) lies in the interior
of X (Neumaier, Interval Methods for Systems of Equations, 1990, section 5.1). What remains is bisected. Poses of
earlier blocks are enclosed by intervals; many boxes, of all of these poses, are computed together.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinfmu.analysis.certified.formulas import PlanRows
from kinfmu.analysis.certified.intervals import Intervals, approximate, around, contracted, enclosed
from kinfmu.arrays import FloatArray
from kinfmu.errors import listed
from kinfmu.plan import Block, SolvePlan
from kinfmu.plan.equations.closing import CONSISTENT
from kinfmu.plan.equations.graph import Node, reachable

LIMIT = 60.0  # [s]
MOST = 256  # poses with which the search goes on to the next block
_SEAM = 0.3  # [rad]; angles are covered from half a turn below -_SEAM: poses are often at half a turn itself
_GRID = {1: 24, 2: 12, 3: 8, 4: 5, 5: 4}  # boxes along each unknown at first; 2 for more of them
_CHUNK = 4096  # boxes computed together
_LEAST = 1e-7  # [rad, units]; boxes no wider than this are left undecided
_UNDECIDED = 1000  # such boxes after which a block is given up
_STARTS, _MOST_STARTS = (
    100,
    20000,
)  # of Newton's method: times the square of the unknowns, for each earlier pose; of all
_NEWTON = 12
_WIDEST, _SHRINK, _TRIES = 0.5, 0.4, 10  # of boxes about a pose: the first one; contraction aimed at; narrower ones
_CLOSE = 1e-7  # [rad, units] of a pose from that of Newton's method
_CONTRACTIONS = 40  # of a proved box
_ROUNDING = 2.0**-52
_TURN = Intervals(6.283185307179586, 6.283185307179587)
_SEED = 1989


@dataclass(frozen=True)
class ClosedPoses:
    """Poses of a plan, each of them proved.

    Attributes:
        outputs: The plan's outputs, (poses, outputs); angles within half a turn, if no redundant row counts turns.
        reasons: Why there may be more of them; none: it is proved that there are no others.

    """

    outputs: FloatArray
    reasons: tuple[str, ...]


@dataclass
class _Roots:
    """Poses of a block: in each box `wide` is exactly one, within `narrow`, for the earlier pose number `owner`."""

    owner: NDArray[np.int64]
    wide: Intervals
    narrow: Intervals


def closed_poses(plan: SolvePlan, limit: float = LIMIT) -> ClosedPoses:
    """Return all poses at the driver values of the plan's anchor; poses that differ by whole turns count as one.

    Args:
        plan: The plan.
        limit: Most time for a block [s].

    """
    rows = PlanRows(plan)
    drivers = zip((driver.inputs[0] for driver in plan.drivers), plan.anchor.u.tolist(), strict=True)
    constants = {name: Intervals(np.full(1, value)) for name, value in (*plan.parameter_values.items(), *drivers)}
    at = dict(zip(plan.mechanism.coordinate_names, plan.anchor.q.tolist(), strict=True))
    solved = list(rows.solved())
    outputs = rows.inlined([motion.position for motion in plan.outputs_motion])
    watches = dict(
        zip((name for name, _ in plan.watches), rows.inlined([node for _, node in plan.watches]), strict=True)
    )
    residuals = [node for _, _, nodes in solved for node in nodes]
    steps, reasons = _whole_turns(plan, outputs, residuals, watches)
    names: list[str] = []
    poses = Intervals(np.zeros((0, 1)), np.zeros((0, 1)))
    for block, _, nodes in solved:
        search = _BlockSearch(plan, rows, block, nodes, constants, (names, poses), at)
        roots = search.run(limit)
        reasons += search.reasons
        names = [*names, *block.unknowns]
        poses = _stacked(poses[:, roots.owner], roots.narrow)
        size = len(block.unknowns)
        companions = dict(zip(block.row_names[size:], nodes[size:], strict=True))
        poses = _closing(companions, {}, constants, (names, poses), reasons)
        if poses.low.shape[1] > MOST:
            reasons.append(f"the search ended at {MOST} assemblies")
            off = abs(np.sin(0.5 * (poses.middle - np.array([[at[name]] for name in names])))).max(axis=0)
            poses = poses[:, np.argsort(off, kind="stable")[:MOST]]  # that of the anchor is among them
    poses = _closing(watches, steps, constants, (names, poses), reasons)
    count = poses.low.shape[1]
    values = {name: value.middle for name, value in constants.items()} | dict(zip(names, poses.middle, strict=True))
    found = np.array([np.broadcast_to(value, count) for value in approximate(outputs, values, (1,))])
    found = found.reshape(len(outputs), count).T
    if not steps:
        turned = [name.is_angle for name in plan.outputs]
        found = np.where(turned, np.remainder(found + math.pi, math.tau) - math.pi, found)
    return ClosedPoses(found, tuple(dict.fromkeys(reasons)))


def _closing(
    rows: Mapping[str, Node],
    steps: Mapping[str, tuple[str, float]],
    constants: Mapping[str, Intervals],
    poses: tuple[Sequence[str], Intervals],
    reasons: list[str],
) -> Intervals:
    """Return the poses in which redundant rows, relative to the size, close up to what rows contradict each other.

    steps: an unknown and the change of a row for each of its turns; it is turned until the row closes.
    """
    names, z = poses
    values = dict(constants) | {name: z[k] for k, name in enumerate(names)}
    keep = np.ones(z.low.shape[1], dtype=bool)
    for name, gap in zip(rows, enclosed(list(rows.values()), values, (1,)), strict=True):
        closing = gap
        if name in steps:
            unknown, step = steps[name]
            turns = np.where(np.arange(len(names)) == names.index(unknown), 1.0, 0.0)[:, None] * np.rint(
                gap.middle / step
            )
            moved = z - _TURN * turns
            z = Intervals(np.where(turns, moved.low, z.low), np.where(turns, moved.high, z.high))
            closing = gap - Intervals(step) * np.rint(gap.middle / step)
        keep &= closing.mignitude <= CONSISTENT
        if (keep & (closing.magnitude > CONSISTENT)).any():
            reasons.append(f"whether the redundant row {name} closes is not decided")
    return z[:, keep]


def _whole_turns(
    plan: SolvePlan, outputs: Sequence[Node], residuals: Sequence[Node], watches: Mapping[str, Node]
) -> tuple[dict[str, tuple[str, float]], list[str]]:
    """Return the change of redundant rows for a whole turn of an unknown, and which turns lead to other poses."""
    steps: dict[str, tuple[str, float]] = {}
    reasons = []
    for name in plan.unknowns:
        if not name.is_angle:
            continue
        c = turns_of([*outputs, *residuals, *watches.values()], {name: 1.0})
        moving = [output.is_angle and is_whole(c[node]) for output, node in zip(plan.outputs, outputs, strict=True)]
        is_same = all(ok or c[node] == 0.0 for ok, node in zip(moving, outputs, strict=True))
        is_same &= all(c[node] == 0.0 for node in residuals)
        for row, node in watches.items():
            step = (c[node] or 0.0) * math.tau
            is_same &= c[node] is not None and (not step or not steps.keys() - {row})
            if step:
                is_same &= math.isclose(abs(steps.setdefault(row, (name, step))[1]), abs(step), rel_tol=1e-12)
        if not is_same:
            reasons.append(f"a whole turn of {name} leads to another pose")
    return steps, reasons


def turns_of(targets: Sequence[Node], turned: Mapping[str, float]) -> dict[Node, float | None]:
    """Return by how many turns nodes change if symbols change by turns; None: otherwise.

    Numbers of turns within 1e-12 of a whole one count as whole: ratios of gears are rounded.
    """
    c: dict[Node, float | None] = {}
    for node in reachable(targets):
        known = [c[arg] for arg in node.args]
        of = [turns for turns in known if turns is not None]
        if len(of) < len(known):
            c[node] = None
        elif any(of):
            c[node] = _turns_of(node, of)
        else:
            c[node] = turned.get(node.name, 0.0) if node.op == "symbol" else 0.0
    return c


def _turns_of(node: Node, of: Sequence[float]) -> float | None:
    found: float | None = None
    if node.op in ("+", "-"):
        found = of[0] + of[1] if node.op == "+" else of[0] - of[1]
    elif node.op == "neg":
        found = -of[0]
    elif node.op == "*" and any(arg.constant is not None for arg in node.args):
        found = sum(turns * (other.constant or 0.0) for turns, other in zip(of, reversed(node.args), strict=True))
    elif node.op == "/" and node.args[1].constant is not None:
        found = of[0] / node.args[1].constant
    elif node.op in ("sin", "cos") and is_whole(of[0]):
        found = 0.0
    elif node.op == "floor" and is_whole(of[0] * math.tau):
        found = of[0]
    return 0.0 if found is not None and abs(found) < 1e-12 else found


def is_whole(turns: float | None) -> bool:
    """Return whether a number of turns is whole, to within 1e-12."""
    return turns is not None and abs(turns - round(turns)) < 1e-12


@dataclass
class _BlockSearch:
    """The search for all poses of a block, after each pose of the blocks before it.

    Attributes:
        before: Names and intervals of all unknowns of earlier blocks, (n, earlier poses).
        at: Coordinates of a closed pose.
        reasons: Why the search is not complete.

    """

    plan: SolvePlan
    graph: PlanRows
    block: Block
    residuals: Sequence[Node]
    constants: Mapping[str, Intervals]
    before: tuple[Sequence[str], Intervals]
    at: Mapping[str, float]
    reasons: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.names = self.block.unknowns
        self.n = len(self.names)
        self.rows = list(self.residuals[: self.n])
        columns = [self.graph.gradient(self.rows, name) for name in self.names]
        self.jacobian = [entry for row in zip(*columns, strict=True) for entry in row]
        self.is_angle = np.array([name.is_angle for name in self.names])
        self.count = self.before[1].low.shape[1]
        empty = Intervals(np.zeros((self.n, 0)), np.zeros((self.n, 0)))
        self.roots = _Roots(np.zeros(0, dtype=np.int64), empty, empty)
        self.table = np.full((self.count, 1), -1)

    def run(self, limit: float) -> _Roots:
        """Return the poses."""
        end = time.monotonic() + limit
        with np.errstate(all="ignore"):
            domain = self._domain()
            boxes, owner = self._first_boxes(domain)
            boxes, owner = self._contracted(boxes, owner)
            self._prove(*self._newton(*self._starts(boxes, owner)))
            stack = [(boxes, owner)]
            undecided: list[FloatArray] = []
            while stack:
                boxes, owner = stack.pop()
                if len(owner) > _CHUNK:
                    stack.append((boxes[:, :-_CHUNK], owner[:-_CHUNK]))
                    boxes, owner = boxes[:, -_CHUNK:], owner[-_CHUNK:]
                if time.monotonic() > end:
                    self._give_up(f"the time limit of {limit:g} s ended its search")
                    break
                boxes, owner = self._round(boxes, owner)
                is_small = (boxes.radius / self.unit[:, None]).max(axis=0, initial=0.0) <= 0.5 * _LEAST
                undecided += list(boxes.middle[:, is_small].T)
                if len(undecided) > _UNDECIDED:
                    self._give_up(f"poses are not isolated, or close to singular, near {self._place(undecided[0])}")
                    undecided = []
                    break
                boxes, owner = self._halved(boxes[:, ~is_small], owner[~is_small])
                if len(owner):
                    stack.append((boxes, owner))
            if undecided:
                self._give_up(f"not decided near {self._place(undecided[0])}, where it is close to singular")
            if self.reasons:
                self._prove(*self._newton(*self._random_starts(domain)))
        return self.roots

    def _give_up(self, why: str) -> None:
        self.reasons.append(f"block of {listed(self.names)}: {why}")

    def _place(self, z: FloatArray) -> str:
        texts = [
            f"{name} = {math.degrees(value):.4g} deg" if name.is_angle else f"{name} = {value:.5g}"
            for name, value in zip(self.names, z.tolist(), strict=True)
        ]
        return listed(texts)

    # ---- boxes

    def _values(self, z: Any, owner: Any, *, as_numbers: bool = False) -> dict[str, Any]:
        names, before = self.before
        earlier, constants = before[:, owner], self.constants
        rest: dict[str, Any] = dict(constants) | {name: earlier[k] for k, name in enumerate(names)}
        if as_numbers:
            rest = {name: value.middle for name, value in rest.items()}
        return rest | {name: z[k] for k, name in enumerate(self.names)}

    def _domain(self) -> Intervals:
        """Return where the unknowns can be, (n, earlier poses), and set the unit of each of them."""
        low = np.where(self.is_angle, -math.pi - _SEAM, -np.inf)[:, None]
        high = np.where(self.is_angle, math.pi - _SEAM + 1e-15, np.inf)[:, None]
        domain = Intervals(*(np.repeat(end, self.count, axis=1) for end in (low, high)))
        self.unit = np.ones(self.n)
        if self.is_angle.all():
            return domain
        owner = np.arange(self.count)
        for _ in range(10 * self.n):
            before = domain
            domain, _ = self._narrowed(domain, owner)
            was, width = before.high - before.low, domain.high - domain.low
            shrunk = np.where(np.isfinite(was), was > 1.01 * width, np.isfinite(width))
            if not shrunk[~self.is_angle].any():
                break
        turned = self.is_angle[:, None]
        domain = Intervals(np.where(turned, low, domain.low), np.where(turned, high, domain.high))
        is_bounded: NDArray[np.bool_] = np.isfinite(domain.radius)
        if not is_bounded.all():
            names = [name for name, bounded in zip(self.names, is_bounded.min(axis=1), strict=True) if not bounded]
            self._give_up(f"its rows give no bounds of {listed(names)}")
            near = np.array([[self.at[name]] for name in self.names])
            near_by = around(near, np.full_like(near, 10.0 * self.plan.size))
            domain = Intervals(
                np.where(is_bounded, domain.low, near_by.low), np.where(is_bounded, domain.high, near_by.high)
            )
        self.unit = np.where(self.is_angle, 1.0, domain.radius.max(axis=1, initial=0.0))
        self.unit[self.unit == 0.0] = self.plan.size
        return domain

    def _narrowed(self, boxes: Intervals, owner: Any) -> tuple[Intervals, Any]:
        """Return boxes contracted by the rows, and where they are empty."""
        parts, is_empty = contracted(self.rows, self._values(boxes, owner), self.names)
        return _together(parts, len(owner)), np.broadcast_to(is_empty, len(owner))

    def _contracted(self, boxes: Intervals, owner: Any) -> tuple[Intervals, Any]:
        parts = []
        for k in range(0, len(owner), _CHUNK):
            some, is_empty = self._narrowed(boxes[:, k : k + _CHUNK], owner[k : k + _CHUNK])
            parts.append((some.low[:, ~is_empty], some.high[:, ~is_empty], owner[k : k + _CHUNK][~is_empty]))
        if not parts:
            return boxes, owner
        low, high, owner = (np.concatenate(column, axis=-1) for column in zip(*parts, strict=True))
        return Intervals(low, high), owner

    def _first_boxes(self, domain: Intervals) -> tuple[Intervals, Any]:
        parts = _GRID.get(self.n, 2 if self.n <= 10 else 1)  # 1024 boxes
        grid = np.indices((parts,) * self.n).reshape(self.n, 1, -1)
        edges = [domain.low + (domain.high - domain.low) * (k / parts) for k in range(parts)] + [domain.high]
        ends = np.array(edges)  # (parts + 1, n, earlier poses); neighbours share them to the bit
        unknown, earlier = np.arange(self.n)[:, None, None], np.arange(self.count)[None, :, None]
        low, high = ends[grid, unknown, earlier], ends[grid + 1, unknown, earlier]
        owner = np.repeat(np.arange(self.count), grid.shape[-1])
        return Intervals(low.reshape(self.n, -1), high.reshape(self.n, -1)), owner

    def _round(self, boxes: Intervals, owner: Any) -> tuple[Intervals, Any]:
        """Return what remains of boxes; new poses are added."""
        boxes, owner = self._elsewhere(boxes, owner)
        boxes, is_empty = self._narrowed(boxes, owner)
        boxes, owner = boxes[:, ~is_empty], owner[~is_empty]
        image, contraction = self._krawczyk(boxes, owner)
        inside = image.is_inside(boxes).all(axis=0)
        self._add(boxes[:, inside], image[:, inside], owner[inside], image.middle[:, inside])
        boxes = boxes.intersection(image)
        keep = ~inside & (boxes.low <= boxes.high).all(axis=0)
        boxes, owner, is_regular = boxes[:, keep], owner[keep], contraction[keep] < 1.0
        if is_regular.any():  # it may have one pose, on the border of boxes
            self._prove(*self._newton(boxes.middle[:, is_regular], owner[is_regular]))
            boxes, owner = self._elsewhere(boxes, owner)
        return boxes, owner

    def _elsewhere(self, boxes: Intervals, owner: Any) -> tuple[Intervals, Any]:
        """Return the boxes that are not in that of a known pose."""
        keep = np.ones(len(owner), dtype=bool)
        for slot in range(self.table.shape[1]):
            number = self.table[owner, slot]
            known = number >= 0
            wide = self.roots.wide[:, number[known]]
            keep[known] &= ~_is_within(self._near(boxes[:, known], wide), wide)
        return boxes[:, keep], owner[keep]

    def _near(self, boxes: Intervals, others: Intervals) -> Intervals:
        """Return boxes moved by whole turns towards others."""
        turns = np.where(self.is_angle[:, None], np.rint((others.middle - boxes.middle) / math.tau), 0.0)
        moved = boxes + _TURN * turns
        return Intervals(np.where(turns, moved.low, boxes.low), np.where(turns, moved.high, boxes.high))

    def _halved(self, boxes: Intervals, owner: Any) -> tuple[Intervals, Any]:
        """Return halves along the unknowns that change rows most."""
        if not len(owner):
            return boxes, owner
        entries = enclosed(self.jacobian, self._values(boxes, owner), (1,))
        radius = boxes.radius
        slopes = np.array([np.broadcast_to(e.magnitude, radius.shape[1:]) for e in entries])
        change = slopes.reshape(self.n, self.n, -1) * radius
        change = change / np.maximum(change.sum(axis=1, keepdims=True), 1e-300)
        smear = np.where(np.isfinite(change), change, 1.0).sum(axis=0)
        relative = radius / self.unit[:, None]
        smear = np.where(relative > 0.1 * relative.max(axis=0), smear, -1.0)
        which = smear.argmax(axis=0), np.arange(len(owner))
        first, second = boxes.high.copy(), boxes.low.copy()
        first[which] = second[which] = boxes.middle[which]
        low, high = np.concatenate([boxes.low, second], axis=1), np.concatenate([first, boxes.high], axis=1)
        return Intervals(low, high), np.concatenate([owner, owner])

    # ---- proofs

    def _krawczyk(self, boxes: Intervals, owner: Any) -> tuple[Intervals, FloatArray]:
        """Return K(X) of boxes, and the largest row sum of |1 - Y J(X)| in units; all numbers where it has no value.

        A product of n x n matrices is rounded by at most (n + 2) 2^-52 of that of the absolute values.
        """
        n, count, c = self.n, len(owner), boxes.middle
        entries = enclosed(self.jacobian, self._values(boxes, owner), (1,))
        whole = _together(entries, count)
        centre, spread = (np.moveaxis(part.reshape(n, n, count), -1, 0) for part in (whole.middle, whole.radius))
        is_known = np.asarray(np.isfinite(spread + centre).all(axis=(1, 2), keepdims=True))
        y = _inverses(np.where(is_known, centre, 0.0))
        rest = _together(enclosed(self.rows, self._values(Intervals(c), owner), (1,)), count)
        middle, off = rest.middle.T[..., None], rest.radius.T[..., None]
        one, error, size = np.eye(n), (n + 2) * _ROUNDING, abs(y)
        product = size @ spread * (1.0 + error) + error * (one + size @ abs(centre))
        reach = (abs(one - y @ centre) + product) * (1.0 + error)  # (boxes, n, n)
        step = (y @ middle)[..., 0].T
        radius = reach @ boxes.radius.T[..., None] + size @ off + error * (size @ abs(middle))
        radius = radius[..., 0].T * (1.0 + 2.0 * error) + _ROUNDING * (abs(c) + abs(step)) + 1e-300
        image = around(c - step, radius)
        is_known = is_known[:, 0, 0] & np.isfinite(radius + step).all(axis=0)
        contraction = np.where(is_known, (reach * self.unit / self.unit[:, None]).sum(axis=2).max(axis=1), np.inf)
        return Intervals(np.where(is_known, image.low, -np.inf), np.where(is_known, image.high, np.inf)), contraction

    def _starts(self, boxes: Intervals, owner: Any) -> tuple[FloatArray, Any]:
        """Return the middles of boxes, and the closed pose after each earlier pose, as starts of Newton's method."""
        near = np.array([[self.at[name]] for name in self.names])
        starts = np.concatenate([boxes.middle, np.repeat(near, self.count, axis=1)], axis=1)
        return starts, np.concatenate([owner, np.arange(self.count)])

    def _random_starts(self, domain: Intervals) -> tuple[FloatArray, Any]:
        each = max(1, min(_STARTS * self.n**2, _MOST_STARTS // max(1, self.count)))
        owner = np.repeat(np.arange(self.count), each)
        random = np.random.default_rng(_SEED).uniform(-1.0, 1.0, (self.n, len(owner)))
        return domain.middle[:, owner] + domain.radius[:, owner] * random, owner

    def _newton(self, z: FloatArray, owner: Any) -> tuple[FloatArray, Any]:
        """Return distinct poses near places, with their earlier poses."""
        n, unit = self.n, self.unit[:, None]
        last = np.full(len(owner), np.inf)
        for _ in range(_NEWTON):
            values = self._values(z, owner, as_numbers=True)
            found = [np.broadcast_to(v, len(owner)) for v in approximate([*self.rows, *self.jacobian], values, (1,))]
            r, entries = np.array(found[:n]), np.array(found[n:])
            inverse = _inverses(np.moveaxis(entries.reshape(n, n, -1), -1, 0))
            step = -(inverse @ r.T[..., None])[..., 0].T
            length = abs(step / unit).max(axis=0)
            z, last = z + step * np.minimum(1.0, 0.7 / length), length
            keep = np.isfinite(z).all(axis=0)
            z, owner, last = z[:, keep], owner[keep], last[keep]
            if not (last > 1e-13).any():  # rounding
                break
        z, owner = z[:, last < 1e-9], owner[last < 1e-9]  # close to where it converges
        z = np.where(self.is_angle[:, None], np.remainder(z + math.pi + _SEAM, math.tau) - math.pi - _SEAM, z)
        rounded = np.concatenate([owner[None], np.rint(z / unit * 1e5)])
        _, first = np.unique(rounded, axis=1, return_index=True)
        return z[:, first], owner[first]

    def _prove(self, z: FloatArray, owner: Any) -> None:
        """Add the poses close to some places of which it can be proved that they are the only ones in a box."""
        point, owner = self._elsewhere(Intervals(z), owner)
        z, radius = point.low, np.full(len(owner), _WIDEST)
        for _ in range(_TRIES):
            if not len(owner):
                return
            box = around(z, radius * self.unit[:, None])
            image, contraction = self._krawczyk(box, owner)
            inside = image.is_inside(box).all(axis=0)
            self._add(box[:, inside], image[:, inside], owner[inside], z[:, inside])
            factor = np.clip(_SHRINK / np.maximum(contraction, 1e-300), 0.05, 0.6)[~inside]
            z, owner, radius = z[:, ~inside], owner[~inside], (radius[~inside] * factor)

    def _add(self, wide: Intervals, image: Intervals, owner: Any, near: FloatArray) -> None:
        """Add poses that are the only ones in boxes, and in their images, and probably near some places; each once."""
        if not len(owner):
            return
        narrow = image.intersection(wide)
        close = around(near, np.full_like(near, _CLOSE) * self.unit[:, None])
        image, _ = self._krawczyk(close, owner)
        is_close = image.is_inside(close).all(axis=0) & _is_within(close, wide)
        narrow = Intervals(np.where(is_close, image.low, narrow.low), np.where(is_close, image.high, narrow.high))
        for _ in range(_CONTRACTIONS):
            last, narrow = narrow, narrow.intersection(self._krawczyk(narrow, owner)[0])
            if not (narrow.radius < 0.95 * last.radius).any():
                break
        for k, earlier in enumerate(owner.tolist()):
            if not self._is_new(narrow[:, k : k + 1], earlier):
                continue
            old = self.roots
            number = len(old.owner)
            this = slice(k, k + 1)
            self.roots = _Roots(
                np.append(old.owner, earlier),
                _stacked(old.wide, wide[:, this], axis=1),
                _stacked(old.narrow, narrow[:, this], axis=1),
            )
            free = np.flatnonzero(self.table[earlier] < 0)
            if not len(free):
                self.table = np.concatenate([self.table, np.full((self.count, 1), -1)], axis=1)
                free = np.array([self.table.shape[1] - 1])
            self.table[earlier, free[0]] = number

    def _is_new(self, narrow: Intervals, owner: int) -> bool:
        """Return True if a pose is none of the known ones: outside of their boxes, or apart from them."""
        known = self.table[owner][self.table[owner] >= 0]
        if not len(known):
            return True
        wide, others = self.roots.wide[:, known], self.roots.narrow[:, known]
        if _is_within(self._near(narrow, wide), wide).any():
            return False
        moved = self._near(narrow, others)
        is_apart = ((moved.high < others.low) | (moved.low > others.high)).any(axis=0)
        if not is_apart.all():
            self._give_up(f"whether two poses near {self._place(narrow.middle[:, 0])} are one is not decided")
        return True


def _is_within(boxes: Intervals, others: Intervals) -> Any:
    return ((others.low <= boxes.low) & (boxes.high <= others.high)).all(axis=0)


def _stacked(boxes: Intervals, others: Intervals, axis: int = 0) -> Intervals:
    return Intervals(
        np.concatenate([boxes.low, others.low], axis=axis), np.concatenate([boxes.high, others.high], axis=axis)
    )


def _together(rows: Sequence[Intervals], count: int) -> Intervals:
    """Return intervals that broadcast as arrays, (rows, count)."""
    return Intervals(*(np.array([np.broadcast_to(getattr(row, e), count) for row in rows]) for e in ("low", "high")))


def _inverses(matrices: FloatArray) -> FloatArray:
    """Return approximate inverses, (boxes, n, n); what is singular has none: numbers that are not finite."""
    n = matrices.shape[-1]
    if n == 1:
        return np.asarray(1.0 / matrices)
    if n == 2:  # the usual size
        (a, b), (c, d) = np.moveaxis(matrices, 0, -1)
        return np.asarray(np.moveaxis(np.array([[d, -b], [-c, a]]) / (a * d - b * c), -1, 0))
    good = np.isfinite(matrices).all(axis=(1, 2), keepdims=True)
    safe = np.where(good, matrices, np.eye(n))
    try:
        found = np.linalg.inv(safe)
    except np.linalg.LinAlgError:  # one of them is singular to the bit
        noise = 1e-13 * np.random.default_rng(_SEED).random((n, n))
        found = np.linalg.inv(safe + noise * (1.0 + abs(safe).max(axis=(1, 2), keepdims=True)))
    return np.asarray(np.where(good, found, np.nan))
