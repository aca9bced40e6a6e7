"""Loading generated source into this process."""

from __future__ import annotations

import linecache
from types import ModuleType
from typing import Any

from kinfmu.codegen.python.emit import emit
from kinfmu.plan import SolvePlan


def load_model(plan: SolvePlan) -> Any:
    """The generated model of a plan with its parameters as written, ready for a Solver."""
    module = load_module(plan)
    return module.bound(tuple(value for _, value in module.PARAMETERS)) if plan.parameters else module


def load_module(plan: SolvePlan) -> ModuleType:
    """The generated module of a plan; its source shows in tracebacks.

    Without parameters it is a model itself; with parameters its function `bound` gives one.
    """
    source = emit(plan)
    name = f"kinfmu.solver.python.model_{plan.mechanism.name}"  # beside `linear`, as in an FMU
    model = ModuleType(name)
    model.__package__ = "kinfmu.solver.python"
    model.__file__ = f"<{name}>"
    linecache.cache[model.__file__] = (len(source), None, source.splitlines(keepends=True), model.__file__)
    exec(compile(source, model.__file__, "exec"), model.__dict__)  # noqa: S102  our own generated source
    return model
