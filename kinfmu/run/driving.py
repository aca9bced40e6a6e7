"""What moves a sweep: times for the laws, or driver values as inputs, read as arrays of numbers."""

from __future__ import annotations

import math
import sys
from collections.abc import Collection, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinfmu.arrays import FloatArray, new_numbers
from kinfmu.errors import KinfmuError, RequestError, listed, valid_names
from kinfmu.mechanism import RunSettings
from kinfmu.plan import DriverInfo
from kinfmu.run import MOST_SAMPLES
from kinfmu.run.engine import Driven
from kinfmu.solver.python.bridge import TURN, turned

_DOUBLE = np.dtype(np.float64)
_NO_NUMBERS: dict[tuple[type, ...], str] = {  # types that numpy makes floats of
    (bool, np.bool_): "true or false",
    (complex, np.complexfloating): "complex",
    (np.datetime64,): "dates",
    (np.timedelta64,): "durations; divide them by a unit, such as np.timedelta64(1, 's')",
    (np.void,): "records of several fields",
}
_HALF = 0.5 + 1e-9  # [turns]; a step of half a turn, within rounding, is unchanged
LARGEST_RATE = 1e100  # of drivers; squares of much larger numbers are infinite
_LARGEST_KEPT = 1_000_000  # numbers of a table of equal ones that is kept
_FEW = 50  # numbers that are checked sooner one by one
_MANY = 10_000  # numbers from which on their memory and one pass less count
_NUMBER = (float, int)
_DEFAULTS = (0.0, 1.0, 0.0)  # of value (which must be given), speed and acceleration


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


def times_of(run: RunSettings, t: ArrayLike | None) -> FloatArray:
    """Return the times (n,) [s] of a call: those of the file's run if `t` is None."""
    return column_of("t", run_times(run) if t is None else t)


def refuse_both(t: ArrayLike | None, inputs: Collection[str]) -> None:
    """Raise a RequestError if times and inputs are given."""
    if inputs and t is not None:
        raise RequestError(f"give times or inputs, not both: t and {listed(inputs)}")


def driven_by_inputs(
    drivers: Sequence[DriverInfo], inputs: Mapping[str, ArrayLike], *, wrap: bool = False, rows: int = 1
) -> Driven:
    """Return values, speeds and accelerations of the drivers from inputs by name.

    Args:
        drivers: The drivers of a plan, which have the inputs.
        inputs: Arrays (n,) or numbers by name, such as crank_angle [rad]; with designs also (m, n).
        wrap: Unwrap angles.
        rows: How many designs there are, the m of inputs (m, n).

    Returns:
        Values, speeds and accelerations, (n, d) each; (m, n, d) if an input is (m, n).

    Raises:
        RequestError: An input is unknown, missing or invalid, or the lengths differ.

    """
    if len(drivers) == len(inputs) == rows == 1 and not wrap and drivers[0].inputs[0] in inputs:
        (name,) = inputs  # the values of a single driver: a short call is done here
        column = column_of(name, inputs[name])
        if len(column) <= _MANY:
            table = column.reshape(-1, 1).copy()
        else:
            table = new_numbers(len(column), 1)
            table[:, 0] = column
        return table, _filled(table.shape, _DEFAULTS[1]), _filled(table.shape, _DEFAULTS[2])
    names = [name for driver in drivers for name in driver.inputs]
    for name in inputs:
        if name not in names:
            raise RequestError(f"input '{name}' is not known{valid_names(name, names, 'inputs')}; times go by t")
    for driver in drivers:
        if driver.inputs[0] not in inputs:
            raise RequestError(f"input '{driver.inputs[0]}' is missing; give times or every driver's value")
    columns = {name: column_of(name, value, rows) for name, value in inputs.items()}
    if wrap:
        angles = [driver.inputs[0] for driver in drivers if driver.quantity.kind == "angle"]
        if not angles:
            raise RequestError(f"wrap unwraps angles, and no input is one; inputs: {listed(names)}")
        columns |= {name: np.apply_along_axis(unwrap, -1, columns[name]) for name in angles}
    lengths = {array.shape[-1] for array in columns.values()}
    if len(lengths - {1}) > 1:
        sizes = listed(f"{name} ({array.shape[-1]})" for name, array in columns.items())
        raise RequestError(f"inputs must have equal lengths or be single numbers: {sizes}")
    n = next(iter(lengths - {1}), min(lengths, default=1))
    is_by_design = rows > 1 and any(array.ndim == 2 for array in columns.values())
    shape = (rows, n) if is_by_design else (n,)
    for driver in drivers:
        for name in driver.inputs[1:]:
            if name in columns:
                _refuse_huge(name, columns[name])
    u, ud, udd = (
        _table([columns.get(driver.inputs[order]) for driver in drivers], shape, default)
        for order, default in enumerate(_DEFAULTS)
    )
    return u, ud, udd


def _table(columns: Sequence[FloatArray | None], shape: tuple[int, ...], default: float) -> FloatArray:
    """Return a table (n, d) or (m, n, d) of columns, of which None are the default.

    Columns are copied: a run reads them later too, when the caller may have changed them.
    """
    if all(column is None for column in columns):
        return _filled((*shape, len(columns)), default)
    table = np.empty((*shape, len(columns)))
    for k, column in enumerate(columns):
        table[..., k] = default if column is None else column
    return table


def _filled(shape: tuple[int, ...], value: float) -> FloatArray:
    """Return a table of equal numbers; the last ones are kept, because filling them takes as long as solving."""
    return _constant(shape, value) if math.prod(shape) <= _LARGEST_KEPT else np.full(shape, value)


@lru_cache(maxsize=4)
def _constant(shape: tuple[int, ...], value: float) -> FloatArray:
    numbers = np.full(shape, value)
    numbers.flags.writeable = False
    return numbers


def with_constants(drivers: Sequence[DriverInfo], driven: Driven, inputs: Mapping[str, ArrayLike]) -> Driven:
    """Return the same driver values; tables of single numbers repeat one row, which costs no memory to read."""
    if not inputs or not len(driven[0]):
        return driven
    tables = []
    for order, table in enumerate(driven):
        is_constant = all(isinstance(inputs.get(driver.inputs[order], 0.0), _NUMBER) for driver in drivers)
        if is_constant:  # np.broadcast_to takes 10 us
            table = np.ndarray(table.shape, float, table, strides=(0, table.strides[1]))
        tables.append(table)
    u, ud, udd = tables
    return u, ud, udd


def applied_efforts(known: Sequence[str], given: Mapping[str, ArrayLike], count: int) -> dict[str, FloatArray]:
    """Return the efforts of external loads at all samples, (n,) by the names of their inputs; 0 where none is given.

    Raise a RequestError if an effort is not a number, or neither one number nor one for each sample.
    """
    efforts = {}
    for name in known:
        column = column_of(name, given.get(name, 0.0))
        if len(column) not in (1, count):
            raise RequestError(
                f"{name} must be a number or have {count} values, one for each sample, not {len(column)}"
            )
        efforts[name] = np.broadcast_to(column, (count,)).copy()
    return efforts


def without_huge_rates(driven: Driven) -> Driven:
    """Return the driver values; NaN where a law has no value, or has rates whose squares overflow."""
    u, ud, udd = driven
    if _is_within(ud, LARGEST_RATE) and _is_within(udd, LARGEST_RATE):
        return driven
    has_value = (np.abs(ud) <= LARGEST_RATE) & (np.abs(udd) <= LARGEST_RATE)
    return np.where(has_value, u, np.nan), ud, udd


def _refuse_huge(name: str, rates: FloatArray) -> None:
    """Raise a RequestError for a speed or an acceleration of a driver whose square overflows."""
    if not _is_within(rates, LARGEST_RATE):
        *_, sample = place = tuple(np.argwhere(np.abs(rates) > LARGEST_RATE)[0])
        raise RequestError(f"{name} = {rates[place]:.6g} at sample {sample}: the largest value is {LARGEST_RATE:g}")


def _is_within(values: FloatArray, largest: float) -> bool:
    """Return True if all values are numbers of at most this size; no temporary arrays are made."""
    if values.size <= _FEW and math.hypot(*values.ravel().tolist()) <= largest:  # NaN stays
        return True
    if largest == sys.float_info.max and values.size > _MANY:
        with np.errstate(over="ignore", invalid="ignore"):
            if math.isfinite(values.sum()):  # one pass in place of two: infinity and NaN stay
                return True
    return bool(values.min(initial=0.0) >= -largest and values.max(initial=0.0) <= largest)


def column_of(name: str, values: ArrayLike, rows: int = 1) -> FloatArray:
    """Return finite numbers as an array (n,); with `rows` > 1 also (rows, n).

    Raises:
        RequestError: They are no finite numbers, or have another shape.

    """
    array = numbers_of(name, values)
    if array.ndim == 0:
        array = array.reshape(1)
    if array.ndim > 2 or (array.ndim == 2 and (rows == 1 or len(array) != rows)):
        rule = f"of shape (n,) or ({rows}, n)" if rows > 1 else "one-dimensional"
        raise RequestError(f"{name} must be {rule}, not of shape {array.shape}")
    if not _is_within(array, sys.float_info.max):
        place = np.unravel_index(int(np.argmin(np.isfinite(array))), array.shape)
        raise RequestError(f"{name}[{', '.join(map(str, place))}] is not a finite number")
    return array


def numbers_of(name: str, values: ArrayLike, what: str = "numbers") -> FloatArray:
    """Return an array of floats.

    Raises:
        RequestError: They are no real numbers, though numpy may make numbers of them, or some are masked.

    """
    if type(values) is np.ndarray and values.dtype is _DOUBLE:
        return values
    if type(values) is float:
        return np.array(values)
    items: Sequence[Any] = values if isinstance(values, list | tuple) else ()
    types: set[type] = set(map(type, items))
    try:
        if any(issubclass(one, np.ma.MaskedArray) for one in types):  # numpy would drop their masks
            values = np.ma.stack(list(map(np.ma.asanyarray, items)))
        array = np.asanyarray(values)
        types |= set(map(type, array.ravel().tolist())) if array.dtype == object else {array.dtype.type}
        for kinds, what_they_are in _NO_NUMBERS.items():
            if any(issubclass(one, kinds) for one in types):
                raise RequestError(f"{name} must be {what}, not {what_they_are}")
        if np.ma.is_masked(array):
            place = np.argwhere(np.ma.getmaskarray(array))[0]
            where = f"[{', '.join(map(str, place))}]" if array.ndim else ""
            raise RequestError(f"{name}{where} is masked; leave it out, or fill in a number")
        return np.asarray(array, dtype=float)
    except (TypeError, ValueError):
        raise RequestError(f"{name} must be {what}") from None


def unwrap(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the angles, each moved by whole turns to within half a turn of the one before.

        350, 10, 350 deg -> 350, 370, 350 deg

    angles: (n,) [rad]; the first is unchanged.
    """
    steps = np.diff(angles) / TURN
    back = np.sign(steps) * np.ceil(np.abs(steps) - _HALF)  # [turns]
    turns = -np.concatenate([[0.0], np.cumsum(back)])[: len(angles)]
    return np.array([turned(angle, n) for angle, n in zip(angles.tolist(), turns.tolist(), strict=True)])  # (n,)


def is_long(steps: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which steps between angles [rad] are longer than half a turn, so that unwrapping changes them."""
    return np.abs(steps) > _HALF * TURN
