"""Engines: per-sample diagnostics of a sweep, and what every engine can do."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations
from typing import Literal, NamedTuple, Protocol

import numpy as np

from kinfmu.arrays import FloatArray, IntArray
from kinfmu.errors import KinfmuError, RequestError, listed, suggestion

ENGINES = ("auto", "python", "native")

Driven = tuple[FloatArray, FloatArray, FloatArray]  # (n, d) values, speeds and accelerations of the drivers
Tables = tuple[FloatArray, FloatArray, FloatArray]  # (n, m) values, rates and accelerations of the outputs


class UnreachedError(KinfmuError):
    """Parameters, or the start of the laws with them, that continuation from the anchor does not reach."""


class SweepResult(NamedTuple):
    """Per-sample diagnostics as in Run, as functions that return them.

    failures: the first sample of each interval without numbers, and the reason.
    """

    status: Callable[[], IntArray]
    iterations: Callable[[], IntArray]
    residual: Callable[[], FloatArray]
    watch: Callable[[], FloatArray]
    margin: Callable[[], FloatArray]
    error: Callable[[], FloatArray]
    failures: tuple[tuple[int, str], ...]


class Engine(Protocol):
    """A solver of a plan at many samples. order: of the fastest tables; fixed: coordinates that never move."""

    name: str
    order: Literal["C", "F"]

    @property
    def fixed(self) -> Mapping[str, float]: ...

    def drive(self, times: FloatArray, constants: Sequence[float]) -> Driven:
        """Return driver values, speeds and accelerations at times, by the laws."""

    def sweep(self, driven: Driven, tables: Tables) -> SweepResult:
        """Fill the tables, with NaN for samples that cannot be reached, and return the diagnostics."""


def require_engine(engine: str) -> None:
    """Raise a RequestError for the name of an unknown engine."""
    if engine not in ENGINES:
        raise RequestError(f"engine '{engine}' is not known{suggestion(engine, ENGINES)}; engines: {listed(ENGINES)}")


def tables_for(out: Tables | None, shape: tuple[int, int], order: Literal["C", "F"]) -> Tables:
    """Return the tables that are given, checked, or new ones."""
    if out is None:
        rows, columns = shape
        whole = np.empty((3, *shape)) if order == "C" else np.empty((3, columns, rows)).transpose(0, 2, 1)
        return tuple(whole)  # type: ignore[return-value]  # three; the system provides one large array faster
    names = ("values", "rates", "accelerations")
    if not isinstance(out, tuple | list) or len(out) != len(names):
        given = f"{len(out)}" if isinstance(out, tuple | list) else type(out).__name__
        raise RequestError(f"out must be three arrays, ({', '.join(names)}), not {given}")
    for name, array in zip(names, out, strict=True):
        _refuse_table(name, array, shape)
    for (name, array), (other, following) in combinations(zip(names, out, strict=True), 2):
        if np.shares_memory(array, following):
            raise RequestError(f"out: {name} and {other} share memory; each needs an array of its own")
    return tuple(out)  # type: ignore[return-value]  # three


def _refuse_table(name: str, array: object, shape: tuple[int, ...]) -> None:
    if not isinstance(array, np.ndarray) or isinstance(array, np.ma.MaskedArray):
        raise RequestError(f"out: {name} must be a numpy array, float64 of shape {shape}, not {type(array).__name__}")
    if array.shape != shape or array.dtype != np.float64:
        raise RequestError(f"out: {name} must be float64 of shape {shape}, not {array.dtype} of {array.shape}")
    if not array.flags.writeable:
        raise RequestError(f"out: {name} is read-only")
