"""A job measures designs: those of a part in a worker, and the design as written with its derivatives."""

from __future__ import annotations

import math
import pickle
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from kinfmu import VERSION
from kinfmu.arrays import FloatArray
from kinfmu.design.study.definition import REASON, STATUS, Study, own_cycles
from kinfmu.errors import KinfmuError, StudyError
from kinfmu.mechanism.measures import Maximum, Minimum, Range, Reading
from kinfmu.motion import DesignMeasures, measure_designs
from kinfmu.run.model import Model

Columns = dict[str, Any]  # arrays (m,) by column; texts of `reason` by the design's number in the part


@dataclass(frozen=True)
class Job:
    """What a worker needs to measure designs of a study; it is sent as bytes and unpacked once.

    model: the compiled mechanism, with its measures; t: (n,) times, or None; inputs, at_own_speed: as in `StudyMotion`.
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

    Raise a StudyError if the worker has another version of kinfmu.

    packed: The job. version: Of the kinfmu that sent it. parameters: (m,) by name.
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


STEP = 0.1  # of difference quotients, in standard deviations: their error is a hundredth of the third-order term
_ENDS: dict[type[Reading], tuple[float, ...]] = {Minimum: (1.0,), Maximum: (1.0,), Range: (-1.0, 1.0)}
EXACT, DIFFERENCES = "sensitivities", "differences"


@dataclass(frozen=True)
class NominalMeasure:
    """A measure of the design as written.

    Attributes:
        value: Its value; nan if it has none.
        unit: Its unit.
        at: Driver values where it occurs.
        at_unit: Unit of these.
        slopes: Derivatives with respect to the parameters that have tolerances, by name; nan: unknown.
        method: How they were found: 'sensitivities', exact derivatives at the extreme, or 'differences', central
            difference quotients over a fifth of a standard deviation.

    """

    value: float
    unit: str
    at: tuple[float, ...]
    at_unit: str
    slopes: Mapping[str, float] = field(default_factory=dict)
    method: str = ""


@dataclass(frozen=True)
class Nominal:
    """The design as written.

    measures: by name; deviations: standard deviations of the tolerances by name, none if the study has no tolerances,
    or others too; reason: why it has no numbers, '' if it has.
    """

    measures: Mapping[str, NominalMeasure]
    deviations: Mapping[str, float]
    reason: str = ""

    def variances(self, measure: str) -> dict[str, float]:
        """Return by parameter the variance that it contributes to a measure, to first order: (dm/dp s_p)^2."""
        slopes = self.measures[measure].slopes
        return {name: (slopes[name] * deviation) ** 2 for name, deviation in self.deviations.items()}

    def deviation(self, measure: str) -> float:
        """Return the standard deviation of a measure to first order; the parameters deviate independently."""
        return math.sqrt(sum(self.variances(measure).values()))

    def contributions(self, measure: str) -> dict[str, float]:
        """Return by parameter its part of the variance of a measure, 0 to 1, the largest first."""
        variances = self.variances(measure)
        whole = sum(variances.values())
        order = sorted(variances, key=lambda name: -variances[name] if variances[name] == variances[name] else 0.0)
        return {name: variances[name] / whole if whole else 0.0 for name in order}

    def as_json(self) -> dict[str, Any]:
        """Return all as plain data."""
        return asdict(self)

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> Nominal:
        """Return what `as_json` gave."""
        measures = {
            name: NominalMeasure(**{**one, "at": tuple(one["at"])}) for name, one in content["measures"].items()
        }
        return cls(measures, content["deviations"], content["reason"])


def nominal(study: Study, job: Job) -> Nominal:
    """Measure the design as written, and differentiate its measures by the parameters with tolerances.

        s_m^2 = sum_p (dm/dp s_p)^2

    An extreme of a coordinate that occurs at x has the derivative of the coordinate there: d max q / dp = dq/dp (x), as
    the extreme's own shift has no effect to first order (envelope theorem). Its derivatives are exact. Those of other
    measures are central differences.
    """
    tolerances = study.sampling.tolerances
    written = study.mechanism.settable
    values = {one.name: float(written[one.name].value) for one in study.sampling.variations} | {
        one.name: one.nominal for one in tolerances
    }
    rows = [values]
    for one in tolerances:
        rows += [values | {one.name: one.nominal + sign * STEP * one.deviation} for sign in (1.0, -1.0)]
    found = job.measure({name: np.array([row[name] for row in rows]) for name in values})
    measures = {}
    for reading in study.mechanism.measures:
        name = reading.name
        column, at = found.values[name], tuple(float(x) for x in found.at[name][0])
        slopes = {
            one.name: float((column[2 * k + 1] - column[2 * k + 2]) / (2.0 * STEP * one.deviation))
            for k, one in enumerate(tolerances)
        }
        exact = _exact(study, job, reading, at, values) if tolerances else None
        measures[name] = NominalMeasure(
            value=float(column[0]),
            unit=found.units[name],
            at=at,
            at_unit=found.at_unit,
            slopes=exact or slopes,
            method=(EXACT if exact else DIFFERENCES) if tolerances else "",
        )
    return Nominal(measures, {one.name: one.deviation for one in tolerances}, found.reasons.get(0, ""))


def _exact(
    study: Study, job: Job, reading: Reading, at: tuple[float, ...], values: Mapping[str, float]
) -> dict[str, float] | None:
    """Return exact derivatives of an extreme of a coordinate; None for other measures, and where there are none."""
    signs = _ENDS.get(type(reading))
    of = getattr(reading, "of", None)
    drivers = study.mechanism.drivers
    if signs is None or study.motion.t is not None or len(drivers) != 1 or of not in job.model.outputs:
        return None
    if not all(map(math.isfinite, at)):
        return None
    value, speed, _ = drivers[0].inputs()
    driven: Mapping[str, Any] = {value: np.array(at), speed: 1.0}
    names = [one.name for one in study.sampling.tolerances]
    try:
        found = job.model.sensitivities(outputs=[of], wrt=names, parameters=dict(values), **driven)
    except KinfmuError:  # a parameter that the model solves for only as a number
        return None
    slopes = np.array(signs) @ found.values_by[:, 0, :]
    if not np.isfinite(slopes).all():
        return None
    return dict(zip(names, map(float, slopes), strict=True))
