/* Span: interpolation across a singular point from six regular poses around it, by two-sided Hermite polynomials.
 * See kinfmu/solver/python/span.py.
 */
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

static const double inner_places[4] = {-2.0, -1.0, 1.0, 2.0}; /* of the nodes, in half widths */
static const double outer_places[4] = {-4.0, -2.0, 2.0, 4.0};
static const int inner_nodes[4] = {1, 2, 3, 4};
static const int outer_nodes[4] = {0, 1, 4, 5};

/* Weights of the nodes at the centre: kf_weights at 0 of the places above. */
static const double inner_weights[4][3] = {{-0.2901234567901234, -0.09722222222222143, -0.009259259259259522},
                                           {0.7901234567901234, 0.1481481481481488, 0.14814814814814792},
                                           {0.7901234567901234, -0.14814814814814814, 0.14814814814814814},
                                           {-0.2901234567901235, 0.09722222222222222, -0.009259259259259259}};
static const double outer_weights[4][3] = {{-0.2901234567901234, -0.19444444444444287, -0.03703703703703809},
                                           {0.7901234567901234, 0.2962962962962976, 0.5925925925925917},
                                           {0.7901234567901234, -0.2962962962962963, 0.5925925925925926},
                                           {-0.2901234567901235, 0.19444444444444445, -0.037037037037037035}};

/* Store a pose as a node. */
void kf_span_node(kf_span *span, int place, kf_pose *node, const kf_model *model)
{
    const size_t size = KF_UNKNOWNS * sizeof(double);
    kf_tangent(model, node);
    span->u[place] = KF_POSE_U(node)[KF_ALONG_OF(model)];
    memcpy(span->z[place], node->found.x, size);
    memcpy(span->zd[place], node->x1, size);
    memcpy(span->zdd[place], node->x2, size);
}

static void exchange(double *a, double *b, int count)
{
    int k;
    for (k = 0; k < count; ++k) {
        const double kept = a[k];
        a[k] = b[k];
        b[k] = kept;
    }
}

/* Reverse the order of the nodes. */
void kf_span_reverse(kf_span *span)
{
    int k;
    for (k = 0; k < KF_NODES / 2; ++k) {
        const int other = KF_NODES - 1 - k;
        exchange(&span->u[k], &span->u[other], 1);
        exchange(span->z[k], span->z[other], KF_UNKNOWNS);
        exchange(span->zd[k], span->zd[other], KF_UNKNOWNS);
        exchange(span->zdd[k], span->zdd[other], KF_UNKNOWNS);
    }
}

/* Blocks are interpolated where one of the determinants at the two nodes next to the centre is small. */
void kf_span_hold(kf_span *span, const double *before, const double *after)
{
    int k;
    for (k = 0; k < KF_BLOCKS; ++k) {
        span->held[k] = before[k] * after[k] <= 0.0 /* a steep one may be regular at both ends */
            || fmin(fabs(before[k]), fabs(after[k])) < KF_REGULAR;
    }
}

/* z of the Hermite polynomials through some nodes, at a place whose weights are known. */
void kf_combined(const kf_span *span, double half, int count, const int *nodes, const double weights[][3],
                 double *z)
{
    int i, k;
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        z[k] = 0.0;
    }
    for (i = 0; i < count; ++i) {
        const int node = nodes[i];
        const double w0 = weights[i][0], w1 = weights[i][1] * half, w2 = weights[i][2] * half * half;
        for (k = 0; k < KF_UNKNOWNS; ++k) {
            z[k] = z[k] + w0 * span->z[node][k] + w1 * span->zd[node][k] + w2 * span->zdd[node][k];
        }
    }
}

/* z at the centre by the inner nodes. */
void kf_span_middle(const kf_span *span, double *z)
{
    kf_combined(span, span->half, 4, inner_nodes, inner_weights, z);
}

/* Return the largest difference of the inner and the outer nodes at the centre, in radians and sizes. */
double kf_span_apart(const kf_span *span)
{
    double inner[KF_ROOM(KF_UNKNOWNS)], outer[KF_ROOM(KF_UNKNOWNS)], apart = 0.0;
    int k;
    kf_span_middle(span, inner);
    kf_combined(span, span->half, 4, outer_nodes, outer_weights, outer);
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        apart = fmax(apart, fabs(inner[k] - outer[k]) / kf_unknown_scales[k]);
    }
    return apart;
}

/* The polynomial of an unknown through four of the nodes, over x = (u - centre) / half. */
static void through(const kf_span *span, const double *places, const int *nodes, int unknown, kf_hermite *polynomial)
{
    const double half = span->half;
    double samples[4][3];
    int i;
    for (i = 0; i < 4; ++i) {
        samples[i][0] = span->z[nodes[i]][unknown];
        samples[i][1] = span->zd[nodes[i]][unknown] * half;
        samples[i][2] = span->zdd[nodes[i]][unknown] * half * half;
    }
    kf_hermite_through(4, places, (const double(*)[3])samples, polynomial);
}

/* Its value and two derivatives with respect to the driver. */
static void read_at(const kf_hermite *polynomial, double half, double x, double *z, double *zd, double *zdd)
{
    const double per_x = 1.0 / half;
    double values[3];
    kf_hermite_at(polynomial, x, values);
    *z = values[0];
    *zd = values[1] * per_x;
    *zdd = values[2] * per_x * per_x;
}

/* Make the inner polynomials, unless they are those that were read last: most samples in a window follow another one.
 * They are compared by the nodes they were made from, so that copied memory is valid, too.
 */
static void make_inner(const kf_span *span, kf_inner *inner)
{
    const size_t size = sizeof inner->z;
    int k;
    if (inner->half == span->half && memcmp(inner->z, span->z[1], size) == 0
        && memcmp(inner->zd, span->zd[1], size) == 0 && memcmp(inner->zdd, span->zdd[1], size) == 0) {
        return;
    }
    inner->half = span->half;
    memcpy(inner->z, span->z[1], size);
    memcpy(inner->zd, span->zd[1], size);
    memcpy(inner->zdd, span->zdd[1], size);
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        through(span, inner_places, inner_nodes, k, &inner->polynomials[k]);
    }
}

/* z and its two derivatives with respect to the driver at x = (u - centre) / half, by the inner nodes. */
void kf_span_read(const kf_span *span, kf_inner *inner, double x, double *z, double *zd, double *zdd)
{
    int k;
    make_inner(span, inner);
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        read_at(&inner->polynomials[k], span->half, x, &z[k], &zd[k], &zdd[k]);
    }
}

/* Return the difference of inner and outer nodes: the error estimate. */
void kf_span_difference(const kf_span *span, kf_inner *inner, double x, double *z, double *zd, double *zdd)
{
    int k;
    kf_span_read(span, inner, x, z, zd, zdd);
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        kf_hermite outer;
        double other[3];
        through(span, outer_places, outer_nodes, k, &outer);
        read_at(&outer, span->half, x, &other[0], &other[1], &other[2]);
        z[k] -= other[0];
        zd[k] -= other[1];
        zdd[k] -= other[2];
    }
}
