"""Slaves of FMUs through fmpy's low-level calls."""

from __future__ import annotations

import sys
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
from kinfmu.fmu.host.ports import Port

WARNING = 1  # fmi2Warning and fmi3Warning; a greater status is a failure
DISCARD = 2  # fmi2Discard and fmi3Discard
COUNTS = ("solver.status", "solver.iterations")
_PYTHONFMU_FILE = "resources/slavemodule.txt"  # in every FMU of pythonfmu, of other tools too
_STATE_CALLS = ("get", "set", "free")
Log = Callable[[int, str], None]  # status and text of a message
_TYPES = (  # of FMI 2.0 and 3.0, in fmpy's names of functions, by type of a variable
    {"Enumeration": "Integer"},
    {"Real": "Float64", "Integer": "Int32", "Enumeration": "Int64"},
)


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
        self._address = c_void_p(rows.ctypes.data)
        variables = (c_uint * len(references))(*references)
        more = (count,) if has_value_count else ()
        self._function = _function_of(fmu, function, variables, count, self._address, *more)
        self._rows, self._base, self._stride = rows, rows.ctypes.data, rows.strides[0]

    def __call__(self, row: int | None = None) -> None:
        """Get or set a row, by default that of the last call; raise fmpy's FMICallException for a failure."""
        if row is not None:
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


class LoadedSlave:
    """A slave of an FMU, of kinfmu or another tool, with the same calls for both versions of FMI.

    What is called in every step of an FMU of kinfmu goes to the C functions directly, with arguments that are built
    once: fmpy's methods build arrays and lists in every call, and ctypes converts Python numbers, which each take
    longer than a native step.

    Args:
        fmpy: fmpy's object of the instance.
        is_fmi3: True for FMI 3.0.
        name: Name of the component of a system, for messages; '' of an FMU alone.
        references: Value references by name, of an FMU of kinfmu.

    """

    def __init__(self, fmpy: Any, name: str, references: Mapping[str, int], *, is_fmi3: bool) -> None:
        self.name, self.references, self._fmpy, self._is_fmi3 = name, references, fmpy, is_fmi3
        needs_event, terminates, returns_early = ((c_bool * 1)() for _ in range(3))
        results = needs_event, terminates, returns_early, (c_double * 1)()  # the last one: the time reached
        self._terminates = terminates if is_fmi3 else None
        more = (c_bool(True), *results) if is_fmi3 else (c_int(1),)  # the state before is not needed
        self._do_step = StepCall(fmpy, "fmi3DoStep" if is_fmi3 else "fmi2DoStep", *more)
        if references:
            counts = {"Int64": COUNTS[:1], "Int32": COUNTS[1:]} if is_fmi3 else {"Integer": COUNTS}
            rows = [np.zeros((1, len(of)), np.int64 if kind == "Int64" else np.int32) for kind, of in counts.items()]
            self._read_counts = [
                self._row_call(f"Get{kind}", [references[count] for count in of], row)
                for (kind, of), row in zip(counts.items(), rows, strict=True)
            ]
            self._status, self._iterations = rows[0][0].data, rows[-1][0, -1:].data

    def free(self) -> None:
        """Free the instance and its library.

        pythonfmu's library also frees its state of Python, which it would free a second time when the process ends.
        """
        finalize = getattr(self._fmpy.dll, "finalizePythonInterpreter", None)
        if finalize is None:
            self._fmpy.freeInstance()
            return
        self._fmpy.fmi2FreeInstance(self._fmpy.component)
        finalize()
        self._fmpy.freeLibrary()

    def enter(self, start: float) -> None:
        """Enter initialization mode at a time [s]."""
        if self._is_fmi3:
            self._call(self._fmpy.enterInitializationMode, startTime=start)
        else:
            self._call(self._fmpy.setupExperiment, startTime=start)
            self._call(self._fmpy.enterInitializationMode)

    def exit(self) -> None:
        """Leave initialization mode."""
        self._call(self._fmpy.exitInitializationMode)

    def getter(self, ports: Sequence[Port]) -> Callable[[], list[float]]:
        """Return a call that returns the numbers of these variables."""
        calls = [(getattr(self._fmpy, f"get{kind}"), *rest) for kind, *rest in self._by_type(ports)]

        def get() -> list[float]:
            values = [0.0] * len(ports)
            for call, references, places in calls:
                for place, value in zip(places, self._call(call, references), strict=True):
                    values[place] = float(value)
            return values

        return get

    def setter(self, ports: Sequence[Port]) -> Callable[[Sequence[float]], None]:
        """Return a call that sets these variables to numbers."""
        calls = [(getattr(self._fmpy, f"set{kind}"), *rest) for kind, *rest in self._by_type(ports)]
        into = {"real": float, "integer": round, "boolean": bool}
        kinds = [into[port.kind] for port in ports]

        def set_all(values: Sequence[float]) -> None:
            for call, references, places in calls:
                self._call(call, references, [kinds[place](values[place]) for place in places])

        return set_all

    def row_reader(self, names: Sequence[str], rows: NDArray[np.float64]) -> RowCall:
        """Return a call that reads Real variables of an FMU of kinfmu into a row of the table (n, len(names))."""
        return self._row_call(f"Get{self._real}", [self.references[name] for name in names], rows)

    def row_setter(self, names: Sequence[str], rows: NDArray[np.float64]) -> RowCall:
        """Return a call that sets Real variables of an FMU of kinfmu to those in a row of the table (n, len(names))."""
        return self._row_call(f"Set{self._real}", [self.references[name] for name in names], rows)

    def get(self, names: Sequence[str]) -> list[float]:
        """Return the numbers of Real variables of an FMU of kinfmu."""
        return list(self._call(getattr(self._fmpy, f"get{self._real}"), [self.references[name] for name in names]))

    def counts(self) -> tuple[int, int]:
        """Return solver.status and solver.iterations of an FMU of kinfmu."""
        for read in self._read_counts:
            read()
        return self._status[0], self._iterations[0]

    def message(self) -> str:
        """Return solver.message of an FMU of kinfmu."""
        (text,) = self._fmpy.getString([self.references["solver.message"]])
        return text.decode() if isinstance(text, bytes) else str(text)

    def step(self, time: float, step: float) -> bool:
        """Step; return False if the FMU discards the step or asks to end. Raise an FmuError for any other failure."""
        status = self._do_step(time, step)
        if status <= WARNING:
            return self._terminates is None or not self._terminates[0]
        if status == DISCARD:
            return False
        from fmpy.fmi1 import FMICallException

        failure = FMICallException(function=self._do_step.name, status=status)
        raise FmuError(f"{self.name or f'at t = {time:g} s'}: {failure}")

    def saved_state(self) -> Callable[[], None]:
        """Save the state of an FMU; return a call that restores it, once."""
        get, put, free = (getattr(self._fmpy, f"{verb}FMU{'S' if self._is_fmi3 else 's'}tate") for verb in _STATE_CALLS)
        state = self._call(get)

        def restore() -> None:
            self._call(put, state)
            self._call(free, state)

        return restore

    @property
    def _real(self) -> str:
        return "Float64" if self._is_fmi3 else "Real"

    def _row_call(self, function: str, references: Sequence[int], rows: NDArray[Any]) -> RowCall:
        prefix = "fmi3" if self._is_fmi3 else "fmi2"
        return RowCall(self._fmpy, f"{prefix}{function}", references, rows, has_value_count=self._is_fmi3)

    def _by_type(self, ports: Sequence[Port]) -> Iterator[tuple[str, list[int], list[int]]]:
        """Yield the type in names of functions, value references, and places of the variables of each type."""
        types = [_TYPES[self._is_fmi3].get(port.type, port.type) for port in ports]
        for kind in dict.fromkeys(types):
            places = [place for place, own in enumerate(types) if own == kind]
            yield kind, [ports[place].reference for place in places], places

    def _call(self, function: Callable[..., Any], *values: Any, **named: Any) -> Any:
        from fmpy.fmi1 import FMICallException

        try:
            return function(*values, **named)
        except FMICallException as error:
            raise FmuError(f"{self.name}: {error}" if self.name else str(error)) from None


@contextmanager
def slave(about: Any, folder: Path, log: Log, name: str = "") -> Iterator[LoadedSlave]:
    """Start a slave of an FMU; at the end free it and restore `sys.path`.

    Args:
        about: Description of an FMU of kinfmu; of another FMU fmpy's model description.
        folder: Folder into which the FMU is unpacked.
        log: Called with status and text of each message.
        name: Name of the component of a system, for messages.

    Yields:
        The slave.

    Raises:
        MissingPackageError: If fmpy is not installed.
        FmuError: If the FMU does not load.

    """
    require_fmpy()
    path_before = list(sys.path)
    messages: list[str] = []

    def logged(status: int, text: str) -> None:
        messages.append(text)
        log(status, text)

    instance = about.interface.name if isinstance(about, Description) else name
    try:
        started = _started(about, folder, logged, name, instance)
    except Exception as error:  # fmpy raises bare exceptions
        sys.path[:] = path_before
        reason = " ".join([*messages, *str(error).split()])
        raise FmuError(f"FMU '{instance}' does not load: {reason}") from None
    try:
        yield started
    finally:
        started.free()
        sys.path[:] = path_before  # pythonfmu adds the FMU's resources and does not remove them


def require_fmpy() -> None:
    """Raise a MissingPackageError if fmpy is not installed."""
    try:
        import fmpy  # noqa: F401  # only to see if it is installed
    except ImportError:
        raise MissingPackageError("stepping an FMU needs fmpy; pip install fmpy") from None


def _started(about: Any, folder: Path, log: Log, name: str, instance: str) -> LoadedSlave:
    """Return a slave that is instantiated."""
    is_own = isinstance(about, Description)
    token, identifier = (
        (about.token, about.model_identifier) if is_own else (about.guid, about.coSimulation.modelIdentifier)
    )
    is_fmi3 = str(about.version if is_own else about.fmiVersion).startswith("3")
    common = {"guid": token, "modelIdentifier": identifier, "instanceName": instance, "unzipDirectory": str(folder)}
    if is_fmi3:
        from fmpy.fmi3 import FMU3Slave

        def logger(_environment: object, status: int, _category: bytes, message: bytes) -> None:
            log(status, (message or b"").decode("utf-8", errors="replace"))

        fmpy = FMU3Slave(**common)
        fmpy.instantiate(loggingOn=True, logMessage=logger)
    else:
        from fmpy.fmi2 import FMU2Slave

        fmpy = FMU2Slave(**common)
        if is_own or (folder / _PYTHONFMU_FILE).exists():
            _instantiate(fmpy, folder, fmi2_callbacks(log))
        else:
            fmpy.instantiate(callbacks=fmi2_callbacks(log), loggingOn=False)
    return LoadedSlave(fmpy, name, about.interface.value_references() if is_own else {}, is_fmi3=is_fmi3)


def _instantiate(fmpy: Any, folder: Path, callbacks: Any) -> None:
    """Do what fmpy's `instantiate` does, but leave the URI of the resources unquoted.

    pythonfmu's binary unquotes blanks only, and crashes the process if the folder does not exist.
    """
    from fmpy.fmi2 import fmi2CoSimulation

    path = (folder / "resources").absolute().as_posix()
    address = f"file://{path}" if path.startswith("/") else f"file:///{path}"
    if "%20" in path and (folder / _PYTHONFMU_FILE).exists():
        raise FmuError(
            f"pythonfmu's library reads '%20' in '{folder.parent}' as a blank; "
            "let TMPDIR be another folder, or build with --flavour native"
        )
    fmpy.callbacks = callbacks  # the binary keeps a pointer to it
    fmpy.component = fmpy.fmi2Instantiate(
        fmpy.instanceName.encode(), fmi2CoSimulation, fmpy.guid.encode(), address.encode(), byref(callbacks), 0, 1
    )
    if fmpy.component is None:
        raise FmuError("the slave did not start")


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
