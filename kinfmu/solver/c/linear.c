/* Small dense linear algebra: blocks of three unknowns and more, and least squares. See kinfmu/solver/python/linear.py. */
#include "kinfmu.h"

#include <math.h>

static double dot(int m, const double *a, const double *b)
{
    double sum = 0.0;
    int i;
    for (i = 0; i < m; ++i) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* Form A^T B (k, k) of two matrices (m, k), with `diagonal` added to its diagonal. */
static void multiply(int m, int k, const double *a, const double *b, double diagonal, double *product)
{
    int i, j, row;
    for (i = 0; i < k; ++i) {
        for (j = 0; j < k; ++j) {
            double sum = i == j ? diagonal : 0.0;
            for (row = 0; row < m; ++row) {
                sum += a[row * k + i] * b[row * k + j];
            }
            product[i * k + j] = sum;
        }
    }
}

/* Factors of A (k, k): the equilibrated rows' LU, row after row; the rows' order; their scales. */
bool kf_lu(int k, const double *matrix, double *factors, double *determinant)
{
    double *const lu = factors;
    double *const order = factors + k * k;
    double *const scales = order + k;
    int i, j, column;
    *determinant = 1.0;
    for (i = 0; i < k; ++i) {
        const double length = sqrt(dot(k, matrix + i * k, matrix + i * k));
        if (!(length > 0.0 && length < INFINITY)) {
            return false;
        }
        order[i] = i;
        scales[i] = 1.0 / length;
        for (j = 0; j < k; ++j) {
            lu[i * k + j] = matrix[i * k + j] / length;
        }
    }
    for (column = 0; column < k; ++column) {
        int pivot = column;
        for (i = column + 1; i < k; ++i) {
            if (fabs(lu[i * k + column]) > fabs(lu[pivot * k + column])) {
                pivot = i;
            }
        }
        if (lu[pivot * k + column] == 0.0) {
            return false;
        }
        if (pivot != column) {
            double kept = order[pivot];
            order[pivot] = order[column];
            order[column] = kept;
            for (j = 0; j < k; ++j) {
                kept = lu[pivot * k + j];
                lu[pivot * k + j] = lu[column * k + j];
                lu[column * k + j] = kept;
            }
            *determinant = -*determinant;
        }
        *determinant *= lu[column * k + column];
        for (i = column + 1; i < k; ++i) {
            const double ratio = lu[i * k + column] / lu[column * k + column];
            lu[i * k + column] = ratio;
            for (j = column + 1; j < k; ++j) {
                lu[i * k + j] -= ratio * lu[column * k + j];
            }
        }
    }
    return true;
}

/* Return the smallest length of a line relative to its usual one, at most 1; scaling hides a line that vanishes.
 *
 * lines of so many entries, that begin `start` apart; entries of a line are `step` apart.
 */
static double least_part(int lines, int start, int entries, int step, const double *matrix, const double *usual)
{
    double least = 1.0;
    int i, j;
    for (i = 0; i < lines; ++i) {
        double square = 0.0, part;
        for (j = 0; j < entries; ++j) {
            const double entry = matrix[i * start + j * step];
            square += entry * entry;
        }
        part = sqrt(square) / usual[i];
        least = part < least ? part : least;
    }
    return least;
}

/* Of the rows of a square matrix. */
double kf_row_part(int k, const double *matrix, const double *usual)
{
    return least_part(k, k, k, 1, matrix, usual);
}

/* Of the columns of a tall matrix (m, k). */
double kf_column_part(int m, int k, const double *matrix, const double *usual)
{
    return least_part(k, 1, m, k, matrix, usual);
}

/* x with A x = b from the factors of A. */
void kf_lu_solve(int k, const double *factors, const double *right, double *x)
{
    const double *const lu = factors;
    const double *const order = factors + k * k;
    const double *const scales = order + k;
    int i;
    for (i = 0; i < k; ++i) {
        x[i] = right[(int)order[i]] * scales[(int)order[i]];
    }
    for (i = 1; i < k; ++i) {
        x[i] -= dot(i, lu + i * k, x);
    }
    for (i = k - 1; i >= 0; --i) {
        x[i] = (x[i] - dot(k - 1 - i, lu + i * k + i + 1, x + i + 1)) / lu[i * k + i];
    }
}

/* column -= 2 (reflector . column) / square * reflector */
static void reflect(int m, const double *reflector, double square, double *column)
{
    const double weight = 2.0 * dot(m, reflector, column) / square;
    int i;
    for (i = 0; i < m; ++i) {
        column[i] -= weight * reflector[i];
    }
}

/* Householder factors of A (m, k), m >= k: the columns of R, then the reflectors, column after column. */
bool kf_qr(int m, int k, const double *matrix, double *factors, double *determinant)
{
    double *const columns = factors;
    double *const reflectors = factors + m * k;
    int i, j, other;
    for (j = 0; j < k; ++j) {
        for (i = 0; i < m; ++i) {
            columns[j * m + i] = matrix[i * k + j];
        }
    }
    *determinant = 1.0;
    for (j = 0; j < k; ++j) {
        double *const column = columns + j * m;
        double *const reflector = reflectors + j * m;
        double length = 0.0, alpha, square;
        const double norm = sqrt(dot(m - j, column + j, column + j));
        for (i = 0; i < m; ++i) { /* of the column as it was: reflections keep it */
            length += matrix[i * k + j] * matrix[i * k + j];
        }
        length = sqrt(length);
        if (!(norm > 0.0 && norm < INFINITY)) {
            return false;
        }
        alpha = column[j] > 0.0 ? -norm : norm;
        for (i = 0; i < m; ++i) {
            reflector[i] = i < j ? 0.0 : column[i];
        }
        reflector[j] -= alpha;
        square = dot(m, reflector, reflector);
        for (other = j; other < k; ++other) {
            reflect(m, reflector, square, columns + other * m);
        }
        *determinant *= norm / length;
    }
    return true;
}

/* x that minimizes |A x - b| from the factors of A. */
void kf_qr_solve(int m, int k, const double *factors, const double *right, double *x)
{
    const double *const columns = factors;
    const double *const reflectors = factors + m * k;
    double b[KF_ROOM(KF_LARGEST_BLOCK)];
    int i, j;
    for (i = 0; i < m; ++i) {
        b[i] = right[i];
    }
    for (j = 0; j < k; ++j) {
        const double *const reflector = reflectors + j * m;
        reflect(m, reflector, dot(m, reflector, reflector), b);
    }
    for (i = k - 1; i >= 0; --i) {
        double sum = 0.0;
        for (j = i + 1; j < k; ++j) {
            sum += columns[j * m + i] * x[j];
        }
        x[i] = (b[i] - sum) / columns[i * m + i];
    }
}

/* Return the same for 2 x 2, with the inverse written out. */
static double reciprocal_condition_of_two(const double *matrix)
{
    double a = matrix[0], b = matrix[1], c = matrix[2], d = matrix[3];
    double p = sqrt(a * a + b * b), q = sqrt(c * c + d * d), norm, inverse_norm;
    if (!(p > 0.0 && q > 0.0)) {
        return 0.0;
    }
    a /= p;
    b /= p;
    c /= q;
    d /= q;
    p = sqrt(a * a + c * c);
    q = sqrt(b * b + d * d);
    if (!(p > 0.0 && q > 0.0)) {
        return 0.0;
    }
    a /= p;
    b /= q;
    c /= p;
    d /= q;
    norm = fmax(fabs(a) + fabs(c), fabs(b) + fabs(d));
    inverse_norm = fmax(fabs(d) + fabs(c), fabs(b) + fabs(a)); /* over |det| */
    return fabs(a * d - b * c) / (norm * inverse_norm);
}

/* The largest entry of b + A x where x minimizes |A x + b|^2 + damping^2 |x|^2: the part of b outside the columns of A
 * (m, k).
 */
double kf_unclosed(int m, int k, const double *matrix, const double *right, double damping)
{
    double normal[KF_ROOM(KF_LARGEST_BLOCK)], factors[3 * KF_ROOM(KF_LARGEST_BLOCK)], x[KF_ROOM(KF_LARGEST_BLOCK)];
    double b[KF_ROOM(KF_LARGEST_BLOCK)], determinant, largest = 0.0;
    int i, j, row;
    for (i = 0; i < k; ++i) {
        b[i] = 0.0;
        for (row = 0; row < m; ++row) {
            b[i] -= matrix[row * k + i] * right[row];
        }
    }
    multiply(m, k, matrix, matrix, damping * damping, normal);
    if (!kf_lu(k, normal, factors, &determinant)) {
        return 0.0;
    }
    kf_lu_solve(k, factors, b, x);
    for (row = 0; row < m; ++row) {
        double left = right[row];
        for (j = 0; j < k; ++j) {
            left += matrix[row * k + j] * x[j];
        }
        largest = fmax(largest, fabs(left));
    }
    return largest;
}

/* det(A^T B) of two tall matrices over the lengths of its rows: negative if their orientations differ. */
double kf_orientation(int m, int k, const double *a, const double *b)
{
    double product[KF_ROOM(KF_LARGEST_BLOCK)], factors[3 * KF_ROOM(KF_LARGEST_BLOCK)], determinant;
    multiply(m, k, a, b, 0.0, product);
    return kf_lu(k, product, factors, &determinant) ? determinant : 0.0;
}

/* 1 / cond of the equilibrated A (m, k) (rows, then columns, scaled to unit length), in the 1-norm; 0 if it is
 * singular. For a tall matrix that of R in A = QR, its rows as they are: where one of them vanishes the others carry
 * the block, and what rounding leaves of it must not count. A is overwritten.
 */
double kf_reciprocal_condition(int m, int k, double *matrix)
{
    double factors[KF_QR_ROOM(1, KF_ROOM(KF_LARGEST_BLOCK)) + KF_LU_ROOM(1)], unit[KF_ROOM(KF_LARGEST_BLOCK)];
    double column[KF_ROOM(KF_LARGEST_BLOCK)], norm = 0.0, inverse_norm = 0.0, determinant;
    int i, j;
    if (m == 2 && k == 2) {
        return reciprocal_condition_of_two(matrix);
    }
    for (i = 0; i < m; ++i) {
        const double length = m > k ? 1.0 : sqrt(dot(k, matrix + i * k, matrix + i * k));
        for (j = 0; length > 0.0 && j < k; ++j) {
            matrix[i * k + j] /= length;
        }
    }
    for (j = 0; j < k; ++j) {
        double length = 0.0;
        for (i = 0; i < m; ++i) {
            length += matrix[i * k + j] * matrix[i * k + j];
        }
        length = sqrt(length);
        if (!(length > 0.0)) {
            return 0.0;
        }
        for (i = 0; i < m; ++i) {
            matrix[i * k + j] /= length;
        }
    }
    if (m > k) {
        if (!kf_qr(m, k, matrix, factors, &determinant)) {
            return 0.0;
        }
        for (i = 0; i < k; ++i) {
            for (j = 0; j < k; ++j) {
                matrix[i * k + j] = j >= i ? factors[j * m + i] : 0.0;
            }
        }
    }
    if (!kf_lu(k, matrix, factors, &determinant)) {
        return 0.0;
    }
    for (j = 0; j < k; ++j) {
        double sum = 0.0, inverse_sum = 0.0;
        for (i = 0; i < k; ++i) {
            unit[i] = i == j ? 1.0 : 0.0;
            sum += fabs(matrix[i * k + j]);
        }
        kf_lu_solve(k, factors, unit, column);
        for (i = 0; i < k; ++i) {
            inverse_sum += fabs(column[i]);
        }
        norm = sum > norm ? sum : norm;
        inverse_norm = inverse_sum > inverse_norm ? inverse_sum : inverse_norm;
    }
    return 1.0 / (norm * inverse_norm);
}
