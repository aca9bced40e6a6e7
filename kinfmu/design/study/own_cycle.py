"""The cycle of a driver at each design's own speed, where the parameters of a study change the law of the driver."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.laws import ConstantSpeed
from kinfmu.mechanism.parameters import parameter_values
from kinfmu.motion.batch_reading import dependent_numbers


def law_changing(mechanism: Mechanism, names: Collection[str]) -> list[str]:
    """Return those of some parameters and law constants that change the law of a driver.

    Args:
        mechanism: The mechanism.
        names: Names of parameters and law constants.

    """
    constants = {constant.name for constant in mechanism.law_constants}

    def is_behind_law(name: str) -> bool:
        places = dependent_numbers(mechanism, [name])
        return name in constants or any(place[0] == "drivers" and "law" in place for place in places)

    return [name for name in names if is_behind_law(name)]


def own_cycles(
    mechanism: Mechanism, cycle: Mapping[str, FloatArray | float], designs: Mapping[str, FloatArray]
) -> dict[str, Any]:
    """Return the driver values (m, n) of one cycle at the start and the speed of each design, as `solve` takes them.

    Args:
        mechanism: The mechanism, with a single driver whose law is `constant_speed`.
        cycle: The cycle of the design as written: angles (n,) and speed, by input.
        designs: Arrays (m,) of the parameters and law constants that vary, by name.

    Returns:
        Angles and speeds; of a single design (n,) and a number.

    """
    (driver,) = mechanism.drivers
    law: Any = driver.law
    count = max(map(len, designs.values()))
    parameters = {name: values for name, values in designs.items() if name in mechanism.parameters}
    known = parameter_values(mechanism.parameters, parameters)
    own: dict[str, Any] = {}
    for key in ("start", "speed"):
        expression = mechanism.expressions.get(("drivers", driver.name, "law", key))
        written = getattr(law, key) if expression is None else expression.value(known)
        own[key] = np.broadcast_to(np.asarray(designs.get(f"{driver.name}.{key}", written), dtype=float), count)
    angle, speed, _ = driver.inputs()
    turned = np.asarray(cycle[angle]) - float(np.asarray(cycle[angle])[0])
    begin = own["start"] + own["speed"] * mechanism.run.start
    if count == 1:
        return {angle: begin[0] + turned, speed: float(own["speed"][0])}
    return {angle: begin[:, None] + turned, speed: np.repeat(own["speed"][:, None], len(turned), axis=1)}


def can_cycle(mechanism: Mechanism) -> bool:
    """Return whether the law of the only driver has a speed, at which each design can make its cycle."""
    return len(mechanism.drivers) == 1 and isinstance(mechanism.drivers[0].law, ConstantSpeed)
