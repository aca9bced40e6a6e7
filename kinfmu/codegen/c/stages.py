"""Functions that loop over the units: kf_solve_blocks, kf_velocity, kf_acceleration, kf_jacobian, kf_residuals."""

from __future__ import annotations

from kinfmu.codegen.c.parts import Parts
from kinfmu.codegen.c.text import function, repeated
from kinfmu.codegen.kinds import UnitRun
from kinfmu.codegen.lists import LISTS

_LOCALS = ("const double *const x = found->x;", "const double *const hold = found->hold;")


def stages(parts: Parts) -> list[str]:
    """Return all of them."""
    return [
        *_positions(parts),
        *_rates(parts, "velocity", 1),
        *_rates(parts, "acceleration", 2),
        *_entries(parts, "jacobian"),
        *_entries(parts, "residuals"),
    ]


def _positions(parts: Parts) -> list[str]:
    """Return kf_solve_blocks."""
    calls: list[str] = []
    for number, run in parts.numbered():
        unit = _unit(parts, number, index(run))
        if run.kind.solved:
            block = block_of(run)
            call = [
                f"if (!position{run.kind.label}(model, {unit}, z, held && held[{block}],",
                f"                &found->determinants[{block}], newton)) {{",
                f"    return {block};",
                "}",
            ]
        else:
            call = [f"position{run.kind.label}(model, {unit});"]
        calls += repeated(len(run.members), call)
    signature = (
        "inline int kf_solve_blocks(const kf_model *model, const double *z, const bool *held, kf_found *found,\n"
        "                kf_newton *newton)"
    )
    variables = ["double *const x = found->x;", "double *const hold = found->hold;"]
    variables += ["int k;"] if any(index(run) == "k" for run in parts.runs) else []
    return function(signature, [*calls, "return -1;"], ("z", "held", "newton"), variables)


def _rates(parts: Parts, name: str, order: int) -> list[str]:
    """Return kf_velocity or kf_acceleration."""
    out, driven = LISTS[order], "u" + "d" * order
    calls: list[str] = []
    for number, run in parts.numbered():
        solving = ["given", f"held && held[{block_of(run)}]"] if run.kind.solved else []
        arguments = ["model", _unit(parts, number, index(run)), *solving, *LISTS[1:order], out]
        calls += repeated(len(run.members), [f"{name}{run.kind.label}({', '.join(arguments)});"])
    ready = " const double *x1," if order == 2 else ""
    signature = (
        f"inline void kf_{name}(const kf_model *model, const kf_found *found, const double *{driven},{ready}\n"
        f"    const double *given, const bool *held, double *{out})"
    )
    drivers = [
        "for (k = 0; k < KF_DRIVERS; ++k) {",
        f"    {out}[KF_COORDINATES - KF_DRIVERS + k] = {driven}[k];",
        "}",
    ]
    return function(signature, [*drivers, *calls], ("given", "held"), (*_LOCALS, "int k;"))


def _entries(parts: Parts, name: str) -> list[str]:
    """Return kf_jacobian or kf_residuals: numbers of one block."""
    calls: list[str] = []
    for number, run in parts.numbered():
        if run.kind.solved:
            unit = _unit(parts, number, f"block - {run.first}")
            calls += [
                f"if (block < {run.first + len(run.members)}) {{",
                f"    {name}{run.kind.label}(model, {unit}, {name});",
                "    return;",
                "}",
            ]
    signature = f"void kf_{name}(const kf_model *model, const kf_found *found, int block, double *{name})"
    return function(signature, calls, ("model", "found", "block", name), _LOCALS if calls else ())


def _unit(parts: Parts, number: int, k: str) -> str:
    """Return the arguments for unit k of a run: its row, the positions, and its part of the stage cache."""
    return f"&run_{number}[{k}], x, hold + {parts.stage_cache.start(number, k)}"


def index(run: UnitRun) -> str:
    """Return the index of a unit in a loop over its run; '0' for a run of one."""
    return "k" if len(run.members) > 1 else "0"


def block_of(run: UnitRun) -> str:
    """Return the number of the solved block of unit k."""
    return f"{run.first} + k" if len(run.members) > 1 else f"{run.first}"
