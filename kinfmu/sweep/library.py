"""A plan's C as a library: compiled, loaded, and called for whole arrays of samples."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinfmu.codegen.c import compiler
from kinfmu.codegen.c.model import emit
from kinfmu.errors import KinfmuError
from kinfmu.plan import SolvePlan
from kinfmu.simd import sources
from kinfmu.solver.python.solver import TOLERANCE
from kinfmu.solver.python.status import Status

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FLAGS = ("-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math")  # lanes need them; results are equal
MESSAGE = 480  # characters, as KF_MESSAGE
MOST_FAILURES = 1000  # intervals without numbers whose reasons are kept

_double = ctypes.c_double
_numbers = ctypes.POINTER(_double)
_integers = ctypes.POINTER(ctypes.c_int64)


class _Table(ctypes.Structure):
    """kf_table of sweep.h."""

    _fields_ = (("start", _numbers), ("row", ctypes.c_ssize_t), ("column", ctypes.c_ssize_t))


class _Job(ctypes.Structure):
    """kf_job of sweep.h."""

    _fields_ = (
        ("count", ctypes.c_int64),
        ("u", _numbers),
        ("ud", _numbers),
        ("udd", _numbers),
        ("tables", _Table * 3),
        ("outcomes", ctypes.c_void_p),
        ("residual", _numbers),
        ("watches", _numbers),
        ("most_failures", ctypes.c_int64),
        ("failure_count", ctypes.c_int64),
        ("failures", _integers),
        ("messages", ctypes.c_char_p),
        ("side_by_side", ctypes.c_int64),
        ("gaps", ctypes.c_int64),
    )


_sweep, _job = ctypes.c_void_p, ctypes.POINTER(_Job)
_FUNCTIONS: dict[str, tuple[Any, ...]] = {  # of sweep.h: types of the result and of the arguments
    "kf_sweep_new": (_sweep, _double),
    "kf_sweep_free": (None, _sweep),
    "kf_sweep_bind": (ctypes.c_bool, _sweep, _numbers),
    "kf_sweep_run": (ctypes.c_bool, _sweep, _job),
    "kf_sweep_diagnose": (ctypes.c_bool, _sweep, _job, _numbers, _numbers),
    "kf_sweep_message": (ctypes.c_char_p, _sweep),
    "kf_drive_all": (ctypes.c_bool, ctypes.c_int64, *[_numbers] * 6),
}


@dataclass(frozen=True, eq=False)
class LibraryResult:
    """Per-sample diagnostics of a sweep, as in Run.

    outcomes: (n, 2), status and iterations; failures: first sample and message of each interval without numbers, and
    after MOST_FAILURES of them how many more there are; side_by_side: how many samples were solved in lanes.
    """

    outcomes: NDArray[np.int32]
    residual: FloatArray
    watch: FloatArray
    failures: tuple[tuple[int, str], ...]
    side_by_side: int


class Library:
    """The compiled model and solver of a plan.

    Args:
        plan: The plan.
        parameters: Values to set by continuation from those of the plan; default: those of the plan.
        tolerance: Residual relative to the size above which a sample is not ok.

    Raises:
        CompilerError: It cannot be compiled, cached or loaded.

    """

    def __init__(self, plan: SolvePlan, parameters: Sequence[float] = (), tolerance: float = TOLERANCE) -> None:
        self.plan = plan
        self._parameters = parameters
        self._tolerance = tolerance
        files = emit(plan) | compiler.runtime() | sources(plan)
        library = self._library = compiler.load(files, FLAGS)
        for name, (result, *arguments) in _FUNCTIONS.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments

    def drive(self, times: FloatArray, constants: Sequence[float]) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return (n, d) driver values, speeds and accelerations at times."""
        times = np.ascontiguousarray(times, dtype=np.float64)
        driven = tuple(np.empty((len(times), len(self.plan.drivers))) for _ in range(3))
        values = self._parameters or [parameter.value for parameter in self.plan.parameters]
        given = (_start(np.array(numbers, dtype=float)) for numbers in (values, constants))
        if not self._library.kf_drive_all(len(times), _start(times), *given, *map(_start, driven)):
            raise KinfmuError("these parameters have no solution")
        return driven  # type: ignore[return-value]  # three of them

    def sweep(
        self,
        driven: tuple[FloatArray, FloatArray, FloatArray],
        tables: Sequence[FloatArray | None],
        reuse: LibraryResult | None = None,
    ) -> LibraryResult:
        """Fill tables of values, rates and accelerations; NaN for samples that cannot be reached.

        Args:
            driven: (n, d) driver values, speeds and accelerations.
            tables: Three arrays (n, outputs), by samples or by outputs; None: not wanted.
            reuse: Result of an earlier sweep of as many samples, whose arrays are overwritten.

        Returns:
            The diagnostics.

        Raises:
            KinfmuError: Memory runs out, the parameters have no solution, or the arrays to reuse have other shapes.

        """
        count, watches = len(driven[0]), len(self.plan.watches)
        if reuse is None:
            whole = np.empty((2, count))  # one allocation: the system provides large ones faster
            result = LibraryResult(
                whole[0].view(np.int32).reshape(count, 2), whole[1], np.empty((count, watches)), (), 0
            )
        elif reuse.watch.shape == (count, watches):
            result = reuse
        else:
            raise KinfmuError(
                f"the result to reuse has {reuse.watch.shape} samples and watches, not {(count, watches)}"
            )
        failures = np.zeros(MOST_FAILURES, dtype=np.int64)
        messages = ctypes.create_string_buffer(MOST_FAILURES * MESSAGE)
        job = self._job(driven, tables)
        job.outcomes = result.outcomes.ctypes.data_as(ctypes.c_void_p)
        job.residual, job.watches = _start(result.residual), _start(result.watch)
        job.most_failures, job.failures = MOST_FAILURES, _integer_start(failures)
        job.messages = ctypes.cast(messages, ctypes.c_char_p)
        with self._memory(count) as memory:
            if not self._library.kf_sweep_run(memory, ctypes.byref(job)):
                raise KinfmuError(self._refusal(count))
        failed = []
        for k, sample in enumerate(failures[: min(job.failure_count, MOST_FAILURES)].tolist()):
            text = messages.raw[k * MESSAGE : (k + 1) * MESSAGE].split(b"\0", 1)[0]
            failed.append((sample, text.decode()))
        more = job.failure_count - MOST_FAILURES
        if more > 0:
            bad = result.outcomes[:, 0] > Status.BRIDGED
            first = int(np.flatnonzero(bad & ~np.concatenate([[False], bad[:-1]]))[MOST_FAILURES])
            failed.append(
                (first, f"{more} more intervals without numbers begin here or later; {MOST_FAILURES} are reported")
            )
        return replace(result, failures=tuple(failed), side_by_side=job.side_by_side)

    def diagnose(
        self,
        driven: tuple[FloatArray, FloatArray, FloatArray],
        outcomes: NDArray[np.int32],
    ) -> tuple[FloatArray, FloatArray]:
        """Return margins (n,) and estimated errors (n, 3) of swept samples with these outcomes; NaN if not good."""
        margins, errors = np.empty(len(driven[0])), np.empty((len(driven[0]), 3))
        job = self._job(driven, (None, None, None))
        job.outcomes = outcomes.ctypes.data_as(ctypes.c_void_p)
        with self._memory(len(margins)) as memory:
            if not self._library.kf_sweep_diagnose(memory, ctypes.byref(job), _start(margins), _start(errors)):
                raise KinfmuError(self._refusal(len(margins)))
        return margins, errors

    @contextmanager
    def _memory(self, count: int) -> Iterator[int]:
        """Yield the memory of a sweep, with the parameters bound."""
        library, parameters = self._library, self._parameters
        memory = library.kf_sweep_new(self._tolerance)
        if not memory:
            raise KinfmuError(self._refusal(count))
        try:
            if parameters and not library.kf_sweep_bind(memory, (_double * len(parameters))(*parameters)):
                raise KinfmuError(library.kf_sweep_message(memory).decode())
            yield memory
        finally:
            library.kf_sweep_free(memory)

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
                row, column = (stride // table.itemsize for stride in table.strides)
                job.tables[k] = _Table(table.ctypes.data_as(_numbers), row, column)
        return job


def _start(array: FloatArray) -> Any:
    return array.ctypes.data_as(_numbers)


def _integer_start(array: IntArray) -> Any:
    return array.ctypes.data_as(_integers)
