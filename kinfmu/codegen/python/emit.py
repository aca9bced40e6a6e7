"""SolvePlan -> Python source: one module of plain arithmetic on the standard library, the `model` of a Solver.

The module holds constants and these functions, each a stage, which is computed when it is called. With parameters the
functions are inside `bound(parameters)`, which computes once what depends on parameters alone:

    drive(t, constants)                            -> u, ud, udd
    position(u, z, zd, zdd, s, held, enough)       -> z, determinants, margin, residual, iterations, moved, watch,
                                                      values
    tangent(values)                                -> z' and z'' (one driver only)
    first_motion(values, ud, udd)                  -> tangent and motion in one go (one driver only)
    velocity(values, ud, given, held)              -> zd
    acceleration(values, ud, udd, zd, given, held) -> zdd
    outputs(values)                                -> positions of the outputs
    rates(values, ud, first)                       -> their rates
    accelerations(values, ud, udd, first, second)  -> their accelerations
    motion(values, ud, udd, first, second)         -> the three in one row, with what they share computed once
    differences(there, here)                       -> largest differences of two rows of motion, in radians and sizes
    watches(values)                                -> rows set aside, relative to the size
    jacobians(values)                              -> one matrix a block

z are the unknowns of all blocks. position predicts z + s zd + s^2 zdd / 2 and corrects by Newton; margin is the
smallest |determinant|, residual the largest length of a block's residuals, moved the largest correction, watch the
largest residual of the rows set aside. `held` is a bit a block: set, its z is taken as given instead of solved for.
`enough` is the squared residual that Newton may end at; it ends too where the residual no longer falls.
first and second are zd and zdd; with one driver they are the derivatives of z with respect to u, and the chain rule is
part of the code.
"""

from __future__ import annotations

import linecache
import weakref
from types import ModuleType
from typing import Any

from kinfmu.codegen.python.looped import looped
from kinfmu.codegen.python.straight import straight
from kinfmu.plan import SolvePlan

MANY = 200  # coordinates; beyond, unrolled code outgrows 256 names a function and the caches: loops are faster


def emit(plan: SolvePlan) -> str:
    """Return the source text of the model module; equal plans give equal text."""
    count = sum(len(block.coordinates) for block in plan.blocks)
    return looped(plan) if count > MANY else straight(plan)


_modules: dict[int, ModuleType] = {}  # by id of their plans: plans of equal text may differ in units and origin


def load_model(plan: SolvePlan) -> Any:
    """Return the generated model of a plan with its parameters as written, ready for a Solver."""
    module = load_module(plan)
    return module.bound(tuple(value for _, value in module.PARAMETERS)) if plan.parameters else module


def load_module(plan: SolvePlan) -> ModuleType:
    """Return the generated module of a plan, compiled once per plan; its source is in tracebacks.

    Without parameters the module is a model itself; with parameters its function `bound` returns one.
    """
    module = _modules.get(id(plan))
    if module is None:
        module = _modules[id(plan)] = _compiled(plan)
        weakref.finalize(plan, _modules.pop, id(plan))
    return module


def _compiled(plan: SolvePlan) -> ModuleType:
    source = emit(plan)
    name = f"kinfmu.solver.python.model_{plan.mechanism.name}"  # next to `linear`, as in an FMU
    model = ModuleType(name)
    model.__package__ = "kinfmu.solver.python"
    model.__file__ = f"<{name}>"
    linecache.cache[model.__file__] = (len(source), None, source.splitlines(keepends=True), model.__file__)
    exec(compile(source, model.__file__, "exec"), model.__dict__)  # noqa: S102  our own generated source
    return model
