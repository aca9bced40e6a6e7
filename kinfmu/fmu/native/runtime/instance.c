/* The life of an instance: start, initialization, modes, time and events. */
#include "instance.h"

#include <float.h>
#include <math.h>
#include <string.h>

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
    s->committed_status = KF_INCONSISTENT;
    memcpy(s->committed_u, KF_POSE_U(&s->poses[0]), sizeof s->committed_u);
    for (k = 0; k < 3 * KF_DRIVERS; ++k) {
        s->committed_inputs[k] = s->real[k];
    }
    kf_find_rate_sources(s);
    kf_forget(s);
}

#define RUNNING (KF_BIT(KF_EVENTS) | KF_BIT(KF_CONTINUOUS))
#define IN_STEPS (KF_BIT(KF_STEPPING) | KF_BIT(KF_EVENTS_OF_STEPS))
#define ALIVE (KF_BIT(KF_INSTANTIATED) | KF_BIT(KF_INITIALIZATION) | IN_STEPS | RUNNING)

/* The modes in which each call is possible, a bit each, and the answer in all others. */
static const struct {
    unsigned modes;
    const char *refusal;
} calls[] = {
    [KF_SET_UP] = {KF_BIT(KF_INSTANTIATED), "the instance is initialized already; reset it first"},
    [KF_EXIT_INITIALIZATION] = {KF_BIT(KF_INITIALIZATION),
                                "exitInitializationMode: the instance is not in initialization mode"},
    [KF_SET_VARIABLES] = {ALIVE, "nothing can be set after terminate"},
    [KF_DO_STEP] = {KF_BIT(KF_STEPPING), "doStep before the end of initialization, in event mode, or after terminate"},
    [KF_ENTER_EVENTS_OF_STEPS] = {KF_BIT(KF_STEPPING), "enterEventMode: not possible now"},
    [KF_ENTER_STEPS] = {KF_BIT(KF_EVENTS_OF_STEPS), "enterStepMode: the instance is not in event mode of co-simulation"},
    [KF_ENTER_EVENTS] = {RUNNING, "enterEventMode: not possible now"},
    [KF_ENTER_CONTINUOUS] = {RUNNING, "enterContinuousTimeMode: not possible now"},
    [KF_SET_TIME] = {ALIVE, "setTime: not possible after terminate"},
    [KF_SET_STATES] = {KF_BIT(KF_CONTINUOUS), "setContinuousStates: the instance is not in continuous-time mode"},
    [KF_COMPLETE_STEP] = {RUNNING, "completedIntegratorStep: the instance is not in continuous-time mode"},
    [KF_TERMINATE] = {IN_STEPS | RUNNING, "terminate: not possible now"},
};

kf_answer kf_possible(const kf_instance *instance, kf_call call)
{
    const bool is_possible = calls[call].modes >> instance->now.mode & 1u;
    if (!kf_rounds_to_nearest() && call != KF_TERMINATE) {
        return kf_answered(instance, KF_ERROR,
                           "the host does not round to nearest; call fesetround(FE_TONEAREST) before the FMU");
    }
    return is_possible ? KF_DONE : kf_answered(instance, KF_ERROR, "%s", calls[call].refusal);
}

kf_answer kf_set_experiment(kf_instance *instance, double start_time, bool has_stop_time, double stop_time)
{
    kf_state *const s = &instance->now;
    if (kf_possible(instance, KF_SET_UP) != KF_DONE) {
        return KF_ERROR;
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
    const kf_answer answer = kf_possible(instance, KF_SET_UP);
    if (answer == KF_DONE) {
        instance->now.mode = KF_INITIALIZATION;
    }
    return answer;
}

kf_answer kf_exit_initialization(kf_instance *instance)
{
    kf_state *const s = &instance->now;
    if (kf_possible(instance, KF_EXIT_INITIALIZATION) != KF_DONE) {
        return KF_ERROR;
    }
    if (s->unbound) {
        kf_bind_parameters(instance);
    }
    if (s->unsolvable) {
        return kf_answered(instance, KF_ERROR, "initialization fails: %s", s->solver.message);
    }
    if (!KF_GOOD(kf_ask(instance))) {
        return kf_answered(instance, KF_ERROR, "initialization fails: at t = %g s: %s%s", s->time, s->message,
                           s->driven_by_time && s->time != kf_start_time ? "; laws count from t = 0 s" : "");
    }
    if (kf_begin_motion(instance) != KF_DONE) {
        return KF_ERROR;
    }
    s->mode = s->model_exchange ? KF_EVENTS : KF_STEPPING;
    return instance->has_event_mode ? kf_enter_events(instance) : KF_DONE;
}

/* Between events the discrete variables keep the values that they had at the last one. */
static void hold_discrete(kf_instance *instance)
{
    kf_state *const s = &instance->now;
    s->held_status = kf_ask(instance);
    s->held_iterations = kf_shown(s)->found.iterations;
    s->held_work = s->work;
    memcpy(s->held_message, s->message, sizeof s->held_message);
}

bool kf_holds(const kf_state *s)
{
    return s->mode == KF_CONTINUOUS;
}

kf_answer kf_enter(kf_instance *instance, kf_mode mode, kf_call call)
{
    if (kf_possible(instance, call) != KF_DONE) {
        return KF_ERROR;
    }
    if (mode == KF_CONTINUOUS) {
        hold_discrete(instance);
    }
    instance->now.mode = mode;
    return KF_DONE;
}

kf_answer kf_set_time(kf_instance *instance, double time)
{
    kf_state *const s = &instance->now;
    if (!s->model_exchange) {
        return kf_answered(instance, KF_ERROR, "setTime: this instance is for co-simulation, where doStep sets the time");
    }
    if (kf_possible(instance, KF_SET_TIME) != KF_DONE) {
        return KF_ERROR;
    }
    if (!isfinite(time)) {
        return kf_answered(instance, KF_ERROR, "setTime: %g s is not a finite number", time);
    }
    if (time != s->time) {
        s->time = time;
        kf_time_changed(s);
    }
    return KF_DONE;
}

/* wants_event: solver.status differs from that at the last event. */
kf_answer kf_complete_integrator_step(kf_instance *instance, bool *wants_event)
{
    kf_state *const s = &instance->now;
    const double last = s->samples ? s->history[s->samples - 1].t : s->time;
    kf_answer answer;
    *wants_event = false;
    if (kf_possible(instance, KF_COMPLETE_STEP) != KF_DONE) {
        return KF_ERROR;
    }
    if (!KF_GOOD(kf_ask(instance))) { /* the host has accepted the step: a smaller one is no longer possible */
        return kf_answered(instance, KF_ERROR, "at t = %g s: %s", s->time, s->message);
    }
    if (kf_is_past_stop(s, last, s->time - last)) {
        return kf_past_stop(instance, "completedIntegratorStep", last, s->time - last);
    }
    answer = kf_accept_step(instance);
    if (!s->terminated) {
        *wants_event = kf_holds(s) && s->status != s->held_status;
        kf_commit(s, s->time, 0.0);
    }
    return answer;
}
