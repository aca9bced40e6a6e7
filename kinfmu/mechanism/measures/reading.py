"""The contract of a reading: one number that a designer reads off a motion, declared in `[measures]`.

A reading is a formula in the words of a motion: histories of quantities, their extremes, crossings and derivatives. The
package `kinfmu.motion` computes these on arrays; this package only declares the readings, as a mechanism file holds
them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Annotated, Any, ClassVar, NamedTuple

from kinfmu.mechanism.laws import LawQuantity
from kinfmu.mechanism.quantities import PoseQuantity
from kinfmu.units import Quantity

Motion = Any  # kinfmu.motion.Motion, which is made of numpy's arrays; this package uses the standard library only
PerDesign = Any  # (...) an array with one number per design

Measured = Annotated[
    str | PoseQuantity,
    "a coordinate such as 'rocker.phi' or its rate, or a quantity such as a distance or a relative angle; of extremes "
    "also a force such as 'crank.torque'",
]
Begin = Annotated[float | None, LawQuantity("argument"), "value of the driver where the part of the motion begins"]
End = Annotated[float | None, LawQuantity("argument"), "value of the driver at the end of the part"]


class Finding(NamedTuple):
    """What a reading found.

    value: numbers (...). quantity: what they measure. at: arguments of the motion where they occur. lacks: why designs
    whose samples all have numbers have no value: True for these designs (...), and the reason.
    """

    value: PerDesign
    quantity: Quantity
    at: tuple[PerDesign, ...] = ()
    lacks: tuple[tuple[PerDesign, str], ...] = ()


class Reading(ABC):
    """One number of a motion.

    A leaf is a frozen dataclass whose first field is `name`; its other fields are the keys of its table in a mechanism
    file. `begin` and `end` choose a part of the motion by values of the driver.
    """

    type: ClassVar[str]  # its name in mechanism files
    counted_from: ClassVar[str] = ""  # what its value is a deviation from, where that is not 0
    reads_forces: ClassVar[bool] = False  # True if `of` may be a force
    reads_points: ClassVar[bool] = False  # True if `of` may be a point of a body
    compares_rates: ClassVar[bool] = False  # with each other: geometry, which does not depend on the driver's speed
    name: str
    begin: float | None = None
    end: float | None = None

    @abstractmethod
    def read(self, motion: Motion) -> Finding:
        """Return the numbers of a motion; NaN for designs without them."""

    def quantities(self) -> tuple[str | PoseQuantity, ...]:
        """Return what it reads of a motion: quantities, and names of coordinates, points and forces."""
        return tuple(value for key in ("of", "to") if (value := getattr(self, key, None)) is not None)

    def check(self) -> None:  # noqa: B027  most readings accept all values
        """Raise a MechanismError for invalid values; numbers are finite and references valid by then."""
