from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.mechanism.joints.joint import Joint
from kinfmu.mechanism.laws import Law
from kinfmu.mechanism.quantities import PoseQuantity
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.quantities.placement import Placement


@dataclass(frozen=True)
class Coupling(Joint):
    """One measured quantity follows another by a law: a gear train, a screw or an indexer.

        Phi = output - f(input)        (1 row, scale 1)

    After Haug (1989), relative constraints; quantities may be absolute too.
    """

    type: ClassVar[str] = "coupling"
    labels: ClassVar[tuple[str, ...]] = ("coupled",)

    name: str
    input: Annotated[PoseQuantity, "the independent quantity, such as the angle of a body"]
    output: Annotated[PoseQuantity, "the dependent quantity, such as the position of a point along an axis"]
    law: Annotated[Law, "f, in the unit of the output over that of the input"]

    @property
    def law_kinds(self) -> tuple[str, str]:
        """Kinds of the law's output and of its input."""
        return self.output.kind, self.input.kind

    @property
    def depends_on_origin(self) -> bool:
        return self.input.is_absolute or self.output.is_absolute

    def bodies(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys((*self.input.bodies(), *self.output.bodies())))

    def residual(self, at: Placement) -> tuple[Value, ...]:
        return (self.output.value(at) - self.law.at(self.input.value(at)),)

    def led_by(self, at: Placement) -> tuple[Law, Value]:
        return self.law, self.input.value(at)

    def kinds(self) -> tuple[str, ...]:
        return (self.output.kind,)

    def check(self) -> None:
        self.law.check(f"[joints.{self.name}]")
