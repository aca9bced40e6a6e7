"""Which points and numbers of a mechanism depend on which of its parameters."""

from __future__ import annotations

from typing import Any

from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.expression import Expression
from kinfmu.mechanism.joints.joint import Joint
from kinfmu.mechanism.members import NumberPath


def dependent_points(mechanism: Mechanism) -> dict[str, list[str]]:
    """Return for each parameter the points 'body.point' whose coordinates depend on it."""
    found: dict[str, list[str]] = {}
    for place, expression in mechanism.expressions.items():
        if place[0] != "bodies" or place[2] != "points":
            continue
        for name in parameters_behind(mechanism, expression):
            point = f"{place[1]}.{place[3]}"
            if point not in found.setdefault(name, []):
                found[name].append(point)
    return found


def parameters_of(mechanism: Mechanism, joint: Joint, key: str = "") -> list[str]:
    """Return the parameters on which numbers of a joint depend, or only the number of a key."""
    path = ("joints", joint.name, key) if key else ("joints", joint.name)
    found = [one for place, one in mechanism.expressions.items() if place[: len(path)] == path]
    return sorted({name for expression in found for name in parameters_behind(mechanism, expression)})


def number_data(mechanism: Mechanism, path: NumberPath, value: float) -> dict[str, Any]:
    """Return a number of the file, the parameters on which it depends, and that one which is its whole expression."""
    expression = mechanism.expressions.get(path)
    names = sorted(parameters_behind(mechanism, expression)) if expression else []
    alone = expression.alone if expression and names == [expression.alone] else None
    return {"value": value, "names": names, "alone": alone}


def parameters_behind(mechanism: Mechanism, expression: Expression) -> set[str]:
    """Return the parameters on which an expression depends."""
    names, seen = list(expression.names), set()
    while names:
        name = names.pop()
        if name not in seen:
            seen.add(name)
            other = mechanism.parameters[name].expression
            names += other.names if other else ()
    return seen
