"""The table of a study: one row for each design, with units, and with what it was made from in its metadata."""

from __future__ import annotations

import io
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from kinfmu import VERSION
from kinfmu.errors import StudyError
from kinfmu.studies.chunk import Columns, places
from kinfmu.studies.definition import DESIGN, REASON, STATUS, Study
from kinfmu.studies.nominal import Nominal

_PREFIX = "kinfmu."
_LOOK: dict[str, Any] = {
    "compression": "zstd",
    "use_dictionary": False,
    "write_statistics": True,
    "write_page_checksum": True,
}


def schema_of(study: Study, nominal: Nominal) -> Any:
    """Return the pyarrow.Schema of a study's table: columns with units, and metadata."""
    import pyarrow as pa

    fields = [pa.field(DESIGN, pa.int64(), nullable=False, metadata={"unit": "1"})]
    fields += [_number(pa, one.name, one.unit, "parameter", one.display_unit) for one in study.sampling.variations]
    for name, found in nominal.measures.items():
        fields.append(_number(pa, name, found.unit, "measure", "deg" if found.unit == "rad" else ""))
        fields += [_number(pa, place, found.at_unit, "place") for place in places(name, len(found.at))]
    fields.append(pa.field(STATUS, pa.int8(), nullable=False, metadata={"unit": "1"}))
    fields.append(pa.field(REASON, pa.string(), metadata={"unit": ""}))
    about = {
        "version": VERSION,
        "fingerprint": study.fingerprint,
        "seed": str(study.sampling.seed),
        "study": json.dumps(study.definition),
        "study_file": study.file_text,
        "mechanism": study.mechanism_text,
        "nominal": json.dumps(nominal.as_json()),
    }
    return pa.schema(fields, metadata={_PREFIX + key: text for key, text in about.items()})


def _number(pa: Any, name: str, unit: str, role: str, display: str = "") -> Any:
    shown = {} if display in ("", unit) else {"display_unit": display}
    return pa.field(name, pa.float64(), nullable=False, metadata={"unit": unit, "role": role, **shown})


def part_bytes(schema: Any, first: int, columns: Columns) -> bytes:
    """Return the rows of a part as the bytes of a Parquet file."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    count = len(columns[STATUS])
    reasons = columns[REASON]
    own = {
        **columns,
        DESIGN: np.arange(first, first + count),
        REASON: [reasons.get(k) for k in range(count)] if reasons else [None] * count,
    }
    table = pa.table([pa.array(own[field.name], field.type) for field in schema], schema=schema.remove_metadata())
    file = io.BytesIO()
    pq.write_table(table, file, **_LOOK)
    return file.getvalue()


def join(schema: Any, parts: Iterable[tuple[int, int, Path]], target: Path) -> None:
    """Write the rows of all parts into one file, part after part; equal parts give equal bytes.

    Args:
        schema: Of the table.
        parts: First design, number of designs and file of each part.
        target: The file.

    Raises:
        StudyError: A part cannot be read, or holds other designs.

    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    bare = schema.remove_metadata()
    with pq.ParquetWriter(target, schema, **_LOOK) as writer:
        for first, count, path in parts:
            try:
                table = pq.ParquetFile(path, page_checksum_verification=True).read().cast(bare)
                if table.column(DESIGN).to_pylist() != list(range(first, first + count)):
                    raise ValueError(f"it does not hold designs {first} to {first + count - 1}")
            except (OSError, ValueError, pa.ArrowException) as error:
                path.unlink(missing_ok=True)
                reason = " ".join(str(error).split())
                raise StudyError(f"{path}: cannot be read ({reason}); the same command measures it again") from None
            writer.write_table(table.replace_schema_metadata(schema.metadata))


def metadata_of(schema: Any) -> Mapping[str, str]:
    """Return the metadata of a study's table by their names; none for another table."""
    found = schema.metadata or {}
    return {
        key.decode().removeprefix(_PREFIX): text.decode()
        for key, text in found.items()
        if key.decode().startswith(_PREFIX)
    }
