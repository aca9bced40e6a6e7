from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.laws.law import Law, Led
from kinfmu.measures.arithmetic import Value


@dataclass(frozen=True)
class External(Law):
    """No law: the value comes from the inputs of the FMU; without inputs the driver is at rest.

        u = start

    Only drivers can have this law.
    """

    type: ClassVar[str] = "external"

    start: Annotated[Led, "value without inputs"] = 0.0

    def target(self, x: Value, **constants: Value) -> Value:  # noqa: ARG002  it stands still
        return constants["start"]
