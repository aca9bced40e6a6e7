"""Fewer samples for a picture: those of a long run that show what happened in it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kinfmu.run import Run

MOST_ROWS = 200_000  # of a recording; viewers get slow beyond


def decimated(run: Run, most: int | None = None) -> Run:
    """The run itself if it has at most so many samples (MOST_ROWS if nothing is said), else evenly chosen ones and what
    lies between them that counts.

    These are the first and the last sample of every gap and beside it, and of each column the least and the greatest
    value, so that no peak is lost. The run that is logged elsewhere keeps every sample.
    """
    most = MOST_ROWS if most is None else most
    if len(run) <= most:
        return run
    rows = np.union1d(np.arange(0, len(run), -(-len(run) // most)), _indispensable(run))
    return run.part(rows, events=run.events)


def _indispensable(run: Run) -> NDArray[np.int64]:
    """Samples that must not be left out."""
    found = [0, len(run) - 1]
    turns = np.flatnonzero(np.diff(run.good.astype(int)))
    found += [*turns.tolist(), *(turns + 1).tolist()]
    for column in run.columns():
        known = np.flatnonzero(np.isfinite(column.values))
        if len(known):
            values = column.values[known]
            found += [int(known[np.argmin(values)]), int(known[np.argmax(values)])]
    return np.array(found)
