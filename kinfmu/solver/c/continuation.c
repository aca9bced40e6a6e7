/* Continuation: from the anchor with the parameters of the mechanism to the same pose with other parameters.
 *
 *     Phi(q, u, p0 + s (p1 - p0)) = 0,   s from 0 to 1
 *
 * The drivers rest; steps in s are predicted by the last step's slope, corrected by Newton and trusted as on a
 * path of the drivers. See kinfmu/solver/python/continuation.py.
 */
#include "internal.h"

#define WHY 200 /* characters */

/* Return whether corrections are small compared with the determinants and no determinant falls steeply. */
static bool is_trusted(const kf_found *found, const kf_found *trial)
{
    int k;
    if (KF_TRUST * trial->moved > fmin(trial->margin, found->margin) || trial->margin == 0.0) {
        return false;
    }
    for (k = 0; k < KF_BLOCKS; ++k) {
        const double before = found->determinants[k], after = trial->determinants[k];
        if (!(before > 0.0 ? after >= KF_FALL * before : after <= KF_FALL * before)) {
            return false;
        }
    }
    return true;
}

#if KF_HAS(KF_LAWS)
/* Return whether what laws give outright moves by so much that what follows from it may be a whole turn off. */
static bool leads_far(const kf_model *model, const kf_model *ahead, const kf_pose *pose, const kf_pose *trial)
{
    double here[KF_LAWS], there[KF_LAWS];
    int k;
    kf_law_positions(model, &pose->found, here);
    kf_law_positions(ahead, &trial->found, there);
    for (k = KF_LAW_ARGUMENTS + KF_LAW_LENGTHS; k < KF_LAWS; ++k) {
        if (!(fabs(there[k] - here[k]) <= KF_MOST_OFF * kf_law_units[k])) {
            return true;
        }
    }
    return false;
}
#else
#define leads_far(model, ahead, pose, trial) false
#endif

/* "parameters coupler = 9": those that differ from the mechanism's. */
static void append_parameters(char *message, const double *parameters)
{
    bool is_first = true;
    int k;
    message[0] = '\0';
    kf_append(message, "parameters ");
    for (k = 0; k < KF_PARAMETERS; ++k) {
        if (parameters[k] != kf_parameters_written[k]) {
            kf_append(message, "%s%s = ", is_first ? "" : ", ", kf_parameter_names[k]);
            kf_append_number(message, "%.12g", parameters[k]);
            is_first = false;
        }
    }
    kf_append(message, ": ");
}

static double length_of(int count, const double *vector)
{
    double largest = 0.0, square = 0.0;
    int k;
    for (k = 0; k < count; ++k) {
        largest = fmax(largest, fabs(vector[k]));
    }
    for (k = 0; largest > 0.0 && k < count; ++k) {
        square += vector[k] / largest * (vector[k] / largest);
    }
    return largest * sqrt(square);
}

/* Form J^T (J, r) of a block at the pose found, rows relative to the size; return the length of r. */
static double normal_equations(const kf_model *model, const kf_found *found, int block, int k, double *normal,
                               double *right)
{
    double jacobian[KF_ROOM(KF_LARGEST_BLOCK)], left[KF_ROOM(KF_LARGEST_BLOCK)];
    const int m = kf_block_rows[block];
    const double *scales = kf_row_scales;
    int i, j, row;
    for (i = 0; i < block; ++i) {
        scales += kf_block_rows[i];
    }
    kf_jacobian(model, found, block, jacobian);
    kf_residuals(model, found, block, left);
    for (i = 0; i < k; ++i) {
        right[i] = 0.0;
        for (row = 0; row < m; ++row) {
            right[i] -= jacobian[row * k + i] / scales[row] * left[row];
        }
        for (j = 0; j < k; ++j) {
            normal[i * k + j] = 0.0;
            for (row = 0; row < m; ++row) {
                normal[i * k + j] += jacobian[row * k + i] / scales[row] * (jacobian[row * k + j] / scales[row]);
            }
        }
    }
    return length_of(m, left);
}

double kf_gap(kf_solver *solver, const kf_model *model, int block, const double *u, double *z)
{
    kf_found *const found = &solver->scratch.follow[0].found;
    double normal[KF_ROOM(KF_LARGEST_BLOCK)], damped[KF_ROOM(KF_LARGEST_BLOCK)], right[KF_ROOM(KF_LARGEST_BLOCK)];
    double factors[KF_LU_ROOM(1) + 3 * KF_LARGEST_BLOCK], step[KF_ROOM(KF_LARGEST_BLOCK)];
    double residuals[KF_ROOM(KF_LARGEST_BLOCK)], determinant, damping = 1e-3, left = -1.0, now;
    double *const trial = solver->scratch.zd;
    const int first = kf_first_of(block), k = kf_block_ends[block] - first;
    int turn, i;
    for (turn = 0; turn < KF_MOST_ITERATIONS; ++turn) {
        if (left < 0.0) {
            if (!kf_evaluated_as_given(model, u, z, found)) {
                return 0.0;
            }
            left = normal_equations(model, found, block, k, normal, right);
        }
        memcpy(damped, normal, (size_t)(k * k) * sizeof(double));
        for (i = 0; i < k; ++i) {
            damped[i * k + i] += damping * (normal[i * k + i] + 1e-12);
        }
        if (!kf_lu(k, damped, factors, &determinant)) {
            break;
        }
        kf_lu_solve(k, factors, right, step);
        memcpy(trial, z, KF_UNKNOWNS * sizeof(double));
        for (i = 0; i < k; ++i) {
            trial[first + i] += step[i];
        }
        if (!kf_evaluated_as_given(model, u, trial, found)) {
            return 0.0;
        }
        kf_residuals(model, found, block, residuals);
        now = length_of(kf_block_rows[block], residuals);
        if (now < left) {
            memcpy(z, trial, KF_UNKNOWNS * sizeof(double));
            left = -1.0;
            damping = fmax(0.2 * damping, 1e-12);
        } else {
            damping *= 8.0;
            if (damping > 1e8) {
                break;
            }
        }
    }
    kf_evaluated_as_given(model, u, z, found);
    kf_residuals(model, found, block, residuals);
    return length_of(kf_block_rows[block], residuals);
}

/* Append why the path ends: the rows that do not close with these parameters, and their smallest gap. */
static void append_failure(kf_solver *solver, const double *parameters, int block)
{
    kf_model *const model = &solver->scratch.ahead;
    const double *const determinants = solver->anchor.found.determinants;
    const bool is_known = block >= 0;
    char why[WHY];
    double gap;
    int k;
    if (!kf_bind(model, parameters, why, sizeof why)) { /* a length that is not positive */
        kf_append(solver->message, "%s", why);
        return;
    }
    for (k = 0; !is_known && k < KF_BLOCKS; ++k) {
        block = block < 0 || fabs(determinants[k]) < fabs(determinants[block]) ? k : block;
    }
    if (block < 0) {
        kf_append(solver->message, "the mechanism does not close");
        return;
    }
    memcpy(solver->scratch.z, solver->anchor.found.x, KF_UNKNOWNS * sizeof(double));
    gap = kf_gap(solver, model, block, kf_anchor_u, solver->scratch.z);
    if (gap > 1e-9) {
        kf_append(solver->message, "the mechanism does not close: rows %s leave a gap of ", kf_block_row_names[block]);
        kf_append_number(solver->message, "%.4g", gap * kf_size);
        kf_append(solver->message, " %s", kf_length_unit);
    } else {
        kf_append(solver->message, "beyond a singular point, where rows %s are dependent",
               kf_block_row_names[block]);
    }
}

bool kf_continued(kf_solver *solver, const double *from, const double *to, const double *u, double shortest,
                  kf_pose *pose, kf_continuation *path)
{
    kf_model *const ahead = &solver->scratch.ahead;
    kf_pose *const trial = &solver->scratch.poses[0];
    double *const slope = solver->scratch.zd;
    double p[KF_ROOM(KF_PARAMETERS)], s = 0.0, turn = 0.0, longest, step;
    bool is_there = true;
    int k;
    path->block = -1;
    for (k = 0; k < KF_PARAMETERS; ++k) {
        is_there = is_there && to[k] == from[k];
        turn = kf_parameter_is_angle[k] ? fmax(turn, fabs(to[k] - from[k])) : turn;
    }
    longest = turn > 0.0 ? fmin(1.0, KF_LONGEST_TURN / turn) : 1.0;
    step = longest;
    memset(slope, 0, KF_UNKNOWNS * sizeof(double));
    for (path->steps = 0; path->steps < KF_MOST_CONTINUED && !is_there; ++path->steps) {
        const double there = fmin(s + step, 1.0);
        char why[WHY];
        for (k = 0; k < KF_PARAMETERS; ++k) {
            p[k] = there == 1.0 ? to[k] : from[k] + there * (to[k] - from[k]);
        }
        kf_fresh(trial, -1, -INFINITY, INFINITY);
        if (kf_bind(ahead, p, why, sizeof why)) {
            const int failed =
                kf_position(ahead, u, pose->found.x, slope, kf_at_rest, there - s, NULL, &trial->found);
            if (failed < 0 && is_trusted(&pose->found, &trial->found) && !leads_far(&solver->model, ahead, pose, trial)) {
                for (k = 0; k < KF_UNKNOWNS; ++k) {
                    slope[k] = (trial->found.x[k] - pose->found.x[k]) / (there - s);
                }
                KF_ASSIGN(pose, trial);
                solver->model = *ahead;
                s = there;
                step = fmin(2.0 * step, longest);
                is_there = s == 1.0;
                continue;
            }
            path->block = failed >= 0 ? failed : path->block;
        }
        step *= 0.5;
        if (step < shortest) {
            break;
        }
    }
    return is_there;
}

bool kf_solver_bind(kf_solver *solver, const double *parameters)
{
    const double tolerance = solver->tolerance;
    kf_continuation path;
    bool is_there;
    kf_solver_start(solver);
    solver->tolerance = tolerance;
    is_there = kf_continued(solver, kf_parameters_written, parameters, kf_anchor_u, KF_SHORTEST, &solver->anchor, &path);
    solver->unsolvable = !is_there || !(solver->anchor.found.watch <= solver->tolerance);
    if (!solver->unsolvable) {
        solver->message[0] = '\0';
        return true;
    }
    append_parameters(solver->message, parameters);
    if (is_there) {
        kf_append_watch(solver->message, &solver->model, &solver->anchor.found, "gap about ", "%.4g");
    } else if (path.steps < KF_MOST_CONTINUED) {
        append_failure(solver, parameters, path.block);
    } else {
        kf_append(solver->message, "too far from the parameters as written");
    }
    return false;
}
