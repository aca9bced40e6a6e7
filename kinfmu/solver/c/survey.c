/* Surveying: what a pose near a singular point tells of it. See surveyed in kinfmu/solver/python/advance.py. */
#include "way.h"

/* A pose beside another on the side where a block's determinant grows; NULL if there is none. */
static kf_pose *beside(kf_solver *solver, kf_pose *pose, int block, double distance)
{
    int k;
    for (k = 0; k < 2; ++k) {
        const kf_pose *const other = kf_plainly(solver, pose, KF_HERE(solver, pose) + (k == 0 ? distance : -distance));
        if (other != NULL && fabs(other->found.determinants[block]) > fabs(pose->found.determinants[block])) {
            solver->scratch.beside = *other; /* walks start from it */
            return &solver->scratch.beside;
        }
    }
    return NULL;
}

/* The road with what is new at a trial pose: a bridge, if it has come near the window of a singular point; a searched
 * stretch, if no bridge holds there. The road as it was, if nothing is new.
 */
int kf_surveyed(kf_solver *solver, kf_pose *pose, kf_pose *trial)
{
    const double here = KF_HERE(solver, trial), reach = kf_reach[KF_ALONG(solver)];
    const double *const determinants = trial->found.determinants;
    int road = trial->road, block = 0, k;
    kf_pose *before;
    while (block < KF_BLOCKS && !(fabs(determinants[block]) < KF_REGULAR && !kf_knows(solver, road, here, block))) {
        ++block;
    }
    if (block == KF_BLOCKS) {
        return road;
    }
    for (k = 0; kf_driver_is_angle[KF_ALONG(solver)] && road >= 0 && k < KF_MAP(solver)->roads[road].bridges; ++k) {
        const int again = kf_moved(solver, KF_MAP(solver)->roads[road].bridge[k], pose, here);
        if (again >= 0) {
            return kf_with_bridge(solver, road, again);
        }
    }
    before = fabs(here - KF_HERE(solver, pose)) > 1e-3 * reach ? pose : beside(solver, trial, block, 0.02 * reach);
    for (; before != NULL && block < KF_BLOCKS; ++block) { /* upstream first */
        const double from = KF_HERE(solver, before), of_from = before->found.determinants[block];
        kf_searched searched;
        double zero;
        int bridge;
        if (!(fabs(determinants[block]) < KF_REGULAR) || kf_knows(solver, trial->road, here, block)
            || !kf_secant_zero(from, of_from, here, determinants[block], &zero)
            || fabs(zero - here) > 1.05 * KF_HALF_WIDTH * reach || kf_knows(solver, road, zero, block)) {
            continue;
        }
        bridge = kf_build(solver, before, block, zero);
        searched.block = block;
        if (bridge < 0) {
            searched.low = zero - 2.0 * KF_HALF_WIDTH * reach;
            searched.high = zero + 2.0 * KF_HALF_WIDTH * reach;
        } else if (kf_knows(solver, road, KF_MAP(solver)->bridges[bridge].centre, block)) {
            searched.low = fmin(here, KF_MAP(solver)->bridges[bridge].centre);
            searched.high = fmax(here, KF_MAP(solver)->bridges[bridge].centre);
        } else {
            return kf_with_bridge(solver, road, bridge);
        }
        road = kf_with_searched(solver, road, searched);
    }
    return road;
}
