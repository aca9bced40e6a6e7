"""lanes.c: the formulas of a plan for many samples side by side, free of branches.

A unit's position is one loop over the lanes; its rates and accelerations are another, which is left out where they are
not wanted. In a window around a singular point some blocks are held: their positions and derivatives are given.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from kinfmu.codegen.c.functions import block_of, index
from kinfmu.codegen.c.stage_cache import StageCache
from kinfmu.codegen.c.text import Places, array, indented, loads, model_places, repeated
from kinfmu.codegen.c.units import rows_of
from kinfmu.codegen.lanes.lane_units import LISTED, VECTORS, LaneUnit, is_turned, through
from kinfmu.codegen.lists import LISTS, Kind, Lists
from kinfmu.codegen.newton import is_small
from kinfmu.codegen.writer import Names, Writer
from kinfmu.plan import SolvePlan
from kinfmu.plan.equations.graph import Node, reachable

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
