/* Sine and cosine without branches, so that compilers lay many of them side by side. */
#ifndef KF_SINCOS_H
#define KF_SINCOS_H

#include <stdbool.h>

/* Within an ulp or so, for angles of up to some 1e5 turns. */
static inline void kf_sincos(double x, double *sine, double *cosine)
{
    /* x = n pi/2 + r with pi/2 in three parts (Cody and Waite), sine and cosine of r by fdlibm's polynomials */
    const double n = __builtin_rint(x * 0.63661977236758134308);
    const double r = ((x - n * 1.57079632673412561417e+00) - n * 6.07710050630396597660e-11) - n * 2.02226624879595063154e-21;
    const double z = r * r;
    const double s = r + r * z * (-1.66666666666666324348e-01 + z * (8.33333333332248946124e-03
        + z * (-1.98412698298579493134e-04 + z * (2.75573137070700676789e-06
        + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))));
    const double half = 0.5 * z, one = 1.0 - half;
    const double c = one + (((1.0 - one) - half) + z * z * (4.16666666666666019037e-02
        + z * (-1.38888888888741095749e-03 + z * (2.48015872894767294178e-05
        + z * (-2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 - z * 1.13596475577881948265e-11))))));
    const double quarter = n - 4.0 * __builtin_floor(0.25 * n); /* 0, 1, 2, 3 */
    const bool odd = quarter == 1.0 || quarter == 3.0;
    const double a = odd ? c : s, b = odd ? s : c;
    *sine = quarter >= 2.0 ? -a : a;
    *cosine = quarter == 1.0 || quarter == 2.0 ? -b : b;
}

#endif
