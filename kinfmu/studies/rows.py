"""The rows of a study, one for each design, read from its Parquet file column by column."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from kinfmu.errors import MissingPackageError, StudyError, suggestion
from kinfmu.mechanism import Mechanism, toml_file
from kinfmu.mechanism.display_unit import DisplayUnit, display_unit
from kinfmu.mechanism.valid import quoted
from kinfmu.run import FloatArray
from kinfmu.run.tables import table_package
from kinfmu.studies.definition import DESIGN, REASON
from kinfmu.studies.nominal import Nominal
from kinfmu.studies.statistics import Moments, Statistics
from kinfmu.studies.table import metadata_of
from kinfmu.units import quantity_in


class StudyRows:
    """A row for each design of a study, and what they were made from; attributes as in `StudyResult`."""

    def __init__(self, source: Path | bytes) -> None:
        self._source = source
        self._name = str(source) if isinstance(source, Path) else "the results"
        schema = self._file().schema_arrow
        about = metadata_of(schema)
        if not {"fingerprint", "study", "nominal", "mechanism"} <= set(about):
            raise StudyError(f"{self._name}: not the results of a study")
        roles = {field.name: (field.metadata or {}).get(b"role", b"").decode() for field in schema}
        self.parameters = tuple(name for name, role in roles.items() if role == "parameter")
        self.measures = tuple(name for name, role in roles.items() if role == "measure")
        self.units = {field.name: (field.metadata or {}).get(b"unit", b"").decode() for field in schema}
        self._shown = {field.name: (field.metadata or {}).get(b"display_unit", b"").decode() for field in schema}
        self.definition: Mapping[str, Any] = json.loads(about["study"])
        self.nominal = Nominal.from_json(json.loads(about["nominal"]))
        self.version = about["version"]
        self._mechanism_text = about["mechanism"]

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """Return the results in a Parquet file.

        Args:
            path: The file that a study wrote.

        Raises:
            StudyError: The file cannot be read, or is not one of a study.

        """
        if not isinstance(path, str | Path):
            raise StudyError(f"path = {quoted(path)} must be the path of a Parquet file")
        return cls(Path(path))

    @classmethod
    def of_bytes(cls, content: bytes) -> Self:
        """Return the results in the content of a Parquet file.

        Args:
            content: The bytes of such a file.

        Returns:
            The results; tables are read when they are asked for.

        """
        return cls(content)

    def _file(self) -> Any:
        """Return the pyarrow.parquet.ParquetFile."""
        try:
            import pyarrow as pa
            import pyarrow.parquet as pq
        except ImportError:
            raise MissingPackageError(f"{self._name}: reading Parquet needs pyarrow: pip install pyarrow") from None
        try:
            return pq.ParquetFile(self._source if isinstance(self._source, Path) else io.BytesIO(self._source))
        except (OSError, pa.ArrowInvalid) as error:
            raise StudyError(f"{self._name}: cannot be read ({error})") from None

    def __len__(self) -> int:
        return int(self._file().metadata.num_rows)

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return a column (m,): a parameter, a measure, 'stroke.at', 'solver.status' or 'design'.

        Raises:
            StudyError: There is no such column.

        """
        if name not in self.units:
            raise StudyError(f"the study has no column '{name}'{suggestion(name, self.units)}")
        return np.asarray(self._file().read(columns=[name]).column(0).to_numpy())

    @cached_property
    def mechanism(self) -> Mechanism:
        """The mechanism as written, with the measures of the study."""
        return toml_file.parse(self._mechanism_text, "the study's mechanism")

    @cached_property
    def failures(self) -> dict[int, str]:
        """Why a measure of a design has no value, by the number of the design."""
        found: dict[int, str] = {}
        for batch in self._batches([DESIGN, REASON]):
            reasons = batch.column(1)
            if reasons.null_count < len(reasons):
                numbers, texts = batch.column(0).to_pylist(), reasons.to_pylist()
                found |= {k: text for k, text in zip(numbers, texts, strict=True) if text is not None}
        return found

    @cached_property
    def first_failure(self) -> tuple[int, int, str] | None:
        """How many designs lack a measure, the number of the first, and why it does; None if none does."""
        count, first = 0, None
        for batch in self._batches([DESIGN, REASON]):
            known = batch.column(1).is_valid()
            if first is None and known.true_count:
                row = known.index(True).as_py()
                first = (batch.column(0)[row].as_py(), batch.column(1)[row].as_py())
            count += known.true_count
        return None if first is None else (count, *first)

    @cached_property
    def statistics(self) -> dict[str, Statistics]:
        """Mean, deviation and extremes of the measures over all designs that have one, by name."""
        moments = {name: Moments() for name in self.measures}
        for batch in self._batches(list(self.measures)):
            for name, column in zip(self.measures, batch.columns, strict=True):
                moments[name].add(column.to_numpy())
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

    def columns(self) -> Iterator[tuple[str, FloatArray]]:
        """Yield all columns but that of reasons, with their names."""
        for name in self.units:
            if name != REASON:
                yield name, self[name]

    def to_arrow(self) -> Any:
        """Return the rows as a pyarrow.Table, with the unit of each column in the metadata of its field."""
        return self._file().read()

    def to_pandas(self) -> Any:
        """Return the rows as a pandas.DataFrame, with the units by column in `attrs["units"]`.

        Raises:
            MissingPackageError: pandas is not installed.

        """
        table_package("pandas")
        frame = self.to_arrow().replace_schema_metadata().to_pandas()
        frame.attrs["units"] = dict(self.units)
        return frame

    def to_polars(self) -> Any:
        """Return the rows as a polars.DataFrame.

        Raises:
            MissingPackageError: polars is not installed.

        """
        return table_package("polars").from_arrow(self.to_arrow())

    def _batches(self, columns: list[str]) -> Iterator[Any]:
        """Yield row groups of columns, so that memory holds one of them."""
        file = self._file()
        for k in range(file.num_row_groups):
            yield from file.read_row_group(k, columns=columns).to_batches()


def study_in(path: Path) -> Mapping[str, str]:
    """Return the metadata of the study whose results a file holds; empty for another file, or none."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        return metadata_of(pq.read_schema(path))
    except (OSError, ValueError, pa.ArrowException):
        return {}
