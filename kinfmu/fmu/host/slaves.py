"""Slaves of kinfmu's FMUs through fmpy's low-level calls, with the same methods for both versions of FMI."""

from __future__ import annotations

import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from ctypes import CFUNCTYPE, byref, c_bool, c_double, c_int, c_size_t, c_uint, c_void_p
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinfmu.errors import FmuError, MissingPackageError
from kinfmu.fmu.description import Description

WARNING = 1  # fmi2Warning and fmi3Warning; a greater status is a failure
DISCARD = 2  # fmi2Discard and fmi3Discard
Log = Callable[[int, str], None]  # status and text of a message


class RowCall:
    """A get of variables into a row of a table, or a set from it: `call(row)`.

    Args:
        fmu: Instance, of fmpy.
        function: Name of the C function, such as "fmi2GetReal".
        references: The k value references.
        rows: (n, k) table of the function's type, each row without gaps.
        has_value_count: True for FMI 3.0, whose functions also take the number of values.

    """

    __slots__ = ("_address", "_base", "_function", "_name", "_rows", "_stride")

    def __init__(
        self, fmu: Any, function: str, references: Sequence[int], rows: NDArray[Any], *, has_value_count: bool
    ) -> None:
        self._name = function
        count = c_size_t(len(references))
        self._address = c_void_p()
        variables = (c_uint * len(references))(*references)
        more = (count,) if has_value_count else ()
        self._function = _function_of(fmu, function, variables, count, self._address, *more)
        self._rows, self._base, self._stride = rows, rows.ctypes.data, rows.strides[0]

    def __call__(self, row: int) -> None:
        """Get or set; raise fmpy's FMICallException for a status above Warning."""
        self._address.value = self._base + row * self._stride
        status = self._function()
        if status > WARNING:
            from fmpy.fmi1 import FMICallException

            raise FMICallException(function=self._name, status=status)


class StepCall:
    """A DoStep of an FMU: `call(time, step)` returns its status.

    Args:
        fmu: Instance, of fmpy.
        function: Name of the C function, such as "fmi2DoStep".
        more: Its arguments after time and step, values of ctypes.

    """

    __slots__ = ("_function", "_step", "_time", "name")

    def __init__(self, fmu: Any, function: str, *more: Any) -> None:
        self.name = function
        self._time, self._step = c_double(), c_double()
        self._function = _function_of(fmu, function, self._time, self._step, *more)

    def __call__(self, time: float, step: float) -> int:
        self._time.value, self._step.value = time, step
        return self._function()


def _function_of(fmu: Any, name: str, *arguments: Any) -> partial[int]:
    """Return a C function of an FMU bound to its instance and these arguments, values of ctypes."""
    return partial(CFUNCTYPE(c_int)((name, fmu.dll)), c_void_p.from_param(fmu.component), *arguments)


def free(slave: Any) -> None:
    """Free the instance of an object of fmpy, and its library.

    pythonfmu's library also frees its state of Python, which it would free a second time when the process ends.
    """
    finalize = getattr(slave.dll, "finalizePythonInterpreter", None)
    if finalize is None:
        slave.freeInstance()
        return
    slave.fmi2FreeInstance(slave.component)
    finalize()
    slave.freeLibrary()


class LoadedSlave(ABC):
    """A slave of an FMU unpacked into a folder; raises what fmpy raises.

    Calls that are made in every step go to the C functions directly, with arguments that are built once: fmpy's methods
    build arrays and lists in every call, and ctypes converts Python numbers, which each take longer than a native step.

    Attributes:
        fmpy: fmpy's object, for calls that are not wrapped here.
        references: Value references by name.

    """

    fmpy: Any
    _functions: str  # prefix of the names of C functions
    _real: str  # FMI's name of the type of Real variables
    _integer: str  # FMI's name of the type of integers
    _enumeration: str  # and of the type by which enumerations are set
    _has_value_count: bool  # of lists of values
    _do_step: StepCall

    def __init__(self, fmpy_class: Callable[..., Any], about: Description, folder: Path) -> None:
        self.references = about.interface.value_references()
        self.fmpy = fmpy_class(
            instanceName=about.interface.name,
            guid=about.token,
            modelIdentifier=about.model_identifier,
            unzipDirectory=str(folder),
        )

    def free(self) -> None:
        free(self.fmpy)

    @abstractmethod
    def initialize(self, start: float) -> None:
        """Go through initialization mode."""

    def get(self, references: Sequence[int]) -> list[float]:
        """Return the numbers of these value references."""
        return list(getattr(self.fmpy, f"get{self._real}")(references))

    def set(self, references: Sequence[int], values: Sequence[float]) -> None:
        """Set the numbers of these value references."""
        getattr(self.fmpy, f"set{self._real}")(references, values)

    def set_boolean(self, reference: int, value: bool) -> None:
        self.fmpy.setBoolean([reference], [value])

    def set_enumeration(self, reference: int, value: int) -> None:
        getattr(self.fmpy, f"set{self._enumeration}")([reference], [value])

    def set_integer(self, reference: int, value: int) -> None:
        getattr(self.fmpy, f"set{self._integer}")([reference], [value])

    def reader(self, references: Sequence[int], rows: NDArray[np.float64]) -> RowCall:
        """Return a call that reads Real variables into a row of the table (n, len(references))."""
        return self._row_call(f"Get{self._real}", references, rows)

    def setter(self, references: Sequence[int], rows: NDArray[np.float64]) -> RowCall:
        """Return a call that sets Real variables to the values in a row of the table (n, len(references))."""
        return self._row_call(f"Set{self._real}", references, rows)

    def _row_call(self, function: str, references: Sequence[int], rows: NDArray[Any]) -> RowCall:
        name = f"{self._functions}{function}"
        return RowCall(self.fmpy, name, references, rows, has_value_count=self._has_value_count)

    @abstractmethod
    def counts(self) -> tuple[int, int]:
        """Return solver.status and solver.iterations."""

    def message(self) -> str:
        """Return solver.message."""
        (text,) = self.fmpy.getString([self.references["solver.message"]])
        return text.decode() if isinstance(text, bytes) else str(text)

    def step(self, time: float, step: float) -> bool:
        """Call DoStep; return False if it is discarded. Raise an FmuError for any other failure."""
        status = self._do_step(time, step)
        if status <= WARNING:
            return True
        if status == DISCARD:
            return False
        from fmpy.fmi1 import FMICallException

        raise FmuError(f"at t = {time:g} s: {FMICallException(function=self._do_step.name, status=status)}")


class Slave2(LoadedSlave):
    """A slave of FMI 2.0."""

    _functions, _real, _integer, _enumeration, _has_value_count = "fmi2", "Real", "Integer", "Integer", False

    def __init__(self, about: Description, folder: Path, log: Log) -> None:
        from fmpy.fmi2 import FMU2Slave

        super().__init__(FMU2Slave, about, folder)
        self._instantiate(folder, fmi2_callbacks(log))
        self._do_step = StepCall(self.fmpy, "fmi2DoStep", c_int(1))  # the state before is not needed
        row = np.zeros((1, 2), np.int32)
        counts = [self.references[name] for name in ("solver.status", "solver.iterations")]
        self._read_counts = self._row_call("GetInteger", counts, row)
        self._counts = row[0].data

    def _instantiate(self, folder: Path, callbacks: Any) -> None:
        """Do what fmpy's `instantiate` does, but leave the URI of the resources unquoted.

        pythonfmu's binary unquotes blanks only, and crashes the process if the folder does not exist.
        """
        from fmpy.fmi2 import fmi2CoSimulation

        path = (folder / "resources").absolute().as_posix()
        address = f"file://{path}" if path.startswith("/") else f"file:///{path}"
        if "%20" in path and (folder / "resources/slavemodule.txt").exists():
            raise FmuError(
                f"pythonfmu's library reads '%20' in '{folder.parent}' as a blank; "
                "let TMPDIR be another folder, or build with --flavour native"
            )
        slave = self.fmpy
        slave.callbacks = callbacks  # the binary keeps a pointer to it
        slave.component = slave.fmi2Instantiate(
            slave.instanceName.encode(), fmi2CoSimulation, slave.guid.encode(), address.encode(), byref(callbacks), 0, 1
        )
        if slave.component is None:
            raise FmuError("the slave did not start")

    def initialize(self, start: float) -> None:
        self.fmpy.setupExperiment(startTime=start)
        self.fmpy.enterInitializationMode()
        self.fmpy.exitInitializationMode()

    def counts(self) -> tuple[int, int]:
        self._read_counts(0)
        return self._counts[0], self._counts[1]


class Slave3(LoadedSlave):
    """A slave of FMI 3.0."""

    _functions, _real, _integer, _enumeration, _has_value_count = "fmi3", "Float64", "Int32", "Int64", True

    def __init__(self, about: Description, folder: Path, log: Log) -> None:
        from fmpy.fmi3 import FMU3Slave

        super().__init__(FMU3Slave, about, folder)

        def logger(_environment: object, status: int, _category: bytes, message: bytes) -> None:
            log(status, (message or b"").decode("utf-8", errors="replace"))

        self.fmpy.instantiate(loggingOn=True, logMessage=logger)
        results = *((c_bool * 1)() for _ in range(3)), (c_double * 1)()  # flags and the time reached
        self._do_step = StepCall(self.fmpy, "fmi3DoStep", c_bool(True), *results)
        status, iterations = np.zeros((1, 1), np.int64), np.zeros((1, 1), np.int32)
        self._counts = status[0].data, iterations[0].data
        self._read_status = self._row_call("GetInt64", [self.references["solver.status"]], status)
        self._read_iterations = self._row_call("GetInt32", [self.references["solver.iterations"]], iterations)

    def initialize(self, start: float) -> None:
        self.fmpy.enterInitializationMode(startTime=start)
        self.fmpy.exitInitializationMode()

    def counts(self) -> tuple[int, int]:
        self._read_status(0)
        self._read_iterations(0)
        status, iterations = self._counts
        return status[0], iterations[0]


_SLAVES: Mapping[str, type[Slave2 | Slave3]] = {"2.0": Slave2, "3.0": Slave3}


@contextmanager
def slave(about: Description, folder: Path, log: Log) -> Iterator[LoadedSlave]:
    """Start a slave of an FMU; at the end free it and restore `sys.path`.

    Args:
        about: Model description.
        folder: Folder into which the FMU is unpacked.
        log: Called with status and text of each message.

    Yields:
        The slave.

    Raises:
        MissingPackageError: If fmpy is not installed.
        FmuError: If the FMU does not load.

    """
    try:
        import fmpy  # noqa: F401  # only to see if it is installed
    except ImportError:
        raise MissingPackageError("stepping an FMU needs fmpy; pip install fmpy") from None
    path_before = list(sys.path)
    messages: list[str] = []

    def logged(status: int, text: str) -> None:
        messages.append(text)
        log(status, text)

    try:
        started = _SLAVES[about.version](about, folder, logged)
    except Exception as error:  # fmpy raises bare exceptions
        sys.path[:] = path_before
        raise FmuError(f"FMU '{about.interface.name}' does not load: {' '.join([*messages, str(error)])}") from None
    try:
        yield started
    finally:
        started.free()
        sys.path[:] = path_before  # pythonfmu adds the FMU's resources and does not remove them


def fmi2_callbacks(log: Log) -> Any:
    """Return FMI 2.0's callbacks that pass messages to `log` and print nothing.

    fmpy's proxy for printf-like messages is left out: it serves one logger per process, and kinfmu's FMUs send finished
    text.
    """
    from fmpy import calloc, free
    from fmpy.fmi2 import (
        fmi2CallbackAllocateMemoryTYPE,
        fmi2CallbackFreeMemoryTYPE,
        fmi2CallbackFunctions,
        fmi2CallbackLoggerTYPE,
    )

    def logger(_environment: object, _instance: bytes, status: int, _category: bytes, message: bytes) -> None:
        text = (message or b"").decode("utf-8", errors="replace")
        log(status, text.replace("%%", "%").replace("##", "#"))  # the text is a format, in which % and # are doubled

    callbacks = fmi2CallbackFunctions()
    callbacks.logger = fmi2CallbackLoggerTYPE(logger)
    callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
    callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
    return callbacks
