/* Advance: from a good pose to other driver values, along one continuous branch. See kinfmu/solver/python/advance.py. */
#include "way.h"

#define UNDOUBTED 1e-5     /* [rad, sizes]; a prediction that was corrected by less did not land by accident */
#define SMOOTH 0.5         /* change of the tangent beside the predicted one, as a part: more is another branch */
#define MOST_WALKED 10000  /* steps between a pose and a node; a few, as a rule */
#define ROUGHEST 5e-4      /* of the longest step; where even that cannot be trusted there is no plain way */

/* True if the columns of a block's J change their orientation from a pose to another, det(J^T J') <= 0.
 *
 * The determinant of a block of more rows than unknowns has no sign by which a crossing in between could be seen.
 */
static bool turns_over(const kf_model *model, const kf_pose *pose, const kf_pose *trial)
{
    double here[KF_ROOM(KF_LARGEST_BLOCK)], there[KF_ROOM(KF_LARGEST_BLOCK)];
    int block, first = 0;
    for (block = 0; block < KF_BLOCKS; ++block) {
        const int rows = kf_block_rows[block], columns = kf_block_ends[block] - first;
        if (rows > columns && !kf_is_outside(model, block)) {
            kf_jacobian(model, &pose->found, block, here);
            kf_jacobian(model, &trial->found, block, there);
            if (kf_orientation(rows, columns, here, there) <= 0.0) {
                return true;
            }
        }
        first = kf_block_ends[block];
    }
    return false;
}

/* One step of predict and correct; false if it cannot be trusted to stay on the branch. */
inline bool kf_trusted_step(kf_solver *solver, kf_pose *pose, const double *direction, double s, const double *u,
                     kf_pose *trial)
{
    const kf_model *const model = &solver->model;
    const double *x1 = pose->x1, *x2 = pose->x2;
    double needed;
    int k;
    if (KF_IS_ONE(solver)) {
        if (pose->derivatives < 2) {
            kf_tangent(model, pose);
        }
    } else {
        x1 = solver->scratch.x1;
        x2 = solver->scratch.x2;
        KF_VELOCITY(model, &pose->found, direction, NULL, NULL, solver->scratch.x1);
        KF_ACCELERATION(model, &pose->found, kf_at_rest, x1, NULL, NULL, solver->scratch.x2);
    }
    if (kf_position(model, u, pose->found.x, x1, x2, s, NULL, &trial->found) >= 0) { /* singular, or diverged */
        return false;
    }
    needed = KF_TRUST * trial->found.moved;
    if (needed > trial->found.margin || needed > pose->found.margin || trial->found.margin == 0.0) {
        return false;
    }
    for (k = 0; k < KF_BLOCKS; ++k) {
        const double before = pose->found.determinants[k], after = trial->found.determinants[k];
        if (before > 0.0 ? after < KF_FALL * before : after > KF_FALL * before) {
            return false;
        }
    }
    if (KF_TALL && turns_over(model, pose, trial)) {
        return false;
    }
    for (k = 0; trial->found.moved > UNDOUBTED && k < KF_UNKNOWNS; ++k) {
        if (fabs(x2[k]) * s * s > 2.0 * KF_BENT * kf_unknown_scales[k]) {
            return false;
        }
    }
    kf_fresh(trial, pose->road, pose->low, pose->high);
    return true;
}

/* False if the tangent of a way jumps in a step along it, as it does from one branch to a crossing one.
 *
 * Near a crossing the branches lie as close as corrections are small, and one of them keeps the determinant's sign;
 * their tangents stay apart. Toward a dead centre tangents grow, by at most this much in a step. So close to either
 * that both branches are the same in doubles, no step leads on.
 */
bool kf_keeps_branch(kf_solver *solver, kf_pose *pose, kf_pose *trial, const double *direction, double s)
{
    const kf_model *const model = &solver->model;
    const double *x1 = pose->x1, *x2 = pose->x2, *const there = trial->x1;
    double largest = 0.0, jump = 0.0;
    int block, k = 0;
    if (pose->found.margin < KF_UNDECIDED && trial->found.margin > pose->found.margin) {
        return false;
    }
    if (KF_IS_ONE(solver)) {
        kf_tangent(model, pose);
        kf_tangent(model, trial);
    } else {
        x1 = solver->scratch.x1; /* of the step from the pose to the trial */
        x2 = solver->scratch.x2;
        KF_VELOCITY(model, &trial->found, direction, NULL, NULL, trial->x1);
    }
    for (block = 0; block < KF_BLOCKS; ++block) {
        for (; k < kf_block_ends[block]; ++k) {
            if (!kf_is_outside(model, block)) {
                largest = fmax(largest, fabs(there[k]) / kf_unknown_scales[k]);
                jump = fmax(jump, fabs(there[k] - (x1[k] + s * x2[k])) / kf_unknown_scales[k]);
            }
        }
    }
    return jump <= SMOOTH * largest;
}

/* From a pose to a value of the only driver by trusted steps, without bridges; or NULL. What it finds lasts until the
 * next walk, which may start there.
 */
kf_pose *kf_plainly(kf_solver *solver, kf_pose *start, double u)
{
    const double longest = KF_LONGEST_STEP * kf_reach[KF_ALONG(solver)];
    kf_pose *const walk = solver->scratch.walk, *pose = start;
    double step = longest;
#if KF_TRACKS
    double room[KF_DRIVERS];
#endif
    int k;
    for (k = 0; k < MOST_WALKED; ++k) {
        const double here = KF_HERE(solver, pose), distance = u - here;
        const bool whole = -step <= distance && distance <= step;
        const double s = whole ? distance : distance > 0.0 ? step : -step, there = whole ? u : here + s;
        kf_pose *const trial = pose == &walk[0] ? &walk[1] : &walk[0];
        if (here == u) {
            return pose;
        }
        if (kf_trusted_step(solver, pose, KF_SPEEDS(&solver->model), s, KF_AT(&solver->model, &there, room), trial)) {
            pose = trial;
            continue;
        }
        step = 0.5 * fabs(s);
        if (step < ROUGHEST * longest) {
            return NULL;
        }
    }
    return NULL;
}

/* The pose at the end of a way, with the iterations of the whole way.
 *
 * At a dead centre it has no tangent to go on by: the next way starts from the last regular pose.
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
        pose->road = regular->road;
        pose->low = regular->low;
        pose->high = regular->high;
    }
    return pose;
}

/* A place for one more pose beside those that are needed. */
static kf_pose *spare(kf_solver *solver, const kf_pose *pose, const kf_pose *before, const kf_pose *regular)
{
    kf_pose *place = solver->scratch.way;
    while (place == pose || place == before || place == regular) {
        ++place;
    }
    return place;
}

/* The same pose with other singular points known. */
static kf_pose *on_road(kf_solver *solver, const kf_pose *pose, int road, kf_pose *place)
{
    if (place != pose) {
        *place = *pose;
    }
    kf_stretch(solver, road, KF_HERE(solver, place), &place->low, &place->high);
    place->road = road;
    place->bridge = -1;
    place->status = KF_OK;
    place->has_base = false;
    return place;
}

/* The pose at `target`, in the solver's scratch, or NULL and the limit on the way to it; road: what is known of the way,
 * the start's or more.
 *
 * Each step predicts with velocity and acceleration (the prediction decides the branch), corrects by Newton on the
 * residual, and is trusted if the correction is small against the determinant and no determinant changes its sign.
 * With one driver, singular points on the way are bridged.
 */
kf_pose *kf_advance(kf_solver *solver, kf_pose *start, int road, const double *target, kf_limit *limit)
{
    const bool one = KF_IS_FOLLOWED;
    const double longest = one ? KF_LONGEST_STEP * kf_reach[KF_ALONG(solver)] : KF_LONGEST_STEP;
    kf_pose *pose = start, *before = start, *regular = start, *trial;
    double direction[KF_DRIVERS], u[KF_DRIVERS], distance, step = longest;
    int iterations = 0, turn, k;
    bool is_limited = false;
    memcpy(direction, KF_SPEEDS(&solver->model), sizeof direction);
    distance = one ? target[KF_ALONG(solver)] - KF_HERE(solver, start) : kf_course(KF_POSE_U(start), target, direction);
    memcpy(limit->u, KF_POSE_U(start), sizeof limit->u);
    limit->block = KF_TOO_FAR;
    limit->crosses = false;
    if (fabs(distance) > KF_MOST_STEPS * longest) {
        return NULL;
    }
    if (road != start->road) {
        pose = on_road(solver, start, road, solver->scratch.way);
    }
    for (turn = 0; turn < KF_MOST_STEPS; ++turn) {
        bool whole;
        double s;
        trial = spare(solver, pose, before, regular);
        if (one) {
            kf_needed(solver, start->road, pose->road, regular->road);
            road = pose->road;
            if (!(pose->low <= target[KF_ALONG(solver)] && target[KF_ALONG(solver)] <= pose->high)) {
                const int bridge =
                    pose->bridge >= 0 ? pose->bridge : kf_next_bridge(solver, road, KF_HERE(solver, pose), target[KF_ALONG(solver)]);
                if (kf_covers(&KF_MAP(solver)->bridges[bridge], target[KF_ALONG(solver)])) {
                    if (!kf_bridge_pose(solver, bridge, target, trial)) { /* a block not interpolated ends there */
                        memcpy(limit->u, KF_POSE_U(pose), sizeof limit->u);
                        limit->block = KF_NO_BLOCK;
                        return NULL;
                    }
                    kf_stretch(solver, road, target[KF_ALONG(solver)], &trial->low, &trial->high);
                    trial->road = road;
                    return trial;
                }
                kf_bridge_exit(solver, bridge, target[KF_ALONG(solver)], trial);
                pose = on_road(solver, trial, road, trial);
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
                    road = kf_surveyed(solver, pose, trial);
                    if (road != trial->road) {
                        pose = on_road(solver, pose, road, trial);
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
                kf_limited(solver, before, pose, direction, limit);
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
