"""The rows of a study, one for each design, read from its table column by column, and their statistics."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray
from kinfmu.design.study.definition import DESIGN, REASON
from kinfmu.design.study.job import Nominal
from kinfmu.design.study.table import Table, table_in
from kinfmu.errors import StudyError, suggestion
from kinfmu.mechanism import Mechanism, toml_file
from kinfmu.mechanism.number import DisplayUnit, display_unit
from kinfmu.mechanism.valid import quoted
from kinfmu.run.tables import Column, Tabular, table_package
from kinfmu.units import quantity_in


@dataclass(frozen=True)
class Statistics:
    """Statistics of the designs that have a number.

    Attributes:
        count: How many have one.
        mean: Mean.
        deviation: Standard deviation of the sample (n - 1); nan of fewer than two.
        low: Smallest.
        high: Largest.
        missing: How many have none.

    """

    count: int
    mean: float
    deviation: float
    low: float
    high: float
    missing: int


class Moments:
    """Statistics of numbers that arrive part by part (Chan, Golub, LeVeque 1979)."""

    def __init__(self) -> None:
        self._count = self._missing = 0
        self._mean = self._squares = 0.0
        self._low, self._high = np.inf, -np.inf

    def add(self, numbers: FloatArray) -> None:
        """Add numbers (m,); those that are not finite count as missing."""
        known = numbers[np.isfinite(numbers)]
        self._missing += len(numbers) - len(known)
        if not len(known):
            return
        count = self._count + len(known)
        mean = float(known.mean())
        apart = mean - self._mean
        self._squares += float(((known - mean) ** 2).sum()) + apart**2 * self._count * len(known) / count
        self._mean += apart * len(known) / count
        self._count = count
        self._low, self._high = min(self._low, float(known.min())), max(self._high, float(known.max()))

    def statistics(self) -> Statistics:
        """Return the statistics of all numbers so far."""
        if not self._count:
            return Statistics(0, np.nan, np.nan, np.nan, np.nan, self._missing)
        deviation = (self._squares / (self._count - 1)) ** 0.5 if self._count > 1 else np.nan
        return Statistics(self._count, self._mean, deviation, self._low, self._high, self._missing)


class StudyRows(Tabular):
    """A row for each design of a study, and what they were made from; attributes as in `StudyResult`."""

    def __init__(self, table: Table, name: str = "the results") -> None:
        self._table = table
        fields, about = table.layout.fields, table.layout.about
        if not {"fingerprint", "study", "nominal", "mechanism"} <= set(about):
            raise StudyError(f"{name}: not the results of a study")
        self.parameters = tuple(field.name for field in fields if field.role == "parameter")
        self.measures = tuple(field.name for field in fields if field.role == "measure")
        self.units = {field.name: field.unit for field in fields}
        self._shown = {field.name: field.display_unit for field in fields}
        self.definition: Mapping[str, Any] = json.loads(about["study"])
        self.nominal = Nominal.from_json(json.loads(about["nominal"]))
        self.version = about["version"]
        self._mechanism_text = about["mechanism"]

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """Return the results in a file.

        Args:
            path: The .parquet or .csv file that a study wrote; next to the latter lies its FILE.json.

        Raises:
            StudyError: The file cannot be read, or is not one of a study.
            MissingPackageError: Parquet without pyarrow.

        """
        if not isinstance(path, str | Path):
            raise StudyError(f"path = {quoted(path)} must be the path of a .parquet or .csv file")
        return cls(table_in(Path(path)), str(path))

    def __len__(self) -> int:
        return len(self._table)

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return a column (m,): a parameter, a measure, 'stroke.at', 'solver.status' or 'design'.

        Raises:
            StudyError: There is no such column.

        """
        if name not in self.units:
            raise StudyError(f"the study has no column '{name}'{suggestion(name, self.units)}")
        return self._table.column(name)

    @cached_property
    def mechanism(self) -> Mechanism:
        """The mechanism as written, with the measures of the study."""
        return toml_file.parse(self._mechanism_text, "the study's mechanism")

    @cached_property
    def failures(self) -> dict[int, str]:
        """Why a measure of a design has no value, by the number of the design."""
        texts: dict[int, str] = {}
        for rows in self._table.batches([DESIGN, REASON]):
            known = np.flatnonzero(rows[REASON])
            texts |= dict(zip(rows[DESIGN][known].tolist(), rows[REASON][known].tolist(), strict=True))
        return texts

    @cached_property
    def first_failure(self) -> tuple[int, int, str] | None:
        """How many designs lack a measure, the number of the first, and why it does; None if none does."""
        count, first = 0, None
        for rows in self._table.batches([DESIGN, REASON]):
            known = np.flatnonzero(rows[REASON])
            if first is None and len(known):
                first = (int(rows[DESIGN][known[0]]), str(rows[REASON][known[0]]))
            count += len(known)
        return None if first is None else (count, *first)

    @cached_property
    def statistics(self) -> dict[str, Statistics]:
        """Mean, deviation and extremes of the measures over all designs that have one, by name."""
        moments = {name: Moments() for name in self.measures}
        for rows in self._table.batches(list(self.measures)):
            for name in self.measures:
                moments[name].add(rows[name])
        return {name: one.statistics() for name, one in moments.items()}

    def display_unit(self, name: str) -> DisplayUnit:
        """Return the unit in which summary and pictures show a column: as the files write it, measured angles in deg.

        The column itself and `units` keep the units of the table.

        Args:
            name: Name of a column, such as a measure or a parameter.

        """
        length = self.mechanism.length_unit
        own, shown = self.units[name], self._shown[name]
        quantity = None if own == "1" else quantity_in(own, length)
        return display_unit(quantity, length, shown) if shown else DisplayUnit(own)

    def good(self) -> NDArray[np.bool_]:
        """Return (m,) True for designs whose measures all have values."""
        return np.asarray(np.logical_and.reduce([np.isfinite(self[name]) for name in self.measures]))

    def columns(self) -> Iterator[Column]:
        """Yield all columns; in that of reasons are texts, or None."""
        for name, unit in self.units.items():
            yield Column(name, unit, self[name])

    def shown_columns(self) -> list[Column]:
        """Return all columns but that of reasons, in the units in which summary and pictures show them."""
        found = []
        for name, _, values in self.columns():
            if name != REASON:
                unit, factor = self.display_unit(name)
                found.append(Column(name, unit, values if factor == 1.0 else values / factor))
        return found

    def to_arrow(self) -> Any:
        """Return the rows as a pyarrow.Table, with the unit of each column in the metadata of its field.

        Raises:
            MissingPackageError: pyarrow is not installed.

        """
        table_package("pyarrow")
        return self._table.to_arrow()


def study_in(path: Path) -> Mapping[str, str]:
    """Return the metadata of the study whose results a file holds; empty for another file, or none."""
    try:
        return table_in(path).layout.about
    except StudyError:
        return {}
