"""A slave of any FMU through fmpy, with the same calls for both versions of FMI."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from kinfmu.errors import FmuError
from kinfmu.fmu.host.ports import Port
from kinfmu.fmu.host.slaves import DISCARD, Log, fmi2_callbacks, free

Getter = Callable[[], list[float]]
Setter = Callable[[Sequence[float]], None]


class AnySlave:
    """A slave of an FMU; calls raise an FmuError that states the function and FMI's status."""

    def __init__(self, name: str, fmpy: Any, is_fmi3: bool) -> None:
        self.name, self._fmpy, self._is_fmi3 = name, fmpy, is_fmi3

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

    def getter(self, ports: Sequence[Port]) -> Getter:
        """Return a call that returns the numbers of these variables."""
        calls = [(getattr(self._fmpy, f"get{kind}"), *rest) for kind, *rest in self._by_type(ports)]

        def get() -> list[float]:
            values = [0.0] * len(ports)
            for call, references, places in calls:
                for place, value in zip(places, self._call(call, references), strict=True):
                    values[place] = float(value)
            return values

        return get

    def setter(self, ports: Sequence[Port]) -> Setter:
        """Return a call that sets these variables to numbers."""
        calls = [(getattr(self._fmpy, f"set{kind}"), *rest) for kind, *rest in self._by_type(ports)]
        into = {"real": float, "integer": round, "boolean": bool}
        kinds = [into[port.kind] for port in ports]

        def set_all(values: Sequence[float]) -> None:
            for call, references, places in calls:
                self._call(call, references, [kinds[place](values[place]) for place in places])

        return set_all

    def step(self, time: float, step: float) -> bool:
        """Step; return False if the FMU discards the step or asks to end."""
        from fmpy.fmi1 import FMICallException

        try:
            result = self._fmpy.doStep(currentCommunicationPoint=time, communicationStepSize=step)
        except FMICallException as error:
            if error.status == DISCARD:
                return False
            raise FmuError(f"{self.name}: {error}") from None
        return not (self._is_fmi3 and result[1])

    def _by_type(self, ports: Sequence[Port]) -> Iterator[tuple[str, list[int], list[int]]]:
        """Yield the type in names of functions, value references, and places of the variables of each type."""
        enumeration = "Int64" if self._is_fmi3 else "Integer"
        types = [enumeration if port.type == "Enumeration" else port.type for port in ports]
        for kind in dict.fromkeys(types):
            places = [place for place, own in enumerate(types) if own == kind]
            yield kind, [ports[place].reference for place in places], places

    def _call(self, function: Callable[..., Any], *values: Any, **named: Any) -> Any:
        from fmpy.fmi1 import FMICallException

        try:
            return function(*values, **named)
        except FMICallException as error:
            raise FmuError(f"{self.name}: {error}") from None


@contextmanager
def foreign_slave(name: str, about: Any, folder: Path, log: Log) -> Iterator[AnySlave]:
    """Start a slave of an FMU that is not kinfmu's, and free it at the end.

    Args:
        name: Name of the component, for messages.
        about: fmpy's model description.
        folder: Folder into which the FMU is unpacked.
        log: Called with status and text of each message.

    Raises:
        FmuError: The FMU does not load.

    """
    is_fmi3 = str(about.fmiVersion).startswith("3")
    messages: list[str] = []

    def logged(status: int, text: str) -> None:
        messages.append(text)
        log(status, text)

    try:
        slave = _instance(name, about, folder, is_fmi3, logged)
    except Exception as error:  # fmpy raises bare exceptions
        reason = " ".join([*messages, *str(error).split()])
        raise FmuError(f"FMU '{name}' does not load: {reason}") from None
    try:
        yield AnySlave(name, slave, is_fmi3)
    finally:
        free(slave)


def _instance(name: str, about: Any, folder: Path, is_fmi3: bool, log: Log) -> Any:
    """Return fmpy's object of a new instance."""
    common = {"guid": about.guid, "modelIdentifier": about.coSimulation.modelIdentifier, "instanceName": name}
    if is_fmi3:
        from fmpy.fmi3 import FMU3Slave

        def logger(_environment: object, status: int, _category: bytes, message: bytes) -> None:
            log(status, (message or b"").decode("utf-8", errors="replace"))

        slave = FMU3Slave(unzipDirectory=str(folder), **common)
        slave.instantiate(loggingOn=True, logMessage=logger)
    else:
        from fmpy.fmi2 import FMU2Slave

        slave = FMU2Slave(unzipDirectory=str(folder), **common)
        slave.instantiate(callbacks=fmi2_callbacks(log), loggingOn=False)
    return slave
