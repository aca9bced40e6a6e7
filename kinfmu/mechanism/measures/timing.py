"""Readings of when a quantity moves and rests: time ratio and dwell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.errors import MechanismError
from kinfmu.mechanism.laws import LawQuantity
from kinfmu.mechanism.measures.reading import Begin, End, Finding, Measured, Motion, Reading
from kinfmu.mechanism.quantities.placement import Reference
from kinfmu.units import Quantity


@dataclass(frozen=True)
class TimeRatio(Reading):
    """Time of the slower stroke over that of the faster one (quick return), of a motion that goes round.

    The strokes lie between the smallest and the largest value of the quantity, one after the other. Of a quantity that
    repeats on the way, as over several turns of a crank, they are those of one repeat.
    """

    type: ClassVar[str] = "time_ratio"

    name: str
    of: Measured

    def read(self, motion: Motion) -> Finding:
        lacks = motion.at_rest(self.of), motion.turning_on(self.of, "so it has no two strokes")
        if not lacks[0][0].all():
            motion.require_closed(self.type)
        history = motion.history(self.of)
        low, high = (extreme.x for extreme in history.extremes())
        period = history.span / history.repeats()
        stroke = abs(high - low) % period
        longer = 0.5 * (period + abs(period - 2.0 * stroke))
        at = tuple(history.x[0] + (x - history.x[0]) % period for x in (low, high))
        return Finding(motion.ratio(longer, period - longer), Quantity("number"), at, lacks)


@dataclass(frozen=True)
class Dwell(Reading):
    """How far the driver moves while a quantity stays within a band below its maximum or above its minimum."""

    type: ClassVar[str] = "dwell"

    name: str
    of: Measured
    band: Annotated[float, LawQuantity("led"), "height of the band, positive"]
    near: Annotated[str, Reference("choice", ("maximum", "minimum")), "'maximum' or 'minimum'"] = "maximum"
    begin: Begin = None
    end: End = None

    def check(self) -> None:
        if not self.band > 0.0:
            raise MechanismError(f"[measures.{self.name}] band = {float(self.band):g} must be positive")

    def read(self, motion: Motion) -> Finding:
        history = motion.history(self.of)
        start, stop = (history if self.near == "maximum" else history.negative()).stay(self.band)
        lacks = (motion.turning_on(self.of, f"so it has no {self.near}"),)
        return Finding(motion.driven_between(start, stop), motion.driver_quantity, (start, stop), lacks)
