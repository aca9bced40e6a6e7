/* Advance: from a good pose to other driver values, along one continuous branch. See kinfmu/solver/python/advance.py. */
#include "internal.h"

/* Return the pose at the end of a path, with the iterations of the whole path.
 *
 * A dead centre has no tangent that the next path could start with: that starts from the last regular pose.
 */
static kf_pose *arrived(kf_pose *pose, const kf_pose *regular, int iterations)
{
    pose->found.iterations = iterations;
    if (pose->found.margin < KF_NEAR) {
        pose->status = KF_NEAR_SINGULAR;
        pose->has_base = true;
        memcpy(pose->base_u, KF_POSE_U(regular), sizeof pose->base_u);
        memcpy(pose->base_z, regular->found.x, KF_UNKNOWNS * sizeof(double));
        pose->base_bridge = regular->bridge;
        pose->map = regular->map;
        pose->low = regular->low;
        pose->high = regular->high;
    }
    return pose;
}

/* Return a place for one more pose that holds none of those needed. */
static kf_pose *spare(kf_solver *solver, const kf_pose *pose, const kf_pose *before, const kf_pose *regular)
{
    kf_pose *place = solver->scratch.poses;
    while (place == pose || place == before || place == regular) {
        ++place;
    }
    return place;
}

/* Return the same pose with another singularity map. */
static kf_pose *with_map(kf_solver *solver, const kf_pose *pose, int map, kf_pose *place)
{
    if (place != pose) {
        *place = *pose;
    }
    kf_around(solver, map, KF_HERE(solver, place), &place->low, &place->high);
    place->map = map;
    place->bridge = -1;
    place->status = KF_OK;
    place->has_base = false;
    return place;
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
    const bool one = KF_IS_FOLLOWED;
    const double longest = one ? KF_LONGEST_STEP * kf_reach[KF_ALONG(solver)] : KF_LONGEST_STEP;
    kf_pose *pose = start, *before = start, *regular = start, *trial;
    double direction[KF_DRIVERS], u[KF_DRIVERS], distance, step = longest;
    int iterations = 0, turn, k;
    bool is_limited = false;
    memcpy(direction, KF_SPEEDS(&solver->model), sizeof direction);
    distance = one ? target[KF_ALONG(solver)] - KF_HERE(solver, start) : kf_straight_path(KF_POSE_U(start), target, direction);
    memcpy(limit->u, KF_POSE_U(start), sizeof limit->u);
    limit->block = KF_TOO_FAR;
    limit->crosses = false;
    if (fabs(distance) > KF_MOST_STEPS * longest) {
        return NULL;
    }
    if (map != start->map) {
        pose = with_map(solver, start, map, solver->scratch.poses);
    }
    for (turn = 0; turn < KF_MOST_STEPS; ++turn) {
        bool whole;
        double s;
        trial = spare(solver, pose, before, regular);
        if (one) {
            kf_keep_maps(solver, start->map, pose->map, regular->map);
            map = pose->map;
            if (!(pose->low <= target[KF_ALONG(solver)] && target[KF_ALONG(solver)] <= pose->high)) {
                const int bridge =
                    pose->bridge >= 0 ? pose->bridge : kf_next_bridge(solver, map, KF_HERE(solver, pose), target[KF_ALONG(solver)]);
                if (kf_covers(&KF_POOL(solver)->bridges[bridge], target[KF_ALONG(solver)])) {
                    if (!kf_bridge_pose(solver, bridge, target, trial)) { /* a block not interpolated ends there */
                        memcpy(limit->u, KF_POSE_U(pose), sizeof limit->u);
                        limit->block = KF_NO_BLOCK;
                        return NULL;
                    }
                    kf_around(solver, map, target[KF_ALONG(solver)], &trial->low, &trial->high);
                    trial->map = map;
                    return trial;
                }
                kf_bridge_exit(solver, bridge, target[KF_ALONG(solver)], trial);
                pose = with_map(solver, trial, map, trial);
                continue;
            }
            distance = target[KF_ALONG(solver)] - KF_HERE(solver, pose);
            if (distance == 0.0) { /* a node, or a step that ended there by rounding */
                return arrived(pose, regular, iterations);
            }
        }
        whole = -step <= distance && distance <= step;
        s = whole ? distance : distance > 0.0 ? step : -step;
        for (k = 0; k < KF_DRIVERS; ++k) {
            u[k] = whole ? target[k] : KF_POSE_U(pose)[k] + s * direction[k];
        }
        if (kf_trusted_step(solver, pose, direction, s, u, trial)) {
            iterations += trial->found.iterations;
            if (trial->found.margin >= (one ? KF_CLOSE : KF_REGULAR)
                || kf_keeps_branch(solver, pose, trial, direction, s)) {
                if (trial->found.margin < KF_REGULAR && one) {
                    map = kf_surveyed(solver, pose, trial);
                    if (map != trial->map) {
                        pose = with_map(solver, pose, map, trial);
                        continue;
                    }
                }
                if (whole) {
                    return arrived(trial, regular, iterations);
                }
                before = pose;
                pose = trial;
                if (pose->found.margin >= KF_NEAR) {
                    regular = pose;
                }
                distance -= s;
                step = fmin(2.0 * step, longest);
                continue;
            }
        }
        step = 0.5 * fabs(s);
        if (step < KF_SHORTEST_STEP * longest) {
            if (!is_limited) {
                kf_limit_beyond(solver, before, pose, direction, limit);
                is_limited = true;
            }
            if (step < KF_GIVE_UP * longest || kf_is_beyond(target, limit->u, direction, s)) {
                return NULL;
            }
        }
    }
    memcpy(limit->u, KF_POSE_U(pose), sizeof limit->u);
    limit->block = KF_TOO_FAR;
    return NULL;
}
