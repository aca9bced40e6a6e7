"""Small dense linear algebra on lists: blocks of three and more unknowns, and least squares."""

from __future__ import annotations

from math import isfinite, sqrt
from operator import mul

Matrix = list[list[float]]


class Singular(ArithmeticError):  # noqa: N818  # a state of the matrix, not a fault
    """A matrix without a usable pivot."""


class LU:
    """Factors of an equilibrated matrix with its row order; `determinant` is that of the rows scaled to unit length."""

    __slots__ = ("determinant", "lu", "order", "scales")

    def __init__(self, lu: Matrix, order: list[int], scales: list[float], determinant: float) -> None:
        self.lu = lu
        self.order = order
        self.scales = scales
        self.determinant = determinant


def factor(matrix: Matrix) -> LU:
    """Return LU factors of A (k, k); Singular if a row or a pivot vanishes."""
    k = len(matrix)
    scales, rows = [], []
    for row in matrix:
        length = sqrt(sum(entry * entry for entry in row))
        if not 0.0 < length < float("inf"):
            raise Singular
        scales.append(1.0 / length)
        rows.append([entry / length for entry in row])
    order, determinant = list(range(k)), 1.0
    for column in range(k):
        pivot = max(range(column, k), key=lambda i: abs(rows[i][column]))
        if rows[pivot][column] == 0.0:
            raise Singular
        if pivot != column:
            rows[pivot], rows[column] = rows[column], rows[pivot]
            order[pivot], order[column] = order[column], order[pivot]
            determinant = -determinant
        top = rows[column]
        determinant *= top[column]
        for i in range(column + 1, k):
            row = rows[i]
            row[column] = ratio = row[column] / top[column]
            if ratio:
                for j in range(column + 1, k):
                    row[j] -= ratio * top[j]
    return LU(rows, order, scales, determinant)


def row_part(matrix: Matrix, usual: tuple[float, ...]) -> float:
    """Return the smallest length of a row relative to its usual one, at most 1; scaling hides a row that vanishes."""
    return min(1.0, *[sqrt(sum([e * e for e in row])) / u for row, u in zip(matrix, usual, strict=True)])


def column_part(matrix: Matrix, usual: tuple[float, ...]) -> float:
    """Return the same of the columns, for a tall matrix."""
    return row_part([list(column) for column in zip(*matrix, strict=True)], usual)


def lu_solve(factors: LU, right: list[float]) -> list[float]:
    """Return x with A x = b from the factors of A."""
    rows, k = factors.lu, len(factors.order)
    x = [right[i] * factors.scales[i] for i in factors.order]
    for i in range(1, k):
        row = rows[i]
        x[i] -= sum(row[j] * x[j] for j in range(i))
    for i in range(k - 1, -1, -1):
        row = rows[i]
        x[i] = (x[i] - sum(row[j] * x[j] for j in range(i + 1, k))) / row[i]
    return x


class QR:
    """Householder factors of a tall matrix (m, k); `determinant` is the product of R's diagonal over column lengths."""

    __slots__ = ("columns", "determinant", "reflectors")

    def __init__(self, columns: Matrix, reflectors: Matrix, determinant: float) -> None:
        self.columns = columns
        self.reflectors = reflectors
        self.determinant = determinant


def qr_factor(matrix: Matrix) -> QR:
    """Return Householder QR of A (m, k), m >= k; Singular if a column vanishes or depends on others."""
    m, k = len(matrix), len(matrix[0])
    columns = [[matrix[i][j] for i in range(m)] for j in range(k)]
    lengths = [sqrt(sum(entry * entry for entry in column)) for column in columns]
    reflectors, determinant = [], 1.0
    for j in range(k):
        column = columns[j]
        norm = sqrt(sum(column[i] * column[i] for i in range(j, m)))
        if not 0.0 < norm < float("inf"):
            raise Singular
        alpha = -norm if column[j] > 0.0 else norm
        reflector = [0.0] * j + column[j:]
        reflector[j] -= alpha
        square = sum(entry * entry for entry in reflector)
        for other in columns[j:]:
            _reflect(reflector, square, other)
        reflectors.append(reflector)
        determinant *= norm / lengths[j]
    return QR(columns, reflectors, determinant)


def qr_solve(factors: QR, right: list[float]) -> list[float]:
    """Return x that minimizes |A x - b| from the factors of A."""
    b, columns, k = list(right), factors.columns, len(factors.columns)
    for reflector in factors.reflectors:
        _reflect(reflector, sum(entry * entry for entry in reflector), b)
    x = [0.0] * k
    for i in range(k - 1, -1, -1):
        x[i] = (b[i] - sum(columns[j][i] * x[j] for j in range(i + 1, k))) / columns[i][i]
    return x


def least_norm(factors: QR, right: list[float]) -> list[float]:
    """Return the shortest x with A^T x = b, from the factors of A: x = Q R^-T b."""
    columns, k = factors.columns, len(factors.columns)
    x = [0.0] * len(columns[0])
    for i in range(k):
        x[i] = (right[i] - sum(columns[i][j] * x[j] for j in range(i))) / columns[i][i]
    for reflector in reversed(factors.reflectors):
        _reflect(reflector, sum(entry * entry for entry in reflector), x)
    return x


def unclosed(matrix: Matrix, right: list[float], damping: float) -> list[float]:
    """Return b + A x where x minimizes |A x + b|^2 + damping^2 |x|^2: the part of b outside the columns of A."""
    columns = list(zip(*matrix, strict=True))
    normal = [[sum(map(mul, one, other)) for other in columns] for one in columns]
    for k, row in enumerate(normal):
        row[k] += damping * damping
    x = lu_solve(factor(normal), [-sum(map(mul, column, right)) for column in columns])
    return [b + sum(map(mul, row, x)) for row, b in zip(matrix, right, strict=True)]


def _reflect(reflector: list[float], square: float, column: list[float]) -> None:
    weight = 2.0 * sum(a * b for a, b in zip(reflector, column, strict=True)) / square
    for i, entry in enumerate(reflector):
        column[i] -= weight * entry


def orientation(a: Matrix, b: Matrix) -> float:
    """Return det(A^T B) of two tall matrices over the lengths of its rows: negative if their orientations differ."""
    columns = list(zip(*b, strict=True))
    product = [[sum(map(mul, one, other)) for other in columns] for one in zip(*a, strict=True)]
    try:
        return factor(product).determinant
    except Singular:
        return 0.0


def reciprocal_condition(matrix: Matrix) -> float:
    """Return 1 / cond of the equilibrated matrix in the 1-norm, 0 if singular; rows, then columns have unit length.

    Of a tall matrix it is that of R in A = QR, without scaling its rows: where one of them vanishes the others carry
    the block, and its rounding errors must not count.
    """
    m, k = len(matrix), len(matrix[0])
    if m == k == 2:
        return _reciprocal_condition_of_two(matrix)
    rows = []
    for row in matrix:
        length = 1.0 if m > k else sqrt(sum(entry * entry for entry in row))
        rows.append([entry / length for entry in row] if length > 0.0 else row)
    for j in range(k):
        length = sqrt(sum(row[j] * row[j] for row in rows))
        if not length > 0.0:
            return 0.0
        for row in rows:
            row[j] /= length
    try:
        if m > k:
            columns = qr_factor(rows).columns
            rows = [[columns[j][i] if j >= i else 0.0 for j in range(k)] for i in range(k)]
        factors = factor(rows)
        inverse = [lu_solve(factors, [float(i == j) for i in range(k)]) for j in range(k)]
    except ArithmeticError:
        return 0.0
    norm = max(sum(abs(row[j]) for row in rows) for j in range(k))
    inverse_norm = max(sum(abs(entry) for entry in column) for column in inverse)
    return 1.0 / (norm * inverse_norm)


def _reciprocal_condition_of_two(matrix: Matrix) -> float:
    """Return the same for 2 x 2, with the inverse written out."""
    (a, b), (c, d) = matrix
    p, q = sqrt(a * a + b * b), sqrt(c * c + d * d)
    if not isfinite(p + q):
        return 0.0
    try:
        a, b, c, d = a / p, b / p, c / q, d / q
        p, q = sqrt(a * a + c * c), sqrt(b * b + d * d)
        a, b, c, d = a / p, b / q, c / p, d / q
    except ArithmeticError:  # a row or a column vanishes
        return 0.0
    norm = max(abs(a) + abs(c), abs(b) + abs(d))
    inverse_norm = max(abs(d) + abs(c), abs(b) + abs(a))  # over |det|
    return abs(a * d - b * c) / (norm * inverse_norm)
