from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from kinfmu.errors import MechanismError
from kinfmu.laws.law import Constant, Law, LawQuantity, Path
from kinfmu.measures.arithmetic import Value

HIGHEST_DEGREE = 20  # the value of a polynomial of a higher degree is mostly rounding error


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

    def numbers(self) -> dict[Path, Constant]:
        return {(f"c{k}",): Constant(c, LawQuantity("led", k)) for k, c in enumerate(self.coefficients)}

    def with_numbers(self, values: Mapping[Path, Any]) -> Polynomial:
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
