/* Limits: driver values where a path ends, and why. See kinfmu/solver/python/limit.py. */
#include "internal.h"

#define VANISHING 1e-6 /* [sizes] of a length that a law gives: where steps end there, it would be negative beyond */

/* Move the limit past the last pose, to where a number vanishes that is `far` at the pose before and `near` at the last. */
static void extrapolate(const kf_pose *before, const kf_pose *pose, double near, double far, kf_limit *limit)
{
    int k;
    for (k = 0; far > near && k < KF_DRIVERS; ++k) {
        limit->u[k] += (KF_POSE_U(pose)[k] - KF_POSE_U(before)[k]) * (near / (far - near));
    }
}

/* Return where the path ends, just beyond a pose that steps cannot leave.
 *
 * Near a dead centre the tangent grows without bound, and determinant^2 falls linearly along the path: the secant rule
 * on the last two poses gives its zero. Where branches cross the determinant itself falls linearly.
 */
void kf_limit_beyond(kf_solver *solver, const kf_pose *before, kf_pose *pose, const double *direction, kf_limit *limit)
{
    const double *const determinants = pose->found.determinants;
    double near, far, steepest = 0.0;
    int k;
#if KF_LAWS
    double lengths[KF_LAWS], longer[KF_LAWS];
    kf_law_positions(&solver->model, &pose->found, lengths);
    kf_law_positions(&solver->model, &before->found, longer);
#endif
    memcpy(limit->u, KF_POSE_U(pose), sizeof limit->u);
    limit->crosses = false;
#if KF_LAWS
    for (k = KF_LAW_ARGUMENTS; k < KF_LAW_ARGUMENTS + KF_LAW_LENGTHS; ++k) {
        if (lengths[k] < VANISHING * kf_size) {
            extrapolate(before, pose, lengths[k], longer[k], limit);
            limit->block = KF_NEGATIVE;
            return;
        }
    }
#endif
    limit->block = KF_BLOCKS > 0 ? 0 : KF_NO_BLOCK;
    if (KF_BLOCKS == 0) {
        return;
    }
    for (k = 1; k < KF_BLOCKS; ++k) {
        limit->block = fabs(determinants[k]) < fabs(determinants[limit->block]) ? k : limit->block;
    }
    if (KF_IS_ONE(solver)) {
        kf_tangent(&solver->model, pose);
    } else {
        KF_VELOCITY(&solver->model, &pose->found, direction, NULL, NULL, pose->x1);
    }
    for (k = kf_first_of(limit->block); k < kf_block_ends[limit->block]; ++k) {
        steepest = fmax(steepest, fabs(pose->x1[k]) / kf_unknown_scales[k]);
    }
    limit->crosses = steepest * (KF_IS_ONE(solver) ? kf_reach[KF_ALONG(solver)] : 1.0) < KF_STEEP;
    near = fabs(determinants[limit->block]);
    far = fabs(before->found.determinants[limit->block]);
    if (!limit->crosses) {
        near *= near;
        far *= far;
    }
    extrapolate(before, pose, near, far, limit);
}

/* Return whether the target lies past the limit in the direction of s. */
bool kf_is_beyond(const double *target, const double *limit, const double *direction, double s)
{
    double sum = 0.0;
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        sum += (target[k] - limit[k]) * direction[k] * s;
    }
    return sum > 0.0;
}

/* Append why a target cannot be reached, in one line. */
void kf_append_limit(char *message, const kf_limit *limit, const double *target, int driver)
{
    int k;
    if (limit->block == KF_TOO_FAR) {
        kf_append_place(message, target, KF_ROUGHLY, driver);
        kf_append(message, " is too far from ");
        kf_append_place(message, limit->u, KF_ROUGHLY, driver);
        kf_append(message, ": more than %d steps on one path", KF_MOST_STEPS);
        return;
    }
    if (!kf_differs(target, limit->u, KF_LOCATED)) {
        kf_append_place(message, target, KF_LOCATED, driver);
        kf_append(message, " cannot be reached: to these digits it is the limit");
    } else {
        kf_append_place(message, target, kf_differs(target, limit->u, KF_ROUGHLY) ? KF_ROUGHLY : KF_LOCATED, driver);
        kf_append(message, " cannot be reached: the limit is ");
        kf_append_place(message, limit->u, KF_LOCATED, driver);
    }
    if (limit->block == KF_NEGATIVE) {
        kf_append(message, "; beyond it a distance would be negative");
        return;
    }
    kf_append(message, limit->crosses ? ", where branches of " : "; beyond it ");
    kf_append(message, limit->block == KF_NO_BLOCK ? "the joints" : limit->crosses ? "" : "the loop of ");
    for (k = kf_first_of(limit->block); limit->block >= 0 && k < kf_block_ends[limit->block]; ++k) {
        kf_append(message, "%s%s", k == kf_first_of(limit->block) ? "" : ", ", kf_unknown_names[k]);
    }
    kf_append(message, limit->crosses ? " cross" : " cannot close");
    if (limit->crosses && KF_DRIVERS > 1 && driver < 0) {
        kf_append(message, "; the crossing depends on several drivers, so no bridge is built");
    }
}
