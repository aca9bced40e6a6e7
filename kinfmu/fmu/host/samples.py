"""The samples of a run while an FMU is stepped: read, stored, and passed to a sink in pieces."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from math import inf
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinfmu.draw.scene.completed import with_estimates
from kinfmu.errors import FmuError
from kinfmu.fmu.description import Description
from kinfmu.fmu.host.slaves import LoadedSlave
from kinfmu.fmu.interface import Interface, InterfacePart, Variable
from kinfmu.fmu.slave.layout import UNKNOWN_ERROR
from kinfmu.mechanism import Mechanism, RunSettings
from kinfmu.mechanism.force_names import force_names, reaction_names_of
from kinfmu.run import Event, Run
from kinfmu.run.channels import absent_columns, is_all_but
from kinfmu.run.run import Sink
from kinfmu.run.verdict import coarse_samples
from kinfmu.solver.python.pose import Status
from kinfmu.units import ForceName, SignalName, read_inputs

PIECE = 1024 * 1024  # [bytes] of a run passed to a sink at once, or fewer after PERIOD
FEWEST = 16  # samples in a piece of a large mechanism: each piece has a fixed cost
PERIOD = 0.5  # [s] of wall-clock time
LAST_GOOD = int(Status.BRIDGED)  # compared in every sample, where an int is faster
DISCARD, ERROR = 2, 3  # of FMI's statuses
_LEVELS = ("info", "warning", "error", "error", "error", "info")  # of FMI's OK, Warning, Discard, Error, Fatal, Pending
_FORCES = ("forces", "loads", "reactions", "shaking")
_REALS = ("values", "rates", "accelerations", "driven", "residual", "watch", *_FORCES, "margin", "errors")
ERRORS = ("error_q", "error_qd", "error_qdd")
_ESTIMATES = 2  # number of parts at the end that follow from the others


def _unsolved(part: str, *names: str) -> InterfacePart:
    variables = [Variable(f"solver.{name}", "Real", "output", "continuous", "of a mechanism") for name in names]
    return InterfacePart(part, tuple(variables))


_NO_MOTION = Interface(  # of a run of signals alone
    name="",
    title="",
    length_unit="m",
    experiment=RunSettings(),
    coordinate_count=0,
    parts=(_unsolved("residual", "residual"), _unsolved("margin", "margin"), _unsolved("errors", *ERRORS)),
)
_UNSOLVED = frozenset(("solver.iterations", *(variable.name for variable in _NO_MOTION)))


def _force_names(interface: Interface, mechanism: Mechanism | None, parts: Sequence[str]) -> tuple[ForceName, ...]:
    """Return the names of the forces in some parts of an FMU."""
    if mechanism is None:
        return ()
    names = {str(name): name for name in (*force_names(mechanism), *reaction_names_of(mechanism))}
    return tuple(names[variable.name] for part in parts for variable in interface.part(part) if variable.name in names)


def own_info(about: Description, settings: Mapping[str, float | bool | str]) -> dict[str, str]:
    """Return what a run of an FMU of kinfmu states of it, with the parameters that are set."""
    return {
        "name": about.interface.name,
        "title": about.interface.title,
        "generation_tool": about.generation_tool,
        "token": about.token,
        "parameters": ", ".join(f"{name} = {value}" for name, value in settings.items()),
    }


class Samples:
    """The samples of a run so far, and its messages: signals of FMUs, and the motion of one FMU of kinfmu.

    Args:
        count: Number of samples of the run.
        info: What the run states of its FMUs, by name.
        interface: Variables of the FMU of kinfmu; without one the run has signals alone.
        mechanism: Its mechanism, with the parameters that are set.
        model_description: Its model description.
        signals: Names of the signals.

    """

    def __init__(
        self,
        count: int,
        info: Mapping[str, str],
        *,
        interface: Interface | None = None,
        mechanism: Mechanism | None = None,
        model_description: str = "",
        signals: Sequence[SignalName] = (),
    ) -> None:
        has_motion = interface is not None
        interface = self._interface = interface or _NO_MOTION
        columns = [self._variables(part) for part in _REALS]
        self._ends: list[int] = np.cumsum([len(variables) for variables in columns]).tolist()
        self._most = count + 1  # samples, and a last one without numbers
        self._reals = np.empty((0, self._ends[-1]))  # the columns that are read
        self._t = np.empty(self._most)
        self._status, self._iterations = np.empty((2, self._most), np.int64)
        # Items of memoryviews are assigned faster than those of arrays.
        self._columns: tuple[Any, Any, Any] = self._t.data, self._status.data, self._iterations.data
        self._size = 0
        self._names = [variable.name for variables in columns for variable in variables]
        self._force_names = _force_names(interface, mechanism, _FORCES[:2])
        self._reaction_names = _force_names(interface, mechanism, _FORCES[2:])
        self._absent = frozenset() if has_motion else _UNSOLVED
        self._tables = self._layout(range(len(self._names)))
        self._mechanism, self._model_description, self._info = mechanism, model_description, info
        self._signal_names, self._signals = tuple(signals), np.empty((self._most, len(signals)))
        self._read_signals: Sequence[Callable[[], list[float]]] = ()
        self._slave: LoadedSlave | None = None
        self._events: list[Event] = []
        self.now = 0.0
        self.fixed: dict[str, float] = {}
        self._sink: Sink | None = None
        self._passed_on = self._events_passed_on = 0  # number of samples and events that the sink has
        self._computes_estimates = False  # margins and errors are computed when they are read
        self._piece = 1  # number of samples passed to the sink at once
        self._full_at = self._most + 1  # number of samples at which the next piece is passed
        self._due = inf  # wall-clock time at which the next piece is passed in any case

    def _variables(self, part: str) -> tuple[Variable, ...]:
        """Return the variables of a part; the driver values in effect are states if the FMU owns the motion."""
        if part == "loads":
            return self._interface.inputs(part)
        return self._interface.part(part) or (self._interface.part("states") if part == "driven" else ())

    def _layout(self, asked: Sequence[int]) -> dict[str, tuple[slice, int, list[int]]]:
        """Return the place of each part among the columns that are read, its width, and which of its columns are."""
        found, end = {}, 0
        for name, first, last in zip(_REALS, (0, *self._ends), self._ends, strict=False):
            kept = [k - first for k in asked if first <= k < last]
            found[name] = slice(end, end := end + len(kept)), last - first, kept
        return found

    def log(self, status: int, text: str) -> None:
        """Store a message of the FMU as an event at the current time."""
        event = Event(self.now, _LEVELS[status] if 0 <= status < len(_LEVELS) else "error", text)
        if not self._events or self._events[-1] != event:
            self._events.append(event)

    def extend(self, events: Iterable[Event]) -> None:
        """Store events that have their own times."""
        self._events.extend(events)

    def first_error(self) -> str:
        """Return the first message of level error, or an empty text."""
        return next((event.text for event in self._events if event.level == "error"), "")

    def read_fixed(self, slave: LoadedSlave) -> None:
        """Read the fixed coordinates: constants, and those that follow from the parameters."""
        names = [variable.name for variable in self._interface.part("fixed")]
        self.fixed = dict(zip(names, slave.get(names) if names else [], strict=True))

    def begin(
        self,
        slave: LoadedSlave | None,
        channels: Sequence[str] | None,
        sink: Sink | None,
        *,
        read_signals: Sequence[Callable[[], list[float]]] = (),
        computes_estimates: bool = False,
    ) -> None:
        """Choose the variables to read, and begin the sink's run.

        Args:
            slave: Slave of the FMU of kinfmu, if there is one.
            channels: Channels to record. None: all.
            sink: Sink of the run, if any.
            read_signals: Calls that together return the signals, in the order of their names.
            computes_estimates: Margins and errors follow from mechanism and driver values. Unless `channels` names
                them, they are not read from the FMU, but computed when they are read from the run.

        Raises:
            FmuError: Two columns would have one name.
            RequestError: A channel is unknown.

        """
        self._slave, self._read_signals = slave, read_signals
        run = self._run(slice(0, 0))
        places = Counter(place.name for place in run.places(kept=False))
        if twice := [name for name, number in places.items() if number > 1]:
            raise FmuError(f"two columns of the run would be named '{twice[0]}'; rename a component of the system")
        self._absent = absent_columns(run, channels)
        self._computes_estimates = (
            computes_estimates and is_all_but(channels) and self._absent.isdisjoint(run.input_names)
        )
        columns = [name.removeprefix("driven.") for name in self._names]  # names in a run
        asked = [k for k, name in enumerate(columns) if name not in self._absent]
        if self._computes_estimates:
            asked = [k for k in asked if k < self._ends[-1 - _ESTIMATES]]
        self._tables = self._layout(asked)
        self._reals = np.empty((self._most, len(asked)))
        part = _REALS.index("driven")
        self._drivers = [place for place, k in enumerate(asked) if self._ends[part - 1] <= k < self._ends[part]]
        names_asked = [self._names[k] for k in asked]
        self._read = slave.row_reader(names_asked, self._reals) if slave and asked else None
        self._names_of_drivers = [names_asked[place] for place in self._drivers]
        self._sink = sink
        if sink is not None:
            self._piece = max(FEWEST, PIECE // (8 * (len(asked) + len(self._signal_names) + 3)))
            self._full_at, self._due = self._piece, perf_counter() + PERIOD
            sink.begin(self._run(slice(0, 0)))

    def is_unreachable(self) -> bool:
        """Return whether the FMU of kinfmu is asked for an unreachable pose."""
        return self._slave is not None and self._slave.counts()[0] > LAST_GOOD

    def message(self) -> str:
        """Return the message of the FMU of kinfmu about its pose."""
        return self._slave.message() if self._slave else ""

    def read(self, t: float, *, is_kept: bool) -> bool:
        """Read a sample, if it is to be kept; return False if it holds no numbers except the driver values."""
        status, iterations = self._slave.counts() if self._slave else (0, 0)
        good = status <= LAST_GOOD
        row = self._size
        if self._read_signals and (is_kept or not good):
            self._signals[row] = [value for read in self._read_signals for value in read()]
        if not good:
            self._reals[row] = np.nan
            if self._drivers and self._slave:
                self._reals[row, self._drivers] = self._slave.get(self._names_of_drivers)
        elif not is_kept:
            if perf_counter() > self._due:
                self._pass_on()
            return True
        elif self._read:
            self._read(row)
        times, all_status, all_iterations = self._columns
        times[row], all_status[row], all_iterations[row] = t, status, iterations
        self._size = row = row + 1
        if row >= self._full_at or perf_counter() > self._due:
            self._pass_on()
        return good

    def note_coarse(self) -> None:
        """Store a note if the samples are too far apart to show a motion that the FMU integrates."""
        names = read_inputs([variable.name for variable in self._interface.part("states")])
        names = names[::3] if names else ()
        if names and len(self._drivers) == 3 * len(names):
            driven = self._reals[: self._size, self._drivers]
            text = coarse_samples(self._t[: self._size], names, driven[:, ::3], driven[:, 1::3])
            if text:
                self._events.append(Event(float(self._t[0]), "info", text))

    def end(self, reason: str = "") -> Run:
        """Return all samples as a Run and end the sink's run; reason: the error that ended it, if any."""
        if reason:
            self.log(ERROR, reason)
        run = self._run(slice(0, self._size), tuple(self._events))
        self._pass_on()
        if self._sink is not None:
            self._sink.end(run, reason)
        return run

    def _pass_on(self) -> None:
        """Pass the sink the samples and events that it does not have yet."""
        rows = slice(self._passed_on, self._size)
        events = tuple(self._events[self._events_passed_on :])
        self._passed_on, self._events_passed_on = self._size, len(self._events)
        sink, self._sink = self._sink, None  # a sink that raises is not called again
        if sink is not None and (events or rows.start < rows.stop):
            sink.add(self._run(rows, events))
        self._sink = sink
        if sink is not None:
            self._full_at, self._due = self._size + self._piece, perf_counter() + PERIOD

    def _run(self, rows: slice, events: tuple[Event, ...] = ()) -> Run:
        """Return samples as a run, whose tables are views where they can be: rows that are read do not change."""
        part = {name: self._table(rows, *place) for name, place in self._tables.items()}
        iterations = self._iterations[rows]
        if "solver.iterations" in self._absent:
            iterations = np.zeros_like(iterations)
        interface = self._interface
        run = Run.of_texts(
            t=self._t[rows],
            outputs=tuple(variable.name for variable in interface.part("values")),
            coordinate_count=interface.coordinate_count,
            values=part["values"],
            rates=part["rates"],
            accelerations=part["accelerations"],
            fixed=self.fixed,
            input_names=tuple(variable.name for variable in interface.motion),
            inputs=part["driven"],
            status=self._status[rows],
            iterations=iterations,
            residual=part["residual"][:, 0],
            margin=part["margin"][:, 0],
            error=np.where(part["errors"] >= UNKNOWN_ERROR, np.inf, part["errors"]),
            watch_names=tuple(v.name.removeprefix("watch.") for v in interface.part("watch")),
            watch=part["watch"],
            force_names=self._force_names,
            forces=np.hstack([part["forces"], part["loads"]]) if self._force_names else None,
            reaction_names=self._reaction_names,
            reactions=np.hstack([part["reactions"], part["shaking"]]) if self._reaction_names else None,
            signal_names=self._signal_names,
            signals=self._signals[rows] if self._signal_names else None,
            length_unit=interface.length_unit,
            mechanism_source=self._mechanism or "",
            model_description=self._model_description,
            info=self._info,
            events=events,
            absent=self._absent,
        )
        run = with_estimates(run) if self._computes_estimates else run
        return run.without(self._absent) if self._computes_estimates or self._signal_names else run

    def _table(self, rows: slice, place: slice, width: int, kept: list[int]) -> NDArray[np.float64]:
        """Return the columns of a part, NaN where they are not read."""
        table = self._reals[rows, place]
        if len(kept) == width:
            return table
        whole = np.broadcast_to(np.nan, (len(table), width))
        if kept:
            whole = whole.copy()
            whole[:, kept] = table
        return whole
