"""The driver values of a record, which its page shows in place of the laws of the file."""

from __future__ import annotations

from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import KinfmuError, listed
from kinfmu.mechanism import Mechanism
from kinfmu.run import Run
from kinfmu.run.axis import axis_of

MOST = 400  # samples in a page, first and last among them; between them values are interpolated linearly
_DIGITS = 12  # of a value
_SAME = 1e-9  # of the largest value, or 1; a law that is nearer to all samples gives them


def samples_of(run: Run, mechanism: Mechanism) -> dict[str, Any] | None:
    """Return the driver values of a run as its page shows them; None if the laws of the mechanism give them.

    Returns:
        isTime: whether t are times [s], else numbers of samples; t (n,); columns: by driver its value, speed and
        acceleration, each a list (n,) or one number.

    Raises:
        KinfmuError: The run is not over time, and does not hold the values of its drivers.

    """
    is_time = axis_of(run).is_time
    values = [name for driver in mechanism.drivers for name in driver.inputs()]
    missing = [str(name) for name in values if name not in run.input_names or name in run.absent]
    if len(run) < 2 or (is_time and missing):
        return None
    if missing:
        raise KinfmuError(
            f"the run does not hold {listed(missing)}, without which its page has no motion; keep them: --channels "
            f"all, or inputs among its names"
        )
    if is_time and _is_by_laws(run, mechanism):
        return None
    rows = np.unique(np.linspace(0, len(run) - 1, min(len(run), MOST)).round().astype(int))
    columns = [_short(run.inputs[rows, run.input_names.index(name)]) for name in values]
    return {
        "isTime": is_time,
        "t": run.t[rows].tolist(),
        "columns": [columns[k : k + 3] for k in range(0, len(columns), 3)],
    }


def _is_by_laws(run: Run, mechanism: Mechanism) -> bool:
    """Return whether the laws of the drivers give the values of a run at its times."""
    for k, driver in enumerate(mechanism.drivers):
        values = run.inputs[:, 3 * k]
        law = np.array([float(driver.law.at(t)) for t in run.t.tolist()])
        if not np.all(np.abs(values - law) <= _SAME * max(1.0, float(np.max(np.abs(law), initial=0.0)))):
            return False
    return True


def _short(values: FloatArray) -> list[float] | float:
    """Return values with _DIGITS digits; one number for all if they are equal."""
    if (values == values[0]).all():
        return float(values[0])
    return [float(f"{value:.{_DIGITS}g}") for value in values.tolist()]
