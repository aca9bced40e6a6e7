/* A piecewise function of one variable: see kinfmu/solver/python/curve.py. */
#include "curve.h"

#include "sincos.h"

/* Return n! / (n - order)!, the factor of the derivative of s^n. */
static double falling(int n, int order)
{
    double factor = 1.0;
    int k;
    for (k = 0; k < order; ++k) {
        factor *= n - k;
    }
    return factor;
}

/* Return the derivative of the given order (0: the value) at x. */
double kf_curve_at(const kf_curve *curve, int order, double x)
{
    int low = 0, high = curve->count - 1, k;
    const kf_piece *piece;
    double s, value;
    while (low < high) { /* a piece holds from its left break on */
        const int middle = (low + high) / 2;
        if (x < curve->breaks[middle]) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    piece = &curve->pieces[low];
    s = x - piece->origin;
    value = 0.0 * s; /* NaN stays NaN where a piece is constant */
    for (k = 0; k < piece->count - order; ++k) {
        value = value * s + falling(piece->count - 1 - k, order) * piece->coefficients[k];
    }
    if (piece->amplitude != 0.0) {
        const double angle = piece->frequency * s + piece->phase;
        const double wave = order % 2 ? kf_cos(angle) : kf_sin(angle);
        double scale = order % 4 < 2 ? piece->amplitude : -piece->amplitude;
        for (k = 0; k < order; ++k) {
            scale *= piece->frequency;
        }
        value += scale * wave;
    }
    return value;
}
