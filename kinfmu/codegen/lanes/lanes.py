"""lanes.c: the formulas of a plan for many samples side by side, free of branches; each function loops over the lanes.

A unit's position is one loop over the lanes; its rates and accelerations are another, which is left out where they are
not wanted. In a window around a singular point some blocks are held: their positions and derivatives are given.
Intermediate numbers stay in registers. Newton corrects a good prediction once; the sines and cosines of the unknowns
that come with it are rotated by the correction.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence
from pathlib import Path

from kinfmu.codegen.c.functions import block_of, index
from kinfmu.codegen.c.stage_cache import StageCache
from kinfmu.codegen.c.text import Places, array, assigned, declared, ended, indented, loads, model_places, repeated
from kinfmu.codegen.c.units import fields, places, row_type, rows_of
from kinfmu.codegen.lists import LISTS, Kind, Lists
from kinfmu.codegen.newton import (
    before_newton,
    determinant,
    is_small,
    jacobian_text,
    outright,
    outright_rates,
    right_side,
    solution,
    square,
)
from kinfmu.codegen.writer import Names, Writer, identifier
from kinfmu.plan import Block, SolvePlan
from kinfmu.plan.equations.graph import FUNCTIONS, Node, reachable

VECTORS = {"sin": "kf_sin_lane", "cos": "kf_cos_lane"}
LISTED = {"sin": "sine", "cos": "cosine"}  # lists of the predicted sines and cosines


class LaneUnit:
    """The functions of one kind of units.

        position(model, row, lanes, hold, factor)   Newton's correction, what it leaves, and what follows
        motion(model, row, lanes, hold)             rates and accelerations
        position_given, motion_given                the same for a block whose motion is given

    turned: names of the coordinates whose sines and cosines are predicted.
    """

    def __init__(self, kind: Kind, bound: Places, size: float, turned: set[str]) -> None:
        self.kind = kind
        self.derived = [node for node in bound if isinstance(node, Node)]
        self.size = size
        self.names = Names.of_blocks(kind.blocks, functions=VECTORS)
        self.positions = kind.positions
        self.predicted = {node for node in self.positions if is_turned(node, turned)}
        self.turning = [  # unknown angles with the nodes of sine and cosine; the formulas hold at least one of these
            (node.name, node.graph.function("sin", node), node.graph.function("cos", node))
            for node in self.positions
            if node.op == "symbol" and kind.solved and node.name in kind.solved.unknowns and node.name in turned
        ]
        self.turning = [turn for turn in self.turning if self.predicted & set(turn[1:])]
        self.predicted |= {node for turn in self.turning for node in turn[1:]}
        self.assigned = {motion[0]: name for block in kind.blocks for name, motion in block.assigned}
        self.where = places(kind)
        self.places: Places = {node: f"x_{self.where[name][1]}[i]" for node, name in self.assigned.items() if node.args}
        for node in self.predicted:
            self.places[node] = f"{LISTED[node.op]}_{self.where[node.args[0].name][1]}[i]"
        self.places |= bound
        self.places |= {name: f"row->{name}" for name in fields(kind)[1]}
        self.places |= {name: f"{LISTS[order]}_{field}[i]" for name, (order, field) in self.where.items()}
        self.hold: dict[Node | None, int] = {}  # None: the determinant of the block that is solved

    def cached(self, node: Node | None) -> int:
        """Return the place of a node among the numbers that a unit keeps for later functions; add it if it is new."""
        return self.hold.setdefault(node, len(self.hold))

    def cache_size(self) -> int:
        """Return how many numbers a unit keeps."""
        return len(self.hold)

    def source(self) -> list[str]:
        motion = self._motion("motion", held=False)  # before the position, which keeps what the motion reads
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
            if block.unknowns and held:
                r, closing = right_side(writer, "r", block.residuals, ())
                lines += [*closing, *self._left(r, block)]
            elif block.unknowns:
                lines += self._newton(writer, block)
            lines += outright(writer, block)
        corrected = self.kind.solved.unknowns if self.kind.solved is not None and not held else ()
        turning = self.turning if corrected else []
        for unknown, sine, cosine in turning:
            field = self.where[unknown][1]
            lines += [f"sine_{field}[i] = {self.names.of(sine)}", f"cosine_{field}[i] = {self.names.of(cosine)}"]
        found = (*corrected, *self.kind.assigned)
        lines += [f"x_{self.where[name][1]}[i] = {identifier(name)}" for name in found]
        held_nodes = {node: k for node, k in self.hold.items() if node is not None}
        lines += writer.statements(list(held_nodes))
        lines += [f"hold[{k}][i] = {writer.expression(node)}" for node, k in held_nodes.items()]
        used = dict.fromkeys([*(node for turn in turning for node in turn[1:]), *writer.used])
        predicted = [f"{identifier(name)} = z_{self.where[name][1]}[i]" for name in corrected]
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
                lines += outright_rates(writer, block, order)
        names = self.kind.assigned if held else self.kind.coordinates
        rates = [(name.derivative(order), order, self.where[name][1]) for name in names for order in (1, 2)]
        lines += [f"{LISTS[order]}_{field}[i] = {identifier(name)}" for name, order, field in rates]
        return self._function(stage, "", [*self._loads(writer.used, {name for name, _, _ in rates}), *lines])

    def _loads(self, nodes: Iterable[Node], found: Collection[str]) -> list[str]:
        """Return assignments of what the statements read and do not compute."""
        read = (node for node in nodes if node.op != "symbol" or node.name not in found)
        return loads(self.names, read, self.places, lambda node: f"hold[{self.cached(node)}][i]")

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
            *through(lines),
            "}",
            "",
        ]

    def _newton(self, writer: Writer, block: Block) -> list[str]:
        """Return statements of one correction of the prediction and of the residual after it."""
        turned = [node for turn in self.turning for node in turn[1:]]
        lines = before_newton(writer, block, turned)
        known = set(writer.known)
        steps = [f"d{k}" for k in range(len(block.unknowns))]
        r, evaluated = right_side(writer, "r", block.residuals, block.entries)
        jacobian = jacobian_text(writer, block)
        values = solution(jacobian, r, "* per_det")
        lines += [*evaluated, f"per_det = 1.0 / ({determinant(jacobian)})"]
        lines += [f"{one} = {text}" for one, text in zip(steps, values, strict=True)]
        for name, one in zip(block.unknowns, steps, strict=True):
            scale = "" if name.is_angle else f" * {1.0 / self.size!r}"
            lines += [f"{identifier(name)} -= {one}", f"size = fabs({one}){scale}"]
            lines.append("lanes->moved[i] = size > lanes->moved[i] ? size : lanes->moved[i]")
            for unknown, sine, cosine in self.turning:
                if unknown == name:
                    lines.append(f"kf_rotate(-{one}, &{self.names.of(sine)}, &{self.names.of(cosine)})")
        writer.known = set(known)
        r, evaluated = right_side(writer, "r", block.residuals, block.entries)
        jacobian = jacobian_text(writer, block)
        return [
            *lines,
            *evaluated,
            f"det = {determinant(jacobian)}",
            f"hold[{self.cached(None)}][i] = det",
            "size = fabs(det * factor)",
            "lanes->margin[i] = size < lanes->margin[i] ? size : lanes->margin[i]",
            *self._left(r, block),
        ]

    def _left(self, r: Sequence[str], block: Block) -> list[str]:
        """Return statements that add the residuals of a block to those of all blocks."""
        return [
            f"size = {square(r, block.row_scales)}",
            "lanes->error[i] = size > lanes->error[i] || size != size ? size : lanes->error[i]; /* a NaN stays */",
        ]

    def _linear(self, writer: Writer, block: Block, order: int) -> list[str]:
        """Return the linear solve of a block for its rates (order 1) or, after them, its accelerations (2)."""
        right = (block.velocity, block.acceleration)[order - 1]
        many = len(block.unknowns) > 1  # the determinant of one unknown is its Jacobian
        entries = block.entries if many else ()
        b, lines = right_side(writer, "b", right, entries)
        if order == 1:
            lines.append(f"per_det = 1.0 / hold[{self.cached(None)}][i]")
        z = [identifier(name.derivative(order)) for name in block.unknowns]
        jacobian = [[writer.expression(entry) if many else "" for entry in row] for row in block.jacobian]
        values = solution(jacobian, b, "* per_det", is_opposite=True)
        return lines + [f"{one} = {text}" for one, text in zip(z, values, strict=True)]


def is_turned(node: Node, angles: Collection[str]) -> bool:
    """Return True for the sine or cosine of one of these angles."""
    return node.op in LISTED and node.args[0].op == "symbol" and node.args[0].name in angles


def through(lines: Sequence[str]) -> list[str]:
    """Return the statements in a loop over the lanes; what is the same in all lanes is read before it.

    Stores might change it as far as compilers know, and some of them (GCC 12) then leave the loop without vectors.
    """
    if not lines:
        return ["    (void)i;"]
    lines = ended(lines)
    equal = [line for line in lines if re.fullmatch(r"\w+ = model->[\w\[\]]+;", line)]
    lines = [line for line in lines if line not in equal]
    return [
        *(f"    const double {line}" for line in equal),
        "    KF_SIDE_BY_SIDE",
        "    for (i = 0; i < KF_LANES; ++i) {",
        *(f"        {line}" for line in [*declared(assigned(lines)), *lines]),
        "    }",
    ]


_BRANCHING = ("curve", "atan2", "floor")


def has_lanes(plan: SolvePlan) -> bool:
    """Return True if lanes can solve a plan: one driver, blocks of one or two unknowns, no piecewise functions."""
    solved = (block for block in plan.blocks if block.unknowns)
    rows = [node for block in plan.blocks for node in (*block.residuals, *(m[0] for _, m in block.assigned))]
    plain = not any(node.op in _BRANCHING for node in reachable(rows))
    return len(plan.drivers) == 1 and plain and all(is_small(block) for block in solved)


def sources(plan: SolvePlan) -> dict[str, str]:
    """Return the texts of this package's C files, and of those generated from the plan, by name."""
    fixed = sorted(path for path in Path(__file__).parent.iterdir() if path.suffix in (".c", ".h"))
    return {path.name: path.read_text("utf-8") for path in fixed} | emit_lanes(plan)


def emit_lanes(plan: SolvePlan) -> dict[str, str]:
    """Return the texts of lane_sizes.h and, if the plan has lanes, of lanes.c, by file name."""
    if not has_lanes(plan):
        return {"lane_sizes.h": _sizes(0, 0, 0)}
    lanes = _Lanes(plan)
    return {"lane_sizes.h": _sizes(1, len(lanes.stage_cache), int(repeats(plan))), "lanes.c": lanes.source()}


def _sizes(has: int, hold: int, is_repeated: int) -> str:
    return f"#define KF_HAS_LANES {has}\n#define KF_LANE_HOLD {hold}\n#define KF_REPEATS {is_repeated}\n"


class _Lanes(Lists):
    def __init__(self, plan: SolvePlan) -> None:
        super().__init__(plan)
        self.names = Names((name for block in plan.blocks for name in block.coordinates), functions=VECTORS)
        self.angles = self._angles()
        self.bound = model_places(self)
        self.units = {
            label: LaneUnit(kind, self.bound, plan.size, self._turned(kind)) for label, kind in self.kinds.items()
        }
        self.stage_cache = StageCache(self, self.units)
        readers = [self._formulas(k) for k in range(3)] + [self._watches()]  # first: they fill the stage cache
        units = [line for unit in self.units.values() for line in unit.source()]
        self.functions = [*units, *(line for k, run in self.numbered() for line in rows_of(k, run, self.place))]
        self.functions += self.stage_cache.placed(line for lines in readers for line in lines)

    def _angles(self) -> dict[str, int]:
        """Return the coordinates whose sines and cosines are predicted, with their places among these.

        These are the unknown angles, then the driver's angle and all angles equal to it.
        """
        angles: dict[str, int] = {name: k for k, name in enumerate(self.plan.unknowns) if name.is_angle}
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
        """Return the coordinates of a kind whose sines and cosines are predicted in all its units."""
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
            *indented(self._calls("position")),
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
            *indented(self._calls("motion")),
            "    rates(model, lanes);",
            "    accelerations(model, lanes);",
            "}",
            "",
        ]

    def _calls(self, stage: str) -> list[str]:
        """Return the calls of a stage's functions, unit after unit."""
        lines = []
        for number, run in self.numbered():
            label, k = run.kind.label, index(run)
            arguments = f"model, &run_{number}[{k}], lanes, lanes->hold + {self.stage_cache.start(number, k)}"
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
        """Return a function that loops over the lanes."""
        listed: Places = {name: f"lanes->{LISTS[k]}[{at}][i]" for k in range(3) for name, at in self.places(k).items()}

        def held(node: Node) -> str:
            if is_turned(node, self.angles):
                return f"lanes->{LISTED[node.op]}[{self.place[node.args[0].name]}][i]"
            return f"lanes->hold[{self.stage_cache.place(node)}][i]"

        read = loads(self.names, writer.used, self.bound | listed, held)
        return [
            f"static inline void {name}(const kf_model *model, kf_lanes *lanes)",
            "{",
            "    int i;",
            "    (void)model;",
            "    (void)lanes;",
            *through([*read, *lines] if lines else ()),
            "}",
            "",
        ]

    def _formulas(self, order: int) -> list[str]:
        """Return the function of the outputs that are formulas; the others are read from the lists of coordinates."""
        targets = [(k, node) for k, (node, place) in enumerate(self.outputs(order)) if place is None]
        lines, writer = self._statements([node for _, node in targets])
        lines += [f"lanes->outputs[{order}][{k}][i] = {writer.expression(node)};" for k, node in targets]
        return self._loop(("outputs", "rates", "accelerations")[order], lines, writer)

    def _watches(self) -> list[str]:
        targets = [node for _, node in self.plan.watches]
        lines, writer = self._statements(targets)
        lines += [f"lanes->watches[{k}][i] = {writer.expression(node)};" for k, node in enumerate(targets)]
        return self._loop("watches", lines, writer)

    def _statements(self, targets: Sequence[Node]) -> tuple[list[str], Writer]:
        """Return statements for the targets; what the units compute and what is predicted is known."""
        turned = [node for node in reachable(targets) if is_turned(node, self.angles)]
        writer = Writer(self.names, [*self.derived, *self.stage_cache.nodes, *turned])
        return writer.statements(targets), writer


def repeats(plan: SolvePlan) -> bool:
    """Return True if a whole turn of any angle changes nothing.

    That holds if angles occur in sines and cosines only, or are equal to other angles up to a constant. A plan with a
    gear or a coupling of angles does not repeat: its poses depend on the number of turns.
    """
    angles: set[str] = {name for block in plan.blocks for name in block.coordinates if name.is_angle}
    angles |= {driver.inputs[0] for driver in plan.drivers if driver.quantity.kind == "angle"}

    def is_turned(node: Node) -> bool:
        """Return True for an angle to which at most constants are added."""
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
