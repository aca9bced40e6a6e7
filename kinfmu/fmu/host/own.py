"""Step an FMU of kinfmu and return its samples as a Run: with its mechanism, its checked settings and its inputs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kinfmu.errors import FmuError, RequestError, listed
from kinfmu.fmu import description
from kinfmu.fmu.host.input_table import InputTable, input_notes, input_table, times, undriven
from kinfmu.fmu.host.ports import Port
from kinfmu.fmu.host.samples import Samples, own_info
from kinfmu.fmu.host.settings import as_set, fmu_settings
from kinfmu.fmu.host.slaves import LoadedSlave, slave
from kinfmu.fmu.host.stepping import Interruption, step_through
from kinfmu.fmu.interface import Interface
from kinfmu.fmu.slave.estimated_rates import Rates
from kinfmu.fmu.unpacked import DESCRIPTION, LARGEST_DESCRIPTION, MECHANISM, text_in, unpacked
from kinfmu.mechanism import toml_file
from kinfmu.run import Run
from kinfmu.run.channels import kept_samples
from kinfmu.run.run import Sink

if TYPE_CHECKING:
    from numpy.typing import NDArray

INTEGRATOR_TOLERANCE = "integrator.tolerance"  # of an FMU that owns the motion of its drivers


def simulate_own(
    path: Path,
    *,
    drive: str | None,
    start: float | None,
    stop: float | None,
    step: float | None,
    inputs: str | Path | Mapping[str, Any] | None,
    parameters: Mapping[str, float | str | bool],
    state: Mapping[str, float] | None,
    tolerance: float | None,
    wrap: bool,
    channels: Sequence[str] | None,
    rate: float | None,
    sink: Sink | None,
    progress: Callable[[int, int], None] | None,
) -> Run:
    """Step an FMU of kinfmu; arguments and errors as in kinfmu.simulate."""
    only = {"drive": drive, "state": state, "tolerance": tolerance}
    torque_driven = [name for name, value in only.items() if value is not None]
    interrupted = Interruption()
    try:
        with unpacked(path) as folder:
            xml = text_in(path, folder, DESCRIPTION, LARGEST_DESCRIPTION)
            about = description.read(xml.encode(), str(path))
            interface = about.interface
            if torque_driven and (not interface.part("states") or drive not in (None, "torque")):
                raise RequestError(
                    f"{listed(torque_driven)}: for a mechanism driven by torques, or its FMU, not for FMU {path}"
                )
            given = dict(parameters) | dict(state or {})
            given |= {} if tolerance is None else {INTEGRATOR_TOLERANCE: tolerance}
            if wrap and inputs is None:
                raise RequestError("wrap unwraps angles among the inputs, and no inputs are given")
            table = None if inputs is None else input_table(inputs, interface, wrap=wrap)
            experiment = interface.experiment
            t = times(table or experiment, start, stop, experiment.step if step is None else step)
            rows = np.empty((len(t), 0)) if table is None else table.at(t)
            kept = kept_samples(t, rate)
            mechanism = toml_file.parse(text_in(path, folder, MECHANISM), f"{path}: {MECHANISM}")
            try:
                drives = table is not None and any(v.name in table.names for v in interface.part("inputs"))
                settings = fmu_settings(interface, mechanism.settable, given, has_inputs=drives)
            except RequestError as error:
                raise RequestError(f"{path}: {error}") from None
            mechanism = as_set(mechanism, settings)
            info = own_info(about, settings)
            samples = Samples(len(kept), info, interface=interface, mechanism=mechanism, model_description=xml)
            if interface.part("inputs") and not _time_drives(interface, settings):
                samples.extend(undriven(interface, table, float(t[0])))
            if table is not None:
                samples.extend(input_notes(interface, table, start, stop))
            with interrupted:
                with slave(about, folder, samples.log) as loaded:
                    _initialize(loaded, interface, settings, t, samples.first_error)
                    samples.read_fixed(loaded)
                    if interrupted:
                        raise KeyboardInterrupt
                    computes = _computes_estimates(interface, settings, table, rows[0])
                    samples.begin(loaded, channels, sink, computes_estimates=computes)
                    try:
                        set_inputs = loaded.row_setter(table.names, rows) if table and table.names else None
                        step_through(samples, t, kept, set_inputs, loaded.step, progress, interrupted.came)
                    except BaseException as failure:
                        samples.end(str(failure) or type(failure).__name__)
                        raise
                if rate is None:
                    samples.note_coarse()
                return samples.end()
    finally:
        interrupted.deliver()


def _time_drives(interface: Interface, parameters: Mapping[str, float | bool | str]) -> bool:
    return any(bool(parameters.get(switch.name, switch.start)) for switch in interface.part("drive"))


def _initialize(
    slave: LoadedSlave,
    interface: Interface,
    parameters: Mapping[str, float | bool | str],
    t: NDArray[np.float64],
    complaint: Callable[[], str],
) -> None:
    """Set the parameters and initialize; raise an FmuError for refused parameters and for those with no solution.

    FMUs of the python flavour cannot return Error here: their messages of level error count.
    """
    ports = {v.name: Port(v.name, slave.references[v.name], v.type, v.causality) for v in interface}
    values = [Rates[value.upper()] if isinstance(value, str) else value for value in parameters.values()]
    try:
        slave.setter([ports[name] for name in parameters])(values)
        slave.enter(float(t[0]))
        slave.exit()
    except FmuError as failure:
        raise FmuError(complaint() or str(failure)) from None
    if complaint():
        raise FmuError(complaint())


def _computes_estimates(
    interface: Interface,
    settings: Mapping[str, float | bool | str],
    table: InputTable | None,
    first: NDArray[np.float64],
) -> bool:
    """Return True if margins and errors follow from the driver values: errors of estimated rates do not.

    first: inputs at the first sample.
    """
    if interface.part("states") or _time_drives(interface, settings):
        return True
    given = set() if table is None else {name for name, value in zip(table.names, first, strict=True) if value}
    rates = {variable.name for k, variable in enumerate(interface.part("inputs")) if k % 3}
    mode = settings.get("rates", "auto")
    return mode == "wired" or (mode == "auto" and rates <= given)
