/* Mixed: blocks that depend on several drivers, where others depend on one. See Solver._followed in
 * kinfmu/solver/python/solver.py.
 */
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

/* Take one step of all blocks, or find a failed pose if the tracks end before it; false if the blocks that depend on
 * several drivers cannot be trusted to stay on their branch.
 */
static bool mixed_step(kf_solver *solver, kf_pose *pose, const double *u, const double *target, kf_pose *there)
{
    kf_pose *const start = &solver->scratch.share[0], *const trial = &solver->scratch.share[1];
    double chord[KF_UNKNOWNS], path[KF_DRIVERS];
    bool is_trusted;
    int k, iterations;
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

static kf_status ended(kf_solver *solver, const kf_limit *limit, const double *target, kf_pose *pose)
{
    solver->message[0] = '\0';
    kf_append_limit(solver->message, limit, target, -1);
    return kf_failed(pose, KF_OUTSIDE);
}

/* Return a place for one more pose that holds none of those needed. */
static kf_pose *spare(kf_solver *solver, const kf_pose *pose, const kf_pose *before, const kf_pose *regular)
{
    kf_pose *place = solver->scratch.whole;
    while (place == pose || place == before || place == regular) {
        ++place;
    }
    return place;
}

/* Find the pose at `target`; blocks that depend on several drivers follow the tracks in trusted steps.
 *
 * The path is straight, as in kf_advance, but at each step the tracks are solved first, and the other blocks are
 * predicted along the chord of the tracks: they need no rates of the tracks, which may be singular.
 */
kf_status kf_followed_all(kf_solver *solver, kf_pose *start, const double *target, kf_pose *found)
{
    kf_pose *pose = start, *before, *regular;
    double direction[KF_DRIVERS], u[KF_DRIVERS], distance, step = KF_LONGEST_STEP;
    kf_limit limit;
    int iterations = 0, turn, k;
    bool is_limited = false;
    for (k = 0; k < KF_DRIVERS; ++k) {
        solver->scratch.origin[k] = start->has_tracks ? start->own[k].map : -1;
    }
    if (start->has_base) {
        pose = solver->scratch.whole;
        if (!KF_GOOD(kf_assembled(solver, start, start->base_u, start->base_u, start->base_z, pose))) {
            return kf_failed(found, pose->status);
        }
    }
    before = regular = pose;
    distance = kf_straight_path(KF_POSE_U(pose), target, direction);
    memcpy(limit.u, KF_POSE_U(pose), sizeof limit.u);
    limit.block = KF_TOO_FAR;
    limit.crosses = false;
    if (distance > KF_MOST_STEPS * KF_LONGEST_STEP) {
        return ended(solver, &limit, target, found);
    }
    for (turn = 0; turn < KF_MOST_STEPS; ++turn) {
        const bool whole = distance <= step;
        const double s = whole ? distance : step;
        kf_pose *const trial = spare(solver, pose, before, regular);
        const double *const at = whole ? target : u;
        for (k = 0; k < KF_DRIVERS; ++k) {
            u[k] = KF_POSE_U(pose)[k] + s * direction[k];
        }
        if ((!(whole && pose == start) && kf_is_near(solver, pose, at, trial))
            || mixed_step(solver, pose, at, target, trial)) {
            double margin;
            if (!KF_GOOD(trial->status)) {
                return kf_failed(found, trial->status);
            }
            iterations += trial->found.iterations;
            margin = share_of(trial, &solver->scratch.share[0])->found.margin;
            if (whole) {
                trial->found.iterations = iterations;
                if (margin < KF_NEAR) {
                    trial->status = KF_NEAR_SINGULAR;
                    trial->has_base = true;
                    memcpy(trial->base_u, KF_POSE_U(regular), sizeof trial->base_u);
                    memcpy(trial->base_z, regular->found.x, sizeof trial->base_z);
                }
                *found = *trial;
                return found->status;
            }
            before = pose;
            pose = trial;
            regular = margin >= KF_NEAR ? pose : regular;
            distance -= s;
            step = fmin(2.0 * step, KF_LONGEST_STEP);
            continue;
        }
        step = 0.5 * s;
        if (step < KF_SHORTEST_STEP * KF_LONGEST_STEP) {
            if (!is_limited) {
                mixed_limit(solver, before, pose, direction, &limit);
                is_limited = true;
            }
            if (step < KF_GIVE_UP * KF_LONGEST_STEP || kf_is_beyond(target, limit.u, direction, s)) {
                return ended(solver, &limit, target, found);
            }
        }
    }
    memcpy(limit.u, KF_POSE_U(pose), sizeof limit.u);
    limit.block = KF_TOO_FAR;
    limit.crosses = false;
    return ended(solver, &limit, target, found);
}

#endif
