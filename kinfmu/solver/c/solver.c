/* Solver: poses, rates and accelerations of the model. See kinfmu/solver/python/solver.py. */
#include "internal.h"

void kf_solver_start(kf_solver *solver)
{
    int k;
    kf_bind(&solver->model, kf_parameters_written, solver->message, sizeof solver->message);
    solver->tolerance = KF_TOLERANCE;
    solver->most_work = KF_ANY_WORK;
    solver->scratch.work = 0;
#if KF_HAS(KF_TRACKS)
    solver->model.track = solver->scratch.ahead.track = 0;
#endif
    solver->unsolvable = false;
    for (k = 0; k < KF_INNERS; ++k) {
        solver->scratch.inner[k].half = 0.0; /* nothing was read */
    }
    solver->message[0] = '\0';
    kf_fresh(&solver->anchor, -1, -INFINITY, INFINITY);
    kf_evaluated(&solver->model, kf_anchor_u, kf_anchor_z, NULL, &solver->anchor.found);
}

KF_RARE kf_status kf_failed(kf_pose *pose, kf_status status)
{
    kf_fresh(pose, -1, -INFINITY, INFINITY);
    pose->status = status;
    return status;
}

/* Reject driver values whose pose needs more work than may be done. */
KF_RARE kf_status kf_overworked(kf_solver *solver, const double *u, kf_pose *pose)
{
    solver->message[0] = '\0';
    kf_append_place(solver->message, u, KF_ROUGHLY, -1);
    kf_append(solver->message, " is not reached with %d pose solves, the limit solver.most_work", solver->most_work);
    return kf_failed(pose, KF_OUTSIDE);
}

/* Set the message for driver values that no mechanism has: not finite, or a distance below 0. mixed: only distances in
 * blocks that depend on several drivers are checked.
 */
bool kf_is_refused(kf_solver *solver, const double *u, int driver, bool mixed)
{
    const char *why = NULL;
    double sum = 0.0;
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        sum += u[k];
    }
    for (k = 0; k < KF_DISTANCES; ++k) {
        if (u[kf_distance_drivers[k]] < 0.0 && !(mixed && KF_IS_ON_A_TRACK(kf_distance_blocks[k]))) {
            why = ": a distance cannot be negative";
        }
    }
    why = sum - sum == 0.0 ? why : " is not a finite number";
    solver->message[0] = '\0';
    if (why != NULL) {
        kf_append_place(solver->message, u, KF_ROUGHLY, driver);
        kf_append(solver->message, "%s", why);
    }
    return why != NULL;
}

/* Set status and message of a pose whose rows or watches do not close. */
static KF_RARE kf_status rejected(kf_solver *solver, kf_pose *pose)
{
    char *const message = solver->message;
    kf_append_place(message, KF_POSE_U(pose), KF_ROUGHLY, KF_NAMED_DRIVER(solver));
    if (!(pose->found.residual <= solver->tolerance)) {
        kf_append(message, ": the rows do not close: residual ");
        kf_append_number(message, "%.2g", pose->found.residual);
        kf_append(message, " of the size");
        kf_append_rounding(message);
        return pose->status = KF_NOT_CONVERGED;
    }
    kf_append(message, ": ");
    kf_append_watch(message, &solver->model, &pose->found, "gap ", "%.3g");
    return pose->status = KF_INCONSISTENT;
}

/* Return the pose from which a path starts if the pose itself has no tangent. */
static KF_RARE kf_pose *base_of(kf_solver *solver, const kf_pose *pose)
{
    kf_pose *const base = &solver->scratch.base;
    if (pose->base_bridge >= 0) {
        kf_bridge_pose(solver, pose->base_bridge, pose->base_u, base);
    } else {
        kf_fresh(base, -1, -INFINITY, INFINITY);
        ++solver->scratch.work;
        kf_evaluated_as_given(&solver->model, pose->base_u, pose->base_z, &base->found);
    }
    base->map = pose->map;
    base->low = pose->low;
    base->high = pose->high;
    return base;
}

static inline bool is_same(const double *a, const double *b)
{
    bool same = true;
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        same = same && a[k] == b[k];
    }
    return same;
}

/* Take one trusted step; false near singular points, where `map` is the map with what is new there. */
static KF_WHOLE bool is_near(kf_solver *solver, kf_pose *start, const double *u, kf_pose *pose, int *map)
{
    const double longest = KF_LONGEST_STEP * kf_reach[KF_ALONG(solver)], s = u[KF_ALONG(solver)] - KF_HERE(solver, start);
    if (!(-longest <= s && s <= longest && start->low <= u[KF_ALONG(solver)] && u[KF_ALONG(solver)] <= start->high)
        || !kf_trusted_step(solver, start, KF_SPEEDS(&solver->model), s, u, pose)
        || !(pose->found.watch <= solver->tolerance && pose->found.residual <= solver->tolerance)) {
        return false;
    }
    if (pose->found.margin >= KF_REGULAR) {
        return true;
    }
    if (pose->found.margin > KF_NEAR
        && (pose->found.margin >= KF_CLOSE || kf_keeps_branch(solver, start, pose, KF_SPEEDS(&solver->model), s))) {
        kf_keep_maps(solver, start->map, start->map, start->map);
        *map = kf_surveyed(solver, start, pose);
        return *map == pose->map && !kf_is_overworked(solver);
    }
    return false;
}

/* Take one trusted step of several drivers to a pose that is regular and closes; false if it is none. */
static bool is_one_step(kf_solver *solver, kf_pose *start, const double *u, kf_pose *pose)
{
    double direction[KF_DRIVERS];
    const double distance = kf_straight_path(KF_POSE_U(start), u, direction);
    return distance <= KF_LONGEST_STEP && kf_trusted_step(solver, start, direction, distance, u, pose)
           && pose->found.margin >= KF_REGULAR && pose->found.watch <= solver->tolerance
           && pose->found.residual <= solver->tolerance;
}

/* Reject the pose if its rows or its watches do not close. */
kf_status kf_checked(kf_solver *solver, kf_pose *pose)
{
    if (!(pose->found.residual <= solver->tolerance && pose->found.watch <= solver->tolerance)) {
        solver->message[0] = '\0';
        return rejected(solver, pose);
    }
    return pose->status;
}

/* Find the pose at the driver values of the start: the start itself, or its checked copy if it is the anchor. */
static kf_status again(kf_solver *solver, kf_pose *start, kf_pose *pose)
{
    const kf_pose *found = NULL;
    if (start->found.margin < KF_REGULAR && start->status == KF_OK && start->map < 0) {
        kf_limit limit;
        int map = -1;
        if (KF_IS_FOLLOWED) {
            kf_keep_maps(solver, start->map, start->map, start->map);
            map = kf_surveyed(solver, start, start);
        }
        found = map < 0 ? NULL : kf_advance(solver, start, map, KF_POSE_U(start), &limit);
    }
    KF_ASSIGN(pose, found == NULL ? start : found);
    if (pose->status == KF_OK && pose->found.margin < KF_NEAR) {
        pose->status = KF_NEAR_SINGULAR;
    }
    return kf_checked(solver, pose);
}

#if KF_HAS(KF_TRACKS)
#define KF_SOLVE_ALONG kf_solve_along
#else
#define KF_SOLVE_ALONG kf_solve
#endif

inline kf_status KF_SOLVE_ALONG(kf_solver *solver, kf_pose *start, const double *u, kf_pose *pose)
{
    kf_pose *found;
    kf_limit limit;
    int map;
    if (!KF_TRACKS) {
        solver->scratch.work = 0;
    }
    if (solver->unsolvable) {
        return kf_failed(pose, KF_INCONSISTENT);
    }
    if (start->has_base && !is_same(u, KF_POSE_U(start))) {
        start = base_of(solver, start);
    }
    if (is_same(u, KF_POSE_U(start))) {
        return again(solver, start, pose);
    }
    map = start->map;
    if (KF_IS_FOLLOWED && is_near(solver, start, u, pose, &map)) { /* most samples */
        return KF_OK;
    }
    if (kf_is_refused(solver, u, KF_NAMED_DRIVER(solver), false)) {
        return kf_failed(pose, KF_OUTSIDE);
    }
    if (!KF_IS_FOLLOWED && is_one_step(solver, start, u, pose)) { /* most samples of several drivers */
        return KF_OK;
    }
    found = kf_advance(solver, start, map, u, &limit);
    if (kf_is_overworked(solver)) {
        return kf_overworked(solver, u, pose);
    }
    if (found == NULL) {
        kf_append_limit(solver->message, &limit, u, KF_NAMED_DRIVER(solver));
        return kf_failed(pose, KF_OUTSIDE);
    }
    KF_ASSIGN(pose, found);
    return kf_checked(solver, pose);
}

/* Form outputs, rates and accelerations from the derivatives of the pose: with respect to the only driver, or in time. */
inline void kf_outputs_of(const kf_model *model, const kf_pose *pose, const double *ud, const double *udd,
                          double *outputs, double *rates, double *accelerations)
{
    if (outputs != NULL) {
        kf_outputs(model, &pose->found, outputs);
    }
    if (rates != NULL) {
        kf_output_rates(model, &pose->found, pose->x1, ud[0], rates);
    }
    if (accelerations != NULL) {
        kf_output_accelerations(model, &pose->found, pose->x1, pose->x2, ud[0], udd[0], accelerations);
    }
}

inline void kf_motion(const kf_solver *solver, kf_pose *pose, const double *ud, const double *udd, double *outputs,
                      double *rates, double *accelerations)
{
    const kf_model *const model = &solver->model;
    const bool one = KF_DRIVERS == 1;
#if KF_HAS(KF_TRACKS)
    if (pose->is_held && (rates != NULL || accelerations != NULL)) {
        kf_rates_in_time(model, pose, ud, udd);
        kf_outputs_of(model, pose, ud, udd, outputs, rates, accelerations);
        return;
    }
#endif
    if ((rates != NULL || accelerations != NULL) && pose->derivatives < 1) {
        KF_VELOCITY(model, &pose->found, one ? kf_alone : ud, NULL, NULL, pose->x1);
        pose->derivatives = one ? 1 : 0; /* those with respect to the single driver stay valid */
    }
    if (accelerations != NULL && pose->derivatives < 2) {
        KF_ACCELERATION(model, &pose->found, one ? kf_at_rest : udd, pose->x1, NULL, NULL, pose->x2);
        pose->derivatives = one ? 2 : 0;
    }
    kf_outputs_of(model, pose, ud, udd, outputs, rates, accelerations);
}

double kf_margin(const kf_solver *solver, const kf_pose *pose)
{
    double matrix[KF_ROOM(KF_LARGEST_BLOCK)], margin = fmin(1.0, pose->found.margin);
    int block, first = 0;
    for (block = 0; block < KF_BLOCKS; ++block) {
        const int rows = kf_block_rows[block], columns = kf_block_ends[block] - first;
        if (rows > 1) {
            kf_jacobian(&solver->model, &pose->found, block, matrix);
            margin = fmin(margin, kf_reciprocal_condition(rows, columns, matrix));
        }
        first = kf_block_ends[block];
    }
    return margin;
}
