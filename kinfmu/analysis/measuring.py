"""The measures of a mechanism over one cycle of its driver, or over the run of its file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kinfmu.analysis.driver_path import follow
from kinfmu.analysis.singular import DriverRange, driver_range
from kinfmu.errors import KinfmuError, RequestError
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.drivers import SAMPLES_PER_TURN
from kinfmu.mechanism.laws import ConstantSpeed, ConstantValue, External, Law, Polynomial
from kinfmu.mechanism.laws.law import NEARLY
from kinfmu.mechanism.loads.load import Following
from kinfmu.mechanism.number import given_unit
from kinfmu.motion import MeasuredValue, measure
from kinfmu.plan import SolvePlan
from kinfmu.run import Run
from kinfmu.run.axis import axis_of
from kinfmu.run.solve import solve
from kinfmu.units import Quantity, angular_speed, factors

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

    They are those of the motion of `motion_of_check`.
    """
    if not mechanism.measures:
        return None
    names = [reading.name for reading in mechanism.measures]
    try:
        arguments, over = motion_of_check(mechanism, ranges)
        run = solve(replace(mechanism, coordinates="all"), **arguments)
    except KinfmuError as reason:
        return Measurements("no motion", (), dict.fromkeys(names, str(reason)))
    values: list[MeasuredValue] = []
    refused: dict[str, str] = {}
    for name in names:
        try:
            values += measure(run, [name]).values()
        except KinfmuError as reason:
            refused[name] = str(reason).removeprefix(f"[measures.{name}]: ")
    return Measurements(over or name_of_run(run), tuple(values), refused)


def motion_of_check(mechanism: Mechanism, ranges: Sequence[DriverRange]) -> tuple[dict[str, Any], str]:
    """Return the motion of which `check` reports measures and forces, as `solve` takes it, and what it is as text.

    A single driver that turns all the way round makes one cycle if its speed is constant: at that speed, or at 1 rad/s
    if the file does not move it. Any other motion is the run of the file: both are empty. `[run] over` chooses. Raise a
    RequestError if `[run] over` asks for a turn that the drivers cannot make.
    """
    inputs, over = _cycle(mechanism, ranges)
    if inputs and (mechanism.loads or mechanism.has_masses) and (speed := constant_speed(mechanism.drivers[0].law)):
        angles = next(iter(inputs.values()))
        inputs = {"t": mechanism.run.start + (angles - angles[0]) / abs(speed)}  # laws of loads may need times
    return inputs, over


def name_of_run(run: Run) -> str:
    """Return what the motion is that the file makes."""
    return f"the run of the file, {axis_of(run).range()}"


def constant_speed(law: Law) -> float | None:
    """Return the speed of a law that has the same one at all times, 0 for one that stands still; None for others."""
    if isinstance(law, ConstantSpeed):
        return float(law.speed)
    if isinstance(law, Polynomial) and not any(law.coefficients[2:]):
        return float(sum(law.coefficients[1:]))
    return 0.0 if isinstance(law, External | ConstantValue) else None


def _speed_text(law: Law, speed: float) -> str:
    """Return the speed of an angle in the unit of the mechanism file, such as '600 rpm'."""
    unit = given_unit(getattr(law, "speed", speed))
    factor = factors(Quantity("angle", 1), "m").get(unit)
    return angular_speed(speed) if factor is None else f"{speed / factor:.6g} {unit}"


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

    Both are empty if the driver does not turn all the way round. Raise a KinfmuError if the driver cannot be followed.
    """
    return _cycle(plan.mechanism, [driver_range(follow(plan, 0))])


def _cycle(mechanism: Mechanism, ranges: Sequence[DriverRange]) -> tuple[dict[str, Any], str]:
    over, drivers = mechanism.run.over, mechanism.drivers
    if len(drivers) != 1 or not ranges or ranges[0].turns is None:
        if over == "turn":
            raise RequestError("over = 'turn' needs a single driver that turns all the way round; 'run' is the other")
        return {}, ""
    (driver,), speed = drivers, constant_speed(drivers[0].law)
    if over == "run" or (speed is None and not over):
        return {}, ""
    turns = turns_of_cycle(mechanism, ranges[0].turns)
    angle, speed_name, _ = driver.inputs()
    start = float(driver.law.at(mechanism.run.start))
    angles = start + np.linspace(0.0, turns * math.tau, turns * SAMPLES_PER_TURN + 1)
    count = "one turn" if turns == 1 else f"{turns} turns"
    at = _speed_text(drivers[0].law, speed) if speed else "1 rad/s, so that rates are per rad"
    return {angle: angles, speed_name: speed or 1.0}, f"{count} of {driver.name} at {at}"
