"""Ctrl-C and signals during a simulation: noted, and delivered after its end."""

from __future__ import annotations

import signal
import threading
from types import TracebackType
from typing import Any

ENDING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))  # no SIGHUP on Windows


class Interruption:
    """Record of Ctrl-C, SIGTERM and SIGHUP during a `with` block; true once one came.

    A KeyboardInterrupt inside an FMU's Python would reach the host as fmi2Fatal. Ignored signals stay ignored. Outside
    the main thread, where Python does not deliver signals, it has no effect.
    """

    def __init__(self) -> None:
        self.came: list[int] = []  # signals, in order
        self._before: dict[int, Any] = {}

    def __bool__(self) -> bool:
        return bool(self.came)

    def __enter__(self) -> Interruption:
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, *ENDING):
                before = signal.getsignal(number)
                if number == signal.SIGINT or before not in (signal.SIG_IGN, None):
                    self._before[number] = before
                    signal.signal(number, self._note)
        return self

    def __exit__(
        self, _kind: type[BaseException] | None, _error: BaseException | None, _traceback: TracebackType | None
    ) -> None:
        for number, before in self._before.items():
            signal.signal(number, before)
        self._before = {}

    def _note(self, number: int, _frame: Any) -> None:
        self.came.append(number)

    def deliver(self) -> None:
        """Raise SIGTERM or SIGHUP again, if one came: by default it ends the process."""
        for number in self.came:
            if number in ENDING:
                signal.raise_signal(number)
