"""The samples of a system: signals of every FMU, and those of the mechanism that is drawn, as one run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from time import perf_counter
from typing import Any

import numpy as np

from kinfmu.errors import FmuError
from kinfmu.fmu.host.samples import ERROR, PERIOD, Samples
from kinfmu.fmu.host.slaves import LoadedSlave
from kinfmu.run import Event, Run
from kinfmu.run.channels import absent_columns
from kinfmu.run.run import Sink
from kinfmu.units import SignalName

_LEVELS = ("info", "warning", "error", "error", "error", "info")  # of FMI's OK, Warning, Discard, Error, Fatal, Pending
_UNSOLVED = ("residual", "iterations", "margin", "error_q", "error_qd", "error_qdd")  # of runs without a mechanism


class SystemSamples:
    """The samples of a system so far.

    A sample is read after the exchange of values at its time. The mechanism's own `Samples`, if there is one, decide
    when a piece is passed to the sink; the signals of the same rows go with it.
    """

    def __init__(
        self,
        names: Sequence[SignalName],
        count: int,
        info: Mapping[str, str],
        main: Samples | None = None,
    ) -> None:
        self.names, self._main, self._info = tuple(names), main, dict(info)
        self._signals = np.empty((count + 1, len(names)))
        self._t = np.empty(count + 1)
        self._size = self._passed_on = self._events_passed_on = 0
        self._events: list[Event] = []
        self._sink: Sink | None = None
        self._absent: frozenset[str] = frozenset()
        self._due = 0.0
        self.now = 0.0

    def log(self, status: int, text: str) -> None:
        """Store a message of an FMU as an event at the current time."""
        if self._main:
            self._main.now = self.now
            self._main.log(status, text)
            return
        event = Event(self.now, _LEVELS[status] if 0 <= status < len(_LEVELS) else "error", text)
        if not self._events or self._events[-1] != event:
            self._events.append(event)

    def first_error(self) -> str:
        """Return the first message of level error, or an empty text."""
        return (
            next((event.text for event in self._events if event.level == "error"), "")
            if not self._main
            else (self._main.first_error())
        )

    def extend(self, events: Sequence[Event]) -> None:
        """Store events that have their own times."""
        if self._main:
            self._main.extend(events)
        else:
            self._events.extend(events)

    def begin(
        self,
        readers: Sequence[Callable[[], list[float]]],
        slave: LoadedSlave | None,
        channels: Sequence[str] | None,
        sink: Sink | None,
    ) -> None:
        """Begin the sink's run.

        Args:
            readers: Calls that together return the signals, in the order of their names.
            slave: Slave of the mechanism that is drawn, if there is one.
            channels: Channels to record. None: all.
            sink: Sink of the run, if any.

        Raises:
            FmuError: Two columns would have one name.
            RequestError: A channel is unknown.

        """
        self._readers, self._sink = readers, sink
        if self._main and slave:
            self._main.begin(slave, None, _Joined(self, channels))
        else:
            self._choose(self._plain(slice(0, 0)), channels)
            if sink is not None:
                sink.begin(self._plain(slice(0, 0)))
            self._due = perf_counter() + PERIOD

    def _choose(self, run: Run, channels: Sequence[str] | None) -> None:
        """Check the names of columns, and choose those that are recorded."""
        places = [place.name for place in run.places(kept=False)]
        twice = [name for name in places if places.count(name) > 1]
        if twice:
            raise FmuError(f"two columns of the run would be named '{twice[0]}'; rename a component of the system")
        self._absent = absent_columns(run, channels)

    def is_unreachable(self) -> bool:
        """Return whether the mechanism, if there is one, is asked for an unreachable pose."""
        return self._main is not None and self._main.is_unreachable()

    def message(self) -> str:
        """Return the message of the mechanism's FMU about its pose, '' without one."""
        return self._main.message() if self._main else ""

    def read(self, t: float, *, is_kept: bool) -> bool:
        """Read a sample, if it is to be kept; return False if the mechanism has no numbers there."""
        self.now, row = t, self._size
        self._t[row], self._signals[row] = t, [value for read in self._readers for value in read()]
        self._size = row + 1  # the mechanism's samples may pass on a piece while they are read
        if self._main:
            good = self._main.read(t, is_kept=is_kept)
            self._size = row + (is_kept or not good)
            return good
        self._size = row + is_kept
        if self._sink is not None and perf_counter() > self._due:
            self._pass_on()
        return True

    def end(self, reason: str = "") -> Run:
        """Return all samples as a run and end the sink's run; reason: the error that ended it, if any."""
        if self._main:
            return self.joined(self._main.end(reason), slice(0, self._size))
        if reason:
            self.log(ERROR, reason)
        run = self._plain(slice(0, self._size), tuple(self._events))
        self._pass_on()
        if self._sink is not None:
            self._sink.end(run, reason)
        return run

    def _pass_on(self) -> None:
        """Pass the sink the samples and events that it does not have yet."""
        rows, events = slice(self._passed_on, self._size), tuple(self._events[self._events_passed_on :])
        self._passed_on, self._events_passed_on = self._size, len(self._events)
        sink, self._sink = self._sink, None  # a sink that raises is not called again
        if sink is not None and (events or rows.start < rows.stop):
            sink.add(self._plain(rows, events))
        self._sink, self._due = sink, perf_counter() + PERIOD

    def joined(self, run: Run, rows: slice) -> Run:
        """Return the run of the mechanism with the signals of the rows."""
        signals = self._signals[rows].copy()
        whole = run.replaced(signal_names=self.names, signals=signals, info={**run.info, **self._info})
        return whole.without(self._absent) if self._absent - run.absent else whole

    def _plain(self, rows: slice, events: tuple[Event, ...] = ()) -> Run:
        """Return a run without a mechanism."""
        count = self._t[rows].size
        tables: dict[str, Any] = {name: np.empty((count, 0)) for name in ("values", "rates", "accelerations", "watch")}
        run = Run.of_texts(
            t=self._t[rows].copy(),
            outputs=(),
            coordinate_count=0,
            fixed={},
            input_names=(),
            inputs=np.empty((count, 0)),
            status=np.zeros(count, np.int64),
            iterations=np.zeros(count, np.int64),
            residual=np.full(count, np.nan),
            margin=np.full(count, np.nan),
            error=np.full((count, 3), np.nan),
            watch_names=(),
            signal_names=self.names,
            signals=self._signals[rows].copy(),
            info=self._info,
            events=events,
            absent=frozenset(f"solver.{name}" for name in _UNSOLVED),
            **tables,
        )
        return run.without(self._absent) if self._absent - run.absent else run


class _Joined:
    """A sink of the mechanism's samples that adds the signals and passes all to the sink of the system."""

    def __init__(self, samples: SystemSamples, channels: Sequence[str] | None) -> None:
        self._samples, self._channels, self._passed_on = samples, channels, 0

    def begin(self, run: Run) -> None:
        nothing = slice(0, 0)
        self._samples._choose(self._samples.joined(run, nothing), self._channels)
        if self._samples._sink is not None:
            self._samples._sink.begin(self._samples.joined(run, nothing))

    def add(self, run: Run) -> None:
        rows = slice(self._passed_on, self._passed_on + len(run))
        self._passed_on = rows.stop
        if self._samples._sink is not None:
            self._samples._sink.add(self._samples.joined(run, rows))

    def end(self, run: Run, reason: str) -> None:
        if self._samples._sink is not None:
            self._samples._sink.end(self._samples.joined(run, slice(0, len(run))), reason)
