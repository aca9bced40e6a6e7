"""SolvePlan -> C: model.c, the formulas of a mechanism, and sizes.h, how many there are of what.

The same plan gives the same bytes. What the functions mean is told in runtime/kinfmu.h; kinds of units are written by
`units`, and here are the tables of their runs, the functions that go through them, outputs, laws and names.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from itertools import accumulate

from kinfmu.backends.c.text import FUNCTIONS, array, assigned, booleans, declared, string
from kinfmu.backends.c.units import Units, placed, rows_of
from kinfmu.backends.lists import LISTS, Lists
from kinfmu.backends.writer import Names, Writer, identifier
from kinfmu.equations.graph import Node
from kinfmu.plan import SolvePlan
from kinfmu.plan.trace import is_parameter
from kinfmu.solver.continuation import NO_NUMBER
from kinfmu.solver.curve import CurveData


def emit(plan: SolvePlan) -> dict[str, str]:
    """Texts of sizes.h and model.c, by file name."""
    model = _Model(plan)
    return {"sizes.h": model.sizes(), "model.c": model.source()}


class _Model(Lists):
    def __init__(self, plan: SolvePlan) -> None:
        super().__init__(plan)
        data = dict.fromkeys(node.curve[0] for node in plan.nodes if node.op == "curve")
        self.curves: dict[CurveData, str] = {one: f"&curve_{k}" for k, one in enumerate(data, start=1)}
        self.names = Names((name for block in plan.blocks for name in block.coordinates), self.curves, FUNCTIONS)
        self.solved = [block for block in plan.blocks if block.unknowns]
        self.units = {k: Units(kind, self.curves, self.parameters, self.derived) for k, kind in self.kinds.items()}
        self.taken = self.home({label: units.positions for label, units in self.units.items()})
        readers = [self._written(order) for order in range(3)] + [self._watches()]  # they say what is handed on
        self.unit_sources = {label: units.source() for label, units in self.units.items()}
        rooms = [len(run.members) * self.units[run.kind.label].room() for run in self.runs]
        self.holds = [0, *accumulate(rooms)]  # where the numbers that each run hands on stand
        self.readers = [placed(line, self.holds) for lines in readers for line in lines]

    def sizes(self) -> str:
        """sizes.h."""
        plan = self.plan
        counts = {
            "DRIVERS": len(plan.drivers),
            "UNKNOWNS": len(plan.unknowns),
            "COORDINATES": len(self.order),
            "BLOCKS": len(self.solved),
            "ROWS": sum(len(block.residuals) for block in self.solved),
            "HOLD": self.holds[-1],
            "OUTPUTS": len(plan.outputs_motion),
            "WATCHES": len(plan.watches),
            "FIXED": len(plan.fixed_nodes),
            "PARAMETERS": len(plan.parameters),
            "DERIVED": len(self.derived),
            "CONSTANTS": len(plan.law_constants),
            "LARGEST_BLOCK": max((len(b.residuals) * len(b.unknowns) for b in self.solved), default=0),
        }
        offset = max(map(abs, plan.origin)) / plan.size
        return "\n".join(
            [
                f"/* Sizes of {plan.mechanism.name}: generated from its mechanism, not to be edited. */",
                "#ifndef KF_SIZES_H",
                "#define KF_SIZES_H",
                "",
                *(f"#define KF_{name} {count}" for name, count in counts.items()),
                f"#define KF_SIZE {plan.size!r} /* of the mechanism, in its unit of length */",
                f"#define KF_OFFSET {offset!r} /* from the world's origin, in sizes */",
                "",
                "#endif",
                "",
            ]
        )

    def source(self) -> str:
        """model.c."""
        lines = [
            f"/* Kinematics of {self.plan.mechanism.name}: generated from its mechanism, not for editing. */",
            '#include "kinfmu.h"',
            '#include "sincos.h"',
            "",
            "#include <math.h>",
            "#include <stdio.h>",
            "",
            *self._names(),
            *self._curves(),
            "typedef struct {",
            "    double largest, total, failed; /* residual, relative to the size and squared */",
            "    int iterations;",
            "} kf_newton;",
            "",
            *(line for source in self.unit_sources.values() for line in source),
            *(line for number, run in self.numbered() for line in rows_of(number, run, self.place)),
            *self._drive(),
            *self._bind(),
            *self._position(),
            *self._solving("velocity", 1),
            *self._solving("acceleration", 2),
            *self.readers,
            *self._fixed(),
            *self._entries("jacobian"),
            *self._entries("residuals"),
        ]
        return "\n".join(lines) + "\n"

    def _names(self) -> list[str]:
        plan = self.plan
        anchor_u, anchor_z = plan.anchor_values
        kinds = [driver.quantity.kind for driver in plan.drivers]
        scales = [1.0 if name.endswith(".phi") else plan.size for name in plan.unknowns]
        ends = list(accumulate(len(block.unknowns) for block in self.solved))
        return [
            *array("double kf_anchor_u", anchor_u),
            *array("double kf_anchor_z", anchor_z),
            *array("double kf_unknown_scales", scales),
            *array("double kf_reach", [1.0 if kind == "angle" else plan.size for kind in kinds]),
            *array("int kf_block_ends", ends),
            *array("int kf_block_rows", [len(block.residuals) for block in self.solved]),
            *array("double kf_row_scales", [scale for block in self.solved for scale in block.row_scales]),
            *array("double kf_parameters_written", [parameter.value for parameter in plan.parameters]),
            *array("double kf_constants_written", [constant.value for constant in plan.law_constants]),
            "",
            f"const char kf_name[] = {string(plan.mechanism.name)};",
            f"const char kf_length_unit[] = {string(plan.mechanism.length_unit)};",
            *_strings("kf_driver_names", [driver.name for driver in plan.drivers]),
            *array("bool kf_driver_is_angle", booleans(kind == "angle" for kind in kinds)),
            *_strings("kf_unknown_names", plan.unknowns),
            *array("bool kf_unknown_is_angle", booleans(name.endswith(".phi") for name in plan.unknowns)),
            *array("bool kf_output_is_angle", booleans(name.endswith(".phi") for name in plan.outputs)),
            *_strings("kf_watch_names", plan.watch_names),
            *_strings("kf_parameter_names", [parameter.name for parameter in plan.parameters]),
            *_strings("kf_block_row_names", [", ".join(block.row_names) for block in self.solved]),
            "",
        ]

    def _curves(self) -> list[str]:
        lines: list[str] = []
        for (breaks, pieces), reference in self.curves.items():
            name = reference.removeprefix("&")
            lines += array(f"static double {name}_breaks", breaks)
            rows = []
            for k, (origin, coefficients, amplitude, frequency, phase) in enumerate(pieces):
                lines += array(f"static double {name}_{k}", coefficients)
                numbers = f"{float(amplitude)!r}, {float(frequency)!r}, {float(phase)!r}"
                rows.append(f"    {{{float(origin)!r}, {len(coefficients)}, {name}_{k}, {numbers}}},")
            lines += [f"static const kf_piece {name}_pieces[{len(rows)}] = {{", *rows, "};"]
            lines += [f"static const kf_curve {name} = {{{len(pieces)}, {name}_breaks, {name}_pieces}};", ""]
        if self.curves:
            lines += [
                "static double curve(const kf_curve *data, int order, double x)",
                "{",
                "    return kf_curve_at(data, order, x);",
                "}",
                "",
            ]
        return lines

    def _function(
        self, signature: str, lines: Sequence[str], unused: Iterable[str] = (), variables: Iterable[str] = ()
    ) -> list[str]:
        return [
            signature,
            "{",
            *(f"    {line}" for line in [*declared(assigned(lines)), *variables]),
            *(f"    (void){name};" for name in unused),
            *(f"    {line}" for line in lines),
            "}",
            "",
        ]

    def _drive(self) -> list[str]:
        writer = Writer(Names(curves=self.curves, functions=FUNCTIONS), ())
        orders = [[getattr(law, order) for law in self.plan.laws] for order in ("position", "rate", "acceleration")]
        flat = [node for nodes in orders for node in nodes]
        body = [f"{line};" for line in writer.statements(flat)]
        results = []
        for name, nodes in zip(("u", "ud", "udd"), orders, strict=True):
            results += [f"{name}[{k}] = {writer.expression(node)};" for k, node in enumerate(nodes)]
        used = {node.name for node in writer.used if node.op == "symbol"}
        constants = [
            f"{identifier(constant.name)} = constants[{k}];"
            for k, constant in enumerate(self.plan.law_constants)
            if constant.name in used
        ]
        parameters = [
            f"{identifier(name)} = model->parameters[{k}];" for name, k in self.parameters.items() if name in used
        ]
        constants += parameters
        unused = [] if "time" in used else ["time"]
        unused += _unused([*constants, *body, *results], "model", "constants")
        signature = (
            "void kf_drive(const kf_model *model, double time, const double *constants, double *u, double *ud,"
            "\n              double *udd)"
        )
        return self._function(signature, [*constants, *body, *results], unused)

    def _bind(self) -> list[str]:
        """Parameters and what depends on them alone; why they cannot be had, if they cannot."""
        signature = "bool kf_bind(kf_model *model, const double *parameters, char *why, size_t room)"
        if not self.parameters:
            return self._function(signature, ["return true;"], ["model", "parameters", "why", "room"])
        writer = Writer(self.names, (), self.derived)
        known = [f"{line};" for line in writer.statements([*self.derived, *(c.node for c in self.plan.conditions)])]
        numbers = [writer.expression(node) for _, node, _ in self.plan.conditions if node not in self.derived]
        loads = [
            f"{identifier(name)} = parameters[{k}];"
            for name, k in self.parameters.items()
            if any(node.name == name for node in writer.used if node.op == "symbol")
        ]
        lines = [f"model->parameters[{k}] = parameters[{k}];" for k in self.parameters.values()]
        lines += [*loads, *known]
        lines += [f"model->derived[{k}] = {writer.expression(node)};" for k, node in enumerate(self.derived)]
        if self.derived:
            lines += ["for (k = 0; k < KF_DERIVED; ++k) {", "    total += fabs(model->derived[k]);", "}"]
        if self.derived or numbers:
            lines += [
                f"if (!({' + '.join(['total', *(f'fabs({number})' for number in numbers)])} < INFINITY)) {{",
                f'    snprintf(why, room, "{NO_NUMBER}");',
                "    return false;",
                "}",
            ]
        for name, node, meant in self.plan.conditions:
            number = writer.expression(node)
            told = string(f"{name.replace('%', '%%')} = %.15g must be {meant}")
            lines += [
                f"if (!({_HOLDS[meant].format(number)})) {{",
                f"    snprintf(why, room, {told}, {number});",
                "    return false;",
                "}",
            ]
        needed = self.derived or numbers
        variables = (
            ["double total = 0.0;", "int k;"] if self.derived else ["const double total = 0.0;"] if numbers else []
        )
        return self._function(signature, [*lines, "return true;"], [] if needed else ["why", "room"], variables)

    def _position(self) -> list[str]:
        lines = [
            "kf_newton newton = {0.0, 0.0, 0.0, 0};",
            "double predicted[KF_ROOM(KF_UNKNOWNS)];",
            "double watches[KF_ROOM(KF_WATCHES)], open = 0.0;",
            "double *const x = found->x;",
            "double *const hold = found->hold;",
            "int k;",
            "for (k = 0; k < KF_UNKNOWNS; ++k) {",
            "    predicted[k] = x[k] = z[k] + s * (zd[k] + 0.5 * s * zdd[k]);",
            "}",
            "for (k = 0; k < KF_DRIVERS; ++k) {",
            "    x[KF_COORDINATES - KF_DRIVERS + k] = u[k];",
            "}",
        ]
        for number, run in self.numbered():
            label, room = run.kind.label, self.units[run.kind.label].room()
            start = self.holds[number - 1]
            place = f"hold + {start} + k * {room}" if len(run.members) > 1 else f"hold + {start}"
            index = "k" if len(run.members) > 1 else "0"
            block = f"{run.first} + k" if len(run.members) > 1 else f"{run.first}"
            if run.kind.solved:
                call = [
                    f"if (!position{label}(model, &run_{number}[{index}], x, {place}, z, held && held[{block}],",
                    f"                &found->determinants[{block}], &newton)) {{",
                    "    found->residual = sqrt(newton.failed);",
                    f"    return {block};",
                    "}",
                ]
            else:
                call = [f"position{label}(model, &run_{number}[{index}], x, {place});"]
            lines += _repeated(call, len(run.members))
        factors = [1.0 / block.determinant_scale for block in self.solved]
        lines += [
            "found->margin = 1.0;",
            "for (k = 0; k < KF_BLOCKS; ++k) {",
            "    double size;",
            "    found->determinants[k] *= determinant_factors[k];",
            "    size = fabs(found->determinants[k]);",
            "    found->margin = k == 0 || size < found->margin ? size : found->margin;",
            "}",
            "found->residual = sqrt(newton.total < INFINITY ? newton.largest : newton.total);",
            "found->iterations = newton.iterations;",
            "found->moved = 0.0;",
            "for (k = 0; newton.iterations && k < KF_UNKNOWNS; ++k) {",
            "    const double moved = fabs(x[k] - predicted[k]) / kf_unknown_scales[k];",
            "    found->moved = moved > found->moved ? moved : found->moved;",
            "}",
            "kf_watches(model, found, watches);",
            "found->watch = 0.0;",
            "for (k = 0; k < KF_WATCHES; ++k) {",
            "    const double gap = fabs(watches[k]);",
            "    found->watch = found->watch > gap ? found->watch : gap;",
            "    open += gap; /* a NaN stays */",
            "}",
            "found->watch = open < INFINITY ? found->watch : open;",
            "return -1;",
        ]
        signature = (
            "inline int kf_position(const kf_model *model, const double *u, const double *z, const double *zd,"
            " const double *zdd,\n                double s, const bool *held, kf_found *found)"
        )
        unused = [] if self.solved else ["held"]
        return [
            *array("static double determinant_factors", factors),
            "",
            signature,
            "{",
            *(f"    {line}" for line in [*lines[:6], *(f"(void){name};" for name in unused), *lines[6:]]),
            "}",
            "",
        ]

    def _solving(self, name: str, order: int) -> list[str]:
        """kf_velocity or kf_acceleration."""
        out, driver = LISTS[order], "u" + "d" * order
        ready = " const double *x1," if order == 2 else ""
        signature = (
            f"inline void kf_{name}(const kf_model *model, const kf_found *found, const double *{driver},{ready}\n"
            f"    const double *given, const bool *held, double *{out})"
        )
        lines = ["const double *const x = found->x;", "const double *const hold = found->hold;", "int k;"]
        lines += [
            "for (k = 0; k < KF_DRIVERS; ++k) {",
            f"    {out}[KF_COORDINATES - KF_DRIVERS + k] = {driver}[k];",
            "}",
        ]
        for number, run in self.numbered():
            room, start, many = self.units[run.kind.label].room(), self.holds[number - 1], len(run.members) > 1
            arguments = [f"&run_{number}[{'k' if many else 0}]", "x", f"hold + {start}{f' + k * {room}' * many}"]
            if run.kind.solved:
                arguments += ["given", f"held && held[{run.first}{' + k' * many}]"]
            arguments += [*LISTS[1:order], out]
            lines += _repeated([f"{name}{run.kind.label}(model, {', '.join(arguments)});"], len(run.members))
        unused = [] if self.solved else ["given", "held"]
        return [signature, "{", *(f"    {line}" for line in [*lines[:3], *(f"(void){u};" for u in unused), *lines[3:]]),
                "}", ""]  # fmt: skip

    def _expressions(self, targets: Sequence[Node]) -> tuple[list[str], list[str]]:
        """Expressions of the targets, and the statements before them."""
        writer = Writer(self.names, [*self.derived, *self.taken])
        body = [f"{line};" for line in writer.statements(targets)]
        expressions = [writer.expression(node) for node in targets]
        return expressions, [*self._loads(writer), *body]

    def _loads(self, writer: Writer) -> list[str]:
        where = {name: f"{_SOURCES[order]}[{k}]" for order in range(3) for name, k in self.stands(order).items()}
        lines = []
        for node in writer.used:
            if node in self.derived:
                lines.append(f"{self.names.of(node)} = model->derived[{self.derived[node]}];")
            elif node in self.taken:
                number = self.taken[node]
                place = self.units[self.runs[number - 1].kind.label].handed_on(node)
                lines.append(f"{self.names.of(node)} = found->hold[<{number}:{place}>];")
            elif is_parameter(node):
                lines.append(f"{identifier(node.name)} = model->parameters[{self.parameters[node.name]}];")
            else:
                lines.append(f"{identifier(node.name)} = {where[node.name]};")
        return lines

    def _written(self, order: int) -> list[str]:
        """The function of the outputs of an order: some stand in a list, others are formulas.

        With one driver x1 and x2 are derivatives with respect to it, and so are the formulas:

            yd = y' ud,   ydd = y'' ud^2 + y' udd
        """
        parts = [self.outputs(of) for of in ((0,), (1,), (2, 1))[order][: 1 if len(self.plan.drivers) > 1 else None]]
        places = [place for _, place in parts[0]]
        rest = [k for k, place in enumerate(places) if place is None]
        expressions, lines = self._expressions([part[k][0] for part in parts for k in rest])
        factors = [] if len(self.plan.drivers) > 1 else [[], ["v"], ["(v * v)", "a"]][order]
        out = ("outputs", "rates", "accelerations")[order]
        table = array(f"int kf_{out}_places", [-1 if place is None else place for place in places])
        sources = (_SOURCES[order], "x1")
        copied = [f"{source}[kf_{out}_places[k]]" for source in sources[: len(parts)]]
        copying = [
            "for (k = 0; k < KF_OUTPUTS; ++k) {",
            f"    if (kf_{out}_places[k] >= 0) {{",
            f"        {out}[k] = {_weighted(copied, factors)};",
            "    }",
            "}",
        ]
        is_copied = len(rest) < len(places)
        lines += copying if is_copied else []
        for number, k in enumerate(rest):
            lines.append(f"{out}[{k}] = {_weighted(expressions[number :: len(rest)], factors)};")
        name = ("kf_outputs", "kf_output_rates", "kf_output_accelerations")[order]
        arguments = [[], ["x1"], ["x1", "x2"]][order], [[], ["v"], ["v", "a"]][order]
        listed = "".join(
            [*(f" const double *{one}," for one in arguments[0]), *(f" double {x}," for x in arguments[1])]
        )
        signature = f"inline void {name}(const kf_model *model, const kf_found *found,{listed}\n    double *{out})"
        unused = _unused(lines, "model", "found", *arguments[0], *arguments[1])
        return [*table, "", *self._function(signature, lines, unused, ["int k;"] if is_copied else ())]

    def _watches(self) -> list[str]:
        expressions, lines = self._expressions([node for _, node in self.plan.watches])
        lines += [f"watches[{k}] = {text};" for k, text in enumerate(expressions)]
        signature = "inline void kf_watches(const kf_model *model, const kf_found *found, double *watches)"
        return self._function(signature, lines, _unused(lines, "model", "found", "watches"))

    def _fixed(self) -> list[str]:
        expressions, lines = self._expressions(list(self.plan.fixed_nodes.values()))
        lines += [f"fixed[{k}] = {text};" for k, text in enumerate(expressions)]
        signature = "void kf_fixed(const kf_model *model, double *fixed)"
        return self._function(signature, lines, _unused(lines, "model", "fixed"))

    def _entries(self, name: str) -> list[str]:
        """kf_jacobian or kf_residuals: numbers of one block."""
        lines = ["const double *const x = found->x;", "const double *const hold = found->hold;"]
        calls = []
        for number, run in self.numbered():
            if run.kind.solved:
                room, start, count = self.units[run.kind.label].room(), self.holds[number - 1], len(run.members)
                k = f"block - {run.first}"
                places = f"&run_{number}[{k}], x, hold + {start} + ({k}) * {room}"
                calls += [
                    f"if (block < {run.first + count}) {{",
                    f"    {name}{run.kind.label}(model, {places}, {name});",
                    "    return;",
                    "}",
                ]
        signature = f"void kf_{name}(const kf_model *model, const kf_found *found, int block, double *{name})"
        if not calls:
            return self._function(signature, [], ["model", "found", "block", name])
        return [signature, "{", *(f"    {line}" for line in [*lines, *calls]), "}", ""]


_HOLDS = {"positive": "{} > 0.0", "other than 0": "{} != 0.0", "0": "fabs({}) <= 1e-9"}


_SOURCES = ("found->x", "x1", "x2")


def _weighted(values: Sequence[str], factors: Sequence[str]) -> str:
    """'(value) * factor + ...' of texts, or the value alone where there are no factors."""
    if not factors:
        return values[0]
    return " + ".join(f"{v} * {f}" if v.isidentifier() or v.endswith("]") else f"({v}) * {f}"
                      for v, f in zip(values, factors, strict=True))  # fmt: skip


def _unused(lines: Sequence[str], *arguments: str) -> list[str]:
    text = "\n".join(lines)
    return [name for name in arguments if not re.search(rf"\b{name}\b", text)]


def _strings(name: str, texts: Sequence[str]) -> list[str]:
    return array(f"char *const {name}", [string(text) for text in texts])


def _repeated(lines: Sequence[str], count: int) -> list[str]:
    """The lines, in a loop over k where there are several units."""
    if count == 1:
        return list(lines)
    return [f"for (k = 0; k < {count}; ++k) {{", *(f"    {line}" for line in lines), "}"]
