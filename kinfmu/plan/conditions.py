"""Conditions: what numbers that follow from parameters must fulfil, where parameters are set without the file."""

from __future__ import annotations

from typing import Any, NamedTuple

from kinfmu.equations.graph import Node
from kinfmu.joints import Distance, Gear, RackAndPinion
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.places import Place, told
from kinfmu.plan.trace import Tracer
from kinfmu.units import Quantity

_POSITIVE = {(Distance, "length")}
_OTHER_THAN_ZERO = {(Gear, "ratio"), (RackAndPinion, "radius")}


class Condition(NamedTuple):
    """A number that must be positive, or other than 0: what messages call it, and its node, of parameters alone."""

    told: str
    node: Node
    is_positive: bool


def find_conditions(mechanism: Mechanism, tracer: Tracer) -> tuple[Condition, ...]:
    """The conditions on the numbers of a mechanism that are written as expressions; `check` looks at the others."""
    found: list[Condition] = []
    owners = {("joints", joint.name): joint for joint in mechanism.joints}
    laws = {("joints", name): getattr(joint, "law", None) for (_, name), joint in owners.items()}
    laws |= {("drivers", driver.name): driver.law for driver in mechanism.drivers}

    def look(place: Place, value: Any, _: Quantity) -> Any:
        if place not in mechanism.expressions or not isinstance(value, Node) or value.constant is not None:
            return value
        table, name, key, *path = place
        law = laws.get((str(table), str(name)))
        is_positive = key == "law" and law is not None and law.numbers()[tuple(path)].measures.is_positive
        owned = (type(owners.get((str(table), str(name)))), key)
        if is_positive or owned in _POSITIVE or owned in _OTHER_THAN_ZERO:
            found.append(Condition(told(place), value, owned not in _OTHER_THAN_ZERO))
        return value

    tracer.members.changed(look)
    return tuple(found)
