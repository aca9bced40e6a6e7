"""The contract of a joint: one formula, everything else follows."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, NamedTuple

from kinfmu.measures.arithmetic import Value
from kinfmu.measures.measure import Measure
from kinfmu.measures.placement import Placement


class Condition(NamedTuple):
    """What a number of a joint must be; it may follow from parameters, so it is in any arithmetic.

    key: how messages call it; required: 'positive', 'other than 0' or '0' (to NEARLY).
    """

    key: str
    value: Value
    required: str


class Joint(ABC):
    """Constraint rows Phi(q) = 0 between bodies.

    A leaf is a frozen dataclass whose first field is `name`; its other fields are the keys of its table in a mechanism
    file, and their annotations say how the reader checks them. `residual` is plain arithmetic without branches on
    values, so that one formula serves direct evaluation, derivative tests, arrays and generated code.
    """

    type: ClassVar[str]  # how mechanism files call it
    labels: ClassVar[tuple[str, ...]]  # one word a row, such as "x"
    name: str

    @property
    def depends_on_origin(self) -> bool:
        """True if it depends on where the world's origin lies and `moved` cannot make up for it."""
        return False

    @abstractmethod
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies that the rows touch, ground included."""

    @abstractmethod
    def residual(self, at: Placement) -> tuple[Value, ...]:
        """Phi, one value a row; zero where the joint holds."""

    def check(self) -> None:  # noqa: B027  most joints take any values
        """Raise a MechanismError for values that cannot be meant; numbers are finite and references valid by then."""

    def conditions(self) -> tuple[Condition, ...]:
        """What `check` asks of numbers alone: where parameters are set without the file, it is asked again."""
        return ()

    def moved(self, dx: float, dy: float) -> Joint:  # noqa: ARG002  absolute joints depend on it
        """The joint when the whole mechanism stands elsewhere; the same unless it is absolute."""
        return self

    def reach(self) -> float:
        """The largest length that it holds by itself [length]: what the size of a mechanism counts besides bodies."""
        return 0.0

    def scales(self) -> tuple[float, ...]:
        """Residual per unit of the row's kind, one a row: |residual| / scale is the gap, to first order."""
        return (1.0,) * len(self.labels)

    def gaps(self, residual: tuple[float, ...]) -> tuple[float, ...]:
        """By how much each row is open, in the mechanism's unit of length or in radians."""
        return tuple(r / scale for r, scale in zip(residual, self.scales(), strict=True))

    def kinds(self) -> tuple[str, ...]:
        """'length' or 'angle', one a row: what its gap is."""
        return ("length",) * len(self.labels)


class Held(Joint):
    """One measured quantity, held at a value.

    Phi = measure - value, or what the measure has in its place        (1 row)
    """

    @abstractmethod
    def measured(self) -> tuple[Measure, float]:
        """The measure and the value at which it is held."""

    def bodies(self) -> tuple[str, ...]:
        return self.measured()[0].bodies()

    def residual(self, at: Placement) -> tuple[Value, ...]:
        measure, value = self.measured()
        return (measure.row(at, value),)

    def reach(self) -> float:
        """The largest length that it holds by itself [length]: what the size of a mechanism counts besides bodies."""
        return 0.0

    def scales(self) -> tuple[float, ...]:
        measure, value = self.measured()
        return (measure.scale(value),)

    def gaps(self, residual: tuple[float, ...]) -> tuple[float, ...]:
        measure, value = self.measured()
        return (measure.gap(residual[0], value),)

    def kinds(self) -> tuple[str, ...]:
        return (self.measured()[0].kind,)
