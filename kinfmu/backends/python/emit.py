"""SolvePlan -> Python source: one module of plain arithmetic on the standard library, the `model` of a Solver.

The module holds constants and these functions, each a stage; nothing is computed before somebody asks for its stage.
With parameters the functions stand inside `bound(parameters)`, which computes once what depends on parameters alone:

    drive(t, constants)                            -> u, ud, udd
    position(u, z, zd, zdd, s, held)               -> z, determinants, margin, residual, iterations, moved, watch,
                                                      values
    tangent(values)                                -> z' and z'' (one driver only)
    first_motion(values, ud, udd)                  -> tangent and motion in one go (one driver only)
    velocity(values, ud, given, held)              -> zd
    acceleration(values, ud, udd, zd, given, held) -> zdd
    outputs(values)                                -> positions of the outputs
    rates(values, ud, first)                       -> their rates
    accelerations(values, ud, udd, first, second)  -> their accelerations
    motion(values, ud, udd, first, second)         -> the three in one row, with what they share computed once
    watches(values)                                -> rows set aside, relative to the size
    jacobians(values)                              -> one matrix a block

z are the unknowns of all blocks. position predicts z + s zd + s^2 zdd / 2 and corrects by Newton; margin is the
smallest |determinant|, residual the largest length of a block's residuals, moved the largest correction, watch the
largest residual of the rows set aside. `held` is a bit a block: set, its z is taken as given instead of solved for.
first and second are zd and zdd; with one driver they are the derivatives of z with respect to u, and the chain rule is
part of the code.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from kinfmu.backends.python.alike import Calls, grouped
from kinfmu.backends.python.alone import Alone
from kinfmu.backends.python.binding import bound, parametric
from kinfmu.backends.python.block_code import (
    assigned_lines,
    indented,
    kept_name,
    matrix,
    newton_lines,
    solution_lines,
    tupled,
    unpacking,
)
from kinfmu.backends.python.definitions import Definitions, formula
from kinfmu.backends.python.header import header, places
from kinfmu.backends.python.writer import Names, Writer, identifier
from kinfmu.equations.graph import Node, reachable, symbols
from kinfmu.naming import derivative_name
from kinfmu.plan import Block, SolvePlan

MANY = 64  # unknowns; beyond, a name for each of their parts would make functions of tens of thousands of names


def emit(plan: SolvePlan) -> str:
    """Source text of the model module; equal plans give equal text."""
    return _Emitter(plan).module()


class _Emitter:
    def __init__(self, plan: SolvePlan) -> None:
        self.plan = plan
        self.solved = [block for block in plan.blocks if block.unknowns]
        curves = dict.fromkeys(node.curve[0] for node in plan.nodes if node.op == "curve")
        self.curves = {data: f"CURVE_{k}" for k, data in enumerate(curves, start=1)}
        self.unknowns = plan.unknowns
        self.many = len(self.unknowns) > MANY
        self.places = places(self.solved)
        self.rates = {driver.inputs[0]: driver.inputs for driver in plan.drivers}
        members = grouped(self.solved, self._rate_of)
        self.calls = {k: Calls(k, self.solved[k], member, self._rate_of) for k, member in members.items()}
        self.names = Names((name for block in plan.blocks for name in block.coordinates), self.curves)
        self.position_nodes: list[Node] = []
        self.formulas: dict[str, Node] = {}  # of rates and accelerations of assigned coordinates
        number = {id(block): k for k, block in enumerate(self.solved)}
        self.order = [(number.get(id(block)), block) for block in plan.blocks]  # all blocks, the solved with numbers
        for k, block in self.order:
            if k not in self.calls:
                for name, motion in block.assigned:
                    self.names.assign(motion[0], name)
                    self.formulas |= {self._rate_of(name, order): motion[order] for order in (1, 2)}
                self.position_nodes += [motion[0] for _, motion in block.assigned]
                self.position_nodes += [*block.residuals, *(entry for row in block.jacobian for entry in row)]
        self.parametric, self.prolog = parametric(plan)
        known = [node for node in reachable(self.position_nodes) if node not in self.parametric]
        self.known = {*known, *self.prolog}  # what later stages find computed
        self.definitions = self._defined_by(self.formulas, identifier)
        self.inputs = [[driver.inputs[order] for driver in plan.drivers] for order in range(3)]
        self.exports: dict[str, Node | None] = {}  # names that later stages take from `values`

    def _rate_of(self, name: str, order: int) -> str:
        """Name of a derivative of a coordinate or of a driver's value."""
        return self.rates[name][order] if name in self.rates else derivative_name(name, order)

    def _defined_by(self, formulas: Mapping[str, Node], spoken: Callable[[str], str]) -> Definitions:
        """Rates and accelerations of assigned coordinates in the order of evaluation."""
        ordered = []
        for k, block in self.order:
            if not block.assigned:
                continue
            if k in self.calls:
                ordered += [self.calls[k].definition(order, spoken) for order in (1, 2)]
            else:
                names = [self._rate_of(name, order) for name, _ in block.assigned for order in (1, 2)]
                ordered += [formula(name, formulas[name]) for name in names]
        return Definitions(ordered)

    def module(self) -> str:
        """Constants and functions; with parameters the functions stand in `bound`, which binds their values."""
        later = [
            self._velocity(),
            self._acceleration(),
            *(self._alone() if len(self.plan.drivers) == 1 else ()),
            self._stage("outputs", "Positions of the outputs.", (0,)),
            self._stage("rates", "Rates of the outputs.", (1,)),
            self._stage("accelerations", "Accelerations of the outputs.", (2,)),
            self._stage("motion", "Positions, rates and accelerations of the outputs in one row.", (0, 1, 2)),
            self._watches(),
            self._jacobians(),
            *([self._residuals()] if self.plan.parameters else []),
        ]
        position = self._position()  # after the later stages, which say what it has to hand on
        kinds = {call.member.kind.label: call.member.kind for call in self.calls.values()}
        shared = [line for kind in kinds.values() for line in kind.source(self.curves, bool(self.plan.parameters))]
        unpacked = "\n".join(unpacking(self.exports, "values")) or "    # nothing is handed on"
        functions = [*self._drive(), *shared, *position]
        for lines in later:
            functions += [unpacked if line is _VALUES else line for line in lines]
        if self.plan.parameters:
            functions = bound(self.plan, self.names, self.prolog, functions)
        return "\n".join([*header(self.plan, self.curves, many=self.many), *functions]) + "\n"

    def _drive(self) -> list[str]:
        writer = Writer(Names(curves=self.curves), ())
        orders = [[getattr(law, order) for law in self.plan.laws] for order in ("position", "rate", "acceleration")]
        flat = [node for nodes in orders for node in nodes]
        body = writer.statements(flat)
        constants = [identifier(constant.name) for constant in self.plan.law_constants]
        returned = ", ".join(tupled(writer.expression(node) for node in nodes) for nodes in orders)
        return [
            "",
            "def drive(time, constants):",
            '    """Driver values, speeds and accelerations at a time, by the laws."""',
            *unpacking(constants, "constants"),
            *indented(body),
            f"    return {returned}",
            "",
        ]

    def _position(self) -> list[str]:
        keep = [node for node in self.exports.values() if node is not None]
        writer = Writer(self.names, self.prolog, keep)
        lines = [
            "",
            "def position(u, z, zd, zdd, s, held=0):",
            '    """Unknowns by Newton from a prediction, block by block; or ArithmeticError(block, residual)."""',
            *unpacking(map(identifier, self.inputs[0]), "u"),
        ]
        if self.solved:
            lines += ["    half = 0.5 * s"]
            if len(self.solved) > 1:
                lines += ["    largest, iterations = 0.0, 0"]
            lines += self._predicted()
        for number, block in self.order:
            lines += indented(assigned_lines(writer, block) if number is None else self._solved(writer, number, block))
        z = tupled(identifier(name) for name in self.unknowns)
        values = tupled(self.exports)
        margin, determinants = "1.0", "()"
        if self.many:
            raw = tupled(f"det{k}" for k in range(1, len(self.solved) + 1))
            lines.append(f"    determinants = tuple([a * b for a, b in zip({raw}, DETERMINANT_FACTORS)])")
            lines.append(f"    found = {z}")
            margin, determinants, z = "min(map(abs, determinants))", "determinants", "found"
        elif self.solved:
            lines += [
                f"    m{k} = det{k} * {1.0 / block.determinant_scale!r}" for k, block in enumerate(self.solved, start=1)
            ]
            determinants = tupled(f"m{k}" for k in range(1, len(self.solved) + 1))
            sizes = [f"abs(m{k})" for k in range(1, len(self.solved) + 1)]
            margin = f"min({', '.join(sizes)})" if len(sizes) > 1 else sizes[0]
        summary = "1.0, 0.0, 0, 0.0"
        if self.solved:
            error, count = ("largest", "iterations") if len(self.solved) > 1 else ("error", "iteration")
            summary = f"{margin}, sqrt({error}), {count}, {self._moved()} if {count} else 0.0"
        rows = [node for _, node in self.plan.watches]
        lines += indented(writer.statements(rows))
        watched = [f"abs({writer.expression(node)})" for node in rows]
        summary += ", " + (f"max({', '.join(watched)})" if len(watched) > 1 else "".join(watched) or "0.0")
        return [*lines, f"    return {z}, {determinants}, {summary}, {values}", ""]

    def _predicted(self) -> list[str]:
        """Unknowns as predicted, by their names; of many unknowns in one go, so that the function stays small."""
        if self.many:
            names = tupled(identifier(name) for name in self.unknowns)
            return [
                "    predicted = [a + s * (b + half * c) for a, b, c in zip(z, zd, zdd)]",
                f"    {names} = predicted",
            ]
        lines = []
        for letter, source in (("z", "z"), ("d", "zd"), ("a", "zdd")):
            lines += unpacking([f"{letter}{k}" for k in range(len(self.unknowns))], source)
        for k, name in enumerate(self.unknowns):
            lines.append(f"    {identifier(name)} = p{k} = z{k} + s * (d{k} + half * a{k})")
        return lines

    def _moved(self) -> str:
        """The largest correction of a prediction, in radians and sizes."""
        if self.many:
            return "max([abs(a - b) / c for a, b, c in zip(found, predicted, UNKNOWN_SCALES)])"
        moves = []
        for k, name in enumerate(self.unknowns):
            move = f"abs({identifier(name)} - p{k})"
            moves.append(move if name.endswith(".phi") else f"{move} / {self.plan.size!r}")
        return f"max({', '.join(moves)})" if len(moves) > 1 else moves[0]

    def _solved(self, writer: Writer, k: int, block: Block) -> list[str]:
        """Statements of a block that needs Newton: its own, or a call of what alike blocks share."""
        starts = [f"z[{place}]" if self.many else f"z{place}" for place in range(*self.places[k])]
        if k in self.calls:
            lines = [self.calls[k].position(self.places[k][0])]
        else:
            held = f"held & {1 << k}"
            lines = [f"# block {k + 1}: {', '.join(block.unknowns)} from {', '.join(block.row_names)}"]
            lines += newton_lines(writer, block, str(k + 1), starts, held, str(k))
        if len(self.solved) > 1:
            lines += ["iterations += iteration", "if error > largest:", "    largest = error"]
        return lines

    def _velocity(self) -> list[str]:
        lines = [
            "",
            "def velocity(values, ud, given=(), held=0):",
            '    """Rates of the unknowns: J zd = -rate of the rows with z at rest."""',
        ]
        lines += [_VALUES, *unpacking(map(identifier, self.inputs[1]), "ud")]
        return lines + self._linear(1, lambda block: block.velocity)

    def _acceleration(self) -> list[str]:
        lines = [
            "",
            "def acceleration(values, ud, udd, zd, given=(), held=0):",
            '    """Accelerations of the unknowns: J zdd = -second rate of the rows with zdd = 0."""',
        ]
        lines += [
            _VALUES,
            *unpacking(map(identifier, self.inputs[1]), "ud"),
            *unpacking(map(identifier, self.inputs[2]), "udd"),
        ]
        lines += unpacking([identifier(derivative_name(name, 1)) for name in self.unknowns], "zd")
        return lines + self._linear(2, lambda block: block.acceleration)

    def _alone(self) -> list[list[str]]:
        """With one driver: derivatives with respect to it, which are needed at every pose, and motion with them."""
        writer = Writer(self.names, self.known)
        alone = Alone(self.inputs[1][0], self.inputs[2][0], self.formulas)
        definitions = self._defined_by(alone.formulas, alone.spoken)
        lines, done = [], set[int]()
        for order, right in ((1, alone.velocity), (2, alone.acceleration)):
            lines += indented(self._linear_lines(writer, order, right, definitions, done, alone.spoken))
        self._import(writer)
        first, second = (tupled(identifier(derivative_name(name, order)) for name in self.unknowns) for order in (1, 2))
        told = "First and second derivative of the unknowns with respect to the driver."
        tangent = [
            "",
            "def tangent(values):",
            f'    """{told}"""',
            _VALUES,
            *lines,
            f"    return {first}, {second}",
            "",
        ]
        if self.many:  # a function twice as large would cost more than the calls
            first_read = [
                "",
                "def first_motion(values, ud, udd):",
                '    """Tangent and motion, for the first reading of a pose."""',
                "    first, second = tangent(values)",
                "    return (first, second), motion(values, ud, udd, first, second)",
                "",
            ]
            return [tangent, first_read]
        motion = self._stage("motion", "", (0, 1, 2))
        head, row = motion.index(_VALUES) + 1, motion[-2].removeprefix("    return ")
        first_read = [
            "",
            "def first_motion(values, ud, udd):",
            '    """Tangent and motion in one go, for the first reading of a pose."""',
            _VALUES,
            *lines,
            f"    first, second = {first}, {second}",
            *motion[head:-2],
            f"    return (first, second), {row}",
            "",
        ]
        return [tangent, first_read]

    def _linear(self, order: int, right: _Right) -> list[str]:
        """Linear solves of one order as a function's body."""
        writer = Writer(self.names, self.known)
        lines = self._linear_lines(writer, order, right, self.definitions, set(), identifier, held=True)
        self._import(writer)
        result = tupled(identifier(derivative_name(name, order)) for name in self.unknowns)
        return [*indented(lines), f"    return {result}", ""]

    def _linear_lines(
        self,
        writer: Writer,
        order: int,
        right: _Right,
        definitions: Definitions,
        done: set[int],
        spoken: Callable[[str], str],
        *,
        held: bool = False,
    ) -> list[str]:
        """Linear solves of one order, block after block, with the definitions that they need on the way."""
        lines = []
        for k, block in enumerate(self.solved):
            z = [identifier(derivative_name(name, order)) for name in block.unknowns]
            if k in self.calls:
                call = self.calls[k]
                lines += definitions.lines(writer, call.needs(order), done)
                self.exports.setdefault(call.hold, None)
                solution = [call.linear(order, spoken)]
            else:
                vector, entries = right(block), [entry for row in block.jacobian for entry in row]
                lines += definitions.lines(writer, _names(vector), done)
                lines += writer.statements([*vector, *entries])
                b = [f"b{i}" for i in range(len(vector))]
                lines += [f"{name} = {writer.expression(node)}" for name, node in zip(b, vector, strict=True)]
                jacobian = [[writer.expression(entry) for entry in row] for row in block.jacobian]
                self.exports.setdefault(kept_name(block, str(k + 1)), None)
                solution = solution_lines(str(k + 1), jacobian, b, z)
            if held:
                first, last = self.places[k]
                lines.append(f"if held & {1 << k}:")
                lines.append(f"    {tupled(z)} = given[{first}:{last}]")
                lines += ["else:", *indented(solution)]
            else:
                lines += solution
        return lines

    def _stage(self, name: str, docstring: str, orders: Sequence[int]) -> list[str]:
        """A function that returns all outputs at some orders of derivative, one after another."""
        targets: list[Node] = [motion[1:][order] for order in orders for motion in self.plan.outputs_motion]
        highest = max(orders)
        arguments = [["values"], ["values", "ud", "first"], ["values", "ud", "udd", "first", "second"]][highest]
        lines = ["", f"def {name}({', '.join(arguments)}):", f'    """{docstring}"""', _VALUES]
        for argument, names in (("ud", self.inputs[1]), ("udd", self.inputs[2])):
            if argument in arguments:
                lines += unpacking(map(identifier, names), argument)
        if highest:
            lines += self._chained(highest)
        writer = Writer(self.names, self.known)
        body = self.definitions.lines(writer, _names(targets), set()) + writer.statements(targets)
        returned = tupled(writer.expression(node) for node in targets)
        self._import(writer)
        return [*lines, *indented(body), f"    return {returned}", ""]

    def _chained(self, order: int) -> list[str]:
        """Rates (and accelerations, of order 2) of the unknowns from `first` (and `second`).

        With one driver by the chain rule: zd = z' ud, zdd = z'' ud^2 + z' udd.
        """
        rates, accelerations = ([identifier(derivative_name(unknown, k)) for unknown in self.unknowns] for k in (1, 2))
        if len(self.plan.drivers) != 1:
            lines = unpacking(rates, "first")
            return lines if order == 1 else lines + unpacking(accelerations, "second")
        speed, more = identifier(self.inputs[1][0]), identifier(self.inputs[2][0])
        if self.many:
            lines = unpacking(rates, f"[d * {speed} for d in first]")
            given = f"[a * {speed} * {speed} + d * {more} for a, d in zip(second, first)]"
            return lines if order == 1 else lines + unpacking(accelerations, given)
        lines = unpacking([f"d{k}" for k in range(len(rates))], "first")
        lines += [f"    {rate} = d{k} * {speed}" for k, rate in enumerate(rates)]
        if order == 2:
            lines += unpacking([f"a{k}" for k in range(len(rates))], "second")
            lines += [f"    {name} = a{k} * {speed} * {speed} + d{k} * {more}" for k, name in enumerate(accelerations)]
        return lines

    def _watches(self) -> list[str]:
        writer = Writer(self.names, self.known)
        targets = [node for _, node in self.plan.watches]
        body = writer.statements(targets)
        returned = tupled(writer.expression(node) for node in targets)
        self._import(writer)
        return [
            "",
            "def watches(values):",
            '    """Rows set aside as redundant, relative to the size: zero as long as they hold."""',
            _VALUES,
            *indented(body),
            f"    return {returned}",
            "",
        ]

    def _jacobians(self) -> list[str]:
        writer = Writer(self.names, self.known)
        matrices = []
        body: list[str] = []
        for k, block in enumerate(self.solved):
            if k in self.calls:
                self.exports.setdefault(self.calls[k].hold, None)
                matrices.append(self.calls[k].jacobian())
            else:
                body += writer.statements([entry for row in block.jacobian for entry in row])
                matrices.append(matrix([[writer.expression(entry) for entry in row] for row in block.jacobian]))
        self._import(writer)
        return [
            "",
            "def jacobians(values):",
            '    """Jacobian of each block."""',
            _VALUES,
            *indented(body),
            f"    return {tupled(matrices)}",
            "",
        ]

    def _residuals(self) -> list[str]:
        writer = Writer(self.names, self.known)
        rows, body = [], []
        for k, block in enumerate(self.solved):
            if k in self.calls:
                rows.append(self.calls[k].residual())
            else:
                body += writer.statements(block.residuals)
                scaled = zip(block.residuals, block.row_scales, strict=True)
                rows.append("[" + ", ".join(f"({writer.expression(r)}) / {scale!r}" for r, scale in scaled) + "]")
        self._import(writer)
        return [
            "",
            "def residuals(values):",
            '    """Residuals of each block, relative to the size."""',
            _VALUES,
            *indented(body),
            f"    return {tupled(rows)}",
            "",
        ]

    def _import(self, writer: Writer) -> None:
        """Note what a later stage takes from the position stage."""
        coordinates = {name for block in self.plan.blocks for name in block.coordinates} | set(self.inputs[0])
        for node in writer.used:
            if node in self.parametric:
                continue
            if node.op != "symbol":
                self.exports.setdefault(self.names.of(node), node)
            elif node.name in coordinates:
                self.exports.setdefault(identifier(node.name), None)


_VALUES = "    <values>"
_Right = Callable[[Block], tuple[Node, ...]]


def _names(targets: Sequence[Node]) -> list[str]:
    """Names of the symbols that the targets are made of."""
    return [symbol.name for symbol in symbols(targets)]


__all__ = ["emit"]
