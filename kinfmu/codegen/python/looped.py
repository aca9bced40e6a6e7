"""The model module of a plan of many blocks: coordinates are in lists, runs of units are loops over tables.

Unrolled, such a plan would be functions of tens of thousands of statements and names, which are slow to compile and
larger than the processor's caches. kinfmu.codegen.lists describes the order of the lists.
"""

from __future__ import annotations

from collections.abc import Sequence

from kinfmu.codegen.lists import LISTS, Lists, UnitRun
from kinfmu.codegen.python.block_code import defined, extreme, tupled
from kinfmu.codegen.python.header import ORDERS, bound, curve_names, differences, drive, header, law_steps, stage
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
            *(line for name, orders in ORDERS.items() for line in self._outputs(name, orders)),
            *(self._laws() if self.plan.path_laws.units else ()),
            *self._watches(),
            *self._appended("jacobians"),
            *self._appended("residuals"),
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
        return [f"{self._kept()} = values"]

    def _kept(self) -> str:
        return tupled(["x", *(f"holds{k}" for k, _ in self.numbered())])

    def _position(self) -> list[str]:
        lines = [
            "half = 0.5 * s",
            "predicted = [a + s * (b + half * c) for a, b, c in zip(z, zd, zdd)]",
            "x = [*predicted, *REST, *u]",
            "determinants, largest, iterations = [], 0.0, 0",
        ]
        for k, run in self.numbered():
            label = run.kind.label
            if run.kind.solved:
                arguments = f"RUN_{k}, x, z, held, enough, {run.first}, determinants, largest, iterations"
                lines.append(f"holds{k}, largest, iterations = position{label}({arguments})")
            else:
                lines.append(f"holds{k} = position{label}(RUN_{k}, x)")
        margin, moved = "1.0", "0.0"
        if self.unknowns:
            lines += [
                "determinants = tuple([a * b for a, b in zip(determinants, DETERMINANT_FACTORS)])",
                f"found = tuple(x[:{self.unknowns}])",
            ]
            margin = "min(map(abs, determinants))"
            moved = "max([abs(a - b) / c for a, b, c in zip(found, predicted, UNKNOWN_SCALES)]) if iterations else 0.0"
        else:
            lines.append("determinants = found = ()")
        body, rows = self._formulas([node for _, node in self.plan.watches])
        lines += [*body, f"watch = {extreme('max', [f'abs({row})' for row in rows])}"]
        summary = f"found, determinants, {margin}, sqrt(largest), iterations, {moved}, watch"
        return stage("position", lines, f"{summary}, {self._kept()}")

    def _formulas(self, targets: Sequence[Node]) -> tuple[list[str], list[str]]:
        """Return statements, which read the lists, and after them each target as an expression."""
        writer = Writer(self.names, self.derived)
        body, expressions = writer.formulas(targets)
        names = [node.name for node in writer.used if node.op == "symbol" and node.name in self.moving]
        return [*(f"{identifier(name)} = {self.moving[name]}" for name in names), *body], expressions

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
                lines.append(f"{name}{run.kind.label}(RUN_{k}, holds{k}, {lists}, {given}, {run.first})")
            else:
                lines += self._carrying(order, k, run)
        return lines

    def _carrying(self, order: int, k: int, run: UnitRun) -> list[str]:
        """Return the call that computes what is given outright from what is solved for."""
        lists = ", ".join(LISTS[1 : order + 1])
        name = ("rates", "accelerations")[order - 1]
        return [f"{name}{run.kind.label}(RUN_{k}, holds{k}, {lists})"] if run.kind.assigned else []

    def _velocity(self) -> list[str]:
        lines = [*self._values(), f"x1 = {self._rest('[*ud]')}", *self._solving(1, "given, held")]
        return stage("velocity", lines, self._cut("x1"))

    def _acceleration(self) -> list[str]:
        lines = [*self._values(), "x1 = carried(values, ud, zd)", f"x2 = {self._rest('[*udd]')}"]
        return stage("acceleration", [*lines, *self._solving(2, "given, held")], self._cut("x2"))

    def _cut(self, name: str) -> str:
        """Return the part of a list that belongs to the unknowns."""
        return f"tuple({name}[:{self.unknowns}])"

    def _tangent(self) -> list[str]:
        """Return, for one driver, the derivatives with respect to it, which every pose needs, and motion with them."""
        about = "First and second derivative of all coordinates with respect to the driver."
        lines = [*self._values(), f"x1 = {self._rest('[1.0]')}", *self._solving(1, "(), 0")]
        lines += [f"x2 = {self._rest('[0.0]')}", *self._solving(2, "(), 0")]
        both, read = f"{self._cut('x1')}, {self._cut('x2')}", ["x1, x2 = derivatives(values)"]
        chained = "Rates and accelerations by the chain rule: qd = q' ud, qdd = q'' ud^2 + q' udd."
        at_speed = "[d * speed for d in x1], [a * speed * speed + d * more for a, d in zip(x2, x1)]"
        return [
            *defined("derivatives(values)", about, lines, "x1, x2"),
            *stage("tangent", read, both),
            *stage("first_motion", read, f"({both}), motion_row(values[0], *at_speed(x1, x2, ud, udd))"),
            *defined("at_speed(x1, x2, ud, udd)", chained, ["(speed,), (more,) = ud, udd"], at_speed),
        ]

    def _carried(self) -> list[str]:
        """Return functions of the rates and accelerations of all coordinates from those of the unknowns."""
        first, second = ([line for k, run in self.numbered() for line in self._carrying(n, k, run)] for n in (1, 2))
        first = [*self._values(), "x1 = [*zd, *REST, *ud]", *first]
        second = [*self._values(), "x2 = [*zdd, *REST, *udd]", *second]
        about = "Rates of all coordinates from those of the unknowns."
        of_second = "Accelerations of all coordinates from their rates and the accelerations of the unknowns."
        return [
            *defined("carried(values, ud, zd)", about, first, "x1"),
            *defined("carried_twice(values, udd, x1, zdd)", of_second, second, "x2"),
        ]

    def _gathered(self, order: int) -> tuple[list[Node], list[int]]:
        """Return the outputs of an order that are formulas, and each output's place in its list with those appended."""
        formulas: list[Node] = []
        places = []
        for node, place in self.outputs(order):
            places.append(len(self.order) + len(formulas) if place is None else place)
            formulas += [node] if place is None else []
        return formulas, places

    def _row(self, orders: Sequence[int]) -> tuple[list[str], str]:
        """Return statements, and after them the outputs of some orders, one after another."""
        outputs = [self._gathered(order) for order in orders]
        lines, expressions = self._formulas([node for formulas, _ in outputs for node in formulas])
        parts = []
        for order, (formulas, places) in zip(orders, outputs, strict=True):
            own, expressions = expressions[: len(formulas)], expressions[len(formulas) :]
            source = f"[*{LISTS[order]}, {', '.join(own)}]" if own else LISTS[order]
            if _is_long(places):
                parts.append(f"{_GATHERS[order]}({source})")
            else:
                parts.append(f"({source}[{places[0]}],)" if places else "()")
        return lines, " + ".join(parts)

    def _outputs(self, name: str, orders: Sequence[int]) -> list[str]:
        """Return a function that returns all outputs at some orders of derivative, one after another."""
        highest = max(orders)
        lines = ["x = values[0]", *self._carrying_to(highest)]
        if self.has_one_driver and highest:
            lines.append("x1, x2 = at_speed(x1, x2, ud, udd)" if highest == 2 else "x1 = [d * ud[0] for d in x1]")
        if len(orders) == 1:
            body, row = self._row(orders)
            return stage(name, [*lines, *body], row)
        about = "The outputs, their rates and accelerations in one row."
        return [
            *stage(name, lines, "motion_row(x, x1, x2)"),
            *defined("motion_row(x, x1, x2)", about, *self._row(orders)),
        ]

    def _carrying_to(self, order: int) -> list[str]:
        """Return statements of the rates (and accelerations, order 2) of all coordinates; by a driver alone."""
        ud, udd = ("(1.0,)", "(0.0,)") if self.has_one_driver else ("ud", "udd")
        return [f"x1 = carried(values, {ud}, first)", f"x2 = carried_twice(values, {udd}, x1, second)"][:order]

    def _laws(self) -> list[str]:
        """Return the functions of what steps of a path monitor of laws."""
        motions = self.plan.path_laws.motions
        lines, here = self._formulas(motions[0])
        all_lines, moving = self._formulas([node for nodes in motions for node in nodes])
        return [
            *stage("law_motion", ["x = values[0]", *self._carrying_to(2), *all_lines], tupled(moving)),
            *stage("law_positions", ["x = values[0]", *lines], tupled(here)),
            *law_steps(self.plan, self.names, list(self.derived)),
        ]

    def _watches(self) -> list[str]:
        body, rows = self._formulas([node for _, node in self.plan.watches])
        return stage("watches", ["x = values[0]", *body], tupled(rows))

    def _appended(self, name: str) -> list[str]:
        """Return the function of the Jacobians or the residuals, each block after another."""
        solved = [(k, run.kind.label) for k, run in self.numbered() if run.kind.solved]
        calls = [f"{name.removesuffix('s')}{label}(RUN_{k}, holds{k}, found)" for k, label in solved]
        return stage(name, [*self._values(), "found = []", *calls], "found")


_GATHERS = ("gather_positions", "gather_rates", "gather_accelerations")


def _is_long(places: Sequence[int]) -> bool:
    return len(places) > 1  # of a single place itemgetter gives no tuple
