"""Load generated source into this process."""

from __future__ import annotations

import linecache
import weakref
from types import ModuleType
from typing import Any

from kinfmu.codegen.python.emit import emit
from kinfmu.plan import SolvePlan

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
    name = f"kinfmu.solver.python.model_{plan.mechanism.name}"  # beside `linear`, as in an FMU
    model = ModuleType(name)
    model.__package__ = "kinfmu.solver.python"
    model.__file__ = f"<{name}>"
    linecache.cache[model.__file__] = (len(source), None, source.splitlines(keepends=True), model.__file__)
    exec(compile(source, model.__file__, "exec"), model.__dict__)  # noqa: S102  our own generated source
    return model
