/* Tracks: blocks that depend on one driver alone are followed along that driver; those that depend on several follow the
 * tracks. See kinfmu/solver/python/tracks.py.
 */
#include "internal.h"

#if KF_HAS(KF_TRACKS)

/* Return the track's part of a pose of the whole mechanism. */
kf_pose *kf_on_track(kf_solver *solver, const kf_pose *whole, int driver)
{
    kf_pose *const own = &solver->scratch.track[0];
    const double u = KF_POSE_U(whole)[driver];
    const kf_track_pose *const known = &whole->own[driver];
    double z[KF_UNKNOWNS], buffer[KF_DRIVERS];
    int block, k = 0;
    if (whole->has_tracks && known->bridge >= 0) {
        kf_bridge_pose(solver, known->bridge, kf_driven_at(&solver->model, &u, buffer), own);
    } else {
        for (block = 0; block < KF_BLOCKS; ++block) {
            for (; k < kf_block_ends[block]; ++k) {
                z[k] = kf_block_drivers[block] == driver ? whole->found.x[k] : solver->anchor.found.x[k];
            }
        }
        kf_fresh(own, -1, -INFINITY, INFINITY);
        ++solver->scratch.work;
        kf_evaluated_as_given(&solver->model, kf_driven_at(&solver->model, &u, buffer), z, &own->found);
    }
    if (whole->has_tracks) {
        own->status = known->status;
        own->map = known->map;
        own->has_base = known->has_base;
        own->base_bridge = known->base_bridge;
        if (known->has_base) {
            kf_driven_at(&solver->model, &known->base_u, own->base_u);
            memcpy(own->base_z, known->base_z, sizeof own->base_z);
        }
        kf_around(solver, own->map, own->has_base ? known->base_u : u, &own->low, &own->high);
    }
    return own;
}

/* Store the pose of a track in a pose of the whole mechanism. */
static void keep(kf_solver *solver, const kf_pose *own, int driver, kf_pose *whole, double *z)
{
    kf_track_pose *const kept = &whole->own[driver];
    const bool *const held =
        own->bridge < 0 ? NULL : KF_POOL(solver)->spans[KF_POOL(solver)->bridges[own->bridge].span].held;
    int block, k = 0;
    kept->status = own->status;
    kept->map = own->map;
    kept->bridge = own->bridge;
    kept->has_base = own->has_base;
    kept->base_bridge = own->base_bridge;
    if (own->has_base) {
        kept->base_u = own->base_u[driver];
        memcpy(kept->base_z, own->base_z, sizeof kept->base_z);
    }
    for (block = 0; block < KF_BLOCKS; ++block) {
        const bool is_own = kf_block_drivers[block] == driver;
        whole->held[block] = is_own ? held != NULL && held[block] : whole->held[block];
        whole->is_held = whole->is_held || whole->held[block];
        for (; k < kf_block_ends[block]; ++k) {
            if (is_own) {
                z[k] = own->found.x[k];
                whole->own1[k] = held == NULL ? 0.0 : own->x1[k];
                whole->own2[k] = held == NULL ? 0.0 : own->x2[k];
            }
        }
    }
}

static bool has_track(int driver)
{
    int block;
    for (block = 0; block < KF_BLOCKS && kf_block_drivers[block] != driver; ++block) {
    }
    return block < KF_BLOCKS;
}

/* Return whether the blocks of all tracks are regular, and the others not near singular. */
static bool is_apart(const kf_pose *pose)
{
    int block;
    bool apart = pose->found.margin >= KF_NEAR;
    if (!KF_MIXES || pose->found.margin >= KF_REGULAR) {
        return pose->found.margin >= KF_REGULAR;
    }
    for (block = 0; block < KF_BLOCKS; ++block) {
        apart = apart && (kf_block_drivers[block] < 0 || fabs(pose->found.determinants[block]) >= KF_REGULAR);
    }
    return apart;
}

/* Take one trusted step of all drivers; return false if it is not trusted, or if a track is near a singular point. */
static bool is_near_by_tracks(kf_solver *solver, kf_pose *start, const double *u, kf_pose *pose)
{
    double direction[KF_DRIVERS], distance;
    int k;
    if (start->status != KF_OK || start->has_base || !is_apart(start)) {
        return false;
    }
    distance = kf_straight_path(KF_POSE_U(start), u, direction);
    if (!(0.0 < distance && distance <= KF_LONGEST_STEP)) {
        return false;
    }
    for (k = 0; start->has_tracks && k < KF_DRIVERS; ++k) {
        if (start->own[k].map >= 0) {
            double low, high;
            kf_enter_track(solver, k);
            kf_around(solver, start->own[k].map, KF_POSE_U(start)[k], &low, &high);
            kf_leave_track(solver);
            if (!(low <= u[k] && u[k] <= high)) {
                return false;
            }
        }
    }
    if (!kf_trusted_step(solver, start, direction, distance, u, pose) || !is_apart(pose)
        || !(pose->found.watch <= solver->tolerance && pose->found.residual <= solver->tolerance)
        || (pose->found.margin < KF_REGULAR && !kf_keeps_branch(solver, start, pose, direction, distance))) {
        return false;
    }
    pose->has_tracks = true;
    for (k = 0; k < KF_DRIVERS; ++k) {
        pose->own[k].status = KF_OK;
        pose->own[k].map = start->has_tracks ? start->own[k].map : -1;
        pose->own[k].bridge = -1;
        pose->own[k].has_base = false;
        pose->own[k].base_bridge = -1;
    }
    return true;
}

/* Form the pose of the tracks at u, on the path from `start` to `target`; all other blocks are as in `from`. */
static kf_status assembled(kf_solver *solver, kf_pose *start, const double *u, const double *target, const double *from,
                       kf_pose *pose)
{
    const double tolerance = solver->tolerance;
    kf_pose *const own = &solver->scratch.track[1];
    double z[KF_UNKNOWNS], buffer[KF_DRIVERS];
    kf_status status = KF_OK;
    int k, iterations = 0;
    memcpy(z, from, sizeof z);
    memset(pose->held, 0, sizeof pose->held);
    pose->is_held = false;
    for (k = 0; k < KF_DRIVERS; ++k) {
        kf_status own_status;
        if (!has_track(k)) {
            pose->own[k].status = KF_OK;
            pose->own[k].map = pose->own[k].bridge = pose->own[k].base_bridge = -1;
            pose->own[k].has_base = false;
            continue;
        }
        kf_enter_track(solver, k);
        solver->tolerance = INFINITY; /* it applies to the whole pose only */
        kf_driven_at(&solver->model, &u[k], buffer);
        own_status = kf_solve_along(solver, kf_on_track(solver, start, k), buffer, own);
        if (!KF_GOOD(own_status) && u != target) { /* the message names the target */
            char message[KF_MESSAGE];
            kf_status beyond;
            memcpy(message, solver->message, sizeof message);
            kf_driven_at(&solver->model, &target[k], buffer);
            beyond = kf_solve_along(solver, kf_on_track(solver, start, k), buffer, own);
            if (KF_GOOD(beyond)) {
                memcpy(solver->message, message, sizeof message);
            } else {
                own_status = beyond;
            }
        }
        solver->tolerance = tolerance;
        if (KF_GOOD(own_status)) {
            keep(solver, own, k, pose, z);
            iterations += own->found.iterations;
            status = own_status == KF_NEAR_SINGULAR || status == KF_OK ? own_status : status;
        }
        kf_leave_track(solver);
        if (!KF_GOOD(own_status)) {
            return kf_failed(pose, own_status);
        }
    }
    pose->low = -INFINITY;
    pose->high = INFINITY;
    pose->derivatives = 0;
    pose->map = pose->bridge = -1;
    pose->has_base = false;
    pose->has_tracks = true;
    pose->status = status;
    ++solver->scratch.work;
    if (!kf_evaluated_as_given(&solver->model, u, z, &pose->found)) {
        kf_limit limit;
        kf_limit_at(&limit, KF_POSE_U(start), KF_NO_BLOCK);
        solver->message[0] = '\0';
        kf_append_limit(solver->message, &limit, target, -1);
        return kf_failed(pose, KF_OUTSIDE);
    }
    pose->found.iterations = iterations;
    return pose->status;
}

kf_status kf_solve(kf_solver *solver, kf_pose *start, const double *u, kf_pose *pose)
{
    kf_status status;
    int k;
    bool is_same = start->has_tracks;
    solver->scratch.work = 0;
    if (!KF_TRACKS) {
        return kf_solve_along(solver, start, u, pose);
    }
    if (solver->unsolvable) {
        return kf_failed(pose, KF_INCONSISTENT);
    }
    for (k = 0; k < KF_DRIVERS; ++k) {
        is_same = is_same && u[k] == KF_POSE_U(start)[k];
    }
    if (is_same) {
        KF_ASSIGN(pose, start);
        return pose->status;
    }
    if (is_near_by_tracks(solver, start, u, pose)) { /* most samples */
        return KF_OK;
    }
    if (kf_is_refused(solver, u, -1, true)) {
        return kf_failed(pose, KF_OUTSIDE);
    }
#if KF_HAS(KF_MIXES)
    status = KF_MIXES ? kf_advance_mixed(solver, start, u, pose) : assembled(solver, start, u, u, start->found.x, pose);
#else
    status = assembled(solver, start, u, u, start->found.x, pose);
#endif
    if (kf_is_overworked(solver)) {
        return kf_overworked(solver, u, pose);
    }
    return KF_GOOD(status) ? kf_checked(solver, pose) : status;
}

#endif

/* Form first and second derivative of the coordinates in time; return the interpolated blocks, whose derivatives follow by
 * the chain rule, or NULL.
 */
const bool *kf_rates_in_time(const kf_model *model, kf_pose *pose, const double *ud, const double *udd)
{
    const bool *held = NULL;
    const double *first = NULL, *second = NULL;
#if KF_HAS(KF_TRACKS)
    double given_first[KF_UNKNOWNS], given_second[KF_UNKNOWNS];
    int block, k = 0;
    for (block = 0; pose->is_held && block < KF_BLOCKS; ++block) {
        const int driver = kf_block_drivers[block];
        const double v = driver < 0 ? 0.0 : ud[driver], a = driver < 0 || udd == NULL ? 0.0 : udd[driver];
        for (; k < kf_block_ends[block]; ++k) {
            given_first[k] = v * pose->own1[k];
            given_second[k] = v * v * pose->own2[k] + a * pose->own1[k];
        }
    }
    if (pose->is_held) {
        held = pose->held;
        first = given_first;
        second = given_second;
    }
#endif
    kf_velocity(model, &pose->found, ud, first, held, pose->x1);
    if (udd != NULL) {
        kf_acceleration(model, &pose->found, udd, pose->x1, second, held, pose->x2);
    }
    return held;
}

#if KF_HAS(KF_MIXES)

/* Return the part of a pose of the whole mechanism with the blocks that depend on several drivers. */
static kf_pose *share_of(const kf_pose *whole, kf_pose *share)
{
    double margin = INFINITY;
    int block;
    KF_ASSIGN(share, whole);
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
    if (!KF_GOOD(assembled(solver, pose, half, half, pose->found.x, there))) {
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
    if (!KF_GOOD(assembled(solver, pose, u, target, pose->found.x, there))) {
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
    ++solver->scratch.work;
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
        if (!KF_GOOD(assembled(solver, start, start->base_u, start->base_u, start->base_z, pose))) {
            return kf_failed(found, pose->status);
        }
    }
    kf_path_init(&path, pose, target, -1, solver->scratch.whole);
    for (turn = 0; turn < path.most_steps && !path.is_ended && !kf_is_overworked(solver); ++turn) {
        double s;
        const double *const u = kf_path_ahead(&path, &s);
        kf_pose *const before = path.pose, *const trial = kf_path_spare(&path);
        if ((!(u == target && path.pose == start) && is_near_by_tracks(solver, before, u, trial))
            || mixed_step(solver, before, u, target, trial)) {
            if (!KF_GOOD(trial->status)) {
                return kf_failed(found, trial->status);
            }
            path.iterations += trial->found.iterations;
            kf_path_accept(&path, trial, s, share_of(trial, solver->scratch.share)->found.margin);
            if (!path.is_ended && path.length < KF_STRIDE * path.longest) {
                path.is_ended = kf_pole_before(solver, before, trial, path.direction, path.distance, KF_FAR_AWAY,
                                               &path.limit);
            }
        } else if (kf_path_shorten(&path, s)) {
            if (!path.is_limited
                && !kf_pole_before(solver, path.before, path.pose, path.direction, path.distance, 0.0, &path.limit)) {
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
    KF_ASSIGN(found, pose);
    return found->status;
}

#endif
