/* Trusted steps: predict, correct, and accept only what stays on the branch. See kinfmu/solver/python/trusted_step.py. */
#include "internal.h"

/* Return whether the columns of a block's J change their orientation from a pose to another, det(J^T J') <= 0.
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

#if KF_HAS(KF_LAWS)
/* Return whether a step passes over a part of a law that it has not seen, or over a length below 0.
 *
 * What it monitors moves along the step as predicted, and by what the prediction is `off` to either side. Arguments may
 * turn back within the step. A coordinate that a law gives outright may not be off by so much that another one, predicted
 * from it, may be a whole turn off.
 */
static bool passes_unseen(const kf_model *model, const kf_found *pose, const double *x1, const double *x2,
                          const kf_found *trial, double s)
{
    double here[KF_LAWS], rates[KF_LAWS], bends[KF_LAWS], there[KF_LAWS], lows[KF_LAWS], highs[KF_LAWS];
    double before[KF_ROOM(KF_LAW_ARGUMENTS)], after[KF_ROOM(KF_LAW_ARGUMENTS)];
    int k;
    kf_law_positions(model, pose, here);
    kf_law_rates(model, pose, x1, rates);
    kf_law_accelerations(model, pose, x1, x2, bends);
    kf_law_positions(model, trial, there);
    for (k = 0; k < KF_LAWS; ++k) {
        const double rate = s * rates[k], bend = s * s * bends[k], predicted = here[k] + rate + 0.5 * bend;
        double off = there[k] - predicted;
        if (k < KF_LAW_ARGUMENTS && kf_law_turns[k] > 0.0) {
            off -= kf_law_turns[k] * floor(off / kf_law_turns[k] + 0.5);
        }
        if (!(fabs(off) <= KF_MOST_OFF * kf_law_units[k])) {
            return true;
        }
        lows[k] = fmin(here[k], predicted);
        highs[k] = fmax(here[k], predicted);
        if (rate * (rate + bend) < 0.0) {
            const double turning = here[k] - 0.5 * rate * rate / bend;
            lows[k] = fmin(lows[k], turning);
            highs[k] = fmax(highs[k], turning);
        }
        lows[k] -= fabs(off);
        highs[k] += fabs(off);
        if (k >= KF_LAW_ARGUMENTS && k < KF_LAW_ARGUMENTS + KF_LAW_LENGTHS && lows[k] < 0.0) {
            return true;
        }
    }
    kf_law_slopes(model, before);
    for (k = 0; k < KF_LAW_ARGUMENTS && before[k] * (highs[k] - lows[k]) <= 1.0; ++k) {
    }
    if (k == KF_LAW_ARGUMENTS) { /* as a rule */
        return false;
    }
    kf_law_steps(model, lows, before);
    kf_law_steps(model, highs, after);
    for (k = 0; k < KF_LAW_ARGUMENTS; ++k) {
        if (fabs(after[k] - before[k]) > 1.0) {
            return true;
        }
    }
    return false;
}

/* Return the same of the step between two poses along a single driver. */
bool kf_passes_unseen_between(kf_solver *solver, kf_pose *pose, const kf_pose *trial)
{
    kf_tangent(&solver->model, pose);
    return passes_unseen(&solver->model, &pose->found, pose->x1, pose->x2, &trial->found,
                         KF_HERE(solver, trial) - KF_HERE(solver, pose));
}
#endif

/* Take one step of predict and correct; return false if it cannot be trusted to stay on the branch. */
inline bool kf_trusted_step(kf_solver *solver, kf_pose *pose, const double *direction, double s, const double *u,
                     kf_pose *trial)
{
    const kf_model *const model = &solver->model;
    const double *x1 = pose->x1, *x2 = pose->x2;
    double needed;
    int k;
    if (solver->scratch.work >= solver->most_work) {
        solver->scratch.work += solver->scratch.work == solver->most_work; /* what is refused is no work */
        return false;
    }
    ++solver->scratch.work;
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
#if KF_HAS(KF_LAWS)
    if (KF_LAWS && passes_unseen(model, &pose->found, x1, x2, &trial->found, s)) {
        return false;
    }
#endif
    if (KF_TALL && turns_over(model, pose, trial)) {
        return false;
    }
    for (k = 0; trial->found.moved > KF_UNDOUBTED && k < KF_UNKNOWNS; ++k) {
        if (fabs(x2[k]) * s * s > 2.0 * KF_BENT * kf_unknown_scales[k]) {
            return false;
        }
    }
    kf_fresh(trial, pose->map, pose->low, pose->high);
    return true;
}

/* Return false if the tangent of a path jumps in a step along it, as it does from one branch to a crossing one.
 *
 * Near a crossing the branches lie as close as corrections are small, and one of them keeps the determinant's sign;
 * their tangents stay apart. Towards a dead centre the tangent grows, but in a step by at most KF_SMOOTH of itself. Where
 * the unknowns rest the tangent is rounding noise: at a distance x from a crossing both branches have a determinant
 * |D| ~ x and lie |D| apart, so in a step s across it their tangents differ by (|D| + |D'|) / s. Where a pose is so
 * close to either that doubles cannot tell the branches apart, no step is accepted.
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
    return jump <= KF_SMOOTH * fmax(largest, KF_APART * (pose->found.margin + trial->found.margin) / fabs(s));
}

/* Return the pose at a value of the only driver, followed by trusted steps without bridges, or NULL. It lasts until the
 * next call, which may start from it.
 */
kf_pose *kf_follow_path(kf_solver *solver, kf_pose *start, double u)
{
    const double longest = KF_LONGEST_STEP * kf_reach[KF_ALONG(solver)];
    kf_pose *const found = solver->scratch.follow, *pose = start;
    double step = longest;
#if KF_HAS(KF_TRACKS)
    double buffer[KF_DRIVERS];
#endif
    int k;
    for (k = 0; k < KF_MOST_FOLLOWED; ++k) {
        const double here = KF_HERE(solver, pose), distance = u - here;
        const bool whole = -step <= distance && distance <= step;
        const double s = whole ? distance : distance > 0.0 ? step : -step, there = whole ? u : here + s;
        kf_pose *const trial = pose == &found[0] ? &found[1] : &found[0];
        if (here == u) {
            return pose;
        }
        if (kf_trusted_step(solver, pose, KF_SPEEDS(&solver->model), s, KF_AT(&solver->model, &there, buffer), trial)) {
            pose = trial;
            continue;
        }
        step = 0.5 * fabs(s);
        if (step < KF_ROUGHEST * longest) {
            return NULL;
        }
    }
    return NULL;
}
