"""Efforts of drivers and external loads: numbers, laws of time, functions, or tables over time."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from kinfmu.errors import RequestError, valid_names
from kinfmu.mechanism.laws import External, Law
from kinfmu.mechanism.laws.law import Jumps
from kinfmu.mechanism.loads import Load
from kinfmu.mechanism.valid import is_number, quoted
from kinfmu.run import MOST_SAMPLES
from kinfmu.run.driving import numbers_of

TIME = "time"  # the column of a table
_VALID = "a number, a law of time, a function of t or of (t, state), or an array with 'time'"

State = Mapping[str, float]  # values and speeds of the drivers by the names of their inputs
Effort = Callable[[float, State], float]


class Efforts(NamedTuple):
    """Efforts by the names of their inputs, and the times at which they jump."""

    by_name: Mapping[str, Effort]
    jumps: tuple[float, ...]

    def at(self, t: float, state: State) -> tuple[float, ...]:
        """Return all efforts [N, N m]; raise a RequestError if one is not a finite number."""
        efforts = tuple([effort(t, state) for effort in self.by_name.values()])
        for name, value in zip(self.by_name, efforts, strict=True):
            if not isfinite(value):
                raise RequestError(f"{name} = {value} at t = {t:g} s must be a finite number")
        return efforts


def read_efforts(known: Sequence[str], given: Mapping[str, Any], span: tuple[float, float]) -> Efforts:
    """Return the efforts of inputs, 0 where none is given, for a span of time.

    Raise a RequestError if a name is unknown or a value is invalid.
    """
    for name in given:
        if name != TIME and name not in known:
            raise RequestError(f"input '{name}' is not known{valid_names(name, known, 'inputs')}")
    jumps: set[float] = set()
    times = _times(given[TIME]) if TIME in given else None
    by_name = {}
    for name in known:
        value = given.get(name, 0.0)
        if is_number(value):
            by_name[name] = _constant(float(value))
        elif isinstance(value, Law) and not isinstance(value, External):
            value.check(name)
            by_name[name] = _of_law(value)
            jumps.update(_within(value.own_breaks(), span))
        elif callable(value):
            by_name[name] = _function(name, value)
        elif times is not None and not isinstance(value, str):
            by_name[name] = _table(name, times, value)
            jumps.update(t for t in times.tolist() if span[0] < t < span[1])
        else:
            raise RequestError(f"{name} = {quoted(value)} must be {_VALID}")
    return Efforts(by_name, tuple(sorted(jumps)))


def jumps_of_loads(loads: Sequence[Load], span: tuple[float, float]) -> set[float]:
    """Return the times at which laws of loads over time jump."""
    found: set[float] = set()
    for load in loads:
        law = getattr(load, "law", None)
        if law is not None and getattr(load, "over", None) is None:
            found.update(_within(law.own_breaks(), span))
    return found


def _within(jumps: Jumps, span: tuple[float, float]) -> Iterator[float]:
    """Yield the times of jumps inside a span."""
    first, last = span
    period = float(jumps.period)
    for at in map(float, jumps.at):
        if not period > 0.0:
            yield from (at,) * (first < at < last)
            continue
        if (last - first) / period > MOST_SAMPLES:
            raise RequestError(f"a law that repeats every {period:g} s jumps more than {MOST_SAMPLES} times in the run")
        low, high = np.ceil((first - at) / period), np.floor((last - at) / period)
        yield from (t for t in (at + k * period for k in range(int(low), int(high) + 1)) if first < t < last)


def _constant(value: float) -> Effort:
    return lambda t, state: value  # noqa: ARG005  a constant depends on neither


def _of_law(law: Law) -> Effort:
    return lambda t, state: float(law.at(t))  # noqa: ARG005  laws are over time


def _function(name: str, function: Callable[..., Any]) -> Effort:
    """Return a function of t, or of t and the state, as one of both."""
    try:
        parameters = inspect.signature(function).parameters.values()
        required = [p for p in parameters if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
        count = len([p for p in required if p.default is p.empty]) or min(len(required), 1)
    except (TypeError, ValueError):  # functions of C libraries may have no signature
        count = 1
    if count not in (1, 2):
        raise RequestError(f"{name}: the function must take t, or t and the state, not {count} arguments")

    def effort(t: float, state: State) -> float:
        value = function(t) if count == 1 else function(t, state)
        try:
            return float(value)
        except (TypeError, ValueError):
            raise RequestError(f"{name} = {quoted(value)} at t = {t:g} s must be a finite number") from None

    return effort


def _times(values: Any) -> Any:
    times = numbers_of("time", values)
    if times.ndim != 1 or len(times) == 0 or not np.isfinite(times).all() or not (np.diff(times) > 0.0).all():
        raise RequestError("time must be finite numbers that increase")
    return times


def _table(name: str, times: Any, values: Any) -> Effort:
    column = numbers_of(name, values, _VALID)
    if column.shape != times.shape or not np.isfinite(column).all():
        raise RequestError(f"{name} must have {len(times)} finite numbers, one for each time")
    return lambda t, state: float(np.interp(t, times, column))  # noqa: ARG005  tables are over time
