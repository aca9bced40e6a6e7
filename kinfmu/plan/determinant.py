"""The determinant of a small block as a formula, such as `sin(coupler.phi - rocker.phi)`."""

from __future__ import annotations

from collections.abc import Mapping

from kinfmu.plan.block import Block
from kinfmu.plan.equations.graph import Node, reachable

Frequencies = tuple[tuple[str, int], ...]  # angle -> multiple, the argument of a sine or cosine
_Terms = dict[tuple[str, Frequencies], float]  # ('sin' or 'cos', argument) -> coefficient


def determinant_formula(block: Block, parameters: Mapping[str, float] | None = None) -> str | None:
    """Return det J of a 1 x 1 or 2 x 2 block as a sum of sines and cosines of sums of angles.

    Products become sums (sin a cos b = (sin(a + b) + sin(a - b)) / 2), so that equal formulas are equal texts.

    Args:
        block: The block.
        parameters: Values of the parameters, by the names of their symbols.

    Returns:
        The formula, or None if det J is no such sum.

    """
    jacobian = block.jacobian
    if len(jacobian) != len(block.unknowns) or len(jacobian) not in (1, 2):
        return None
    if len(jacobian) == 1:
        node = jacobian[0][0]
    else:
        node = jacobian[0][0] * jacobian[1][1] - jacobian[0][1] * jacobian[1][0]
    terms = _harmonics(node, parameters or {})
    return None if terms is None else _text(terms)


def _harmonics(root: Node, parameters: Mapping[str, float]) -> _Terms | None:
    values: dict[Node, _Terms] = {}
    angles: dict[Node, Mapping[str, int]] = {}
    for node in reachable([root]):
        if node.op == "constant":
            values[node] = {("cos", ()): float(node.constant or 0.0)}
        elif node.op == "symbol" and node.name in parameters:
            values[node] = {("cos", ()): parameters[node.name]}
        elif node.coordinate is not None and node.coordinate.is_angle:
            angles[node] = {node.name: 1}
        elif node.op in ("sin", "cos") and node.args[0] in angles:
            values[node] = {(node.op, tuple(angles[node.args[0]].items())): 1.0}
        elif node.op in ("+", "-", "*", "neg") and all(arg in values for arg in node.args):
            parts = [values[arg] for arg in node.args]
            if node.op == "*":
                values[node] = _product(*parts)
            elif node.op == "neg":
                values[node] = _sum({}, parts[0], -1.0)
            else:
                values[node] = _sum(parts[0], parts[1], 1.0 if node.op == "+" else -1.0)
    return values.get(root)


def _sum(a: _Terms, b: _Terms, factor: float) -> _Terms:
    total = dict(a)
    for key, coefficient in b.items():
        total[key] = total.get(key, 0.0) + factor * coefficient
    return {key: coefficient for key, coefficient in total.items() if abs(coefficient) > 1e-14}


def _product(a: _Terms, b: _Terms) -> _Terms:
    total: _Terms = {}
    for (f, x), p in a.items():
        for (g, y), q in b.items():
            half = 0.5 * p * q
            if f == g:  # cos cos = (cos(x-y) + cos(x+y)) / 2, sin sin = (cos(x-y) - cos(x+y)) / 2
                total = _sum(total, _term("cos", x, y, -1), half)
                total = _sum(total, _term("cos", x, y, 1), half if f == "cos" else -half)
            else:  # sin x cos y = (sin(x+y) + sin(x-y)) / 2
                s, c = (x, y) if f == "sin" else (y, x)
                total = _sum(total, _term("sin", s, c, 1), half)
                total = _sum(total, _term("sin", s, c, -1), half)
    return total


def _term(function: str, x: Frequencies, y: Frequencies, sign: int) -> _Terms:
    """Return one sine or cosine of x + sign y; the first multiple in its argument is positive."""
    argument = dict(x)
    for name, multiple in y:
        argument[name] = argument.get(name, 0) + sign * multiple
    items = tuple(sorted((name, multiple) for name, multiple in argument.items() if multiple))
    if not items:
        return {("cos", ()): 1.0} if function == "cos" else {}
    if items[0][1] < 0:
        items = tuple((name, -multiple) for name, multiple in items)
        return {(function, items): -1.0 if function == "sin" else 1.0}
    return {(function, items): 1.0}


def _text(terms: _Terms) -> str:
    words = []
    for (function, argument), coefficient in sorted(terms.items(), key=lambda item: (-abs(item[1]), item[0])):
        size = abs(coefficient)
        inside = ""
        for name, multiple in argument:
            sign = " - " if multiple < 0 else " + " if inside else ""
            inside += f"{sign}{'' if abs(multiple) == 1 else f'{abs(multiple)} '}{name}"
        factor = f"{function}({inside})" if inside else ""
        number = "" if factor and abs(size - 1.0) < 1e-12 else f"{size:.12g}"
        words.append(("-" if coefficient < 0 else "+", " ".join(part for part in (number, factor) if part)))
    if not words:
        return "0"
    text = ("-" if words[0][0] == "-" else "") + words[0][1]
    return text + "".join(f" {sign} {word}" for sign, word in words[1:])
