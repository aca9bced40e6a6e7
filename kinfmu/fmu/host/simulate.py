"""Simulate an FMU, a system or a mechanism: what `kinfmu.simulate` is given decides.

fmpy's own `simulate_fmu` records the outputs of u(t - h) at t, and ends without a message if a step is discarded. FMUs
are stepped here through fmpy's low-level calls: set at t_k, get, record, then step.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

from kinfmu.errors import RequestError
from kinfmu.fmu.host.input_table import times
from kinfmu.fmu.host.own import simulate_own
from kinfmu.fmu.host.system import simulate_foreign, simulate_ssp
from kinfmu.fmu.unpacked import DESCRIPTION, MECHANISM
from kinfmu.mechanism import Mechanism
from kinfmu.run import Run
from kinfmu.run.run import Sink

BEGINNING = 4096  # bytes of a model description that hold the attributes of its first tag


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
        method: With a mechanism: 'DOP853', the pair of Dormand and Prince of order 8, or, for stiff springs and
            dampers, 'Radau', of scipy.integrate. Default: 'DOP853'.
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
        return _simulate_mechanism(
            fmu_path,
            (start, stop, step),
            sink,
            inputs=inputs,
            state=state,
            parameters=parameters,
            tolerance=tolerance,
            method=method,
            progress=progress,
        )
    if method is not None:
        raise RequestError(f"method: for a mechanism driven by torques, not for FMU {fmu_path}")
    path = Path(fmu_path)
    common: dict[str, Any] = {
        "start": start,
        "stop": stop,
        "step": step,
        "inputs": inputs,
        "parameters": parameters or {},
        "channels": channels,
        "rate": rate,
        "sink": sink,
        "progress": progress,
    }
    if is_own(path):
        return simulate_own(path, drive=drive, state=state, tolerance=tolerance, wrap=wrap, **common)
    if wrap:
        raise RequestError("wrap is for FMUs of kinfmu")
    simulate_others = simulate_ssp if path.suffix.lower() == ".ssp" else simulate_foreign
    return simulate_others(path, exchange=exchange, **common)


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


def _simulate_mechanism(
    mechanism: Mechanism,
    span: tuple[float | None, float | None, float | None],
    sink: Sink | None,
    **arguments: Any,
) -> Run:
    """Integrate the motion of a mechanism under torques, and pass the run to the sink as a whole."""
    from kinfmu.motion.torque import torque_driven  # steps of FMUs do not need the planner

    start, stop, step = span
    t = times(mechanism.run, start, stop, mechanism.run.step if step is None else step)
    run = torque_driven(mechanism, t, **arguments)
    if sink is not None:
        sink.begin(run.part(slice(0, 0)))
        sink.add(run)
        sink.end(run, "")
    return run
