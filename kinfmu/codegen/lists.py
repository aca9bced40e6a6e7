"""Kinds of units, and the places of a plan's numbers in lists: used by Python's loops, by C, and by C's lanes.

Blocks with the same formulas over other coordinates and numbers share one set of functions. They are first joined to
units: a block that is solved with the coordinates that follow from its unknowns at once, or the coordinates of one body
that are given outright. Consecutive units with the same formulas form a run; a chain of a thousand loops is a run of a
thousand units, with a table of what differs from one to the next.

The lists hold the unknowns first, in the order of z, then the coordinates that are given outright, then the drivers: x
their positions, x1 their rates, x2 their accelerations.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import NamedTuple

from kinfmu.mechanism.quantities import DistanceBetween
from kinfmu.plan import Block, SolvePlan
from kinfmu.plan.equations.graph import Graph, Node, reachable, symbols
from kinfmu.plan.trace import is_parameter, parameter_symbol
from kinfmu.units import CoordinateName, VariableName


@dataclass(frozen=True, eq=False)
class Kind:
    """The blocks that units of equal formulas share, over names of their own: `own0.phi`, `given0.phi`, and `c0`.

    The only unit of its kind keeps its own names. given: coordinates or driver values from outside the unit, each with
    its rate and acceleration; constants: how many numbers differ from unit to unit.
    """

    label: str
    blocks: tuple[Block, ...]
    given: tuple[tuple[str, str, str], ...]
    constants: int

    @property
    def coordinates(self) -> tuple[CoordinateName, ...]:
        return tuple(name for block in self.blocks for name in block.coordinates)

    @property
    def solved(self) -> Block | None:
        """The block that is solved by Newton, if there is one."""
        return next((block for block in self.blocks if block.unknowns), None)

    @cached_property
    def positions(self) -> list[Node]:
        """The nodes of the position stage."""
        return reachable([node for group in positions(self.blocks) for node in group])

    @property
    def assigned(self) -> tuple[CoordinateName, ...]:
        """The coordinates that are given outright."""
        return tuple(name for block in self.blocks for name, _ in block.assigned)


class UnitMember(NamedTuple):
    """What a unit has for the names of its kind: symbols from outside, numbers, and its own coordinates."""

    given: tuple[VariableName, ...]
    constants: tuple[float, ...]
    own: tuple[CoordinateName, ...]


class UnitRun(NamedTuple):
    """Consecutive units of one kind; first: number of the first solved block of the run among all solved blocks."""

    kind: Kind
    members: tuple[UnitMember, ...]
    first: int


class _Form(NamedTuple):
    """A unit without its names and numbers; units with equal `text` are of one kind."""

    text: tuple[object, ...]
    nodes: list[Node]
    member: UnitMember


_Unit = tuple[Block, ...]


def runs_of(blocks: Sequence[Block]) -> list[UnitRun]:
    """Return the blocks, in their order, as runs; units of equal formulas share a kind also in different runs."""
    units = _units(blocks)
    forms = [_form(unit) for unit in units]
    of_text: dict[tuple[object, ...], list[int]] = {}
    for k, form in enumerate(forms):
        of_text.setdefault(form.text, []).append(k)
    kinds: dict[tuple[object, ...], Kind] = {}
    differs: dict[tuple[object, ...], list[bool]] = {}
    for text, numbers in of_text.items():
        table = zip(*(forms[k].member.constants for k in numbers), strict=True)
        differs[text] = [len(set(column)) > 1 for column in table]
        first = numbers[0]
        kinds[text] = _kind(f"_{len(kinds) + 1}", units[first], forms[first], differs[text], len(numbers))
    runs, solved = [], 0
    for text, row in groupby(forms, key=lambda form: form.text):
        members = []
        for _, _, member in row:
            own = [value for value, is_own in zip(member.constants, differs[text], strict=True) if is_own]
            members.append(member._replace(constants=tuple(own)))
        runs.append(UnitRun(kinds[text], tuple(members), solved))
        solved += len(members) if kinds[text].solved else 0
    return runs


def _units(blocks: Sequence[Block]) -> list[_Unit]:
    units: list[list[Block]] = []
    for block in blocks:
        if units and _continues(units[-1][0], block):
            units[-1].append(block)
        else:
            units.append([block])
    return [tuple(unit) for unit in units]


def _continues(head: Block, block: Block) -> bool:
    """Return True if a block only gives coordinates, and these belong to the unit that starts with `head`."""
    if block.unknowns:
        return False
    name, motion = block.assigned[0]
    if head.unknowns:
        return any(symbol.name in head.unknowns for symbol in symbols(motion[:1]))
    return name.owner == head.assigned[0][0].owner


def positions(blocks: Sequence[Block]) -> Iterator[Sequence[Node]]:
    """Yield the nodes of the position stage, in an order that a unit's form and its kind share."""
    for block in blocks:
        yield [motion[0] for _, motion in block.assigned]
        yield block.residuals
        yield from block.jacobian


def _groups(unit: _Unit) -> Iterator[Sequence[Node]]:
    """Yield all nodes of a unit."""
    yield from positions(unit)
    for block in unit:
        for _, motion in block.assigned:
            yield motion[1:]
        yield block.velocity
        yield block.acceleration


def _variable(symbol: Node) -> VariableName:
    """Return the coordinate or the input of a symbol; the rows of a plan hold no others but parameters."""
    return symbol.value  # type: ignore[return-value]  # a CoordinateName or an InputName


def _form(unit: _Unit) -> _Form:
    coordinates = tuple(name for block in unit for name in block.coordinates)
    own = {name: CoordinateName(f"own{k}", name.axis) for k, name in enumerate(coordinates)}
    roots = [list(group) for group in _groups(unit)]
    nodes = reachable([node for group in roots for node in group])
    number = {node: k for k, node in enumerate(nodes)}
    met = symbols([node for group in positions(unit) for node in group])
    given = tuple(_variable(node) for node in met if node.name not in own and not is_parameter(node))
    new_name = {
        name.derivative(order): f"{canonical}{order}"
        for name, canonical in (*own.items(), *((name, f"given{k}") for k, name in enumerate(given)))
        for order in range(3)
    }
    lines: list[object] = []
    constants = []
    for node in nodes:
        if node.op == "constant":
            constants.append(float(node.value))  # type: ignore[arg-type]  # constants hold floats
            lines.append("constant")
        elif node.op == "symbol":
            lines.append(node.name if is_parameter(node) else new_name[node.name])
        else:
            lines.append((node.op, node.value, *(number[arg] for arg in node.args)))
    lines += [tuple(number[node] for node in group) for group in roots]
    for block in unit:
        rows = tuple(row.label for row in (*block.rows, *block.assigned_by))
        lines.append(
            (tuple(own[name] for name in block.coordinates), len(block.unknowns), block.row_scales, block.usual, rows)
        )
    return _Form(tuple(lines), nodes, UnitMember(given, tuple(constants), coordinates))


def _kind(label: str, unit: _Unit, form: _Form, differs: Sequence[bool], units: int) -> Kind:
    own, given = form.member.own, form.member.given
    if units == 1:
        return Kind(label, unit, tuple((name, name.derivative(1), name.derivative(2)) for name in given), 0)
    graph = Graph()
    names = {name: CoordinateName(f"own{k}", name.axis) for k, name in enumerate(own)}
    of_given: dict[VariableName, CoordinateName] = {
        name: CoordinateName(f"given{k}", "phi") for k, name in enumerate(given)
    }
    new_name = {
        name.derivative(k): new.derivative(k) for name, new in (*names.items(), *of_given.items()) for k in range(3)
    }
    new: dict[Node, Node] = {}
    is_own = iter(differs)
    count = 0
    for node in form.nodes:
        if node.op == "constant":
            if next(is_own):
                new[node] = graph.symbol(f"c{count}")
                count += 1
            else:
                new[node] = graph.constant(float(node.value))  # type: ignore[arg-type]  # constants hold floats
        elif node.op == "symbol":
            new[node] = graph.symbol(node.name if is_parameter(node) else new_name[node.name])
        else:
            new[node] = graph.copy(node, *(new[arg] for arg in node.args))
    renamed = tuple(_renamed(block, names, new) for block in unit)
    outside = tuple((new_name[name], new_name[name.derivative(1)], new_name[name.derivative(2)]) for name in given)
    return Kind(label, renamed, outside, count)


def _renamed(block: Block, names: dict[CoordinateName, CoordinateName], new: dict[Node, Node]) -> Block:
    return Block(
        assigned=tuple((names[name], tuple(new[node] for node in motion)) for name, motion in block.assigned),  # type: ignore[misc]
        unknowns=tuple(names[name] for name in block.unknowns),
        rows=tuple(row._replace(owner="") for row in block.rows),
        assigned_by=tuple(row._replace(owner="") for row in block.assigned_by),
        row_scales=block.row_scales,
        residuals=tuple(new[node] for node in block.residuals),
        jacobian=tuple(tuple(new[node] for node in row) for row in block.jacobian),
        velocity=tuple(new[node] for node in block.velocity),
        acceleration=tuple(new[node] for node in block.acceleration),
        determinant_scale=block.determinant_scale,
        row_offset=block.row_offset,
        usual=block.usual,
    )


LISTS = ("x", "x1", "x2")  # coordinates, their rates, their accelerations


def parametric(plan: SolvePlan) -> tuple[set[Node], list[Node]]:
    """Return the operations that depend on parameters only, and those of them that other operations or outputs use."""
    depends: dict[Node, bool] = {}  # on parameters only
    for node in plan.nodes:
        if node.op == "symbol":
            depends[node] = is_parameter(node)
        elif node.op != "constant":
            on = [arg for arg in node.args if arg.op != "constant"]
            depends[node] = bool(on) and all(depends[arg] for arg in on)
    own = {node for node, is_own in depends.items() if is_own and node.args}
    used = [arg for node in plan.nodes if node not in own for arg in node.args]
    used += [*plan.fixed_nodes.values(), *(motion.position for motion in plan.outputs_motion)]
    return own, list(dict.fromkeys(node for node in used if node in own))


class Lists:
    """The lists of a plan, and the runs of units that fill them.

    runs: its blocks as runs of units; order: names in the lists, `place` the place of each; given_outright: how many
    coordinates need no solving; parameters, derived: places of the parameters by their symbols, and of the nodes that
    depend on them alone.
    """

    def __init__(self, plan: SolvePlan) -> None:
        self.plan = plan
        self.runs = runs_of(plan.blocks)
        self.kinds = {run.kind.label: run.kind for run in self.runs}
        assigned = [name for block in plan.blocks for name, _ in block.assigned]
        self.given_outright = len(assigned)
        self.order: list[VariableName] = [*plan.unknowns, *assigned, *(driver.inputs[0] for driver in plan.drivers)]
        self.place: dict[str, int] = {name: k for k, name in enumerate(self.order)}
        self.parameters: dict[str, int] = {
            parameter_symbol(parameter.name): k for k, parameter in enumerate(plan.parameters)
        }
        _, derived = parametric(plan)
        self.derived = {node: k for k, node in enumerate(derived)}

    def numbered(self) -> list[tuple[int, UnitRun]]:
        """Return the runs with their numbers, from 1."""
        return list(enumerate(self.runs, start=1))

    def places(self, order: int) -> dict[str, int]:
        """Return the place in its list of each symbol of an order."""
        return {name.derivative(order): k for k, name in enumerate(self.order)}

    def outputs(self, order: int) -> list[tuple[Node, int | None]]:
        """Return each output of an order with its place in the list, None for a formula."""
        places = self.places(order)
        nodes: list[Node] = [motion[1:][order] for motion in self.plan.outputs_motion]
        return [(node, places.get(node.name) if node.op == "symbol" else None) for node in nodes]


class DistanceRow(NamedTuple):
    """A driver of a distance, by its number, and its row in a solved block; scale: of the row, per mechanism size."""

    driver: int
    block: int
    row: int
    scale: float


def distance_rows(plan: SolvePlan, solved: Sequence[Block]) -> tuple[DistanceRow, ...]:
    """Return the rows of the plan's drivers of distances; solved: the blocks that need Newton."""
    found = []
    for number, driver in enumerate(plan.mechanism.drivers):
        measure = driver.measured()
        if isinstance(measure, DistanceBetween):
            found += [
                DistanceRow(number, k, place, measure.scale(plan.size) * plan.size)
                for k, block in enumerate(solved)
                for place, row in enumerate(block.rows)
                if (row.owner, row.label) == (driver.name, driver.noun)
            ]
    return tuple(found)
