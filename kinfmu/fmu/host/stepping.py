"""The loop that steps an FMU or a system of FMUs: set at t_k, record, step; and what interrupts it."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np

from kinfmu.fmu.host.samples import DISCARD, ERROR, Samples

if TYPE_CHECKING:
    from numpy.typing import NDArray


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


def step_through(
    samples: Samples,
    t: NDArray[np.float64],
    kept: NDArray[np.int64],
    set_inputs: Callable[[int], None] | None,
    step: Callable[[float, float], bool],
    progress: Callable[[int, int], None] | None,
    signals: list[int],
) -> None:
    """Run the loop: set at t_k, get, record if the sample is kept or holds no numbers, step.

    Args:
        samples: Samples.
        t: (n,) times [s].
        kept: Indices of samples to record.
        set_inputs: Sets the inputs of a sample. None: there are none.
        step: Steps from a time by a step [s]; False if that is discarded.
        progress: Called with (samples done, number of samples).
        signals: Those that came, which end the run.

    """
    kept_at = np.zeros(len(t), bool)
    kept_at[kept] = True
    is_kept: Any = kept_at.data
    times = t.data  # items of a memoryview are Python numbers, which are faster
    last = len(t) - 1
    for k, time in enumerate(times):
        samples.now = time
        if signals and k:
            samples.log(ERROR, f"at t = {time:g} s: interrupted; the run ends here")
            return
        if set_inputs:
            set_inputs(k)
        good = samples.read(time, is_kept=is_kept[k])
        if progress is not None:
            progress(k + 1, len(t))
        if not good:
            samples.log(DISCARD, f"at t = {time:g} s: {samples.message()}")
            return
        if k == last:
            return
        end = times[k + 1]
        samples.now = time if set_inputs else end  # messages of a step are about its inputs, or the time it goes to
        if not step(time, end - time):
            if samples.is_unreachable():  # the step goes to an unreachable pose
                samples.read(end, is_kept=True)
            return
