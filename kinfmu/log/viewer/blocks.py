"""Rows of a recording, sent in blocks."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from kinfmu.log.viewer.timeline import Timeline
from kinfmu.run import FloatArray

if TYPE_CHECKING:
    import rerun as rr

APPLICATION = "kinfmu"
ROWS = 4096  # larger blocks are slower and take more memory


def send(
    rec: rr.RecordingStream,
    path: str,
    timeline: Timeline,
    t: FloatArray,
    columns: Callable[[slice], Iterable[rr.ComponentColumn]],
) -> None:
    """Rows at times t (n,) of the timeline to the entity `path`; columns(rows) gives those of a slice of them."""
    for start in range(0, len(t), ROWS):
        rows = slice(start, start + ROWS)
        rec.send_columns(path, [timeline.column(t[rows])], columns(rows))
