"""Run: the result of a solve or of a simulation, with named columns, units and a status for every sample; sinks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import MISSING, dataclass, replace
from dataclasses import fields as fields_of
from functools import cached_property
from itertools import groupby
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray, IntArray
from kinfmu.display import Displayed
from kinfmu.errors import KinfmuError, listed, suggestion
from kinfmu.run.axis import TIME, axis_of, rates_per
from kinfmu.run.tables import NAMES, Column, Place, Tabular, index_of, sizes_of, tables_of
from kinfmu.solver.python.pose import Status
from kinfmu.units import CoordinateName, ForceName, InputName, SignalName, read_coordinate, read_inputs, unit_of

if TYPE_CHECKING:
    from kinfmu.mechanism import Mechanism


MOST_SAMPLES = 10_000_000  # a table of them fills the memory of a large machine
_SHAKING = 3  # columns of shaking force and moment, the last reactions

T = TypeVar("T")


class Lazy(Generic[T]):
    """A field of a run that may be given as a function: it is called when the field is first read.

    default: Of the field; none if it is not given.
    """

    def __init__(self, *default: T) -> None:
        self._default = default

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, run: Run | None, owner: type) -> T:
        if run is None:
            if self._default:
                return self._default[0]
            raise AttributeError(self._name)  # so that the field has no default
        value = run.__dict__[self._name]
        if callable(value):
            value = run.__dict__[self._name] = value()
        return value  # type: ignore[no-any-return]  # whatever was given

    def __set__(self, run: Run, value: T | Callable[[], T]) -> None:
        run.__dict__[self._name] = value


class ColumnPlace(NamedTuple):
    """The place of a column: a table of the run, by the name of the field, and the number of its column."""

    name: str
    unit: str
    table: str
    column: int | None  # None in tables of one column


class Event(NamedTuple):
    """Something that happened at a time of a run, such as a pose that could not be reached."""

    t: float
    level: str  # "info", "warning" or "error"
    text: str


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Run(Tabular, Displayed):
    """The motion of a mechanism at n samples.

    Samples of status 3 to 5 are NaN in values, rates and accelerations, and in the diagnostics. Fields declared as
    Lazy may be given as functions, which are called when the field is first read: a call with few samples, or with
    given tables, then costs little more than its solving.

    Attributes:
        t: (n,) times [s]; of a run over driver values the numbers of the samples.
        outputs: Names of the m outputs: the generalized coordinates q, then the points of interest.
        coordinate_count: How many of the outputs are generalized coordinates.
        values: (n, m) in the mechanism's unit of length and rad.
        rates: (n, m), per second or per unit of the driver on the axis.
        accelerations: (n, m), the same.
        force_names: Names of the f efforts, inertias and energies, such as 'crank.torque'; none without masses, loads.
        forces: (n, f) in SI units; None without any.
        reaction_names: Names of the r reactions of joints, such as 'pin.force_x'. Columns compute sizes: 'pin.force'.
        reactions: (n, r) in N and N m; None without any. NaN where redundant rows share a load in an unknown way.
        shaking: (n, 3) the last columns of `reactions`, shaking force and moment, which need none of the others; None
            where they are not computed by themselves.
        signal_names: Names of the s outputs of FMUs that are not kinfmu's, with their units, such as 'motor.current'.
        signals: (n, s) their values; None without any.
        fixed: Coordinates that a joint holds at a constant, by name.
        input_names: Names of the 3 d inputs: value, speed and acceleration of each driver.
        inputs: (n, 3 d).
        status: (n,) values of Status.
        iterations: (n,) Newton iterations.
        residual: (n,) largest residual of a block, relative to the mechanism's size.
        margin: (n,) 1 / condition.
        error: (n, 3) estimated error of q, qd, qdd, the largest among the outputs, lengths relative to the size.
        watch_names: Names of the w redundant rows.
        watch: (n, w) residuals of the redundant rows, relative to the size.
        length_unit: The mechanism's unit of length.
        mechanism_source: The mechanism with the parameters set, or its TOML text as a file holds it; empty if unknown.
        model_description: XML of the FMU that was stepped; empty if none.
        info: Name, title, versions, token and parameters, as text.
        events: What happened at a time of the run.
        absent: Names of columns that were not kept, such as 'coupler.ax'; the tables hold NaN in their places.
        axis: The quantity over which pictures and reports show the samples: 'time'; for driver values the input that
            changes, such as 'crank_angle', or 'sample' if several change.

    """

    t: Lazy[FloatArray] = Lazy()  # a descriptor, not a default
    outputs: tuple[CoordinateName, ...]
    coordinate_count: int
    values: FloatArray
    rates: FloatArray
    accelerations: FloatArray
    fixed: Lazy[Mapping[CoordinateName, float]] = Lazy()
    input_names: tuple[InputName, ...]
    inputs: Lazy[FloatArray] = Lazy()
    status: Lazy[IntArray] = Lazy()
    iterations: Lazy[IntArray] = Lazy()
    residual: Lazy[FloatArray] = Lazy()
    margin: Lazy[FloatArray] = Lazy()
    error: Lazy[FloatArray] = Lazy()
    watch_names: tuple[str, ...]
    watch: Lazy[FloatArray] = Lazy()
    force_names: tuple[ForceName, ...] = ()
    forces: Lazy[FloatArray | None] = Lazy(None)
    reaction_names: tuple[ForceName, ...] = ()
    reactions: Lazy[FloatArray | None] = Lazy(None)
    shaking: Lazy[FloatArray | None] = Lazy(None)
    signal_names: tuple[SignalName, ...] = ()
    signals: Lazy[FloatArray | None] = Lazy(None)
    length_unit: str = "m"
    mechanism_source: Lazy[Mechanism | str] = Lazy("")
    model_description: str = ""
    info: Lazy[Mapping[str, str]] = Lazy()
    events: Lazy[tuple[Event, ...]] = Lazy(())
    absent: frozenset[str] = frozenset()
    axis: Lazy[str] = Lazy(TIME)

    @classmethod
    def of_texts(
        cls, outputs: Iterable[str], fixed: Mapping[str, float], input_names: Sequence[str], **fields: Any
    ) -> Run:
        """Return the run whose names are texts, as files and FMUs hold them.

        Args:
            outputs: Names of the m outputs, such as 'coupler.x', the generalized coordinates first.
            fixed: Coordinates that a joint holds at a constant, by name [length unit, rad].
            input_names: Names of the 3 d inputs, such as 'crank_angle': value, speed and acceleration of each driver.
            fields: The other fields of `Run(...)`, as they are.

        Raises:
            KinfmuError: A name is no coordinate, or the inputs are not three for each driver.

        """
        coordinates = {text: read_coordinate(text) for text in (*outputs, *fixed)}
        inputs = read_inputs(input_names)
        wrong = [text for text, name in coordinates.items() if name is None]
        if wrong or inputs is None:
            raise KinfmuError(f"{listed(wrong or input_names)}: no names of {'coordinates' if wrong else 'inputs'}")
        named = {text: name for text, name in coordinates.items() if name is not None}
        return cls(
            outputs=tuple(named[text] for text in outputs),
            fixed={named[text]: value for text, value in fixed.items()},
            input_names=inputs,
            **fields,
        )

    @classmethod
    def of_fields(cls, **fields: Any) -> Run:
        """Return the run of these fields, which are those of `Run(...)`; it takes a fifth of the time.

        Args:
            fields: All fields of `Run(...)` without a default, by name; others as wanted.

        Returns:
            The run; its fields are not checked.

        """
        run = object.__new__(cls)
        run.__dict__.update(_DEFAULTS | fields)
        return run

    @cached_property
    def mechanism(self) -> Mechanism | None:
        """The mechanism with the parameters set; None if the run does not hold it.

        Raises:
            MechanismError: The run was read from a file whose text is not a mechanism.

        """
        if not isinstance(self.mechanism_source, str):
            return self.mechanism_source
        from kinfmu.mechanism import toml_file  # a run that is only read and converted does not need it

        return toml_file.parse(self.mechanism_source, "the run's mechanism") if self.mechanism_source else None

    @cached_property
    def mechanism_text(self) -> str:
        """The mechanism as TOML for files; empty if the run does not hold it."""
        if isinstance(self.mechanism_source, str):
            return self.mechanism_source
        from kinfmu.mechanism import toml_text

        return toml_text.text(self.mechanism_source)

    @property
    def names(self) -> tuple[CoordinateName, ...]:
        """Names of the generalized coordinates, the columns of q."""
        return self.outputs[: self.coordinate_count]

    @property
    def q(self) -> FloatArray:
        """Generalized coordinates, (n, len(names))."""
        return self.values[:, : self.coordinate_count]

    @property
    def qd(self) -> FloatArray:
        """Velocities of the generalized coordinates."""
        return self.rates[:, : self.coordinate_count]

    @property
    def qdd(self) -> FloatArray:
        """Accelerations of the generalized coordinates."""
        return self.accelerations[:, : self.coordinate_count]

    @property
    def good(self) -> NDArray[np.bool_]:
        """(n,) True where the sample holds numbers (status 0 to 2)."""
        return np.asarray(self.status <= Status.BRIDGED)

    def __getstate__(self) -> dict[str, Any]:
        """Return all tables as numbers and the mechanism as text, for copies and for other processes."""
        fields = {name: getattr(self, name) for name in _LAZY} | {"mechanism_source": self.mechanism_text}
        kept = {name: value for name, value in self.__dict__.items() if name != "mechanism"}
        return kept | fields  # a mechanism has views of its tables, which cannot be sent

    def __repr__(self) -> str:
        name = self.info.get("name", "run")
        span = f", {axis_of(self).range()}" if len(self.t) else ""
        bad = int((~self.good).sum())
        columns = ", ".join((*self.outputs, *self.signal_names))
        return f"<Run of {name}: {len(self.t)} samples{span}, {bad} without numbers; {columns}>"

    def __len__(self) -> int:
        return len(self.values)

    def part(self, rows: slice | NDArray[Any], events: tuple[Event, ...] = ()) -> Run:
        """Return a part of the samples.

        Args:
            rows: A slice, indices (k,) or a mask (n,).
            events: Events of the part. Default: none.

        Returns:
            A run of k samples; lazy tables stay lazy.

        """

        def part(name: str) -> Any:
            table = self.__dict__[name]
            return (lambda: getattr(self, name)[rows]) if callable(table) else table[rows]

        tables = [name for name in _TABLES if self.__dict__[name] is not None]
        return self.replaced(**{name: part(name) for name in tables}, events=events)

    def is_lazy(self, table: str) -> bool:
        """Return True if a table is not computed yet.

        Args:
            table: Name of the field, such as 'margin'.

        """
        return callable(self.__dict__[table])

    def replaced(self, **fields: Any) -> Run:
        """Return the run with other fields; what is not computed yet stays so.

        Args:
            fields: New values, by the names of the fields.

        """
        return replace(self, **{name: self.__dict__[name] for name in _LAZY} | fields)

    def without(self, names: Iterable[str]) -> Run:
        """Return the run without columns of these names: their places hold NaN (counts: 0), and none is computed.

        Args:
            names: Names of columns, such as 'coupler.ax'.

        Returns:
            A run with the same tables; `absent` lists the columns.

        """
        absent = self.absent | frozenset(names)
        absent |= {size for size, components in self.force_sizes.items() if not absent.isdisjoint(components)}
        tables: dict[str, Any] = {}
        for name, group in groupby(self.places(kept=False), key=lambda place: place.table):
            places = list(group)
            gone = [place.column or 0 for place in places if place.name in absent]
            if len(gone) == len(places):
                shape = len(self) if places[0].column is None else (len(self), len(places))
                tables[name] = np.zeros(shape, np.int64) if name == "iterations" else np.full(shape, np.nan)
            elif gone:
                tables[name] = self._blanked(name, gone)
        return self.replaced(**tables, absent=absent)

    def _blanked(self, name: str, gone: list[int]) -> Any:
        """Return a table with NaN in some columns; one that is lazy stays so."""

        def blanked() -> FloatArray:
            table = np.array(getattr(self, name))
            table[:, gone] = np.nan
            return table

        return blanked if callable(self.__dict__[name]) else blanked()

    def columns(self) -> Iterator[Column]:
        """Yield every column that was kept: time, inputs, values, rates, accelerations, diagnostics, watches.

        A run over driver values has no time: its first columns are the inputs, that of its axis before the others. The
        size of a force in a pin follows its components.
        """
        sizes = self._sizes_after(kept=True)
        has_time = axis_of(self).is_time
        places = (place for place in self.places() if has_time or place.table != "t")
        for place in sorted(places, key=lambda place: place.name != self.axis):
            yield Column(place.name, place.unit, self._column(place.table, place.column))
            if place.name in sizes:
                yield Column(sizes[place.name], place.unit, self[sizes[place.name]])

    @property
    def force_sizes(self) -> Mapping[ForceName, tuple[ForceName, ForceName]]:
        """Names of the sizes of forces in pins and on the ground, such as 'pin.force', with their two components.

        They are columns that are computed when they are read.
        """
        return sizes_of(self.reaction_names)

    def _sizes_after(self, *, kept: bool) -> dict[str, ForceName]:
        """Return the sizes of forces by the name of the column that they follow."""
        gone = self.absent if kept else frozenset()
        return {y: size for size, (_, y) in self.force_sizes.items() if size not in gone}

    def column_units(self, *, kept: bool = True) -> dict[str, str]:
        """Return the units of the columns by name, in their order.

        Args:
            kept: False: also columns that were not kept. Default: True.

        Returns:
            Units such as 'rad', 'mm/s', '1'.

        """
        units: dict[str, str] = {}
        sizes = self._sizes_after(kept=kept)
        for place in self.places(kept=kept):
            units[place.name] = place.unit
            if place.name in sizes:
                units[sizes[place.name]] = place.unit
        return units

    def places(self, *, kept: bool = True) -> Iterator[ColumnPlace]:
        """Yield names, units and places of the columns, in their order.

        Args:
            kept: False: also columns that were not kept. Default: True.

        Returns:
            Name, unit ('rad', 'mm/s', '1'), table and number of each column.

        """
        for place in self._places():
            if not (kept and place.name in self.absent):
                yield place

    def _places(self) -> Iterator[ColumnPlace]:
        per = rates_per(self)
        quantities = [given.quantity._replace(per=per) for given in self.input_names]
        quantities += [name.quantity(order, per) for order in range(3) for name in self.outputs]
        quantities += [force.quantity for force in (*self.force_names, *self.reaction_names)]
        units = ["s" if self.axis == TIME else "1", *(unit_of(quantity, self.length_unit) for quantity in quantities)]
        units += [signal.unit for signal in self.signal_names]
        units += ["1"] * (len(self._tables) - len(units))
        for (name, table, column), unit in zip(self._tables, units, strict=True):
            yield ColumnPlace(name, unit, table, column)

    @property
    def _tables(self) -> tuple[Place, ...]:
        return tables_of(*(getattr(self, names) for names in NAMES))

    def _column(self, table: str, column: int | None) -> NDArray[Any]:
        if table == "reactions" and column is not None and callable(self.__dict__["reactions"]):
            of_shaking = column - len(self.reaction_names) + _SHAKING
            if of_shaking >= 0 and self.shaking is not None:
                return self.shaking[:, of_shaking]
        numbers: NDArray[Any] = getattr(self, table)
        return numbers if column is None else numbers[:, column]

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return the column of a name, (n,); of a fixed coordinate its constant, with rates of zero.

        Raises:
            KinfmuError: The run has no such column, or it was not kept.

        """
        if not isinstance(name, str):
            raise KinfmuError(f"columns of a run have names such as 'time', not {name!r}")
        index = index_of(*(getattr(self, names) for names in NAMES))
        if name in index:
            if name in self.absent:
                raise KinfmuError(f"the run does not hold '{name}': it was not among the channels to keep")
            return self._column(*index[name])
        for size, (x, y) in self.force_sizes.items():
            if size == name:
                return np.asarray(np.hypot(self[x], self[y]))
        still = {
            fixed.derivative(order): 0.0 if order else value
            for fixed, value in self.fixed.items()
            for order in range(3)
        }
        if name not in still:
            raise KinfmuError(f"the run has no column '{name}'{suggestion(name, [*index, *self.force_sizes, *still])}")
        return np.full(len(self.t), still[name])


_DEFAULTS = {field.name: field.default for field in fields_of(Run) if field.default is not MISSING}
_LAZY = tuple(name for name, value in vars(Run).items() if isinstance(value, Lazy))
_TABLES = ("t", "values", "rates", "accelerations", "inputs", "status", "iterations", "residual", "margin", "error",
           "watch", "forces", "reactions", "shaking", "signals")  # fmt: skip


class Sink(Protocol):
    """A receiver of a run in parts: `begin`, `add` for each part, `end`; not called again after an error."""

    def begin(self, run: Run) -> None:
        """Receive names, units, constants and mechanism of a run, before its first sample.

        Args:
            run: A run of no samples.

        """

    def add(self, run: Run) -> None:
        """Receive the next samples, and the events since the last call.

        Args:
            run: A run of the samples since the last call, with their events.

        """

    def end(self, run: Run, reason: str) -> None:
        """Receive the whole run.

        Args:
            run: All samples that were kept, and all events.
            reason: Why the run ended early, if none of its events has the reason; else empty.

        """
