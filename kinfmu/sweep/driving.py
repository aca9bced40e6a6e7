"""What moves a sweep: times for the laws, or driver values given as inputs."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from kinfmu.errors import KinfmuError, RequestError, listed, suggestion
from kinfmu.mechanism import RunSettings
from kinfmu.plan import DriverInfo
from kinfmu.run import MOST_SAMPLES, FloatArray
from kinfmu.run.unwrap import unwrap
from kinfmu.sweep.engine import Driven

LARGEST_RATE = 1e100  # of drivers; squares of much larger numbers are infinite


def run_times(run: RunSettings) -> FloatArray:
    """Return the times of a run.

        t = start + k step <= stop,   k = 0, 1, ...

    Args:
        run: Start, stop and step [s].

    Returns:
        The times (n,) [s]; the stop is one of them if a step hits it.

    Raises:
        KinfmuError: There are more than MOST_SAMPLES of them.

    """
    if (run.stop - run.start) / run.step > MOST_SAMPLES:
        raise KinfmuError(
            f"[run] {run.start:g} to {run.stop:g} s in steps of {run.step:g} s: more than {MOST_SAMPLES} samples"
        )
    count = int((run.stop - run.start) / run.step + 1e-6)
    return run.start + run.step * np.arange(count + 1, dtype=np.float64)


def driven_by_inputs(
    drivers: Sequence[DriverInfo], inputs: Mapping[str, ArrayLike], *, wrap: bool = False
) -> tuple[FloatArray, ...]:
    """Return sample numbers as times, and (n, d) values, speeds and accelerations from inputs by name.

    Args:
        drivers: The drivers of a plan, which have the inputs.
        inputs: Arrays (n,) or numbers by name, such as crank_angle [rad].
        wrap: Unwrap angles.

    Returns:
        Times (n,), values, speeds and accelerations (n, d).

    Raises:
        RequestError: An input is unknown, missing or invalid, or the lengths differ.

    """
    known = [name for driver in drivers for name in driver.inputs]
    for name in inputs:
        if name not in known:
            raise RequestError(
                f"input '{name}' is not known{suggestion(name, known)}; inputs: {listed(known)}; times go by t"
            )
    for driver in drivers:
        if driver.inputs[0] not in inputs:
            raise RequestError(f"input '{driver.inputs[0]}' is missing; give times or every driver's value")
    columns = {name: column_of(name, value) for name, value in inputs.items()}
    angles = [driver.inputs[0] for driver in drivers if driver.quantity.kind == "angle"]
    if wrap and not angles:
        raise RequestError(f"wrap unwraps angles, and no input is one; inputs: {listed(known)}")
    columns |= {name: unwrap(columns[name]) for name in angles if wrap}
    lengths = {len(column) for column in columns.values() if len(column) > 1}
    if len(lengths) > 1:
        sizes = listed(f"{name} ({len(column)})" for name, column in columns.items())
        raise RequestError(f"inputs must have equal lengths or be single numbers: {sizes}")
    n = lengths.pop() if lengths else min((len(column) for column in columns.values()), default=1)
    tables = []
    for order, default in enumerate((0.0, 1.0, 0.0)):
        given = [columns.get(driver.inputs[order], np.array([default])) for driver in drivers]
        tables.append(np.stack([np.broadcast_to(column, (n,)) for column in given], axis=1))
    return np.arange(n, dtype=float), *tables


def without_huge_rates(driven: Driven) -> Driven:
    """Return the driver values; NaN where a law has no value, or has rates whose squares overflow."""
    u, ud, udd = driven
    if _is_within(ud, LARGEST_RATE) and _is_within(udd, LARGEST_RATE):
        return driven
    has_value = (np.abs(ud) <= LARGEST_RATE) & (np.abs(udd) <= LARGEST_RATE)
    return np.where(has_value, u, np.nan), ud, udd


def refuse_huge_rates(drivers: Sequence[DriverInfo], driven: Driven) -> None:
    """Raise a RequestError for a speed or an acceleration of a driver whose square overflows."""
    for order in (1, 2):
        if not _is_within(driven[order], LARGEST_RATE):
            sample, number = np.argwhere(np.abs(driven[order]) > LARGEST_RATE)[0]
            raise RequestError(
                f"{drivers[number].inputs[order]} = {driven[order][sample, number]:.6g} at sample {sample}: "
                f"the largest value is {LARGEST_RATE:g}"
            )


def _is_within(values: FloatArray, largest: float) -> bool:
    """Return True if all values are numbers of at most this size; no temporary arrays are made."""
    return bool(values.min(initial=0.0) >= -largest and values.max(initial=0.0) <= largest)


def column_of(name: str, values: ArrayLike) -> FloatArray:
    """Return times or values of an input as numbers (n,); a RequestError for anything else."""
    try:
        column = np.atleast_1d(np.asarray(values, dtype=float))
    except (TypeError, ValueError):
        raise RequestError(f"{name} must be numbers") from None
    if column.ndim != 1:
        raise RequestError(f"{name} must be one-dimensional, not of shape {column.shape}")
    if not _is_within(column, sys.float_info.max):
        raise RequestError(f"{name}[{int(np.argmin(np.isfinite(column)))}] is not a finite number")
    return column
