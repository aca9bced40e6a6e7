"""Worst-case steps: how far rounding of its rows may move the unknowns of a block."""

from __future__ import annotations

from collections.abc import Sequence
from math import copysign

from .linear import Matrix, factor, lu_solve, qr_factor, qr_solve
from .pose import Vector


def worst_case_step(matrix: Matrix, rows: Vector, scales: Vector) -> Sequence[float]:
    """Return J^-1 (s R), (k,), with the signs s that move the most sensitive unknown as far as possible.

    Args:
        matrix: J (m, k) of a block, m >= k.
        rows: R, scales of its rows, in lengths.
        scales: Of its unknowns.

    """
    k = len(scales)
    if len(rows) == k == 1:
        return (abs(rows[0] / matrix[0][0]),)
    if len(rows) == k == 2:
        return _worst_case_step_of_two(matrix, rows, scales)
    columns = _inverse(matrix, rows)
    reach = [sum([abs(column[j]) for column in columns]) / scales[j] for j in range(k)]
    worst = reach.index(max(reach))
    total = [0.0] * k
    for column in columns:
        sign = 1.0 if column[worst] >= 0.0 else -1.0
        total = [a + sign * b for a, b in zip(total, column)]  # noqa: B905  one item per unknown
    return total


def _worst_case_step_of_two(matrix: Matrix, rows: Vector, scales: Vector) -> Vector:
    """Return `worst_case_step` of a 2 x 2 matrix: the columns of J^-1 R are (d p, -c p) and (-b q, a q)."""
    (a, b), (c, d) = matrix
    det = a * d - b * c
    p, q = rows[0] / det, rows[1] / det
    dp, cp, bq, aq = d * p, -c * p, -b * q, a * q
    gain = (abs(dp) + abs(bq)) / scales[0] - (abs(cp) + abs(aq)) / scales[1]
    first = copysign(1.0, choose(gain, dp, cp) + 0.0)  # + 0.0 makes -0.0 positive
    second = copysign(1.0, choose(gain, bq, aq) + 0.0)
    return first * dp + second * bq, first * cp + second * aq


def choose(number: float, if_positive: float, otherwise: float) -> float:
    """Return `if_positive` for a number of 0 and more."""
    return if_positive if number >= 0.0 else otherwise


def _inverse(matrix: Matrix, rows: Vector) -> list[Sequence[float]]:
    """Return the columns of J^-1 (of the least-squares inverse if J is tall), each times the scale of its row."""
    m = len(rows)
    units = [[scale if j == i else 0.0 for j in range(m)] for i, scale in enumerate(rows)]
    if m == len(matrix[0]):
        factors = factor(matrix)
        return [lu_solve(factors, unit) for unit in units]
    tall = qr_factor(matrix)
    return [qr_solve(tall, unit) for unit in units]
