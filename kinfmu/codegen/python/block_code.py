"""The statements of one block: Newton's loop and the linear solves, unrolled for one and two unknowns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from kinfmu.codegen.newton import (
    ITERATIONS,
    before_newton,
    determinant,
    is_small,
    jacobian_text,
    outright,
    right_side,
    settled,
    solution,
    square,
)
from kinfmu.codegen.writer import Writer, identifier
from kinfmu.plan import Block

BY_ROW = "  # {}"  # the comment on a coordinate that a row gives outright


def newton_lines(writer: Writer, block: Block, label: str, starts: Sequence[str], held: str, number: str) -> list[str]:
    """Return Newton's loop of a block; it starts from the predictions in its unknowns.

    label: ends the names that outlive the loop (det, factors); starts: names of the unknowns before the prediction;
    held: an expression that is true where the unknowns are not to be solved for; number: of the block, for the error.
    The code reads `enough`, the squared residual that it may end at.
    """
    before = before_newton(writer, block)
    inside = outright(writer, block, BY_ROW)
    r, lines = right_side(writer, "r", block.residuals, block.entries)
    inside += [*lines, f"error = {square(r, block.row_scales)}"]
    jacobian = jacobian_text(writer, block)
    z = [identifier(name) for name in block.unknowns]
    inside += _determinant(label, jacobian, block.usual)
    done = f"error <= enough or {held} or (16.0 * error > last and error <= {settled(block, starts)})"
    return [
        *before,
        "last = inf",
        f"for iteration in {tuple(range(ITERATIONS))}:",  # a constant, which costs less than a range
        *indented(inside),
        f"    if {done}:",
        "        break",
        "    last = error",
        *indented(_correction(label, jacobian, r, z)),
        "else:",
        f"    raise ArithmeticError({number}, sqrt(error))",
    ]


def kept_name(block: Block, label: str) -> str:
    """Return the name of what a block keeps for its linear solves: its determinant, or its factors."""
    return f"det{label}" if is_small(block) else f"factors{label}"


def _determinant(label: str, jacobian: Sequence[Sequence[str]], usual: Sequence[float]) -> list[str]:
    m, n = len(jacobian), len(jacobian[0])
    if m == n <= 2:
        return [f"det{label} = {determinant(jacobian)}"]
    factor, part = ("factor", "row_part") if m == n else ("qr_factor", "column_part")
    return [
        f"jacobian = {matrix(jacobian)}",
        f"factors{label} = {factor}(jacobian)",
        f"det{label} = factors{label}.determinant * {part}(jacobian, {tuple(usual)!r})",
    ]


def _correction(label: str, jacobian: Sequence[Sequence[str]], r: Sequence[str], z: Sequence[str]) -> list[str]:
    """Return z -= J^-1 r."""
    m, n = len(jacobian), len(z)
    if m == n <= 2:
        return [f"{name} -= {step}" for name, step in zip(z, solution(jacobian, r, f"/ det{label}"), strict=True)]
    solve = "lu_solve" if m == n else "qr_solve"
    steps = [f"d{i}" for i in range(n)]
    lines = [f"{tupled(steps)} = {solve}(factors{label}, [{', '.join(r)}])"]
    return lines + [f"{name} -= {step}" for name, step in zip(z, steps, strict=True)]


def solution_lines(
    label: str, order: int, jacobian: Sequence[Sequence[str]], b: Sequence[str], z: Sequence[str]
) -> list[str]:
    """Return z = -J^-1 b, for velocities (order 1) or accelerations (2)."""
    m, n = len(jacobian), len(z)
    if m == n <= 2:
        if order == 1:  # a quotient, rounded once: bodies that turn equally have equal speeds to the bit
            solved, before = solution(jacobian, b, f"/ det{label}", is_opposite=True), []
        else:
            solved = solution(jacobian, b, "* per_det", is_opposite=True)
            before = [f"per_det = 1.0 / det{label}"]
        return [*before, *(f"{name} = {value}" for name, value in zip(z, solved, strict=True))]
    solve = "lu_solve" if m == n else "qr_solve"
    return [f"{tupled(z)} = {solve}(factors{label}, [{', '.join(f'-{name}' for name in b)}])"]


def scaled_residuals(writer: Writer, block: Block) -> tuple[list[str], str]:
    """Return the statements of a block's residuals relative to the size, and the list of them."""
    lines, residuals = writer.formulas(block.residuals)
    scaled = [f"({r}) / {scale!r}" for r, scale in zip(residuals, block.row_scales, strict=True)]
    return lines, f"[{', '.join(scaled)}]"


def extreme(name: str, terms: Sequence[str]) -> str:
    """Return 'max(a, b)', 'a' or '0.0' for the terms of 'max' or 'min'."""
    return f"{name}({', '.join(terms)})" if len(terms) > 1 else "".join(terms) or "0.0"


def matrix(rows: Sequence[Sequence[str]]) -> str:
    """Return '[[a, b], [c, d]]'."""
    return "[" + ", ".join("[" + ", ".join(row) + "]" for row in rows) + "]"


def tupled(items: Iterable[str]) -> str:
    """Return '(a, b)', '(a,)' or '()'."""
    items = list(items)
    return f"({items[0]},)" if len(items) == 1 else f"({', '.join(items)})"


def unpacking(names: Iterable[str], source: str) -> list[str]:
    """Return the assignment of a tuple's items to names; no line for no names."""
    names = list(names)
    return [f"{tupled(names)} = {source}"] if names else []


def defined(head: str, about: str, lines: Iterable[str], returned: str) -> list[str]:
    """Return a function with its docstring, between empty lines."""
    return ["", f"def {head}:", f'    """{about}"""', *indented(lines), f"    return {returned}", ""]


def indented(lines: Iterable[str], spaces: int = 4) -> list[str]:
    """Return the lines, indented."""
    return [f"{' ' * spaces}{line}" for line in lines]
