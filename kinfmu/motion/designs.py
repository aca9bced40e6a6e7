"""`measure_designs`: what designers read off the motions of many designs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinfmu.arrays import FloatArray
from kinfmu.display import Displayed
from kinfmu.errors import KinfmuError, suggestion
from kinfmu.mechanism.measures import Reading
from kinfmu.mechanism.settings import read_tolerance
from kinfmu.motion.batch_reading import BatchReading
from kinfmu.processes import require_workers
from kinfmu.run import Column
from kinfmu.run.model import Model
from kinfmu.run.tables import Tabular
from kinfmu.solver.python.solver import TOLERANCE


@dataclass(frozen=True, eq=False, kw_only=True)
class DesignMeasures(Tabular, Displayed):
    """The measures of m designs, as columns of a table.

    Attributes:
        parameters: (m,) values of the parameters and law constants that were given, by name.
        values: (m,) values of the measures by name; NaN where a measure has none.
        at: (m, k) values of the driver where each measure occurs, by its name: k = 1 for an extreme, 2 for a range, a
            time ratio (smallest, largest) and a dwell (begin, end), 0 for a deviation.
        units: Units of parameters and measures, by name; '1' for a pure number.
        driver: The driver in whose values `at` is; 'time' if several move.
        at_unit: Unit of these.
        status: (m,) the worst status of a design's samples, as in Status.
        reasons: Why a measure of a design has no value (the first of them), by the number of the design.

    """

    parameters: Mapping[str, FloatArray]
    values: Mapping[str, FloatArray]
    at: Mapping[str, FloatArray]
    units: Mapping[str, str]
    driver: str
    at_unit: str
    status: NDArray[np.int32]
    reasons: Mapping[int, str]

    def __len__(self) -> int:
        return len(self.status)

    def __repr__(self) -> str:
        return f"<{len(self)} designs, {int(self.good.sum())} of them with all measures; {', '.join(self.values)}>"

    @property
    def good(self) -> NDArray[np.bool_]:
        """(m,) True where all measures of a design have values."""
        return np.asarray(np.logical_and.reduce([np.isfinite(value) for value in self.values.values()]))

    def __getitem__(self, name: str) -> FloatArray:
        """Return the column (m,) of a measure or a parameter.

        Raises:
            KinfmuError: There is no such column.

        """
        if name in self.values:
            return self.values[name]
        if name in self.parameters:
            return self.parameters[name]
        known = (*self.values, *self.parameters)
        raise KinfmuError(f"the designs have no column '{name}'{suggestion(name, known)}")

    def columns(self) -> Iterator[Column]:
        """Yield parameters, measures with the driver values where they occur ('stroke.at', 'stroke.at2'), status."""
        for name, values in (*self.parameters.items(), *self.values.items()):
            yield Column(name, self.units[name], values)
            for k, at in enumerate(self.at[name].T if name in self.at else ()):
                yield Column(f"{name}.at{k + 1 if k else ''}", self.at_unit, at)
        yield Column("solver.status", "1", self.status)


def measure_designs(
    model: Model,
    parameters: Mapping[str, ArrayLike | str],
    measures: Iterable[Reading | str] | None = None,
    t: ArrayLike | None = None,
    *,
    workers: int = 1,
    tolerance: float = TOLERANCE,
    anew: bool = True,
    **inputs: ArrayLike,
) -> DesignMeasures:
    """Measure the motions of many designs: sets of parameters, at the same times or driver values.

    The values are those of `kinfmu.measure(model.solve(...))` for each design. The motions are solved and measured part
    by part, so that memory holds the measures alone. What cannot be assembled or reached is NaN with a status and a
    reason; it never ends the batch. Results do not depend on the number of workers.

    Args:
        model: The model, compiled with the outputs that the measures need, or with all.
        parameters: Arrays (m,) of parameters and law constants by name, one value for each design; numbers, and texts
            such as "30 rpm", hold for all.
        measures: Measures such as `kinfmu.measures.Range("stroke", of="slider.x")`, or names of those of the mechanism.
            Default: those of the mechanism.
        t: (n,) times [s] for the laws of the file; default: those of the file's run, unless inputs are given.
        workers: Threads of the native engine; the Python engine has one.
        tolerance: Residual relative to the size above which a sample is not ok; positive.
        anew: Assemble designs anew that continuation from the design as written does not reach, as in `solve_designs`.
        **inputs: Driver values in place of t, as in `solve`, the same for all designs (n,) or one row for each (m, n).

    Returns:
        The measures.

    Raises:
        RequestError: A name is unknown, arrays have other lengths, or no motion at these samples can be measured.
        MechanismError: A measure is invalid.
        CompilerError: The engine is 'native' and no compiler is found, or it fails.

    """
    require_workers(workers)
    tolerance = read_tolerance("tolerance", tolerance)
    reading = BatchReading(model, parameters, measures, t, tolerance=tolerance, anew=anew, inputs=inputs)
    reading.run(workers)
    count = len(reading.status)
    return DesignMeasures(
        parameters={name: np.broadcast_to(array, count) for name, array in reading.parameters.items()},
        values=reading.values,
        at=reading.at,
        units=reading.units,
        driver=reading.motion.driver,
        at_unit=reading.at_unit,
        status=reading.status,
        reasons=dict(sorted(reading.reasons.items())),
    )
