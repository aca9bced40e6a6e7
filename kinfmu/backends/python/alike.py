"""Alike blocks: the same formulas over other coordinates and other numbers. They share one set of functions.

A chain of a thousand loops is then a thousand calls of one loop's code and not a thousand copies of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from kinfmu.backends.python.block_code import (
    indented,
    kept_name,
    matrix,
    newton_lines,
    solution_lines,
    tupled,
    unpacking,
)
from kinfmu.backends.python.definitions import Definition
from kinfmu.backends.python.writer import Names, Writer, identifier
from kinfmu.equations.graph import Graph, Node, reachable
from kinfmu.naming import derivative_name
from kinfmu.plan import Block
from kinfmu.plan.trace import is_parameter
from kinfmu.solver.curve import CurveData

SHARED_FROM = 8  # alike blocks; for fewer a call costs more than the code it saves


class Member(NamedTuple):
    """A block as a member of its kind: what stands in place of the kind's own names.

    given: position symbols from outside, coordinates or driver values, in order; constants: numbers that differ from
    block to block.
    """

    kind: Kind
    given: tuple[str, ...]
    constants: tuple[float, ...]


class _Form(NamedTuple):
    """A block seen without its names and numbers; equal `text` means alike."""

    text: tuple[object, ...]
    nodes: list[Node]
    given: tuple[str, ...]
    constants: tuple[float, ...]


def grouped(blocks: Sequence[Block], rate_of: Callable[[str, int], str]) -> dict[int, Member]:
    """Members by index of the block, where SHARED_FROM blocks or more are alike.

    rate_of: name of a coordinate's or driver value's derivative.
    """
    forms = {k: _form(block, rate_of) for k, block in enumerate(blocks) if block.unknowns}
    groups: dict[tuple[object, ...], list[int]] = {}
    for k, form in forms.items():
        groups.setdefault(form.text, []).append(k)
    members: dict[int, Member] = {}
    kinds = 0
    for numbers in groups.values():
        if len(numbers) < SHARED_FROM:
            continue
        kinds += 1
        table = [forms[k].constants for k in numbers]
        differs = [len(set(column)) > 1 for column in zip(*table, strict=True)]
        first = numbers[0]
        kind = Kind(f"_{kinds}", _renamed(blocks[first], forms[first], differs, rate_of), len(numbers), differs)
        for k in numbers:
            own = tuple(value for value, told in zip(forms[k].constants, differs, strict=True) if told)
            members[k] = Member(kind, forms[k].given, own)
    return members


def _groups(block: Block) -> Iterator[Sequence[Node]]:
    """All nodes of a block, in an order that its form and its renamed copy share."""
    for _, motion in block.assigned:
        yield motion
    yield block.residuals
    yield from block.jacobian
    yield block.velocity
    yield block.acceleration


def _form(block: Block, rate_of: Callable[[str, int], str]) -> _Form:
    own = {name: f"own{k}{name[name.rindex('.') :]}" for k, name in enumerate(block.coordinates)}
    roots = [list(group) for group in _groups(block)]
    nodes = reachable([node for group in roots for node in group])
    number = {node: k for k, node in enumerate(nodes)}
    positions = [node for group in _position_groups(block) for node in group]
    given = tuple(
        node.name
        for node in reachable(positions)
        if node.op == "symbol" and node.name not in own and not is_parameter(node)
    )
    spoken = {
        rate_of(name, order): f"{canonical}{order}"
        for name, canonical in [*own.items(), *((name, f"given{k}") for k, name in enumerate(given))]
        for order in range(3)
    }
    lines: list[object] = []
    constants = []
    for node in nodes:
        if node.op == "constant":
            constants.append(float(node.value))  # type: ignore[arg-type]  # constants hold floats
            lines.append("constant")
        elif node.op == "symbol":
            lines.append(node.name if is_parameter(node) else spoken[node.name])
        else:
            lines.append((node.op, node.value, *(number[arg] for arg in node.args)))
    lines += [tuple(number[node] for node in group) for group in roots]
    lines.append((tuple(own.values()), len(block.unknowns), block.row_scales))
    lines.append(tuple(name.rpartition(".")[2] for name in (*block.row_names, *block.assigned_by)))
    return _Form(tuple(lines), nodes, given, tuple(constants))


def _position_groups(block: Block) -> Iterator[Sequence[Node]]:
    for _, motion in block.assigned:
        yield motion[:1]
    yield block.residuals
    yield from block.jacobian


def _renamed(block: Block, form: _Form, differs: Sequence[bool], rate_of: Callable[[str, int], str]) -> Block:
    """The block over the kind's own names: own0.phi, given0.phi, c0."""
    graph = Graph()
    names = {name: f"own{k}{name[name.rindex('.') :]}" for k, name in enumerate(block.coordinates)}
    names |= {name: f"given{k}.phi" for k, name in enumerate(form.given)}
    spoken = {rate_of(name, k): derivative_name(new, k) for name, new in names.items() for k in range(3)}
    new: dict[Node, Node] = {}
    is_told = iter(differs)
    told = 0
    for node in form.nodes:
        if node.op == "constant":
            if next(is_told):
                new[node] = graph.symbol(f"c{told}")
                told += 1
            else:
                new[node] = graph.constant(float(node.value))  # type: ignore[arg-type]  # constants hold floats
        elif node.op == "symbol":
            new[node] = graph.symbol(node.name if is_parameter(node) else spoken[node.name])
        else:
            new[node] = graph.copy(node, *(new[arg] for arg in node.args))
    return Block(
        assigned=tuple((names[name], tuple(new[node] for node in motion)) for name, motion in block.assigned),  # type: ignore[misc]
        unknowns=tuple(names[name] for name in block.unknowns),
        row_names=tuple(name.rpartition(".")[2] for name in block.row_names),
        assigned_by=tuple(name.rpartition(".")[2] for name in block.assigned_by),
        row_scales=block.row_scales,
        residuals=tuple(new[node] for node in block.residuals),
        jacobian=tuple(tuple(new[node] for node in row) for row in block.jacobian),
        velocity=tuple(new[node] for node in block.velocity),
        acceleration=tuple(new[node] for node in block.acceleration),
        determinant_scale=block.determinant_scale,
    )


@dataclass(frozen=True, eq=False)
class Kind:
    """What alike blocks share: one block over names of its own, and the functions made of it.

        position(given..., constants..., p..., z, first, held, number)
                                                    -> coordinates, determinant, error, iterations, hold
        velocity(hold, rates of given...)           -> rates of the unknowns
        acceleration(hold, both of given..., own rates...)  -> accelerations of the unknowns
        rates, accelerations                        -> the same of the assigned coordinates
        jacobian(hold)                              -> its Jacobian

    p: predicted unknowns; z[first], ...: the unknowns before; hold: what the later functions need of the position.
    """

    label: str
    block: Block
    count: int
    differs: Sequence[bool]

    def given(self) -> list[str]:
        """Canonical names of what comes from outside, in order."""
        names = {
            node.name
            for group in _position_groups(self.block)
            for node in reachable(group)
            if node.op == "symbol" and node.name.startswith("given")
        }
        return sorted(names, key=lambda name: int(name.removeprefix("given").partition(".")[0]))

    def source(self, curves: Mapping[CurveData, str], with_residuals: bool) -> list[str]:
        """The functions; curves: names of the constants that hold the data of curves."""
        return _KindEmitter(self, curves).source(with_residuals)


class _KindEmitter:
    def __init__(self, kind: Kind, curves: Mapping[CurveData, str]) -> None:
        self.kind = kind
        self.block = block = kind.block
        self.names = Names(block.coordinates, curves)
        for name, motion in block.assigned:
            self.names.assign(motion[0], name)
        self.positions = [node for group in _position_groups(block) for node in group]
        self.hold: dict[str, Node | None] = {}

    def source(self, with_residuals: bool) -> list[str]:
        later = [
            self._linear("velocity", 1, self.block.velocity),
            self._linear("acceleration", 2, self.block.acceleration),
            *([self._assigned("rates", 1), self._assigned("accelerations", 2)] if self.block.assigned else []),
            self._jacobian(),
            *([self._residual()] if with_residuals else []),
        ]
        parts = self._position()
        hold = "\n".join(unpacking(self.hold, "hold"))
        for lines in later:
            parts += [hold if line is _HOLD else line for line in lines]
        return parts

    def _position(self) -> list[str]:
        block, label = self.block, self.kind.label
        keep = [node for node in self.hold.values() if node is not None]
        writer = Writer(self.names, (), keep)
        count = len(block.unknowns)
        arguments = [identifier(name) for name in self.kind.given()]
        arguments += [f"c{k}" for k in range(sum(self.kind.differs))]
        z = [identifier(name) for name in block.unknowns]
        lines = newton_lines(writer, block, label, [f"z[first + {k}]" for k in range(count)], _HELD, "number")
        own = [identifier(name) for name in block.coordinates]
        about = f"{len(block.residuals)} x {count} from rows {', '.join(block.row_names)}"
        return [
            "",
            f"def position{label}({', '.join([*arguments, *z, 'z', 'first', 'held', 'number'])}):",
            f'    """One of {self.kind.count} blocks that are alike: {about}."""',
            *indented(lines),
            f"    return {', '.join(own)}, det{label}, error, iteration, {tupled(self.hold)}",
            "",
        ]

    def _linear(self, name: str, order: int, right: Sequence[Node]) -> list[str]:
        writer = Writer(self.names, reachable(self.positions))
        block, label = self.block, self.kind.label
        lines = writer.statements([*right, *(entry for row in block.jacobian for entry in row)])
        b = [f"b{i}" for i in range(len(right))]
        lines += [f"{one} = {writer.expression(node)}" for one, node in zip(b, right, strict=True)]
        z = [identifier(derivative_name(unknown, order)) for unknown in block.unknowns]
        jacobian = [[writer.expression(entry) for entry in row] for row in block.jacobian]
        self.hold.setdefault(kept_name(block, label), None)
        lines += solution_lines(label, jacobian, b, z)
        self._import(writer)
        own = block.coordinates if order == 2 else ()
        return self._function(name, order, own, lines, z)

    def _assigned(self, name: str, order: int) -> list[str]:
        writer = Writer(self.names, reachable(self.positions))
        lines = []
        for coordinate, motion in self.block.assigned:
            lines += writer.statements([motion[order]])
            lines.append(f"{identifier(derivative_name(coordinate, order))} = {writer.expression(motion[order])}")
        self._import(writer)
        results = [identifier(derivative_name(coordinate, order)) for coordinate, _ in self.block.assigned]
        own = self.block.unknowns if order == 1 else self.block.coordinates
        extra = [derivative_name(unknown, order) for unknown in self.block.unknowns] if order == 2 else []
        return self._function(name, order, own, lines, results, extra)

    def _function(
        self,
        name: str,
        order: int,
        own: Iterable[str],
        lines: Sequence[str],
        results: Sequence[str],
        extra: Iterable[str] = (),
    ) -> list[str]:
        arguments = ["hold"]
        arguments += [identifier(derivative_name(g, k)) for k in range(1, order + 1) for g in self.kind.given()]
        arguments += [identifier(derivative_name(coordinate, 1)) for coordinate in own]
        arguments += [identifier(one) for one in extra]
        return [
            "",
            f"def {name}{self.kind.label}({', '.join(arguments)}):",
            _HOLD,
            *indented(lines),
            f"    return {tupled(results)}",
            "",
        ]

    def _jacobian(self) -> list[str]:
        writer = Writer(self.names, reachable(self.positions))
        lines = writer.statements([entry for row in self.block.jacobian for entry in row])
        rows = [[writer.expression(entry) for entry in row] for row in self.block.jacobian]
        self._import(writer)
        label = self.kind.label
        return ["", f"def jacobian{label}(hold):", _HOLD, *indented(lines), f"    return {matrix(rows)}", ""]

    def _residual(self) -> list[str]:
        writer = Writer(self.names, reachable(self.positions))
        lines = writer.statements(self.block.residuals)
        scaled = zip(self.block.residuals, self.block.row_scales, strict=True)
        row = ", ".join(f"({writer.expression(r)}) / {scale!r}" for r, scale in scaled)
        self._import(writer)
        return ["", f"def residual{self.kind.label}(hold):", _HOLD, *indented(lines), f"    return [{row}]", ""]

    def _import(self, writer: Writer) -> None:
        """Note what a later function takes from the position."""
        for node in writer.used:
            if node.op != "symbol":
                self.hold.setdefault(self.names.of(node), node)
            elif not node.name.endswith(_RATES) and not is_parameter(node):
                self.hold.setdefault(identifier(node.name), None)


_HOLD = "    <hold>"
_HELD = "(held and held >> number & 1)"  # as a rule nothing is held
_RATES = (".vx", ".vy", ".omega", ".ax", ".ay", ".alpha")


class Calls:
    """Calls of a kind's functions for one of its members, in the names of the module.

    number: of the block among those that are solved, from 0; rate_of: name of a derivative of a coordinate or driver
    value; spoken: how a rate is written where the call stands, by its name or as a number.
    """

    def __init__(self, number: int, block: Block, member: Member, rate_of: Callable[[str, int], str]) -> None:
        self.number = number
        self.block = block
        self.member = member
        self.rate_of = rate_of
        self.hold = f"hold{number + 1}"

    def position(self, first: int) -> str:
        """The block's position from predictions that stand in its unknowns; first: place of its unknowns in z."""
        given = [*map(identifier, self.member.given), *map(repr, self.member.constants)]
        own = [identifier(name) for name in self.block.coordinates]
        results = [*own, f"det{self.number + 1}", "error", "iteration", self.hold]
        predicted = [identifier(name) for name in self.block.unknowns]
        arguments = [*given, *predicted, "z", str(first), "held", str(self.number)]
        return f"{', '.join(results)} = position{self.member.kind.label}({', '.join(arguments)})"

    def linear(self, order: int, spoken: Callable[[str], str]) -> str:
        """Rates (order 1) or accelerations (2) of the unknowns."""
        name = ("velocity", "acceleration")[order - 1]
        results = tupled(identifier(self.rate_of(unknown, order)) for unknown in self.block.unknowns)
        return f"{results} = {name}{self.member.kind.label}({', '.join([self.hold, *map(spoken, self.needs(order))])})"

    def needs(self, order: int) -> list[str]:
        """Rates that the linear solve of an order is made of."""
        names = [self.rate_of(name, k) for k in range(1, order + 1) for name in self.member.given]
        return names + ([self.rate_of(name, 1) for name in self.block.coordinates] if order == 2 else [])

    def definition(self, order: int, spoken: Callable[[str], str]) -> Definition:
        """Rates or accelerations of the assigned coordinates, from those of the unknowns."""
        names = [self.rate_of(name, order) for name, _ in self.block.assigned]
        given = [self.rate_of(name, k) for k in range(1, order + 1) for name in self.member.given]
        own = self.block.unknowns if order == 1 else self.block.coordinates
        needs = [*given, *(self.rate_of(name, 1) for name in own)]
        needs += [self.rate_of(name, 2) for name in self.block.unknowns] if order == 2 else []
        function = ("rates", "accelerations")[order - 1] + self.member.kind.label

        def write(_writer: Writer) -> list[str]:
            arguments = ", ".join([self.hold, *map(spoken, needs)])
            return [f"{tupled(map(identifier, names))} = {function}({arguments})"]

        return Definition(tuple(names), tuple(needs), write)

    def jacobian(self) -> str:
        """The block's Jacobian as an expression."""
        return f"jacobian{self.member.kind.label}({self.hold})"

    def residual(self) -> str:
        """The block's residuals, relative to the size, as an expression."""
        return f"residual{self.member.kind.label}({self.hold})"
