"""Step any FMU, or the FMUs of an SSP, and return their samples as one run."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kinfmu.errors import FmuError, RequestError, valid_names
from kinfmu.fmu.host.exchange import check_exchange, exchange_of, ordered
from kinfmu.fmu.host.input_table import InputTable, table_of, times
from kinfmu.fmu.host.ports import Port
from kinfmu.fmu.host.samples import DISCARD, ERROR, Samples, own_info
from kinfmu.fmu.host.settings import as_set
from kinfmu.fmu.host.slaves import require_fmpy, slave
from kinfmu.fmu.host.stepping import Interruption, step_through
from kinfmu.fmu.host.structure import STRUCTURE, Component, SystemStructure, of_fmu, of_ssp
from kinfmu.fmu.unpacked import unpacked
from kinfmu.mechanism import Mechanism, toml_file, toml_text
from kinfmu.run import Event, Run
from kinfmu.run.channels import kept_samples
from kinfmu.run.components import mechanism_info
from kinfmu.run.run import Sink
from kinfmu.units import SignalName

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

RESERVED = ("time",)  # names of columns that every run has


def simulate_foreign(path: Path, **arguments: Any) -> Run:
    """Step an FMU of another tool, a system of one component; arguments and errors as in kinfmu.simulate."""
    return _simulate(path, lambda opened: of_fmu(path, opened.enter_context(unpacked(path))), **arguments)


def simulate_ssp(path: Path, **arguments: Any) -> Run:
    """Step the FMUs of an SSP; arguments and errors as in kinfmu.simulate."""
    return _simulate(
        path, lambda opened: of_ssp(path, opened.enter_context(unpacked(path, STRUCTURE)), opened), **arguments
    )


def _simulate(
    path: Path,
    open_system: Callable[[ExitStack], SystemStructure],
    *,
    start: float | None,
    stop: float | None,
    step: float | None,
    inputs: str | Path | Mapping[str, ArrayLike] | None,
    parameters: Mapping[str, float | str | bool],
    channels: Sequence[str] | None,
    rate: float | None,
    sink: Sink | None,
    progress: Callable[[int, int], None] | None,
    exchange: str,
) -> Run:
    check_exchange(exchange)
    require_fmpy()
    interrupted = Interruption()
    try:
        with ExitStack() as opened:
            system = open_system(opened)
            table = None if inputs is None else table_of(inputs, _units(system))
            span = table or system.experiment
            if stop is None and math.isnan(span.stop):
                raise RequestError(f"{path}: the model states no stop time; give one (--stop)")
            default = system.experiment.step if math.isfinite(system.experiment.step) else None
            if step is None and default is None:
                first = span.start if start is None else start
                default = ((span.stop if stop is None else stop) - first) / 1000 or 1.0
            t = times(span, start, stop, step if step is not None else default or 1.0)
            kept = kept_samples(t, rate)
            values = _values(path, system, parameters, table)
            with interrupted:
                return _run(system, t, kept, table, values, channels, sink, progress, exchange, interrupted, opened)
    finally:
        interrupted.deliver()


def _units(system: SystemStructure) -> dict[str, dict[str, float]]:
    """Return the units that columns of a table of inputs may have."""
    return {name: ends[0][1].units() for name, ends in system.inputs.items()}


def _values(
    path: Path, system: SystemStructure, parameters: Mapping[str, float | str | bool], table: InputTable | None
) -> dict[str, dict[str, float]]:
    """Return what is set before initialization, by component and variable."""
    found = {one.name: dict(one.values) for one in system.components}
    settable = {
        one.column(port.name): (one, port)
        for one in system.components
        for port in one.ports.values()
        if port.causality in ("parameter", "input")
    }
    settable |= {name: ends[0] for name, ends in system.inputs.items()}
    for name, value in parameters.items():
        if name not in settable:
            raise RequestError(
                f"{path}: '{name}' is no parameter or input{valid_names(name, settable, 'parameters and inputs')}"
            )
        for one, port in system.inputs.get(name, (settable[name],)):
            found[one.name][port.name] = port.number(name, value)
    for one in system.components:  # drivers whose inputs are given follow these, not their laws
        if one.own is not None:
            given = {wire.input.name for wire in system.connections if wire.target is one}
            given |= {
                port.name for name in (table.names if table else ()) for end, port in system.inputs[name] if end is one
            }
            drivers = [variable.name for variable in one.own.interface.part("inputs")]
            if given & set(drivers):
                (switch,) = one.own.interface.part("drive")
                found[one.name].setdefault(switch.name, 0.0)
                if given >= set(drivers) and "rates" in one.ports:
                    found[one.name].setdefault("rates", one.ports["rates"].number("rates", "wired"))
    return found


def _run(
    system: SystemStructure,
    t: NDArray[np.float64],
    kept: NDArray[np.int64],
    table: InputTable | None,
    values: Mapping[str, Mapping[str, float]],
    channels: Sequence[str] | None,
    sink: Sink | None,
    progress: Callable[[int, int], None] | None,
    exchange: str,
    interrupted: Interruption,
    opened: ExitStack,
) -> Run:
    """Start the slaves, initialize them, and step them."""
    rows = np.empty((len(t), 0)) if table is None else table.at(t)
    main = next((one for one in system.components if one.own is not None), None)
    others = [one for one in system.components if one is not main]
    names = [SignalName(_column(one, port), port.unit) for one in others for port in one.of("output")]
    driven = [name for name in (table.names if table else ()) if all(end is not main for end, _ in system.inputs[name])]
    names += [SignalName(name, system.inputs[name][0][1].unit) for name in driven]
    samples = _samples(main, len(kept), values, _info(system, values, main), names)
    samples.extend([Event(float(t[0]), "info", note) for note in system.notes])
    samples.now = float(t[0])
    slaves = {
        one.name: opened.enter_context(slave(one.own or one.about, one.folder, samples.log, one.name or one.path.stem))
        for one in system.components
    }
    exchanged = exchange_of(exchange, system.connections, slaves)
    set_inputs = [
        (column, slaves[end.name].setter([port]))
        for column, name in enumerate(table.names if table else ())
        for end, port in system.inputs[name]
    ]

    place = 0  # of the sample

    def exchange_at(k: int) -> None:
        nonlocal place
        place = k
        for column, set_input in set_inputs:
            set_input([float(rows[k, column])])
        exchanged()

    try:
        for one in system.components:
            given = values[one.name]
            slaves[one.name].setter([one.ports[name] for name in given])(list(given.values()))
            slaves[one.name].enter(float(t[0]))
        exchange_at(0)
        for one in system.components:
            slaves[one.name].exit()
    except FmuError as error:
        raise FmuError(f"{error} {samples.first_error()}".strip()) from None
    loaded = slaves[main.name] if main else None
    if loaded:
        if samples.first_error():  # FMUs in Python cannot return Error here: their messages count
            raise FmuError(samples.first_error())
        samples.read_fixed(loaded)
    for loop in ordered(system.connections)[1]:
        text = f"algebraic loop: {', '.join(map(str, loop))}; its first value is a step late, which may be unstable"
        samples.extend([Event(float(t[0]), "warning", text)])
    if interrupted:
        raise KeyboardInterrupt
    readers = [slaves[one.name].getter(one.of("output")) for one in others]
    columns = [] if table is None else [table.names.index(name) for name in driven]
    readers.append(lambda: [float(rows[place, column]) for column in columns])
    samples.begin(loaded, channels, sink, read_signals=readers)

    def step(time: float, size: float) -> bool:
        for one in slaves.values():
            if not one.step(time, size):
                if not samples.is_unreachable():
                    samples.log(DISCARD, f"at t = {time:g} s: {one.name} ends the run: it does not step further")
                return False
        return True

    try:
        step_through(samples, t, kept, exchange_at, step, progress, interrupted.came)
    except FmuError as failure:
        samples.log(ERROR, f"at t = {samples.now:g} s: {failure}")
    except BaseException as failure:
        samples.end(str(failure) or type(failure).__name__)
        raise
    return samples.end()


def _column(one: Component, port: Port) -> str:
    """Return the name of an output as a column."""
    name = one.column(port.name)
    return f"fmu.{name}" if name in RESERVED or name.startswith("solver.") else name


def _mechanism_of(one: Component, values: Mapping[str, Mapping[str, float]]) -> Mechanism:
    """Return the mechanism of a component, with the parameters that are set."""
    return as_set(toml_file.parse(one.mechanism, f"{one.path}: mechanism.toml"), values[one.name])


def _samples(
    main: Component | None,
    count: int,
    values: Mapping[str, Mapping[str, float]],
    info: Mapping[str, str],
    signals: Sequence[SignalName],
) -> Samples:
    """Return the samples of the system, with those of kinfmu's FMU that is drawn, if there is one."""
    if main is None or main.own is None:
        return Samples(count, info, signals=signals)
    return Samples(
        count,
        own_info(main.own, values[main.name]) | dict(info),
        interface=main.own.interface,
        mechanism=_mechanism_of(main, values),
        model_description=(main.folder / "modelDescription.xml").read_text("utf-8"),
        signals=signals,
    )


def _info(system: SystemStructure, values: Mapping[str, Mapping[str, float]], main: Component | None) -> dict[str, str]:
    """Return what the record states of the system."""
    given = [f"{one.column(name)} = {value:g}" for one in system.components for name, value in values[one.name].items()]
    if len(system.components) == 1:
        parts = {"generation_tool": str(system.components[0].about.generationTool or "")}
    else:
        parts = {
            "components": ", ".join(f"{one.name} ({one.about.modelName})" for one in system.components),
            "connections": ", ".join(map(str, system.connections)),
        }
    parts |= {} if main else {"token": ""}
    others = [one for one in system.components if one.own is not None and one is not main]
    texts = [(one.name, toml_text.text(_mechanism_of(one, values))) for one in others]
    parts |= mechanism_info(main.name if main else "", texts)
    return {"name": system.name, "title": system.title, **parts, "parameters": ", ".join(given)}
