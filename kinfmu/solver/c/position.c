/* Position: a model's pose at driver values, predicted, corrected block after block, and judged. */
#include <math.h>

#include "kinfmu.h"

#define KF_ROUND_OFF 4e-16 /* residual relative to the size that Newton may end at: see kinfmu/codegen/newton.py */

/* Return the largest residual of the watches. */
static inline double watched(const kf_model *model, const kf_found *found)
{
    double watches[KF_ROOM(KF_WATCHES)], largest = 0.0, total = 0.0;
    int k;
    kf_watches(model, found, watches);
    for (k = 0; k < KF_WATCHES; ++k) {
        const double gap = fabs(watches[k]);
        largest = largest > gap ? largest : gap;
        total += gap; /* a NaN stays */
    }
    return total < INFINITY ? largest : total;
}

/* Return whether a block is outside the track that is followed. */
inline bool kf_is_outside(const kf_model *model, int block)
{
#if KF_HAS(KF_TRACKS)
    return model->track != 0 && model->outside[block];
#else
    (void)model;
    (void)block;
    return false;
#endif
}

#if KF_HAS(KF_MIXES)
/* The largest length of the residuals of the blocks that are followed: others do not close while they rest. */
static double own_residual(const kf_model *model, const kf_found *found)
{
    double residuals[KF_ROOM(KF_ROWS)], largest = 0.0, total = 0.0;
    int block, k;
    for (block = 0; block < KF_BLOCKS; ++block) {
        double square = 0.0;
        if (kf_is_outside(model, block)) {
            continue;
        }
        kf_residuals(model, found, block, residuals);
        for (k = 0; k < kf_block_rows[block]; ++k) {
            square += residuals[k] * residuals[k];
        }
        largest = square > largest ? square : largest;
        total += square; /* a NaN stays */
    }
    return sqrt(total < INFINITY ? largest : total);
}
#endif

/* Newton from a prediction, and its determinants, in a model's unit; -1, or the block that failed. */
static inline int solved(const kf_model *model, const double *z, const bool *held, double enough, kf_found *found)
{
    kf_newton newton = {0.0, 0.0, 0.0, 0.0, 0};
    int k, failed;
    newton.enough = enough;
    failed = kf_solve_blocks(model, z, held, found, &newton);
    if (failed >= 0) {
        found->residual = sqrt(newton.failed);
        return failed;
    }
    found->margin = KF_BLOCKS > 0 ? INFINITY : 1.0;
    for (k = 0; k < KF_BLOCKS; ++k) {
        double size;
        if (kf_is_outside(model, k)) {
            found->determinants[k] = 1.0;
            continue;
        }
        found->determinants[k] *= kf_determinant_factors[k];
        size = fabs(found->determinants[k]);
        found->margin = k == 0 || size < found->margin ? size : found->margin;
    }
    found->residual = sqrt(newton.total < INFINITY ? newton.largest : newton.total);
    found->iterations = newton.iterations;
#if KF_HAS(KF_MIXES)
    if (KF_MIXES && model->track != 0) {
        found->residual = own_residual(model, found);
    }
#endif
    return -1;
}

/* Return whether a block that is solved for is near a singular pose. */
static bool is_polished(const bool *held, const kf_found *found)
{
    int k;
    for (k = 0; k < KF_BLOCKS; ++k) {
        if (fabs(found->determinants[k]) < KF_POLISHED && !(held != NULL && held[k])) {
            return true;
        }
    }
    return false;
}

/* Go on near a singular pose until the residual no longer falls; keep the pose if the residual does not fall. */
static KF_RARE void polish(const kf_model *model, const bool *held, kf_found *found)
{
    kf_found before;
    if (!is_polished(held, found)) {
        return;
    }
    KF_ASSIGN(&before, found);
    if (solved(model, before.x, held, 0.0, found) >= 0 || !(found->residual <= before.residual)) {
        KF_ASSIGN(found, &before);
        return;
    }
    found->iterations += before.iterations;
}

inline int kf_position(const kf_model *model, const double *u, const double *z, const double *zd, const double *zdd,
                       double s, const bool *held, kf_found *found)
{
    double predicted[KF_ROOM(KF_UNKNOWNS)];
    double *const x = found->x;
    int k, failed;
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        predicted[k] = x[k] = z[k] + s * (zd[k] + 0.5 * s * zdd[k]);
    }
    for (k = 0; k < KF_DRIVERS; ++k) {
        x[KF_COORDINATES - KF_DRIVERS + k] = u[k];
    }
#if KF_HAS(KF_TRACKS)
    bool given[KF_BLOCKS];
    if (model->track != 0) {
        int place = 0;
        for (k = 0; k < KF_BLOCKS; ++k) {
            given[k] = model->outside[k] || (held != NULL && held[k]);
            for (; place < kf_block_ends[k]; ++place) {
                predicted[place] = x[place] = model->outside[k] ? model->kept[place] : x[place];
            }
        }
        held = given;
    }
#endif
    failed = solved(model, z, held, KF_ROUND_OFF * KF_ROUND_OFF, found);
    if (failed >= 0) {
        return failed;
    }
    found->moved = 0.0;
    for (k = 0; found->iterations && k < KF_UNKNOWNS; ++k) {
        const double moved = fabs(x[k] - predicted[k]) / kf_unknown_scales[k];
        found->moved = moved > found->moved ? moved : found->moved;
    }
    if (found->margin < KF_POLISHED) {
        polish(model, held, found);
    }
#if KF_HAS(KF_TRACKS)
    if (model->track != 0) {
        found->watch = 0.0; /* watches belong to the whole model */
        return -1;
    }
#endif
    found->watch = watched(model, found);
    return -1;
}
