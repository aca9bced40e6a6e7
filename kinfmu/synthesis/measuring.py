"""Measures of the motion with values to reach or limits to keep, and their derivatives by central differences."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kinfmu.errors import KinfmuError, MechanismError, listed, suggestion
from kinfmu.laws import ConstantSpeed
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.number import read_constant
from kinfmu.mechanism.valid import quoted
from kinfmu.motion import measure
from kinfmu.readings import LowestMargin, Reading
from kinfmu.run import FloatArray
from kinfmu.sweep import Model
from kinfmu.sweep import compile as compiled
from kinfmu.synthesis.argument import Argument
from kinfmu.synthesis.constraints import Constraint, MarginConstraint, MeasureConstraint
from kinfmu.synthesis.numbers import read_weights
from kinfmu.synthesis.targets import MeasureTarget, Target
from kinfmu.units import Quantity, quantity_in

SAMPLES = 361  # of the motion that is measured
STEP = 1e-5  # of the range of an unknown, half of a central difference; error: some 1e-9 of the derivative


@dataclass(frozen=True)
class Aim:
    """A measure with the value it shall have, or its limits."""

    name: str
    reading: Reading
    value: float | None
    minimum: float | None
    maximum: float | None
    root: float  # square root of the weight
    unit: str

    def error(self, found: float) -> float:
        """Return the deviation from the value, or what exceeds a limit; 0 within the limits."""
        if self.value is not None:
            return found - self.value
        if self.minimum is not None and found < self.minimum:
            return found - self.minimum
        return found - self.maximum if self.maximum is not None and found > self.maximum else 0.0


class Measuring:
    """The measures of a problem.

    Args:
        model: The mechanism with all outputs.
        argument: What the samples go by.
        aims: Measures with values or limits.

    """

    def __init__(self, model: Model, argument: Argument, aims: Sequence[Aim]) -> None:
        self.model, self.argument, self.aims = model, argument, tuple(aims)
        self._readings = [_renamed(aim.reading, aim.name) for aim in aims]

    def values(self, parameters: Mapping[str, float]) -> FloatArray:
        """Return the measured values (aims,).

        Raises:
            KinfmuError: The design cannot be assembled, or a measure has no value.

        """
        found = _measured(self.model, self.argument, self._readings, parameters)
        return np.array([found[aim.name].value for aim in self.aims])

    def slopes(self, value_of: Callable[[FloatArray], Mapping[str, float]], z: FloatArray) -> FloatArray:
        """Return the derivatives of the values by the unknowns as parts of their ranges, (aims, n).

        value_of: The parameters of unknowns.
        """
        columns = []
        for k in range(len(z)):
            ends = []
            for side in (1.0, -1.0):
                moved = z.copy()
                moved[k] = min(max(z[k] + side * STEP, 0.0), 1.0)
                ends.append((moved[k], moved))
            (above, high), (below, low) = ends
            try:
                difference = self.values(value_of(high)) - self.values(value_of(low))
            except KinfmuError:  # at the edge of what can be assembled
                difference = np.zeros(len(self.aims))
            columns.append(difference / (above - below))
        return np.array(columns).T


def measuring_of(
    mechanism: Mechanism, argument: Argument, targets: Sequence[Target], constraints: Sequence[Constraint]
) -> Measuring | None:
    """Return the measures of targets and constraints; None if there are none.

    Raises:
        MechanismError: A name or a value is invalid.
        KinfmuError: The mechanism as written cannot be measured.

    """
    tables = [(f"[targets.{one.name}]", one) for one in targets if isinstance(one, MeasureTarget)]
    more = [(f"[constraints.{one.name}]", one) for one in constraints if _is_measured(one)]
    both: list[tuple[str, Any]] = [*tables, *more]
    if not both:
        return None
    readings = [_reading(where, one, mechanism) for where, one in both]
    plain = replace(mechanism, coordinates="all", measures=())
    model = compiled(plain)
    named = [_renamed(reading, one.name) for (_, one), reading in zip(both, readings, strict=True)]
    found = _measured(model, argument, named, {}, require=False)
    aims = []
    for (where, one), reading in zip(both, readings, strict=True):
        unit = found[one.name].unit
        quantity = Quantity("number") if unit == "1" else quantity_in(unit, mechanism.length_unit)
        limits = {
            key: None if (value := getattr(one, key, None)) is None else _number(where, key, value, quantity, mechanism)
            for key in ("value", "minimum", "maximum")
        }
        if all(value is None for value in limits.values()):
            raise MechanismError(f"{where} needs 'minimum' or 'maximum', or both")
        root = float(read_weights(f"{where} weight", one.weight, 1)[0]) ** 0.5
        aims.append(Aim(one.name, reading, **limits, root=root, unit=unit))
    return Measuring(model, argument, aims)


def _renamed(reading: Reading, name: str) -> Reading:
    return replace(reading, name=name)  # type: ignore[type-var]  # leaves are dataclasses


def _is_measured(one: Constraint) -> bool:
    return isinstance(one, MarginConstraint | MeasureConstraint)


def _number(where: str, key: str, value: object, quantity: Quantity, mechanism: Mechanism) -> float:
    return read_constant(f"{where} {key}", value, quantity, mechanism.length_unit)


def _reading(where: str, one: Any, mechanism: Mechanism) -> Reading:
    """Return the measure of a target or constraint."""
    if isinstance(one, MarginConstraint):
        return LowestMargin(one.name)
    if isinstance(one.of, Reading):
        return next(iter(replace(mechanism, measures=(one.of,)).measures))  # texts become numbers
    own = {reading.name: reading for reading in mechanism.measures}
    if one.of not in own:
        near = suggestion(one.of, own) if isinstance(one.of, str) else ""
        raise MechanismError(f"{where} of = {quoted(one.of)} is not a measure{near}; measures: {listed(own)}")
    return own[one.of]


def _measured(
    model: Model,
    argument: Argument,
    readings: Sequence[Reading],
    parameters: Mapping[str, float],
    *,
    require: bool = True,
) -> dict[str, Any]:
    """Measure a design over the motion; a driver moves at the speed of its law, if that is constant."""
    inputs = argument.keywords(argument.values(None, None, SAMPLES))
    if argument.input:
        law = model.mechanism.drivers[0].law
        speed = float(law.speed) if isinstance(law, ConstantSpeed) else 0.0
        inputs[model.mechanism.drivers[0].inputs()[1]] = speed or 1.0
    run = model.solve(parameters=parameters, anew=False, **inputs)
    found = measure(run, readings)
    missing = next((one for one in found.values() if one.reason), None)
    if require and missing is not None:
        raise KinfmuError(f"measure '{missing.name}' has no value: {missing.reason}")
    return dict(found)
