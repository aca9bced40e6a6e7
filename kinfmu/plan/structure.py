"""Structure of the rows: which coordinates are constants, which are given outright, and which blocks remain.

rows -> constants -> matching and strongly connected components -> blocks in order -> assignments in each block
"""

from __future__ import annotations

import heapq
from collections import ChainMap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from kinfmu.arrays import FloatArray
from kinfmu.errors import MobilityError, listed
from kinfmu.plan.companions import BlockStructure, with_companions
from kinfmu.plan.equations.blocks import ordered_blocks
from kinfmu.plan.equations.graph import Node, symbols
from kinfmu.plan.equations.redundancy import Redundancy
from kinfmu.plan.equations.system import System
from kinfmu.plan.origin import far_rows
from kinfmu.plan.trace import Tracer, is_parameter
from kinfmu.units import CoordinateName

_LEAST_DIVISOR = 0.5  # of the largest factor of a length in a row: along an axis 1e-6 rad from x, y follows from x


@dataclass(frozen=True)
class Structure:
    """The order of solving.

    fixed: coordinates that joints hold at a constant or a formula of parameters, in file order; fixed_by: the row that
    gives each, in the order in which they are found; blocks: in the order of solving.
    """

    fixed: Mapping[str, Node]
    fixed_by: Mapping[CoordinateName, int]
    blocks: tuple[BlockStructure, ...]


class RowTracer:
    """The rows of a system by index, traced with the coordinates known so far."""

    def __init__(self, system: System, tracer: Tracer) -> None:
        self.tracer = tracer
        self._system = system
        self._traced: dict[tuple[int, tuple[Node | None, ...]], tuple[Node, ...]] = {}  # by member and what is known

    def __call__(self, index: int, known: Mapping[str, Node]) -> Node:
        number = self._system.member_of[index]
        member = self._system.members[number]
        coordinates = self._system.coordinates
        key = number, tuple([known.get(coordinates[column]) for column in member.columns])
        rows = self._traced.get(key)
        if rows is None:
            rows = self._traced[key] = self._rows(number, known)
        return rows[index - member.rows[0]]

    def _rows(self, number: int, known: Mapping[str, Node]) -> tuple[Node, ...]:
        """Return the rows of a joint or driver, by its number among the members."""
        joints = self.tracer.joints
        if number < len(joints):
            return self.tracer.joint(joints[number], known)
        return (self.tracer.driver(self.tracer.drivers[number - len(joints)], known),)


def find_structure(
    system: System, tracer: Tracer, row: RowTracer, redundancy: Redundancy, pose: FloatArray
) -> Structure:
    """Return the order of solving the kept joint rows and the driver rows; redundant rows may become companions.

    pose: closed, (n,).
    """
    kept = redundancy.kept
    known, fixed_by = _constants(system, tracer, row, kept)
    used = set(fixed_by.values())
    driving = range(system.joint_row_count, len(system.rows))
    open_rows = [index for index in (*kept, *driving) if index not in used]
    unknown = [name for name in system.coordinates if name not in known]
    number: dict[str, int] = {name: k for k, name in enumerate(unknown)}
    meets = {
        index: [number[symbol.name] for symbol in symbols([row(index, known)]) if symbol.name in number]
        for index in open_rows
    }
    order = ordered_blocks([meets[index] for index in open_rows], len(unknown), len(driving))
    if order.unmatched_rows or order.unmatched_columns:
        missed = [unknown[k] for k in order.unmatched_columns]
        spare = [system.rows[open_rows[k]].name for k in order.unmatched_rows]
        raise MobilityError(f"nothing determines {listed(missed)}; rows to spare: {listed(spare)}")
    slopes = far_rows(system, pose).slopes
    blocks = [
        _with_assignments(tracer, row, known, [open_rows[k] for k in rows], [unknown[k] for k in columns], slopes)
        for rows, columns in order.blocks
    ]

    def met(index: int) -> list[str]:
        return [symbol.name for symbol in symbols([row(index, known)])]

    return Structure(known, fixed_by, tuple(with_companions(system, met, blocks, redundancy, pose)))


def linear_coefficient(row: Node, symbol: Node) -> float | None:
    """Return c if the row is c * symbol + rest, with a constant c != 0 and a rest free of the symbol; else None."""
    graph = row.graph
    (slope,) = graph.derivative([row], {symbol: graph.constant(1.0)})
    return slope.constant or None


def given_value(tracer: Tracer, row: RowTracer, index: int, name: str, known: Mapping[str, Node]) -> Node | None:
    """Return what a row gives outright for a coordinate: -rest / c, or None if it does not."""
    coefficient = linear_coefficient(row(index, known), tracer.symbols[name])
    if coefficient is None:
        return None
    rest = row(index, ChainMap({name: tracer.graph.constant(0.0)}, known))  # type: ignore[arg-type]  # only read
    return -rest if coefficient == 1.0 else rest if coefficient == -1.0 else rest / -coefficient


def _constants(
    system: System, tracer: Tracer, row: RowTracer, kept: Sequence[int]
) -> tuple[dict[str, Node], dict[CoordinateName, int]]:
    """Return the coordinates that the kept joint rows fix, in file order, and the row that gives each."""
    values: dict[str, Node] = {}
    fixed_by: dict[CoordinateName, int] = {}
    used: set[int] = set()
    touching: dict[str, list[int]] = {}  # body -> rows
    joints = {joint.name: joint for joint in system.mechanism.joints}
    for index in kept:
        for body in joints[system.rows[index].owner].bodies():
            touching.setdefault(body, []).append(index)
    waiting = list(kept)
    heapq.heapify(waiting)
    while waiting:
        index = heapq.heappop(waiting)
        if index in used:
            continue
        free = [symbol for symbol in symbols([row(index, values)]) if not is_parameter(symbol)]
        coordinate = free[0].coordinate if len(free) == 1 else None
        value = None if coordinate is None else given_value(tracer, row, index, coordinate, values)
        if coordinate is None or value is None:
            continue
        values[coordinate] = value
        fixed_by[coordinate] = index
        used.add(index)
        for again in touching[coordinate.owner]:
            heapq.heappush(waiting, again)
    return {name: values[name] for name in system.coordinates if name in values}, fixed_by


def _with_assignments(
    tracer: Tracer,
    row: RowTracer,
    known: Mapping[str, Node],
    rows: Sequence[int],
    columns: Sequence[CoordinateName],
    slopes: FloatArray,
) -> BlockStructure:
    """Return a block with assignments: rows that give a coordinate outright, without circles among them.

    slopes: those of `FarRows`. An angle that follows from lengths there is not assigned, because its rounding
    is counted as that of a solved row.
    """
    needs: dict[CoordinateName, set[CoordinateName]] = {}  # assigned coordinate -> coordinates of the block in its row
    assigned: dict[CoordinateName, int] = {}
    for index in rows:
        traced = row(index, known)
        inside = [one.coordinate for one in symbols([traced]) if one.coordinate is not None and one.name in columns]
        inside.sort(key=lambda name: (name.is_angle, columns.index(name)))
        factors = [abs(linear_coefficient(traced, tracer.symbols[name]) or 0.0) for name in inside]
        largest = max((factor for name, factor in zip(inside, factors, strict=True) if not name.is_angle), default=0.0)
        for name, factor in zip(inside, factors, strict=True):
            if name in assigned or factor == 0.0 or (factor < _LEAST_DIVISOR * largest and not name.is_angle):
                continue
            if name.is_angle and slopes[index]:
                continue
            others = {other for other in inside if other != name}
            if _reaches(needs, others, name):
                continue
            assigned[name] = index
            needs[name] = others
            break
    order: list[CoordinateName] = []
    left = dict(assigned)
    while left:
        ready = [name for name in left if not needs[name] & left.keys()]
        order += ready
        for name in ready:
            del left[name]
    rest = tuple(index for index in rows if index not in assigned.values())
    unknowns = tuple(name for name in columns if name not in assigned)
    return BlockStructure(tuple((name, assigned[name]) for name in order), unknowns, rest)


def _reaches(needs: Mapping[CoordinateName, set[CoordinateName]], start: set[CoordinateName], goal: str) -> bool:
    """Return True if an assignment among `start` needs `goal`, directly or through others."""
    stack, seen = list(start), set(start)
    while stack:
        name = stack.pop()
        if name == goal:
            return True
        new = needs.get(name, set()) - seen
        seen |= new
        stack += new
    return False
