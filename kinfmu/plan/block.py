"""A block of the plan with its formulas: assignments, residuals, Jacobian and the right sides, all from one trace."""

from __future__ import annotations

import math
from collections import ChainMap
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.plan.companions import BlockStructure
from kinfmu.plan.equations.graph import Node, evaluate_all, reachable, symbols
from kinfmu.plan.equations.system import Row, System
from kinfmu.plan.origin import FarRows
from kinfmu.plan.structure import RowTracer, given_value
from kinfmu.plan.trace import Tracer, is_parameter
from kinfmu.units import CoordinateName

_DETERMINANT_SAMPLES = 48


@dataclass(frozen=True, eq=False)
class Block:
    """Rows solved together for k unknowns z, and the coordinates that they give outright.

        Newton         J dz = -r              r, J: residuals (m,), jacobian (m, k); m > k: least squares
        velocity       J zd = -velocity       velocity (m,): rate of r with z at rest
        acceleration   J zdd = -acceleration  acceleration (m,): second rate of r with zdd = 0

    assigned: coordinate -> its position, rate and acceleration as nodes, in the order of evaluation. row_scales:
    residual per mechanism size; 1 for least squares, whose rows are relative to the size themselves. Symbols are
    coordinates, rates and accelerations under their contract names.
    """

    assigned: tuple[tuple[CoordinateName, tuple[Node, Node, Node]], ...]
    unknowns: tuple[CoordinateName, ...]
    rows: tuple[Row, ...]
    assigned_by: tuple[Row, ...]  # row that gives each assigned coordinate
    row_scales: tuple[float, ...]
    residuals: tuple[Node, ...]
    jacobian: tuple[tuple[Node, ...], ...]
    velocity: tuple[Node, ...]
    acceleration: tuple[Node, ...]
    determinant_scale: float  # the largest |determinant| of J over random poses, far from singular
    row_offset: float  # of the numbers in the rows, in sizes, where they are far from the origin
    usual: tuple[float, ...]  # of three unknowns and more: largest lengths of the rows (if tall, columns) of J

    @property
    def coordinates(self) -> tuple[CoordinateName, ...]:
        return (*(name for name, _ in self.assigned), *self.unknowns)

    @property
    def row_names(self) -> tuple[str, ...]:
        return tuple(row.name for row in self.rows)

    @property
    def entries(self) -> tuple[Node, ...]:
        """The entries of the Jacobian, row after row."""
        return tuple(entry for row in self.jacobian for entry in row)


class TimeDerivatives:
    """Derivatives with respect to time on the graph: each symbol's rate is the symbol of its next derivative."""

    def __init__(self, tracer: Tracer, fixed: Mapping[str, Node]) -> None:
        self.graph = tracer.graph
        self.first: dict[Node, Node] = {}
        self.both: dict[Node, Node] = {}
        for name in tracer.mechanism.coordinate_names:
            if name not in fixed:
                symbol = tracer.symbols[name]
                rate, acceleration = (self.graph.symbol(name.derivative(order)) for order in (1, 2))
                self._add(symbol, rate, acceleration)
        for driver in tracer.mechanism.drivers:
            value, speed, acceleration = (self.graph.symbol(name) for name in driver.inputs())
            self._add(value, speed, acceleration)

    def _add(self, symbol: Node, rate: Node, acceleration: Node) -> None:
        self.first[symbol] = rate
        self.both[symbol] = rate
        self.both[rate] = acceleration

    def of(self, nodes: Sequence[Node], at_rest: Collection[Node] = ()) -> list[Node]:
        """Return first derivatives; the symbols `at_rest` do not move."""
        return self.graph.derivative(nodes, self.first, at_rest)

    def second(self, nodes: Sequence[Node], unaccelerated: Collection[Node] = ()) -> list[Node]:
        """Return second derivatives; the accelerations of the symbols `unaccelerated` are zero."""
        still = {self.first[symbol] for symbol in unaccelerated}
        return self.graph.derivative(self.of(nodes), self.both, still)

    def first_and_second(self, nodes: Sequence[Node]) -> tuple[list[Node], list[Node]]:
        """Return first and second derivatives."""
        first = self.of(nodes)
        return first, self.graph.derivative(first, self.both)


def build_block(
    system: System,
    tracer: Tracer,
    row: RowTracer,
    rates: TimeDerivatives,
    structure: BlockStructure,
    fixed: Mapping[str, Node],
    anchor: Mapping[str, float],
    far: FarRows,
) -> Block:
    """Return a block; its rows are traced once, and all its formulas come from that trace.

    anchor: values of all coordinates, parameters and drivers, by name of their symbols. far: in the anchor; the scale
    of a row is as large as its slope there.
    """
    known = ChainMap[str, Node]({}, fixed)  # type: ignore[arg-type]  # the fixed ones are not written to
    assigned = []
    for name, index in structure.assigned:
        value = given_value(tracer, row, index, name, known)
        if value is None:  # `find_structure` found it linear, so this cannot happen
            raise AssertionError(f"{system.rows[index].name} does not give {name}")
        known[name] = value
        (rate,), (acceleration,) = rates.first_and_second([value])
        assigned.append((name, (value, rate, acceleration)))
    solved = (*structure.rows, *structure.companions)
    unknowns = [tracer.symbols[name] for name in structure.unknowns]
    residuals = [row(index, known) for index in solved]
    scales = tuple(float(max(system.rows[index].scale, far.slopes[index]) * system.size) for index in solved)
    if structure.companions:  # least squares weigh lengths against angles: as pure numbers
        residuals = [residual / scale for residual, scale in zip(residuals, scales, strict=True)]
        scales = (1.0,) * len(scales)
    one = tracer.graph.constant(1.0)
    columns = [tracer.graph.derivative(residuals, {unknown: one}) for unknown in unknowns]
    jacobian = tuple(zip(*columns, strict=True)) if columns else ()
    turns = {driver.inputs()[0] for driver in system.mechanism.drivers if driver.quantity.kind == "angle"}
    scale, usual = _determinant_scale(jacobian, anchor, turns, system.size)
    return Block(
        assigned=tuple(assigned),
        unknowns=structure.unknowns,
        rows=tuple(system.rows[index] for index in solved),
        assigned_by=tuple(system.rows[index] for _, index in structure.assigned),
        row_scales=scales,
        residuals=tuple(residuals),
        jacobian=jacobian,
        velocity=tuple(rates.of(residuals, at_rest=unknowns)),
        acceleration=tuple(rates.second(residuals, unaccelerated=unknowns)),
        determinant_scale=scale,
        row_offset=far.offset,
        usual=usual,
    )


def _determinants(jacobians: FloatArray, usual: Sequence[float]) -> FloatArray:
    """Return the determinants of a block that the run time monitors, one for each of its Jacobians (n, m, k).

    For one and two unknowns det J itself; from three on that of the rows scaled to unit length; for tall J the product
    of R's diagonal over the column lengths. Scaling hides a row (a column) that vanishes, as where all links of a loop
    are in line, so both are multiplied by its length over the usual one.
    """
    _, m, k = jacobians.shape
    if m == k <= 2:
        return np.asarray(np.linalg.det(jacobians))
    lengths = np.linalg.norm(jacobians, axis=1 if m > k else 2)
    part = (lengths / usual).min(axis=1, initial=1.0)
    if m > k:
        diagonal = np.abs(np.diagonal(np.linalg.qr(jacobians, mode="r"), axis1=1, axis2=2))
        return np.asarray(part * np.prod(diagonal / np.where(lengths > 0.0, lengths, 1.0), axis=1))
    return np.asarray(part * np.linalg.det(jacobians / lengths[:, :, None]))


def _determinant_scale(
    jacobian: Sequence[Sequence[Node]], anchor: Mapping[str, float], turns: Collection[str], size: float
) -> tuple[float, tuple[float, ...]]:
    """Return the largest |determinant| over random poses, and the usual lengths of rows or columns.

    turns: names of the drivers' values that are angles. A block has them in its Jacobian where a driver moves a body
    relative to one that the block solves.
    """
    if not jacobian:
        return 1.0, ()
    flat = [entry for row in jacobian for entry in row]
    met = symbols(flat)
    moving = [symbol for symbol in met if not is_parameter(symbol)]
    random = np.random.default_rng(1989).random((_DETERMINANT_SAMPLES - 1, len(moving)))
    values = {symbol.name: [anchor[symbol.name]] * _DETERMINANT_SAMPLES for symbol in met}
    for symbol, part in zip(moving, random.T.tolist(), strict=True):
        at = anchor[symbol.name]
        is_angle = symbol.name in turns if symbol.coordinate is None else symbol.coordinate.is_angle
        values[symbol.name] = [at, *(-np.pi + math.tau * x if is_angle else at + size * (-0.5 + x) for x in part)]
    m, k = len(jacobian), len(jacobian[0])
    matrices = np.transpose(evaluate_all(flat, values, _DETERMINANT_SAMPLES)).reshape(-1, m, k)
    usual: tuple[float, ...] = ()
    if m > k or k > 2:
        lengths = np.linalg.norm(matrices, axis=1 if m > k else 2).max(axis=0)
        usual = tuple(_rounded(length) for length in lengths)
    return _rounded(max(map(abs, _determinants(matrices, usual)))), usual


def _rounded(scale: float) -> float:
    """Return a scale with two digits: more would differ between machines."""
    return float(f"{scale:.2g}") or 1.0


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
