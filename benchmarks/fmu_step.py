"""What a step of the python FMU costs in fmpy's low-level loop, compared with a pythonfmu toy (sine and cosine)."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from time import process_time
from typing import Any

from benchmarks.rounds import in_turn, spread, table
from kinfmu.errors import FmuError
from kinfmu.fmu.build import build
from kinfmu.mechanism import Mechanism
from kinfmu.units import read_coordinate

STEPS = 720  # in a round, of one degree each: whole turns
ROUNDS = 60


def run(mechanism: Mechanism, rounds: int = ROUNDS) -> str:
    """Return a table: processor time of a step (set 1, step, get 15) of the mechanism's FMU and of the toy."""
    with tempfile.TemporaryDirectory(prefix="kinfmu_bench_") as folder:
        ours = build(mechanism, Path(folder) / "ours.fmu", flavour="python", drive="inputs")
        toy = _toy(Path(folder))
        body = mechanism.drivers[0].inputs()[0]
        with _stepper(ours, body, _fifteen(ours)) as step_ours, _stepper(toy, "u", None) as step_toy:
            seconds = in_turn([step_ours, step_toy], rounds, process_time)
    costs = [[value / STEPS * 1e6 for value in row] for row in seconds]
    rows = []
    for name, measured in zip((mechanism.name, "toy (sin, cos)"), costs, strict=True):
        of = spread(measured)
        rows.append((name, f"{of.median:.2f} us", f"{of.lower:.2f} to {of.upper:.2f} us"))
    ratio = spread([a / b for a, b in zip(*costs, strict=True)])
    rows.append(("ratio, round by round", f"{ratio.median:.2f}", f"{ratio.lower:.2f} to {ratio.upper:.2f}"))
    return "\n".join(table(("FMU step: set 1, step 1 deg, get 15", "median", "quartiles"), rows))


def _fifteen(fmu: Path) -> list[str]:
    """Return names of position, velocity and acceleration of the first five outputs of an FMU."""
    from fmpy import read_model_description

    names = [v.name for v in read_model_description(str(fmu)).modelVariables if v.causality == "output"]
    first = list(filter(None, map(read_coordinate, names)))[:5]
    return [name.derivative(order) for order in range(3) for name in first]


def _toy(folder: Path) -> Path:
    from pythonfmu import FmuBuilder

    return Path(FmuBuilder.build_FMU(Path(__file__).with_name("sine_slave.py"), dest=folder / "toy.fmu"))


@contextmanager
def _stepper(fmu: Path, input_name: str, outputs: list[str] | None) -> Iterator[Callable[[], None]]:
    """Return a function that steps an FMU through a round, each of which continues the last one."""
    from fmpy import extract, read_model_description
    from fmpy.fmi2 import FMU2Slave

    description = read_model_description(str(fmu))
    references = {v.name: v.valueReference for v in description.modelVariables}
    if outputs is None:
        outputs = [v.name for v in description.modelVariables if v.causality == "output"]
    if input_name not in references:
        raise FmuError(f"{fmu.name}: has no input '{input_name}'")
    inputs, reads = [references[input_name]], [references[name] for name in outputs]
    with tempfile.TemporaryDirectory(prefix="kinfmu_bench_") as folder:
        slave = FMU2Slave(
            guid=description.guid,
            modelIdentifier=description.coSimulation.modelIdentifier,
            unzipDirectory=extract(str(fmu), unzipdir=folder),
        )
        slave.instantiate()
        slave.setupExperiment()
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        first = count(0, STEPS)
        yield lambda: _round(slave, next(first), inputs, reads)
        slave.freeInstance()


def _round(slave: Any, first: int, inputs: list[int], reads: list[int]) -> None:
    degree = math.pi / 180.0
    for k in range(first, first + STEPS):
        slave.setReal(inputs, [k * degree])
        slave.doStep(k * degree, degree)
        slave.getReal(reads)
