/* Survey: find the singular points near a pose and bridge them. See kinfmu/solver/python/survey.py. */
#include "internal.h"

/* Return a pose at a distance from another, on the side where a block's determinant grows; NULL if there is none. */
static kf_pose *nearby(kf_solver *solver, kf_pose *pose, int block, double distance)
{
    int k;
    for (k = 0; k < 2; ++k) {
        const kf_pose *const other = kf_follow_path(solver, pose, KF_HERE(solver, pose) + (k == 0 ? distance : -distance));
        if (other != NULL && fabs(other->found.determinants[block]) > fabs(pose->found.determinants[block])) {
            solver->scratch.nearby = *other; /* paths start from it */
            return &solver->scratch.nearby;
        }
    }
    return NULL;
}

/* Return whether the secant through two poses next to each other has all zeros of low determinants far off; block: the
 * first that is low.
 */
static bool is_far_off(const kf_solver *solver, const kf_pose *pose, const kf_pose *trial, int block)
{
    const double here = KF_HERE(solver, trial), from = KF_HERE(solver, pose);
    const double *const after = trial->found.determinants, *const before = pose->found.determinants;
    double zero;
    for (; block < KF_BLOCKS; ++block) {
        if (fabs(after[block]) < KF_REGULAR && !kf_knows(solver, trial->map, here, block)
            && !(kf_secant_zero(from, before[block], here, after[block], &zero)
                 && fabs(zero - here) > KF_FAR_OFF * KF_HALF_WIDTH * kf_reach[KF_ALONG(solver)])) {
            return false;
        }
    }
    return true;
}

/* Return the singularity map with what a trial pose shows: the map itself if that is nothing new.
 *
 * New is a bridge, where the trial comes near a singular point, or a searched interval, where no bridge holds.
 */
int kf_surveyed(kf_solver *solver, kf_pose *pose, kf_pose *trial)
{
    const double here = KF_HERE(solver, trial), reach = kf_reach[KF_ALONG(solver)];
    const double *const determinants = trial->found.determinants;
    int map = trial->map, block = 0, k;
    kf_pose *before = pose;
    while (block < KF_BLOCKS && !(fabs(determinants[block]) < KF_REGULAR && !kf_knows(solver, map, here, block))) {
        ++block;
    }
    if (block == KF_BLOCKS) {
        return map;
    }
    for (k = 0; kf_driver_is_angle[KF_ALONG(solver)] && map >= 0 && k < KF_POOL(solver)->maps[map].bridges; ++k) {
        const int again = kf_moved(solver, KF_POOL(solver)->maps[map].bridge[k], pose, here);
        if (again >= 0) {
            return kf_with_bridge(solver, map, again);
        }
    }
    if (fabs(here - KF_HERE(solver, pose)) <= KF_NEXT_TO * reach) {
        if (is_far_off(solver, pose, trial, block)) {
            return map;
        }
        before = nearby(solver, trial, block, 0.02 * reach);
    }
    for (; before != NULL && block < KF_BLOCKS; ++block) { /* upstream first */
        const double from = KF_HERE(solver, before), of_from = before->found.determinants[block];
        kf_interval searched;
        double zero;
        int bridge;
        if (!(fabs(determinants[block]) < KF_REGULAR) || kf_knows(solver, trial->map, here, block)
            || !kf_secant_zero(from, of_from, here, determinants[block], &zero)
            || fabs(zero - here) > 1.05 * KF_HALF_WIDTH * reach || kf_knows(solver, map, zero, block)) {
            continue;
        }
        bridge = kf_build(solver, before, block, zero);
        searched.block = block;
        if (bridge < 0) {
            searched.low = zero - 2.0 * KF_HALF_WIDTH * reach;
            searched.high = zero + 2.0 * KF_HALF_WIDTH * reach;
        } else if (kf_knows(solver, map, KF_POOL(solver)->bridges[bridge].centre, block)) {
            searched.low = fmin(here, KF_POOL(solver)->bridges[bridge].centre);
            searched.high = fmax(here, KF_POOL(solver)->bridges[bridge].centre);
        } else {
            return kf_with_bridge(solver, map, bridge);
        }
        map = kf_with_interval(solver, map, searched);
    }
    return map;
}
