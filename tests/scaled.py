"""A mechanism once more in another size: every number in a place that measures a length, a speed of a slide, ..."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from kinfmu import Mechanism
from kinfmu.mechanism.members import NumberPath
from kinfmu.mechanism.operations import Dimension
from kinfmu.units import Quantity


def scaled(mechanism: Mechanism, factor: float) -> Mechanism:
    """The same mechanism `factor` times as large, at the same times; expressions are numbers in it.

    A factor that is a power of two changes no digit, any other leaves 15 decimal ones.
    """
    exact = math.frexp(factor)[0] == 0.5

    def larger(_: NumberPath, value: Any, quantity: Quantity) -> Any:
        power = int(Dimension.of(quantity).length)
        if value is None or isinstance(value, bool | int | str):
            return value
        product = float(value) * factor**power
        return product if exact else float(f"{product:.15g}")

    members = mechanism.members.changed(larger)
    return replace(
        mechanism,
        bodies=members.bodies,
        joints=members.joints,
        drivers=members.drivers,
        run=members.run,
        parameters={},
    )
