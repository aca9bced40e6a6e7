"""Check that a model description, of any origin, describes an FMU that kinfmu can step."""

from __future__ import annotations

from collections.abc import Sequence

from kinfmu.errors import FmuError, listed
from kinfmu.fmu.interface import Interface, Variable
from kinfmu.mechanism.valid import quoted
from kinfmu.units import METRES, read_coordinate, read_inputs

_ALONE = {  # parts with a fixed list of variables
    "residual": ("solver.residual",),
    "margin": ("solver.margin",),
    "errors": ("solver.error_q", "solver.error_qd", "solver.error_qdd"),
    "counts": ("solver.status", "solver.iterations"),
    "message": ("solver.message",),
}


def check(interface: Interface) -> None:
    """Raise an FmuError for an interface that differs in structure from those of `interface`."""
    if interface.length_unit not in METRES:
        raise FmuError(f"unit of length {quoted(interface.length_unit)} is not one of {listed(METRES)}")
    for name, variables in _ALONE.items():
        if not set(variables) <= set(_names(interface.part(name))):
            raise FmuError(f"part {name} does not hold {listed(variables)}")
    switches = interface.part("drive")
    if [(variable.type, type(variable.start)) for variable in switches] != [("Boolean", bool)]:
        raise FmuError("part drive must be one Boolean variable with a start value")
    _check_motion(interface)


def _check_motion(interface: Interface) -> None:
    """Raise an FmuError unless the outputs are coordinates, with their rates, and every driver has three inputs."""
    outputs = _names(interface.part("values"))
    coordinates = []
    for name in (*outputs, *_names(interface.part("fixed"))):
        coordinate = read_coordinate(name)
        if coordinate is None:
            raise FmuError(f"{quoted(name)} is no coordinate such as 'crank.phi'")
        coordinates.append(coordinate)
    for order, part in enumerate(("values", "rates", "accelerations")):
        if _names(interface.part(part)) != [name.derivative(order) for name in coordinates[: len(outputs)]]:
            raise FmuError(f"part {part} does not hold the derivatives of the outputs")
    if not 0 <= interface.coordinate_count <= len(outputs):
        raise FmuError(f"{interface.coordinate_count} of {len(outputs)} outputs cannot be coordinates")
    inputs = _names(interface.part("inputs"))
    if read_inputs(inputs) is None or _names(interface.part("driven")) != [f"driven.{name}" for name in inputs]:
        raise FmuError("part driven does not hold the inputs, three for each driver")
    for name in _names(interface.part("watch")):
        if not name.startswith("watch."):
            raise FmuError(f"{quoted(name)} is no name of a watch such as 'watch.rod.length'")


def _names(variables: Sequence[Variable]) -> list[str]:
    return [variable.name for variable in variables]
