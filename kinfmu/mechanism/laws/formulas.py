"""Laws that are one formula: a constant, uniform motion, polynomial, harmonic motion; and External, for inputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from kinfmu.errors import MechanismError
from kinfmu.mechanism.laws.law import (
    NEARLY,
    RISE_STEPS,
    TURN,
    Constant,
    ConstantPath,
    Frequency,
    Law,
    LawQuantity,
    Led,
    LedRate,
    Phase,
)
from kinfmu.mechanism.quantities.arithmetic import Value, sine_of_line, sqrt

HIGHEST_DEGREE = 20  # the value of a polynomial of a higher degree is mostly rounding error


@dataclass(frozen=True)
class ConstantSpeed(Law):
    """Uniform motion.

        u = start + speed x

    x: time of a driver, angle of a cam, input of a coupling.
    """

    type: ClassVar[str] = "constant_speed"

    start: Annotated[Led, "value at x = 0"] = 0.0
    speed: Annotated[LedRate, "rate, such as [rad/s] or [length/s], by the driven quantity"] = 1.0

    def target(self, x: Value, **constants: Value) -> Value:
        return constants["start"] + constants["speed"] * x


@dataclass(frozen=True)
class ConstantValue(Law):
    """A constant.

        u = level

    For loads, and for drivers that stay where they are.
    """

    type: ClassVar[str] = "constant"

    level: Annotated[Led, "the value"]

    def target(self, x: Value, **constants: Value) -> Value:  # noqa: ARG002  it is the same for all
        return constants["level"]

    def why_not_periodic(self) -> str:
        return ""


@dataclass(frozen=True)
class Polynomial(Law):
    """A polynomial.

        u = c0 + c1 x + c2 x^2 + ...

    The coefficients are constants named c0, c1, ...
    """

    type: ClassVar[str] = "polynomial"

    coefficients: Annotated[tuple[float, ...], "(c0, c1, ...), c_k in the unit of u per x^k"]

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficients", tuple(self.coefficients))

    def numbers(self) -> dict[ConstantPath, Constant]:
        return {(f"c{k}",): Constant(c, LawQuantity("led", k)) for k, c in enumerate(self.coefficients)}

    def with_numbers(self, values: Mapping[ConstantPath, Any]) -> Polynomial:
        return Polynomial(tuple(values.get((f"c{k}",), c) for k, c in enumerate(self.coefficients)))

    def target(self, x: Value, **constants: Value) -> Value:
        *lower, value = (constants[f"c{k}"] for k in range(len(self.coefficients)))
        for c in reversed(lower):
            value = value * x + c
        return value

    def check(self, where: str) -> None:
        if not 1 <= len(self.coefficients) <= HIGHEST_DEGREE + 1:
            raise MechanismError(
                f"{where} coefficients: {len(self.coefficients)} numbers; "
                f"they must be 1 to {HIGHEST_DEGREE + 1}, [c0, c1, ...]"
            )

    def why_not_periodic(self) -> str:
        return "" if not any(self.coefficients[1:]) else super().why_not_periodic()


@dataclass(frozen=True)
class Harmonic(Law):
    """A harmonic motion.

        u = start + amplitude sin(frequency x + phase)

    Periodic over a turn of x if `frequency` is a whole number.
    """

    type: ClassVar[str] = "harmonic"

    amplitude: Annotated[Led, "half of the peak-to-peak stroke"]
    frequency: Annotated[Frequency, "[rad] per unit of x, over time also in Hz"]
    start: Annotated[Led, "middle of the motion"] = 0.0
    phase: Annotated[Phase, "[rad]"] = 0.0

    def target(self, x: Value, **constants: Value) -> Value:
        return constants["start"] + constants["amplitude"] * sine_of_line(constants["frequency"], x, constants["phase"])

    def fewest_steps(self, x: Value, **constants: Value) -> Value:
        return 2.0 * RISE_STEPS / TURN * constants["frequency"] * x

    def most_steps(self, **constants: Value) -> Value:
        return 2.0 * RISE_STEPS / TURN * sqrt(constants["frequency"] * constants["frequency"])

    @property
    def period(self) -> float:
        return TURN / abs(self.frequency) if self.frequency else 0.0

    def why_not_periodic(self) -> str:
        if abs(self.frequency - round(self.frequency)) <= NEARLY:
            return ""
        return f"frequency = {float(self.frequency)!r} must be a whole number of waves in a turn"


@dataclass(frozen=True)
class External(Law):
    """No law: the value comes from the inputs of the FMU; without inputs it is constant.

        u = start

    Only drivers and loads can have this law.
    """

    type: ClassVar[str] = "external"

    start: Annotated[Led, "value without inputs"] = 0.0

    def target(self, x: Value, **constants: Value) -> Value:  # noqa: ARG002  it stands still
        return constants["start"]
