/* Lanes: many samples side by side, one in each lane of the processor's vectors.
 *
 * A batch of samples is predicted, corrected twice by Newton and checked; what does not pass the check is left to the
 * solver, sample by sample. x, x1, x2 are those of kinfmu.h, with a number for each lane.
 */
#ifndef KF_LANES_H
#define KF_LANES_H

#include "kinfmu.h"
#include "lane_sizes.h"

#if defined(__clang__)
#define KF_SIDE_BY_SIDE _Pragma("clang loop vectorize(enable)")
#elif defined(__GNUC__)
#define KF_SIDE_BY_SIDE _Pragma("GCC ivdep")
#else
#define KF_SIDE_BY_SIDE
#endif

/* As many lanes as the first caches hold. */
#define KF_LANES (KF_COORDINATES <= 64 ? 256 : KF_COORDINATES <= 512 ? 32 : 8)

typedef struct {
    double x[KF_COORDINATES][KF_LANES];
    double x1[KF_COORDINATES][KF_LANES];
    double x2[KF_COORDINATES][KF_LANES];
    double hold[KF_ROOM(KF_LANE_HOLD)][KF_LANES];
    double outputs[3][KF_ROOM(KF_OUTPUTS)][KF_LANES];
    double watches[KF_ROOM(KF_WATCHES)][KF_LANES];
    double error[KF_LANES];  /* sum of the squared residuals, relative to the size */
    double margin[KF_LANES]; /* smallest |determinant| */
    double moved[KF_LANES];  /* largest correction of the prediction, in radians and sizes */
} kf_lanes;

/* From predictions in x (and speeds and accelerations of the drivers at the ends of x1 and x2) to the motion. Generated.
 * full: with rates and accelerations.
 */
void kf_lanes_solve(const kf_model *model, kf_lanes *lanes, bool full);

/* Rounds as the processor's vectors do; the argument may be some 1e5 turns: beyond, use the solver. */
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

/* Sine and cosine of an angle that changes by a small step, below 1e-2. */
static inline void kf_rotate(double step, double *sine, double *cosine)
{
    const double square = step * step;
    const double ds = step * (1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0)));
    const double dc = -square * (0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0)));
    const double s = *sine, c = *cosine;
    *sine = s + (s * dc + c * ds);
    *cosine = c + (c * dc - s * ds);
}

#endif
