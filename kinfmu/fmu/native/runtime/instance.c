/* The life of an instance: start, initialization, modes, time and events. */
#include "instance.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define JUST_AFTER 4e-15 /* relative to the numbers from which a jump is computed */

bool kf_token_fits(const char *token)
{
    return token != NULL && strcmp(token, KF_TOKEN) == 0;
}

void kf_start(kf_instance *instance, bool model_exchange)
{
    kf_state *const s = &instance->now;
    int k;
    memset(s, 0, sizeof *s);
    kf_solver_start(&s->solver);
    s->poses[0] = s->solver.anchor;
    s->model_exchange = model_exchange;
    memcpy(s->real, kf_real_starts, sizeof s->real);
    s->driven_by_time = kf_driven_by_time_start;
    s->rates = kf_rates_start;
    s->time = s->last_time = kf_start_time;
    s->stop_time = DBL_MAX;
    s->mode = KF_INSTANTIATED;
    memcpy(s->committed_u, KF_POSE_U(&s->poses[0]), sizeof s->committed_u);
    for (k = 0; k < 3 * KF_DRIVERS; ++k) {
        s->committed_inputs[k] = s->real[k];
    }
    kf_find_rate_sources(s);
    kf_forget(s);
}

static bool is_fresh(const kf_instance *instance)
{
    return instance->now.mode == KF_INSTANTIATED;
}

static KF_RARE kf_answer not_fresh(const kf_instance *instance)
{
    return kf_answered(instance, KF_ERROR, "the instance is initialized already; reset it first");
}

kf_answer kf_set_experiment(kf_instance *instance, double start_time, bool has_stop_time, double stop_time)
{
    kf_state *const s = &instance->now;
    if (!is_fresh(instance)) {
        return not_fresh(instance);
    }
    if (!isfinite(start_time)) {
        return kf_answered(instance, KF_ERROR, "the start time %g s is not a finite number", start_time);
    }
    if (has_stop_time && !(stop_time >= start_time)) {
        return kf_answered(instance, KF_ERROR, "the stop time %g s is not after the start time %g s", stop_time, start_time);
    }
    s->time = s->last_time = s->start_time = start_time;
    s->stop_time = has_stop_time ? fmin(stop_time, DBL_MAX) : DBL_MAX;
    kf_forget(s);
    return KF_DONE;
}

kf_answer kf_enter_initialization(kf_instance *instance)
{
    if (!is_fresh(instance)) {
        return not_fresh(instance);
    }
    instance->now.mode = KF_INITIALIZATION;
    return KF_DONE;
}

kf_answer kf_exit_initialization(kf_instance *instance)
{
    kf_state *const s = &instance->now;
    if (s->mode != KF_INITIALIZATION) {
        return kf_answered(instance, KF_ERROR, "exitInitializationMode: the instance is not in initialization mode");
    }
    if (s->unbound) {
        kf_bind_parameters(instance);
    }
    if (s->unsolvable) {
        return kf_answered(instance, KF_ERROR, "initialization fails: %s", s->solver.message);
    }
    if (!KF_GOOD(kf_ask(instance))) {
        return kf_answered(instance, KF_ERROR, "initialization fails: at t = %g s: %s", s->time, s->message);
    }
#if KF_TORQUE
    kf_find_drive(s);
    if (!isfinite(s->udd[0])) {
        const int k = kf_massless(&s->solver, kf_shown(s), s->time, s->ud, KF_REAL(s, KF_PART_LOADS));
        return kf_answered(instance, KF_ERROR, "initialization fails: driver %s: its reduced inertia is 0, so that efforts do "
                      "not determine its motion; give a body that it moves a mass or an inertia", kf_driver_names[k]);
    }
    kf_commit(s, s->time, 0.0);
#endif
    s->mode = s->model_exchange ? KF_EVENTS : KF_STEPPING;
    return KF_DONE;
}

/* Between events the discrete variables keep the values that they had at the last one. */
static void hold_discrete(kf_instance *instance)
{
    kf_state *const s = &instance->now;
    s->held_status = kf_ask(instance);
    s->held_iterations = kf_shown(s)->found.iterations;
    memcpy(s->held_message, s->message, sizeof s->held_message);
}

bool kf_holds(const kf_state *s)
{
    return s->mode == KF_CONTINUOUS;
}

kf_answer kf_enter(kf_instance *instance, kf_mode mode, const char *function)
{
    kf_state *const s = &instance->now;
    const bool running = s->mode == KF_EVENTS || s->mode == KF_CONTINUOUS;
    if (mode == KF_TERMINATED ? !(running || s->mode == KF_STEPPING) : !running) {
        return kf_answered(instance, KF_ERROR, "%s: not possible now", function);
    }
    if (mode == KF_CONTINUOUS) {
        hold_discrete(instance);
    }
    s->mode = mode;
    return KF_DONE;
}

static void move_to(kf_state *s, double time)
{
    if (time != s->time) {
        s->time = time;
        if (s->driven_by_time) {
            kf_forget(s);
        }
#if KF_TORQUE
        kf_forget_motion(s); /* loads may depend on time */
#endif
    }
}

kf_answer kf_set_time(kf_instance *instance, double time)
{
    if (!instance->now.model_exchange) {
        return kf_answered(instance, KF_ERROR, "setTime: this instance is for co-simulation, where doStep sets the time");
    }
    if (instance->now.mode == KF_TERMINATED) {
        return kf_answered(instance, KF_ERROR, "setTime: not possible after terminate");
    }
    if (!isfinite(time)) {
        return kf_answered(instance, KF_ERROR, "setTime: %g s is not a finite number", time);
    }
    move_to(&instance->now, time);
    return KF_DONE;
}

/* wants_event: solver.status differs from that at the last event. */
kf_answer kf_complete_integrator_step(kf_instance *instance, bool *wants_event)
{
    kf_state *const s = &instance->now;
    const double last = s->samples ? s->history[s->samples - 1].t : s->time;
    *wants_event = false;
    if (s->mode != KF_CONTINUOUS && s->mode != KF_EVENTS) {
        return kf_answered(instance, KF_ERROR, "completedIntegratorStep: the instance is not in continuous-time mode");
    }
    if (!KF_GOOD(kf_ask(instance))) { /* the host has accepted the step: a smaller one is no longer possible */
        return kf_answered(instance, KF_ERROR, "at t = %g s: %s", s->time, s->message);
    }
    if (kf_is_past_stop(s, last, s->time - last)) {
        return kf_past_stop(instance, "completedIntegratorStep", last, s->time - last);
    }
#if KF_TORQUE
    {
        double reached;
        s->terminated = kf_passes_limit(instance, &reached);
        if (s->terminated) {
            return kf_answered(instance, KF_WARN, "at t = %g s: %s", reached, s->message);
        }
        kf_find_drive(s);
    }
#endif
    *wants_event = kf_holds(s) && s->status != s->held_status;
    kf_commit(s, s->time, 0.0);
    return kf_warn_of_inputs(instance);
}

/* Return a time at which the law is beyond its jump in spite of rounding. */
static double just_after(double jump, double period, double times)
{
    const double at = jump + times * period;
    return at + JUST_AFTER * (fabs(jump) + fabs(at) + period);
}

/* Return the next time at which a driver's value, speed or acceleration jumps. */
bool kf_next_event(const kf_instance *instance, double *time)
{
    const kf_state *const s = &instance->now;
    double jumps[KF_ROOM(KF_JUMPS)], periods[KF_ROOM(KF_JUMPS)], next = INFINITY;
    int k;
#if !KF_TORQUE
    if (!s->driven_by_time) {
        return false;
    }
#endif
#if KF_TORQUE
    kf_jumps(&s->solver.model, KF_REAL(s, KF_PART_LOADS), jumps, periods);
#else
    kf_jumps(&s->solver.model, KF_REAL(s, KF_PART_CONSTANTS), jumps, periods);
#endif
    for (k = 0; k < KF_JUMPS; ++k) {
        const double past = periods[k] > 0.0 ? floor((s->time - jumps[k]) / periods[k]) : 0.0;
        double event = just_after(jumps[k], periods[k], past);
        if (!(event > s->time) && periods[k] > 0.0) {
            event = just_after(jumps[k], periods[k], past + 1.0);
        }
        if (event > s->time) {
            next = fmin(next, event);
        }
    }
    *time = next;
    return next < INFINITY;
}
