/* Sine, cosine and atan2, the same on every platform; sine and cosine are cheaper than the C library's.
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

/* Veltkamp: the upper 26 bits of a, exactly; |a| < 2^996. */
static inline double kf_upper(double a)
{
    const double c = 134217729.0 * a;
    return c - (c - a);
}

/* atan2(y, x) in (-pi, pi], within one ulp; signed zeros, infinities and NaN as in C99.
 *
 *     atan(y/x) = atan t + atan r,  r = (y - t x)/(x + t y)     t of 0, 1/2, 1, 3/2, infinity; |r| <= 7/16
 *
 * Breakpoints and polynomial are fdlibm's. The multiple of pi/2 and atan t are one constant in two parts, so that there
 * is one last sum; y - t x is exact up to the rounding of r, and for t = 0 the remainder of the quotient is added.
 */
static inline double kf_atan2(double y, double x)
{
#ifdef KF_LIBRARY_SINCOS
    return atan2(y, x);
#else
    static const double upper[2][5] = {
        {0.0, 4.63647609000806093515e-01, 7.85398163397448278999e-01, 9.82793723247329054082e-01,
            1.57079632679489655800e+00},
        {3.14159265358979311600e+00, 2.67794504458898696697e+00, 2.35619449019234483700e+00, 2.15879893034246395089e+00,
            1.57079632679489655800e+00},
    };
    static const double lower[2][5] = {
        {0.0, 2.26987774529616870924e-17, 3.06161699786838301793e-17, 1.39033110312309984516e-17,
            6.12323399573676603587e-17},
        {1.22464679914735320717e-16, 1.55277053693031466809e-16, 9.18485099360514843750e-17, 2.19583671346019967064e-16,
            6.12323399573676603587e-17},
    };
    const int left = signbit(x) != 0;
    double b = fabs(y), a = fabs(x), t, r, z, w, tail = 0.0, angle;
    int k;
    if (a != a || b != b) {
        return x + y;
    }
    if (a > 1e300 || b > 1e300) { /* sums and splits stay finite; of infinities the ratio counts */
        const int endless = isinf(a) || isinf(b);
        a = endless ? (isinf(a) ? 1.0 : 0.0) : a * 0x1p-40;
        b = endless ? (isinf(b) ? 1.0 : 0.0) : b * 0x1p-40;
    } else if (a < 1e-150 && b < 1e-150) { /* exact products stay above the smallest number */
        a *= 0x1p+600;
        b *= 0x1p+600;
    }
    if (b == 0.0) {
        return copysign(upper[left][0], y);
    }
    k = b < 0.4375 * a ? 0 : b < 0.6875 * a ? 1 : b < 1.1875 * a ? 2 : b < 2.4375 * a ? 3 : 4;
    if (k == 0) {
        r = b / a;
        if (r > 1e-9) { /* below, r is atan r and the remainder less than half an ulp of it */
            const double ru = kf_upper(r), au = kf_upper(a), p = r * a;
            const double rest = ((ru * au - p) + ru * (a - au) + (r - ru) * au) + (r - ru) * (a - au);
            tail = ((b - p) - rest) / a;
        }
    } else if (k == 4) {
        r = -a / b;
    } else {
        const double au = kf_upper(a);
        t = 0.5 * k;
        r = ((b - t * au) - t * (a - au)) / (a + t * b);
    }
    z = r * r;
    w = z * z;
    tail -= r * (z * (3.33333333333329318027e-01 + w * (1.42857142725034663711e-01 + w * (9.09088713343650656196e-02
        + w * (6.66107313738753120669e-02 + w * (4.97687799461593236017e-02 + w * 1.62858201153657823623e-02)))))
        + w * (-1.99999999998764832476e-01 + w * (-1.11111104054623557880e-01 + w * (-7.69187620504482999495e-02
        + w * (-5.83357013379057348645e-02 + w * -3.65315727442169155270e-02)))));
    if (left) {
        r = -r;
        tail = -tail;
    }
    angle = k == 0 && !left ? r + tail : upper[left][k] + (r + (lower[left][k] + tail));
    return copysign(angle, y);
#endif
}

#endif
