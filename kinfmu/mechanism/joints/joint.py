"""The contract of a joint: one formula, from which everything else follows."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, NamedTuple

from kinfmu.mechanism.laws import Law
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.quantities.placement import Placement


class Condition(NamedTuple):
    """A condition on a number of a joint, which may depend on parameters and so be of any arithmetic.

    key: its name in messages; required: 'positive', '0 or more', 'other than 0' or '0' (within `NEARLY`).
    """

    key: str
    value: Value
    required: str


class Joint(ABC):
    """Constraint rows Phi(q) = 0 between bodies.

    A leaf is a frozen dataclass whose first field is `name`; its other fields are the keys of its table in a mechanism
    file, and their annotations define values and meanings. `residual` is plain arithmetic without branches on
    values, so that one formula serves direct evaluation, derivative tests, arrays and generated code.
    """

    type: ClassVar[str]  # its name in mechanism files
    labels: ClassVar[tuple[str, ...]]  # one word per row, such as "x"
    name: str

    @property
    def depends_on_origin(self) -> bool:
        """True if it depends on the world's origin and `moved` cannot correct for a shift."""
        return False

    @abstractmethod
    def bodies(self) -> tuple[str, ...]:
        """Return the names of the bodies in its rows, ground included."""

    @abstractmethod
    def residual(self, at: Placement) -> tuple[Value, ...]:
        """Return Phi, one value per row; zero where the joint holds."""

    def led_by(self, at: Placement) -> tuple[Law, Value] | None:  # noqa: ARG002  most joints have none
        """Return the law that the joint follows, with its argument at a pose; None if it has no law."""
        return None

    def check(self) -> None:  # noqa: B027  most joints accept all values
        """Raise a MechanismError for invalid values; numbers are finite and references valid by then."""

    def conditions(self) -> tuple[Condition, ...]:
        """Return the conditions of `check` on numbers; they are tested again when parameters are set at run time."""
        return ()

    def moved(self, dx: float, dy: float) -> Joint:  # noqa: ARG002  absolute joints depend on it
        """Return the joint for a mechanism shifted by (dx, dy); the same unless it is absolute."""
        return self

    def reach(self) -> float:
        """Return the largest length in its own numbers [length], which counts for the size of the mechanism."""
        return 0.0

    def scales(self) -> tuple[float, ...]:
        """Return residual per unit of the row's kind, one per row: |residual| / scale is the gap, to first order."""
        return (1.0,) * len(self.labels)

    def gaps(self, residual: tuple[float, ...]) -> tuple[float, ...]:
        """Return the gap of each row, in the mechanism's unit of length or in radians."""
        return tuple(r / scale for r, scale in zip(residual, self.scales(), strict=True))

    def kinds(self) -> tuple[str, ...]:
        """Return the kind of each row's gap, 'length' or 'angle'."""
        return ("length",) * len(self.labels)
