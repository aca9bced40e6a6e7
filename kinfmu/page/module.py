"""A mechanism as a WebAssembly module: the C of its plan, the solver and `interface.c`, compiled without any import.

The module does the same arithmetic as the native engine and the native FMU, operation by operation: numbers are equal
to the bit. It holds one instance of the mechanism; web/engine.js calls it.
"""

from __future__ import annotations

import base64
import gzip
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from kinfmu.codegen.c import compiler, emit
from kinfmu.codegen.c.text import FUNCTIONS, array, booleans, function, string
from kinfmu.codegen.forces import SIGNATURE, emit_c_forces, solves
from kinfmu.codegen.writer import Names, Writer, identifier
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.force_names import reaction_names_of, shaking_names
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.plan.efforts import load_inputs
from kinfmu.plan.forces import ForceSteps, force_names, force_steps, loaded_coordinates
from kinfmu.plan.reactions import reaction_steps, shaking_steps
from kinfmu.plan.trace import Tracer, parameter_symbol
from kinfmu.plan.undetermined import undetermined_reactions

FOLLOWER = ("follower.h", "follower.c")
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
FLAGS = ("-Oz",)
_INTERFACE = Path(__file__).with_name("interface.c")


class PageModule(NamedTuple):
    """A compiled mechanism and what its arrays hold.

    Attributes:
        data: The WebAssembly module.
        plan: What it solves: all bodies' coordinates that move, then the points of interest.
        points: The points 'body.point' whose places in their bodies it returns.
        parameters: Names of what it can bind, in its order: parameters, or their labels, then constants of the laws.
        forces: Names of its forces; none without masses and loads.
        reactions: Names of the reactions of joints, without those that are undetermined, then of
            shaking force and moment; none without masses and loads.

    """

    data: bytes
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
        """The module for a page."""
        return packed(self.data)


def packed(data: bytes) -> str:
    """Return data for a page: compressed by gzip, in base64."""
    return base64.b64encode(gzip.compress(data, 9, mtime=0)).decode()


def page_module(mechanism: Mechanism, labels: Mapping[str, str] | None = None) -> PageModule:
    """Return the module of a mechanism, compiled now or taken from the cache of compiled libraries.

    Args:
        mechanism: The mechanism.
        labels: Names of parameters for messages and `PageModule.parameters`, such as `Opened.labels`. Default: none.

    Raises:
        KinfmuError: The mechanism cannot be solved, as `compile_plan` reports it.
        CompilerError: ziglang is not installed, or it fails.

    """
    labels = labels or {}
    names = force_names(mechanism)
    plan = compile_plan(replace(mechanism, coordinates="moving"), solved=loaded_coordinates(mechanism) if names else ())
    points = tuple(mechanism.body_points)
    data = compiler.wasm_module(page_sources(plan, points, labels), EXPORTS, FLAGS)
    parameters = (labels.get(parameter.name, parameter.name) for parameter in plan.parameters)
    constants = (constant.name for constant in plan.law_constants)
    reactions = [name for steps in _reaction_stages(plan).values() for name in steps.names]
    return PageModule(data, plan, points, (*parameters, *constants), names, tuple(reactions))


def page_sources(plan: SolvePlan, points: Sequence[str], labels: Mapping[str, str]) -> dict[str, str]:
    """Return the C files of a module by name; all but forces.c is one unit, page.c."""
    files = emit(plan, labels) | compiler.sources([*compiler.SOLVER, *FOLLOWER])
    files |= {"instance.h": _header(plan, points), "points.h": _points(plan, points)}
    files["interface.c"] = _INTERFACE.read_text("utf-8")
    names = force_names(plan.mechanism)
    stages = {"forces": force_steps(plan, names, coefficients="given")} if names else {}
    stages |= _reaction_stages(plan)
    if any(map(solves, stages.values())):
        files |= compiler.sources(["solutions.c"])
    lines = ["/* The whole module as one unit. Files included here are not compiled separately. */"]
    lines += [f'#include "{name}"' for name in sorted(files) if name.endswith(".c")]
    files |= {f"{stage}.c": emit_c_forces(plan, steps, stage, are_loads_open=False) for stage, steps in stages.items()}
    return files | {"page.c": "\n".join(lines) + "\n"}


def _reaction_stages(plan: SolvePlan) -> dict[str, ForceSteps]:
    """Return the steps to reactions of joints, and to shaking force and moment; none without masses and loads."""
    if not reaction_names_of(plan.mechanism):
        return {}
    undetermined, of_ground = undetermined_reactions(plan), shaking_names(plan.mechanism)
    of_joints = [
        name for name in reaction_names_of(plan.mechanism) if name not in undetermined and name not in of_ground
    ]
    return {"reactions": reaction_steps(plan, of_joints), "shaking": shaking_steps(plan)}


def _header(plan: SolvePlan, points: Sequence[str]) -> str:
    constants = plan.law_constants
    counts = [len(steps.names) for steps in _reaction_stages(plan).values()] or [0]
    lines = [
        f"/* What the page of {plan.mechanism.name} needs to know: generated from its mechanism, not to be edited. */",
        "#ifndef KF_INSTANCE_H",
        "#define KF_INSTANCE_H",
        "",
        '#include "kinfmu.h"',
        "",
        f"#define KF_POINTS {len(points)}",
        f"#define KF_FORCES {len(force_names(plan.mechanism))}",
        f"#define KF_REACTIONS {sum(counts)} /* of joints, then shaking force and moment */",
        f"#define KF_OF_JOINTS {counts[0]}",
        f"#define KF_LOADS {len(load_inputs(plan))} /* efforts of external loads */",
        f"#define KF_START {plan.mechanism.run.start!r} /* [s] of the laws */",
        "",
        *(f"{SIGNATURE.format(stage=stage)};" for stage in ("forces", "reactions", "shaking")),
        "",
        *array("static char *const kf_constant_names", [string(one.name) for one in constants]),
        *array("static bool kf_constant_is_positive", booleans(one.is_positive for one in constants)),
        "",
        "#endif",
    ]
    return "\n".join(lines) + "\n"


def _points(plan: SolvePlan, points: Sequence[str]) -> str:
    """Return points.h: a function that computes x, y of all points in their bodies from the parameters."""
    tracer = Tracer(plan.mechanism, [parameter.name for parameter in plan.parameters])
    nodes = [tracer.graph.lift(value) for name in points for value in tracer.members.body_points[name]]
    writer = Writer(Names(functions=FUNCTIONS), ())
    body = [f"{line};" for line in writer.statements(nodes)]
    body += [f"points[{k}] = {writer.expression(node)};" for k, node in enumerate(nodes)]
    used = {node.name for node in writer.used if node.op == "symbol"}
    places = {parameter_symbol(one.name): f"model->parameters[{k}]" for k, one in enumerate(plan.parameters)}
    loads = [f"{identifier(name)} = {place};" for name, place in places.items() if name in used]
    lines = [
        f"/* Points of {plan.mechanism.name}: generated from its mechanism, not to be edited. */",
        '#include "kinfmu.h"',
        '#include "sincos.h"',
        "",
        *function("static void kf_points(const kf_model *model, double *points)", [*loads, *body]),
    ]
    return "\n".join(lines) + "\n"
