"""Simulate an FMU through fmpy's low-level calls, and return its samples as a Run.

fmpy's own `simulate_fmu` records the outputs of u(t - h) at t, and ends without a message if a step is discarded. This
loop sets at t_k, gets, records, then steps.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile, ZipFile

import numpy as np

from kinfmu.errors import FmuError, RequestError, listed
from kinfmu.fmu import description
from kinfmu.fmu.fmu_settings import as_set, fmu_settings
from kinfmu.fmu.input_table import InputTable, input_notes, input_table, times, undriven
from kinfmu.fmu.interface import Interface
from kinfmu.fmu.interruption import Interruption
from kinfmu.fmu.samples import DISCARD, ERROR, Samples
from kinfmu.fmu.slave.estimated_rates import Rates
from kinfmu.fmu.slaves import LoadedSlave, slave
from kinfmu.fmu.system.simulate import simulate_system
from kinfmu.fmu.unpacked import DESCRIPTION, LARGEST_DESCRIPTION, MECHANISM, text_in, unpacked
from kinfmu.mechanism import Mechanism, toml_file
from kinfmu.run import Run
from kinfmu.run.channels import kept_samples
from kinfmu.run.run import Sink
from kinfmu.solver.python.status import Status

if TYPE_CHECKING:
    from numpy.typing import NDArray

BEGINNING = 4096  # bytes of a model description that hold the attributes of its first tag
INTEGRATOR_TOLERANCE = "integrator.tolerance"  # of an FMU that owns the motion of its drivers


def simulate(
    fmu_path: str | Path | Mechanism,
    *,
    drive: str | None = None,
    start: float | None = None,
    stop: float | None = None,
    step: float | None = None,
    inputs: str | Path | Mapping[str, Any] | None = None,
    parameters: Mapping[str, float | str | bool] | None = None,
    state: Mapping[str, float] | None = None,
    tolerance: float | None = None,
    method: str | None = None,
    wrap: bool = False,
    channels: Sequence[str] | None = None,
    rate: float | None = None,
    sink: Sink | None = None,
    progress: Callable[[int, int], None] | None = None,
    exchange: str = "ordered",
) -> Run:
    """Step an FMU or a system of FMUs, or integrate the motion of a mechanism under torques, from start to stop.

    Samples are at t_k = start + k step; a shorter last step ends at stop. If a pose cannot be reached, the run ends:
    its last sample has the status and no numbers, and an event of level "error" states driver, value and limit.

    Ctrl-C also ends the run and adds an event. Before the first sample it raises KeyboardInterrupt, and the sink is not
    called. SIGTERM and SIGHUP do the same, and then have their usual effect.

    Probable mistakes (inputs that no column drives, angles that jump by more than half a turn, radians that look like
    degrees) are reported by events of level "warning" and "info".

    FMUs of other tools are stepped too, and the FMUs of an .ssp, with the connections between them. Their outputs are
    the signals of the run; those of the first FMU of kinfmu among them are its coordinates and forces, and its linkage
    is drawn. Parameters and inputs of the components of a system have names such as motor.voltage. At each sample all
    connections pass their values, and then all FMUs step.

    With a mechanism and drive="torque" the drivers apply efforts, and their values and speeds are integrated:

        J(u) udd = T - bias(u, ud)        u: driver values, T: efforts, J: reduced inertia

    Efforts and external loads are inputs, such as crank_torque [N m] or wind_force [N], 0 by default: numbers, laws of
    time such as Harmonic(...), functions of t, functions of t and the state (a mapping of crank_angle, crank_speed),
    or arrays over "time". At jumps of laws, breaks of cams' laws and rows of arrays the integrator restarts.
    The motion ends at a limit of the drivers with an event as above, and goes through change points.

    Args:
        fmu_path: File of the FMU or of the SSP; a mechanism with masses for drive="torque".
        drive: 'torque' for a mechanism. Default: what the FMU was built for.
        start: Start time [s]. Default: of the FMU's default experiment; with inputs, of their first row.
        stop: Stop time [s]. Default: of the FMU's default experiment; with inputs, of their last row.
        step: Step [s]. Default: of the FMU's default experiment.
        inputs: CSV file with the columns `time` and inputs such as `crank_angle`, or `crank_angle [deg]` with a unit,
            or a mapping of arrays by name; linear between rows. `driven_by_time` is then false by default, unless all
            of them are efforts of external loads.
        parameters: Values by name, such as {"crank.speed": 2.0} or {"crank.speed": "20 rpm"}.
        state: With a mechanism, or its FMU built with drive="torque": initial values and speeds, such as
            {"crank_angle": 0.5, "crank_speed": 2.0} [rad, rad/s]. Default: those of the laws at the start.
        tolerance: In the same cases: error of a step, relative, and absolute in rad and sizes. Default: 1e-9.
        method: With a mechanism: 'DOP853' or, for stiff springs and dampers, 'Radau', of scipy.integrate. Default:
            'DOP853'.
        wrap: True: angles among the inputs that jump by a turn, such as from 2 pi to 0, are unwrapped. False: such a
            jump is a turn back.
        channels: Channels to record of every sample, such as ["q", "qd"] or ["-error", "-margin"]: see
            kinfmu.run.channels. Others are not read from the FMU. Default: all.
        rate: Number of samples to record per second of the run. Default: all.
        sink: Sink that gets the run while it is simulated, such as kinfmu.log.McapLog("run.mcap"), or any other
            kinfmu.Sink.
        progress: Called with (samples done, number of samples).
        exchange: How connections of a system pass values: 'ordered', an output is read after the inputs that it depends
            on are set, or 'jacobi', all outputs are read before any input is set, as many hosts do. Default: 'ordered'.

    Returns:
        The run.

    Raises:
        RequestError: If times, inputs, parameters or channels are not valid.
        FmuError: If the file is not an FMU, connections do not fit, a table of inputs is faulty, or the mechanism has
            no solution with the parameters.

    """
    if isinstance(fmu_path, Mechanism):
        if drive != "torque":
            raise RequestError(
                f"simulate steps an FMU; build(mechanism) makes one of mechanism '{fmu_path.name}'; "
                f"simulate(mechanism, drive='torque') integrates its motion under torques"
            )
        if wrap or channels is not None or rate is not None or isinstance(inputs, str | Path):
            raise RequestError("wrap, channels, rate and files of inputs are for FMUs, not for a mechanism")
        from kinfmu.motion.torque import torque_driven  # steps of FMUs do not need the planner

        run = torque_driven(
            fmu_path,
            times(fmu_path.run, start, stop, fmu_path.run.step if step is None else step),
            inputs=inputs,
            state=state,
            parameters=parameters,
            tolerance=tolerance,
            method=method,
            progress=progress,
        )
        if sink is not None:
            sink.begin(run.part(slice(0, 0)))
            sink.add(run)
            sink.end(run, "")
        return run
    only = {"drive": drive, "state": state, "tolerance": tolerance}
    own = [name for name, value in only.items() if value is not None]
    if method is not None:
        raise RequestError(f"method: for a mechanism driven by torques, not for FMU {fmu_path}")
    path = Path(fmu_path)
    if not is_own(path):
        if wrap:
            raise RequestError("wrap is for FMUs of kinfmu")
        return simulate_system(
            path,
            start=start,
            stop=stop,
            step=step,
            inputs=inputs,
            parameters=parameters or {},
            channels=channels,
            rate=rate,
            sink=sink,
            progress=progress,
            exchange=exchange,
        )
    interrupted = Interruption()
    try:
        with unpacked(path) as folder:
            xml = text_in(path, folder, DESCRIPTION, LARGEST_DESCRIPTION)
            about = description.read(xml.encode(), str(path))
            interface = about.interface
            if own and (not interface.part("states") or drive not in (None, "torque")):
                raise RequestError(
                    f"{listed(own)}: for a mechanism driven by torques, or its FMU, not for FMU {fmu_path}"
                )
            given = dict(parameters or {}) | dict(state or {})
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
            samples = Samples(about, len(kept), settings=settings, mechanism=mechanism, model_description=xml)
            if interface.part("inputs") and not _time_drives(interface, settings):
                samples.extend(undriven(interface, table, float(t[0])))
            if table is not None:
                samples.extend(input_notes(interface, table, start, stop))
            with interrupted:
                with slave(about, folder, samples.log) as one:
                    _initialize(one, settings, t, samples.first_error)
                    samples.read_fixed(one)
                    if interrupted:
                        raise KeyboardInterrupt
                    computes = _computes_estimates(interface, settings, table, rows[0])
                    samples.begin(one, channels, sink, computes_estimates=computes)
                    try:
                        driven = [] if table is None else [one.references[name] for name in table.names]
                        _step_through(one, samples, t, kept, driven, rows, progress, interrupted.came)
                    except BaseException as failure:
                        samples.end(str(failure) or type(failure).__name__)
                        raise
                if rate is None:
                    samples.note_coarse()
                return samples.end()
    finally:
        interrupted.deliver()


def is_own(path: Path) -> bool:
    """Return False for an SSP and for an FMU of another tool; True also for a damaged FMU."""
    if path.suffix.lower() == ".ssp":
        return False
    try:
        with ZipFile(path) as zipped:
            if MECHANISM in zipped.namelist():
                return True
            with zipped.open(DESCRIPTION) as file:
                return b'generationTool="kinfmu' in file.read(BEGINNING)
    except (OSError, BadZipFile, LookupError, ValueError, RuntimeError, zlib.error):
        return True


def _time_drives(interface: Interface, parameters: Mapping[str, float | bool | str]) -> bool:
    return any(bool(parameters.get(switch.name, switch.start)) for switch in interface.part("drive"))


def _initialize(
    slave: LoadedSlave,
    parameters: Mapping[str, float | bool | str],
    t: NDArray[np.float64],
    complaint: Callable[[], str],
) -> None:
    """Set the parameters and initialize; raise an FmuError for refused parameters and for those with no solution.

    FMUs of the python flavour cannot return Error here: their messages of level error count.
    """
    from fmpy.fmi1 import FMICallException

    try:
        for name, value in parameters.items():
            if isinstance(value, bool):
                slave.set_boolean(slave.references[name], value)
            elif isinstance(value, str):
                slave.set_enumeration(slave.references[name], Rates[value.upper()])
            else:
                slave.set([slave.references[name]], [value])
        slave.initialize(float(t[0]))
    except FMICallException as failure:
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


def _step_through(
    slave: LoadedSlave,
    samples: Samples,
    t: NDArray[np.float64],
    kept: NDArray[np.int64],
    inputs: list[int],
    rows: NDArray[np.float64],
    progress: Callable[[int, int], None] | None,
    signals: list[int],
) -> None:
    """Run the loop: set at t_k, get, record if the sample is kept or holds no numbers, step.

    kept: indices of samples to record; inputs: value references of the k inputs to set; rows: (n, k) their values;
    signals: those that came, which end the run.
    """
    kept_at = np.zeros(len(t), bool)
    kept_at[kept] = True
    is_kept: Any = kept_at.data
    times = t.data  # items of a memoryview are Python numbers, which are faster
    last = len(t) - 1
    set_inputs = slave.setter(inputs, rows) if inputs else None
    for k, time in enumerate(times):
        samples.now = time
        if signals and k:
            samples.log(ERROR, f"at t = {time:g} s: interrupted; the run ends here")
            return
        if set_inputs:
            set_inputs(k)
        good = samples.read(time, slave, is_kept=is_kept[k])
        if progress is not None:
            progress(k + 1, len(t))
        if not good:
            samples.log(DISCARD, f"at t = {time:g} s: {slave.message()}")
            return
        if k == last:
            return
        end = times[k + 1]
        samples.now = time if inputs else end  # messages of a step are about its inputs, or the time it goes to
        if not slave.step(time, end - time):
            if slave.counts()[0] > Status.BRIDGED:  # the step goes to an unreachable pose
                samples.read(end, slave)
            return
