"""What a step of the python FMU costs in fmpy's low-level loop, beside a pythonfmu toy (sine and cosine)."""

from __future__ import annotations

import math
import statistics
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

from kinfmu.errors import FmuError
from kinfmu.fmu.build import build
from kinfmu.mechanism import Mechanism
from kinfmu.naming import derivative_name

STEPS = 720  # in a round, of one degree each: whole turns
ROUNDS = 60  # of each FMU, in turn, so that whatever else the machine does hits both


class StepCost(NamedTuple):
    """Microseconds a step (set 1, step, get 15) of one FMU: median and quartiles over the rounds."""

    name: str
    median: float
    lower: float
    upper: float


def run(mechanism: Mechanism) -> tuple[StepCost, StepCost]:
    """Measure mechanism and toy side by side, print a table, return (mechanism, toy)."""
    with tempfile.TemporaryDirectory(prefix="kinfmu_bench_") as folder:
        ours = build(mechanism, Path(folder) / "ours.fmu", drive="inputs")
        toy = _toy(Path(folder))
        body = mechanism.drivers[0].inputs()[0]
        with _stepper(ours, body, _fifteen(ours)) as step_ours, _stepper(toy, "u", None) as step_toy:
            rounds = [(step_ours(k), step_toy(k)) for k in range(ROUNDS + 1)][1:]  # the first one warms up
    costs = tuple(
        StepCost(name, statistics.median(times), *statistics.quantiles(times, n=4)[::2])
        for name, times in zip((mechanism.name, "toy (sin, cos)"), zip(*rounds, strict=True), strict=True)
    )
    print(f"{'FMU step: set 1, step 1 deg, get 15':38}{'median':>9}{'quartiles':>18}")
    for cost in costs:
        print(f"{cost.name:38}{cost.median:6.2f} us{cost.lower:8.2f} to {cost.upper:.2f} us")
    ratios = [ours / toy for ours, toy in rounds]
    lower, upper = statistics.quantiles(ratios, n=4)[::2]
    print(f"{'ratio, round by round':38}{statistics.median(ratios):6.2f}   {lower:8.2f} to {upper:.2f}")
    return costs[0], costs[1]


def _fifteen(fmu: Path) -> list[str]:
    """Position, velocity and acceleration of the first five outputs of an FMU."""
    from fmpy import read_model_description

    names = [v.name for v in read_model_description(str(fmu)).modelVariables if v.causality == "output"]
    first = [name for name in names if name.rpartition(".")[2] in ("x", "y", "phi")][:5]
    return [derivative_name(name, order) for order in range(3) for name in first]


def _toy(folder: Path) -> Path:
    from pythonfmu import FmuBuilder

    return Path(FmuBuilder.build_FMU(Path(__file__).with_name("sine_slave.py"), dest=folder / "toy.fmu"))


@contextmanager
def _stepper(fmu: Path, input_name: str, outputs: list[str] | None) -> Iterator[Callable[[int], float]]:
    """A function that steps an FMU through a round and returns microseconds a step."""
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
        yield lambda k: _round(slave, k * STEPS, inputs, reads)
        slave.freeInstance()


def _round(slave: Any, first: int, inputs: list[int], reads: list[int]) -> float:
    degree = math.pi / 180.0
    begin = perf_counter()
    for k in range(first, first + STEPS):
        slave.setReal(inputs, [k * degree])
        slave.doStep(k * degree, degree)
        slave.getReal(reads)
    return (perf_counter() - begin) / STEPS * 1e6
