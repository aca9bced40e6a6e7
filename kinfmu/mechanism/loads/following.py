"""The contract of loads whose effort follows a law or an input."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from kinfmu.errors import MechanismError
from kinfmu.mechanism.laws import External, Law
from kinfmu.mechanism.loads.load import EFFORTS, Load
from kinfmu.mechanism.quantities import PoseQuantity
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.quantities.placement import Placement
from kinfmu.units import InputName

Over = Annotated[PoseQuantity | None, "the quantity x over which the law is given, such as an angle; default: time"]


class Following(Load):
    """A load whose effort follows a law over time or over a quantity of the pose, or an input.

        e = f(x)

    Leaves have the fields `law` and `over`, and define along what they act.
    """

    law: Law
    over: PoseQuantity | None

    @property
    def noun(self) -> str:
        """What it applies: 'force' or 'torque'."""
        return EFFORTS[self.kinds()[0]]

    @property
    def law_kinds(self) -> tuple[str, str]:
        """Kinds of the law's output and of its input."""
        return self.noun, self.over.kind if self.over else "time"

    @property
    def depends_on_origin(self) -> bool:
        return self.over is not None and self.over.is_absolute

    def frames(self) -> tuple[str, ...]:
        """Return the names of bodies with which its direction turns."""
        return ()

    def bodies(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys((*self.acts_on(), *self.frames(), *(self.over.bodies() if self.over else ()))))

    def argument(self, at: Placement) -> Value | None:
        return self.over.value(at) if self.over else None

    def inputs(self) -> tuple[InputName, ...]:
        return (InputName(self.name, self.noun),) if isinstance(self.law, External) else ()

    def effort(self, x: Value) -> Value:
        """Return the force [N] or torque [N m] at an argument of the law, or of an input."""
        return x if isinstance(self.law, External) else self.law.at(x)

    def efforts(self, at: Placement, s: Sequence[Value], sd: Sequence[Value], x: Value) -> tuple[Value, ...]:  # noqa: ARG002
        return (self.effort(x),)

    def check(self) -> None:
        where = f"[loads.{self.name}]"
        self.law.check(where)
        if isinstance(self.law, External) and self.over is not None:
            raise MechanismError(
                f"{where} over: an input gives the {self.noun}, as the law is 'external'; remove 'over'"
            )
