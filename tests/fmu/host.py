"""A host for tests: fmpy's low-level calls, with names in place of value references."""

from __future__ import annotations

import sys
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave

from kinfmu.fmu import description
from kinfmu.fmu.slaves import fmi2_callbacks

DISCARD, TERMINATED, LAST_SUCCESSFUL_TIME = 2, 3, 2


class Host:
    """One slave of an FMU. messages: what it logged, as (status, text)."""

    def __init__(self, path: Path, folder: Path) -> None:
        with zipfile.ZipFile(path) as zipped:
            zipped.extractall(folder)
        self.about = description.read((folder / "modelDescription.xml").read_bytes(), str(path))
        self.references = self.about.interface.value_references()
        self.types = {variable.name: variable.type for variable in self.about.interface}
        self.messages: list[tuple[int, str]] = []
        self._path = list(sys.path)
        self.slave: Any = FMU2Slave(
            guid=self.about.token,
            modelIdentifier=self.about.model_identifier,
            unzipDirectory=str(folder),
            instanceName="under_test",
        )
        self.slave.instantiate(callbacks=fmi2_callbacks(lambda *message: self.messages.append(message)), loggingOn=True)

    def initialize(self, t: float, stop: float | None = None) -> None:
        self.slave.setupExperiment(startTime=t, stopTime=stop)
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()

    def set(self, values: Mapping[str, float | bool | int | str]) -> None:
        for name, value in values.items():
            kind = {"Enumeration": "Integer"}.get(self.types[name], self.types[name])
            getattr(self.slave, f"set{kind}")([self.references[name]], [value])

    def get(self, *names: str) -> list[float]:
        return list(self.slave.getReal([self.references[name] for name in names]))

    def status(self) -> int:
        return int(self.slave.getInteger([self.references["solver.status"]])[0])

    def message(self) -> str:
        return str(self.slave.getString([self.references["solver.message"]])[0].decode())

    def outputs(self) -> list[float]:
        """All Real outputs: positions, rates, accelerations and diagnostics."""
        return self.get(*(v.name for v in self.about.interface if v.causality == "output" and v.type == "Real"))

    def step(self, t: float, h: float) -> bool:
        """DoStep; False if it is Discard, every other failure raises."""
        try:
            self.slave.doStep(t, h)
        except FMICallException as failure:
            if failure.status != DISCARD:
                raise
            return False
        return True

    def free(self) -> None:
        self.slave.freeInstance()
        sys.path[:] = self._path
