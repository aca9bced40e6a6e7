"""The measures of a mechanism over one cycle of its driver, or over the run of its file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kinfmu.analysis.driver_path import follow
from kinfmu.analysis.singular import DriverRange, driver_range
from kinfmu.errors import KinfmuError
from kinfmu.laws import ConstantSpeed
from kinfmu.laws.law import NEARLY
from kinfmu.loads.following import Following
from kinfmu.mechanism import Mechanism
from kinfmu.motion import MeasuredValue, measure
from kinfmu.plan import SolvePlan
from kinfmu.run import Run
from kinfmu.run.axis import axis_of
from kinfmu.sweep import solve
from kinfmu.units import unit_of

SAMPLES_PER_TURN = 360
_MOST_TURNS = 24  # of the law of a load


@dataclass(frozen=True)
class Measurements:
    """The values of a mechanism's measures.

    over: The motion that was measured, as text; values: in file order; refused: why others have no value, by name.
    """

    over: str
    values: tuple[MeasuredValue, ...]
    refused: dict[str, str]

    def as_json(self) -> dict[str, Any]:
        """Return the values as plain data."""
        values = [value.as_json() for value in self.values]
        return {"over": self.over, "values": values, "refused": dict(self.refused)}


def measurements(mechanism: Mechanism, ranges: Sequence[DriverRange]) -> Measurements | None:
    """Measure the motion of a mechanism; None if it declares no measures.

    A single driver that turns all the way round makes one cycle, at the speed of its law if that is constant, else at 1
    rad per unit of the argument; any other motion is the run of the file.

    Args:
        mechanism: The mechanism.
        ranges: Ranges of its drivers.

    """
    if not mechanism.measures:
        return None
    names = [reading.name for reading in mechanism.measures]
    try:
        run, over = _motion(replace(mechanism, coordinates="all"), ranges)
    except KinfmuError as reason:
        return Measurements("no motion", (), dict.fromkeys(names, str(reason)))
    values: list[MeasuredValue] = []
    refused: dict[str, str] = {}
    for name in names:
        try:
            values += measure(run, [name]).values()
        except KinfmuError as reason:
            refused[name] = str(reason).removeprefix(f"[measures.{name}]: ")
    return Measurements(over, tuple(values), refused)


def _motion(mechanism: Mechanism, ranges: Sequence[DriverRange]) -> tuple[Run, str]:
    """Return the samples of the motion, and what it is as text."""
    inputs, over = _cycle(mechanism, ranges)
    if mechanism.loads and inputs and isinstance(law := mechanism.drivers[0].law, ConstantSpeed) and law.speed:
        angles, speed = next(iter(inputs.values())), float(law.speed)
        inputs = {"t": mechanism.run.start + (angles - angles[0]) / abs(speed)}  # laws of loads may need times
    run = solve(mechanism, **inputs)
    return run, over or f"the run of the file, {axis_of(run).range()}"


def turns_of_cycle(mechanism: Mechanism, turns: int) -> int:
    """Return the turns after which the loads repeat too, such as two for the gas force of a four-stroke engine.

    turns: after which the pose repeats. Loads whose law repeats after no whole number of turns do not count.
    """
    for load in mechanism.loads:
        if not (
            isinstance(load, Following) and load.over is not None and load.over.kind == "angle" and load.law.period
        ):
            continue
        times = math.tau / load.law.period  # in a turn
        own = (n for n in range(1, _MOST_TURNS + 1) if round(n * times) and abs(n * times - round(n * times)) <= NEARLY)
        turns = math.lcm(turns, next(own, 1))
    return turns


def driver_cycle(plan: SolvePlan) -> tuple[dict[str, Any], str]:
    """Return the driver values of one cycle of a single driver, as `solve` takes them, and what it is as text.

    Both are empty if the driver does not turn all the way round.

    Raises:
        KinfmuError: The driver cannot be followed.

    """
    return _cycle(plan.mechanism, [driver_range(follow(plan, 0))])


def _cycle(mechanism: Mechanism, ranges: Sequence[DriverRange]) -> tuple[dict[str, Any], str]:
    if len(mechanism.drivers) != 1 or not ranges or ranges[0].turns is None:
        return {}, ""
    (driver,), turns = mechanism.drivers, turns_of_cycle(mechanism, ranges[0].turns)
    speed = driver.law.speed if isinstance(driver.law, ConstantSpeed) else 0.0
    angle, speed_name, _ = driver.inputs()
    start = float(driver.law.at(mechanism.run.start))
    angles = start + np.linspace(0.0, turns * math.tau, turns * SAMPLES_PER_TURN + 1)
    count = "one turn" if turns == 1 else f"{turns} turns"
    at = f"at {float(speed):.6g} {unit_of(speed_name.quantity, mechanism.length_unit)}"
    over = f"{count} of {driver.name} {at if speed else 'at speed 1, so that rates are per rad'}"
    return {angle: angles, speed_name: float(speed) or 1.0}, over
