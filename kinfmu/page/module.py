"""A mechanism as a WebAssembly module: the compiled solver of all mechanisms with the model of one.

`solver/` has what was compiled together with kinfmu/solver/c, and the result, solver.wasm: there sizes are variables,
and what a model defines has a place. The model's C is translated into these places. The module does the same
arithmetic as the native engine and the native FMU, operation by operation: numbers are equal to the bit. It holds
one instance of the mechanism; web/engine.js calls it.
"""

from __future__ import annotations

import base64
import gzip
import re
import struct
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

from kinfmu.analysis import Report
from kinfmu.codegen.c import compiler, emit
from kinfmu.codegen.c.text import FUNCTIONS, array, booleans, function, string
from kinfmu.codegen.forces import emit_c_forces
from kinfmu.codegen.wasm import Binary, Translator
from kinfmu.codegen.writer import Names, Writer, identifier
from kinfmu.errors import KinfmuError, TooLargeError
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.force_names import reaction_names_of, shaking_names
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.plan.efforts import load_inputs
from kinfmu.plan.forces import ForceSteps, force_names, force_steps
from kinfmu.plan.reactions import reaction_steps, shaking_steps
from kinfmu.plan.trace import Tracer, parameter_symbol
from kinfmu.plan.undetermined import undetermined_reactions

EXPORTS = (
    "kf_page_start",
    "kf_page_place",
    "kf_page_length",
    "kf_page_message",
    "kf_page_bind",
    "kf_page_gap",
    "kf_page_drive",
    "kf_page_restart",
    "kf_page_at",
    "kf_page_margin",
    "kf_page_errors",
    "kf_page_forces",
    "kf_page_reactions",
    "kf_page_sweep",
    "kf_page_sample",
)
SOURCES = Path(__file__).with_name("solver")  # with the compiled module, solver.wasm, which scripts/solver makes
_SIZES = {
    "HOLD": "numbers that rates read",
    "LARGEST_BLOCK": "entries in a Jacobian",
    "OF_JOINTS": "reactions of joints",
}


class PageModule(NamedTuple):
    """A mechanism compiled for pages and what its arrays hold.

    Attributes:
        binary: The WebAssembly module.
        plan: What it solves: all bodies' coordinates that move, then the points of interest.
        points: The points 'body.point' whose places in their bodies it returns.
        parameters: Names of what it can bind, in its order: parameters, or their labels, then constants of the laws.
        forces: Names of its forces; none without masses and loads.
        reactions: Names of the reactions of joints, without those that are undetermined, then of
            shaking force and moment; none without masses and loads.

    """

    binary: Binary
    plan: SolvePlan
    points: tuple[str, ...]
    parameters: tuple[str, ...]
    forces: tuple[str, ...]
    reactions: tuple[str, ...]

    @property
    def loads(self) -> tuple[str, ...]:
        """Inputs with the efforts of external loads, in the order of the module."""
        return load_inputs(self.plan)

    @property
    def text(self) -> str:
        """What a page makes the module from, with the text of `solver`."""
        return packed(self.binary.difference(EXPORTS))


@cache
def solver() -> str:
    """Return the solver of all mechanisms for a page."""
    return packed(_solver())


@cache
def _solver() -> bytes:
    return (SOURCES / "solver.wasm").read_bytes()


def packed(data: bytes) -> str:
    """Return data for a page: compressed by gzip, in base64."""
    return base64.b64encode(gzip.compress(data, 9, mtime=0)).decode()


def page_module(
    mechanism: Mechanism, labels: Mapping[str, str] | None = None, report: Report | None = None
) -> PageModule:
    """Return the module of a mechanism: the compiled solver with its model, which needs no compiler.

    Args:
        mechanism: The mechanism.
        labels: Names of parameters for messages and `PageModule.parameters`, such as `Opened.labels`. Default: none.
        report: Of the mechanism, or of the one that `opened` has changed: what it has found is not found again.
            Default: none.

    Raises:
        KinfmuError: The mechanism cannot be solved, as `compile_plan` reports it.
        TooLargeError: It is larger than `solver/page_sizes.h` and `solver/instance.h` allow.

    """
    labels = labels or {}
    names = force_names(mechanism)
    plan = _planned(mechanism, report)
    points = tuple(mechanism.body_points)
    reactions = _reaction_stages(plan)
    counts = [len(steps.names) for steps in reactions.values()] or [0]
    files = emit(plan, labels)
    sizes = {name: int(count) for name, count in re.findall(r"#define KF_(\w+) (\d+)", files["sizes.h"])} | {
        "POINTS": len(points),
        "FORCES": len(names),
        "REACTIONS": sum(counts),  # of joints, then shaking force and moment
        "OF_JOINTS": counts[0],
        "LOADS": len(load_inputs(plan)),
    }
    stages = {"forces": force_steps(plan, names, coefficients="given")} if names else {}
    texts = [files["model.c"], _instance(plan, points)]
    texts += [emit_c_forces(plan, steps, stage, are_loads_open=False) for stage, steps in (stages | reactions).items()]
    parameters = (labels.get(parameter.name, parameter.name) for parameter in plan.parameters)
    constants = (constant.name for constant in plan.law_constants)
    return PageModule(
        _binary(mechanism.name, sizes, texts),
        plan,
        points,
        (*parameters, *constants),
        names,
        tuple(name for steps in reactions.values() for name in steps.names),
    )


def require_page_size(mechanism: Mechanism) -> None:
    """Raise a TooLargeError for a mechanism that is too large for a page, as far as its plan shows it.

    What a report and a module take seconds for is not begun then. Small mechanisms are not planned.
    """
    sizes = {"DRIVERS": len(mechanism.drivers), "POINTS": len(mechanism.body_points)}
    _require_sizes(mechanism.name, sizes)
    if len(mechanism.coordinate_names) <= _layout()[0]["UNKNOWNS"]:
        return
    with suppress(KinfmuError):  # the report states it better
        plan = compile_plan(replace(mechanism, coordinates="moving"))
        moving = sum(len(block.coordinates) for block in plan.blocks)
        sizes = {"UNKNOWNS": len(plan.unknowns), "COORDINATES": moving + len(plan.drivers)}
    _require_sizes(mechanism.name, sizes)


def _require_sizes(name: str, sizes: Mapping[str, int]) -> None:
    most, _ = _layout()
    for size, count in sizes.items():
        if count > most[size]:
            what = _SIZES.get(size, size.lower().replace("_", " "))
            raise TooLargeError(f"'{name}' is too large for a page: it has {count} {what}, at most {most[size]} fit")


def _planned(mechanism: Mechanism, report: Report | None) -> SolvePlan:
    """Return the plan of all coordinates that move."""
    known = report.plan if report else None
    if known and known.mechanism is mechanism and mechanism.coordinates == "moving":
        return known
    # Numbers seen from an origin of the plan's own are rounded in other ways when they are parameters.
    redundancy = report.redundancy if report and known and not any(known.origin) else None
    return compile_plan(replace(mechanism, coordinates="moving"), redundancy=redundancy)


def _binary(name: str, sizes: Mapping[str, int], texts: Iterable[str]) -> Binary:
    """Return the compiled solver with the C texts of a model and its sizes."""
    _require_sizes(name, sizes)
    most, structures = _layout()
    made = Binary(_solver())
    for size, count in sizes.items():
        made.put(made.addresses[f"size_{size.lower()}"], struct.pack("<i", count))
    translator = Translator(made, {f"KF_{size}": count for size, count in sizes.items()}, most)
    for text in (structures, *texts):
        translator.translate(text)
    return made


@cache
def _layout() -> tuple[dict[str, int], str]:
    """Return the largest sizes of models in pages, and the structures that models share with the solver."""
    headers = [(SOURCES / name).read_text("utf-8") for name in ("page_sizes.h", "instance.h")]
    most = {name: int(most) for text in headers for name, most in re.findall(r"KF_MOST_KF_(\w+) (\d+)", text)}
    shared = "\n".join(compiler.sources(["curve.h", "kinfmu.h"]).values())
    return most, "\n".join(re.findall(r"^typedef struct {[^}]*} \w+;", shared, re.MULTILINE))


def _reaction_stages(plan: SolvePlan) -> dict[str, ForceSteps]:
    """Return the steps to reactions of joints, and to shaking force and moment; none without masses and loads."""
    if not reaction_names_of(plan.mechanism):
        return {}
    undetermined, of_ground = undetermined_reactions(plan), shaking_names(plan.mechanism)
    of_joints = [
        name for name in reaction_names_of(plan.mechanism) if name not in undetermined and name not in of_ground
    ]
    return {"reactions": reaction_steps(plan, of_joints), "shaking": shaking_steps(plan)}


def _instance(plan: SolvePlan, points: Sequence[str]) -> str:
    """Return what interface.c reads besides the model, and the function of x, y of all points from the parameters."""
    constants = plan.law_constants
    tracer = Tracer(plan.mechanism, [parameter.name for parameter in plan.parameters])
    nodes = [tracer.graph.lift(value) for name in points for value in tracer.members.body_points[name]]
    writer = Writer(Names(functions=FUNCTIONS), ())
    body = [f"{line};" for line in writer.statements(nodes)]
    body += [f"points[{k}] = {writer.expression(node)};" for k, node in enumerate(nodes)]
    used = {node.name for node in writer.used if node.op == "symbol"}
    places = {parameter_symbol(one.name): f"model->parameters[{k}]" for k, one in enumerate(plan.parameters)}
    loads = [f"{identifier(name)} = {place};" for name, place in places.items() if name in used]
    lines = [
        f"const double kf_start = {plan.mechanism.run.start!r};",
        *array("char *const kf_constant_names", [string(one.name) for one in constants]),
        *array("bool kf_constant_is_positive", booleans(one.is_positive for one in constants)),
        *function("void kf_points(const kf_model *model, double *points)", [*loads, *body]),
    ]
    return "\n".join(lines) + "\n"
