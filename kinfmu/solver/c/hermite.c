/* Two-sided Hermite interpolation from value and two derivatives at several nodes. See kinfmu/solver/python/hermite.py. */
#include "internal.h"

/* The polynomial of degree 3 n - 1 with given f, f', f'' at n nodes, in Newton's form on repeated nodes:
 *
 *     p(x) = sum_i c_i prod_{j<i} (x - x_j),   every node three times
 *
 * c by divided differences, where a difference over equal nodes is the derivative over its factorial.
 */
void kf_hermite_through(int count, const double *nodes, const double samples[][3], kf_hermite *polynomial)
{
    const int n = 3 * count;
    double *const repeated = polynomial->nodes;
    double column[3 * KF_MOST_NODES] = {0.0};
    int i, order;
    polynomial->count = n;
    for (i = 0; i < n; ++i) {
        repeated[i] = nodes[i / 3];
        column[i] = samples[i / 3][0];
    }
    polynomial->coefficients[0] = column[0];
    for (order = 1; order < n; ++order) {
        for (i = 0; i < n - order; ++i) {
            const double a = repeated[i], b = repeated[i + order];
            if (a == b) { /* three equal nodes at most: order 1 or 2 */
                column[i] = order == 1 ? samples[i / 3][1] : 0.5 * samples[i / 3][2];
            } else {
                column[i] = (column[i + 1] - column[i]) / (b - a);
            }
        }
        polynomial->coefficients[order] = column[0];
    }
}

/* p, p', p'' at x. */
void kf_hermite_at(const kf_hermite *polynomial, double x, double values[3])
{
    double value = 0.0, slope = 0.0, curve = 0.0;
    int i;
    for (i = polynomial->count - 1; i >= 0; --i) {
        const double d = x - polynomial->nodes[i];
        curve = curve * d + 2.0 * slope;
        slope = slope * d + value;
        value = value * d + polynomial->coefficients[i];
    }
    values[0] = value;
    values[1] = slope;
    values[2] = curve;
}

/* What f, f' and f'' of each node count for the value of the interpolating polynomial at x. */
void kf_weights(int count, const double *nodes, double x, double weights[][3])
{
    double samples[KF_MOST_NODES][3], values[3];
    kf_hermite polynomial;
    int k, order;
    memset(samples, 0, sizeof samples);
    for (k = 0; k < count; ++k) {
        for (order = 0; order < 3; ++order) {
            samples[k][order] = 1.0;
            kf_hermite_through(count, nodes, (const double(*)[3])samples, &polynomial);
            kf_hermite_at(&polynomial, x, values);
            weights[k][order] = values[0];
            samples[k][order] = 0.0;
        }
    }
}
