/* Advance: from a good pose to other driver values, along one continuous branch. See kinfmu/solver/python/advance.py. */
#include "internal.h"

inline void kf_path_init(kf_path *path, kf_pose *start, const double *target, int driver, kf_pose *places)
{
    path->places = places;
    path->target = target;
    path->pose = path->before = path->regular = start;
    path->margin = start->found.margin;
    if (driver >= 0) {
        memset(path->direction, 0, sizeof path->direction);
        path->direction[driver] = 1.0;
        path->distance = target[driver] - KF_POSE_U(start)[driver];
        path->longest = KF_LONGEST_STEP * kf_reach[driver];
    } else {
        path->distance = kf_straight_path(KF_POSE_U(start), target, path->direction);
        path->longest = KF_LONGEST_STEP;
    }
    path->length = path->longest;
    path->most_steps = fabs(path->distance) > KF_MOST_STEPS * path->longest ? 0 : KF_MOST_STEPS;
    path->iterations = 0;
    path->is_limited = path->is_ended = false;
    path->end = NULL;
}

inline kf_pose *kf_path_spare(const kf_path *path)
{
    kf_pose *place = path->places;
    while (place == path->pose || place == path->before || place == path->regular) {
        ++place;
    }
    return place;
}

inline const double *kf_path_ahead(kf_path *path, double *s)
{
    int k;
    if (-path->length <= path->distance && path->distance <= path->length) {
        *s = path->distance;
        return path->target;
    }
    *s = path->distance > 0.0 ? path->length : -path->length;
    for (k = 0; k < KF_DRIVERS; ++k) {
        path->u[k] = KF_POSE_U(path->pose)[k] + *s * path->direction[k];
    }
    return path->u;
}

inline void kf_path_accept(kf_path *path, kf_pose *trial, double s, double margin)
{
    path->margin = margin;
    if (s == path->distance) {
        path->end = trial;
        path->is_ended = true;
        return;
    }
    path->before = path->pose;
    path->pose = trial;
    if (margin >= KF_NEAR) {
        path->regular = trial;
    }
    path->distance -= s;
    path->length = fmin(2.0 * path->length, path->longest);
}

/* Return whether the next step is lost in the rounding of the driver values. */
static bool is_lost(kf_path *path)
{
    double s;
    const double *const u = kf_path_ahead(path, &s);
    int k = 0;
    while (k < KF_DRIVERS && u[k] == KF_POSE_U(path->pose)[k]) {
        ++k;
    }
    return k == KF_DRIVERS;
}

bool kf_path_shorten(kf_path *path, double s)
{
    path->length = 0.5 * fabs(s);
    return path->length < (KF_LAW_ARGUMENTS ? KF_GIVE_UP : KF_SHORTEST_STEP) * path->longest /* rises may be short, too */
           || is_lost(path);
}

void kf_path_limit(kf_path *path, double s)
{
    path->is_limited = true;
    path->is_ended = path->length < KF_GIVE_UP * path->longest || is_lost(path)
                     || kf_is_beyond(path->target, path->limit.u, path->direction, s);
}

inline kf_pose *kf_path_terminate(kf_path *path, kf_limit *limit)
{
    kf_pose *const end = path->end;
    const kf_pose *const regular = path->regular;
    if (!path->is_ended) {
        kf_limit_at(&path->limit, KF_POSE_U(path->pose), KF_TOO_FAR);
    }
    if (end == NULL) {
        *limit = path->limit;
    } else if (end->bridge < 0) {
        end->found.iterations = path->iterations;
        if (path->margin < KF_NEAR) {
            end->status = KF_NEAR_SINGULAR;
            end->has_base = true;
            memcpy(end->base_u, KF_POSE_U(regular), KF_DRIVERS * sizeof(double));
            memcpy(end->base_z, regular->found.x, KF_UNKNOWNS * sizeof(double));
            end->base_bridge = regular->bridge;
            end->map = regular->map;
            end->low = regular->low;
            end->high = regular->high;
        }
    }
    return end;
}

/* Return the same pose with another singularity map. */
static kf_pose *with_map(kf_solver *solver, const kf_pose *pose, int map, kf_pose *place)
{
    if (place != pose) {
        KF_ASSIGN(place, pose);
    }
    kf_around(solver, map, KF_HERE(solver, place), &place->low, &place->high);
    place->map = map;
    place->bridge = -1;
    place->status = KF_OK;
    place->has_base = false;
    return place;
}

/* Go on at the far side of a bridge ahead, or end on it; return false where there is none: a step is needed. */
static bool cross_bridge(kf_solver *solver, const kf_pose *start, kf_path *path)
{
    kf_pose *const pose = path->pose, *const place = kf_path_spare(path);
    const double target = path->target[KF_ALONG(solver)];
    kf_keep_maps(solver, start->map, pose->map, path->regular->map);
    if (!(pose->low <= target && target <= pose->high)) {
        const int map = pose->map;
        const int bridge = pose->bridge >= 0 ? pose->bridge : kf_next_bridge(solver, map, KF_HERE(solver, pose), target);
        if (!kf_covers(&KF_POOL(solver)->bridges[bridge], target)) {
            kf_bridge_exit(solver, bridge, target, place);
            path->pose = with_map(solver, place, map, place);
            return true;
        }
        path->is_ended = true;
        if (kf_bridge_pose(solver, bridge, path->target, place)) {
            kf_around(solver, map, target, &place->low, &place->high);
            place->map = map;
            path->end = place;
        } else { /* a block not interpolated ends there */
            kf_limit_at(&path->limit, KF_POSE_U(pose), KF_NO_BLOCK);
        }
        return true;
    }
    path->distance = target - KF_HERE(solver, pose);
    if (path->distance == 0.0) { /* a node, or a step that ended there by rounding */
        path->end = pose;
        path->margin = pose->found.margin;
        path->is_ended = true;
    }
    return path->is_ended;
}

/* Go one step along the path, or over a bridge; or try a shorter step, or find a singular point. */
static void step(kf_solver *solver, const kf_pose *start, kf_path *path)
{
    const bool has_one_driver = KF_IS_FOLLOWED;
    kf_pose *pose, *trial;
    const double *u;
    double s;
    if (has_one_driver && cross_bridge(solver, start, path)) {
        return;
    }
    pose = path->pose;
    trial = kf_path_spare(path);
    u = kf_path_ahead(path, &s);
    if (kf_trusted_step(solver, pose, path->direction, s, u, trial)) {
        path->iterations += trial->found.iterations;
        if (trial->found.margin >= (has_one_driver ? KF_CLOSE : KF_REGULAR)
            || kf_keeps_branch(solver, pose, trial, path->direction, s)) {
            if (has_one_driver && trial->found.margin < KF_REGULAR) {
                const int map = kf_surveyed(solver, pose, trial);
                if (map != trial->map) {
                    path->pose = with_map(solver, pose, map, trial);
                    return;
                }
            }
            kf_path_accept(path, trial, s, trial->found.margin);
            if (!path->is_ended && path->length < KF_STRIDE * path->longest) {
                path->is_ended = kf_pole_before(solver, pose, trial, path->direction, path->distance, KF_FAR_AWAY,
                                                &path->limit);
            }
            return;
        }
    }
    if (kf_path_shorten(path, s)) {
        if (!path->is_limited
            && !kf_pole_before(solver, path->before, pose, path->direction, path->distance, 0.0, &path->limit)) {
            kf_limit_beyond(solver, path->before, pose, path->direction, &path->limit);
        }
        kf_path_limit(path, s);
    }
}

/* Follow the branch in a straight line of the driver values.
 *
 * Each step predicts with velocity and acceleration (the prediction decides the branch), corrects by Newton on the
 * residual, and is trusted if the correction is small compared with the determinant and no determinant changes its
 * sign. With one driver, singular points on the path are bridged.
 *
 * map: singular points known on the path, those of the start or more. Returns the pose at the target, in the solver's
 * scratch, or NULL and the limit of the path before it.
 */
kf_pose *kf_advance(kf_solver *solver, kf_pose *start, int map, const double *target, kf_limit *limit)
{
    kf_path path;
    int k;
    kf_path_init(&path, start, target, KF_IS_FOLLOWED ? KF_ALONG(solver) : -1, solver->scratch.poses);
    if (map != start->map) {
        path.pose = with_map(solver, start, map, solver->scratch.poses);
    }
    for (k = 0; k < path.most_steps && !path.is_ended && !kf_is_overworked(solver); ++k) {
        step(solver, start, &path);
    }
    return kf_path_terminate(&path, limit);
}
