"""What in a mechanism file is hardly meant, although nothing forbids it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from kinfmu.drivers import DistanceDriver
from kinfmu.errors import listed
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.places import Place, told
from kinfmu.units import Quantity

_TURN = 2.0 * math.pi * (1.0 + 1e-9)  # [rad]; a whole turn may be meant


def file_notes(mechanism: Mechanism) -> Iterator[str]:
    """One line about parameters that stand nowhere, and one for each angle that looks like degrees without a unit.

    And one for each driven distance that begins below 0.
    """
    unused = mechanism.unused_parameters
    if unused:
        one = "changes" if len(unused) == 1 else "change"
        yield f"[parameters] {listed(unused)} {one} nothing: no number of the mechanism refers to it"
    for driver in mechanism.drivers:
        first = float(driver.law.at(mechanism.run.start))
        if isinstance(driver, DistanceDriver) and first < 0.0:
            yield (
                f"[drivers.{driver.name}] the distance is {first:.6g} {mechanism.length_unit} at the start of the run: "
                "it counts without its sign, and shrinks as the value grows"
            )
    large: list[tuple[Place, float]] = []

    def look(place: Place, value: Any, quantity: Quantity) -> Any:
        is_looked_at = quantity == Quantity("angle") and place[0] in ("bodies", "joints") and "law" not in place
        if is_looked_at and abs(value) > _TURN:
            large.append((place, float(value)))
        return value

    mechanism.members.changed(look)
    for place, value in large:
        yield (
            f"{told(place)} = {value:.6g} rad is {math.degrees(value):.6g} deg, more than a turn: "
            "a bare angle is in radians; degrees are written such as '60 deg'"
        )
