"""OneSided: a law whose breaks count as the pieces on one side of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from kinfmu.arrays import FloatArray
from kinfmu.mechanism.laws import Law
from kinfmu.mechanism.laws.law import Constant
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.plan.equations.jets import Jet


@dataclass(frozen=True, eq=False)
class OneSided(Law):
    """A law at arguments that are jets, with the limits of its derivatives at breaks.

    law: the law; side: (n,) -1 where the limit is that from below, 1 from above.
    """

    type: ClassVar[str] = "one_sided"

    law: Law
    side: FloatArray

    def constants(self) -> dict[str, Constant]:
        return self.law.constants()

    def target(self, x: Value, **constants: Value) -> Value:
        found = self.law.target(replace(x, side=self.side) if isinstance(x, Jet) else x, **constants)
        return replace(found, side=None) if isinstance(found, Jet) else found
