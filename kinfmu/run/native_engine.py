"""The native engine: whole arrays of samples through the compiled C of a plan."""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray, new_numbers
from kinfmu.codegen.c import compiler
from kinfmu.codegen.c.model import emit
from kinfmu.codegen.lanes import sources
from kinfmu.codegen.lanes.stage import address_of as _start
from kinfmu.errors import KinfmuError
from kinfmu.plan import SolvePlan
from kinfmu.run.engine import Driven, SweepResult, Tables, UnreachedError
from kinfmu.solver.python.pose import Status
from kinfmu.solver.python.solver import TOLERANCE


class NativeEngine:
    """The engine of a plan's compiled library.

    Args:
        library: The compiled plan.
        parameters: Values to set by continuation from those of the plan; empty: those of the plan.
        fixed: Returns the coordinates that never move, by name.
        tolerance: Residual relative to the size above which a sample is not ok.

    """

    name = "native"
    order: Literal["C", "F"] = "F"

    def __init__(
        self, library: Library, parameters: Sequence[float], fixed: Callable[[], Mapping[str, float]], tolerance: float
    ) -> None:
        self._library = library
        self._parameters = parameters
        self._tolerance = tolerance
        self._fixed = fixed

    @property
    def fixed(self) -> Mapping[str, float]:
        return self._fixed()

    def drive(self, times: FloatArray, constants: Sequence[float]) -> Driven:
        """Return driver values, speeds and accelerations at times, by the laws."""
        return self._library.drive(times, constants, self._parameters)

    def sweep(self, driven: Driven, tables: Tables) -> SweepResult:
        """Fill the tables, with NaN for samples that cannot be reached, and return the diagnostics."""
        plain = all(map(_is_plain, tables))
        filled = tables if plain else [np.empty(table.shape, order="F") for table in tables]
        result = self._library.sweep(driven, filled, self._parameters, self._tolerance)
        if not plain:
            for table, values in zip(tables, filled, strict=True):
                table[:] = values
        diagnosis = _Diagnosis(
            lambda: self._library.diagnose(driven, result.outcomes, self._parameters, self._tolerance)
        )
        return SweepResult(
            status=lambda: result.outcomes[:, 0].astype(np.int64),
            iterations=lambda: result.outcomes[:, 1].astype(np.int64),
            residual=lambda: result.residual,
            watch=lambda: result.watch,
            margin=lambda: diagnosis.both[0],
            error=lambda: diagnosis.both[1],
            failures=result.failures,
        )


class _Diagnosis:
    """Margins and errors of a sweep: both are computed when either is first read."""

    def __init__(self, compute: Callable[[], tuple[FloatArray, FloatArray]]) -> None:
        self._compute = compute

    @cached_property
    def both(self) -> tuple[FloatArray, FloatArray]:
        return self._compute()


def _is_plain(table: FloatArray) -> bool:
    """Return whether the engine can fill a table: places and strides are whole numbers, and the strides positive."""
    flags = table.flags
    return flags.aligned and (flags.f_contiguous or all(stride > 0 and stride % 8 == 0 for stride in table.strides))


FLAGS = compiler.VECTORIZED
RARE = {  # what runs at few samples, joined
    "singular_points.c": ("bridge.c", "singularity_map.c", "span.c", "tracks.c"),
    "diagnosis.c": ("designs.c", "estimate.c", "limit.c", "linear.c", "worst_case_step.c"),
}
MESSAGE = 480  # characters, as KF_MESSAGE
MOST_FAILURES = 1000  # intervals without numbers whose reasons are kept

MOST_KEPT = 100_000  # samples; memory that served longer sweeps goes back to the system

_Place = ctypes.c_void_p  # of an array's first number


class _Table(ctypes.Structure):
    """kf_table of sweep.h."""

    _fields_ = (("start", _Place), ("row", ctypes.c_ssize_t), ("column", ctypes.c_ssize_t))


class _Job(ctypes.Structure):
    """kf_job of sweep.h."""

    _fields_ = (
        ("count", ctypes.c_int64),
        ("u", _Place),
        ("ud", _Place),
        ("udd", _Place),
        ("tables", _Table * 3),
        ("outcomes", _Place),
        ("residual", _Place),
        ("watches", _Place),
        ("most_failures", ctypes.c_int64),
        ("failure_count", ctypes.c_int64),
        ("failures", _Place),
        ("messages", _Place),
        ("side_by_side", ctypes.c_int64),
        ("gaps", ctypes.c_int64),
    )


class _Designs(ctypes.Structure):
    """kf_designs of designs.h."""

    _fields_ = (
        ("count", ctypes.c_int64),
        ("parameters", _Place),
        ("drive_step", ctypes.c_ssize_t),
        ("times", _Place),
        ("constants", _Place),
        ("constant_step", ctypes.c_ssize_t),
        ("start", ctypes.c_double),
        ("samples", _Job),
        ("table_step", ctypes.c_ssize_t * 3),
        ("status", _Place),
        ("reached", _Place),
        ("status_step", ctypes.c_ssize_t),
        ("messages", _Place),
        ("read", _Place),
        ("context", _Place),
    )


_sweep, _job = ctypes.c_void_p, ctypes.POINTER(_Job)
_FUNCTIONS: dict[str, tuple[Any, ...]] = {  # of sweep.h and designs.h: types of the result and of the arguments
    "kf_sweep_new": (_sweep, ctypes.c_double),
    "kf_sweep_start": (None, _sweep, ctypes.c_double),
    "kf_sweep_free": (None, _sweep),
    "kf_sweep_bind": (ctypes.c_bool, _sweep, _Place),
    "kf_sweep_run": (ctypes.c_bool, _sweep, _job),
    "kf_sweep_diagnose": (ctypes.c_bool, _sweep, _job, _Place, _Place),
    "kf_sweep_message": (ctypes.c_char_p, _sweep),
    "kf_sweep_starts": (ctypes.c_bool, _sweep, _Place, ctypes.c_double),
    "kf_drive_all": (ctypes.c_bool, ctypes.c_int64, *[_Place] * 6),
    "kf_designs_run": (ctypes.c_bool, _sweep, ctypes.POINTER(_Designs)),
}


class LibraryResult(NamedTuple):
    """Per-sample diagnostics of a sweep, as in Run.

    outcomes: (n, 2), status and iterations; failures: first sample and message of each interval without numbers, and
    after MOST_FAILURES of them how many more there are; side_by_side: how many samples were solved in lanes.
    """

    outcomes: NDArray[np.int32]
    residual: FloatArray
    watch: FloatArray
    failures: tuple[tuple[int, str], ...]
    side_by_side: int


class DesignReader(NamedTuple):
    """A C function that reads each design as soon as it is solved, and what it needs: addresses. See designs.h."""

    function: int
    context: int


class LawDriven(NamedTuple):
    """Designs driven by the laws: times (n,), law constants (c,) or (m, c), and the time at which the laws start."""

    times: FloatArray
    constants: FloatArray
    start: float


def is_cached(plan: SolvePlan) -> bool:
    """Return whether the library of a plan is in the cache."""
    return compiler.is_cached(_files(plan), FLAGS, rare=list(RARE))


def _files(plan: SolvePlan) -> dict[str, str]:
    """Return the C files of a plan's library, by name."""
    files = emit(plan) | compiler.runtime() | sources(plan)
    return files | {name: compiler.joined(names) for name, names in RARE.items()}


class Library:
    """The compiled model and solver of a plan.

    Raises:
        CompilerError: It cannot be compiled, cached or loaded.

    """

    def __init__(self, plan: SolvePlan) -> None:
        self.plan = plan
        library = self._library = compiler.load(_files(plan), FLAGS, rare=list(RARE))
        self._idle: list[_Memory] = []
        self._values = ctypes.c_double * len(plan.parameters)
        for name, (result, *arguments) in _FUNCTIONS.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments

    def drive(
        self, times: FloatArray, constants: Sequence[float], parameters: Sequence[float] = ()
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return (n, d) driver values, speeds and accelerations at times; default parameters: those of the plan."""
        times = np.ascontiguousarray(times, dtype=np.float64)
        driven = tuple(np.empty((len(times), len(self.plan.drivers))) for _ in range(3))
        values = parameters or [parameter.value for parameter in self.plan.parameters]
        given = [np.array(numbers, dtype=float) for numbers in (values, constants)]
        if not self._library.kf_drive_all(len(times), *map(_start, (times, *given, *driven))):
            raise UnreachedError("these parameters have no solution")
        return driven  # type: ignore[return-value]  # three of them

    def sweep(
        self,
        driven: Driven,
        tables: Sequence[FloatArray | None],
        parameters: Sequence[float] = (),
        tolerance: float = TOLERANCE,
        reuse: LibraryResult | None = None,
    ) -> LibraryResult:
        """Fill tables of values, rates and accelerations; NaN for samples that cannot be reached.

        Args:
            driven: (n, d) driver values, speeds and accelerations.
            tables: Three arrays (n, outputs), by samples or by outputs; None: not wanted.
            parameters: Values to set by continuation; default: those of the plan.
            tolerance: Residual relative to the size above which a sample is not ok.
            reuse: Result of an earlier sweep of as many samples, whose arrays are overwritten.

        Returns:
            The diagnostics.

        Raises:
            KinfmuError: Memory runs out, the parameters have no solution, or the arrays to reuse have other shapes.

        """
        count, watches = len(driven[0]), len(self.plan.watches)
        if reuse is None:
            whole = new_numbers(2 + watches, count)  # one allocation: the system provides large ones faster
            outcomes = whole[0].view(np.int32).reshape(count, 2)
            result = LibraryResult(outcomes, whole[1], whole[2:].reshape(count, watches), (), 0)
        elif reuse.watch.shape == (count, watches):
            result = reuse
        else:
            raise KinfmuError(
                f"the result to reuse has {reuse.watch.shape} samples and watches, not {(count, watches)}"
            )
        job = self._job(driven, tables)
        start = _start(result.outcomes)  # of the whole allocation
        job.outcomes, job.residual, job.watches = start, start + 8 * count, start + 16 * count
        job.most_failures = MOST_FAILURES
        memory = self._lent(count)
        try:
            self._set(memory, tolerance, parameters)
            job.failures, job.messages = memory.failures, memory.messages
            if not self._library.kf_sweep_run(memory.sweep, ctypes.byref(job)):
                raise KinfmuError(self._refusal(count))
            failed = memory.failed(job.failure_count) if job.failure_count else []
        finally:
            self._returned(memory, count)
        more = job.failure_count - MOST_FAILURES
        if more > 0:
            bad = result.outcomes[:, 0] > Status.BRIDGED
            first = int(np.flatnonzero(bad & ~np.concatenate([[False], bad[:-1]]))[MOST_FAILURES])
            failed.append(
                (first, f"{more} more intervals without numbers begin here or later; {MOST_FAILURES} are reported")
            )
        return LibraryResult(result.outcomes, result.residual, result.watch, tuple(failed), job.side_by_side)

    def diagnose(
        self,
        driven: Driven,
        outcomes: NDArray[np.int32],
        parameters: Sequence[float] = (),
        tolerance: float = TOLERANCE,
    ) -> tuple[FloatArray, FloatArray]:
        """Return margins (n,) and estimated errors (n, 3) of swept samples with these outcomes; NaN if not good."""
        margins, errors = np.empty(len(driven[0])), np.empty((len(driven[0]), 3))
        job = self._job(driven, (None, None, None))
        job.outcomes = _start(outcomes)
        with self._memory(len(margins), tolerance, parameters) as memory:
            if not self._library.kf_sweep_diagnose(memory.sweep, ctypes.byref(job), _start(margins), _start(errors)):
                raise KinfmuError(self._refusal(len(margins)))
        return margins, errors

    def require_start(
        self, parameters: Sequence[float], constants: Sequence[float], start: float, tolerance: float
    ) -> None:
        """Raise an UnreachedError unless the laws start at a pose that can be reached with these parameters."""
        with self._memory(1, tolerance, parameters) as memory:
            values = (ctypes.c_double * len(constants))(*constants)
            if not self._library.kf_sweep_starts(memory.sweep, values, start):
                raise UnreachedError(self._library.kf_sweep_message(memory.sweep).decode())

    def solve_designs(
        self,
        parameters: FloatArray,
        driven: Driven | None,
        law: LawDriven | None,
        tables: Sequence[FloatArray | None],
        status: NDArray[np.int32],
        tolerance: float = TOLERANCE,
        reader: DesignReader | None = None,
    ) -> tuple[NDArray[np.int32], dict[int, str]]:
        """Fill tables of many designs.

        Args:
            parameters: (m, p) values for all parameters of the plan.
            driven: (n, d) or (m, n, d) driver values, speeds and accelerations; None: by the laws.
            law: Times and constants of the laws; None: by driver values.
            tables: Three arrays (m, n, outputs) of values, rates and accelerations; None: not wanted.
            status: (m, n) of 32 bits, filled with values of Status; n without gaps.
            tolerance: Residual relative to the size above which a sample is not ok.
            reader: Reads each design as soon as it is solved, so that all may share the memory of tables and status.

        Returns:
            (m,) how each design was reached, as in designs.h, and reasons by design for those that are not reached, or
            not at all samples.

        Raises:
            KinfmuError: Memory runs out.

        """
        designs, samples = status.shape
        reached = np.empty(designs, dtype=np.int32)
        messages = np.zeros((designs, MESSAGE), dtype=np.uint8)
        of_one = np.empty((2 + len(self.plan.watches), samples))  # outcomes, residual and watches of a design
        job = _Designs(count=designs, parameters=_start(parameters))
        if driven is not None:
            given = [np.ascontiguousarray(table) for table in driven]
            job.drive_step = samples * len(self.plan.drivers) if given[0].ndim == 3 else 0
        elif law is not None:
            given = [np.empty((samples, len(self.plan.drivers))) for _ in range(3)]
            job.times, job.constants, job.start = _start(law.times), _start(law.constants), law.start
            job.constant_step = len(self.plan.law_constants) if law.constants.ndim == 2 else 0
        job.samples.count = samples
        job.samples.u, job.samples.ud, job.samples.udd = map(_start, given)
        for k, table in enumerate(tables):
            if table is not None:
                step, row, column = (stride // table.itemsize for stride in table.strides)
                job.samples.tables[k] = _Table(_start(table), row, column)
                job.table_step[k] = step
        job.samples.outcomes, job.samples.residual, job.samples.watches = map(_start, (of_one, of_one[1:], of_one[2:]))
        job.status, job.reached, job.messages = _start(status), _start(reached), _start(messages)
        job.status_step = status.strides[0] // status.itemsize
        if reader is not None:
            job.read, job.context = reader
        with self._memory(samples, tolerance, ()) as memory:
            if not self._library.kf_designs_run(memory.sweep, ctypes.byref(job)):
                raise KinfmuError(self._refusal(designs * samples))
        return reached, {int(k): _text(_start(messages[k])) for k in np.flatnonzero(messages[:, 0])}

    @contextmanager
    def _memory(self, count: int, tolerance: float, parameters: Sequence[float]) -> Iterator[_Memory]:
        """Lend memory for a sweep of `count` samples, with its parameters set."""
        memory = self._lent(count)
        try:
            self._set(memory, tolerance, parameters)
            yield memory
        finally:
            self._returned(memory, count)

    def _lent(self, count: int) -> _Memory:
        try:
            return self._idle.pop()
        except IndexError:
            return _Memory(self._library, self._refusal(count))

    def _returned(self, memory: _Memory, count: int) -> None:
        if count <= MOST_KEPT:
            self._idle.append(memory)

    def _set(self, memory: _Memory, tolerance: float, parameters: Sequence[float]) -> None:
        self._library.kf_sweep_start(memory.sweep, tolerance)
        if len(parameters) and not self._library.kf_sweep_bind(memory.sweep, self._values(*parameters)):
            raise UnreachedError(self._library.kf_sweep_message(memory.sweep).decode())

    def _refusal(self, count: int) -> str:
        return (
            f"no memory is left for a sweep of {count} samples of '{self.plan.mechanism.name}' by the native engine, "
            "which may need 200 MB in addition to its tables; sweep fewer samples at a time, or with engine 'python'"
        )

    def _job(self, driven: tuple[FloatArray, ...], tables: Sequence[FloatArray | None]) -> _Job:
        job = _Job(count=len(driven[0]))
        job.given = [np.ascontiguousarray(table) for table in driven]  # kept alive while the job points to them
        job.u, job.ud, job.udd = map(_start, job.given)
        for k, table in enumerate(tables):
            if table is not None:
                row, column = table.strides
                place = job.tables[k]
                place.start, place.row, place.column = _start(table.T), row // 8, column // 8  # often by outputs
        return job


class _Memory:
    """Memory for one sweep at a time, and for its failures. refusal: the message if there is none."""

    def __init__(self, library: ctypes.CDLL, refusal: str) -> None:
        self.sweep = library.kf_sweep_new(TOLERANCE)
        if not self.sweep:
            raise KinfmuError(refusal)
        self._samples = np.zeros(MOST_FAILURES, dtype=np.int64)
        self._texts = np.empty(MOST_FAILURES * MESSAGE, dtype=np.uint8)
        self.failures, self.messages = _start(self._samples), _start(self._texts)
        weakref.finalize(self, library.kf_sweep_free, self.sweep)

    def failed(self, count: int) -> list[tuple[int, str]]:
        """Return first samples and messages of so many intervals without numbers, as far as they are kept."""
        samples = self._samples[: min(count, MOST_FAILURES)].tolist()
        return [(sample, _text(self.messages + k * MESSAGE)) for k, sample in enumerate(samples)]


def _text(place: int) -> str:
    """Return the message at a place."""
    return ctypes.string_at(place).decode()
