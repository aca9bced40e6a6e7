/* Directional derivatives: of outputs with respect to inputs, parameters and time.
 *
 * A direction of the known variables moves the drivers by (du, dv, da): values, speeds, accelerations. With R(v) the rates of the
 * outputs at driver speeds v, and H(v, w) the bilinear part of their accelerations, H(v, v) = accelerations at rest of v,
 *
 *     d values = R(du),   d rates = R(dv) + H(ud, du),   d accelerations = R(da) + 2 H(ud, dv) + T du
 *
 * come from the linear solves of the pose. T, the third derivative, and the derivatives of diagnostics and
 * with respect to parameters of the geometry (in initialization only: each trial binds them anew) are central differences
 * of sixth order:
 *
 *     f' = (45 (f1 - f-1) - 9 (f2 - f-2) + (f3 - f-3)) / 60 h
 */
#include "instance.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SMALLEST 0.1 /* margin below which the step is reduced by its square, since curvature grows so near singular points */

const double kf_sixth_order[3] = {45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0};
static const double at_rest[KF_DRIVERS];

/* rates += R(v) */
static void add_rates(kf_state *s, const double *v, double *rates)
{
    double row[KF_ROOM(KF_OUTPUTS)];
    int k;
    kf_motion(&s->solver, kf_shown(s), v, at_rest, NULL, row, NULL);
    for (k = 0; k < KF_OUTPUTS; ++k) {
        rates[k] += row[k];
    }
}

/* The largest rate of a driver, over its reach. */
double kf_largest_rate(const double *v)
{
    double largest = 0.0;
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        largest = fmax(largest, fabs(v[k]) / kf_reach[k]);
    }
    return largest;
}

/* Return the step of differences along a direction of the drivers at unit rate, at the pose shown. */
double kf_trial_step(kf_state *s)
{
    const double margin = fmax(kf_margin(&s->solver, kf_shown(s)), SMALLEST);
    return KF_TRIAL * margin * margin;
}

/* row += factor H(v, w), by H(v + w, v + w) - H(v - w, v - w) = 4 H(v, w) with v and w made equally long */
static void add_bilinear(kf_state *s, const double *v, const double *w, double factor, double *row)
{
    double sum[KF_DRIVERS], difference[KF_DRIVERS], plus[KF_ROOM(KF_OUTPUTS)], minus[KF_ROOM(KF_OUTPUTS)];
    const double of_v = kf_largest_rate(v), of_w = kf_largest_rate(w);
    int k;
    if (of_v == 0.0 || of_w == 0.0) {
        return;
    }
    for (k = 0; k < KF_DRIVERS; ++k) {
        sum[k] = v[k] / of_v + w[k] / of_w;
        difference[k] = v[k] / of_v - w[k] / of_w;
    }
    kf_motion(&s->solver, kf_shown(s), sum, at_rest, NULL, NULL, plus);
    kf_motion(&s->solver, kf_shown(s), difference, at_rest, NULL, NULL, minus);
    for (k = 0; k < KF_OUTPUTS; ++k) {
        row[k] += factor * 0.25 * of_v * of_w * (plus[k] - minus[k]);
    }
}

/* Evaluate the parts at driver values u, with speeds and accelerations, by a solver from a start. */
static bool try_at(kf_solver *solver, kf_pose *start, kf_pose *pose, const double *const drive[3], unsigned parts,
                   double *row)
{
    if (!KF_GOOD(kf_solve(solver, start, drive[0], pose))) {
        return false;
    }
    kf_motion(solver, pose, drive[1], drive[2], parts & KF_BIT(KF_PART_VALUES) ? row + kf_part_first[KF_PART_VALUES] : NULL,
              parts & KF_BIT(KF_PART_RATES) ? row + kf_part_first[KF_PART_RATES] : NULL,
              parts & KF_BIT(KF_PART_ACCELERATIONS) ? row + kf_part_first[KF_PART_ACCELERATIONS] : NULL);
    row[kf_part_first[KF_PART_RESIDUAL]] = pose->found.residual;
    if (parts & KF_BIT(KF_PART_MARGIN)) {
        row[kf_part_first[KF_PART_MARGIN]] = kf_margin(solver, pose);
    }
    if (parts & KF_BIT(KF_PART_ERRORS)) {
        kf_errors(solver, pose, drive[1], drive[2], row + kf_part_first[KF_PART_ERRORS]);
        kf_bound_errors(row + kf_part_first[KF_PART_ERRORS]);
    }
    if (parts & KF_BIT(KF_PART_WATCH)) {
        kf_watches(&solver->model, &pose->found, row + kf_part_first[KF_PART_WATCH]);
    }
    if (parts & KF_BIT(KF_PART_FIXED)) {
        kf_fixed(&solver->model, row + kf_part_first[KF_PART_FIXED]);
    }
    return true;
}

/* slope[...] += differences of the parts along du and, if a solver to bind is given, along the parameters' seed. */
static bool add_differences(kf_instance *instance, const double *du, kf_solver *other, const double *seed, double h,
                            unsigned parts)
{
    kf_state *const s = &instance->now;
    kf_solver *const solver = other ? other : &s->solver;
    kf_pose *const start = other ? &other->anchor : &s->poses[s->committed];
    kf_pose *const pose = &s->poses[s->committed == 0 ? 1 : 0];
    const double *const given = KF_REAL(s, KF_PART_PARAMETERS);
    double moved[KF_ROOM(KF_PARAMETERS)], u[KF_DRIVERS], ud[KF_DRIVERS], udd[KF_DRIVERS];
    const double *drive[3];
    double *const total = instance->total;
    int k, j, part, sign;
    memset(total, 0, sizeof instance->total);
    drive[0] = u;
    drive[1] = ud;
    drive[2] = udd;
    memcpy(ud, s->ud, sizeof ud);
    memcpy(udd, s->udd, sizeof udd);
    for (j = 1; j <= 3; ++j) {
        for (sign = -1; sign <= 1; sign += 2) {
            for (k = 0; k < KF_DRIVERS; ++k) {
                u[k] = s->u[k] + sign * j * h * (other ? 0.0 : du[k]);
            }
            for (k = 0; other && k < KF_PARAMETERS; ++k) {
                moved[k] = given[k] + sign * j * h * seed[k];
            }
            if (other && !kf_solver_bind(other, moved)) {
                return false;
            }
            if (other && !kf_drive_of_trial(instance, other, pose, u, ud, udd)) {
                return false;
            }
            if (!try_at(solver, start, pose, drive, parts, instance->trial)) {
                return false;
            }
            if (parts & KF_FORCE_PARTS) {
                kf_forces_of_trial(s, solver, pose, drive, parts, instance->trial);
            }
            for (k = 0; k < KF_REALS; ++k) {
                total[k] += sign * kf_sixth_order[j - 1] / h * instance->trial[k];
            }
        }
    }
    for (part = 0; part < KF_PARTS; ++part) {
        for (k = kf_part_first[part]; (parts >> part & 1u) && k < kf_part_first[part + 1]; ++k) {
            instance->slope[k] += total[k];
        }
    }
    return true;
}

static kf_answer differences(kf_instance *instance, const double *du, kf_solver *other, const double *seed, double fastest,
                             unsigned parts)
{
    kf_state *const s = &instance->now;
    double h = kf_trial_step(s) / fastest;
    bool done = false;
    int k;
    memset(instance->trial, 0, sizeof instance->trial);
    for (k = 0; k < KF_TRIES && !done; ++k, h *= 0.5) {
        done = add_differences(instance, du, other, seed, h, parts);
    }
    if (s->asked != s->committed) { /* the trials overwrote the pose; it is solved again when needed */
        s->solved = false;
    }
    if (!done) {
        return kf_answered(instance, KF_DISCARD, "there is no directional derivative: no pose near this one can be reached");
    }
    return KF_DONE;
}

static kf_answer along_parameters(kf_instance *instance, const double *seed, unsigned parts)
{
    kf_state *const s = &instance->now;
    const double *const given = KF_REAL(s, KF_PART_PARAMETERS);
    const double least = fmin(1.0, kf_size);
    double fastest = 0.0;
    kf_solver *other;
    kf_answer answer;
    int k;
    for (k = 0; k < KF_PARAMETERS; ++k) {
        fastest = fmax(fastest, fabs(seed[k]) / (given[k] != 0.0 ? fabs(given[k]) : least));
    }
    if (fastest == 0.0) {
        return KF_DONE;
    }
    other = malloc(sizeof *other);
    if (other == NULL) {
        return kf_answered(instance, KF_ERROR, "getDirectionalDerivative: out of memory");
    }
    memset(other, 0, sizeof *other);
    kf_solver_start(other);
    other->tolerance = s->solver.tolerance;
    answer = differences(instance, NULL, other, seed, fastest, parts);
    free(other);
    return answer;
}

/* The derivatives of all parts along a direction, in instance->slope. */
static kf_answer along(kf_instance *instance, double time_seed, unsigned parts)
{
    const unsigned linear = KF_BIT(KF_PART_VALUES) | KF_BIT(KF_PART_RATES);
    kf_state *const s = &instance->now;
    double *const seed = instance->seed, *const slope = instance->slope;
    kf_direction direction;
    double fastest;
    kf_answer answer;
    int k;
    memset(&direction, 0, sizeof direction);
    memset(slope, 0, sizeof instance->slope);
    answer = kf_direction_of_drivers(instance, seed, time_seed, &direction);
    if (answer != KF_DONE) {
        return answer;
    }
    add_rates(s, direction.du, slope + kf_part_first[KF_PART_VALUES]);
    add_rates(s, direction.dv, slope + kf_part_first[KF_PART_RATES]);
    add_bilinear(s, s->ud, direction.du, 1.0, slope + kf_part_first[KF_PART_RATES]);
    add_rates(s, direction.da, slope + kf_part_first[KF_PART_ACCELERATIONS]);
    add_bilinear(s, s->ud, direction.dv, 2.0, slope + kf_part_first[KF_PART_ACCELERATIONS]);
    for (k = 0; k < KF_DRIVERS; ++k) {
        double *const driven = slope + kf_part_first[KF_PART_DRIVEN] + 3 * k;
        driven[0] = direction.du[k];
        driven[1] = direction.dv[k];
        driven[2] = direction.da[k];
    }
    if (parts & KF_FORCE_PARTS) { /* before the trials, which overwrite the pose */
        kf_add_force_slopes(s, direction.dv, direction.da, seed + kf_part_first[KF_PART_LOADS], time_seed, parts, slope);
    }
    fastest = kf_largest_rate(direction.du);
    if (fastest > 0.0 && (parts & ~linear)) {
        answer = differences(instance, direction.du, NULL, NULL, fastest, parts & ~linear & ~KF_BIT(KF_PART_DRIVEN));
    }
    if (answer == KF_DONE) {
        answer = along_parameters(instance, seed + kf_part_first[KF_PART_PARAMETERS], parts);
    }
    return answer;
}

static bool is_unknown(unsigned reference)
{
    const unsigned place = KF_PLACE(reference);
    return place < KF_REALS && !(KF_BIT(kf_part_of[place]) & KF_GIVEN_PARTS);
}

/* Variables that may be differentiated by: inputs, time and tunable parameters; before the end of initialization the
 * fixed ones too.
 */
static bool is_known(const kf_state *s, unsigned reference)
{
    const unsigned place = KF_PLACE(reference);
    if (place >= KF_REALS) {
        return reference == KF_TIME;
    }
    return kf_is_given(place) && (kf_part_of[place] != KF_PART_PARAMETERS || s->mode <= KF_INITIALIZATION);
}

kf_answer kf_directional(kf_instance *instance, const unsigned *unknowns, size_t unknown_count, const unsigned *knowns,
                         size_t known_count, const double *seed, double *sensitivity)
{
    kf_state *const s = &instance->now;
    unsigned parts = 0;
    bool is_held = false;
    double time_seed = 0.0;
    kf_answer answer;
    size_t k;
    memset(instance->seed, 0, sizeof instance->seed);
    for (k = 0; k < unknown_count; ++k) {
        if (!is_unknown(unknowns[k])) {
            return kf_answered(instance, KF_ERROR, "%s (value reference %u) has no directional derivative",
                          kf_name_of(unknowns[k]), unknowns[k]);
        }
        parts |= KF_BIT(kf_part_of[KF_PLACE(unknowns[k])]);
    }
    for (k = 0; k < known_count; ++k) {
        if (!is_known(s, knowns[k]) || !isfinite(seed[k])) {
            return kf_answered(instance, KF_ERROR, "no directional derivative along %s (value reference %u) now, by %g",
                          kf_name_of(knowns[k]), knowns[k], seed[k]);
        }
        if (knowns[k] == KF_TIME) {
            time_seed += seed[k];
        } else {
            instance->seed[KF_PLACE(knowns[k])] += seed[k];
        }
    }
    if (!KF_GOOD(kf_ask(instance))) {
        return kf_answered(instance, KF_DISCARD, "at t = %g s: %s", s->time, s->message);
    }
    /* The derivative is that of setting an input now, even if the pose shown still is that of the last commit. */
    is_held = !s->driven_by_time && !s->model_exchange && s->samples && !s->touched && !s->ended;
    if (is_held) {
        s->touched = true;
        s->drive_known = false;
    }
    kf_find_drive(s);
    answer = along(instance, time_seed, parts);
    if (is_held) {
        s->touched = s->drive_known = false;
    }
    for (k = 0; answer == KF_DONE && k < unknown_count; ++k) {
        sensitivity[k] = instance->slope[KF_PLACE(unknowns[k])];
    }
    return answer;
}
