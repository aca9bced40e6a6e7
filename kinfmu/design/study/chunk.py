"""A part of a study in a worker: the parameters of some designs in, the columns of their rows out."""

from __future__ import annotations

import pickle
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from kinfmu import VERSION
from kinfmu.arrays import FloatArray
from kinfmu.design.study.definition import REASON, STATUS, Study
from kinfmu.design.study.own_cycle import own_cycles
from kinfmu.errors import StudyError
from kinfmu.motion import DesignMeasures, measure_designs
from kinfmu.run.model import Model

Columns = dict[str, Any]  # arrays (m,) by column; texts of `reason` by the design's number in the part


@dataclass(frozen=True)
class Job:
    """What a worker needs to measure designs of a study; it is sent as bytes and unpacked once.

    Attributes:
        model: The compiled mechanism, with its measures.
        t: (n,) times, or None.
        inputs: Driver values.
        at_own_speed: As in `StudyMotion`.

    """

    model: Model
    t: FloatArray | None
    inputs: Mapping[str, FloatArray | float]
    at_own_speed: bool

    @classmethod
    def of(cls, study: Study) -> Job:
        """Return the job of a study; its model is compiled now."""
        return cls(study.model(), study.motion.t, study.motion.inputs, study.motion.at_own_speed)

    def packed(self) -> bytes:
        """Return the job as bytes."""
        return pickle.dumps(self)

    def measure(self, parameters: Mapping[str, FloatArray]) -> DesignMeasures:
        """Measure designs, whose parameters are (m,) by name."""
        driven: Mapping[str, Any] = self.inputs
        if self.at_own_speed:
            mechanism = self.model.mechanism
            driven = own_cycles(mechanism, self.inputs, parameters)
            parameters = {name: values for name, values in parameters.items() if name in mechanism.parameters}
        return measure_designs(self.model, parameters, t=self.t, **driven)


def run_chunk(packed: bytes, version: str, parameters: Mapping[str, FloatArray]) -> Columns:
    """Return the columns of some designs: what workers run.

    Args:
        packed: The job.
        version: Of the kinfmu that sent it.
        parameters: (m,) by name.

    Raises:
        StudyError: The worker has another version of kinfmu.

    """
    if version != VERSION:
        raise StudyError(f"a worker has kinfmu {VERSION}, and this is kinfmu {version}: install the same there")
    found = _job(packed).measure(parameters)
    columns: Columns = {name: np.asarray(values, dtype=float) for name, values in parameters.items()}
    for name, values in found.values.items():
        columns[name] = values
        columns |= dict(zip(places(name, found.at[name].shape[1]), found.at[name].T, strict=True))
    return columns | {STATUS: found.status.astype(np.int8), REASON: dict(found.reasons)}


def places(measure: str, count: int) -> list[str]:
    """Return the names of the columns of the driver values where a measure occurs."""
    return [f"{measure}.at{k if k > 1 else ''}" for k in range(1, count + 1)]


@lru_cache(maxsize=2)
def _job(packed: bytes) -> Job:
    """Return the job, planned and loaded once in each process."""
    job = pickle.loads(packed)  # noqa: S301  what `Job.packed` made
    if not isinstance(job, Job):
        raise TypeError("the bytes are no job of a study")
    return job
