"""The summary of a finished run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kinfmu.errors import KinfmuError, listed

if TYPE_CHECKING:
    from kinfmu.run import Run


def verdict(run: Run) -> str:
    """Return '181 samples: 175 ok, 6 bridged; largest residual 1.1e-16 of the size'."""
    from kinfmu.solver.python.status import Status

    counts = [(status, int((run.status == status).sum())) for status in Status]
    summary = listed(f"{count} {status.name.lower().replace('_', ' ')}" for status, count in counts if count)
    residuals = run.residual[run.good & (run.residual == run.residual)]
    largest = f"; largest residual {residuals.max():.2g} of the size" if len(residuals) else ""
    return f"{len(run)} samples: {summary}{largest}"


def fail_if_failed(run: Run, *, by_samples: bool = False) -> None:
    """Raise a KinfmuError with the first event of level "error" and its time [s].

    by_samples: the times of the run are sample numbers, from 0.
    """
    for event in run.events:
        if event.level == "error":
            has_time = event.text.startswith("at t = ")  # an FMU writes the time itself
            when = f"sample {event.t:.0f}" if by_samples else f"at t = {event.t:g} s"
            raise KinfmuError(event.text if has_time else f"{when}: {event.text}")
