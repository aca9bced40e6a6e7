"""What is told of a run when it is done."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kinfmu.errors import KinfmuError, listed

if TYPE_CHECKING:
    from kinfmu.run import Run


def verdict(run: Run) -> str:
    """'181 samples: 175 ok, 6 bridged; largest residual 1.1e-16'."""
    from kinfmu.solver.python.status import Status

    counts = [(status, int((run.status == status).sum())) for status in Status]
    said = listed(f"{count} {status.name.lower().replace('_', ' ')}" for status, count in counts if count)
    residuals = run.residual[run.good & (run.residual == run.residual)]
    largest = f"; largest residual {residuals.max():.2g} of the size" if len(residuals) else ""
    return f"{len(run)} samples: {said}{largest}"


def fail_if_failed(run: Run, *, by_samples: bool = False) -> None:
    """Raise a KinfmuError with the first event of level "error" and when that was, in [s]; by_samples: times of the run
    count the samples, from 0.
    """
    for event in run.events:
        if event.level == "error":
            told = event.text.startswith("at t = ")  # an FMU says itself when
            when = f"sample {event.t:.0f}" if by_samples else f"at t = {event.t:g} s"
            raise KinfmuError(event.text if told else f"{when}: {event.text}")
