"""Conditions on numbers that follow from parameters, for parameters set at run time."""

from __future__ import annotations

from typing import Any, NamedTuple

from kinfmu.equations.graph import Node
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.members import NumberPath, path_text
from kinfmu.plan.trace import Tracer
from kinfmu.units import Quantity


class PlanCondition(NamedTuple):
    """A condition on a number: its name in messages, its node (of parameters alone), and what is required."""

    label: str
    node: Node
    required: str


def find_conditions(mechanism: Mechanism, tracer: Tracer) -> tuple[PlanCondition, ...]:
    """Return the conditions on numbers written as expressions; others are checked when the file is read."""
    found = [
        PlanCondition(f"[joints.{joint.name}] {key}", value, required)
        for joint in tracer.joints
        for key, value, required in joint.conditions()
        if isinstance(value, Node) and value.constant is None
    ]
    laws = {("joints", joint.name): getattr(joint, "law", None) for joint in mechanism.joints}
    laws |= {("drivers", driver.name): driver.law for driver in mechanism.drivers}

    def look(place: NumberPath, value: Any, _: Quantity) -> Any:
        if place in mechanism.expressions and isinstance(value, Node) and value.constant is None:
            table, name, key, *path = place
            law = laws.get((str(table), str(name)))
            if key == "law" and law is not None and law.numbers()[tuple(path)].measures.is_positive:
                found.append(PlanCondition(path_text(place), value, "positive"))
        return value

    tracer.members.changed(look)
    return tuple(found)
