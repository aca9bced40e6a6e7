"""The functions of a kind of units for many samples side by side; each is a loop over the lanes.

Intermediate numbers stay in registers. Newton corrects a good prediction once; the sines and cosines of the unknowns
that come with it are rotated by the correction.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence

from kinfmu.codegen.c.text import Places, assigned, declared, ended, loads
from kinfmu.codegen.c.units import fields, places, row_type
from kinfmu.codegen.lists import LISTS, Kind
from kinfmu.codegen.newton import (
    before_newton,
    determinant,
    jacobian_text,
    opposite_solution,
    outright,
    outright_rates,
    right_side,
    solution,
    square,
)
from kinfmu.codegen.writer import Names, Writer, identifier
from kinfmu.plan import Block
from kinfmu.plan.equations.graph import FUNCTIONS, Node

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
        values = [text.replace(" / det", " * per_det") for text in solution(jacobian, r, "det")]
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
        values = opposite_solution(jacobian, b, "* per_det")
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
