"""Settings of a run of an FMU: its parameters and the start values of its states, checked before they are set."""

from __future__ import annotations

import math
from collections.abc import Mapping

from kinfmu.errors import MechanismError, RequestError
from kinfmu.fmu.interface import Interface, Variable
from kinfmu.fmu.slave.estimated_rates import Rates
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.number import read_constant
from kinfmu.mechanism.settings import Settable, read_tolerance
from kinfmu.mechanism.valid import quoted
from kinfmu.units import quantity_in


def fmu_settings(
    interface: Interface, settable: Settable, parameters: Mapping[str, float | str | bool], *, has_inputs: bool
) -> dict[str, float | bool | str]:
    """Return the checked parameters to set in the FMU; with inputs of drivers, `driven_by_time` is false by default.

    Those of an FMU that owns the motion of its drivers are also the start values of its states.
    """
    known = {variable.name: variable for variable in interface if variable.causality == "parameter"}
    known |= {variable.name: variable for variable in interface.part("states") if variable.start is not None}
    chosen: dict[str, float | bool | str] = {}
    for name, value in parameters.items():
        if name not in known:
            raise settable.unknown(name, list(known))
        if name in settable.names:
            chosen[name] = settable.number(name, value)
        elif known[name].type == "Boolean":
            if value not in (False, True):
                raise RequestError(f"{name} = {quoted(value)} must be true or false")
            chosen[name] = bool(value)
        elif known[name].type == "Enumeration":
            chosen[name] = _rates(value)
        elif known[name].type == "Integer":
            chosen[name] = _count(known[name], value)
        elif known[name].causality == "output":
            chosen[name] = _start(known[name], value, interface.length_unit)
        else:
            chosen[name] = _tolerance(known[name], value)
    if has_inputs:
        chosen.setdefault("driven_by_time", False)
    return chosen


def _rates(value: float | str | bool) -> str:
    """Return the name of a value of the parameter `rates`, given as name or number."""
    names = {mode.name.lower(): mode for mode in Rates}
    for name, mode in names.items():
        if str(value).lower() == name or (not isinstance(value, str) and value == mode):
            return name
    raise RequestError(f"rates = {quoted(value)} must be auto, estimated or wired")


def _count(variable: Variable, value: float | str | bool) -> int:
    """Return a whole number that is not below the declared minimum, given as number or text."""
    least = variable.minimum or 0.0
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not (number >= least and number.is_integer()):
        raise RequestError(f"{variable.name} = {quoted(value)} must be a whole number of at least {least:g}")
    return int(number)


def _tolerance(variable: Variable, value: float | str | bool) -> float:
    """Return the tolerance if it is in the range that its variable declares."""
    tolerance = read_tolerance(variable.name, value)
    least, most = variable.minimum or 0.0, math.inf if variable.maximum is None else variable.maximum
    if not least <= tolerance <= most:
        raise RequestError(f"{variable.name} = {tolerance:g} must be at least {least:g}, at most {most:g}")
    return tolerance


def _start(variable: Variable, value: object, length_unit: str) -> float:
    """Return the start value of a state, a number or text with a unit, in the units used inside."""
    try:
        return float(read_constant(variable.name, value, quantity_in(variable.unit or "1", length_unit), length_unit))
    except MechanismError as error:
        raise RequestError(str(error)) from None


def as_set(mechanism: Mechanism, settings: Mapping[str, float | bool | str]) -> Mechanism:
    """Return the mechanism with the parameters that are set in the FMU, if it can have them."""
    own = mechanism.settable.names
    values: dict[str, float | str] = {name: value for name, value in settings.items() if name in own}
    try:
        return mechanism.with_parameters(values) if values else mechanism
    except MechanismError:
        return mechanism  # the FMU reports why
