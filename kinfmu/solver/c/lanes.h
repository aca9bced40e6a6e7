/* Lanes: many samples side by side, one in each lane of the processor's vectors.
 *
 * A batch of samples is predicted, corrected by Newton and checked; samples that fail the check are left to the solver,
 * one by one. x, x1, x2 are those of kinfmu.h, with a number for each lane.
 */
#ifndef KF_LANES_H
#define KF_LANES_H

#include <math.h>

#include "kinfmu.h"
#include "lane_sizes.h"
#include "vectors.h"

#define KF_LANES (KF_COORDINATES <= 64 ? 64 : 32) /* as many as the first caches hold */
#define KF_VECTOR 8 /* lanes that are predicted at once, and may be past the last one */

/* z, sine, cosine: predicted unknowns, and sine and cosine of angles, which are corrected in place. hold: the stage cache.
 * rows: KF_LANES rows of a table.
 */
typedef struct {
    double x[KF_COORDINATES][KF_LANES], x1[KF_COORDINATES][KF_LANES], x2[KF_COORDINATES][KF_LANES];
    double outputs[3][KF_ROOM(KF_OUTPUTS)][KF_LANES];
    double z[KF_ROOM(KF_UNKNOWNS)][KF_LANES + KF_VECTOR];
    double angles[2][KF_UNKNOWNS + 1][KF_LANES + KF_VECTOR]; /* sines and cosines: of unknown angles, and of the driver's */
    double *sine[KF_COORDINATES], *cosine[KF_COORDINATES]; /* of each coordinate; NULL: not predicted */
    double hold[KF_ROOM(KF_LANE_HOLD)][KF_LANES];
    double watches[KF_ROOM(KF_WATCHES)][KF_LANES];
    double error[KF_LANES];  /* largest of the blocks' squared residuals, relative to the size */
    double margin[KF_LANES]; /* smallest |determinant| */
    double moved[KF_LANES];  /* correction of the prediction, in radians and sizes */
    double rows[KF_ROOM(KF_OUTPUTS) * KF_LANES];
} kf_lanes;

/* Generated. Place of each coordinate's sine and cosine among those of the unknown angles and, last, of the driver's angle;
 * -1: they are not predicted.
 */
extern const int kf_lane_angles[KF_COORDINATES];

/* From predictions to positions, residuals and watches; and from there, with speeds and accelerations of the drivers at the
 * ends of x1 and x2, to rates and accelerations. held: blocks whose unknowns are given in x, x1, x2; NULL: none. Generated.
 */
void kf_lanes_position(const kf_model *model, kf_lanes *lanes, const bool *held);
void kf_lanes_motion(const kf_model *model, kf_lanes *lanes, const bool *held);

#ifdef FP_FAST_FMA
#define KF_FMA(a, b, c) fma(a, b, c)
#else
#define KF_FMA(a, b, c) ((a) * (b) + (c))
#endif

/* Sine and cosine of an angle that changes by a small step, below 2e-3. */
static inline void kf_rotate(double step, double *sine, double *cosine)
{
    const double square = step * step;
    const double ds = step - step * square * (1.0 / 6.0);
    const double dc = square * (square * (1.0 / 24.0) - 0.5);
    const double s = *sine, c = *cosine;
    *sine = s + (s * dc + c * ds);
    *cosine = c + (c * dc - s * ds);
}

/* The same for a step of up to pi/4, by fdlibm's polynomials, from s and c. */
static inline void kf_turn(double step, double s, double c, double *sine, double *cosine)
{
    const double z = step * step;
    const double p = KF_FMA(z, KF_FMA(z, KF_FMA(z, KF_FMA(z, KF_FMA(z, 1.58969099521155010221e-10,
        -2.50507602534068634195e-08), 2.75573137070700676789e-06), -1.98412698298579493134e-04),
        8.33333333332248946124e-03), -1.66666666666666324348e-01);
    const double r = KF_FMA(z, KF_FMA(z, KF_FMA(z, KF_FMA(z, KF_FMA(z, -1.13596475577881948265e-11,
        2.08757232129817482790e-09), -2.75573143513906633035e-07), 2.48015872894767294178e-05),
        -1.38888888888741095749e-03), 4.16666666666666019037e-02);
    const double ds = KF_FMA(step * z, p, step);
    const double dc = z * KF_FMA(z, r, -0.5); /* cosine of the step, less 1 */
    *sine = s + KF_FMA(s, dc, c * ds);
    *cosine = c + KF_FMA(c, dc, -s * ds);
}

#endif
