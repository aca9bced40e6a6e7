"""`measure`: what designers read off a motion, as named values with units."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray
from kinfmu.display import Displayed
from kinfmu.errors import RequestError, listed, suggestion
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.force_names import measured_forces
from kinfmu.mechanism.measures import LowestMargin, Reading
from kinfmu.mechanism.measures.reading import Finding
from kinfmu.mechanism.valid import quoted
from kinfmu.motion.geometry import geometry_of
from kinfmu.motion.motion import Motion
from kinfmu.motion.needed import needed
from kinfmu.run import Run
from kinfmu.run.axis import HasAxis, axis_of
from kinfmu.units import unit_of


@dataclass(frozen=True)
class MeasuredValue:
    """The value of a measure.

    Attributes:
        name: Name of the measure.
        type: Its type, such as 'range'.
        value: In `unit`; nan if `reason` states why there is none.
        unit: Unit of the value; '1' for a pure number.
        driver: The driver in whose values `at` is; 'time' if several move.
        at: Where the value occurs: one driver value of an extreme; two of a range, a time ratio (smallest, largest) and
            a dwell (begin, end); none of a deviation.
        at_unit: Unit of these.
        reason: Why there is no value; '' if there is one.

    """

    name: str
    type: str
    value: float
    unit: str
    driver: str
    at: tuple[float, ...]
    at_unit: str
    reason: str = ""

    def as_json(self) -> dict[str, Any]:
        """Return the fields as plain data; unknown numbers are null."""
        known = np.isfinite(self.value)
        return {
            "name": self.name,
            "type": self.type,
            "value": self.value if known else None,
            "unit": self.unit,
            "driver": self.driver,
            "at": [value if np.isfinite(value) else None for value in self.at],
            "at_unit": self.at_unit,
            "reason": self.reason or None,
        }


class MeasuredValues(dict[str, MeasuredValue], Displayed):
    """Values of measures by name, in the order of the measures."""


def measure(run: Run, measures: Iterable[Reading | str] | None = None) -> MeasuredValues:
    """Measure a motion.

    Extremes lie between the samples where values, rates and accelerations of the samples place them (polynomials of
    degree 5), so that 361 samples of a turn give them to 1e-9. The ends of a motion count where it does not go round.

    Args:
        run: The motion: samples over time, or over the value of one driver at a constant speed.
        measures: Measures such as `kinfmu.measures.Range("stroke", of="slider.x")`, or names of those of the mechanism.
            Default: those of the mechanism.

    Returns:
        The values by name, in the order of the measures. A measure of samples without numbers is nan, with a reason.

    Raises:
        RequestError: A name is unknown, or the motion does not fit: too few samples, or no order in them.
        MechanismError: A measure is invalid.

    """
    if run.mechanism is None:
        raise RequestError("the run holds no mechanism, so nothing can be measured on it")
    readings = chosen_measures(run.mechanism, measures)
    motion = Motion.of_run(run, with_margin=any(isinstance(reading, LowestMargin) for reading in readings))
    return MeasuredValues((reading.name, read_value(run, motion, reading)) for reading in readings)


def chosen_measures(
    mechanism: Mechanism, measures: Iterable[Reading | str] | Reading | str | None
) -> tuple[Reading, ...]:
    """Return the measures of a call, checked and with numbers in place of texts."""
    return with_measures(mechanism, measures).measures


def with_measures(mechanism: Mechanism, measures: Iterable[Reading | str] | Reading | str | None) -> Mechanism:
    """Return a mechanism with the measures of a call in place of its own; None: its own."""
    if measures is None:
        return mechanism
    own = {reading.name: reading for reading in mechanism.measures}
    chosen: list[Reading] = []
    for one in listed_measures(measures):
        if isinstance(one, Reading):
            chosen.append(one)
        elif one in own:
            chosen.append(own[one])
        else:
            raise RequestError(f"there is no measure {quoted(one)}{suggestion(one, own)}; measures: {listed(own)}")
    return replace(mechanism, measures=tuple(chosen))


def listed_measures(measures: Iterable[Reading | str] | Reading | str) -> list[Reading | str]:
    """Return the measures of a call, of which one can come without a list.

    Raises:
        RequestError: They are neither measures nor names.

    """
    alone = isinstance(measures, str | Reading)
    if not alone and not isinstance(measures, Iterable):
        raise RequestError(f"measures = {measures!r} must be a list of measures or of names of measures")
    found = [measures] if alone else list(measures)  # type: ignore[arg-type]
    for one in found:
        if not isinstance(one, str | Reading):
            raise RequestError(f"measures: {one!r} is neither a measure such as kinfmu.measures.Range nor a name")
    return found  # type: ignore[return-value]


def read_value(run: Run, motion: Motion, reading: Reading, solved: Callable[..., Run] | None = None) -> MeasuredValue:
    """Return the value of a measure, which holds numbers, on a run and its motion.

    solved: Solves the run's mechanism for inputs; default: `solve`.
    """
    unit = motion.mechanism.length_unit
    try:
        motion = geometry_of(run, motion, reading, solved)
        quantities = needed(motion.mechanism, [reading]).quantities
        motion = motion.going_round(bool(motion.goes_round(quantities)))
        with np.errstate(all="ignore"):  # quotients at samples where the driver rests are NaN
            found = reading.read(motion.part(reading.begin, reading.end))
    except RequestError as error:
        raise RequestError(f"[measures.{reading.name}]: {error}") from None
    value, lack = known_values(found)
    at = tuple(float(motion.driven_at(np.asarray(x))) for x in found.at)
    return MeasuredValue(
        name=reading.name,
        type=reading.type,
        value=float(value),
        unit=unit_of(found.quantity, unit),
        driver=motion.driver,
        at=at,
        at_unit=unit_of(motion.driver_quantity, unit),
        reason="" if np.isfinite(value) else str(lack) or _reason(run, reading),
    )


def known_values(found: Finding) -> tuple[FloatArray, NDArray[np.str_]]:
    """Return the values of designs, NaN where there is none, and the reasons that the reading states, else ''."""
    value, reason = np.asarray(found.value, dtype=float), np.full(np.shape(found.value), "")
    for is_lacking, text in found.lacks:
        reason = np.where((reason == "") & is_lacking, text, reason)
    return np.where(np.isfinite(value) & (reason == ""), value, np.nan), reason


def _reason(run: Run, reading: Reading) -> str:
    """Return why a measure of a run has no value."""
    of = getattr(reading, "of", None)
    made = measured_forces(run.mechanism).get(of, ()) if run.mechanism and isinstance(of, str) else ()
    if any(run.good.any() and not np.isfinite(run[name][run.good]).any() for name in made):
        return (
            f"'{of}' is not determined: redundant rows share the load, the contact of a cam is unknown, or laws of "
            "loads have no times"
        )
    return reason_without_value(run, run.good)


def reason_without_value(samples: HasAxis, good: NDArray[np.bool_]) -> str:
    """Return why a measure has no value; good: (n,) True for samples with numbers."""
    missing = np.flatnonzero(~good)
    if not len(missing):
        return "the quantity has no finite value at some samples"
    first = axis_of(samples).place(float(samples.t[missing[0]]))
    return f"{len(missing)} of {len(good)} samples have no numbers, the first at {first}"
