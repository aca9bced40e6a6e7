/* Linear systems of force stages; see kinfmu/codegen/python/solutions.py. */
#include "kinfmu.h"

#include <math.h>
#include <string.h>

/* The shortest x with A^T x = b from the factors of A (m, k), which kf_qr gives: x = Q R^-T b. */
static void least_norm(int m, int k, const double *factors, const double *right, double *x)
{
    const double *const columns = factors;
    const double *const reflectors = factors + m * k;
    int i, j;
    memset(x, 0, (size_t)m * sizeof *x);
    for (i = 0; i < k; ++i) {
        double sum = right[i];
        for (j = 0; j < i; ++j) {
            sum -= columns[i * m + j] * x[j];
        }
        x[i] = sum / columns[i * m + i];
    }
    for (j = k - 1; j >= 0; --j) {
        const double *const reflector = reflectors + j * m;
        double square = 0.0, along = 0.0;
        for (i = 0; i < m; ++i) {
            square += reflector[i] * reflector[i];
            along += reflector[i] * x[i];
        }
        for (i = 0; i < m; ++i) {
            x[i] -= 2.0 * along / square * reflector[i];
        }
    }
}

/* Solve A x = b for several b, column after column; NaN if A (m, k) is singular.
 *
 * Least squares for more rows than unknowns, the shortest x for less. factors: 3 m k + 2 (m + k) numbers.
 */
void kf_solutions(int m, int k, int columns, const double *a, const double *b, double *factors, double *x)
{
    double *const transposed = factors + 2 * m * k;
    double determinant;
    bool is_regular;
    int i, j;
    if (m < k) { /* the rows of A^T are the columns of A */
        for (i = 0; i < m; ++i) {
            for (j = 0; j < k; ++j) {
                transposed[j * m + i] = a[i * k + j];
            }
        }
        is_regular = kf_qr(k, m, transposed, factors, &determinant);
    } else {
        is_regular = m == k ? kf_lu(k, a, factors, &determinant) : kf_qr(m, k, a, factors, &determinant);
    }
    for (j = 0; j < columns; ++j) {
        if (!is_regular) {
            for (i = 0; i < k; ++i) {
                x[j * k + i] = NAN;
            }
        } else if (m < k) {
            least_norm(k, m, factors, b + j * m, x + j * k);
        } else if (m == k) {
            kf_lu_solve(k, factors, b + j * m, x + j * k);
        } else {
            kf_qr_solve(m, k, factors, b + j * m, x + j * k);
        }
    }
}
