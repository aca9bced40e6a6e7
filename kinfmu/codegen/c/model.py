"""SolvePlan -> C: model.c, the formulas of a mechanism, and sizes.h, the sizes of its arrays.

The same plan gives the same bytes. The functions are described in solver/c/kinfmu.h.
"""

from __future__ import annotations

from kinfmu.codegen.c.bind import bind, drive
from kinfmu.codegen.c.parts import Parts
from kinfmu.codegen.c.readers import readers
from kinfmu.codegen.c.stages import stages
from kinfmu.codegen.c.tables import curve_tables, tables
from kinfmu.codegen.c.units import rows_of
from kinfmu.codegen.distances import distance_rows
from kinfmu.plan import SolvePlan


def emit(plan: SolvePlan) -> dict[str, str]:
    """Return the texts of sizes.h and model.c, by file name."""
    parts = Parts(plan)
    model = _model(parts)
    return {"sizes.h": _sizes(parts), "model.c": model}


def _model(parts: Parts) -> str:
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
        *tables(parts.plan, parts.solved),
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
        "TALL": int(any(len(block.residuals) > len(block.unknowns) for block in solved)),
        "LARGEST_BLOCK": max((len(block.residuals) * len(block.unknowns) for block in solved), default=0),
    }
    offset = max(map(abs, plan.origin)) / plan.size
    lines = [
        f"/* Sizes of {plan.mechanism.name}: generated from its mechanism, not to be edited. */",
        "#ifndef KF_SIZES_H",
        "#define KF_SIZES_H",
        "",
        *(f"#define KF_{name} {count}" for name, count in counts.items()),
        f"#define KF_SIZE {plan.size!r} /* of the mechanism, in its unit of length */",
        f"#define KF_OFFSET {offset!r} /* from the world's origin, in sizes */",
        "",
        "#endif",
    ]
    return "\n".join(lines) + "\n"
