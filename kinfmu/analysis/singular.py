"""Singular points on the path of a driver, its range, and the matrices of the method there."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from kinfmu.analysis.driver_path import DriverPath, driver_text
from kinfmu.arrays import FloatArray
from kinfmu.errors import listed
from kinfmu.plan import SolvePlan, localized
from kinfmu.plan.equations.assembly import find_assembly
from kinfmu.plan.equations.closing import close
from kinfmu.plan.equations.redundancy import Redundancy
from kinfmu.plan.equations.system import System
from kinfmu.plan.origin import relative_to
from kinfmu.run.solve import solve
from kinfmu.solver.python import Pose
from kinfmu.solver.python.bridge import Bridge
from kinfmu.solver.python.limit import NEGATIVE, NO_BLOCK, NO_POLE, Limit


@dataclass(frozen=True)
class SingularPoint:
    """A driver value where a block's determinant vanishes.

    kind: 'change point' (branches cross, the motion goes on) or 'limit' (of any other kind: see LimitPosition).
    block: its number, from 1, among the blocks of the plan in which the driver moves alone; 0 if no block is singular.
    """

    value: float
    kind: str
    block: int
    driver: str


@dataclass(frozen=True)
class LimitPosition:
    """The mechanism at a limit of a driver.

    value: of the driver [rad or length]; kind: 'dead centre' (the motion turns back), 'change point' (branches cross
    and no run can cross it), 'pole' (a body runs to infinity) or 'end' (a distance of 0); coordinates: all of them by
    name, in the world, of the last pose before a pole; bodies: those that can move there while the drivers are fixed.
    """

    value: float
    kind: str
    coordinates: Mapping[str, float] = field(hash=False)
    bodies: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        """Return the limit as plain data."""
        return asdict(self) | {"bodies": list(self.bodies)}


@dataclass(frozen=True)
class DriverRange:
    """The range of a driver, the other drivers at their start values, and its singular points.

    driver, kind: its name, and 'angle' or 'length'; points: in the order of the driver value; lowest, highest: the
    limits, None where none was met; turns: number of turns after which the mechanism repeats, None if it
    does not; reach: the values evaluated [rad or length]; stopped: the reason that ended the path other than a limit.
    """

    driver: str
    kind: str
    points: tuple[SingularPoint, ...]
    lowest: LimitPosition | None
    highest: LimitPosition | None
    turns: int | None
    reach: tuple[float, float]
    stopped: str | None = None

    @property
    def low(self) -> float | None:
        """Lower limit of the driver [rad or length], None where none was met."""
        return None if self.lowest is None else self.lowest.value

    @property
    def high(self) -> float | None:
        """Upper limit of the driver [rad or length], None where none was met."""
        return None if self.highest is None else self.highest.value

    @property
    def limits(self) -> tuple[LimitPosition, ...]:
        """The limits that were met, the lower one first."""
        return tuple(limit for limit in (self.lowest, self.highest) if limit is not None)

    def as_json(self) -> dict[str, Any]:
        """Return the range as plain data."""
        return {
            "driver": self.driver,
            "kind": self.kind,
            "low": self.low,
            "high": self.high,
            "turns": self.turns,
            "reach": list(self.reach),
            "stopped": self.stopped,
            "limits": [limit.as_json() for limit in self.limits],
        }


def driver_range(path: DriverPath) -> DriverRange:
    """Return the singular points and limits of a path."""
    limits = [limit for limit in (path.low, path.high) if limit is not None]
    found = []
    for limit in limits:
        kind = "change point" if _kind(limit) == "change point" else "limit"
        found.append(SingularPoint(limit.u[0], kind, max(limit.block, -1) + 1, path.name))
    found += [
        _change_point(path, bridge)
        for bridge in path.bridges
        if not any(bridge.low <= limit.u[0] <= bridge.high for limit in limits)  # a distance of 0 is no crossing
    ]
    found.sort(key=lambda point: point.value)
    return DriverRange(
        driver=path.name,
        kind=path.kind,
        points=tuple(found if path.kind != "angle" or limits else _distinct(found, path, path.turns or 1)),
        lowest=_position(path, path.low),
        highest=_position(path, path.high),
        turns=path.turns,
        reach=(path.poses[0].u[0], path.poses[-1].u[0]),
        stopped=path.stopped,
    )


def _position(path: DriverPath, limit: Limit | None) -> LimitPosition | None:
    if limit is None:
        return None
    coordinates, kind = path.at_limit(limit), _kind(limit)
    return LimitPosition(limit.u[0], kind, coordinates, () if kind == "pole" else parting(path, coordinates))


def _kind(limit: Limit) -> str:
    """Return the kind of a limit, as in LimitPosition."""
    if limit.block in (NO_BLOCK, NEGATIVE):
        return "end"
    if limit.pole != NO_POLE:
        return "pole"
    return "change point" if limit.crosses else "dead centre"


def _change_point(path: DriverPath, bridge: Bridge) -> SingularPoint:
    """Return the zero of the determinant inside a bridge's window, by ternary search of its magnitude."""
    low, high = bridge.centre - 0.999 * bridge.half, bridge.centre + 0.999 * bridge.half
    held = [block for block in range(len(bridge.nodes[2].determinants)) if bridge.span.held >> block & 1]
    block = min(held, key=lambda block: abs(bridge.nodes[2].determinants[block]))  # of several interpolated ones
    for _ in range(90):
        third = (high - low) / 3.0
        if _determinant(bridge, low + third, block) < _determinant(bridge, high - third, block):
            high -= third
        else:
            low += third
    return SingularPoint(0.5 * (low + high), "change point", block + 1, path.name)


def _determinant(bridge: Bridge, u: float, block: int) -> float:
    """Return the magnitude of a block's determinant."""
    pose: Pose = bridge.pose((u,))
    return abs(float(pose.determinants[block]))


def _distinct(points: Sequence[SingularPoint], path: DriverPath, turns: int) -> list[SingularPoint]:
    """Return points within one cycle from the start, or within one turn if every turn has the same points."""
    if turns > 1:
        once, all_turns = _distinct(points, path, 1), _modulo(points, path, turns)
        return once if len(all_turns) == turns * len(once) else all_turns
    return _modulo(points, path, turns)


def _modulo(points: Iterable[SingularPoint], path: DriverPath, turns: int) -> list[SingularPoint]:
    """Return points within some turns from the start of the driver's law, each once, in order."""
    kept: dict[int, SingularPoint] = {}
    for point in points:
        value = replace(path, turns=turns).within_cycle(point.value)
        kept.setdefault(round(value * 1e7), replace(point, value=value))
    return sorted(kept.values(), key=lambda point: point.value)


_MOVES = 1e-3  # of the largest motion; a body that moves less is fixed
_MOST_COORDINATES = 600  # coordinates; the singular values of more take too long


def parting(path: DriverPath, at_limit: Mapping[str, float]) -> tuple[str, ...]:
    """Return the bodies that move in the null direction of Phi_q at a limit pose, in file order.

    at_limit: all coordinates by name. Empty for large mechanisms.
    """
    if len(at_limit) > _MOST_COORDINATES:
        return ()
    local, origin = localized(path.plan.mechanism)
    system = System(local)
    q = relative_to(origin, system.coordinates, at_limit)
    free = np.linalg.svd(system.scaled_jacobian(q))[2][-1]  # (n,)
    moves = np.abs(free).reshape(-1, 3).max(axis=1)
    return tuple(
        body.name for body, most in zip(local.moving_bodies, moves, strict=True) if most > _MOVES * moves.max()
    )


SMALL_TURN = math.radians(1.0)  # [rad]; enough to restore the rank near a singular point
_ZERO = 1e-7  # part of the largest entry; smaller counts as zero: a dead centre, a double root, has half the digits


@dataclass(frozen=True)
class Matrix:
    """A Jacobian at a pose: rows and columns by name, its rank and its row-reduced form."""

    title: str
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    entries: FloatArray  # (m, n)

    @property
    def reduced(self) -> FloatArray:
        """Row-reduced echelon form, (m, n)."""
        return row_reduced(self.entries)

    @property
    def rank(self) -> int:
        return int(np.any(np.abs(self.reduced) > 0.0, axis=1).sum())

    def as_json(self) -> dict[str, Any]:
        """Return the matrix as plain data."""
        return {
            "title": self.title,
            "rows": list(self.rows),
            "columns": list(self.columns),
            "entries": self.entries.tolist(),
            "reduced": self.reduced.tolist(),
            "rank": self.rank,
        }

    def __str__(self) -> str:
        head = f"{self.title}: {len(self.rows)} x {len(self.columns)}, rank {self.rank}"
        plain = _table(self.rows, self.columns, self.entries)
        return "\n".join([head, plain, "row-reduced", _table(None, self.columns, self.reduced)])


def pose_matrices(plan: SolvePlan, redundancy: Redundancy, reach: DriverRange | None) -> tuple[Matrix, ...]:
    """Return Phi_K,q and Phi_q at the assembled pose, Phi_q at each singular point and after a small turn."""
    system = System(localized(plan.mechanism)[0])
    assembled = find_assembly(system).pose
    moving = [name for name in system.coordinates if name not in plan.fixed]
    if assembled is None or not moving:
        return ()
    joint_rows = list(range(system.joint_row_count))
    driving = list(range(system.joint_row_count, len(system.rows)))
    solved = [*redundancy.kept, *driving]
    start = _at(plan, assembled.u)
    matrices = [_moving_jacobian(system, assembled.q, joint_rows, moving, f"Phi_K,q at {start}")]
    matrices.append(_moving_jacobian(system, assembled.q, solved, moving, f"Phi_q at {start}"))
    for point in reach.points if reach else ():
        near = point.value + SMALL_TURN
        if reach and reach.high is not None and near > reach.high:
            near = point.value - SMALL_TURN
        for value, note in ((point.value, "singular point"), (near, "after a small turn")):
            q = _pose(system, plan, value)
            if q is not None:
                matrices.append(_moving_jacobian(system, q, solved, moving, f"Phi_q at {_at(plan, [value])}, {note}"))
    return tuple(matrices)


def _at(plan: SolvePlan, u: Iterable[float]) -> str:
    """Return driver values for a title, such as 'crank = pi/3 (60 deg)'."""
    unit, drivers = plan.mechanism.length_unit, plan.mechanism.drivers
    return listed(driver_text(driver, float(value), unit) for driver, value in zip(drivers, u, strict=True))


def _pose(system: System, plan: SolvePlan, value: float) -> FloatArray | None:
    """Return all coordinates at a driver value; at a limit, closed from a pose just before it."""
    driver = plan.drivers[0]
    for nearer in (0.0, 1e-9, -1e-9):
        asked: dict[str, Any] = {driver.inputs[0]: [value + nearer]}
        run = solve(plan, **asked)
        if run.good[0]:
            q = relative_to(plan.origin, system.coordinates, {name: run[name][0] for name in system.coordinates})
            return q if nearer == 0.0 else close(system, q, np.array([value]))[0]
    return None


def _moving_jacobian(system: System, q: FloatArray, rows: Sequence[int], columns: Sequence[str], title: str) -> Matrix:
    """Return Phi_q of the chosen rows and coordinates, without rows that do not depend on them."""
    places = [system.coordinates.index(name) for name in columns]
    entries = system.jacobian(q)[np.ix_(list(rows), places)]
    meets = [k for k, row in enumerate(entries) if np.abs(row).max(initial=0.0) > 0.0]
    names = tuple(system.rows[rows[k]].name for k in meets)
    return Matrix(title, names, tuple(columns), entries[meets])


def row_reduced(matrix: FloatArray) -> FloatArray:
    """Return the reduced row echelon form by Gauss-Jordan with partial pivoting; rounding errors become zero."""
    a = np.array(matrix, dtype=float)
    small = _ZERO * np.abs(a).max(initial=0.0)
    top = 0
    for column in range(a.shape[1]):
        if top == a.shape[0]:
            break
        pivot = top + int(np.abs(a[top:, column]).argmax())
        if abs(a[pivot, column]) <= small:
            a[top:, column] = 0.0
            continue
        a[[top, pivot]] = a[[pivot, top]]
        a[top] /= a[top, column]
        others = [k for k in range(a.shape[0]) if k != top]
        a[others] -= np.outer(a[others, column], a[top])
        top += 1
    a[np.abs(a) <= small] = 0.0
    return a


def _table(rows: Sequence[str] | None, columns: Sequence[str], entries: FloatArray) -> str:
    width = max([10, *(len(name) + 2 for name in columns)])
    label = max((len(name) for name in rows or ()), default=0) + 2
    lines = [" " * label + "".join(name.rjust(width) for name in columns)]
    for k, row in enumerate(entries):
        name = rows[k] if rows else ""
        lines.append(name.ljust(label) + "".join(f"{value:{width}.4f}" for value in np.round(row, 4) + 0.0))
    return "\n".join(lines)
