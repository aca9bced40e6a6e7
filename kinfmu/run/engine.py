"""Engines: per-sample diagnostics of a sweep, what every engine can do, and the Python engine."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import combinations
from typing import Literal, NamedTuple, Protocol

import numpy as np

from kinfmu.arrays import FloatArray, IntArray, new_numbers
from kinfmu.errors import KinfmuError, RequestError, valid_names
from kinfmu.solver.python import Pose, Solver
from kinfmu.solver.python.pose import Vector, evaluated

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
        raise RequestError(f"engine '{engine}' is not known{valid_names(engine, ENGINES, 'engines')}")


def tables_for(out: Tables | None, shape: tuple[int, int], order: Literal["C", "F"]) -> Tables:
    """Return the tables that are given, checked, or new ones."""
    if out is None:
        rows, columns = shape
        whole = new_numbers(3, *shape) if order == "C" else new_numbers(3, columns, rows).transpose(0, 2, 1)
        return tuple(whole)  # three; the system provides one large array faster
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


_GAP = float("nan")


class PoseHistory:
    """The poses of a run's samples, kept as their unknowns; poses of bridges are kept whole.

    driven: u, ud, udd of the drivers, (n, d) each.
    """

    def __init__(self, solver: Solver, driven: tuple[FloatArray, FloatArray, FloatArray]) -> None:
        self._solver = solver
        self._driven = driven
        self._found: list[Pose | Vector | None] = []

    def add(self, pose: Pose) -> None:
        """Add the good pose of the next sample."""
        self._found.append(pose if pose.bridge is not None or (pose.tracks and pose.status) else pose.z)

    def add_gap(self) -> None:
        """Add a sample without numbers."""
        self._found.append(None)

    def margins(self) -> FloatArray:
        """Return (n,) margins; NaN for samples without numbers."""
        table = np.full(len(self._found), np.nan)
        for k, pose, _, _ in self._poses():
            table[k] = self._solver.margin(pose)
        return table

    def errors(self) -> FloatArray:
        """Return (n, 3) estimated errors of q, qd, qdd; NaN for samples without numbers."""
        table = np.full((len(self._found), 3), np.nan)
        for k, pose, ud, udd in self._poses():
            table[k] = self._solver.errors(pose, ud, udd)
        return table

    def _poses(self) -> Iterator[tuple[int, Pose, Vector, Vector]]:
        model = self._solver.model
        samples = zip(self._found, *(map(tuple, table.tolist()) for table in self._driven), strict=True)
        for k, (found, u, ud, udd) in enumerate(samples):
            if found is not None:
                yield k, found if isinstance(found, Pose) else Pose(u, evaluated(model, u, found)), ud, udd


class PythonEngine:
    """The engine that follows each sample from the last good one by the generated Python."""

    name = "python"
    order: Literal["C", "F"] = "C"

    def __init__(self, solver: Solver) -> None:
        self._solver = solver
        self.fixed: Mapping[str, float] = solver.model.FIXED

    def drive(self, times: FloatArray, constants: Sequence[float]) -> Driven:
        """Return driver values, speeds and accelerations at times, by the laws."""
        model, values = self._solver.model, tuple(constants)
        driven = np.array([model.drive(t, values) for t in times.tolist()], dtype=float)  # (n, 3, d)
        driven = driven.reshape(len(times), 3, len(model.DRIVERS))
        return driven[:, 0], driven[:, 1], driven[:, 2]

    def sweep(self, driven: Driven, tables: Tables) -> SweepResult:
        """Fill the tables, with NaN for samples that cannot be reached, and return the diagnostics."""
        solver = self._solver
        n, m = tables[0].shape
        watch_count = len(solver.model.WATCHES)
        gap: Vector = (_GAP,) * (3 * m)
        motions: list[Vector] = []
        outcomes: list[Vector] = []
        watches: list[Vector] = []
        failures = []
        history = PoseHistory(solver, driven)
        good, failing = solver.anchor, False
        for k, (u, ud, udd) in enumerate(zip(*(map(tuple, table.tolist()) for table in driven), strict=True)):
            pose = solver.solve(good, u)
            if pose.good:
                good, failing = pose, False
                history.add(pose)
                outcomes.append((pose.status, pose.residual, pose.iterations))
                motions.append(solver.motion(pose, ud, udd))
                if watch_count:
                    watches.append(solver.watch(pose))
            else:
                history.add_gap()
                if not failing:
                    failures.append((k, pose.message))
                failing = True
                outcomes.append((pose.status, _GAP, 0))
                motions.append(gap)
                watches.append((_GAP,) * watch_count)
        whole = np.array(motions, dtype=float).reshape(n, 3, m)
        for k, array in enumerate(tables):
            array[:] = whole[:, k]
        return SweepResult(
            status=lambda: np.array([status for status, _, _ in outcomes], dtype=np.int64),
            iterations=lambda: np.array([iterations for _, _, iterations in outcomes], dtype=np.int64),
            residual=lambda: np.array([residual for _, residual, _ in outcomes], dtype=float),
            watch=lambda: np.array(watches, dtype=float).reshape(n, watch_count),
            margin=history.margins,
            error=history.errors,
            failures=tuple(failures),
        )
