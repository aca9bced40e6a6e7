"""The contract of a load: the quantities along which it acts, and its effort along each; efforts that follow a law."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Annotated, ClassVar

from kinfmu.errors import MechanismError
from kinfmu.mechanism.joints.joint import Condition
from kinfmu.mechanism.laws import External, Law
from kinfmu.mechanism.quantities import PoseQuantity
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.quantities.placement import Placement
from kinfmu.units import InputName

EFFORTS = {"length": "force", "angle": "torque"}  # what acts along a quantity of a kind


class Load(ABC):
    """A force or torque on bodies, other than gravity and drivers.

        Q = sum_k e_k ds_k/dq,   power = sum_k e_k ds_k/dt        (Q: generalized force)

    s_k are quantities of the pose, lengths or angles, and e_k the efforts along them: a force [N] or a torque [N m],
    positive if it enlarges s_k. A leaf is a frozen dataclass whose first field is `name`; its other fields are the keys
    of its table in a mechanism file. Its formulas are plain arithmetic without branches on values, so that they serve
    direct evaluation, derivative tests and generated code.
    """

    type: ClassVar[str]  # its name in mechanism files
    required: ClassVar[Mapping[str, str]] = {}  # 'positive' or '0 or more', by the keys of numbers
    columns: ClassVar[tuple[str, ...]] = ()  # of its effort and of its quantity in results, as nouns and quantities
    name: str

    @property
    def needs_direction(self) -> bool:
        """True if it acts along the line between two points: it has no value where they are in the same place."""
        return False

    @property
    def depends_on_origin(self) -> bool:
        """True if it depends on the place of the mechanism in the world."""
        return False

    @abstractmethod
    def bodies(self) -> tuple[str, ...]:
        """Return the names of the bodies in its formulas, each once, ground included."""

    @abstractmethod
    def acts_on(self) -> tuple[str, ...]:
        """Return the names of the bodies on which it acts, ground included."""

    @abstractmethod
    def measured(self, at: Placement) -> tuple[Value, ...]:
        """Return the quantities s_k [length, rad]."""

    @abstractmethod
    def kinds(self) -> tuple[str, ...]:
        """Return the kind of each quantity, 'length' or 'angle'."""

    @abstractmethod
    def efforts(self, at: Placement, s: Sequence[Value], sd: Sequence[Value], x: Value) -> tuple[Value, ...]:
        """Return the efforts [N, N m] along the quantities.

        Args:
            at: The pose.
            s: The quantities [m, rad].
            sd: Their rates [m/s, rad/s].
            x: Argument of its law or value of its input; unused without either.

        """

    def energy(self, s: Sequence[Value]) -> Value:  # noqa: ARG002  most loads store none
        """Return the potential energy [J]; s: the quantities [m, rad]."""
        return 0.0

    def argument(self, at: Placement) -> Value | None:  # noqa: ARG002  most loads have none
        """Return the argument of its law [length, rad]; None if this is the time, or it has no law."""
        return None

    def inputs(self) -> tuple[InputName, ...]:
        """Return the names of the inputs that give its effort, such as `wind_force`; most loads have none."""
        return ()

    def with_unit(self, length_unit: str) -> Load:  # noqa: ARG002  some loads have lengths
        """Return the load for a mechanism with this unit of length."""
        return self

    def check(self) -> None:
        """Raise a MechanismError for invalid values; numbers are finite and references valid by then."""
        for key, value, word in self.conditions():
            if not (value > 0.0 if word == "positive" else value >= 0.0):
                raise MechanismError(f"[loads.{self.name}] {key} = {float(value)!r} must be {word}")

    def conditions(self) -> tuple[Condition, ...]:
        """Return the conditions of `check` on numbers; they are tested again when parameters are set at run time."""
        return tuple(Condition(key, getattr(self, key), word) for key, word in self.required.items())

    def check_start(self, at: Placement) -> None:  # noqa: B027  most loads accept all poses
        """Raise a MechanismError for a start pose in which it is undefined."""


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
