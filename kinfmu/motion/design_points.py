"""Numbers of a mechanism that depend on the parameters in which designs differ, as arrays."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.parameters import in_order, parameter_values
from kinfmu.mechanism.quantities.arithmetic import Value, atan2_like, cos, sin, sqrt

sin.register(np.ndarray, np.sin)
cos.register(np.ndarray, np.cos)
sqrt.register(np.ndarray, np.sqrt)


@atan2_like.register
def _(like: np.ndarray, y: Value, x: Value) -> FloatArray:  # noqa: ARG001
    return np.asarray(np.arctan2(y, x))


def points_of_designs(mechanism: Mechanism, given: Mapping[str, FloatArray]) -> dict[str, tuple[Value, Value]]:
    """Return body-fixed coordinates of every point by 'body.point'.

    Args:
        mechanism: The mechanism as written.
        given: Arrays (m,) of parameters by name.

    Returns:
        Pairs of numbers; (m, 1) those that differ between designs.

    """
    with np.errstate(all="ignore"):  # designs without a solution may have any numbers
        known = parameter_values(mechanism.parameters, {name: array[:, None] for name, array in given.items()})
        points: dict[str, tuple[Value, Value]] = dict(mechanism.body_points)
        for place in dependent_numbers(mechanism, given):
            if place[0] == "bodies" and place[2] == "points":
                body, point, axis = str(place[1]), str(place[3]), place[4]
                pair = list(points[f"{body}.{point}"])
                pair[int(axis)] = mechanism.expressions[place].value(known)
                points[f"{body}.{point}"] = pair[0], pair[1]
    return points


def dependent_numbers(mechanism: Mechanism, given: Collection[str]) -> list[tuple[str | int, ...]]:
    """Return the paths of the numbers that change with parameters, directly or through other parameters."""
    parameters = mechanism.parameters
    expressions = {name: p.expression for name, p in parameters.items() if p.expression and name not in given}
    changing = set(given)
    for name in in_order(parameters, expressions):
        if name in expressions and changing.intersection(expressions[name].names):
            changing.add(name)
    return [place for place, expression in mechanism.expressions.items() if changing.intersection(expression.names)]
