/* Mixed: blocks that depend on several drivers, where others depend on one. See kinfmu/solver/python/mixed.py. */
#include "internal.h"

#if KF_MIXES

/* Return the part of a pose of the whole mechanism with the blocks that depend on several drivers. */
static kf_pose *share_of(const kf_pose *whole, kf_pose *share)
{
    double margin = INFINITY;
    int block;
    *share = *whole;
    for (block = 0; block < KF_BLOCKS; ++block) {
        double *const determinant = &share->found.determinants[block];
        if (kf_block_drivers[block] == KF_MIXED) {
            margin = fmin(margin, fabs(*determinant));
        } else {
            *determinant = 1.0;
        }
    }
    share->found.margin = margin;
    return share;
}

/* Find the unknowns half way to u, of the tracks alone; false if the tracks end before it. */
static bool half_way(kf_solver *solver, kf_pose *pose, const double *u, kf_pose *there, double *z)
{
    double half[KF_DRIVERS];
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        half[k] = 0.5 * (KF_POSE_U(pose)[k] + u[k]);
    }
    if (!KF_GOOD(kf_assembled(solver, pose, half, half, pose->found.x, there))) {
        solver->message[0] = '\0';
        return false;
    }
    memcpy(z, there->found.x, KF_UNKNOWNS * sizeof *z);
    return true;
}

/* Take one step of all blocks, or find a failed pose if the tracks end before it; false if the blocks that depend on
 * several drivers cannot be trusted to stay on their branch, or if they may not close in between, because the tracks bend
 * away from their chord there.
 */
static bool mixed_step(kf_solver *solver, kf_pose *pose, const double *u, const double *target, kf_pose *there)
{
    kf_pose *const start = &solver->scratch.share[0], *const trial = &solver->scratch.share[1];
    double chord[KF_UNKNOWNS], path[KF_DRIVERS], middle[KF_UNKNOWNS], margin, bent = 0.0;
    bool is_trusted, has_middle;
    int k, iterations;
    margin = share_of(pose, start)->found.margin;
    has_middle = margin < KF_REGULAR / KF_FALL /* the step may end at a pose that is not regular */
                 && half_way(solver, pose, u, there, middle);
    if (!KF_GOOD(kf_assembled(solver, pose, u, target, pose->found.x, there))) {
        return true;
    }
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        chord[k] = there->found.x[k] - pose->found.x[k];
        if (fabs(chord[k]) / kf_unknown_scales[k] > KF_BENT) {
            return false;
        }
    }
    for (k = 0; k < KF_DRIVERS; ++k) {
        path[k] = u[k] - KF_POSE_U(pose)[k];
    }
    kf_enter_mixed(solver, there->found.x, chord);
    is_trusted = kf_trusted_step(solver, share_of(pose, start), path, 1.0, u, trial)
                 && (trial->found.margin >= KF_REGULAR || kf_keeps_branch(solver, start, trial, path, 1.0));
    kf_leave_track(solver);
    if (!is_trusted) {
        return false;
    }
    for (k = 0; has_middle && k < KF_UNKNOWNS; ++k) {
        const double off = middle[k] - 0.5 * (pose->found.x[k] + there->found.x[k]);
        bent = fmax(bent, fabs(off) / kf_unknown_scales[k]);
    }
    margin = fmin(margin, trial->found.margin);
    if (KF_TRUST * bent > margin * margin) { /* blocks close where the square of their sine is positive */
        return false;
    }
    iterations = there->found.iterations + trial->found.iterations;
    if (!kf_evaluated_as_given(&solver->model, u, trial->found.x, &there->found)) {
        return false;
    }
    there->found.iterations = iterations;
    return true;
}

/* Find where the path of the blocks that depend on several drivers ends, just beyond a pose. */
static void mixed_limit(kf_solver *solver, const kf_pose *before, kf_pose *pose, const double *direction, kf_limit *limit)
{
    kf_pose *const share = solver->scratch.share;
    kf_rates_in_time(&solver->model, pose, direction, NULL);
    kf_enter_mixed(solver, pose->found.x, pose->x1);
    kf_limit_beyond(solver, share_of(before, &share[0]), share_of(pose, &share[1]), direction, limit);
    kf_leave_track(solver);
}

/* Find the pose at `target`; blocks that depend on several drivers follow the tracks in trusted steps.
 *
 * The path is straight, as in kf_advance, but at each step the tracks are solved first, and the other blocks are
 * predicted along the chord of the tracks: they need no rates of the tracks, which may be singular. Steps near a singular
 * pose are so short that the tracks stay on their chord.
 */
kf_status kf_advance_mixed(kf_solver *solver, kf_pose *start, const double *target, kf_pose *found)
{
    kf_pose *pose = start;
    kf_path path;
    kf_limit limit;
    int turn, k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        solver->scratch.origin[k] = start->has_tracks ? start->own[k].map : -1;
    }
    if (start->has_base) {
        pose = solver->scratch.whole;
        if (!KF_GOOD(kf_assembled(solver, start, start->base_u, start->base_u, start->base_z, pose))) {
            return kf_failed(found, pose->status);
        }
    }
    kf_path_init(&path, pose, target, -1, solver->scratch.whole);
    for (turn = 0; turn < path.most_steps && !path.is_ended; ++turn) {
        double s;
        const double *const u = kf_path_ahead(&path, &s);
        kf_pose *const trial = kf_path_spare(&path);
        if ((!(u == target && path.pose == start) && kf_is_near(solver, path.pose, u, trial))
            || mixed_step(solver, path.pose, u, target, trial)) {
            if (!KF_GOOD(trial->status)) {
                return kf_failed(found, trial->status);
            }
            path.iterations += trial->found.iterations;
            kf_path_accept(&path, trial, s, share_of(trial, solver->scratch.share)->found.margin);
        } else if (kf_path_shorten(&path, s)) {
            if (!path.is_limited) {
                mixed_limit(solver, path.before, path.pose, path.direction, &path.limit);
            }
            kf_path_limit(&path, s);
        }
    }
    pose = kf_path_terminate(&path, &limit);
    if (pose == NULL) {
        solver->message[0] = '\0';
        kf_append_limit(solver->message, &limit, target, -1);
        return kf_failed(found, KF_OUTSIDE);
    }
    *found = *pose;
    return found->status;
}

#endif
