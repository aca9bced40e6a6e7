"""Driver values: as text, and over a run."""

from __future__ import annotations

import math

import numpy as np

from kinfmu.mechanism import RunSettings
from kinfmu.mechanism.drivers import Driver

LOOKS = 201  # times of a run at which a driver is evaluated


def value_text(value: float, unit: str, kind: str) -> str:
    """Return a driver value as text: 'pi (180 deg)', '0.7227 rad (41.41 deg)' or '0.35 m'."""
    if kind != "angle":
        return f"{value:.9g} {unit}"
    return f"{multiple_of_pi(value) or f'{value:.9g} rad'} ({round(math.degrees(value), 8) + 0.0:.9g} deg)"


def place_text(value: float, unit: str) -> str:
    """Return where something occurs as text: '41.41 deg' for an angle in rad, '0.35 m', '1.2 s'."""
    return degrees(value) if unit == "rad" else f"{value:.6g} {unit}"


def driver_text(driver: Driver, value: float, unit: str) -> str:
    """Return a driver with its value as text: 'crank = pi (180 deg)'."""
    return f"{driver.name} = {value_text(value, unit, driver.quantity.kind)}"


def law_values(driver: Driver, run: RunSettings) -> list[float]:
    """Return the driver's values at 201 times of a run."""
    return [float(driver.law.at(t)) for t in np.linspace(run.start, run.stop, LOOKS).tolist()]


def multiple_of_pi(value: float) -> str | None:
    """Return '0', 'pi', '3 pi/2' for simple fractions of pi, to nine digits; None for others."""
    for denominator in (1, 2, 3, 4, 6):
        numerator = value / math.pi * denominator
        if abs(numerator - round(numerator)) < 1e-9:
            whole = round(numerator)
            if whole == 0:
                return "0"
            sign, size = ("-" if whole < 0 else ""), abs(whole)
            top = "pi" if size == 1 else f"{size} pi"
            return f"{sign}{top}" if denominator == 1 else f"{sign}{top}/{denominator}"
    return None


def degrees(angle: float) -> str:
    """Return an angle [rad] as text: '41.4096 deg'."""
    return f"{round(math.degrees(angle), 4) + 0.0:.6g} deg"
