"""The table of a study: one row for each design, with units, and what it was made from.

A .parquet file holds all of it. A .csv file holds the rows alone, and a file FILE.json next to it has the rest. A
finished part of a study is a .npz file.
"""

from __future__ import annotations

import csv
import io
import json
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinfmu import VERSION
from kinfmu.design.study.definition import DESIGN, REASON, STATUS, Study
from kinfmu.design.study.job import Columns, Nominal, places
from kinfmu.errors import MissingPackageError, StudyError

CSV, PARQUET = ".csv", ".parquet"
FORMATS = (PARQUET, CSV)
_PREFIX = "kinfmu."
_INTEGERS: dict[str, type[np.integer[Any]]] = {DESIGN: np.int64, STATUS: np.int8}
_LOOK: dict[str, Any] = {
    "compression": "zstd",
    "use_dictionary": False,
    "write_statistics": True,
    "write_page_checksum": True,
}
_UNREADABLE = (OSError, ValueError, KeyError, TypeError, EOFError, zlib.error, zipfile.BadZipFile)

Rows = dict[str, NDArray[Any]]  # columns (m,) by name; texts or None in that of reasons


@dataclass(frozen=True)
class Field:
    """A column: its unit, its role (parameter, measure, place or none), and the unit in which files write it."""

    name: str
    unit: str
    role: str = ""
    display_unit: str = ""


@dataclass(frozen=True)
class TableLayout:
    """The columns of a study's table, and what it was made from."""

    fields: tuple[Field, ...]
    about: Mapping[str, str]

    @classmethod
    def of(cls, study: Study, nominal: Nominal) -> TableLayout:
        """Return the layout of the table of a study."""
        fields = [Field(DESIGN, "1")]
        fields += [Field(one.name, one.unit, "parameter", one.display_unit) for one in study.sampling.variations]
        for name, value in nominal.measures.items():
            fields.append(Field(name, value.unit, "measure", "deg" if value.unit == "rad" else ""))
            fields += [Field(place, value.at_unit, "place") for place in places(name, len(value.at))]
        about = {
            "version": VERSION,
            "fingerprint": study.fingerprint,
            "seed": str(study.sampling.seed),
            "study": json.dumps(study.definition),
            "study_file": study.file_text,
            "mechanism": study.mechanism_text,
            "nominal": json.dumps(nominal.as_json()),
        }
        return cls((*fields, Field(STATUS, "1"), Field(REASON, "")), about)

    def rows(self, first: int, columns: Columns) -> Rows:
        """Return the rows of a part, whose designs begin with `first`."""
        count = len(columns[STATUS])
        reasons = np.array([columns[REASON].get(k) for k in range(count)], dtype=object)
        given = {**columns, DESIGN: np.arange(first, first + count), REASON: reasons}
        return {field.name: given[field.name] for field in self.fields}

    def as_json(self) -> str:
        """Return the layout as text."""
        return json.dumps({"fields": [asdict(field) for field in self.fields], "about": dict(self.about)}, indent=1)

    @classmethod
    def from_json(cls, text: str) -> TableLayout:
        """Return the layout in a text; ValueError, KeyError or TypeError for any other."""
        found = json.loads(text)
        return cls(tuple(Field(**field) for field in found["fields"]), dict(found["about"]))

    def schema(self) -> Any:
        """Return the layout as a pyarrow.Schema with metadata."""
        import pyarrow as pa

        types = {DESIGN: pa.int64(), STATUS: pa.int8(), REASON: pa.string()}
        fields = []
        for field in self.fields:
            shown = {"role": field.role, "display_unit": "" if field.display_unit == field.unit else field.display_unit}
            about = {"unit": field.unit, **{key: text for key, text in shown.items() if text}}
            kind = types.get(field.name, pa.float64())
            fields.append(pa.field(field.name, kind, nullable=field.name == REASON, metadata=about))
        return pa.schema(fields, metadata={_PREFIX + key: text for key, text in self.about.items()})

    @classmethod
    def from_schema(cls, schema: Any) -> TableLayout:
        """Return the layout in a pyarrow.Schema, without `about` for the schema of another table."""
        fields = []
        for field in schema:
            found = {key.decode(): text.decode() for key, text in (field.metadata or {}).items()}
            fields.append(Field(field.name, *(found.get(key, "") for key in ("unit", "role", "display_unit"))))
        texts = {key.decode(): text.decode() for key, text in (schema.metadata or {}).items()}
        return cls(tuple(fields), {k.removeprefix(_PREFIX): text for k, text in texts.items() if k.startswith(_PREFIX)})


class MemoryTable:
    """The rows of a study in memory, made when they are first asked for."""

    def __init__(self, layout: TableLayout, rows: Callable[[], Rows]) -> None:
        self.layout = layout
        self._make_rows = rows

    @cached_property
    def _rows(self) -> Rows:
        return self._make_rows()

    def __len__(self) -> int:
        return len(self._rows[DESIGN])

    def column(self, name: str) -> NDArray[Any]:
        """Return a column (m,)."""
        return self._rows[name]

    def batches(self, names: list[str]) -> Iterator[Rows]:
        """Yield the columns at once."""
        yield {name: self._rows[name] for name in names}

    def to_arrow(self) -> Any:
        """Return all as a pyarrow.Table."""
        return _arrow_table(self.layout.schema(), self._rows)


class ParquetTable:
    """The rows of a study in a Parquet file, read when they are asked for."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.layout = TableLayout.from_schema(self._file().schema_arrow)

    def _file(self) -> Any:
        """Return the pyarrow.parquet.ParquetFile."""
        require_parquet(f"{self._path}: reading Parquet")
        import pyarrow as pa
        import pyarrow.parquet as pq

        try:
            return pq.ParquetFile(self._path)
        except (OSError, pa.ArrowInvalid) as error:
            raise StudyError(f"{self._path}: cannot be read ({error})") from None

    def __len__(self) -> int:
        return int(self._file().metadata.num_rows)

    def column(self, name: str) -> NDArray[Any]:
        """Return a column (m,)."""
        return np.asarray(self._file().read(columns=[name]).column(0).to_numpy())

    def batches(self, names: list[str]) -> Iterator[Rows]:
        """Yield columns by row groups, so that memory holds one of them."""
        file = self._file()
        for k in range(file.num_row_groups):
            group = file.read_row_group(k, columns=names)
            yield {name: np.asarray(group.column(name).to_numpy()) for name in names}

    def to_arrow(self) -> Any:
        """Return all as a pyarrow.Table."""
        return self._file().read()


Table = MemoryTable | ParquetTable  # the rows of a study, read column by column


def require_parquet(what: str) -> None:
    """Raise MissingPackageError where pyarrow is not installed; `what` needs it."""
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError:
        raise MissingPackageError(f"{what} needs pyarrow: pip install 'kinfmu[parquet]'") from None


def table_in(path: Path) -> Table:
    """Return the table of a study in a file, a .csv file with its FILE.json or a .parquet file.

    Raise a StudyError if it cannot be read or is not one of a study, a MissingPackageError for Parquet without pyarrow.
    """
    if path.suffix != CSV:
        return ParquetTable(path)
    try:
        with path.open("rb"):
            layout = TableLayout.from_json(about_file(path).read_text("utf-8"))
    except OSError as error:
        raise StudyError(f"{error.filename}: cannot be read ({error.strerror})") from None
    except (ValueError, KeyError, TypeError):
        raise StudyError(f"{path}: not the results of a study: {about_file(path).name} is not about it") from None
    return MemoryTable(layout, lambda: _read_csv(path, layout))


def about_file(path: Path) -> Path:
    """Return the file that says of what study a .csv file is."""
    return path.with_name(f"{path.name}.json")


def _read_csv(path: Path, layout: TableLayout) -> Rows:
    names = [field.name for field in layout.fields]
    try:
        with path.open(encoding="utf-8", newline="") as file:
            lines = csv.reader(file)
            if next(lines, None) != names:
                raise ValueError("its columns are others")
            columns = list(zip(*lines, strict=True)) or [()] * len(names)
        texts = dict(zip(names, columns, strict=True))
        rows: Rows = {k: np.array(v, dtype=_INTEGERS.get(k, np.float64)) for k, v in texts.items() if k != REASON}
    except (OSError, ValueError) as error:
        raise StudyError(f"{path}: cannot be read ({error})") from None
    return {**rows, REASON: np.array([text or None for text in texts[REASON]], dtype=object)}


def part_bytes(rows: Rows) -> bytes:
    """Return the rows of a part as the bytes of a .npz file."""
    reasons = np.array(json.dumps(rows[REASON].tolist()))
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **{**rows, REASON: reasons})
    return file.getvalue()


def joined(layout: TableLayout, parts: Iterable[tuple[int, int, Path]]) -> Iterator[Rows]:
    """Yield the rows of parts, one after another; raise a StudyError if a part cannot be read, or holds other designs.

    layout: Of the table. parts: First design, number of designs and file of each part.
    """
    for first, count, path in parts:
        try:
            with np.load(path, allow_pickle=False) as found:
                rows = {field.name: found[field.name] for field in layout.fields}
            rows[REASON] = np.array(json.loads(str(rows[REASON])), dtype=object)
            if rows[DESIGN].tolist() != list(range(first, first + count)):
                raise ValueError(f"it does not hold designs {first} to {first + count - 1}")
        except _UNREADABLE as error:
            path.unlink(missing_ok=True)
            reason = " ".join(str(error).split())
            raise StudyError(f"{path}: cannot be read ({reason}); the same command measures it again") from None
        yield rows


def stacked(parts: Iterable[Rows]) -> Rows:
    """Return the rows of all parts in one table."""
    tables = list(parts)
    return {name: np.concatenate([rows[name] for rows in tables]) for name in tables[0]}


def write_csv(parts: Iterable[Rows], layout: TableLayout, target: Path) -> None:
    """Write rows as lines; nan where a design lacks a measure."""
    with target.open("w", encoding="utf-8", newline="") as file:
        lines = csv.writer(file, lineterminator="\n")
        lines.writerow(field.name for field in layout.fields)
        for rows in parts:
            lines.writerows(zip(*(column.tolist() for column in rows.values()), strict=True))


def write_parquet(parts: Iterable[Rows], layout: TableLayout, target: Path) -> None:
    """Write rows as a Parquet file, part after part; equal parts give equal bytes."""
    import pyarrow.parquet as pq

    schema = layout.schema()
    with pq.ParquetWriter(target, schema, **_LOOK) as writer:
        for rows in parts:
            writer.write_table(_arrow_table(schema, rows))


def _arrow_table(schema: Any, rows: Rows) -> Any:
    import pyarrow as pa

    return pa.table([pa.array(rows[field.name], field.type) for field in schema], schema=schema)
