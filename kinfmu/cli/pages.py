"""Pages that commands write: of a mechanism, or of a run with its parameters and its time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from kinfmu.cli.messages import patience
from kinfmu.errors import KinfmuError
from kinfmu.files import write_whole

if TYPE_CHECKING:
    from kinfmu.mechanism import Mechanism
    from kinfmu.run import Run

PAGES = (".html",)


def write_page(mechanism: Mechanism, path: Path, run: Run | None = None) -> None:
    """Write the page of a mechanism, or of a run of it, whose motion the page shows.

    Raises:
        KinfmuError: There is no page, or it cannot be written.

    """
    from kinfmu.page import page
    from kinfmu.page.samples import samples_of

    over = driver_of(run) if run else None
    samples = samples_of(run, mechanism) if run and not over else None
    with patience():
        text = page(mechanism, over=over, samples=samples)
    try:
        write_whole(path, text.encode())
    except OSError as error:
        raise KinfmuError(f"{path}: cannot be written ({error.strerror})") from None


def mechanism_of(run: Run) -> Mechanism:
    """Return the mechanism of a run: with its parameters, and the time from its first to its last sample."""
    from kinfmu.run.axis import axis_of

    mechanism = run.mechanism
    if mechanism is None:
        raise KinfmuError("the run does not hold its mechanism; give the mechanism file in its place")
    if not axis_of(run).is_time or len(run) < 2:
        return mechanism
    return replace(mechanism, run=replace(mechanism.run, start=float(run.t[0]), stop=float(run.t[-1])))


def driver_of(run: Run) -> tuple[str, float, float] | None:
    """Return the driver on the axis of a run, with its first and last value; None if there is none."""
    from kinfmu.run.axis import axis_of

    axis = axis_of(run)
    if axis.is_time or run.mechanism is None or len(run.mechanism.drivers) != 1 or len(run) < 2:
        return None
    values = run.inputs[:, 0]
    if axis.name != run.mechanism.drivers[0].name or values[0] == values[-1]:
        return None
    return axis.name, float(values[0]), float(values[-1])
