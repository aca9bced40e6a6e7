"""Designs: the motions of a mechanism with many sets of parameters, as arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinfmu.arrays import FloatArray, new_numbers
from kinfmu.display import Displayed
from kinfmu.errors import KinfmuError, RequestError, listed, suggestion
from kinfmu.mechanism import LawConstant
from kinfmu.mechanism.valid import LARGEST_NUMBER
from kinfmu.plan import SolvePlan
from kinfmu.plan.plan import PlanParameter
from kinfmu.processes import in_threads
from kinfmu.run import Run
from kinfmu.run.arguments import Arguments, Settings
from kinfmu.run.driving import driven_by_inputs, numbers_of, times_of
from kinfmu.run.engine import Driven
from kinfmu.solver.python.pose import Status
from kinfmu.units import CoordinateName

if TYPE_CHECKING:
    from kinfmu.run.native_engine import DesignReader, Library

SAMPLES_AT_ONCE = 500_000  # of a piece of work: its diagnostics stay in some 30 MB


@dataclass(frozen=True, eq=False, kw_only=True)
class Designs(Displayed):
    """The motions of m designs at n samples.

    Designs that cannot be assembled, and samples that cannot be reached, are NaN with a status of 3 to 5.

    Attributes:
        parameters: (m,) values of the parameters and law constants that were given, by name.
        t: (n,) times [s]; of designs over driver values the numbers of the samples.
        outputs: Names of the k outputs.
        values: (m, n, k) in the mechanism's unit of length and rad.
        rates: (m, n, k), per second or per unit of the driver; None if they were not asked for.
        accelerations: (m, n, k); None if they were not asked for.
        status: (m, n) values of Status.
        reasons: Why a design has no numbers at some sample (the first of them), by its number.
        anew: Numbers of designs that continuation from the design as written does not reach: they were assembled anew
            from the start poses of the file, as a file with their parameters would be.

    """

    parameters: Mapping[str, FloatArray]
    t: FloatArray
    outputs: tuple[CoordinateName, ...]
    values: FloatArray
    rates: FloatArray | None
    accelerations: FloatArray | None
    status: NDArray[np.int32]
    reasons: Mapping[int, str]
    anew: tuple[int, ...]

    def __len__(self) -> int:
        return len(self.status)

    def __repr__(self) -> str:
        designs, samples = self.status.shape
        whole = int(self.good.all(axis=1).sum())
        return f"<{designs} designs at {samples} samples, {whole} of them without gaps; {', '.join(self.outputs)}>"

    @property
    def good(self) -> NDArray[np.bool_]:
        """(m, n) True where a sample holds numbers (status 0 to 2)."""
        return np.asarray(self.status <= Status.BRIDGED)

    def __getitem__(self, name: str) -> FloatArray:
        """Return the column of an output or of its rate or acceleration, such as 'coupler.vx', as (m, n).

        Raises:
            KinfmuError: There is no such column.

        """
        tables = (self.values, self.rates, self.accelerations)
        places = {
            output.derivative(order): (table, k)
            for order, table in enumerate(tables)
            if table is not None
            for k, output in enumerate(self.outputs)
        }
        if name not in places:
            raise KinfmuError(f"the designs have no column '{name}'{suggestion(name, places)}")
        table, column = places[name]
        return table[:, :, column]


class Solvable(Protocol):
    """What batches of designs and sensitivities need of a Model."""

    plan: SolvePlan
    arguments: Arguments

    def solve(
        self,
        t: ArrayLike | None = None,
        *,
        parameters: Settings | None,
        tolerance: float,
        anew: bool = True,
        **inputs: Any,
    ) -> Run:
        """Return the run of one design, assembled anew if continuation does not reach it."""

    def is_native(self, count: int) -> bool:
        """Return whether so many samples are solved by the native engine; its library is compiled then."""

    def load_library(self) -> Library: ...


class Batch:
    """A batch of m designs at n samples, while it is solved.

    Args:
        model: The model.
        parameters: Arrays (m,), or numbers and texts that hold for all designs, by name.
        count: Number of designs if there are no parameters.

    Raises:
        RequestError: A name is unknown, or arrays have other lengths.

    """

    def __init__(self, model: Solvable, parameters: Mapping[str, ArrayLike | str], count: int = 1) -> None:
        self.model = model
        self.plan = model.plan
        self.parameters = _arrays(model, parameters)
        self.count = max((len(array) for array in self.parameters.values()), default=count)
        self.values = self._rows(self.plan.parameters)
        if model.arguments.opens_expressions:
            self.values = np.array([self._followed(design) for design in range(self.count)])
        self.constants = self._rows(self.plan.law_constants)
        self._of_loads = self._rows(self.plan.load_constants)

    def driving(self, t: ArrayLike | None, inputs: Mapping[str, ArrayLike]) -> Driving:
        """Return what moves the designs: times, or inputs.

        Raise a RequestError if times or inputs are invalid, or constants of the drivers' laws are given, without effect
        where inputs are.
        """
        driven = self._driven(inputs)
        times = times_of(self.plan.mechanism.run, t) if driven is None else np.arange(driven[0].shape[-2], dtype=float)
        return Driving(times, driven, {name: numbers_of(name, value) for name, value in inputs.items()})

    def _driven(self, inputs: Mapping[str, ArrayLike]) -> Driven | None:
        """Return driver values, speeds and accelerations as `Driving` has them; None without inputs."""
        if not inputs:
            return None
        drivers = {driver.name for driver in self.plan.drivers}
        constants = {constant.name for constant in self.plan.law_constants}
        unused = [name for name in self.parameters if name in constants and name.partition(".")[0] in drivers]
        if unused:
            raise RequestError(
                f"{listed(unused)}: the laws of drivers have no effect where {listed(inputs)} is given; "
                "leave them out, or give times in place of inputs"
            )
        return driven_by_inputs(self.plan.drivers, inputs, rows=self.count)

    def of_model(self, model: Solvable) -> Batch:
        """Return the same designs of a model with the same arguments."""
        other = copy(self)
        other.model, other.plan = model, model.plan
        return other

    def part(self, part: slice) -> Batch:
        """Return a batch of some of the designs."""
        some = copy(self)
        some.parameters = {name: array[part] if len(array) > 1 else array for name, array in self.parameters.items()}
        some.values, some.constants, some._of_loads = self.values[part], self.constants[part], self._of_loads[part]
        some.count = len(some.values)
        return some

    def of(self, design: int) -> dict[str, float]:
        """Return the parameters of one design."""
        return {name: float(array[design % len(array)]) for name, array in self.parameters.items()}

    def invalid(self) -> NDArray[np.bool_]:
        """Return (m,): True if a number of a design is not finite, too large, or not positive where it must be."""
        constants = np.hstack([self.constants, self._of_loads])
        positive = [one.is_positive for one in (*self.plan.law_constants, *self.plan.load_constants)]
        found = ~np.logical_and.reduce(
            [(np.abs(table) <= LARGEST_NUMBER).all(axis=1) for table in (self.values, constants)]
        )
        return np.asarray(found | ~(constants[:, positive] > 0.0).all(axis=1))

    def _rows(self, declared: Sequence[PlanParameter | LawConstant]) -> FloatArray:
        """Return the values of all designs, (m, number of those declared)."""
        rows = np.empty((self.count, len(declared)))
        for k, one in enumerate(declared):
            rows[:, k] = self.parameters.get(one.name, one.value)
        return rows

    def _followed(self, design: int) -> Sequence[float]:
        """Return the values of a design, in which expressions that are not given follow from what is given."""
        arguments = self.model.arguments
        try:
            return arguments.setting(self.of(design)).values or arguments.written
        except KinfmuError:  # an invalid number, which `invalid` finds
            return tuple(self.values[design])


class Driving(NamedTuple):
    """What moves all designs.

    times: (n,) for the laws, or the numbers of the samples. driven: (n, d) or (m, n, d) driver values, speeds and
    accelerations; None: by the laws. inputs: the same as they were given, by name; none: by the laws.
    """

    times: FloatArray
    driven: Driven | None
    inputs: Mapping[str, FloatArray]

    def part(self, part: slice) -> Driving:
        """Return what moves some of the designs."""
        driven, inputs = self.driven, self.inputs
        if driven is not None and driven[0].ndim == 3:
            driven = (driven[0][part], driven[1][part], driven[2][part])
        return Driving(self.times, driven, {name: row[part] if row.ndim == 2 else row for name, row in inputs.items()})

    def of(self, design: int) -> dict[str, Any]:
        """Return what moves one design as arguments of `solve`."""
        inputs = {name: row[design] if row.ndim == 2 else row for name, row in self.inputs.items()}
        return inputs or {"t": self.times}


Wanted = Sequence[FloatArray | None]  # (m, n, k) each: values, rates, accelerations; None: not wanted


def solve_batch(batch: Batch, driving: Driving, *, highest: int, tolerance: float, anew: bool, threads: int) -> Designs:
    """Solve a batch of designs.

    Args:
        batch: The designs.
        driving: What moves them.
        highest: Highest derivative wanted: 0, 1 or 2.
        tolerance: Residual relative to the size above which a sample is not ok.
        anew: Assemble designs anew that continuation does not reach.
        threads: Of the compiled plan; 0: design after design, as the model solves them.

    Returns:
        The designs.

    """
    shape = (batch.count, len(driving.times), len(batch.plan.outputs))
    tables: list[Any] = [
        new_numbers(shape[0], shape[2], shape[1]).transpose(0, 2, 1) if order <= highest else None for order in range(3)
    ]
    status = np.empty(shape[:2], dtype=np.int32)
    reasons: dict[int, str] = {}
    alone: Sequence[int] = range(batch.count)
    if threads:
        alone, reasons = solve_by_library(batch, driving, tables, status, tolerance, threads, anew=anew)
    assembled = []
    for design in alone:
        outcome = solve_alone(batch, driving, design, tables, status, tolerance, anew=anew)
        if outcome.is_assembled:
            assembled.append(design)
        if outcome.reason:
            reasons[design] = outcome.reason
    return Designs(
        parameters=batch.parameters,
        t=driving.times,
        outputs=batch.plan.outputs,
        values=tables[0],
        rates=tables[1],
        accelerations=tables[2],
        status=status,
        reasons=dict(sorted(reasons.items())),
        anew=tuple(assembled),
    )


def solve_by_library(
    batch: Batch,
    driving: Driving,
    tables: Wanted,
    status: NDArray[np.int32],
    tolerance: float,
    threads: int,
    *,
    anew: bool,
    reader: DesignReader | None = None,
) -> tuple[Sequence[int], dict[int, str]]:
    """Fill the tables by the compiled plan; return the designs still to be solved alone, and reasons of the others.

    reader: Reads each design as soon as it is solved, by one thread.
    """
    from kinfmu.run.native_engine import LawDriven

    library, start = batch.model.load_library(), batch.plan.mechanism.run.start
    invalid = batch.invalid()
    written = [parameter.value for parameter in batch.plan.parameters]
    values = np.where(invalid[:, None], written, batch.values)

    def piece(part: slice) -> tuple[NDArray[np.int32], dict[int, str]]:
        law = LawDriven(driving.times, batch.constants[part], start) if driving.driven is None else None
        into = [None if table is None else table[part] for table in tables]
        moved = driving.part(part).driven
        return library.solve_designs(values[part], moved, law, into, status[part], tolerance, reader)

    most = batch.count if reader is not None else max(1, SAMPLES_AT_ONCE // max(1, len(driving.times)))
    parts = parts_of(batch.count, most, threads)
    found = in_threads(piece, parts, threads)
    alone: set[int] = set(np.flatnonzero(invalid).tolist())
    reasons: dict[int, str] = {}
    for part, (reached, why) in zip(parts, found, strict=True):
        reasons |= {part.start + k: reason for k, reason in why.items()}
        if anew:
            alone |= {part.start + int(k) for k in np.flatnonzero(reached)}
    return sorted(alone), {design: reason for design, reason in reasons.items() if design not in alone}


def parts_of(designs: int, most: int, threads: int) -> list[slice]:
    """Return slices of designs, of at most so many each; several for each thread, as many for one as for another."""
    count = -(-designs // most)
    if threads > 1:
        count = max(4, -(-count // threads)) * threads
    size = max(1, -(-designs // max(1, count)))
    return [slice(first, min(first + size, designs)) for first in range(0, designs, size)]


class Outcome(NamedTuple):
    """How one design was solved: why it has gaps, else ''; assembled anew; not reached: it has no run at all."""

    reason: str
    is_assembled: bool = False
    is_reached: bool = True


def solve_alone(
    batch: Batch,
    driving: Driving,
    design: int,
    tables: Wanted,
    status: NDArray[np.int32],
    tolerance: float,
    *,
    anew: bool,
) -> Outcome:
    """Fill the tables of one design as `solve` solves it."""
    parameters = batch.of(design)
    try:
        run = batch.model.solve(parameters=parameters, tolerance=tolerance, anew=anew, **driving.of(design))
    except KinfmuError as error:
        for table in tables:
            if table is not None:
                table[design] = np.nan
        status[design] = Status.INCONSISTENT
        return Outcome(str(error), is_reached=False)
    for table, values in zip(tables, (run.values, run.rates, run.accelerations), strict=True):
        if table is not None:
            table[design] = values
    status[design] = run.status
    return Outcome(first_failure(run), is_assembled=bool(run.events) and run.events[0].level == "info")


def first_failure(run: Run) -> str:
    """Return why a run has no numbers at some sample; '' if it has no gaps."""
    return next((event.text for event in run.events if event.level == "error"), "")


def _arrays(model: Solvable, parameters: Mapping[str, ArrayLike | str]) -> dict[str, FloatArray]:
    """Return the parameters as arrays (m,) or (1,) of numbers."""
    if not isinstance(parameters, Mapping):
        raise RequestError(
            f"parameters must be arrays by name, such as {{'a': [1.0, 1.1]}}, not {type(parameters).__name__}"
        )
    arrays: dict[str, FloatArray] = {}
    for name, value in parameters.items():
        if isinstance(value, str):
            arrays[name] = np.array([model.arguments.number(name, value)])
            continue
        model.arguments.number(name, 1.0)
        valid = "numbers, or text with a unit for all designs"
        arrays[name] = np.atleast_1d(numbers_of(f"parameter '{name}'", value, valid))
        if arrays[name].ndim != 1:
            raise RequestError(f"parameter '{name}' must be a number or (m,), not of shape {arrays[name].shape}")
    lengths = {len(array) for array in arrays.values()} - {1}
    if len(lengths) > 1:
        sizes = listed(f"{name} ({len(array)})" for name, array in arrays.items())
        raise RequestError(f"parameters must have equal lengths or be single numbers: {sizes}")
    return arrays
