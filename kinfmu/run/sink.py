"""What takes a run while it goes on, such as a file that is to hold all but the last moment of a run that is killed."""

from __future__ import annotations

from typing import Protocol

from kinfmu.run.run import Run


class Sink(Protocol):
    """Takes a run piece by piece: `begin`, `add` again and again, `end`; nothing is called after an error."""

    def begin(self, run: Run) -> None:
        """The run before its first sample: names, units, constants, mechanism."""

    def add(self, run: Run) -> None:
        """The next samples, and the events since the last call."""

    def end(self, run: Run, reason: str) -> None:
        """The whole run; reason: why it ended early, if none of its events says so."""
