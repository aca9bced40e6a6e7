"""Code of rows: the formulas of a joint or driver, and their gradients, as Python functions for searches."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

from kinfmu.mechanism.quantities.arithmetic import floor
from kinfmu.plan.equations.graph import Graph, Node, reachable
from kinfmu.solver.python.curve import curve

_SOURCES_KEPT = 256
_OPERATIONS = {"+": "{} + {}", "-": "{} - {}", "*": "{} * {}", "/": "{} / {}", "neg": "-{}"}
_CALLED = {"sin": math.sin, "cos": math.cos, "sqrt": math.sqrt, "atan2": math.atan2, "floor": floor, "curve": curve}


class RowCode(NamedTuple):
    """Functions of the coordinates [x, y, phi, ...] of the bodies of a joint or driver, and of its target.

    values: Returns Phi, a value per row. gradients: Returns Phi_q, row after row; it raises a ZeroDivisionError where a
    formula has no derivative.
    """

    values: Callable[[Sequence[float], float], tuple[float, ...]]
    gradients: Callable[[Sequence[float], float], tuple[float, ...]]


def row_code(residual: Callable[[Sequence[Node], Node], Sequence[Any]], count: int) -> RowCode:
    """Return the code of rows.

    Values are equal to the bit to those of the formulas, up to the sign of a zero.

    Args:
        residual: The rows, as a function of coordinates and target.
        count: Number of coordinates.

    """
    graph = Graph()
    coordinates = [graph.symbol(f"q{k}") for k in range(count)]
    rows = [graph.lift(row) for row in residual(coordinates, graph.symbol("u"))]
    one = graph.constant(1.0)
    columns = [graph.derivative(rows, {coordinate: one}) for coordinate in coordinates]
    return RowCode(
        _function(rows, count), _function([entry for row in zip(*columns, strict=True) for entry in row], count)
    )


def _function(results: Sequence[Node], count: int) -> Callable[[Sequence[float], float], tuple[float, ...]]:
    """Return a function of coordinates and target; numbers are arguments, so that joints of one type share a source."""
    names: dict[Node, str] = {}
    constants: list[Any] = []
    lines = []
    for node in reachable(results):
        if node.op == "symbol":
            names[node] = node.name
            continue
        if node.op == "constant":
            names[node] = f"c{len(constants)}"
            constants.append(node.constant)
            continue
        arguments = [names[argument] for argument in node.args]
        names[node] = f"t{node.id}"
        if node.op == "curve":
            data, order = node.curve
            arguments = [f"c{len(constants)}", str(order), *arguments]
            constants.append(data)
        text = (
            _OPERATIONS[node.op].format(*arguments) if node.op in _OPERATIONS else f"{node.op}({', '.join(arguments)})"
        )
        lines.append(f"    {names[node]} = {text}")
    unpacked = [*(f"q{k}" for k in range(count))], [f"c{k}" for k in range(len(constants))]
    found = "".join(f"{names[result]}, " for result in results)
    head = [f"    [{', '.join(names)}] = {given}" for names, given in zip(unpacked, ("q", "constants"), strict=True)]
    source = "\n".join(["def rows(q, u, constants):", *head, *lines, f"    return ({found})"])
    return _bound(_compiled(source), tuple(constants))


def _bound(
    rows: Callable[..., tuple[float, ...]], constants: tuple[Any, ...]
) -> Callable[[Sequence[float], float], tuple[float, ...]]:
    return lambda q, u: rows(q, u, constants)


@lru_cache(maxsize=_SOURCES_KEPT)
def _compiled(source: str) -> Callable[..., tuple[float, ...]]:
    namespace: dict[str, Any] = dict(_CALLED)
    exec(compile(source, "<rows of a joint>", "exec"), namespace)  # noqa: S102  our own text, without any of the file
    function: Callable[..., tuple[float, ...]] = namespace["rows"]
    return function
