"""Ctrl-C while foreign code runs: noted, and acted upon where it can be."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """Within it Ctrl-C is only noted; the function that is given tells whether it came.

    A KeyboardInterrupt inside an FMU's Python would reach the host as fmi2Fatal. Outside the main thread, where Python
    does not deliver signals, nothing is changed.
    """
    came: list[int] = []

    def note(number: int, _frame: Any) -> None:
        came.append(number)

    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    before = signal.signal(signal.SIGINT, note)
    try:
        yield lambda: bool(came)
    finally:
        signal.signal(signal.SIGINT, before)
