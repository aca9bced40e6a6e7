"""The C functions of a kind of units; kinfmu.codegen.python.loops writes the same in Python.

    position(model, row, x, hold, z, held, determinant, newton)    true if Newton arrived
    velocity(model, row, x, hold, given, held, x1)                 rates of the unit's coordinates
    acceleration(model, row, x, hold, given, held, x1, x2)         their accelerations
    jacobian(model, row, x, hold, entries), residuals(...)

A row holds the places of the unit's given values in the lists, its own numbers, and the places of its coordinates.
Units without a solved block have no z, held, given and determinant.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from kinfmu.codegen.c.text import FUNCTIONS, Places, filled, function, indented, loads
from kinfmu.codegen.lists import LISTS, Kind, UnitRun
from kinfmu.codegen.newton import (
    ITERATIONS,
    before_newton,
    determinant,
    is_small,
    jacobian_text,
    outright,
    outright_rates,
    right_side,
    settled,
    solution,
    square,
)
from kinfmu.codegen.writer import Names, Writer, identifier
from kinfmu.plan import Block
from kinfmu.plan.equations.graph import Node, reachable
from kinfmu.solver.python.curve import CurveData

_BY_ROW = "; /* {} */"  # the comment on a coordinate that a row gives outright


class Units:
    """The writer of one kind's functions.

    curves: names of the constants that hold the data of curves; bound: where functions find parameters and what depends
    on them alone.
    """

    def __init__(self, kind: Kind, curves: Mapping[CurveData, str], bound: Places) -> None:
        self.kind = kind
        self.label = kind.label
        self.names = Names.of_blocks(kind.blocks, curves, FUNCTIONS)
        self.positions = kind.positions
        self.derived = [node for node in bound if isinstance(node, Node)]
        self.known = {*self.positions, *self.derived}  # what later functions find computed
        _, constants, own = fields(kind)
        self.own = dict(zip(kind.coordinates, own, strict=True))
        self.places = bound.copy()
        self.places |= {name: f"row->{name}" for name in constants}
        self.places |= {name: f"{LISTS[order]}[row->{field}]" for name, (order, field) in places(kind).items()}
        self.hold: dict[str, Node] = {}  # numbers that later functions take from the position
        self.keeps_determinant = False
        self.later = self._later()

    # What the functions are made of

    def cache_size(self) -> int:
        """Return how many numbers a unit keeps."""
        return len(self.hold) + int(self.keeps_determinant) + self._factors_size()

    def _factors_size(self) -> int:
        block = self.kind.solved
        if block is None or is_small(block):
            return 0
        m, k = len(block.residuals), len(block.unknowns)
        return k * k + 2 * k if m == k else 2 * m * k

    def cached(self, node: Node) -> int:
        """Return the place of a node of the position stage among the numbers that a unit keeps; add it if it is new."""
        name = self.names.of(node)
        self.hold.setdefault(name, node)
        return list(self.hold).index(name)

    def _hold(self, name: str) -> str:
        return f"hold[{list(self.hold).index(name)}]"

    @property
    def _kept(self) -> str:
        """The place of the determinant of a small block, or of the factors of a larger one."""
        return f"hold[{len(self.hold)}]" if self.keeps_determinant else f"hold + {len(self.hold)}"

    def _loads(self, writer: Writer, found: Iterable[str]) -> list[str]:
        """Return assignments of what the statements read and do not compute."""
        names = set(found)

        def held(node: Node) -> str:
            name = self.names.of(node)
            self.hold.setdefault(name, node)
            return f"<{name}>"  # replaced when all places are known

        read = (node for node in writer.used if node.op != "symbol" or node.name not in names)
        return loads(self.names, read, self.places, held)

    # The functions

    def source(self) -> list[str]:
        text = "\n".join([*row_type(self.kind), "", *self._position(), *self.later])
        for name in self.hold:
            text = text.replace(f"<{name}>", self._hold(name))
        return text.replace("<kept>", self._kept).split("\n")

    def _later(self) -> list[str]:
        block = self.kind.solved
        if block is not None:
            self.keeps_determinant = is_small(block)
        lines = self._rates("velocity", 1) + self._rates("acceleration", 2)
        if block is not None:
            lines += self._entries("jacobian", block.entries)
            lines += self._entries("residuals", block.residuals, block.row_scales)
        return lines

    def _position(self) -> list[str]:
        writer = Writer(self.names, self.derived, self.hold.values())
        block = self.kind.solved
        lines: list[str] = []
        for one in self.kind.blocks:
            lines += self._newton(writer, one) if one.unknowns else outright(writer, one, _BY_ROW)
        lines = self._loads(writer, self.kind.assigned) + lines
        lines += [f"x[row->{field}] = {identifier(name)}" for name, field in self.own.items()]
        lines += [f"{self._hold(name)} = {name}" for name in self.hold]
        if block is None:
            signature = (
                f"static void position{self.label}(const kf_model *model, const row{self.label} *row, double *x,"
                " double *hold)"
            )
            return function(signature, lines)
        lines += [f"{self._kept} = det"] if self.keeps_determinant else []
        lines += ["*determinant = det", "newton->iterations += iteration"]
        lines += [
            "newton->largest = newton->largest > error ? newton->largest : error",
            "newton->total += error; /* a NaN stays */",
        ]
        lines.append("return true")
        signature = (
            f"static bool position{self.label}(const kf_model *model, const row{self.label} *row, double *x,\n"
            "    double *hold, const double *z, bool held, double *determinant, kf_newton *newton)"
        )
        variables = ["int iteration;"] if is_small(block) else ["double det;", "int iteration;"]
        return function(signature, lines, variables)

    def _newton(self, writer: Writer, block: Block) -> list[str]:
        looped = [*(motion[0] for _, motion in block.assigned), *block.residuals, *block.entries]
        before = before_newton(writer, block)
        turned = [node for node in reachable(looped) if node.op in ("sin", "cos") and node.args[0].op == "symbol"]
        inside = writer.statements(turned)
        inside += outright(writer, block, _BY_ROW)
        r, lines = right_side(writer, "r", block.residuals, block.entries)
        inside += [*lines, f"error = {square(r, block.row_scales)}"]
        jacobian = jacobian_text(writer, block)
        inside += self._determinant(jacobian, block.usual)
        starts = [f"z[row->{self.own[name]}]" for name in block.unknowns]
        names = [identifier(name) for name in block.unknowns]
        return [
            f"/* {', '.join(block.unknowns)} from {', '.join(block.row_names)} */",
            *before,
            "last = INFINITY",
            f"for (iteration = 0; iteration < {ITERATIONS}; ++iteration) {{",
            *indented(inside),
            "    if (error <= newton->enough || held\n"
            f"            || (16.0 * error > last && error <= {settled(block, starts)})) {{",
            "        break",
            "    }",
            "    last = error",
            *indented(self._correction(jacobian, r, names)),
            "}",
            f"if (iteration == {ITERATIONS}) {{",
            "    newton->failed = error",
            "    return false",
            "}",
        ]

    def _determinant(self, jacobian: Sequence[Sequence[str]], usual: Sequence[float]) -> list[str]:
        m, k = len(jacobian), len(jacobian[0])
        if m == k <= 2:
            return [f"det = {determinant(jacobian)}"]
        flat = ", ".join(entry for row in jacobian for entry in row)
        part = f"kf_row_part({k}, matrix, usual)" if m == k else f"kf_column_part({m}, {k}, matrix, usual)"
        call = f"kf_lu({k}, matrix, <kept>, &det)" if m == k else f"kf_qr({m}, {k}, matrix, <kept>, &det)"
        return [
            "{",
            f"    const double matrix[{m * k}] = {{{flat}}};",
            f"    static const double usual[{k}] = {{{', '.join(map(repr, usual))}}};",
            f"    if (!{call}) {{",
            "        newton->failed = error",
            "        return false",
            "    }",
            f"    det *= {part}",
            "}",
        ]

    def _correction(self, jacobian: Sequence[Sequence[str]], r: Sequence[str], z: Sequence[str]) -> list[str]:
        """Return z -= J^-1 r."""
        m, k = len(jacobian), len(z)
        if m == k <= 2:
            return [f"{name} -= {step}" for name, step in zip(z, solution(jacobian, r), strict=True)]
        return self._solve(m, k, r, [f"{name} -= step[{i}]" for i, name in enumerate(z)])

    def _solve(self, m: int, k: int, right: Sequence[str], then: Sequence[str]) -> list[str]:
        sizes, name = (f"{k}", "kf_lu_solve") if m == k else (f"{m}, {k}", "kf_qr_solve")
        return [
            "{",
            f"    const double right[{m}] = {{{', '.join(right)}}};",
            f"    double step[{k}]",
            f"    {name}({sizes}, <kept>, right, step)",
            *indented(then),
            "}",
        ]

    def _rates(self, name: str, order: int) -> list[str]:
        """Return the function of the rates (order 1) or accelerations (2) of all coordinates of the unit."""
        writer = Writer(self.names, self.known)
        lines: list[str] = []
        found: list[str] = []
        for block in self.kind.blocks:
            if block.unknowns:
                lines += self._linear(writer, block, order)
            lines += outright_rates(writer, block, order)
            found += [coordinate.derivative(order) for coordinate in block.coordinates]
        lines = self._loads(writer, found) + lines
        out = LISTS[order]
        lines += [f"{out}[row->{field}] = {identifier(one.derivative(order))}" for one, field in self.own.items()]
        solving = " const double *given, bool held," if self.kind.solved else ""
        ready = " const double *x1," if order == 2 else ""
        signature = (
            f"static void {name}{self.label}(const kf_model *model, const row{self.label} *row, const double *x,"
            f" const double *hold,\n   {solving}{ready} double *{out})"
        )
        return function(signature, lines)

    def _linear(self, writer: Writer, block: Block, order: int) -> list[str]:
        """Return the linear solve of a block, or the values given in its place."""
        right = (block.velocity, block.acceleration)[order - 1]
        m, k = len(block.residuals), len(block.unknowns)
        entries = block.entries if k == 2 and is_small(block) else ()
        before = writer.statements([*right, *entries])
        b = [f"b{i}" for i in range(m)]
        z = [identifier(unknown.derivative(order)) for unknown in block.unknowns]
        taken = [f"    {one} = given[row->{self.own[name]}]" for one, name in zip(z, block.unknowns, strict=True)]
        solved = [f"{one} = {writer.expression(node)}" for one, node in zip(b, right, strict=True)]
        if is_small(block):
            jacobian = jacobian_text(writer, block) if entries else []
            kept, by_det = ("det = <kept>", "/ det") if order == 1 else ("per_det = 1.0 / <kept>", "* per_det")
            values = solution(jacobian, b, by_det, is_opposite=True)
            solved += [kept, *(f"{one} = {value}" for one, value in zip(z, values, strict=True))]
        else:
            opposite = [f"-{one}" for one in b]
            solved += self._solve(m, k, opposite, [f"{one} = step[{i}]" for i, one in enumerate(z)])
        return [*before, "if (held) {", *taken, "} else {", *indented(solved), "}"]

    def _entries(self, name: str, nodes: Sequence[Node], scales: Sequence[float] = ()) -> list[str]:
        """Return a function that writes numbers of the position stage into an array."""
        writer = Writer(self.names, self.derived if scales else self.known)
        lines, entries = writer.formulas(nodes)
        if scales:
            entries = [f"({entry}) / {scale!r}" for entry, scale in zip(entries, scales, strict=True)]
        signature = (
            f"static void {name}{self.label}(const kf_model *model, const row{self.label} *row, const double *x,"
            " const double *hold,\n    double *entries)"
        )
        return function(signature, [*self._loads(writer, ()), *lines, *filled("entries", entries)])


def fields(kind: Kind) -> tuple[list[str], list[str], list[str]]:
    """Return the field names of a row: places of the given values, numbers, and places of the unit's coordinates."""
    given = [f"g{k}" for k in range(len(kind.given))]
    return given, [f"c{k}" for k in range(kind.constants)], [f"k{k}" for k in range(len(kind.coordinates))]


def row_type(kind: Kind) -> list[str]:
    """Return the struct of a row."""
    given, constants, own = fields(kind)
    members = [f"    int {', '.join(given)};"] if given else []
    members += [f"    double {', '.join(constants)};"] if constants else []
    return ["typedef struct {", *members, f"    int {', '.join(own)};", f"}} row{kind.label};"]


def places(kind: Kind) -> dict[str, tuple[int, str]]:
    """Return for each symbol of a unit its order of derivative and the row's field with its place in that list."""
    given, _, own = fields(kind)
    found: dict[str, tuple[int, str]] = {}
    for field, names in zip(given, kind.given, strict=True):
        found |= {name: (order, field) for order, name in enumerate(names)}
    for field, name in zip(own, kind.coordinates, strict=True):
        found |= {name.derivative(order): (order, field) for order in range(3)}
    return found


def rows_of(number: int, run: UnitRun, place: Mapping[str, int]) -> list[str]:
    """Return the table of a run."""
    rows = []
    for member in run.members:
        given, own = ([str(place[name]) for name in names] for names in (member.given, member.own))
        comment = f" /* {', '.join(member.own)} */"
        rows.append(f"    {{{', '.join([*given, *map(repr, member.constants), *own])}}},{comment}")
    return [f"static const row{run.kind.label} run_{number}[{len(rows)}] = {{", *rows, "};", ""]
