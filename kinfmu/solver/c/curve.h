/* Pieces of a function of one variable: see kinfmu/solver/python/curve.py. */
#ifndef KF_CURVE_H
#define KF_CURVE_H

typedef struct {
    double origin;
    int count; /* of the coefficients, highest power first */
    const double *coefficients;
    double amplitude, frequency, phase;
} kf_piece;

typedef struct {
    int count; /* of the pieces; one break less */
    const double *breaks;
    const kf_piece *pieces;
} kf_curve;

double kf_curve_at(const kf_curve *curve, int order, double x);

#endif
