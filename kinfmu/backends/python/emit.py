"""SolvePlan -> Python source: one module of plain arithmetic on the standard library, the `model` of a Solver.

The module holds constants and these functions, each a stage; nothing is computed before somebody asks for its stage:

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

from collections.abc import Callable, Iterable, Mapping, Sequence

from kinfmu.backends.python.alone import Alone
from kinfmu.backends.python.writer import Names, Writer, identifier
from kinfmu.equations.graph import Node, reachable, symbols
from kinfmu.naming import derivative_name
from kinfmu.plan import Block, SolvePlan

ROUND_OFF = 4e-16  # residual relative to the size below which Newton has nothing left to gain
SETTLED = 1e-13  # residual from which Newton may stop when it no longer falls fourfold
ITERATIONS = 12


def emit(plan: SolvePlan) -> str:
    """Source text of the model module; equal plans give equal text."""
    return _Emitter(plan).module()


class _Emitter:
    def __init__(self, plan: SolvePlan) -> None:
        self.plan = plan
        self.solved = [block for block in plan.blocks if block.unknowns]
        self.number = {id(block): k for k, block in enumerate(self.solved)}
        curves = dict.fromkeys(node.curve[0] for node in plan.nodes if node.op == "curve")
        self.curves = {data: f"CURVE_{k}" for k, data in enumerate(curves, start=1)}
        self.names = Names((name for block in plan.blocks for name in block.coordinates), self.curves)
        self.position_nodes: list[Node] = []
        for block in plan.blocks:
            for name, motion in block.assigned:
                self.names.assign(motion[0], name)
            self.position_nodes += [motion[0] for _, motion in block.assigned]
            self.position_nodes += [*block.residuals, *(entry for row in block.jacobian for entry in row)]
        self.definitions = {
            derivative_name(name, order): motion[order]
            for block in plan.blocks
            for name, motion in block.assigned
            for order in (1, 2)
        }  # rates and accelerations of assigned coordinates by name, in the order of evaluation
        self.inputs = [[driver.inputs[order] for driver in plan.drivers] for order in range(3)]
        self.exports: dict[str, Node | None] = {}  # names that later stages take from `values`

    def module(self) -> str:
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
        ]
        position = self._position()  # after the later stages, which say what it has to hand on
        parts = [*self._header(), *self._drive(), *position]
        for lines in later:
            parts += [line.replace(_VALUES, self._unpacked()) for line in lines]
        return "\n".join(parts) + "\n"

    def _header(self) -> list[str]:
        plan = self.plan
        anchor_u, anchor_z = plan.anchor_values
        starts = []
        count = 0
        for block in self.solved:
            starts.append((count, count + len(block.unknowns)))
            count += len(block.unknowns)
        large = [
            block for block in self.solved if len(block.unknowns) > 2 or len(block.residuals) > len(block.unknowns)
        ]
        rare = {node.op for node in plan.nodes} & {"atan2", "floor"}
        imports = [f"from math import {', '.join(sorted({'cos', 'inf', 'sin', 'sqrt', *rare}))}"]
        if self.curves:
            imports += ["", "from .curve import curve"]
        if large:
            imports += ["", "from .linear import factor, lu_solve, qr_factor, qr_solve"]
        kinds = tuple(driver.quantity.kind for driver in plan.drivers)
        reach = tuple(1.0 if kind == "angle" else plan.size for kind in kinds)
        return [
            f'"""Kinematics of {plan.mechanism.name}: generated from its mechanism, not to be edited."""',
            "",
            *imports,
            "",
            f"NAME = {plan.mechanism.name!r}",
            f"SIZE = {plan.size!r}",
            f"OFFSET = {max(map(abs, plan.origin)) / plan.size!r}  # from the world's origin, in sizes",
            f"LENGTH_UNIT = {plan.mechanism.length_unit!r}",
            f"DRIVERS = {tuple(driver.name for driver in plan.drivers)!r}",
            f"DRIVER_KINDS = {kinds!r}",
            f"REACH = {reach!r}  # what counts as a step of one, by driver",
            f"OUTPUTS = {plan.outputs!r}",
            f"COORDINATE_COUNT = {plan.coordinate_count!r}",
            f"FIXED = {dict(plan.fixed)!r}",
            f"LAW_CONSTANTS = {tuple((constant.name, constant.value) for constant in plan.law_constants)!r}",
            f"WATCHES = {plan.watch_names!r}",
            f"UNKNOWNS = {plan.unknowns!r}",
            f"UNKNOWN_SCALES = {tuple(1.0 if n.endswith('.phi') else plan.size for n in plan.unknowns)!r}",
            f"BLOCKS = {tuple(starts)!r}",
            f"ANCHOR = {(anchor_u, anchor_z)!r}",
            *(f"{name} = {data!r}" for data, name in self.curves.items()),
            "",
        ]

    def _drive(self) -> list[str]:
        writer = Writer(Names(curves=self.curves), ())
        orders = [[getattr(law, order) for law in self.plan.laws] for order in ("position", "rate", "acceleration")]
        flat = [node for nodes in orders for node in nodes]
        body = writer.statements(flat)
        constants = [identifier(constant.name) for constant in self.plan.law_constants]
        returned = ", ".join(_tuple(writer.expression(node) for node in nodes) for nodes in orders)
        return [
            "",
            "def drive(time, constants):",
            '    """Driver values, speeds and accelerations at a time, by the laws."""',
            *_unpack(constants, "constants"),
            *_indented(body),
            f"    return {returned}",
            "",
        ]

    def _position(self) -> list[str]:
        keep = [node for node in self.exports.values() if node is not None]
        writer = Writer(self.names, (), keep)
        lines = [
            "",
            "def position(u, z, zd, zdd, s, held=0):",
            '    """Unknowns by Newton from a prediction, block by block; or ArithmeticError(block, residual)."""',
            *_unpack(map(identifier, self.inputs[0]), "u"),
        ]
        if self.solved:
            lines += ["    half = 0.5 * s"]
            if len(self.solved) > 1:
                lines += ["    largest, iterations = 0.0, 0"]
            for letter, source in (("z", "z"), ("d", "zd"), ("a", "zdd")):
                lines += _unpack([f"{letter}{k}" for k in range(len(self.plan.unknowns))], source)
            for k, name in enumerate(self.plan.unknowns):
                lines.append(f"    {identifier(name)} = p{k} = z{k} + s * (d{k} + half * a{k})")
        for block in self.plan.blocks:
            lines += self._newton(writer, block) if block.unknowns else self._assigned(writer, block, "    ")
        z = _tuple(identifier(name) for name in self.plan.unknowns)
        values = _tuple(self.exports)
        margin = "1.0"
        if self.solved:
            lines += [
                f"    m{k} = det{k} * {1.0 / block.determinant_scale!r}" for k, block in enumerate(self.solved, start=1)
            ]
            sizes = [f"abs(m{k})" for k in range(1, len(self.solved) + 1)]
            margin = f"min({', '.join(sizes)})" if len(sizes) > 1 else sizes[0]
        determinants = _tuple(f"m{k}" for k in range(1, len(self.solved) + 1))
        summary = "1.0, 0.0, 0, 0.0"
        if self.solved:
            error, count = ("largest", "iterations") if len(self.solved) > 1 else ("error", "iteration")
            summary = f"{margin}, sqrt({error}), {count}, {self._moved()} if {count} else 0.0"
        rows = [node for _, node in self.plan.watches]
        lines += _indented(writer.statements(rows))
        watched = [f"abs({writer.expression(node)})" for node in rows]
        summary += ", " + (f"max({', '.join(watched)})" if len(watched) > 1 else "".join(watched) or "0.0")
        return [*lines, f"    return {z}, {determinants}, {summary}, {values}", ""]

    def _moved(self) -> str:
        """The largest correction of a prediction, in radians and sizes."""
        moves = []
        for k, name in enumerate(self.plan.unknowns):
            move = f"abs({identifier(name)} - p{k})"
            moves.append(move if name.endswith(".phi") else f"{move} / {self.plan.size!r}")
        return f"max({', '.join(moves)})" if len(moves) > 1 else moves[0]

    def _assigned(self, writer: Writer, block: Block, indent: str) -> list[str]:
        lines = []
        for (name, motion), row in zip(block.assigned, block.assigned_by, strict=True):
            new = writer.statements([motion[0]])
            given = writer.expression(motion[0])
            if given != identifier(name):
                new.append(f"{identifier(name)} = {given}")
            lines += [f"{indent}{line}" for line in new[:-1]]
            lines += [f"{indent}{line}  # {row}" for line in new[-1:]]
        return lines

    def _newton(self, writer: Writer, block: Block) -> list[str]:
        k = self.number[id(block)] + 1
        entries = [entry for row in block.jacobian for entry in row]
        unknowns = [node for node in symbols([*block.residuals, *entries]) if node.name in block.unknowns]
        looped = [*(motion[0] for _, motion in block.assigned), *block.residuals, *entries]
        before = writer.statements(writer.independent(looped, unknowns))
        inside = self._assigned(writer, block, "")
        inside += writer.statements([*block.residuals, *entries])
        r = [f"r{i}" for i in range(len(block.residuals))]
        inside += [f"{name} = {writer.expression(node)}" for name, node in zip(r, block.residuals, strict=True)]
        inside.append(f"error = {_square(r, block.row_scales)}")
        jacobian = [[writer.expression(entry) for entry in row] for row in block.jacobian]
        z = [identifier(name) for name in block.unknowns]
        inside += _determinant(k, jacobian)
        # large angles are rounded more; those of the start, for an iteration that runs away is not to be forgiven
        starts = [f"z{self.plan.unknowns.index(name)}" for name in block.unknowns]
        angles = " + ".join(["1.0", *(f"{start} * {start}" for start in starts)])
        settled = f"16.0 * error > last and error <= {SETTLED**2} * ({angles})"
        done = f"error <= {ROUND_OFF**2} or held & {1 << (k - 1)} or ({settled})"
        lines = [
            f"    # block {k}: {', '.join(block.unknowns)} from {', '.join(block.row_names)}",
            *_indented(before),
            "    last = inf",
            f"    for iteration in range({ITERATIONS}):",
            *_indented(inside, 8),
            f"        if {done}:",
            "            break",
            "        last = error",
            *_indented(_correction(k, jacobian, r, z), 8),
            "    else:",
            f"        raise ArithmeticError({k - 1}, sqrt(error))",
        ]
        if len(self.solved) > 1:
            lines += ["    iterations += iteration", "    if error > largest:", "        largest = error"]
        return lines

    def _velocity(self) -> list[str]:
        lines = [
            "",
            "def velocity(values, ud, given=(), held=0):",
            '    """Rates of the unknowns: J zd = -rate of the rows with z at rest."""',
        ]
        lines += [_VALUES, *_unpack(map(identifier, self.inputs[1]), "ud")]
        return lines + self._linear(1, lambda block: block.velocity)

    def _acceleration(self) -> list[str]:
        lines = [
            "",
            "def acceleration(values, ud, udd, zd, given=(), held=0):",
            '    """Accelerations of the unknowns: J zdd = -second rate of the rows with zdd = 0."""',
        ]
        lines += [
            _VALUES,
            *_unpack(map(identifier, self.inputs[1]), "ud"),
            *_unpack(map(identifier, self.inputs[2]), "udd"),
        ]
        lines += _unpack([identifier(derivative_name(name, 1)) for name in self.plan.unknowns], "zd")
        return lines + self._linear(2, lambda block: block.acceleration)

    def _alone(self) -> list[list[str]]:
        """With one driver: derivatives with respect to it, which are needed at every pose, and motion with them."""
        writer = Writer(self.names, reachable(self.position_nodes))
        alone = Alone(self.inputs[1][0], self.inputs[2][0], self.definitions)
        lines = []
        for order, right in ((1, alone.velocity), (2, alone.acceleration)):
            lines += _indented(self._linear_lines(writer, order, right, alone.definitions, held=False))
        self._import(writer)
        first, second = (
            _tuple(identifier(derivative_name(name, order)) for name in self.plan.unknowns) for order in (1, 2)
        )
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
        writer = Writer(self.names, reachable(self.position_nodes))
        lines = self._linear_lines(writer, order, right, self.definitions, held=True)
        self._import(writer)
        result = _tuple(identifier(derivative_name(name, order)) for name in self.plan.unknowns)
        return [*_indented(lines), f"    return {result}", ""]

    def _linear_lines(
        self, writer: Writer, order: int, right: _Right, definitions: Mapping[str, Node], *, held: bool
    ) -> list[str]:
        """Linear solves of one order, block after block, with the definitions that they need on the way."""
        lines, count = [], 0
        done: set[str] = set()
        for block in self.solved:
            lines += _defined(writer, right(block), definitions, done)
            k = self.number[id(block)] + 1
            entries = [entry for row in block.jacobian for entry in row]
            lines += writer.statements([*right(block), *entries])
            b = [f"b{i}" for i in range(len(right(block)))]
            lines += [f"{name} = {writer.expression(node)}" for name, node in zip(b, right(block), strict=True)]
            z = [identifier(derivative_name(name, order)) for name in block.unknowns]
            jacobian = [[writer.expression(entry) for entry in row] for row in block.jacobian]
            self.exports.setdefault(f"det{k}" if _is_small(block) else f"factors{k}", None)
            solution = _solution(k, jacobian, b, z)
            if held:
                lines.append(f"if held & {1 << (k - 1)}:")
                lines.append(f"    {_tuple(z)} = given[{count}:{count + len(z)}]")
                lines += ["else:", *_indented(solution, 4)]
            else:
                lines += solution
            count += len(z)
        return lines

    def _stage(self, name: str, docstring: str, orders: Sequence[int]) -> list[str]:
        """A function that returns all outputs at some orders of derivative, one after another."""
        targets: list[Node] = [motion[1:][order] for order in orders for motion in self.plan.outputs_motion]
        highest = max(orders)
        arguments = [["values"], ["values", "ud", "first"], ["values", "ud", "udd", "first", "second"]][highest]
        lines = ["", f"def {name}({', '.join(arguments)}):", f'    """{docstring}"""', _VALUES]
        for argument, names in (("ud", self.inputs[1]), ("udd", self.inputs[2])):
            if argument in arguments:
                lines += _unpack(map(identifier, names), argument)
        if highest:
            lines += self._chained(highest)
        writer = Writer(self.names, reachable(self.position_nodes))
        body = _defined(writer, targets, self.definitions, set()) + writer.statements(targets)
        returned = _tuple(writer.expression(node) for node in targets)
        self._import(writer)
        return [*lines, *_indented(body), f"    return {returned}", ""]

    def _chained(self, order: int) -> list[str]:
        """Rates (and accelerations, of order 2) of the unknowns from `first` (and `second`).

        With one driver by the chain rule: zd = z' ud, zdd = z'' ud^2 + z' udd.
        """
        rates, accelerations = (
            [identifier(derivative_name(unknown, k)) for unknown in self.plan.unknowns] for k in (1, 2)
        )
        if len(self.plan.drivers) != 1:
            lines = _unpack(rates, "first")
            return lines if order == 1 else lines + _unpack(accelerations, "second")
        speed, more = identifier(self.inputs[1][0]), identifier(self.inputs[2][0])
        lines = _unpack([f"d{k}" for k in range(len(rates))], "first")
        lines += [f"    {rate} = d{k} * {speed}" for k, rate in enumerate(rates)]
        if order == 2:
            lines += _unpack([f"a{k}" for k in range(len(rates))], "second")
            lines += [f"    {name} = a{k} * {speed} * {speed} + d{k} * {more}" for k, name in enumerate(accelerations)]
        return lines

    def _watches(self) -> list[str]:
        writer = Writer(self.names, reachable(self.position_nodes))
        targets = [node for _, node in self.plan.watches]
        body = writer.statements(targets)
        returned = _tuple(writer.expression(node) for node in targets)
        self._import(writer)
        return [
            "",
            "def watches(values):",
            '    """Rows set aside as redundant, relative to the size: zero as long as they hold."""',
            _VALUES,
            *_indented(body),
            f"    return {returned}",
            "",
        ]

    def _jacobians(self) -> list[str]:
        writer = Writer(self.names, reachable(self.position_nodes))
        matrices = []
        body: list[str] = []
        for block in self.solved:
            body += writer.statements([entry for row in block.jacobian for entry in row])
            rows = ", ".join("[" + ", ".join(writer.expression(entry) for entry in row) + "]" for row in block.jacobian)
            matrices.append(f"[{rows}]")
        self._import(writer)
        return [
            "",
            "def jacobians(values):",
            '    """Jacobian of each block."""',
            _VALUES,
            *_indented(body),
            f"    return {_tuple(matrices)}",
            "",
        ]

    def _import(self, writer: Writer) -> None:
        """Note what a later stage takes from the position stage."""
        coordinates = {name for block in self.plan.blocks for name in block.coordinates} | set(self.inputs[0])
        for node in writer.used:
            if node.op != "symbol":
                self.exports.setdefault(self.names.of(node), node)
            elif node.name in coordinates:
                self.exports.setdefault(identifier(node.name), None)

    def _unpacked(self) -> str:
        return "\n".join(_unpack(self.exports, "values")) or "    # nothing is handed on"


_VALUES = "    <values>"
_Right = Callable[[Block], tuple[Node, ...]]


def _needed(targets: Sequence[Node], definitions: Mapping[str, Node]) -> list[str]:
    """Those of the definitions that the targets are made of, in the order of evaluation."""
    needed: set[str] = set()
    stack = [symbol.name for symbol in symbols(targets)]
    while stack:
        name = stack.pop()
        if name in definitions and name not in needed:
            needed.add(name)
            stack += [symbol.name for symbol in symbols([definitions[name]])]
    return [name for name in definitions if name in needed]


def _defined(writer: Writer, targets: Sequence[Node], definitions: Mapping[str, Node], done: set[str]) -> list[str]:
    """Statements for the definitions that the targets need and that are not done yet."""
    lines = []
    for name in _needed(targets, definitions):
        if name not in done:
            done.add(name)
            lines += writer.statements([definitions[name]])
            lines.append(f"{identifier(name)} = {writer.expression(definitions[name])}")
    return lines


def _is_small(block: Block) -> bool:
    return len(block.unknowns) <= 2 and len(block.residuals) == len(block.unknowns)


def _determinant(k: int, jacobian: Sequence[Sequence[str]]) -> list[str]:
    m, n = len(jacobian), len(jacobian[0])
    if m == n == 1:
        return [f"det{k} = {jacobian[0][0]}"]
    if m == n == 2:
        (a, b), (c, d) = jacobian
        return [f"det{k} = {_product(a, d)} - {_product(b, c)}"]
    factor = "factor" if m == n else "qr_factor"
    return [f"factors{k} = {factor}({_matrix(jacobian)})", f"det{k} = factors{k}.determinant"]


def _correction(k: int, jacobian: Sequence[Sequence[str]], r: Sequence[str], z: Sequence[str]) -> list[str]:
    """z -= J^-1 r."""
    m, n = len(jacobian), len(z)
    if m == n == 1:
        return [f"{z[0]} -= {r[0]} / det{k}"]
    if m == n == 2:
        (a, b), (c, d) = jacobian
        return [
            f"{z[0]} -= ({_product(d, r[0])} - {_product(b, r[1])}) / det{k}",
            f"{z[1]} -= ({_product(a, r[1])} - {_product(c, r[0])}) / det{k}",
        ]
    solve = "lu_solve" if m == n else "qr_solve"
    steps = [f"d{i}" for i in range(n)]
    lines = [f"{_tuple(steps)} = {solve}(factors{k}, [{', '.join(r)}])"]
    return lines + [f"{name} -= {step}" for name, step in zip(z, steps, strict=True)]


def _solution(k: int, jacobian: Sequence[Sequence[str]], b: Sequence[str], z: Sequence[str]) -> list[str]:
    """Z = -J^-1 b."""
    m, n = len(jacobian), len(z)
    if m == n == 1:
        return [f"{z[0]} = -{b[0]} / det{k}"]
    if m == n == 2:
        (a, c), (d, e) = jacobian
        return [
            f"{z[0]} = ({_product(c, b[1])} - {_product(e, b[0])}) / det{k}",
            f"{z[1]} = ({_product(d, b[0])} - {_product(a, b[1])}) / det{k}",
        ]
    solve = "lu_solve" if m == n else "qr_solve"
    return [f"{_tuple(z)} = {solve}(factors{k}, [{', '.join(f'-{name}' for name in b)}])"]


def _product(a: str, b: str) -> str:
    return " * ".join(f"({text})" if any(c in text for c in " -") else text for text in (a, b))


def _matrix(rows: Sequence[Sequence[str]]) -> str:
    return "[" + ", ".join("[" + ", ".join(row) + "]" for row in rows) + "]"


def _square(r: Sequence[str], scales: Sequence[float]) -> str:
    """Sum of the squared residuals relative to the size: cheaper than the largest, and no NaN hides in it."""
    if len(set(scales)) == 1:
        total = " + ".join(f"{name} * {name}" for name in r)
        return total if scales[0] == 1.0 else f"({total}) * {scales[0] ** -2!r}"
    return " + ".join(f"{name} * {name} * {scale**-2!r}" for name, scale in zip(r, scales, strict=True))


def _tuple(items: Iterable[str]) -> str:
    items = list(items)
    return f"({items[0]},)" if len(items) == 1 else f"({', '.join(items)})"


def _unpack(names: Iterable[str], source: str) -> list[str]:
    names = list(names)
    return [f"    {_tuple(names)} = {source}"] if names else []


def _indented(lines: Iterable[str], spaces: int = 4) -> list[str]:
    return [f"{' ' * spaces}{line}" for line in lines]


__all__ = ["emit"]
