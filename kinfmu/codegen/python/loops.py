"""The functions of a kind of units: each a loop over a run of them, on lists that hold all coordinates.

    position(run, x, z, held, enough, number, determinants, largest, iterations) -> holds, largest, iterations
    velocity(run, holds, x1, given, held, number)                        rates of the unit's coordinates, into x1
    acceleration(run, holds, x1, x2, given, held, number)                accelerations, into x2
    rates(run, holds, x1)                                                of the coordinates that are given outright
    accelerations(run, holds, x1, x2)                                    the same
    jacobian(run, holds, found), residual(run, holds, found)             appended to `found`

A row of a run holds the places of the unit's given values in the lists, its own numbers, and the places of its
coordinates. holds: what the later functions read from the position stage, one tuple per unit; number: of the unit's
block. Kinds without a solved block have the shorter position(run, x) -> holds, rates and accelerations only.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from kinfmu.codegen.lists import LISTS, Kind
from kinfmu.codegen.newton import jacobian_text, outright, right_side
from kinfmu.codegen.python.block_code import (
    BY_ROW,
    defined,
    indented,
    kept_name,
    matrix,
    newton_lines,
    scaled_residuals,
    solution_lines,
    tupled,
)
from kinfmu.codegen.writer import Names, Writer, identifier
from kinfmu.plan import Block
from kinfmu.plan.equations.graph import Node
from kinfmu.plan.trace import is_parameter
from kinfmu.solver.python.curve import CurveData


class Loops:
    """The writer of one kind's functions. curves: names of the constants that hold the data of curves."""

    def __init__(self, kind: Kind, curves: Mapping[CurveData, str]) -> None:
        self.kind = kind
        self.label = kind.label
        self.names = Names.of_blocks(kind.blocks, curves)
        self.positions = kind.positions
        own = {name: f"k{i}" for i, name in enumerate(kind.coordinates)}
        self.row = tupled(
            [*(f"g{i}" for i in range(len(kind.given))), *(f"c{i}" for i in range(kind.constants)), *own.values()]
        )
        self.places = {
            names[order]: f"{LISTS[order]}[g{i}]" for i, names in enumerate(kind.given) for order in range(3)
        }
        for order in range(3):
            self.places |= {
                name.derivative(order): f"{LISTS[order]}[{place}]"
                for name, place in zip(kind.coordinates, own.values(), strict=True)
            }
        self.own = own
        self.hold: dict[str, Node | None] = {}  # names that later functions take from the position

    def source(self) -> list[str]:
        """Return all functions, those of the position stage first."""
        kind, later = self.kind, []
        if kind.solved:
            later += self._linear("velocity", 1) + self._linear("acceleration", 2)
            later += self._matrices(kind.solved) + self._residuals(kind.solved)
        if kind.assigned:
            later += self._assigned("rates", 1) + self._assigned("accelerations", 2)
        parts = self._position()
        hold = tupled(self.hold)
        return [*parts, *(line.replace(_HOLD, hold) for line in later)]

    def _position(self) -> list[str]:
        keep = [node for node in self.hold.values() if node is not None]
        writer = Writer(self.names, (), keep)
        solved, label = self.kind.solved, self.label
        lines: list[str] = []
        for block in self.kind.blocks:
            if not block.unknowns:
                lines += outright(writer, block, BY_ROW)
                continue
            starts = [f"z[{self.own[name]}]" for name in block.unknowns]
            lines += newton_lines(writer, block, label, starts, f"({_HELD})", "number")
            lines += ["iterations += iteration", "if error > largest:", "    largest = error"]
            lines += [f"determinants.append(det{label})", "number += 1"]
        lines = self._loaded(writer, self.kind.assigned) + lines
        lines += [f"{self.places[name]} = {identifier(name)}" for name in self.kind.coordinates]
        arguments, results = ["run", "x"], ["holds"]
        about = "Coordinates that are given outright."
        if solved:
            arguments += ["z", "held", "enough", "number", "determinants", "largest", "iterations"]
            results += ["largest", "iterations"]
            about = f"{len(solved.residuals)} x {len(solved.unknowns)} from rows {', '.join(solved.row_names)}."
        lines.append(f"holds.append({tupled(self.hold)})")
        loop = ["holds = []", f"for {self.row} in run:", *indented(lines)]
        return defined(f"position{label}({', '.join(arguments)})", about, loop, ", ".join(results))

    def _loaded(self, writer: Writer, known: Iterable[str]) -> list[str]:
        """Return statements that read from the lists what the written ones use and do not know."""
        known = set(map(identifier, known))
        names = [node.name for node in writer.used if node.op == "symbol" and node.name in self.places]
        return [f"{identifier(name)} = {self.places[name]}" for name in names if identifier(name) not in known]

    def _later(self, name: str, arguments: Sequence[str], lines: Sequence[str], *, counted: bool = False) -> list[str]:
        """Return a function that loops over units with what the position stage kept."""
        return [
            "",
            f"def {name}{self.label}({', '.join(['run', 'holds', *arguments])}):",
            f"    for {self.row}, {_HOLD} in zip(run, holds):",
            *indented(lines, 8),
            *(["        number += 1"] if counted else []),
            "",
        ]

    def _linear(self, name: str, order: int) -> list[str]:
        """Return the function of the rates (order 1) or accelerations (2) of all coordinates of the units."""
        writer = Writer(self.names, self.positions)
        lines: list[str] = []
        found: list[str] = []
        for block in self.kind.blocks:
            if block.unknowns:
                lines += self._solution(writer, block, order)
            lines += self._assignments(writer, block, order)
            found += [coordinate.derivative(order) for coordinate in block.coordinates]
        self._import(writer)
        lines = self._loaded(writer, [*self.hold, *found]) + lines
        lists = LISTS[1 : order + 1]
        return self._later(name, [*lists, "given", "held", "number"], lines, counted=True)

    def _solution(self, writer: Writer, block: Block, order: int) -> list[str]:
        """Return the linear solve of a block, or the values given in its place."""
        right = (block.velocity, block.acceleration)[order - 1]
        b, lines = right_side(writer, "b", right, block.entries)
        z = [identifier(unknown.derivative(order)) for unknown in block.unknowns]
        jacobian = jacobian_text(writer, block)
        self.hold.setdefault(kept_name(block, self.label), None)
        taken = [f"given[{self.own[name]}]" for name in block.unknowns]
        places = [self.places[name.derivative(order)] for name in block.unknowns]
        return [
            *lines,
            f"if {_HELD}:",
            *(f"    {one} = {value}" for one, value in zip(z, taken, strict=True)),
            "else:",
            *indented(solution_lines(self.label, order, jacobian, b, z)),
            *(f"{place} = {one}" for place, one in zip(places, z, strict=True)),
        ]

    def _assignments(self, writer: Writer, block: Block, order: int) -> list[str]:
        lines = []
        for coordinate, motion in block.assigned:
            name = coordinate.derivative(order)
            lines += writer.statements([motion[order]])
            lines.append(f"{identifier(name)} = {self.places[name]} = {writer.expression(motion[order])}")
        return lines

    def _assigned(self, name: str, order: int) -> list[str]:
        writer = Writer(self.names, self.positions)
        lines = [line for block in self.kind.blocks for line in self._assignments(writer, block, order)]
        self._import(writer)
        found = [coordinate.derivative(order) for coordinate in self.kind.assigned]
        return self._later(name, LISTS[1 : order + 1], self._loaded(writer, [*self.hold, *found]) + lines)

    def _matrices(self, block: Block) -> list[str]:
        writer = Writer(self.names, self.positions)
        lines = writer.statements(block.entries)
        rows = jacobian_text(writer, block)
        self._import(writer)
        return self._later("jacobian", ["found"], [*lines, f"found.append({matrix(rows)})"])

    def _residuals(self, block: Block) -> list[str]:
        writer = Writer(self.names, self.positions)
        lines, row = scaled_residuals(writer, block)
        self._import(writer)
        return self._later("residual", ["found"], [*lines, f"found.append({row})"])

    def _import(self, writer: Writer) -> None:
        """Record what a later function reads from the position stage."""
        readable = {*self.own, *(names[0] for names in self.kind.given)}
        for node in writer.used:
            if node.op != "symbol":
                self.hold.setdefault(self.names.of(node), node)
            elif node.name in readable and not is_parameter(node):
                self.hold.setdefault(identifier(node.name), None)


_HOLD = "<hold>"
_HELD = "held and held >> number & 1"  # usually no block is held
