"""SolvePlan -> C: model.c, the formulas of a mechanism; sizes.h, the sizes of its arrays; the constants of the solver.

The same plan gives the same bytes. The functions are described in solver/c/kinfmu.h.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from importlib import import_module
from itertools import accumulate
from pkgutil import iter_modules

from kinfmu.codegen.c.functions import Parts, bind, drive, readers, stages
from kinfmu.codegen.c.text import array, booleans, defines, header, string
from kinfmu.codegen.c.units import rows_of
from kinfmu.codegen.lists import distance_rows
from kinfmu.plan import Block, SolvePlan
from kinfmu.solver import python
from kinfmu.solver.python.curve import CurveData


def emit(plan: SolvePlan, labels: Mapping[str, str] | None = None) -> dict[str, str]:
    """Return model.c, sizes.h and constants.h, by file name; labels: of parameters that messages name otherwise."""
    parts = Parts(plan)
    model = _model(parts, labels or {})
    return {"constants.h": constants(), "sizes.h": _sizes(parts), "model.c": model}


def _model(parts: Parts, labels: Mapping[str, str]) -> str:
    """Return model.c."""
    reading = readers(parts)  # before the units: they fill the stage cache
    lines = [
        f"/* Kinematics of {parts.plan.mechanism.name}: generated from its mechanism, not for editing. */",
        '#include "kinfmu.h"',
        '#include "sincos.h"',
        "",
        "#include <math.h>",
        "#include <stdio.h>",
        "",
        *tables(parts.plan, parts.solved, labels),
        *curve_tables(parts.curves),
        *(line for units in parts.units.values() for line in units.source()),
        *(line for number, run in parts.numbered() for line in rows_of(number, run, parts.place)),
        *drive(parts),
        *bind(parts),
        *stages(parts),
        *parts.stage_cache.placed(reading),
    ]
    return "\n".join(lines) + "\n"


def _sizes(parts: Parts) -> str:
    """Return sizes.h; to be called after `_model`, which fills the stage cache."""
    plan, solved = parts.plan, parts.solved
    counts = {
        "DRIVERS": len(plan.drivers),
        "TRACKS": int(plan.has_tracks),
        "MIXES": int(plan.has_mixed),
        "UNKNOWNS": len(plan.unknowns),
        "COORDINATES": len(parts.order),
        "BLOCKS": len(solved),
        "ROWS": sum(len(block.residuals) for block in solved),
        "HOLD": len(parts.stage_cache),
        "OUTPUTS": len(plan.outputs_motion),
        "WATCHES": len(plan.watches),
        "FIXED": len(plan.fixed_nodes),
        "PARAMETERS": len(plan.parameters),
        "DERIVED": len(parts.derived),
        "CONSTANTS": len(plan.law_constants),
        "DISTANCES": len(distance_rows(plan, solved)),
        "LAWS": len(plan.path_laws.units),
        "LAW_ARGUMENTS": len(plan.path_laws.turns),
        "LAW_LENGTHS": plan.path_laws.lengths,
        "TALL": int(any(len(block.residuals) > len(block.unknowns) for block in solved)),
        "LARGEST_BLOCK": max((len(block.residuals) * len(block.unknowns) for block in solved), default=0),
    }
    comment = "Sizes of a model: generated from its mechanism, not to be edited."
    return header("sizes", comment, [f"#define KF_{name} {count}" for name, count in counts.items()])


@cache
def constants() -> str:
    """Return constants.h: statuses and numbers of the solver in Python."""
    modules = [import_module(f"{python.__name__}.{one.name}") for one in iter_modules(python.__path__) if not one.ispkg]
    statuses = f"typedef enum {{ {', '.join(f'KF_{status.name}' for status in python.Status)} }} kf_status;"
    comment = "Statuses and constants of the solver: generated from kinfmu/solver/python, not to be edited."
    return header("constants", comment, [statuses, "", *defines("KF_", modules)])


def tables(plan: SolvePlan, solved: Sequence[Block], labels: Mapping[str, str]) -> list[str]:
    """Return the tables that the solver reads from a model; solved: the blocks that need Newton."""
    anchor_u, anchor_z = plan.anchor_values
    kinds = [driver.quantity.kind for driver in plan.drivers]
    scales = [1.0 if name.is_angle else plan.size for name in plan.unknowns]
    distances = distance_rows(plan, solved)
    ends = list(accumulate(len(block.unknowns) for block in solved))
    return [
        f"const double kf_size = {plan.size!r};",
        f"const double kf_offset = {plan.offset!r};",
        f"const double kf_row_offset = {plan.row_offset!r};",
        *array("double kf_anchor_u", anchor_u),
        *array("double kf_anchor_z", anchor_z),
        *array("double kf_unknown_scales", scales),
        *array("double kf_reach", [1.0 if kind == "angle" else plan.size for kind in kinds]),
        *array("int kf_block_ends", ends),
        *array("int kf_block_rows", [len(block.residuals) for block in solved]),
        *(array("int kf_block_drivers", plan.block_drivers) if plan.has_tracks else []),
        *array("double kf_row_scales", [scale for block in solved for scale in block.row_scales]),
        *array("double kf_determinant_factors", [1.0 / block.determinant_scale for block in solved]),
        *array("int kf_distance_drivers", [row.driver for row in distances]),
        *array("int kf_distance_blocks", [row.block for row in distances]),
        *array("int kf_distance_rows", [row.row for row in distances]),
        *array("double kf_distance_scales", [row.scale for row in distances]),
        *(array("double kf_law_turns", plan.path_laws.turns) if plan.path_laws.units else []),
        *(array("double kf_law_units", plan.path_laws.units) if plan.path_laws.units else []),
        *array("double kf_parameters_written", [parameter.value for parameter in plan.parameters]),
        *array("bool kf_parameter_is_angle", booleans(one.quantity.kind == "angle" for one in plan.parameters)),
        *array("double kf_constants_written", [constant.value for constant in plan.law_constants]),
        "",
        f"const char kf_name[] = {string(plan.mechanism.name)};",
        f"const char kf_length_unit[] = {string(plan.mechanism.length_unit)};",
        *_strings("kf_driver_names", [driver.name for driver in plan.drivers]),
        *array("bool kf_driver_is_angle", booleans(kind == "angle" for kind in kinds)),
        *_strings("kf_unknown_names", plan.unknowns),
        *array("bool kf_unknown_is_angle", booleans(name.is_angle for name in plan.unknowns)),
        *array("bool kf_output_is_angle", booleans(name.is_angle for name in plan.outputs)),
        *_strings("kf_watch_names", plan.watch_names),
        *_strings("kf_parameter_names", [labels.get(one.name, one.name) for one in plan.parameters]),
        *_strings("kf_block_row_names", [", ".join(block.row_names) for block in solved]),
        "",
    ]


def curve_tables(curves: Mapping[CurveData, str]) -> list[str]:
    """Return the data of curves, and the function that evaluates them."""
    lines: list[str] = []
    for (breaks, pieces), reference in curves.items():
        name = reference.removeprefix("&")
        lines += array(f"static double {name}_breaks", breaks)
        rows = []
        for k, (origin, coefficients, amplitude, frequency, phase) in enumerate(pieces):
            lines += array(f"static double {name}_{k}", coefficients)
            numbers = f"{float(amplitude)!r}, {float(frequency)!r}, {float(phase)!r}"
            rows.append(f"    {{{float(origin)!r}, {len(coefficients)}, {name}_{k}, {numbers}}},")
        lines += [f"static const kf_piece {name}_pieces[{len(rows)}] = {{", *rows, "};"]
        lines += [f"static const kf_curve {name} = {{{len(pieces)}, {name}_breaks, {name}_pieces}};", ""]
    if curves:
        lines += [
            "static double curve(const kf_curve *data, int order, double x)",
            "{",
            "    return kf_curve_at(data, order, x);",
            "}",
            "",
        ]
    return lines


def _strings(name: str, texts: Sequence[str]) -> list[str]:
    return array(f"char *const {name}", [string(text) for text in texts])
