"""Newton's loop in every language: its statements, when it ends, and the solves of one and two unknowns, unrolled.

Expressions are plain arithmetic on names and mean the same in Python and in C. Statements are without their end.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from kinfmu.codegen.writer import Writer, identifier
from kinfmu.plan import Block
from kinfmu.plan.equations.graph import Node, symbols

ROUND_OFF = 4e-16  # residual relative to the size below which more steps gain nothing at regular poses
SETTLED = 1e-13  # residual from which Newton may stop when it no longer falls fourfold
SETTLED_TALL = 1e-10  # the same of more rows than unknowns: lengths that are consistent to 1e-11 keep them open
FARTHEST = 5e3  # [sizes]; the residual of a mechanism farther off must still fall below 5e-10, for the usual tolerance
ITERATIONS = 12

Rows = Sequence[Sequence[str]]


def is_small(block: Block) -> bool:
    """Return True for a square block of one or two unknowns, whose solves are unrolled."""
    return len(block.unknowns) <= 2 and len(block.residuals) == len(block.unknowns)


def determinant(jacobian: Rows) -> str:
    """Return det J of one or two unknowns."""
    if len(jacobian) == 1:
        return jacobian[0][0]
    (a, b), (c, d) = jacobian
    return f"{_product(a, d)} - {_product(b, c)}"


def solution(jacobian: Rows, r: Sequence[str], by_det: str = "/ det", *, is_opposite: bool = False) -> list[str]:
    """Return J^-1 r, or its opposite, of one or two unknowns; by_det: '/ det', or '* per_det', computed before r."""
    if len(r) == 1:
        return [f"{'-' if is_opposite else ''}{r[0]} {by_det}"]
    (a, b), (c, d) = jacobian
    pairs = (_product(d, r[0]), _product(b, r[1])), (_product(a, r[1]), _product(c, r[0]))
    return [f"({' - '.join(reversed(pair) if is_opposite else pair)}) {by_det}" for pair in pairs]


def square(r: Sequence[str], scales: Sequence[float]) -> str:
    """Return the sum of the squared residuals relative to the size: cheaper than the largest, and NaN if one is."""
    if len(set(scales)) == 1:
        total = " + ".join(f"{name} * {name}" for name in r)
        return total if scales[0] == 1.0 else f"({total}) * {scales[0] ** -2!r}"
    return " + ".join(f"{name} * {name} * {scale**-2!r}" for name, scale in zip(r, scales, strict=True))


def settled(block: Block, starts: Iterable[str]) -> str:
    """Return the squared residual from which Newton may stop when it no longer falls.

    Large numbers are rounded more; those of the start count, so that a diverging iteration gets no larger tolerance.
    starts: names of the unknowns before the prediction.
    """
    sizes = [repr(1.0 + min(block.row_offset, FARTHEST) ** 2), *(f"{start} * {start}" for start in starts)]
    least = SETTLED_TALL if len(block.residuals) > len(block.unknowns) else SETTLED
    return f"{least**2!r} * ({' + '.join(sizes)})"


def _product(a: str, b: str) -> str:
    return " * ".join(f"({text})" if any(c in text for c in " -") else text for text in (a, b))


def outright(writer: Writer, block: Block, comment: str = "") -> list[str]:
    """Return statements for the coordinates that a block gives outright; comment: on each, around its row."""
    lines: list[str] = []
    for (name, motion), row in zip(block.assigned, block.assigned_by, strict=True):
        new, (position,) = writer.formulas(motion[:1])
        new += [f"{identifier(name)} = {position}"] if position != identifier(name) else []
        lines += [*new[:-1], *(f"{line}{comment.format(row.name)}" for line in new[-1:])]
    return lines


def outright_rates(writer: Writer, block: Block, order: int) -> list[str]:
    """Return statements for the rates (order 1) or accelerations (2) of these coordinates."""
    lines: list[str] = []
    for name, motion in block.assigned:
        lines += writer.statements([motion[order]])
        lines.append(f"{identifier(name.derivative(order))} = {writer.expression(motion[order])}")
    return lines


def before_newton(writer: Writer, block: Block, turned: Iterable[Node] = ()) -> list[str]:
    """Return the statements that Newton's loop need not repeat; turned: further nodes that its steps change."""
    rows = [*block.residuals, *block.entries]
    unknowns = [node for node in symbols(rows) if node.name in block.unknowns]
    looped = [*(motion[0] for _, motion in block.assigned), *rows]
    return writer.statements(writer.independent(looped, [*unknowns, *turned]))


def right_side(
    writer: Writer, letter: str, nodes: Sequence[Node], entries: Sequence[Node]
) -> tuple[list[str], list[str]]:
    """Return names of the entries of a right side, and statements that compute them and entries of the Jacobian."""
    names = [f"{letter}{k}" for k in range(len(nodes))]
    lines = writer.statements([*nodes, *entries])
    return names, lines + [f"{name} = {writer.expression(node)}" for name, node in zip(names, nodes, strict=True)]


def jacobian_text(writer: Writer, block: Block) -> Rows:
    """Return the Jacobian as expressions, after its statements."""
    return [[writer.expression(entry) for entry in row] for row in block.jacobian]
