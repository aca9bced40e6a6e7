"""Fewer samples for a recording: those of a long run that show its peaks and gaps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kinfmu.run import Run

MOST_ROWS = 200_000  # of a recording; the viewer is slow with more


def decimated(run: Run, most: int | None = None) -> Run:
    """Return the run itself if it has at most `most` samples, else evenly spaced ones and the important ones between.

    most: default MOST_ROWS. Important are the first and last sample of every gap and the numbers next to it, and the
    least and greatest value of each column, so that no peak is lost. The MCAP record keeps every sample.
    """
    most = MOST_ROWS if most is None else most
    if len(run) <= most:
        return run
    rows = np.union1d(np.arange(0, len(run), -(-len(run) // most)), _indispensable(run))
    return run.part(rows, events=run.events)


def _indispensable(run: Run) -> NDArray[np.int64]:
    """Return the samples that must not be left out."""
    found = [0, len(run) - 1]
    turns = np.flatnonzero(np.diff(run.good.astype(int)))
    found += [*turns.tolist(), *(turns + 1).tolist()]
    for column in run.columns():
        known = np.flatnonzero(np.isfinite(column.values))
        if len(known):
            values = column.values[known]
            found += [int(known[np.argmin(values)]), int(known[np.argmax(values)])]
    return np.array(found)
