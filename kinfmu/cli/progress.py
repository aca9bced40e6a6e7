"""A progress bar for long runs."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import click

LONG_RUN = 2000  # samples from which a progress bar is worth a line


class Progress:
    """A progress bar on stderr for at least `least` steps, if stderr is a terminal."""

    def __init__(self, label: str = "simulating", least: int = LONG_RUN) -> None:
        self.label = label
        self.least = least
        self._bar: Any = None
        self._done = 0

    def __enter__(self) -> Callable[[int, int], None]:
        return self._show

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.render_finish()

    def _show(self, done: int, count: int) -> None:
        if self._bar is None:
            if count < self.least or not sys.stderr.isatty():
                return
            self._bar = click.progressbar(length=count, label=self.label, file=sys.stderr)
            self._bar.render_progress()
        if done - self._done >= count // 200 or done == count:
            self._bar.update(done - self._done)
            self._done = done
