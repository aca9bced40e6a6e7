"""Engines of pages in Node, and the native engine that they are compared with."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu.arrays import FloatArray
from kinfmu.codegen.lanes import lanes
from kinfmu.page.module import PageModule

SCRIPT = Path(__file__).with_name("run_engines.mjs")
NODE = shutil.which("node") or ""
NEEDED = {"node": NODE, "ziglang": find_spec("ziglang")}
MISSING = [name for name, found in NEEDED.items() if not found]
needs_node = pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}")
POSES = 361

Call = Sequence[Any]  # a method of the engine and its arguments
Driven = tuple[FloatArray, FloatArray, FloatArray]  # (n, d) values, speeds and accelerations of the drivers


def answers(folder: Path, jobs: Sequence[tuple[PageModule, Sequence[Call]]]) -> list[list[Any]]:
    """Return what the calls of each job return; all modules run in one process of Node."""
    listed = []
    for number, (module, calls) in enumerate(jobs):
        path = folder / f"module_{number}.txt"
        path.write_text(module.text)
        listed.append({"module": str(path), "calls": calls})
    done = subprocess.run([NODE, SCRIPT], input=json.dumps(listed), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found: list[list[Any]] = json.loads(done.stdout)
    return found


def sweep_call(module: PageModule, driven: Driven) -> Call:
    """Return the call of a sweep of all outputs with rates and accelerations."""
    columns = list(range(3 * len(module.plan.outputs)))
    u, ud, udd = (table.ravel().tolist() for table in driven)
    return ["sweep", u, columns, ud, udd]


def drag_call(driven: Driven) -> Call:
    """Return the call of many steps."""
    return ["drag", np.stack(driven, axis=1).tolist()]


def table(numbers: Sequence[Any], columns: int) -> FloatArray:
    """Return numbers from JSON as a table of so many columns."""
    return np.array([float(number) for number in numbers]).reshape(-1, columns)


def driven_of(run: kinfmu.Run) -> Driven:
    """Return driver values, speeds and accelerations of a run."""
    u, ud, udd = (np.ascontiguousarray(run.inputs[:, order::3]) for order in range(3))
    return u, ud, udd


def rows_of(run: kinfmu.Run) -> FloatArray:
    """Return positions, rates and accelerations of a run side by side."""
    return np.hstack([run.values, run.rates, run.accelerations])


class StepByStep:
    """The native engine of a mechanism without lanes: each sample follows from the one before, as in a page."""

    def __init__(self, mechanism: kinfmu.Mechanism) -> None:
        with pytest.MonkeyPatch.context() as without_lanes:
            without_lanes.setattr(lanes, "has_lanes", lambda _: False)
            self._model = kinfmu.compile(replace(mechanism, coordinates="moving"), engine="native")

    def solve(
        self, t: FloatArray | None = None, parameters: Mapping[str, float] | None = None, **inputs: FloatArray
    ) -> kinfmu.Run:
        """Solve as `Model.solve` does; parameters that continuation does not reach are an error."""
        return self._model.solve(t, parameters=parameters, anew=False, **inputs)


def driven_through(mechanism: kinfmu.Mechanism, native: StepByStep) -> kinfmu.Run:
    """Return a run of the native engine: through a turn of the crank from where it starts, or else over time."""
    run, (driver, *others) = mechanism.run, mechanism.drivers
    if others or driver.quantity.kind != "angle":
        return native.solve(np.linspace(run.start, run.stop, POSES))
    start = native.solve(np.array([run.start])).inputs[0, 0]
    value, speed, acceleration = driver.inputs()
    given = {value: start + np.linspace(0.0, 2.0 * np.pi, POSES), speed: np.full(POSES, 3.0)}
    return native.solve(**given, **{acceleration: np.full(POSES, -0.7)})
