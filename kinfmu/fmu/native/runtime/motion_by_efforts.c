/* The motion of the drivers (motion.h) under efforts: values and speeds of the drivers are states, which are integrated. */
#include "torque.h"

#include <math.h>
#include <string.h>

/* Rates are states. */
void kf_find_rate_sources(kf_state *s)
{
    (void)s;
}

void kf_asked_values(const kf_state *s, double *u)
{
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        u[k] = s->real[3 * k];
    }
}

kf_answer kf_begin_motion(kf_instance *instance)
{
    kf_state *const s = &instance->now;
    kf_find_drive(s);
    if (!isfinite(s->udd[0])) {
        const int k = kf_massless(&s->solver, kf_shown(s), s->time, s->ud, KF_REAL(s, KF_PART_LOADS));
        return kf_answered(instance, KF_ERROR, "initialization fails: driver %s: its reduced inertia is 0, so that efforts do "
                      "not determine its motion; give a body that it moves a mass or an inertia", kf_driver_names[k]);
    }
    kf_commit(s, s->time, 0.0);
    return KF_DONE;
}

/* The host's tolerance, within the bounds of the integrator's. */
void kf_set_tolerance(kf_instance *instance, double tolerance)
{
    if (!instance->now.model_exchange && tolerance > 0.0) {
        KF_REAL(&instance->now, KF_PART_TOLERANCE)[1] = fmin(fmax(tolerance, KF_LEAST_TOLERANCE), KF_MOST_TOLERANCE);
    }
}

/* States and pose at both ends of a step are committed. */
kf_answer kf_move(kf_instance *instance, double time, double step)
{
    kf_state *const s = &instance->now;
    double reached;
    if (s->ahead) {
        kf_forget(s);
    }
    s->time = time;
    if (!KF_GOOD(kf_ask(instance))) {
        return kf_discarded(instance, time, step, time);
    }
    kf_forget_motion(s); /* loads may depend on time */
    kf_find_drive(s);
    kf_commit(s, time, step);
    if (!kf_integrate(instance, time + step, &reached)) {
        return kf_discarded(instance, time, step, reached);
    }
    kf_find_drive(s);
    kf_commit(s, s->time, step);
    return KF_DONE;
}

kf_answer kf_accept_step(kf_instance *instance)
{
    kf_state *const s = &instance->now;
    double reached;
    s->terminated = kf_passes_limit(instance, &reached);
    if (s->terminated) {
        return kf_answered(instance, KF_WARN, "at t = %g s: %s", reached, s->message);
    }
    kf_find_drive(s);
    return KF_DONE;
}

void kf_time_changed(kf_state *s)
{
    kf_forget_motion(s); /* loads may depend on time */
}

const double *kf_constants_of_jumps(const kf_state *s)
{
    return KF_REAL(s, KF_PART_LOADS);
}

/* Read u and ud from the states and compute udd, NaN where the reduced inertia does not determine it. */
void kf_asked_drive(kf_state *s, double *u, double *ud, double *udd)
{
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        u[k] = s->real[3 * k];
        ud[k] = s->real[3 * k + 1];
    }
    if (!KF_GOOD(s->status) || !kf_accelerations(&s->solver, kf_shown(s), s->time, ud, KF_REAL(s, KF_PART_EFFORTS),
                                                 KF_REAL(s, KF_PART_LOADS), udd)) {
        for (k = 0; k < KF_DRIVERS; ++k) {
            udd[k] = NAN;
        }
    }
    for (k = 0; k < KF_DRIVERS; ++k) {
        s->real[3 * k + 2] = udd[k];
    }
}

void kf_committed_drive(const kf_state *s, double *u, double *ud, double *udd)
{
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        u[k] = s->samples ? s->history[s->samples - 1].u[k] : s->committed_u[k];
        ud[k] = s->samples ? s->committed_inputs[3 * k + 1] : 0.0;
        udd[k] = s->samples ? s->committed_inputs[3 * k + 2] : 0.0;
    }
}

/* Rates are not estimated. */
void kf_add_rate_errors(kf_state *s, double errors[3])
{
    (void)s;
    (void)errors;
}

/* Accelerations that no reduced inertia determines are refused. */
kf_answer kf_read_drivers(kf_instance *instance, unsigned parts)
{
    kf_state *const s = &instance->now;
    int k;
    if (!(parts & (KF_POSE_PARTS | KF_BIT(KF_PART_STATES))) || !KF_GOOD(s->status)) {
        return KF_DONE;
    }
    kf_find_drive(s);
    for (k = 0; k < KF_DRIVERS; ++k) {
        if (!isfinite(s->udd[k])) {
            return kf_answered(instance, KF_DISCARD, "at t = %g s: the reduced inertia is singular, or a number is not finite",
                               s->time);
        }
    }
    return KF_DONE;
}

bool kf_set_input(kf_state *s, unsigned place, double value)
{
    (void)s;
    (void)place;
    (void)value;
    return false;
}

void kf_efforts_changed(kf_state *s)
{
    kf_forget_motion(s);
}

void kf_derivative_set(kf_state *s, int number, int order, double value)
{
    (void)s;
    (void)number;
    (void)order;
    (void)value;
}

void kf_drop_past_derivatives(kf_state *s)
{
    (void)s;
}

static kf_answer check_count(const kf_instance *instance, const double *numbers, size_t count)
{
    if (numbers == NULL || count != KF_NUMBERS) {
        return kf_answered(instance, KF_ERROR, "%zu numbers for %d continuous states", numbers ? count : 0, KF_NUMBERS);
    }
    return KF_DONE;
}

/* The states of model exchange: value and speed of each driver. */
kf_answer kf_set_states(kf_instance *instance, const double *states, size_t count)
{
    kf_state *const s = &instance->now;
    kf_answer answer = check_count(instance, states, count);
    size_t k;
    if (answer == KF_DONE) {
        answer = kf_possible(instance, KF_SET_STATES);
    }
    for (k = 0; answer == KF_DONE && k < KF_NUMBERS; ++k) {
        if (!(fabs(states[k]) <= KF_LARGEST)) {
            return kf_answered(instance, KF_DISCARD, "%s = %g is no finite number", kf_variable_names[3 * (k / 2) + k % 2], states[k]);
        }
    }
    for (k = 0; answer == KF_DONE && k < KF_NUMBERS; ++k) {
        s->real[3 * (k / 2) + k % 2] = states[k];
    }
    kf_touch(s);
    kf_forget(s);
    return answer;
}

kf_answer kf_get_states(kf_instance *instance, double *states, size_t count)
{
    const kf_answer answer = check_count(instance, states, count);
    size_t k;
    for (k = 0; answer == KF_DONE && k < KF_NUMBERS; ++k) {
        states[k] = instance->now.real[3 * (k / 2) + k % 2];
    }
    return answer;
}

kf_answer kf_get_state_derivatives(kf_instance *instance, double *derivatives, size_t count)
{
    kf_answer answer = check_count(instance, derivatives, count);
    size_t k;
    if (answer == KF_DONE) {
        answer = kf_read(instance, KF_BIT(KF_PART_STATES) | KF_BIT(KF_PART_VALUES));
    }
    for (k = 0; answer == KF_DONE && k < KF_NUMBERS; ++k) {
        derivatives[k] = instance->now.real[3 * (k / 2) + k % 2 + 1];
    }
    return answer;
}

/* The accelerations of the drivers by differences along states, efforts, loads and time. */
kf_answer kf_direction_of_drivers(kf_instance *instance, const double *seed, double time_seed, kf_direction *direction)
{
    kf_state *const s = &instance->now;
    double u[KF_DRIVERS], ud[KF_DRIVERS], udd[KF_DRIVERS], efforts[KF_DRIVERS], loads[KF_ROOM(KF_LOADS)];
    double fastest, h;
    int k, j, sign, tries;
    bool done = false;
    for (k = 0; k < KF_DRIVERS; ++k) {
        direction->du[k] = seed[3 * k];
        direction->dv[k] = seed[3 * k + 1];
    }
    fastest = kf_largest_rate(direction->du);
    h = fastest > 0.0 ? kf_trial_step(s) / fastest : 1.0;
    if (time_seed != 0.0) {
        h = fmin(h, KF_TRIAL / fabs(time_seed));
    }
    h = kf_step_along_laws(KF_REAL(s, KF_PART_LOADS), seed + kf_part_first[KF_PART_LOADS], h);
    for (tries = 0; tries < KF_TRIES && !done; ++tries, h *= 0.5) {
        memset(direction->da, 0, sizeof direction->da);
        done = true;
        for (j = 1; j <= 3 && done; ++j) {
            for (sign = -1; sign <= 1 && done; sign += 2) {
                const double by = sign * j * h;
                kf_pose *pose = kf_shown(s);
                for (k = 0; k < KF_DRIVERS; ++k) {
                    u[k] = s->u[k] + by * seed[3 * k];
                    ud[k] = s->ud[k] + by * seed[3 * k + 1];
                    efforts[k] = KF_REAL(s, KF_PART_EFFORTS)[k] + by * seed[kf_part_first[KF_PART_EFFORTS] + k];
                }
                for (k = 0; k < KF_LOADS; ++k) {
                    loads[k] = KF_REAL(s, KF_PART_LOADS)[k] + by * seed[kf_part_first[KF_PART_LOADS] + k];
                }
                if (fastest > 0.0) {
                    pose = &instance->track[0];
                    done = KF_GOOD(kf_solve(&s->solver, &s->poses[s->committed], u, pose));
                }
                done = done && kf_accelerations(&s->solver, pose, s->time + by * time_seed, ud, efforts, loads, udd);
                for (k = 0; done && k < KF_DRIVERS; ++k) {
                    direction->da[k] += sign * kf_sixth_order[j - 1] / h * udd[k];
                }
            }
        }
    }
    if (fastest > 0.0 && s->asked != s->committed) { /* the trials may have overwritten maps of the pose shown */
        s->solved = false;
        kf_ask(instance);
    }
    return done ? KF_DONE : kf_answered(instance, KF_DISCARD,
                                        "there is no directional derivative: no pose near this one can be reached");
}

/* Accelerations depend on parameters, too. */
bool kf_drive_of_trial(kf_instance *instance, kf_solver *other, kf_pose *pose, double *u, double *ud, double *udd)
{
    const kf_state *const s = &instance->now;
    int k;
    if (!KF_GOOD(kf_solve(other, &other->anchor, u, pose)) ||
        !kf_accelerations(other, pose, s->time, ud, KF_REAL(s, KF_PART_EFFORTS), KF_REAL(s, KF_PART_LOADS), udd)) {
        return false;
    }
    for (k = 0; k < KF_DRIVERS; ++k) {
        instance->trial[3 * k + 2] = udd[k];
    }
    return true;
}
