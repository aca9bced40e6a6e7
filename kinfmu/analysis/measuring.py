"""The measures of a mechanism over one cycle of its driver, or over the run of its file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kinfmu.analysis.singular import DriverRange
from kinfmu.errors import KinfmuError
from kinfmu.laws import ConstantSpeed
from kinfmu.mechanism import Mechanism
from kinfmu.motion import MeasuredValue, measure
from kinfmu.run import Run
from kinfmu.run.axis import axis_of
from kinfmu.sweep import solve
from kinfmu.units import unit_of

SAMPLES_PER_TURN = 360


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
    if len(mechanism.drivers) == 1 and ranges and ranges[0].turns is not None:
        (driver,), turns = mechanism.drivers, ranges[0].turns
        speed = driver.law.speed if isinstance(driver.law, ConstantSpeed) else 0.0
        angle, speed_name, _ = driver.inputs()
        start = float(driver.law.at(mechanism.run.start))
        angles = start + np.linspace(0.0, turns * math.tau, turns * SAMPLES_PER_TURN + 1)
        inputs: dict[str, Any] = {angle: angles, speed_name: float(speed) or 1.0}
        run = solve(mechanism, **inputs)
        count = "one turn" if turns == 1 else f"{turns} turns"
        at = f"at {float(speed):.6g} {unit_of(speed_name.quantity, mechanism.length_unit)}"
        return run, f"{count} of {driver.name} {at if speed else 'at speed 1, so that rates are per rad'}"
    run = solve(mechanism)
    return run, f"the run of the file, {axis_of(run).range()}"
