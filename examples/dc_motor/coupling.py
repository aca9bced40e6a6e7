"""Step the motor and the press with fmpy, coupled in two ways, and compare with the integration of both as one system.

    python examples/dc_motor/coupling.py

    port      bias torque and reduced inertia go to the motor:  (J_motor + J) a = T - bias
    torque    the torque goes to the motor, a step late:         J_motor a = T - torque

Modelica's names for the two causalities: *InverseInertia*, driven by angle, speed and acceleration, as by
`Rotational.Sources.Speed` or `Move` with a torque sensor, and *DirectInertia*, driven by a torque. Here the
press is the first, and the motor owns the states.
"""

from __future__ import annotations

import sys
import tempfile
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from numpy.typing import NDArray

import kinfmu

sys.path.insert(0, str(Path(__file__).parent))
from build import build

START = np.pi / 2  # [rad] angle of the crank at rest
VOLTAGE, TORQUE_CONSTANT, RESISTANCE = 640.0, 80.0, 32.0  # of the motor, as its model description has them
LARGEST_INERTIA = 4.4287625681355225  # [kg m2] of the press at the crank, over a turn


class Slave:
    """An FMU in fmpy, with variables by name."""

    def __init__(self, path: Path, stack: ExitStack) -> None:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        about = read_model_description(path)
        self.references = {variable.name: variable.valueReference for variable in about.modelVariables}
        extract(path, folder)
        self.fmu = FMU2Slave(
            guid=about.guid,
            unzipDirectory=folder,
            modelIdentifier=about.coSimulation.modelIdentifier,
            instanceName=about.modelName,
        )
        self.fmu.instantiate()
        stack.callback(self.fmu.freeInstance)
        self.fmu.setupExperiment(startTime=0.0)

    def initialize(self, **values: float) -> None:
        self.set(**values)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def set(self, **values: float) -> None:
        self.fmu.setReal([self.references[name] for name in values], list(values.values()))

    def get(self, *names: str) -> list[float]:
        return list(self.fmu.getReal([self.references[name] for name in names]))

    def step(self, time: float, step: float) -> None:
        self.fmu.doStep(currentCommunicationPoint=time, communicationStepSize=step)


def coupled(fmus: dict[str, Path], coupling: str, inertia: float, step: float, stop: float) -> NDArray[np.float64]:
    """Return angle and speed of the crank (n, 2) at all steps; fewer rows if the coupling diverges.

    Args:
        fmus: Paths of the FMUs.
        coupling: 'port' or 'torque'.
        inertia: Moment of inertia of the motor [kg m2].
        step: Communication step [s].
        stop: End of the run [s].

    """
    with ExitStack() as stack:
        motor, press = (Slave(fmus[name], stack) for name in ("dc_motor", "toggle_press"))
        motor.initialize(inertia=inertia, initial_angle=START)
        press.initialize(crank_angle=START)
        rows = []
        for k in range(round(stop / step) + 1):
            angle, speed, acceleration = motor.get("angle", "speed", "acceleration")
            rows.append((angle, speed))
            try:
                if coupling == "port":
                    press.set(crank_angle=angle, crank_speed=speed)
                    bias, load = press.get("crank.bias_torque", "crank.reduced_inertia")
                    motor.set(load_torque=bias, load_inertia=load)
                    (acceleration,) = motor.get("acceleration")
                    press.set(crank_acceleration=acceleration)
                else:
                    press.set(crank_angle=angle, crank_speed=speed, crank_acceleration=acceleration)
                    motor.set(load_torque=press.get("crank.torque")[0])
                motor.step(k * step, step)
                press.step(k * step, step)
            except FMICallException:  # the values are too large for the FMU
                break
            if abs(speed) > 100.0 * VOLTAGE / TORQUE_CONSTANT:
                break
        return np.array(rows)


def monolithic(inertia: float, t: NDArray[np.float64], tolerance: float = 1e-11) -> NDArray[np.float64]:
    """Return angle and speed (n, 2) of motor and press as one system: the inertia of the motor turns with the crank."""
    press = kinfmu.load("toggle_press")
    bodies = [replace(b, inertia=b.inertia + inertia) if b.name == "crank" else b for b in press.bodies]

    def torque(_t: float, state: dict[str, float]) -> float:
        return TORQUE_CONSTANT * (VOLTAGE - TORQUE_CONSTANT * state["crank_speed"]) / RESISTANCE

    run = kinfmu.simulate(
        replace(press, bodies=tuple(bodies)),
        drive="torque",
        start=float(t[0]),
        stop=float(t[-1]),
        step=float(t[1] - t[0]),
        inputs={"crank_torque": torque},
        state={"crank_angle": START, "crank_speed": 0.0},
        tolerance=tolerance,
    )
    return np.column_stack([run["crank_angle"], run["crank_speed"]])


def main() -> None:
    """Print the error of both couplings at ratios of inertia and steps."""
    with tempfile.TemporaryDirectory() as folder:
        fmus = build(Path(folder))
        print(" J_press / J_motor    step [s]   error of the angle [rad]: port      torque")
        for ratio in (0.5, 4.0):
            for step in (1e-3, 5e-4, 2.5e-4):
                wanted = monolithic(LARGEST_INERTIA / ratio, np.arange(0.0, 1.0 + step / 2, step))
                errors = []
                for coupling in ("port", "torque"):
                    rows = coupled(fmus, coupling, LARGEST_INERTIA / ratio, step, 1.0)
                    is_whole = len(rows) == len(wanted)
                    errors.append(f"{np.abs(rows - wanted)[:, 0].max():10.2e}" if is_whole else "  diverges")
                print(f"{ratio:18g}{step:12g}{errors[0]:>35}{errors[1]:>12}")


if __name__ == "__main__":
    main()
