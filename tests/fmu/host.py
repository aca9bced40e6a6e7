"""A host for tests: fmpy's low-level calls of both versions of FMI, with names in place of value references."""

from __future__ import annotations

import math
import sys
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.fmi3 import FMU3Model, FMU3Slave

from kinfmu.fmu import description
from kinfmu.fmu.host.slaves import fmi2_callbacks

OK, WARNING, DISCARD, ERROR = range(4)
TERMINATED, LAST_SUCCESSFUL_TIME = 3, 2
CLASSES = {(2, False): FMU2Slave, (2, True): FMU2Model, (3, False): FMU3Slave, (3, True): FMU3Model}
WORDS = {  # fmpy's names of types in each version
    2: {"Real": "Real", "Integer": "Integer", "Enumeration": "Integer"},
    3: {"Real": "Float64", "Integer": "Int32", "Enumeration": "Int64"},
}


class Host:
    """One instance of an FMU. messages: what it logged, as (status, text).

    inputs_at: gives inputs by name at any time in a step of FMI 3.0, when the FMU asks for them. events, early:
    co-simulation of FMI 3.0 with event mode, and with steps that may end early.
    """

    def __init__(
        self,
        path: Path,
        folder: Path,
        *,
        model_exchange: bool = False,
        inputs_at: Callable[[float], Mapping[str, float]] | None = None,
        events: bool = False,
        early: bool = False,
    ) -> None:
        if not folder.exists():
            with zipfile.ZipFile(path) as zipped:
                zipped.extractall(folder)
        self.about = description.read((folder / "modelDescription.xml").read_bytes(), str(path))
        self.fmi = int(self.about.version[0])
        self.references = self.about.interface.value_references()
        self.types = {variable.name: variable.type for variable in self.about.interface}
        self.messages: list[tuple[int, str]] = []
        self.is_python = (folder / "resources/slavemodule.txt").exists()
        self._path = list(sys.path)
        self.fmu: Any = CLASSES[self.fmi, model_exchange](
            guid=self.about.token,
            modelIdentifier=self.about.model_identifier,
            unzipDirectory=str(folder),
            instanceName="under_test",
        )
        if self.fmi == 2:
            callbacks = fmi2_callbacks(lambda *message: self.messages.append(message))
            self.fmu.instantiate(callbacks=callbacks, loggingOn=True)
        else:
            self.fmu.instantiate(
                loggingOn=True,
                logMessage=lambda _host, status, _category, text: self.messages.append((status, text.decode())),
                **({} if model_exchange else {"eventModeUsed": events, "earlyReturnAllowed": early}),
                **self._intermediate(inputs_at),
            )

    def _intermediate(self, inputs_at: Callable[[float], Mapping[str, float]] | None) -> dict[str, Any]:
        """What `instantiate` of FMI 3.0 takes for inputs inside a step."""
        if inputs_at is None:
            return {}

        def update(_host: Any, t: float, is_set: bool, is_got: bool, *_others: Any) -> None:
            assert is_set
            assert not is_got
            answer(self.set, inputs_at(t))  # what is refused is in `messages`

        return {"requiredIntermediateVariables": self.of(*inputs_at(0.0)), "intermediateUpdate": update}

    def enter(self, t: float, stop: float | None = None) -> None:
        """Into initialization mode."""
        if self.fmi == 2:
            self.fmu.setupExperiment(startTime=t, stopTime=stop)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=t, stopTime=stop)

    def initialize(self, t: float, stop: float | None = None) -> None:
        self.enter(t, stop)
        self.fmu.exitInitializationMode()

    def of(self, *names: str) -> list[int]:
        return [self.references[name] for name in names]

    def set(self, values: Mapping[str, float | bool | int | str]) -> None:
        for name, value in values.items():
            kind = WORDS[self.fmi].get(self.types[name], self.types[name])
            getattr(self.fmu, f"set{kind}")([self.references[name]], [value])

    def get(self, *names: str) -> list[float]:
        return list(getattr(self.fmu, f"get{WORDS[self.fmi]['Real']}")(self.of(*names)))

    def count(self, name: str) -> int:
        kind = WORDS[self.fmi][self.types[name]]
        return int(getattr(self.fmu, f"get{kind}")(self.of(name))[0])

    def status(self) -> int:
        return self.count("solver.status")

    def message(self) -> str:
        (text,) = self.fmu.getString(self.of("solver.message"))
        return text.decode() if self.fmi == 2 else str(text)

    def real_outputs(self) -> list[str]:
        return [v.name for v in self.about.interface if v.causality == "output" and v.type == "Real"]

    def outputs(self) -> list[float]:
        """All Real outputs: positions, rates, accelerations and diagnostics."""
        return self.get(*self.real_outputs())

    def step(self, t: float, h: float) -> int:
        """Status of doStep."""
        return answer(self.fmu.doStep, t, h)

    def slopes(self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]) -> list[float]:
        """Directional derivatives."""
        function = self.fmu.getDirectionalDerivative
        return list(function(self.of(*unknowns), self.of(*knowns), list(seed)))

    def adjoint(self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]) -> list[float]:
        """Adjoint derivatives, which FMI 3.0 has."""
        known = self.of(*knowns)
        return list(self.fmu.getAdjointDerivative(self.of(*unknowns), known, list(seed), len(known)))

    def state(self) -> Any:
        return self.fmu.getFMUstate() if self.fmi == 2 else self.fmu.getFMUState()

    def restore(self, state: Any) -> None:
        (self.fmu.setFMUstate if self.fmi == 2 else self.fmu.setFMUState)(state)

    def free_state(self, state: Any) -> None:
        (self.fmu.freeFMUstate if self.fmi == 2 else self.fmu.freeFMUState)(state)

    def serialize(self, state: Any) -> bytes:
        return bytes((self.fmu.serializeFMUstate if self.fmi == 2 else self.fmu.serializeFMUState)(state))

    def deserialize(self, data: bytes) -> Any:
        return (self.fmu.deSerializeFMUstate if self.fmi == 2 else self.fmu.deserializeFMUState)(data)

    def refusal(self, values: Mapping[str, float | bool | int | str]) -> str:
        """Set values that must be refused, and return the message.

        The setters of a native FMU return Error; those of a python FMU cannot, and its next step is discarded.
        """
        assert answer(self.set, values) == (OK if self.is_python else ERROR)
        status, text = self.messages[-1]
        assert status == ERROR
        return text

    def step_after_refusal(self, t: float, h: float) -> int:
        """Return the status of doStep, after the one that a python FMU discards."""
        assert not self.is_python or self.step(t, h) == DISCARD
        return self.step(t, h)

    @property
    def invalid(self) -> int:
        """Status of an invalid step: the binary of python FMUs cannot return Error."""
        return DISCARD if self.is_python else ERROR

    def free(self) -> None:
        self.fmu.freeInstance()
        sys.path[:] = self._path  # pythonfmu adds the FMU's resources


def answer(call: Callable[..., object], *arguments: object) -> int:
    """Status of a call."""
    try:
        call(*arguments)
    except FMICallException as failure:
        return int(failure.status)
    return OK


def turned(host: Host, steps: range) -> list[list[float]]:
    """Rows of all outputs of a four-bar's FMU while the crank is turned unevenly."""
    rows = []
    for k in steps:
        host.set({"crank_angle": 0.1 * k + 0.02 * math.sin(k)})
        rows.append(host.outputs())
        assert host.step(0.01 * k, 0.01) == OK
        rows.append(host.outputs())
    return rows
