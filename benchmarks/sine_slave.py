"""The least that a pythonfmu FMU with 15 outputs can do. A script for pythonfmu's builder."""

from math import cos, sin
from typing import Any

from pythonfmu import Fmi2Causality, Fmi2Slave, Real

OUTPUT_COUNT = 15


class SineSlave(Fmi2Slave):  # type: ignore[misc]  # pythonfmu carries no types
    """y0, y2, ... = sin(u); y1, y3, ... = cos(u), written the way pythonfmu's examples are."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.u = 0.0
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        for k in range(OUTPUT_COUNT):
            setattr(self, f"y{k}", 0.0)
            self.register_variable(Real(f"y{k}", causality=Fmi2Causality.output))

    def do_step(self, current_time: float, step_size: float) -> bool:  # noqa: ARG002  # pythonfmu calls it so
        s, c = sin(self.u), cos(self.u)
        self.y0 = self.y2 = self.y4 = self.y6 = self.y8 = self.y10 = self.y12 = self.y14 = s
        self.y1 = self.y3 = self.y5 = self.y7 = self.y9 = self.y11 = self.y13 = c
        return True
