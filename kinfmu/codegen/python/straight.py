"""The model module of a plan of few blocks: all unrolled, every number under its own name."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Mapping, Sequence

from kinfmu.codegen.lists import parametric
from kinfmu.codegen.newton import jacobian_text, outright, right_side
from kinfmu.codegen.python.block_code import (
    BY_ROW,
    extreme,
    indented,
    kept_name,
    matrix,
    newton_lines,
    scaled_residuals,
    solution_lines,
    tupled,
    unpacking,
)
from kinfmu.codegen.python.header import (
    ORDERS,
    bound,
    curve_names,
    differences,
    drive,
    header,
    law_steps,
    places,
    stage,
)
from kinfmu.codegen.writer import Names, Writer, identifier
from kinfmu.plan import Block, SolvePlan
from kinfmu.plan.equations.graph import Node, reachable, symbols

_VALUES = "<values>"  # in place of the statements that unpack `values`, which are known when all stages are written
_Motions = Sequence[Sequence[Node]]  # positions, rates, accelerations
_Right = Callable[[Block], tuple[Node, ...]]  # right side of a block's linear solve


def straight(plan: SolvePlan) -> str:
    """Return the source text of the module; equal plans give equal text."""
    return _Straight(plan).module()


class _Straight:
    """The writer of the module of one plan."""

    def __init__(self, plan: SolvePlan) -> None:
        self.plan = plan
        self.solved = [block for block in plan.blocks if block.unknowns]
        self.curves = curve_names(plan)
        self.unknowns = plan.unknowns
        self.places = places(self.solved)
        self.names = Names.of_blocks(plan.blocks, self.curves)
        self.position_nodes: list[Node] = []
        self.formulas: dict[str, Node] = {}  # of rates and accelerations of assigned coordinates
        for block in plan.blocks:
            for name, motion in block.assigned:
                self.formulas |= {name.derivative(order): motion[order] for order in (1, 2)}
            self.position_nodes += [motion[0] for _, motion in block.assigned]
            self.position_nodes += [*block.residuals, *block.entries]
        self.parametric, self.prolog = parametric(plan)
        known = [node for node in reachable(self.position_nodes) if node not in self.parametric]
        self.known = {*known, *self.prolog}  # computed before the later stages
        self.definitions = Definitions(self.formulas)
        self.inputs = [[driver.inputs[order] for driver in plan.drivers] for order in range(3)]
        self.exports: dict[str, Node | None] = {}  # names that later stages read from `values`

    def module(self) -> str:
        """Return constants and functions; with parameters the functions are in `bound`, which binds their values."""
        later = [
            self._velocity(),
            self._acceleration(),
            *(self._tangent() if len(self.plan.drivers) == 1 else ()),
            *(self._stage(name, orders, self._outputs()) for name, orders in ORDERS.items()),
            *(self._laws() if self.plan.path_laws.units else ()),
            self._watches(),
            self._jacobians(),
            self._residuals(),
        ]
        position = self._position()  # after the later stages: they determine what it returns
        (unpacked,) = unpacking(self.exports, "values") or ["# no values are read"]
        functions = [*drive(self.plan, self.curves), *position, *differences(self.plan)]
        for lines in later:
            functions += [line.replace(_VALUES, unpacked) for line in lines]
        if self.plan.path_laws.units:
            functions += law_steps(self.plan, self.names, self.prolog)
        if self.plan.parameters:
            functions = bound(self.plan, self.names, self.prolog, functions)
        return "\n".join([*header(self.plan, self.curves), *functions]) + "\n"

    def _position(self) -> list[str]:
        keep = [node for node in self.exports.values() if node is not None]
        writer = Writer(self.names, self.prolog, keep)
        lines = unpacking(map(identifier, self.inputs[0]), "u")
        if self.solved:
            lines += ["half = 0.5 * s"]
            if len(self.solved) > 1:
                lines += ["largest, iterations = 0.0, 0"]
            lines += self._predicted()
        number = 0
        for block in self.plan.blocks:
            if block.unknowns:
                lines += self._solved(writer, number, block)
                number += 1
            else:
                lines += outright(writer, block, BY_ROW)
        z = tupled(identifier(name) for name in self.unknowns)
        values = tupled(self.exports)
        determinants = [f"m{k}" for k in range(1, len(self.solved) + 1)]
        summary = "1.0, 0.0, 0, 0.0"
        if self.solved:
            dets = zip(determinants, self.solved, strict=True)
            for m, block in dets:
                scale = 1.0 / block.determinant_scale
                lines.append(f"{m} = det{m[1:]}" if scale == 1.0 else f"{m} = det{m[1:]} * {scale!r}")
            margin = extreme("min", [f"abs({m})" for m in determinants])
            error, count = ("largest", "iterations") if len(self.solved) > 1 else ("error", "iteration")
            summary = f"{margin}, sqrt({error}), {count}, {self._moved()} if {count} else 0.0"
        body, rows = writer.formulas([node for _, node in self.plan.watches])
        summary += f", {extreme('max', [f'abs({row})' for row in rows])}"
        return stage("position", [*lines, *body], f"{z}, {tupled(determinants)}, {summary}, {values}")

    def _predicted(self) -> list[str]:
        """Return statements of the predicted unknowns, by their names."""
        lines = []
        for letter, source in (("z", "z"), ("d", "zd"), ("a", "zdd")):
            lines += unpacking([f"{letter}{k}" for k in range(len(self.unknowns))], source)
        for k, name in enumerate(self.unknowns):
            lines.append(f"{identifier(name)} = p{k} = z{k} + s * (d{k} + half * a{k})")
        return lines

    def _moved(self) -> str:
        """Return the largest correction of a prediction, in radians and sizes."""
        moves = []
        for k, name in enumerate(self.unknowns):
            move = f"abs({identifier(name)} - p{k})"
            moves.append(move if name.is_angle else f"{move} / {self.plan.size!r}")
        return extreme("max", moves)

    def _solved(self, writer: Writer, k: int, block: Block) -> list[str]:
        """Return the statements of a block that needs Newton."""
        starts = [f"z{place}" for place in range(*self.places[k])]
        lines = [f"# block {k + 1}: {', '.join(block.unknowns)} from {', '.join(block.row_names)}"]
        lines += newton_lines(writer, block, str(k + 1), starts, f"held & {1 << k}", str(k))
        if len(self.solved) > 1:
            lines += ["iterations += iteration", "largest = max(largest, error)"]
        return lines

    def _velocity(self) -> list[str]:
        lines, zd = self._linear(1, lambda block: block.velocity)
        return stage("velocity", [_VALUES, *self._driven(1), *lines], zd)

    def _acceleration(self) -> list[str]:
        rates = unpacking([identifier(name.derivative(1)) for name in self.unknowns], "zd")
        lines, zdd = self._linear(2, lambda block: block.acceleration)
        return stage("acceleration", [_VALUES, *self._driven(2), *rates, *lines], zdd)

    def _driven(self, order: int) -> list[str]:
        """Return statements that name the speeds of the drivers, and their accelerations (order 2)."""
        return [line for k in range(1, order + 1) for line in unpacking(map(identifier, self.inputs[k]), "u" + "d" * k)]

    def _tangent(self) -> list[list[str]]:
        """Return two functions for one driver: `tangent`, which every pose needs, and `first_motion`."""
        writer = Writer(self.names, self.known)
        unit_speed = UnitSpeed(self.inputs[1][0], self.inputs[2][0], self.formulas)
        definitions = Definitions(unit_speed.formulas)
        lines, done = [], set[str]()
        for order, right in ((1, unit_speed.velocity), (2, unit_speed.acceleration)):
            lines += self._linear_lines(writer, order, right, definitions, done)
        self._import(writer)
        both = ", ".join(tupled(identifier(name.derivative(order)) for name in self.unknowns) for order in (1, 2))
        motion, row = self._motions((0, 1, 2), self._outputs())
        return [
            stage("tangent", [_VALUES, *lines], both),
            stage("first_motion", [_VALUES, *lines, f"first, second = {both}", *motion], f"(first, second), {row}"),
        ]

    def _linear(self, order: int, right: _Right) -> tuple[list[str], str]:
        """Return the linear solves of one order, and what they solve for."""
        writer = Writer(self.names, self.known)
        lines = self._linear_lines(writer, order, right, self.definitions, set(), held=True)
        self._import(writer)
        return lines, tupled(identifier(name.derivative(order)) for name in self.unknowns)

    def _linear_lines(
        self,
        writer: Writer,
        order: int,
        right: _Right,
        definitions: Definitions,
        done: set[str],
        *,
        held: bool = False,
    ) -> list[str]:
        """Return the linear solves of one order, block after block, with the definitions that they need."""
        lines = []
        for k, block in enumerate(self.solved):
            z = [identifier(name.derivative(order)) for name in block.unknowns]
            vector = right(block)
            lines += definitions.lines(writer, _names(vector), done)
            b, new = right_side(writer, "b", vector, block.entries)
            lines += new
            jacobian = jacobian_text(writer, block)
            self.exports.setdefault(kept_name(block, str(k + 1)), None)
            solution = solution_lines(str(k + 1), order, jacobian, b, z)
            if held:
                first, last = self.places[k]
                lines.append(f"if held & {1 << k}:")
                lines.append(f"    {tupled(z)} = given[{first}:{last}]")
                lines += ["else:", *indented(solution)]
            else:
                lines += solution
        return lines

    def _outputs(self) -> _Motions:
        """Return positions, rates and accelerations of all outputs."""
        return [[motion[1:][order] for motion in self.plan.outputs_motion] for order in range(3)]

    def _laws(self) -> list[list[str]]:
        """Return the functions of what steps of a path monitor of laws."""
        motions = self.plan.path_laws.motions
        return [self._stage("law_motion", (0, 1, 2), motions), self._stage("law_positions", (0,), motions)]

    def _stage(self, name: str, orders: Sequence[int], motions: _Motions) -> list[str]:
        """Return a function that returns motions at some orders of derivative, one after another."""
        lines, row = self._motions(orders, motions)
        return stage(name, [_VALUES, *lines], row)

    def _motions(self, orders: Sequence[int], motions: _Motions) -> tuple[list[str], str]:
        """Return the statements of such a function, and what it returns."""
        targets = [node for order in orders for node in motions[order]]
        highest = max(orders)
        writer = Writer(self.names, self.known)
        body = self.definitions.lines(writer, _names(targets), set())
        statements, row = writer.formulas(targets)
        self._import(writer)
        chained = self._chained(highest) if highest else []
        return [*self._driven(highest), *chained, *body, *statements], tupled(row)

    def _chained(self, order: int) -> list[str]:
        """Return statements of the rates (and accelerations, order 2) of the unknowns from `first` (and `second`).

        With one driver by the chain rule: zd = z' ud, zdd = z'' ud^2 + z' udd.
        """
        rates, accelerations = ([identifier(unknown.derivative(k)) for unknown in self.unknowns] for k in (1, 2))
        if len(self.plan.drivers) != 1:
            lines = unpacking(rates, "first")
            return lines if order == 1 else lines + unpacking(accelerations, "second")
        speed, more = identifier(self.inputs[1][0]), identifier(self.inputs[2][0])
        lines = unpacking([f"d{k}" for k in range(len(rates))], "first")
        lines += [f"{rate} = d{k} * {speed}" for k, rate in enumerate(rates)]
        if order == 2:
            lines += unpacking([f"a{k}" for k in range(len(rates))], "second")
            lines += [f"{name} = a{k} * {speed} * {speed} + d{k} * {more}" for k, name in enumerate(accelerations)]
        return lines

    def _watches(self) -> list[str]:
        writer = Writer(self.names, self.known)
        body, rows = writer.formulas([node for _, node in self.plan.watches])
        self._import(writer)
        return stage("watches", [_VALUES, *body], tupled(rows))

    def _jacobians(self) -> list[str]:
        writer = Writer(self.names, self.known)
        matrices = []
        body: list[str] = []
        for block in self.solved:
            body += writer.statements(block.entries)
            matrices.append(matrix(jacobian_text(writer, block)))
        self._import(writer)
        return stage("jacobians", [_VALUES, *body], tupled(matrices))

    def _residuals(self) -> list[str]:
        """Return the function of the residuals, which poses are rarely asked for: they are computed once more.

        They are computed from what the other stages read, so that no pose keeps numbers for them alone.
        """
        read = [node for node in self.exports.values() if node is not None]
        writer = Writer(self.names, [*read, *self.prolog])
        rows, body = [], []
        for block in self.solved:
            lines, row = scaled_residuals(writer, block)
            body += lines
            rows.append(row)
        self._import(writer)
        return stage("residuals", [_VALUES, *body], tupled(rows))

    def _import(self, writer: Writer) -> None:
        """Record what a later stage reads from the position stage."""
        coordinates = {*(name for block in self.plan.blocks for name in block.coordinates), *self.inputs[0]}
        for node in writer.used:
            if node in self.parametric:
                continue
            if node.op != "symbol":
                self.exports.setdefault(self.names.of(node), node)
            elif node.name in coordinates:
                self.exports.setdefault(identifier(node.name), None)


def _names(targets: Sequence[Node]) -> list[str]:
    """Return the names of the symbols that the targets are made of."""
    return [symbol.name for symbol in symbols(targets)]


_OPERATIONS: dict[str, Callable[..., Node]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "neg": operator.neg,
}


class UnitSpeed:
    """Right sides and formulas of a plan whose only driver has speed 1 and acceleration 0.

    formulas: rates and accelerations of assigned coordinates by name, in the order of evaluation.
    """

    def __init__(self, speed: str, acceleration: str, formulas: Mapping[str, Node]) -> None:
        self._given = {speed: 1.0, acceleration: 0.0}
        self.formulas: dict[str, Node] = {}
        for name, node in formulas.items():
            (folded,) = self._folded([node])
            self.formulas[name] = folded
            if folded.constant is not None:
                self._given[name] = folded.constant

    def velocity(self, block: Block) -> tuple[Node, ...]:
        """Return the block's right side for velocities, folded."""
        return tuple(self._folded(block.velocity))

    def acceleration(self, block: Block) -> tuple[Node, ...]:
        """Return the block's right side for accelerations, folded."""
        return tuple(self._folded(block.acceleration))

    def _folded(self, targets: Sequence[Node]) -> list[Node]:
        """Return the targets with numbers in place of the given symbols, simplified by the graph."""
        new: dict[Node, Node] = {}
        for node in reachable(targets):
            if node.op == "symbol" and node.name in self._given:
                new[node] = node.graph.constant(self._given[node.name])
            elif node.op in _OPERATIONS:
                new[node] = _OPERATIONS[node.op](*(new[arg] for arg in node.args))
            elif node.args:
                new[node] = node.graph.function(node.op, *(new[arg] for arg in node.args), value=node.value)
            else:
                new[node] = node
        return [new[target] for target in targets]


class Definitions:
    """Formulas by the names that they define, in the order of evaluation."""

    def __init__(self, formulas: Mapping[str, Node]) -> None:
        self._formulas = formulas
        self._order = {name: k for k, name in enumerate(formulas)}

    def lines(self, writer: Writer, wanted: Iterable[str], done: set[str]) -> list[str]:
        """Return statements for the names that the wanted ones are made of, without those in `done`.

        done: names already written; the new ones are added.
        """
        needed: set[str] = set()
        stack = [name for name in wanted if name in self._formulas]
        while stack:
            name = stack.pop()
            if name not in needed and name not in done:
                needed.add(name)
                stack += [symbol.name for symbol in symbols([self._formulas[name]]) if symbol.name in self._formulas]
        done |= needed
        lines = []
        for name in sorted(needed, key=self._order.__getitem__):
            lines += writer.statements([self._formulas[name]])
            lines.append(f"{identifier(name)} = {writer.expression(self._formulas[name])}")
        return lines
