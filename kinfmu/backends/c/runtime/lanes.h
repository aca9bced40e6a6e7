/* Lanes: many samples side by side, one in each lane of the processor's vectors.
 *
 * A batch of samples is predicted, corrected by Newton and checked; what does not pass the check is left to the solver,
 * sample by sample. x, x1, x2 are those of kinfmu.h, with a number for each lane.
 */
#ifndef KF_LANES_H
#define KF_LANES_H

#include "kinfmu.h"
#include "lane_sizes.h"
#include "sincos.h"

#if defined(__clang__)
#define KF_SIDE_BY_SIDE _Pragma("clang loop vectorize(enable)")
#elif defined(__GNUC__)
#define KF_SIDE_BY_SIDE _Pragma("GCC ivdep")
#else
#define KF_SIDE_BY_SIDE
#endif

/* As many lanes as the first caches hold. */
#define KF_LANES (KF_COORDINATES <= 64 ? 256 : 32)

/* x, x1, x2, outputs: where the numbers of each coordinate and of each output that is a formula go: rooms of their own, or
 * straight into a table.
 */
typedef struct {
    double *x[KF_COORDINATES], *x1[KF_COORDINATES], *x2[KF_COORDINATES];
    double *outputs[3][KF_ROOM(KF_OUTPUTS)];
    double hold[KF_ROOM(KF_LANE_HOLD)][KF_LANES];
    double watches[KF_ROOM(KF_WATCHES)][KF_LANES];
    double error[KF_LANES];  /* largest of the blocks' squared residuals, relative to the size */
    double margin[KF_LANES]; /* smallest |determinant| */
    double moved[KF_LANES];  /* correction of the prediction, in radians and sizes */
    double coordinate_rooms[3][KF_COORDINATES][KF_LANES];
    double output_rooms[3][KF_ROOM(KF_OUTPUTS)][KF_LANES];
} kf_lanes;

/* From predictions in x (and speeds and accelerations of the drivers at the ends of x1 and x2) to the motion. Generated.
 * full: with rates and accelerations.
 */
void kf_lanes_solve(const kf_model *model, kf_lanes *lanes, bool full);

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
