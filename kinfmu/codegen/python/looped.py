"""The model module of a plan of many blocks: coordinates are in lists, runs of units are loops over tables.

Unrolled, such a plan would be functions of tens of thousands of statements and names, which are slow to compile and
larger than the processor's caches. kinfmu.codegen.lists describes the order of the lists.
"""

from __future__ import annotations

from collections.abc import Sequence

from kinfmu.codegen.lists import LISTS, Lists, UnitRun
from kinfmu.codegen.newton import ROUND_OFF
from kinfmu.codegen.python.block_code import indented, tupled
from kinfmu.codegen.python.header import bound, curve_names, differences, drive, header, law_steps
from kinfmu.codegen.python.loops import Loops
from kinfmu.codegen.writer import Names, Writer, identifier
from kinfmu.plan import SolvePlan
from kinfmu.plan.equations.graph import Node


def looped(plan: SolvePlan) -> str:
    """Return the source text of the module; equal plans give equal text."""
    return _Looped(plan).module()


class _Looped(Lists):
    def __init__(self, plan: SolvePlan) -> None:
        super().__init__(plan)
        self.curves = curve_names(plan)
        self.names = Names((name for block in plan.blocks for name in block.coordinates), self.curves)
        self.moving = {name: f"{LISTS[order]}[{k}]" for order in range(3) for name, k in self.places(order).items()}
        self.has_one_driver = len(plan.drivers) == 1
        self.unknowns = len(plan.unknowns)

    def module(self) -> str:
        functions = [
            *drive(self.plan, self.curves),
            *(line for kind in self.kinds.values() for line in Loops(kind, self.curves).source()),
            *self._position(),
            *self._velocity(),
            *self._acceleration(),
            *(self._tangent() if self.has_one_driver else ()),
            *self._carried(),
            *self._stage("outputs", "Positions of the outputs.", (0,)),
            *self._stage("rates", "Rates of the outputs.", (1,)),
            *self._stage("accelerations", "Accelerations of the outputs.", (2,)),
            *self._stage("motion", "Positions, rates and accelerations of the outputs in one row.", (0, 1, 2)),
            *(self._laws() if self.plan.path_laws.units else ()),
            *self._watches(),
            *self._appended("jacobians", "Jacobian of each block.", "jacobian"),
            *self._appended("residuals", "Residuals of each block, relative to the size.", "residual"),
            *differences(self.plan),
        ]
        if self.plan.parameters:
            functions = bound(self.plan, self.names, list(self.derived), functions)
        gathers = any(_is_long(self._gathered(order)[1]) for order in range(3))
        head = header(self.plan, self.curves, extra=("from operator import itemgetter",) if gathers else ())
        return "\n".join([*head, *self._tables(), *functions]) + "\n"

    def _tables(self) -> list[str]:
        """Return the rows of each run, the factors of the determinants, and the places of the outputs."""
        solved = [block for block in self.plan.blocks if block.unknowns]
        lines = [f"REST = (0.0,) * {self.given_outright}  # for the coordinates that are given outright"]
        lines += [f"DETERMINANT_FACTORS = {tuple(1.0 / block.determinant_scale for block in solved)!r}"]
        for order, name in enumerate(_GATHERS):
            places = self._gathered(order)[1]
            if _is_long(places):
                lines.append(f"{name} = itemgetter{tuple(places)!r}")
        for number, run in self.numbered():
            given = [[self.place[name] for name in member.given] for member in run.members]
            rows = [
                (*places, *member.constants, *(self.place[name] for name in member.own))
                for places, member in zip(given, run.members, strict=True)
            ]
            comment = (
                f"{len(rows)} units of kind {run.kind.label}: {run.members[0].own[0]} to {run.members[-1].own[-1]}"
            )
            lines += [f"RUN_{number} = (  # {comment}", *(f"    {row!r}," for row in rows), ")"]
        return [*lines, ""]

    def _values(self) -> list[str]:
        """Return the statement by which later functions read what the position stage keeps."""
        return [f"    {tupled(['x', *(f'holds{k}' for k, _ in self.numbered())])} = values"]

    def _position(self) -> list[str]:
        lines = [
            "",
            f"def position(u, z, zd, zdd, s, held=0, enough={ROUND_OFF**2}):",
            '    """Unknowns by Newton from a prediction, block by block; or ArithmeticError(block, residual)."""',
            "    half = 0.5 * s",
            "    predicted = [a + s * (b + half * c) for a, b, c in zip(z, zd, zdd)]",
            "    x = [*predicted, *REST, *u]",
            "    determinants, largest, iterations = [], 0.0, 0",
        ]
        for k, run in self.numbered():
            label = run.kind.label
            if run.kind.solved:
                arguments = f"RUN_{k}, x, z, held, enough, {run.first}, determinants, largest, iterations"
                lines.append(f"    holds{k}, largest, iterations = position{label}({arguments})")
            else:
                lines.append(f"    holds{k} = position{label}(RUN_{k}, x)")
        margin, moved = "1.0", "0.0"
        if self.unknowns:
            lines += [
                "    determinants = tuple([a * b for a, b in zip(determinants, DETERMINANT_FACTORS)])",
                f"    found = tuple(x[:{self.unknowns}])",
            ]
            margin = "min(map(abs, determinants))"
            moved = "max([abs(a - b) / c for a, b, c in zip(found, predicted, UNKNOWN_SCALES)]) if iterations else 0.0"
        else:
            lines.append("    determinants = found = ()")
        rows, body = self._expressions([node for _, node in self.plan.watches])
        lines += body
        watch = (
            f"max({', '.join(f'abs({row})' for row in rows)})"
            if len(rows) > 1
            else f"abs({rows[0]})"
            if rows
            else "0.0"
        )
        values = tupled(["x", *(f"holds{k}" for k, _ in self.numbered())])
        lines.append(f"    watch = {watch}")
        summary = f"found, determinants, {margin}, sqrt(largest), iterations, {moved}, watch"
        return [*lines, f"    return {summary}, {values}", ""]

    def _expressions(self, targets: Sequence[Node]) -> tuple[list[str], list[str]]:
        """Return expressions of the targets, and the statements before them, which read the lists."""
        writer = Writer(self.names, self.derived)
        body = writer.statements(targets)
        expressions = [writer.expression(node) for node in targets]
        names = [node.name for node in writer.used if node.op == "symbol" and node.name in self.moving]
        return expressions, indented([*(f"{identifier(name)} = {self.moving[name]}" for name in names), *body])

    def _rest(self, drivers: str) -> str:
        """Return a list of rates at rest, with those of the drivers."""
        return f"[0.0] * {len(self.order) - len(self.plan.drivers)} + {drivers}"

    def _solving(self, order: int, given: str) -> list[str]:
        """Return calls that fill x1 (order 1) or x2 (order 2), block after block."""
        lists = ", ".join(LISTS[1 : order + 1])
        lines = []
        for k, run in self.numbered():
            if run.kind.solved:
                name = ("velocity", "acceleration")[order - 1]
                lines.append(f"    {name}{run.kind.label}(RUN_{k}, holds{k}, {lists}, {given}, {run.first})")
            else:
                lines += self._carrying(order, k, run)
        return lines

    def _carrying(self, order: int, k: int, run: UnitRun) -> list[str]:
        """Return the call that computes what is given outright from what is solved for."""
        lists = ", ".join(LISTS[1 : order + 1])
        name = ("rates", "accelerations")[order - 1]
        return [f"    {name}{run.kind.label}(RUN_{k}, holds{k}, {lists})"] if run.kind.has_assigned else []

    def _velocity(self) -> list[str]:
        return [
            "",
            "def velocity(values, ud, given=(), held=0):",
            '    """Rates of the unknowns: J zd = -rate of the rows with z at rest."""',
            *self._values(),
            f"    x1 = {self._rest('[*ud]')}",
            *self._solving(1, "given, held"),
            f"    return tuple(x1[:{self.unknowns}])",
            "",
        ]

    def _acceleration(self) -> list[str]:
        return [
            "",
            "def acceleration(values, ud, udd, zd, given=(), held=0):",
            '    """Accelerations of the unknowns: J zdd = -second rate of the rows with zdd = 0."""',
            *self._values(),
            "    x1 = carried(values, ud, zd)",
            f"    x2 = {self._rest('[*udd]')}",
            *self._solving(2, "given, held"),
            f"    return tuple(x2[:{self.unknowns}])",
            "",
        ]

    def _tangent(self) -> list[str]:
        """Return, for one driver, the derivatives with respect to it, which every pose needs, and motion with them."""
        n = self.unknowns
        return [
            "",
            "def derivatives(values):",
            '    """First and second derivative of all coordinates with respect to the driver."""',
            *self._values(),
            f"    x1 = {self._rest('[1.0]')}",
            *self._solving(1, "(), 0"),
            f"    x2 = {self._rest('[0.0]')}",
            *self._solving(2, "(), 0"),
            "    return x1, x2",
            "",
            "",
            "def tangent(values):",
            '    """First and second derivative of the unknowns with respect to the driver."""',
            "    x1, x2 = derivatives(values)",
            f"    return tuple(x1[:{n}]), tuple(x2[:{n}])",
            "",
            "",
            "def first_motion(values, ud, udd):",
            '    """Tangent and motion in one go, for the first reading of a pose."""',
            "    x1, x2 = derivatives(values)",
            f"    return (tuple(x1[:{n}]), tuple(x2[:{n}])), motion_row(values[0], *at_speed(x1, x2, ud, udd))",
            "",
            "",
            "def at_speed(x1, x2, ud, udd):",
            '    """Rates and accelerations by the chain rule: qd = q\' ud, qdd = q\'\' ud^2 + q\' udd."""',
            "    (speed,), (more,) = ud, udd",
            "    return [d * speed for d in x1], [a * speed * speed + d * more for a, d in zip(x2, x1)]",
            "",
        ]

    def _carried(self) -> list[str]:
        """Return functions of the rates and accelerations of all coordinates from those of the unknowns."""
        first = [line for k, run in self.numbered() for line in self._carrying(1, k, run)]
        second = [line for k, run in self.numbered() for line in self._carrying(2, k, run)]
        return [
            "",
            "def carried(values, ud, zd):",
            '    """Rates of all coordinates from those of the unknowns."""',
            *self._values(),
            "    x1 = [*zd, *REST, *ud]",
            *first,
            "    return x1",
            "",
            "",
            "def carried_twice(values, udd, x1, zdd):",
            '    """Accelerations of all coordinates from their rates and the accelerations of the unknowns."""',
            *self._values(),
            "    x2 = [*zdd, *REST, *udd]",
            *second,
            "    return x2",
            "",
        ]

    def _gathered(self, order: int) -> tuple[list[Node], list[int]]:
        """Return the outputs of an order that are formulas, and each output's place in its list with those appended."""
        formulas: list[Node] = []
        places = []
        for node, place in self.outputs(order):
            places.append(len(self.order) + len(formulas) if place is None else place)
            formulas += [node] if place is None else []
        return formulas, places

    def _row(self, orders: Sequence[int]) -> list[str]:
        """Return the end of a function that returns the outputs of some orders, one after another."""
        wanted = [self._gathered(order) for order in orders]
        expressions, lines = self._expressions([node for formulas, _ in wanted for node in formulas])
        parts = []
        for order, (formulas, places) in zip(orders, wanted, strict=True):
            own, expressions = expressions[: len(formulas)], expressions[len(formulas) :]
            source = f"[*{LISTS[order]}, {', '.join(own)}]" if own else LISTS[order]
            if _is_long(places):
                parts.append(f"{_GATHERS[order]}({source})")
            else:
                parts.append(f"({source}[{places[0]}],)" if places else "()")
        return [*lines, f"    return {' + '.join(parts)}", ""]

    def _stage(self, name: str, docstring: str, orders: Sequence[int]) -> list[str]:
        """Return a function that returns all outputs at some orders of derivative, one after another."""
        highest = max(orders)
        arguments = [["values"], ["values", "ud", "first"], ["values", "ud", "udd", "first", "second"]][highest]
        lines = ["", f"def {name}({', '.join(arguments)}):", f'    """{docstring}"""', "    x = values[0]"]
        if highest:
            ud, udd = ("(1.0,)", "(0.0,)") if self.has_one_driver else ("ud", "udd")
            lines.append(f"    x1 = carried(values, {ud}, first)")
            if highest == 2:
                lines.append(f"    x2 = carried_twice(values, {udd}, x1, second)")
                lines += ["    x1, x2 = at_speed(x1, x2, ud, udd)"] if self.has_one_driver else []
            elif self.has_one_driver:
                lines.append("    x1 = [d * ud[0] for d in x1]")
        if len(orders) == 1:
            return lines + self._row(orders)
        about = '"""The outputs, their rates and accelerations in one row."""'
        return [
            *lines,
            "    return motion_row(x, x1, x2)",
            "",
            "",
            "def motion_row(x, x1, x2):",
            f"    {about}",
            *self._row(orders),
        ]

    def _laws(self) -> list[str]:
        """Return the functions of what steps of a path monitor of laws."""
        motions = self.plan.path_laws.motions
        here, lines = self._expressions(motions[0])
        moving, all_lines = self._expressions([node for nodes in motions for node in nodes])
        rates = ("(1.0,)", "(0.0,)") if self.has_one_driver else ("ud", "udd")
        return [
            "",
            "def law_motion(values, ud, udd, first, second):",
            '    """Motions that steps monitor, with rates and accelerations."""',
            "    x = values[0]",
            f"    x1 = carried(values, {rates[0]}, first)",
            f"    x2 = carried_twice(values, {rates[1]}, x1, second)",
            *all_lines,
            f"    return {tupled(moving)}",
            "",
            "",
            "def law_positions(values):",
            '    """Positions that steps monitor."""',
            "    x = values[0]",
            *lines,
            f"    return {tupled(here)}",
            "",
            *law_steps(self.plan, self.names, list(self.derived)),
        ]

    def _watches(self) -> list[str]:
        rows, body = self._expressions([node for _, node in self.plan.watches])
        return [
            "",
            "def watches(values):",
            '    """Rows set aside as redundant, relative to the size: zero as long as they hold."""',
            "    x = values[0]",
            *body,
            f"    return {tupled(rows)}",
            "",
        ]

    def _appended(self, name: str, docstring: str, one: str) -> list[str]:
        calls = [
            f"    {one}{run.kind.label}(RUN_{k}, holds{k}, found)" for k, run in self.numbered() if run.kind.solved
        ]
        return [
            "",
            f"def {name}(values):",
            f'    """{docstring}"""',
            *self._values(),
            "    found = []",
            *calls,
            "    return found",
            "",
        ]


_GATHERS = ("gather_positions", "gather_rates", "gather_accelerations")


def _is_long(places: Sequence[int]) -> bool:
    return len(places) > 1  # of a single place itemgetter gives no tuple
