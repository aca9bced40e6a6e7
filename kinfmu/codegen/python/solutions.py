"""Linear systems of stages, for numbers. FMUs with reactions have a copy: standard library only."""

from __future__ import annotations

from collections.abc import Sequence

from ...solver.python.linear import factor, least_norm, lu_solve, qr_factor, qr_solve

Entries = Sequence[Sequence[float]]


def solutions(rows: Entries, columns: Entries) -> list[float]:
    """Return the entries of the solutions x of J x = -b, column after column.

    Least squares for more rows than unknowns, the shortest x for less. rows: of J; columns: the columns b.
    """
    matrix_rows, right = [list(row) for row in rows], [[-b for b in column] for column in columns]
    if len(rows) < len(rows[0]):
        orthogonal = qr_factor([list(column) for column in zip(*rows, strict=True)])
        return [entry for column in right for entry in least_norm(orthogonal, column)]
    if len(rows) > len(rows[0]):
        orthogonal = qr_factor(matrix_rows)
        return [entry for column in right for entry in qr_solve(orthogonal, column)]
    factors = factor(matrix_rows)
    return [entry for column in right for entry in lu_solve(factors, column)]
