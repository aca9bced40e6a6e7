"""A stage of steps compiled: a function of one sample, and of all samples at once.

Sensitivities, forces and reactions are stages; they are printed when first needed.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from kinfmu.codegen.python.block_code import defined, matrix, tupled, unpacking
from kinfmu.codegen.python.roots import sqrt
from kinfmu.codegen.python.solutions import solutions
from kinfmu.codegen.writer import Names, Writer, identifier
from kinfmu.mechanism.quantities.arithmetic import floor
from kinfmu.plan.equations.graph import Node, reachable, symbols
from kinfmu.plan.steps import Assignment, Stage, Step
from kinfmu.solver.python.curve import CurveData
from kinfmu.solver.python.curve import curve as curve_value

FEW = 16  # samples up to which numbers are faster than arrays: numpy takes a microsecond for each operation
FEW_WITH_SOLVES = 2  # likewise where blocks of three unknowns are solved by loops in Python

Fill = Callable[[Sequence[Any]], tuple[Any, ...]]
Entries = Sequence[Sequence[Any]]


@dataclass(frozen=True, eq=False)
class CompiledStage:
    """A stage compiled as Python.

    Attributes:
        given: Names of the symbols whose values the functions take, in this order.
        steps: What is computed.
        text: The source.
        of_sample: For numbers.
        of_samples: For arrays (n,).
        few: Up to so many samples are faster one by one.

    """

    given: tuple[str, ...]
    steps: Stage
    text: str
    of_sample: Fill
    of_samples: Fill
    few: int

    @cached_property
    def zeros(self) -> list[slice]:
        """Places of the results that are 0, one after another."""
        ends = (-1, *self.places, len(self.steps.results))
        return [slice(a + 1, b) for a, b in itertools.pairwise(ends) if b > a + 1]

    @cached_property
    def places(self) -> tuple[int, ...]:
        """Places of the returned values in the row of all results, where the others are 0."""
        return tuple(k for k, node in enumerate(self.steps.results) if node.constant != 0.0)


def load_stage(steps: Stage) -> CompiledStage:
    """Return the compiled stage."""
    given, curves = given_symbols(steps), stage_curves(steps)
    text = _text(steps, given, curves)
    code = compile(text, "<stage>", "exec")
    constants = {name: one for one, name in curves.items()}

    def function(operations: dict[str, Any]) -> Fill:
        namespace = operations | constants
        exec(code, namespace)  # noqa: S102  our own generated source
        fill: Fill = namespace["results"]
        return fill

    few = FEW if all(isinstance(step, Assignment) for step in steps.steps) else FEW_WITH_SOLVES
    return CompiledStage(given, steps, text, function(OF_NUMBERS), function(_OF_ARRAYS), few)


def given_symbols(steps: Stage) -> tuple[str, ...]:
    """Return the names of the symbols that no step gives."""
    made = {name for step in steps.steps for name in _names(step)}
    return tuple(symbol.name for symbol in symbols(_roots(steps)) if symbol.name not in made)


def has_roots(steps: Stage) -> bool:
    """Return True for a stage with square roots."""
    return any(node.op == "sqrt" for node in reachable(_roots(steps)))


def stage_curves(steps: Stage) -> dict[CurveData, str]:
    """Return the names of the constants that hold the data of a stage's curves."""
    data = dict.fromkeys(node.curve[0] for node in reachable(_roots(steps)) if node.op == "curve")
    return {one: f"CURVE_{k}" for k, one in enumerate(data, start=1)}


def stage_lines(
    steps: Stage,
    given: Sequence[str],
    curves: Mapping[CurveData, str],
    solve: Callable[[Entries, Entries, Sequence[str]], list[str]],
    functions: Mapping[str, str] | None = None,
) -> tuple[list[str], list[str]]:
    """Return the statements of a stage, in Python or in C without their ends, and expressions of its results.

    solve: gives statements for rows of J, columns b and the names of the solutions.
    functions: names of functions called in place of sin and cos.
    """
    roots = _roots(steps)
    made = [name for step in steps.steps for name in _names(step)]
    writer = Writer(Names((*given, *made), curves, functions), (), _used_again(reachable(roots), roots))
    lines = []
    for step in steps.steps:
        lines += writer.statements(_nodes(step))
        if isinstance(step, Assignment):
            lines.append(f"{identifier(step.name)} = {writer.expression(step.node)}")
        else:
            rows, columns = ([[writer.expression(node) for node in row] for row in part] for part in step[:2])
            lines += solve(rows, columns, [identifier(name) for name in _names(step)])
    results = [node for node in steps.results if node.constant != 0.0]
    last, expressions = writer.formulas(results)
    return lines + last, expressions


def _text(steps: Stage, given: Sequence[str], curves: Mapping[CurveData, str]) -> str:
    def solve(rows: Entries, columns: Entries, names: Sequence[str]) -> list[str]:
        return [f"{tupled(names)} = solutions({matrix(rows)}, {matrix(columns)})"]

    lines, results = stage_lines(steps, given, curves, solve)
    lines = [*unpacking(map(identifier, given), "given"), *lines]
    return "\n".join(defined("results(given)", "Return the results that are not 0.", lines, tupled(results)))


def _roots(steps: Stage) -> list[Node]:
    return [node for step in steps.steps for node in _nodes(step)] + list(steps.results)


def _nodes(step: Step) -> list[Node]:
    if isinstance(step, Assignment):
        return [step.node]
    return [node for row in (*step.jacobian, *step.columns) for node in row]


def _names(step: Step) -> list[str]:
    return [step.name] if isinstance(step, Assignment) else [name for names in step.names for name in names]


def _used_again(nodes: list[Node], roots: list[Node]) -> set[Node]:
    """Return the operations that several others are made of: steps share them."""
    uses = Counter(arg for node in nodes for arg in node.args)
    uses.update(roots)
    return {node for node, count in uses.items() if count > 1 and node.args}


def _solutions_of_arrays(rows: Entries, columns: Entries) -> list[Any]:
    """Return what `solutions` returns, for entries that are numbers or arrays (n,); NaN where J is singular."""
    n = max(np.size(entry) for row in (*rows, *columns) for entry in row)
    jacobian = np.empty((n, len(rows), len(rows[0])))
    right = np.empty((n, len(rows), len(columns)))
    for i, row in enumerate(rows):
        for k, entry in enumerate(row):
            jacobian[:, i, k] = entry
    for k, column in enumerate(columns):
        for i, entry in enumerate(column):
            right[:, i, k] = entry
    is_wide = len(rows) < len(rows[0])
    if is_wide:
        orthogonal, upper = np.linalg.qr(jacobian.transpose(0, 2, 1))
        jacobian = upper.transpose(0, 2, 1)
    elif len(rows) > len(rows[0]):
        orthogonal, jacobian = np.linalg.qr(jacobian)
        right = orthogonal.transpose(0, 2, 1) @ right
    try:
        solved = np.linalg.solve(jacobian, right)
    except np.linalg.LinAlgError:  # one of them is exactly singular
        jacobian[np.linalg.det(jacobian) == 0.0] = np.nan
        solved = np.linalg.solve(jacobian, right)
    if is_wide:
        solved = orthogonal @ solved
    return [-solved[:, i, k] for k in range(len(columns)) for i in range(len(rows[0]))]


def _curve_of_arrays(data: CurveData, order: int, x: Any) -> Any:
    """Return a piecewise function at numbers (n,)."""
    return np.array([curve_value(data, order, value) for value in np.atleast_1d(x).tolist()])


OF_NUMBERS: dict[str, Any] = {
    "sin": math.sin,
    "cos": math.cos,
    "sqrt": sqrt,
    "floor": floor,
    "atan2": math.atan2,
    "curve": curve_value,
    "solutions": solutions,
}
_OF_ARRAYS: dict[str, Any] = {
    "sin": np.sin,
    "cos": np.cos,
    "sqrt": np.sqrt,
    "floor": np.floor,
    "atan2": np.arctan2,
    "curve": _curve_of_arrays,
    "solutions": _solutions_of_arrays,
}
