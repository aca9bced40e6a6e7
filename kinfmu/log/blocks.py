"""Rows of a recording, sent in blocks."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from kinfmu.log.clock import nanoseconds
from kinfmu.run import FloatArray

if TYPE_CHECKING:
    import rerun as rr

APPLICATION = "kinfmu"
TIMELINE = "sim_time"
ROWS = 4096  # larger blocks are slower and take more memory


def send(
    rec: rr.RecordingStream, path: str, t: FloatArray, columns: Callable[[slice], Iterable[rr.ComponentColumn]]
) -> None:
    """Rows at times t (n,) [s] to the entity `path`; columns(rows) gives those of a slice of them."""
    import rerun as rr

    for start in range(0, len(t), ROWS):
        rows = slice(start, start + ROWS)
        # Rerun truncates float durations to nanoseconds: give it whole ones.
        stamps = nanoseconds(t[rows]).astype("timedelta64[ns]")
        rec.send_columns(path, [rr.TimeColumn(TIMELINE, duration=stamps)], columns(rows))
