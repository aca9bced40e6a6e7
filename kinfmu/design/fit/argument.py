"""The argument of a motion: the value of the only driver, or time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import MechanismError
from kinfmu.mechanism import Mechanism
from kinfmu.run.driving import run_times
from kinfmu.units import Quantity

SAMPLES = 181  # of the path that untimed points are compared with, over one turn or over the run
CHOICES = ("driver", "time")


@dataclass(frozen=True)
class Argument:
    """What the samples of a motion go by.

    Attributes:
        name: Name of the driver, or 'time'.
        quantity: Of its values.
        input: Name of the driver's input; '' for time.
        begin: Where the motion begins.
        end: Its last value: one turn after `begin`, or the end of the file's run.

    """

    name: str
    quantity: Quantity
    input: str
    begin: float
    end: float

    @property
    def is_turn(self) -> bool:
        """Whether the motion is a turn of the driver."""
        return self.quantity.kind == "angle"

    def keywords(self, values: FloatArray) -> dict[str, Any]:
        """Return the arguments of `Model.solve` and `Model.sensitivities` for these values."""
        return {self.input: values} if self.input else {"t": values}

    def values(self, begin: float | None, end: float | None, count: int = SAMPLES) -> FloatArray:
        """Return samples (count,) from one value to another; default: the whole motion."""
        low = self.begin if begin is None else begin
        high = end if end is not None else self.end if begin is None or not self.is_turn else low + math.tau
        return np.linspace(low, high, count)


def argument_of(mechanism: Mechanism, choice: str | None) -> Argument:
    """Return what the samples of a mechanism go by; choice: 'driver', 'time' or None: the driver, if there is one only.

    Raises:
        MechanismError: The mechanism has no driver, or several where one is needed.

    """
    drivers, run = mechanism.drivers, mechanism.run
    if not drivers:
        raise MechanismError(f"{mechanism.name} has no driver; a fit needs one")
    if choice not in (None, *CHOICES):
        raise MechanismError(f"over = {choice!r} must be 'driver' or 'time'")
    if choice == "driver" and len(drivers) > 1:
        raise MechanismError(f"over = 'driver' needs one driver; {mechanism.name} has {len(drivers)}: write 'time'")
    if choice == "time" or len(drivers) > 1:
        return Argument("time", Quantity("time"), "", run.start, run.stop)
    (driver,) = drivers
    start = float(driver.law.at(run.start))
    end = start + math.tau
    if driver.quantity.kind != "angle":
        values = [float(driver.law.at(t)) for t in run_times(run).tolist()]
        start, end = min(values), max(values)
    return Argument(driver.name, driver.quantity, driver.inputs()[0], start, end)
