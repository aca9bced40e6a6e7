"""lanes.c: the formulas of a plan for many samples side by side, free of branches.

A unit's position, rates and accelerations are one loop over the lanes, so that intermediate numbers stay in registers.
Newton corrects a good prediction; sines and cosines of the unknowns are computed once and then rotated.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import accumulate

from kinfmu.backends.alike import Kind, positions
from kinfmu.backends.c.text import array, assigned, declared
from kinfmu.backends.c.units import placed, places, row_type, rows_of
from kinfmu.backends.lists import LISTS, Lists
from kinfmu.backends.newton import determinant, is_small, opposite_solution, solution, square
from kinfmu.backends.writer import Names, Writer, identifier
from kinfmu.equations.graph import Node, reachable
from kinfmu.naming import derivative_name
from kinfmu.plan import Block, SolvePlan
from kinfmu.plan.trace import is_parameter

CORRECTIONS = 1  # of a good prediction; the sweep corrects once more where that does not do
_VECTORS = {"sin": "kf_sin", "cos": "kf_cos"}
_BRANCHING = ("curve", "atan2", "floor")


def has_lanes(plan: SolvePlan) -> bool:
    """True if a plan can be solved side by side: one driver, blocks of one or two unknowns, no piecewise functions."""
    solved = (block for block in plan.blocks if block.unknowns)
    rows = [node for block in plan.blocks for node in (*block.residuals, *(m[0] for _, m in block.assigned))]
    plain = not any(node.op in _BRANCHING for node in reachable(rows))
    return len(plan.drivers) == 1 and plain and all(is_small(block) for block in solved)


def emit_lanes(plan: SolvePlan) -> dict[str, str]:
    """Texts of lane_sizes.h and, if the plan has lanes, of lanes.c, by file name."""
    if not has_lanes(plan):
        return {"lane_sizes.h": "#define KF_HAS_LANES 0\n#define KF_LANE_HOLD 0\n#define KF_REPEATS 0\n"}
    lanes = _Lanes(plan)
    sizes = (
        f"#define KF_HAS_LANES 1\n#define KF_LANE_HOLD {lanes.holds[-1]}\n#define KF_REPEATS {int(_repeats(plan))}\n"
    )
    return {"lane_sizes.h": sizes, "lanes.c": lanes.source()}


def _repeats(plan: SolvePlan) -> bool:
    """True if a whole turn of any angle changes nothing: all stand in sines and cosines, but where one is another.

    A gear or a coupling of angles tells how often they have turned: such a plan is not taken to repeat.
    """
    angles = {name for block in plan.blocks for name in block.coordinates if name.endswith(".phi")}
    angles |= {driver.inputs[0] for driver in plan.drivers if driver.quantity.kind == "angle"}

    def is_turned(node: Node) -> bool:
        """An angle, and no more than constants added to it."""
        while node.op in ("+", "-") and node.args[1].constant is not None:
            node = node.args[0]
        while node.op == "+" and node.args[0].constant is not None:
            node = node.args[1]
        return node.op == "symbol" and node.name in angles

    rows = [node for block in plan.blocks for node in block.residuals]
    rows += [m[0] for block in plan.blocks for name, m in block.assigned if not (name in angles and is_turned(m[0]))]
    found: set[Node] = set()
    stack = list(rows)
    while stack:
        node = stack.pop()
        if node in found or (node.op in ("sin", "cos") and is_turned(node.args[0])):
            continue
        if node.op == "symbol" and node.name in angles:
            return False
        found.add(node)
        stack += node.args
    return True


class _Lanes(Lists):
    def __init__(self, plan: SolvePlan) -> None:
        super().__init__(plan)
        self.names = Names((name for block in plan.blocks for name in block.coordinates), functions=_VECTORS)
        self.units = {k: _LaneUnit(kind, self.parameters, self.derived, plan.size) for k, kind in self.kinds.items()}
        self.taken = self.home({label: units.positions for label, units in self.units.items()})
        readers = [self._formulas(k) for k in range(3)] + [self._watches()]  # they say what is handed on
        self.holds = [0, *accumulate(len(self.units[run.kind.label].hold) for run in self.runs)]
        self.readers = [placed(line, self.holds) for lines in readers for line in lines]

    def source(self) -> str:
        factors = [1.0 / block.determinant_scale for block in self.plan.blocks if block.unknowns]
        return "\n".join(
            [
                f"/* Kinematics of {self.plan.mechanism.name}, side by side: generated from its mechanism. */",
                '#include "lanes.h"',
                "",
                "#include <math.h>",
                "",
                *(array("static double determinant_factors", factors) if factors else ()),
                "",
                *(line for units in self.units.values() for line in units.source()),
                *(line for k, run in self.numbered() for line in rows_of(k, run, self.place)),
                *self.readers,
                *self._solve(),
            ]
        )

    def _solve(self) -> list[str]:
        lines = []
        for number, run in self.numbered():
            many = len(run.members) > 1
            row, hold = f"&run_{number}[{'k' if many else 0}]", f"lanes->hold + {self.holds[number - 1]}"
            factor = f", determinant_factors[{run.first}{' + k' * many}]" if run.kind.solved else ""
            call = f"unit{run.kind.label}(model, {row}, lanes, {hold}{factor}, full);"
            lines += [f"for (k = 0; k < {len(run.members)}; ++k) {{", f"    {call}", "}"] if many else [call]
        return [
            "static inline void solve(const kf_model *model, kf_lanes *lanes, const bool full)",
            "{",
            "    int i, k;",
            "    for (i = 0; i < KF_LANES; ++i) {",
            "        lanes->error[i] = 0.0;",
            "        lanes->margin[i] = 1.0;",
            "        lanes->moved[i] = 0.0;",
            "    }",
            "    (void)k;",
            *(f"    {line}" for line in lines),
            "    outputs(model, lanes);",
            "    watches(model, lanes);",
            "    if (full) {",
            "        rates(model, lanes);",
            "        accelerations(model, lanes);",
            "    }",
            "}",
            "",
            "void kf_lanes_solve(const kf_model *model, kf_lanes *lanes, bool full)",
            "{",
            "    if (full) {",
            "        solve(model, lanes, true);",
            "    } else {",
            "        solve(model, lanes, false);",
            "    }",
            "}",
            "",
        ]

    def _loop(self, name: str, lines: Sequence[str], writer: Writer) -> list[str]:
        """A function that goes through the lanes."""
        where = {name: f"{LISTS[k]}[{at}]" for k in range(3) for name, at in self.stands(k).items()}
        loads = []
        for node in writer.used:
            if node in self.derived:
                source = f"model->derived[{self.derived[node]}]"
            elif node in self.taken:
                number = self.taken[node]
                source = f"lanes->hold[<{number}:{self.units[self.runs[number - 1].kind.label].handed_on(node)}>][i]"
            elif is_parameter(node):
                source = f"model->parameters[{self.parameters[node.name]}]"
            else:
                source = f"lanes->{where[node.name]}[i]"
            loads.append(f"{self.names.of(node)} = {source};")
        body = [*loads, *lines]
        loop = ["    KF_SIDE_BY_SIDE", "    for (i = 0; i < KF_LANES; ++i) {",
                *(f"        {line}" for line in [*declared(assigned(body)), *body]), "    }"]  # fmt: skip
        return [
            f"static inline void {name}(const kf_model *model, kf_lanes *lanes)",
            "{",
            "    int i;",
            "    (void)model;",
            *(loop if lines else ["    (void)i;", "    (void)lanes;"]),
            "}",
            "",
        ]

    def _formulas(self, order: int) -> list[str]:
        """The outputs that are formulas; those that are coordinates are taken from where they stand."""
        writer = Writer(self.names, [*self.derived, *self.taken])
        targets = [(k, node) for k, (node, place) in enumerate(self.outputs(order)) if place is None]
        lines = [f"{line};" for line in writer.statements([node for _, node in targets])]
        lines += [f"lanes->outputs[{order}][{k}][i] = {writer.expression(node)};" for k, node in targets]
        return self._loop(("outputs", "rates", "accelerations")[order], lines, writer)

    def _watches(self) -> list[str]:
        writer = Writer(self.names, [*self.derived, *self.taken])
        targets = [node for _, node in self.plan.watches]
        lines = [f"{line};" for line in writer.statements(targets)]
        lines += [f"lanes->watches[{k}][i] = {writer.expression(node)};" for k, node in enumerate(targets)]
        return self._loop("watches", lines, writer)


class _LaneUnit:
    """The function of one kind of units: positions, and with `full` rates and accelerations."""

    def __init__(self, kind: Kind, parameters: dict[str, int], derived: dict[Node, int], size: float) -> None:
        self.kind = kind
        self.parameters = parameters
        self.derived = derived
        self.size = size
        self.names = Names(kind.coordinates, functions=_VECTORS)
        for block in kind.blocks:
            for name, motion in block.assigned:
                self.names.assign(motion[0], name)
        self.positions = reachable([node for group in positions(kind.blocks) for node in group])
        self.hold: dict[Node, int] = {}

    def handed_on(self, node: Node) -> int:
        """Place of a node among the numbers that later functions take from here, from now on if not before."""
        return self.hold.setdefault(node, len(self.hold))

    def source(self) -> list[str]:
        kind = self.kind
        writer = Writer(self.names, self.derived, self.hold)
        self.declared: list[str] = []
        body: list[str] = []
        for block in kind.blocks:
            body += self._newton(writer, block) if block.unknowns else self._given_outright(writer, block)
        where = places(kind)
        own = {name: field for name, (order, field) in where.items() if order == 0 and field.startswith("k")}
        body += [f"x_{field}[i] = {identifier(name)};" for name, field in own.items()]
        body += [f"hold[{k}][i] = {self.names.of(node)};" for node, k in self.hold.items()]
        motion: list[str] = []
        for order in (1, 2):
            for block in kind.blocks:
                motion += self._linear(writer, block, order) if block.unknowns else []
                for name, nodes in block.assigned:
                    motion += [f"{line};" for line in writer.statements([nodes[order]])]
                    motion.append(f"{identifier(derivative_name(name, order))} = {writer.expression(nodes[order])};")
            for name, field in own.items():
                motion.append(f"{LISTS[order]}_{field}[i] = {identifier(derivative_name(name, order))};")
        found = {name for block in kind.blocks for name, _ in block.assigned}
        found |= {derivative_name(name, order) for name in kind.coordinates for order in (1, 2)}
        unknowns = [name for block in kind.blocks for name in block.unknowns]
        loads = [f"{identifier(name)} = x_{own[name]}[i];" for name in unknowns]
        later: list[str] = []
        found |= set(unknowns)
        for node in writer.used:
            name = self.names.of(node)
            if node in self.derived:
                loads.append(f"{name} = model->derived[{self.derived[node]}];")
            elif node.op != "symbol" or node.name in found:
                continue
            elif is_parameter(node):
                loads.append(f"{name} = model->parameters[{self.parameters[node.name]}];")
            elif node.name in where:
                order, field = where[node.name]
                (loads if order == 0 else later).append(f"{name} = {LISTS[order]}_{field}[i];")
            else:
                loads.append(f"{name} = row->{name};")
        lines = [*loads, *body, "if (full) {", *(f"    {line}" for line in [*later, *motion]), "}"]
        solved = kind.solved is not None
        used = sorted(set(re.findall(r"\b(x[12]?)_([gk]\d+)\[i\]", "\n".join(lines))))
        return [
            *row_type(kind),
            "",
            f"static inline void unit{kind.label}(const kf_model *model, const row{kind.label} *row, kf_lanes *lanes,",
            f"    double (*hold)[KF_LANES],{' const double factor,' if solved else ''} const bool full)",
            "{",
            *(f"    double *const {name}_{field} = lanes->{name}[row->{field}];" for name, field in used),
            "    int i;",
            "    (void)model;",
            "    (void)hold;",
            "    KF_SIDE_BY_SIDE",
            "    for (i = 0; i < KF_LANES; ++i) {",
            *(f"        {line}" for line in [*declared([*assigned(lines), *self.declared]), *lines]),
            "    }",
            "}",
            "",
        ]

    def _given_outright(self, writer: Writer, block: Block) -> list[str]:
        lines = []
        for name, motion in block.assigned:
            lines += [f"{line};" for line in writer.statements([motion[0]])]
            given = writer.expression(motion[0])
            if given != identifier(name):
                lines.append(f"{identifier(name)} = {given};")
        return lines

    def _newton(self, writer: Writer, block: Block) -> list[str]:
        """Corrections of the prediction, the residual that they leave, and what follows from the unknowns."""
        turning = self._turning(block)
        lines = []
        for unknown, sine, cosine in turning:
            lines.append(f"kf_sincos({identifier(unknown)}, &{self.names.of(sine)}, &{self.names.of(cosine)});")
            self.declared += [self.names.of(sine), self.names.of(cosine)]
            writer.known |= {sine, cosine}
        entries = [entry for row in block.jacobian for entry in row]
        unknowns = [
            node
            for node in reachable([*block.residuals, *entries])
            if node.op == "symbol" and node.name in block.unknowns
        ]
        looped = [*(motion[0] for _, motion in block.assigned), *block.residuals, *entries]
        moving = [*unknowns, *(node for _, sine, cosine in turning for node in (sine, cosine))]
        lines += [f"{line};" for line in writer.statements(writer.independent(looped, moving))]
        r = [f"r{k}" for k in range(len(block.residuals))]
        steps = [f"d{k}" for k in range(len(block.unknowns))]
        known = set(writer.known)
        for turn in range(CORRECTIONS):
            writer.known = set(known)
            lines += [f"{line};" for line in writer.statements([*block.residuals, *entries])]
            lines += [f"{one} = {writer.expression(node)};" for one, node in zip(r, block.residuals, strict=True)]
            jacobian = [[writer.expression(entry) for entry in row] for row in block.jacobian]
            lines.append(f"per_det = 1.0 / ({determinant(jacobian)});")
            values = solution(jacobian, r, "det")
            lines += [
                f"{one} = {text.replace(' / det', ' * per_det')};" for one, text in zip(steps, values, strict=True)
            ]
            lines += [f"{identifier(name)} -= {one};" for name, one in zip(block.unknowns, steps, strict=True)]
            for name, one in zip(block.unknowns, steps, strict=True):
                for unknown, sine, cosine in turning:
                    if unknown == name:
                        lines.append(f"kf_rotate(-{one}, &{self.names.of(sine)}, &{self.names.of(cosine)});")
            if turn == 0:
                for name, one in zip(block.unknowns, steps, strict=True):
                    scale = "" if name.endswith(".phi") else f" * {1.0 / self.size!r}"
                    lines.append(f"size = fabs({one}){scale};")
                    lines.append("lanes->moved[i] = size > lanes->moved[i] ? size : lanes->moved[i];")
        writer.known = set(known)
        lines += [f"{line};" for line in writer.statements([*block.residuals, *entries])]
        lines += [f"{one} = {writer.expression(node)};" for one, node in zip(r, block.residuals, strict=True)]
        self.jacobian = [[writer.expression(entry) for entry in row] for row in block.jacobian]
        lines += [
            f"det = {determinant(self.jacobian)};",
            "size = fabs(det * factor);",
            "lanes->margin[i] = size < lanes->margin[i] ? size : lanes->margin[i];",
            f"size = {square(r, block.row_scales)};",
            "lanes->error[i] = size > lanes->error[i] || size != size ? size : lanes->error[i]; /* a NaN stays */",
            "per_det = 1.0 / det;",
        ]
        return lines + self._given_outright(writer, block)

    def _turning(self, block: Block) -> list[tuple[str, Node, Node]]:
        """Unknown angles whose sine and cosine the formulas hold, with both as nodes."""
        found = []
        for node in self.positions:
            if node.op == "symbol" and node.name in block.unknowns:
                sine, cosine = node.graph.function("sin", node), node.graph.function("cos", node)
                if {sine, cosine} & set(self.positions):
                    found.append((node.name, sine, cosine))
        return found

    def _linear(self, writer: Writer, block: Block, order: int) -> list[str]:
        right = (block.velocity, block.acceleration)[order - 1]
        lines = [f"{line};" for line in writer.statements(right)]
        b = [f"b{k}" for k in range(len(right))]
        lines += [f"{one} = {writer.expression(node)};" for one, node in zip(b, right, strict=True)]
        z = [identifier(derivative_name(name, order)) for name in block.unknowns]
        values = opposite_solution(self.jacobian, b, "det")
        return lines + [f"{one} = {text.replace(' / det', ' * per_det')};" for one, text in zip(z, values, strict=True)]
