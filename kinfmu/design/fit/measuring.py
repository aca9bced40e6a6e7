"""Measures of the motion with values to reach or limits to keep, and their derivatives by central differences."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.design.fit.argument import Argument
from kinfmu.design.fit.targets import (
    Constraint,
    MarginConstraint,
    MeasureConstraint,
    MeasureTarget,
    Target,
    read_weights,
)
from kinfmu.errors import KinfmuError, MechanismError, valid_names
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.laws import ConstantSpeed
from kinfmu.mechanism.measures import LowestMargin, Reading, TransmissionAngle
from kinfmu.mechanism.measures.transfer import TransmissionSide
from kinfmu.mechanism.number import read_constant
from kinfmu.mechanism.valid import quoted
from kinfmu.motion import measure_designs
from kinfmu.run.model import Model
from kinfmu.run.model import compile as compiled
from kinfmu.units import Quantity, quantity_in

SAMPLES = 361  # of the motion that is measured
STEP = 1e-5  # of the range of an unknown, half of a central difference; error: some 1e-9 of the derivative


@dataclass(frozen=True)
class Aim:
    """A measure with the value it shall have, or its limits.

    Attributes:
        name: Name under which it is measured.
        owner: Name of the target or constraint.
        reading: What is measured.
        value: The value it shall have; None: it has limits.
        minimum: Lowest valid value; None: none.
        maximum: Highest valid value; None: none.
        root: Square root of the weight.
        unit: Unit of all values.

    """

    name: str
    owner: str
    reading: Reading
    value: float | None
    minimum: float | None
    maximum: float | None
    root: float
    unit: str

    @property
    def size(self) -> float:
        """The larger limit without its sign, of which a violation is a part; 1 if it is 0."""
        return max(abs(limit) for limit in (self.minimum, self.maximum, 0.0) if limit is not None) or 1.0

    def excess(self, found: float) -> tuple[float, float]:
        """Return by how much the nearer limit is exceeded, negative within the limits, and its derivative: 1 or -1."""
        low = -math.inf if self.minimum is None else self.minimum - found
        high = -math.inf if self.maximum is None else found - self.maximum
        return (low, -1.0) if low > high else (high, 1.0)


class Measuring:
    """The measures of a problem.

    model: The mechanism with the outputs that the measures need. inputs: What moves it, as arguments of `Model.solve`.
    aims: Measures with values or limits.
    """

    def __init__(self, model: Model, inputs: Mapping[str, Any], aims: Sequence[Aim]) -> None:
        self.model, self.inputs, self.aims = model, inputs, tuple(aims)

    def on(self, engine: str) -> Measuring:
        """Return the same measures of motions that another engine solves."""
        return Measuring(Model(self.model.plan, engine), self.inputs, self.aims)

    def values(self, parameters: Mapping[str, float]) -> FloatArray:
        """Return the measured values (aims,).

        Raise a KinfmuError if the design cannot be assembled, or a measure has no value.
        """
        reasons: dict[int, str] = {}
        found = self._measured({name: np.array([value]) for name, value in parameters.items()}, self.aims, reasons)
        for aim, value in zip(self.aims, found[:, 0], strict=True):
            if not np.isfinite(value):
                reason = reasons.get(0, "some samples are not reached")
                raise KinfmuError(f"measure '{aim.owner}' has no value: {reason}")
        return found[:, 0]

    def slopes(
        self, parameters_of: Callable[[FloatArray], Mapping[str, float]], z: FloatArray, aims: Sequence[Aim]
    ) -> FloatArray:
        """Return the derivatives of some values by the unknowns as parts of their ranges, (aims, n).

        parameters_of: The parameters of unknowns.
        """
        steps = np.minimum(z + STEP, 1.0), np.maximum(z - STEP, 0.0)
        moved = [np.where(np.eye(len(z), dtype=bool)[k], step, z) for k in range(len(z)) for step in steps]
        designs = [parameters_of(one) for one in moved]
        values = self._measured({name: np.array([one[name] for one in designs]) for name in designs[0]}, aims)
        slopes = (values[:, 0::2] - values[:, 1::2]) / (steps[0] - steps[1])
        return np.asarray(np.nan_to_num(slopes))  # 0 at the edge of what can be assembled

    def _measured(
        self, parameters: Mapping[str, FloatArray], aims: Sequence[Aim], reasons: dict[int, str] | None = None
    ) -> FloatArray:
        """Return the values (aims, m) of designs; NaN where there is none, for the reasons that are added by design."""
        readings = [_renamed(aim.reading, aim.name) for aim in aims]
        table = measure_designs(self.model, parameters, readings, anew=False, **self.inputs)
        if reasons is not None:
            reasons |= table.reasons
        return np.array([table.values[aim.name] for aim in aims])


def measuring_of(
    mechanism: Mechanism, argument: Argument, targets: Sequence[Target], constraints: Sequence[Constraint]
) -> Measuring | None:
    """Return the measures of targets and constraints; None if there are none.

    Raise a MechanismError if a name or a value is invalid, another KinfmuError if the mechanism cannot be measured.
    """
    tables = [(f"[targets.{one.name}]", one) for one in targets if isinstance(one, MeasureTarget)]
    measured = (MarginConstraint, MeasureConstraint)
    more = [(f"[constraints.{one.name}]", one) for one in constraints if isinstance(one, measured)]
    both: list[tuple[str, Any]] = [*tables, *more]
    if not both:
        return None
    readings = [_reading(where, one, mechanism) for where, one in both]
    named = [_renamed(reading, one.name) for (_, one), reading in zip(both, readings, strict=True)]
    model = compiled(replace(mechanism, coordinates="all", measures=()))
    inputs = _inputs(model, argument)
    units = measure_designs(model, {}, named, **inputs).units
    aims: list[Aim] = []
    for (where, one), reading in zip(both, readings, strict=True):
        unit = units[one.name]
        quantity = Quantity("number") if unit == "1" else quantity_in(unit, mechanism.length_unit)
        given = {key: getattr(one, key, None) for key in ("value", "minimum", "maximum")}
        limits = {
            key: None if value is None else read_constant(f"{where} {key}", value, quantity, mechanism.length_unit)
            for key, value in given.items()
        }
        if all(value is None for value in limits.values()):
            raise MechanismError(f"{where} needs 'minimum' or 'maximum', or both")
        low, high = limits["minimum"], limits["maximum"]
        if low is not None and high is not None and low > high:
            raise MechanismError(
                f"{where} minimum = {quoted(one.minimum)} is above maximum = {quoted(one.maximum)}: no value is valid"
            )
        if isinstance(one, MarginConstraint) and not 0.0 < (limits["minimum"] or 0.0) < 1.0:
            raise MechanismError(
                f"{where} minimum = {quoted(one.minimum)} must be between 0 and 1, as 1 / condition is"
            )
        root = float(read_weights(f"{where} weight", one.weight, 1)[0]) ** 0.5
        for part in _parts(reading, limits["value"], limits["minimum"]):
            aims.append(Aim(f"measure_{len(aims)}", one.name, part, **limits, root=root, unit=unit))
    return Measuring(model, inputs, aims)


def _parts(reading: Reading, value: float | None, minimum: float | None) -> Iterable[Reading]:
    """Yield what is measured for a target or constraint: both sides of a transmission angle with a highest value.

    An optimum often has equal deviations on both sides, where their maximum has no derivatives.
    """
    if value is not None or minimum is not None or not isinstance(reading, TransmissionAngle):
        yield reading
        return
    first, second = reading.coupler
    for coupler in ((first, second), (second, first)):
        yield TransmissionSide(reading.name, coupler, reading.output, reading.begin, reading.end)


def _renamed(reading: Reading, name: str) -> Reading:
    return replace(reading, name=name)  # type: ignore[type-var]  # leaves are dataclasses


def _reading(where: str, one: Any, mechanism: Mechanism) -> Reading:
    """Return the measure of a target or constraint."""
    if isinstance(one, MarginConstraint):
        return LowestMargin(one.name)
    if isinstance(one.of, Reading):
        return next(iter(replace(mechanism, measures=(one.of,)).measures))  # texts become numbers
    own = {reading.name: reading for reading in mechanism.measures}
    if one.of not in own:
        raise MechanismError(f"{where} of = {quoted(one.of)} is not a measure{valid_names(one.of, own, 'measures')}")
    return own[one.of]


def _inputs(model: Model, argument: Argument) -> dict[str, Any]:
    """Return the motion that is measured: a turn of the driver if the mechanism as written makes one, else its run.

    The driver turns at the speed of its law, if that is constant.
    """
    if not (argument.input and argument.is_turn):
        return {}
    inputs = argument.keywords(argument.values(None, None, SAMPLES))
    if not model.solve(**inputs).good.all():
        return {}
    (driver,) = model.mechanism.drivers
    speed = float(driver.law.speed) if isinstance(driver.law, ConstantSpeed) else 0.0
    return {**inputs, driver.inputs()[1]: speed or 1.0}
