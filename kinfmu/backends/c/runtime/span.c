/* Span: what is interpolated across a singular point, from six regular poses around it. See kinfmu/solver/span.py. */
#include "way.h"

static const double inner_places[4] = {-2.0, -1.0, 1.0, 2.0}; /* of the nodes, in half widths */
static const double outer_places[4] = {-4.0, -2.0, 2.0, 4.0};
static const int inner_nodes[4] = {1, 2, 3, 4};
static const int outer_nodes[4] = {0, 1, 4, 5};

/* Take a pose for a node. */
void kf_span_node(kf_span *span, int place, kf_pose *node, const kf_model *model)
{
    const size_t size = KF_UNKNOWNS * sizeof(double);
    kf_tangent(model, node);
    span->u[place] = KF_POSE_U(node)[0];
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

/* The nodes in the opposite order. */
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
void kf_combined(const kf_span *span, double half, int count, const int *nodes, double weights[][3], double *z)
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
    double weights[4][3];
    kf_weights(4, inner_places, 0.0, weights);
    kf_combined(span, span->half, 4, inner_nodes, weights, z);
}

/* Largest difference of what the inner and the outer nodes say at the centre, in radians and sizes. */
double kf_span_apart(const kf_span *span)
{
    double weights[4][3], inner[KF_ROOM(KF_UNKNOWNS)], outer[KF_ROOM(KF_UNKNOWNS)], apart = 0.0;
    int k;
    kf_span_middle(span, inner);
    kf_weights(4, outer_places, 0.0, weights);
    kf_combined(span, span->half, 4, outer_nodes, weights, outer);
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        apart = fmax(apart, fabs(inner[k] - outer[k]) / kf_unknown_scales[k]);
    }
    return apart;
}

/* z and its two derivatives with respect to the driver at x = (u - centre) / half, from four of the nodes. */
static void read_at(const kf_span *span, const double *places, const int *nodes, double x, double *z, double *zd,
                    double *zdd)
{
    const double half = span->half, per_x = 1.0 / half;
    int i, k;
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        double samples[4][3], values[3];
        kf_hermite polynomial;
        for (i = 0; i < 4; ++i) {
            samples[i][0] = span->z[nodes[i]][k];
            samples[i][1] = span->zd[nodes[i]][k] * half;
            samples[i][2] = span->zdd[nodes[i]][k] * half * half;
        }
        kf_hermite_through(4, places, (const double(*)[3])samples, &polynomial);
        kf_hermite_at(&polynomial, x, values);
        z[k] = values[0];
        zd[k] = values[1] * per_x;
        zdd[k] = values[2] * per_x * per_x;
    }
}

/* By the inner nodes: these give the numbers. */
void kf_span_read(const kf_span *span, double x, double *z, double *zd, double *zdd)
{
    read_at(span, inner_places, inner_nodes, x, z, zd, zdd);
}

/* What the outer nodes say less than the inner ones: the error estimate. */
void kf_span_difference(const kf_span *span, double x, double *z, double *zd, double *zdd)
{
    double outer[3][KF_ROOM(KF_UNKNOWNS)];
    int k;
    read_at(span, inner_places, inner_nodes, x, z, zd, zdd);
    read_at(span, outer_places, outer_nodes, x, outer[0], outer[1], outer[2]);
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        z[k] -= outer[0][k];
        zd[k] -= outer[1][k];
        zdd[k] -= outer[2][k];
    }
}
