"""lanes.c: the formulas of a plan for many samples side by side, free of branches.

A unit's position is one loop over the lanes, so that intermediate numbers stay in registers; its rates and
accelerations are another, which is left out where nobody asks for them. Newton corrects a good prediction once. Sines
and cosines of the driver's angle and of the unknowns come with the prediction, and the correction rotates them. In a
window around a singular point the blocks that are held take position and derivatives as they are given.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence

from kinfmu.backends.alike import Kind, positions
from kinfmu.backends.c.handed_on import HandedOn
from kinfmu.backends.c.stages import block_of, index
from kinfmu.backends.c.text import array, assigned, declared, repeated
from kinfmu.backends.c.units import places, row_type, rows_of
from kinfmu.backends.lists import LISTS, Lists
from kinfmu.backends.newton import determinant, is_small, opposite_solution, solution, square
from kinfmu.backends.writer import Names, Writer, identifier
from kinfmu.equations.graph import FUNCTIONS, Node, reachable
from kinfmu.naming import derivative_name
from kinfmu.plan import Block, SolvePlan
from kinfmu.plan.trace import is_parameter

_VECTORS = {"sin": "kf_sin_lane", "cos": "kf_cos_lane"}
_LISTED = {"sin": "sine", "cos": "cosine"}  # lists of what comes with the prediction
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
        return {"lane_sizes.h": _sizes(0, 0, 0)}
    lanes = _Lanes(plan)
    return {"lane_sizes.h": _sizes(1, len(lanes.handed_on), int(_repeats(plan))), "lanes.c": lanes.source()}


def _sizes(has: int, hold: int, repeats: int) -> str:
    return f"#define KF_HAS_LANES {has}\n#define KF_LANE_HOLD {hold}\n#define KF_REPEATS {repeats}\n"


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
        self.angles = self._angles()
        self.units = {
            label: _LaneUnit(kind, self.parameters, self.derived, plan.size, self._turned(kind))
            for label, kind in self.kinds.items()
        }
        self.handed_on = HandedOn(self, self.units)
        readers = [self._formulas(k) for k in range(3)] + [self._watches()]  # they say what is handed on
        units = [line for unit in self.units.values() for line in unit.source()]
        self.functions = [*units, *(line for k, run in self.numbered() for line in rows_of(k, run, self.place))]
        self.functions += self.handed_on.placed(line for lines in readers for line in lines)

    def _angles(self) -> dict[str, int]:
        """Coordinates whose sine and cosine come with the prediction, with their place there: unknown angles, then the
        driver's angle and what is equal to it.
        """
        angles = {name: k for k, name in enumerate(self.plan.unknowns) if name.endswith(".phi")}
        (driver,) = self.plan.drivers
        if driver.quantity.kind == "angle":
            last = len(self.plan.unknowns)
            angles[driver.inputs[0]] = last
            for block in self.plan.blocks:
                for name, motion in block.assigned:
                    if motion[0].op == "symbol" and angles.get(motion[0].name) == last:
                        angles[name] = last
        return angles

    def _turned(self, kind: Kind) -> set[str]:
        """Names in a kind of coordinates whose sine and cosine come with the prediction, in all units of the kind."""
        members = [member for run in self.runs if run.kind is kind for member in run.members]
        own = {
            name for k, name in enumerate(kind.coordinates) if all(member.own[k] in self.angles for member in members)
        }
        given = {
            names[0] for k, names in enumerate(kind.given) if all(member.given[k] in self.angles for member in members)
        }
        return own | given

    def source(self) -> str:
        return "\n".join(
            [
                f"/* Kinematics of {self.plan.mechanism.name}, side by side: generated from its mechanism. */",
                '#include "lanes.h"',
                "",
                "#include <math.h>",
                "",
                *array("int kf_lane_angles", [self.angles.get(name, -1) for name in self.order]),
                "",
                *self.functions,
                *self._position(),
                *self._motion(),
            ]
        )

    def _position(self) -> list[str]:
        return [
            "void kf_lanes_position(const kf_model *model, kf_lanes *lanes, const bool *held)",
            "{",
            "    int i, k;",
            "    for (i = 0; i < KF_LANES; ++i) {",
            "        lanes->error[i] = 0.0;",
            "        lanes->margin[i] = 1.0;",
            "        lanes->moved[i] = 0.0;",
            "    }",
            "    (void)k;",
            "    (void)held;",
            *(f"    {line}" for line in self._calls("position")),
            "    outputs(model, lanes);",
            "    watches(model, lanes);",
            "}",
            "",
        ]

    def _motion(self) -> list[str]:
        return [
            "void kf_lanes_motion(const kf_model *model, kf_lanes *lanes, const bool *held)",
            "{",
            "    int k;",
            "    (void)k;",
            "    (void)held;",
            *(f"    {line}" for line in self._calls("motion")),
            "    rates(model, lanes);",
            "    accelerations(model, lanes);",
            "}",
            "",
        ]

    def _calls(self, stage: str) -> list[str]:
        """Calls of all units' functions of a stage, one after another."""
        lines = []
        for number, run in self.numbered():
            label, k = run.kind.label, index(run)
            arguments = f"model, &run_{number}[{k}], lanes, lanes->hold + {self.handed_on.start(number, k)}"
            if run.kind.solved:
                block = block_of(run)
                factor = f", kf_determinant_factors[{block}]" if stage == "position" else ""
                calls = [
                    f"if (held != NULL && held[{block}]) {{",
                    f"    {stage}_given{label}({arguments});",
                    "} else {",
                    f"    {stage}{label}({arguments}{factor});",
                    "}",
                ]
            else:
                calls = [f"{stage}{label}({arguments});"]
            lines += repeated(len(run.members), calls)
        return lines

    def _loop(self, name: str, lines: Sequence[str], writer: Writer) -> list[str]:
        """A function that goes through the lanes."""
        where = {name: f"{LISTS[k]}[{at}]" for k in range(3) for name, at in self.stands(k).items()}
        loads = []
        for node in writer.used:
            if node in self.derived:
                source = f"model->derived[{self.derived[node]}]"
            elif _is_turned(node, self.angles):
                source = f"lanes->{_LISTED[node.op]}[{self.place[node.args[0].name]}][i]"
            elif node in self.handed_on.nodes:
                source = f"lanes->hold[{self.handed_on.place(node)}][i]"
            elif is_parameter(node):
                source = f"model->parameters[{self.parameters[node.name]}]"
            else:
                source = f"lanes->{where[node.name]}[i]"
            loads.append(f"{self.names.of(node)} = {source};")
        return [
            f"static inline void {name}(const kf_model *model, kf_lanes *lanes)",
            "{",
            "    int i;",
            "    (void)model;",
            "    (void)lanes;",
            *_through([*loads, *lines] if lines else ()),
            "}",
            "",
        ]

    def _formulas(self, order: int) -> list[str]:
        """The outputs that are formulas; those that are coordinates are taken from where they stand."""
        targets = [(k, node) for k, (node, place) in enumerate(self.outputs(order)) if place is None]
        lines, writer = self._written([node for _, node in targets])
        lines += [f"lanes->outputs[{order}][{k}][i] = {writer.expression(node)};" for k, node in targets]
        return self._loop(("outputs", "rates", "accelerations")[order], lines, writer)

    def _watches(self) -> list[str]:
        targets = [node for _, node in self.plan.watches]
        lines, writer = self._written(targets)
        lines += [f"lanes->watches[{k}][i] = {writer.expression(node)};" for k, node in enumerate(targets)]
        return self._loop("watches", lines, writer)

    def _written(self, targets: Sequence[Node]) -> tuple[list[str], Writer]:
        """Statements for targets, given what the units compute and what comes with the prediction."""
        turned = [node for node in reachable(targets) if _is_turned(node, self.angles)]
        writer = Writer(self.names, [*self.derived, *self.handed_on.nodes, *turned])
        return [f"{line};" for line in writer.statements(targets)], writer


class _LaneUnit:
    """The functions of one kind of units.

        position(model, row, lanes, hold, factor)   Newton's correction, what it leaves, and what follows
        motion(model, row, lanes, hold)             rates and accelerations
        position_given, motion_given                the same of a block that is held

    turned: names of coordinates whose sine and cosine come with the prediction.
    """

    def __init__(
        self, kind: Kind, parameters: dict[str, int], derived: dict[Node, int], size: float, turned: set[str]
    ) -> None:
        self.kind = kind
        self.parameters = parameters
        self.derived = derived
        self.size = size
        self.names = Names(kind.coordinates, functions=_VECTORS)
        for block in kind.blocks:
            for name, motion in block.assigned:
                self.names.assign(motion[0], name)
        self.positions = reachable([node for group in positions(kind.blocks) for node in group])
        self.predicted = {node for node in self.positions if _is_turned(node, turned)}
        self.turning = [  # unknown angles with the nodes of sine and cosine, of which the formulas hold one at least
            (node.name, node.graph.function("sin", node), node.graph.function("cos", node))
            for node in self.positions
            if node.op == "symbol" and kind.solved and node.name in kind.solved.unknowns and node.name in turned
        ]
        self.turning = [turn for turn in self.turning if self.predicted & set(turn[1:])]
        self.predicted |= {node for turn in self.turning for node in turn[1:]}
        self.assigned = {motion[0]: name for block in kind.blocks for name, motion in block.assigned}
        self.where = places(kind)
        self.hold: dict[Node | None, int] = {}  # None: the determinant of the block that is solved

    def handed_on(self, node: Node | None) -> int:
        """Place of a node among the numbers that later functions take from here, from now on if not before."""
        return self.hold.setdefault(node, len(self.hold))

    def room(self) -> int:
        """How many numbers a unit hands on."""
        return len(self.hold)

    def source(self) -> list[str]:
        motion = self._motion("motion", held=False)  # says what is handed on
        if self.kind.solved is None:
            return [*row_type(self.kind), "", *self._position("position", held=False), *motion]
        return [
            *row_type(self.kind),
            "",
            *self._position("position", held=False),
            *self._position("position_given", held=True),
            *motion,
            *self._motion("motion_given", held=True),
        ]

    def _position(self, stage: str, *, held: bool) -> list[str]:
        writer = Writer(self.names, [*self.derived, *self.predicted])
        lines: list[str] = []
        for block in self.kind.blocks:
            if block.unknowns:
                lines += self._closing(writer, block) if held else self._newton(writer, block)
            lines += self._given_outright(writer, block)
        corrected = self.kind.solved.unknowns if self.kind.solved is not None and not held else ()
        turning = self.turning if corrected else []
        for unknown, sine, cosine in turning:
            field = self.where[unknown][1]
            lines += [f"sine_{field}[i] = {self.names.of(sine)};", f"cosine_{field}[i] = {self.names.of(cosine)};"]
        found = [*corrected, *(name for block in self.kind.blocks for name, _ in block.assigned)]
        lines += [f"x_{self.where[name][1]}[i] = {identifier(name)};" for name in found]
        handed_on = {node: k for node, k in self.hold.items() if node is not None}
        lines += [f"{line};" for line in writer.statements(list(handed_on))]
        lines += [f"hold[{k}][i] = {writer.expression(node)};" for node, k in handed_on.items()]
        used = dict.fromkeys([*(node for turn in turning for node in turn[1:]), *writer.used])
        predicted = [f"{identifier(name)} = z_{self.where[name][1]}[i];" for name in corrected]
        factor = " const double factor" if corrected else ""
        return self._function(stage, factor, [*predicted, *self._loads(used, found), *lines])

    def _motion(self, stage: str, *, held: bool) -> list[str]:
        costly = [node for node in self.positions if node.op in FUNCTIONS or node.op == "/"]
        writer = Writer(self.names, [*self.derived, *self.predicted, *self.assigned, *costly])
        lines: list[str] = []
        for order in (1, 2):
            for block in self.kind.blocks:
                if block.unknowns:
                    lines += [] if held else self._linear(writer, block, order)
                for name, nodes in block.assigned:
                    lines += [f"{line};" for line in writer.statements([nodes[order]])]
                    lines.append(f"{identifier(derivative_name(name, order))} = {writer.expression(nodes[order])};")
        names = [name for block in self.kind.blocks for name, _ in block.assigned]
        names = names if held else list(self.kind.coordinates)
        rates = [(derivative_name(name, order), order, self.where[name][1]) for name in names for order in (1, 2)]
        lines += [f"{LISTS[order]}_{field}[i] = {identifier(name)};" for name, order, field in rates]
        return self._function(stage, "", [*self._loads(writer.used, {name for name, _, _ in rates}), *lines])

    def _loads(self, nodes: Iterable[Node], found: Collection[str]) -> list[str]:
        """Assignments of what statements use and have not found themselves."""
        lines = []
        for node in nodes:
            if node in self.derived:
                source = f"model->derived[{self.derived[node]}]"
            elif node in self.predicted:
                source = f"{_LISTED[node.op]}_{self.where[node.args[0].name][1]}[i]"
            elif node.op != "symbol" and node in self.assigned:
                source = f"x_{self.where[self.assigned[node]][1]}[i]"
            elif node.op != "symbol":
                source = f"hold[{self.handed_on(node)}][i]"
            elif node.name in found:
                continue
            elif is_parameter(node):
                source = f"model->parameters[{self.parameters[node.name]}]"
            elif node.name in self.where:
                order, field = self.where[node.name]
                source = f"{LISTS[order]}_{field}[i]"
            else:
                source = f"row->{node.name}"
            lines.append(f"{self.names.of(node)} = {source};")
        return lines

    def _function(self, stage: str, factor: str, lines: Sequence[str]) -> list[str]:
        text = "\n".join(lines)
        used = sorted(set(re.findall(r"\b(x[12]?|z|sine|cosine)_([gk]\d+)\[i\]", text)))
        head = f"static inline void {stage}{self.kind.label}(const kf_model *model, const row{self.kind.label} *row,"
        return [
            head,
            f"    kf_lanes *lanes, double (*hold)[KF_LANES]{',' * bool(factor)}{factor})",
            "{",
            *(f"    double *const {name}_{field} = lanes->{name}[row->{field}];" for name, field in used),
            "    int i;",
            "    (void)model;",
            "    (void)row;",
            "    (void)lanes;",
            "    (void)hold;",
            *_through(lines),
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
        """A correction of the prediction, and the residual that it leaves."""
        entries = [entry for row in block.jacobian for entry in row]
        unknowns = [
            node
            for node in reachable([*block.residuals, *entries])
            if node.op == "symbol" and node.name in block.unknowns
        ]
        looped = [*(motion[0] for _, motion in block.assigned), *block.residuals, *entries]
        moving = [*unknowns, *(node for turn in self.turning for node in turn[1:])]
        lines = [f"{line};" for line in writer.statements(writer.independent(looped, moving))]
        known = set(writer.known)
        steps = [f"d{k}" for k in range(len(block.unknowns))]
        r, evaluated = self._residuals(writer, block, entries)
        jacobian = [[writer.expression(entry) for entry in row] for row in block.jacobian]
        values = [text.replace(" / det", " * per_det") for text in solution(jacobian, r, "det")]
        lines += [*evaluated, f"per_det = 1.0 / ({determinant(jacobian)});"]
        lines += [f"{one} = {text};" for one, text in zip(steps, values, strict=True)]
        for name, one in zip(block.unknowns, steps, strict=True):
            scale = "" if name.endswith(".phi") else f" * {1.0 / self.size!r}"
            lines += [f"{identifier(name)} -= {one};", f"size = fabs({one}){scale};"]
            lines.append("lanes->moved[i] = size > lanes->moved[i] ? size : lanes->moved[i];")
            for unknown, sine, cosine in self.turning:
                if unknown == name:
                    lines.append(f"kf_rotate(-{one}, &{self.names.of(sine)}, &{self.names.of(cosine)});")
        writer.known = set(known)
        r, evaluated = self._residuals(writer, block, entries)
        jacobian = [[writer.expression(entry) for entry in row] for row in block.jacobian]
        return [
            *lines,
            *evaluated,
            f"det = {determinant(jacobian)};",
            f"hold[{self.handed_on(None)}][i] = det;",
            "size = fabs(det * factor);",
            "lanes->margin[i] = size < lanes->margin[i] ? size : lanes->margin[i];",
            *self._left(r, block),
        ]

    def _closing(self, writer: Writer, block: Block) -> list[str]:
        """The residual of unknowns that are given."""
        r, evaluated = self._residuals(writer, block, ())
        return [*evaluated, *self._left(r, block)]

    def _residuals(self, writer: Writer, block: Block, entries: Sequence[Node]) -> tuple[list[str], list[str]]:
        """Names of the residuals, and the statements that compute them and what entries of the Jacobian need."""
        r = [f"r{k}" for k in range(len(block.residuals))]
        lines = [f"{line};" for line in writer.statements([*block.residuals, *entries])]
        lines += [f"{one} = {writer.expression(node)};" for one, node in zip(r, block.residuals, strict=True)]
        return r, lines

    def _left(self, r: Sequence[str], block: Block) -> list[str]:
        """What residuals count among those of all blocks."""
        return [
            f"size = {square(r, block.row_scales)};",
            "lanes->error[i] = size > lanes->error[i] || size != size ? size : lanes->error[i]; /* a NaN stays */",
        ]

    def _linear(self, writer: Writer, block: Block, order: int) -> list[str]:
        right = (block.velocity, block.acceleration)[order - 1]
        many = len(block.unknowns) > 1  # the determinant of one unknown is its Jacobian
        entries = [entry for row in block.jacobian for entry in row if many]
        lines = [f"{line};" for line in writer.statements([*right, *entries])]
        b = [f"b{k}" for k in range(len(right))]
        lines += [f"{one} = {writer.expression(node)};" for one, node in zip(b, right, strict=True)]
        if order == 1:
            self.jacobian = [[writer.expression(entry) if many else "" for entry in row] for row in block.jacobian]
            lines.append(f"per_det = 1.0 / hold[{self.handed_on(None)}][i];")
        z = [identifier(derivative_name(name, order)) for name in block.unknowns]
        values = opposite_solution(self.jacobian, b, "* per_det")
        return lines + [f"{one} = {text};" for one, text in zip(z, values, strict=True)]


def _is_turned(node: Node, angles: Collection[str]) -> bool:
    """True for the sine or cosine of one of these angles."""
    return node.op in _LISTED and node.args[0].op == "symbol" and node.args[0].name in angles


def _through(lines: Sequence[str]) -> list[str]:
    """Statements for each lane."""
    if not lines:
        return ["    (void)i;"]
    return [
        "    KF_SIDE_BY_SIDE",
        "    for (i = 0; i < KF_LANES; ++i) {",
        *(f"        {line}" for line in [*declared(assigned(lines)), *lines]),
        "    }",
    ]
