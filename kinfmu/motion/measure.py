"""`measure`: what designers read off a motion, as named values with units."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray
from kinfmu.display import Displayed
from kinfmu.errors import RequestError, valid_names
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.force_names import measured_forces
from kinfmu.mechanism.measures import Reading
from kinfmu.mechanism.valid import quoted
from kinfmu.motion.history import History
from kinfmu.motion.motion import Motion
from kinfmu.run import Run
from kinfmu.run.axis import HasAxis, axis_of
from kinfmu.run.solve import solve
from kinfmu.units import Quantity, unit_of

_SAMPLES = 360  # of the geometry of a motion, in a turn and in every range
_AT_REST = 1e-12  # of the value of the driver; one that changes by less does not move


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
        value, *at = (number if np.isfinite(number) else None for number in (self.value, *self.at))
        return asdict(self) | {"value": value, "at": at, "reason": self.reason or None}


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
    readings = with_measures(run.mechanism, measures).measures
    motion = Motion.of_run(run)
    return MeasuredValues((reading.name, read_value(run, motion, reading)) for reading in readings)


def with_measures(mechanism: Mechanism, measures: Iterable[Reading | str] | Reading | str | None) -> Mechanism:
    """Return a mechanism with the measures of a call, checked and with numbers for texts; None: with its own."""
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
            raise RequestError(f"there is no measure {quoted(one)}{valid_names(one, own, 'measures')}")
    return replace(mechanism, measures=tuple(chosen))


def listed_measures(measures: Iterable[Reading | str] | Reading | str) -> list[Reading | str]:
    """Return the measures of a call, of which one can come without a list.

    Raise a RequestError if they are neither measures nor names.
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
    with _named_in_errors(reading):
        motion = geometry_of(run, motion, reading, solved)
        motion = motion.going_round(bool(motion.goes_round(motion.names.quantities(reading))))
    values = read_values(motion, reading)
    has_value = bool(np.isfinite(values.value))
    return MeasuredValue(
        name=reading.name,
        type=reading.type,
        value=float(values.value),
        unit=unit_of(values.quantity, unit),
        driver=motion.driver,
        at=tuple(map(float, values.at)),
        at_unit=unit_of(motion.driver_quantity, unit),
        reason="" if has_value else str(values.reason) or _reason(run, reading),
    )


class Values(NamedTuple):
    """A measure of one design or of many.

    value: (...) NaN where there is none; quantity: what it measures; at: (...) each, values of the driver where it
    occurs; reason: (...) why designs whose samples all have numbers have no value, else ''.
    """

    value: FloatArray
    quantity: Quantity
    at: tuple[FloatArray, ...]
    reason: NDArray[np.str_]


def read_values(motion: Motion, reading: Reading) -> Values:
    """Return a measure of all designs of a motion, which goes round or does not for all of them.

    Raise a RequestError that names the measure if the motion does not fit.
    """
    with _named_in_errors(reading), np.errstate(all="ignore"):  # quotients at samples where the driver rests are NaN
        found = reading.read(motion.part(reading.begin, reading.end))
        value, reason = np.asarray(found.value, dtype=float), np.full(np.shape(found.value), "")
        for is_lacking, text in found.lacks:
            reason = np.where((reason == "") & is_lacking, text, reason)
        at = tuple(np.asarray(motion.driven_at(np.asarray(x))) for x in found.at)
    return Values(np.where(np.isfinite(value) & (reason == ""), value, np.nan), found.quantity, at, reason)


@contextmanager
def _named_in_errors(reading: Reading) -> Iterator[None]:
    """Let messages about a motion begin with the measure."""
    try:
        yield
    except RequestError as error:
        raise RequestError(f"[measures.{reading.name}]: {error}") from None


def _reason(run: Run, reading: Reading) -> str:
    """Return why a measure of a run has no value."""
    of = getattr(reading, "of", None)
    made = measured_forces(run.mechanism).get(of, ()) if run.mechanism and isinstance(of, str) else ()
    if any(run.good.any() and not np.isfinite(run[name][run.good]).any() for name in made):
        return (
            f"'{of}' is not determined: redundant rows share the load, the contact of a cam is unknown, or laws of "
            "loads have no times"
        )
    return reason_without_value(run, int(np.count_nonzero(~run.good)), int(np.argmin(run.good)))


def reason_without_value(samples: HasAxis, missing: int, first: int) -> str:
    """Return why a measure has no value; missing: how many samples have no numbers, and the first of them."""
    if not missing:
        return "the quantity has no finite value at some samples"
    place = axis_of(samples).place(float(samples.t[first]))
    return f"{missing} of {len(samples.t)} samples have no numbers, the first at {place}"


def moves_evenly(drive: History) -> bool:
    """Return True for a driver with one speed that is not 0, at which the motion is its geometry."""
    return drive.is_linear and bool(drive.rate[0])


def geometry_of(run: Run, motion: Motion, reading: Reading, solved: Callable[..., Run] | None = None) -> Motion:
    """Return the motion on which a measure is read: of one that compares rates the geometry of the run.

    Raise a RequestError if the driver does not move.

    reading: The measure. A rate over another is not geometry. solved: Solves the run's mechanism for inputs. Default:
    `solve`.
    """
    drive, orders = motion.drive, motion.names.orders
    if not reading.compares_rates or drive is None or moves_evenly(drive) or not run.good.all():
        return motion
    if any(orders[name][1] for name in reading.quantities() if isinstance(name, str) and name in orders):
        return motion  # the rate of a rate
    low, high = (float(extreme.value) for extreme in drive.extremes())
    if high - low <= _AT_REST * max(abs(low), abs(high)):
        raise RequestError(f"{motion.driver} does not move")
    angle, speed, _ = next(one.inputs() for one in motion.mechanism.drivers if one.name == motion.driver)
    turns = (high - low) / math.tau if angle.quantity.kind == "angle" else 1.0
    values = np.linspace(low, high, _SAMPLES * math.ceil(max(turns, 1.0)) + 1)
    solved = solved or partial(solve, replace(motion.mechanism, coordinates="all"))
    return Motion.of_run(solved(**{angle: values, speed: 1.0}))
