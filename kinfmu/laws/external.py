from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from kinfmu.laws.law import Law, Led
from kinfmu.measures.arithmetic import Value


@dataclass(frozen=True)
class External(Law):
    """No law: the value comes from outside, by the FMU's inputs; until then the driver stands still.

        u = start

    start: value as long as nothing comes.
    """

    type: ClassVar[str] = "external"

    start: Led = 0.0

    def target(self, x: Value, **constants: Value) -> Value:  # noqa: ARG002  it stands still
        return constants["start"]
