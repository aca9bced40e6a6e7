/* Sine and cosine, the same on every platform and cheaper than the C library's.
 *
 *     x = n pi/2 + r, |r| <= pi/4     with pi/2 in two parts (Cody and Waite)
 *     sin r, cos r                    by fdlibm's polynomials, summed in pairs, which lets less wait for less (Estrin)
 *
 * Within 1.3e-16 up to 2^20 quarter turns; beyond, where n times the first part is rounded, half an ulp of x more.
 */
#ifndef KF_SINCOS_H
#define KF_SINCOS_H

#include <math.h>
#include <stdint.h>
#include <string.h>

/* r, and n modulo 4 in the last bits of `turns`. */
static inline double kf_reduced(double x, uint64_t *turns)
{
    const double whole = 6755399441055744.0; /* 1.5 2^52: a sum with it ends at the units */
    const double sum = x * 0.63661977236758134308 + whole, n = sum - whole;
    memcpy(turns, &sum, sizeof sum);
    return (x - n * 1.57079632673412561417e+00) - n * 6.07710050650619224932e-11;
}

static inline void kf_near_zero(double r, double *sine, double *cosine)
{
    const double z = r * r, z2 = z * z, z4 = z2 * z2;
    const double half = 0.5 * z, one = 1.0 - half;
    *sine = r + r * z * ((-1.66666666666666324348e-01 + z * 8.33333333332248946124e-03)
        + z2 * (-1.98412698298579493134e-04 + z * 2.75573137070700676789e-06)
        + z4 * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10));
    *cosine = one + (((1.0 - one) - half) + z2 * ((4.16666666666666019037e-02 - z * 1.38888888888741095749e-03)
        + z2 * (2.48015872894767294178e-05 - z * 2.75573143513906633035e-07)
        + z4 * (2.08757232129817482790e-09 - z * 1.13596475577881948265e-11)));
}

static inline void kf_sincos(double x, double *sine, double *cosine)
{
#ifdef KF_LIBRARY_SINCOS /* for tests: what Python has */
    *sine = sin(x);
    *cosine = cos(x);
#else
    uint64_t turns;
    double s, c;
    kf_near_zero(kf_reduced(x, &turns), &s, &c);
    if (turns & 1u) {
        const double kept = s;
        s = c;
        c = -kept;
    }
    if (turns & 2u) {
        s = -s;
        c = -c;
    }
    *sine = s;
    *cosine = c;
#endif
}

/* The same without branches, so that compilers lay many of them side by side. */
static inline void kf_sincos_lane(double x, double *sine, double *cosine)
{
    uint64_t turns, swap, s, c;
    double of_sine, of_cosine;
    kf_near_zero(kf_reduced(x, &turns), &of_sine, &of_cosine);
    memcpy(&s, &of_sine, sizeof s);
    memcpy(&c, &of_cosine, sizeof c);
    swap = (s ^ c) & (0u - (turns & 1u));
    s ^= swap ^ ((turns & 2u) << 62);
    c ^= swap ^ (((turns + 1u) & 2u) << 62);
    memcpy(sine, &s, sizeof s);
    memcpy(cosine, &c, sizeof c);
}

static inline double kf_sin(double x)
{
    double sine, cosine;
    kf_sincos(x, &sine, &cosine);
    return sine;
}

static inline double kf_cos(double x)
{
    double sine, cosine;
    kf_sincos(x, &sine, &cosine);
    return cosine;
}

#endif
