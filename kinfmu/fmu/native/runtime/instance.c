/* The life of an instance: initialization, steps, requested and committed poses. */
#include "instance.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define SAME_TIME 1e-9 /* of a step: hosts add up time with rounding errors, which move no pose */
#define JUST_AFTER 4e-15 /* relative to the numbers from which a jump is computed */
#define LATE 1e-3      /* of a step: a sum of a million steps may end this late */

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

/* Requested poses */

inline void kf_forget_motion(kf_state *s)
{
    s->known = KF_GIVEN_PARTS;
    s->drive_known = false;
}

inline void kf_forget(kf_state *s)
{
    s->solved = s->ahead = false;
    kf_forget_motion(s);
}

inline void kf_touch(kf_state *s)
{
    if (!s->touched) {
        s->touched = true;
        if (s->ended && !s->moving) {
            kf_drop_input_derivatives(s);
        }
        kf_forget_motion(s);
    }
}

static KF_RARE kf_answer bind(kf_instance *instance)
{
    kf_state *const s = &instance->now;
    s->unbound = false;
    s->unsolvable = !kf_solver_bind(&s->solver, KF_REAL(s, KF_PART_PARAMETERS));
    s->committed = s->asked = 0;
    s->poses[0] = s->solver.anchor;
    s->committed_status = KF_OK;
    memcpy(s->committed_u, KF_POSE_U(&s->poses[0]), sizeof s->committed_u);
    s->samples = 0;
    kf_forget(s);
    return s->unsolvable ? kf_answered(instance, KF_ERROR, "%s", s->solver.message) : KF_DONE;
}

/* Solve at driver values u from the committed pose, into poses[asked]. */
static void solve(kf_state *s, const double *u)
{
    s->solver.tolerance = *KF_REAL(s, KF_PART_TOLERANCE);
    if (!s->unsolvable && memcmp(u, s->committed_u, sizeof s->committed_u) == 0) {
        s->asked = s->committed;
        s->status = s->committed_status;
    } else {
        s->asked = !s->committed;
        s->status = kf_solve(&s->solver, &s->poses[s->committed], u, &s->poses[s->asked]);
    }
    if (KF_GOOD(s->status)) {
        s->message[0] = '\0';
    } else {
        memcpy(s->message, s->solver.message, sizeof s->message);
    }
    s->solved = true;
}

kf_status kf_ask_anew(kf_instance *instance)
{
    kf_state *const s = &instance->now;
    double u[KF_DRIVERS], ud[KF_DRIVERS], udd[KF_DRIVERS];
    if (s->unbound) {
        bind(instance);
    }
    if (s->driven_by_time) {
        kf_law(s, s->time, u, ud, udd);
    } else {
        int k;
        for (k = 0; k < KF_DRIVERS; ++k) {
            u[k] = s->real[3 * k];
        }
    }
    solve(s, u);
    return s->status;
}

inline kf_pose *kf_shown(kf_state *s)
{
    return &s->poses[KF_GOOD(s->status) ? s->asked : s->committed];
}

/* Committed poses */

/* Commit the requested pose: all others are followed from it. */
static void commit_pose(kf_state *s)
{
    memcpy(s->committed_u, KF_POSE_U(&s->poses[s->asked]), sizeof s->committed_u);
    memcpy(s->committed_inputs, s->real, sizeof s->committed_inputs);
#if KF_FORCES
    memcpy(s->committed_efforts, KF_REAL(s, KF_PART_LOADS), KF_LOADS * sizeof *s->committed_efforts);
#endif
    s->committed = s->asked;
    s->committed_status = s->status;
    s->touched = false;
}

/* Commit as a sample at time t; step: size of the step that begins or ends at t, 0 if there is none. */
static void commit(kf_state *s, double t, double step)
{
    kf_sample *sample;
    const double *const u = KF_POSE_U(&s->poses[s->asked]);
    const double same = t - SAME_TIME * step - 2.0 * DBL_EPSILON * fabs(t);
    while (s->samples && s->history[s->samples - 1].t >= same) { /* the host went back, or stayed */
        --s->samples;
    }
    if (s->samples == KF_SAMPLES) {
        kf_sample kept[KF_SAMPLES - 1];
        memcpy(kept, s->history + 1, sizeof kept);
        memcpy(s->history, kept, sizeof kept);
        --s->samples;
    }
    sample = &s->history[s->samples++];
    sample->t = t;
    memcpy(sample->u, u, sizeof sample->u);
    s->ended = false;
    commit_pose(s);
}

/* Answer a step that is impossible. If the host requests it again from the same point and no smaller, it is impossible
 * again, and the host is asked to stop.
 */
static KF_RARE kf_answer discard(kf_instance *instance, double time, double step, double at)
{
    kf_state *const s = &instance->now;
    s->terminated = s->failed && s->failed_time == time && step >= s->failed_step;
    s->failed = true;
    s->failed_time = time;
    s->failed_step = step;
    s->last_time = time;
    return kf_answered(instance, KF_DISCARD, "at t = %g s: %s", at, s->message);
}

#if !KF_TORQUE
/* The inputs at the end of a step that follows their derivatives: sum of d^n h^n / n!. Beyond KF_LARGEST of them
 * or their rates there is no pose.
 */
static KF_RARE void move_inputs(kf_state *s, double step)
{
    bool usable = true;
    int k, order;
    for (k = 0; k < 3 * KF_DRIVERS; ++k) {
        const double *const rates = s->input_rates[k];
        double term = 1.0;
        for (order = 0; order < KF_INPUT_ORDERS; ++order) {
            term *= step / (order + 1);
            s->real[k] += rates[order] * term;
        }
        usable = usable && fabs(s->real[k]) <= KF_LARGEST &&
                 fabs(rates[0]) + step * (fabs(rates[1]) + 0.5 * step * fabs(rates[2])) <= KF_LARGEST &&
                 fabs(rates[1]) + step * fabs(rates[2]) <= KF_LARGEST;
    }
    s->real[0] = usable ? s->real[0] : NAN;
    kf_forget(s);
}

/* When inputs drive, the pose at the communication point is committed as a sample. If the inputs move, the pose at the
 * end is committed too, but not as a sample: its inputs are extrapolated, and the host may set others there.
 */
static kf_answer step_by_inputs(kf_instance *instance, double time, double step)
{
    kf_state *const s = &instance->now;
    double kept[3 * KF_DRIVERS];
    bool is_current;
    if (s->ahead) {
        kf_forget(s);
    }
    if (s->ended && !s->moving) {
        kf_drop_input_derivatives(s);
    }
    if (!KF_GOOD(kf_ask(instance))) {
        return discard(instance, time, step, time);
    }
    is_current = s->touched & (time == s->time); /* or inputs are held, or clocks differ: estimates see another time */
    s->known &= KF_GIVEN_PARTS | (0u - (unsigned)is_current); /* no branch: clocks differ by chance, in the last digit */
    s->drive_known &= is_current;
    commit(s, time, step);
    s->time = time + step;
    if (!s->moving) {
        return KF_DONE;
    }
    memcpy(kept, s->real, sizeof kept);
    move_inputs(s, step);
    if (!KF_GOOD(kf_ask(instance))) {
        memcpy(s->real, kept, sizeof kept);
        s->time = time;
        s->ahead = true;
        return discard(instance, time, step, time + step);
    }
    commit_pose(s);
    kf_end_of_step(s, step);
    s->moving = false;
    return KF_DONE;
}
#endif

#if KF_TORQUE
/* When efforts drive, states and pose at both ends of a step are committed. */
static kf_answer step_by_efforts(kf_instance *instance, double time, double step)
{
    kf_state *const s = &instance->now;
    double reached;
    if (s->ahead) {
        kf_forget(s);
    }
    s->time = time;
    if (!KF_GOOD(kf_ask(instance))) {
        return discard(instance, time, step, time);
    }
    kf_forget_motion(s); /* loads may depend on time */
    kf_find_drive(s);
    commit(s, time, step);
    if (!kf_integrate(instance, time + step, &reached)) {
        return discard(instance, time, step, reached);
    }
    kf_find_drive(s);
    commit(s, s->time, step);
    return KF_DONE;
}

/* The host's tolerance, within the bounds of the integrator's. */
void kf_set_tolerance(kf_instance *instance, double tolerance)
{
    if (!instance->now.model_exchange && tolerance > 0.0) {
        KF_REAL(&instance->now, KF_PART_TOLERANCE)[1] = fmin(fmax(tolerance, 1e-13), 1e-4);
    }
}

#else
/* When time drives, the poses at both ends of a step are committed. */
static kf_answer step_by_time(kf_instance *instance, double time, double step)
{
    kf_state *const s = &instance->now;
    const double last = s->samples ? s->history[s->samples - 1].t : 0.0;
    double u[KF_DRIVERS], ud[KF_DRIVERS], udd[KF_DRIVERS];
    kf_forget(s);
    if (s->unbound) {
        bind(instance);
    }
    if (!s->samples || s->touched || fabs(time - last) > SAME_TIME * step) {
        s->time = time;
        if (!KF_GOOD(kf_ask(instance))) {
            return discard(instance, time, step, time);
        }
        commit(s, time, step);
    }
    s->time = time + step;
    kf_law(s, s->time, u, ud, udd);
    kf_forget(s);
    solve(s, u);
    if (!KF_GOOD(s->status)) {
        return discard(instance, time, step, s->time);
    }
    commit(s, s->time, step);
    return KF_DONE;
}
#endif

/* Warn once if inputs were set although time drives. */
static kf_answer warn_of_inputs(kf_instance *instance)
{
    kf_state *const s = &instance->now;
    if (!s->driven_by_time || !s->stray || s->stray_warned) {
        return KF_DONE;
    }
    s->stray_warned = true;
    return kf_answered(instance, KF_WARN, "%s was set, but driven_by_time is true: the law drives, inputs have no effect",
                       kf_name_of(s->stray));
}

/* Answer a step past the stop time of the experiment by more than rounding. */
static bool is_past_stop(const kf_state *s, double time, double step)
{
    return time + step - s->stop_time > LATE * step + 4.0 * DBL_EPSILON * fabs(s->stop_time);
}

static KF_RARE kf_answer past_stop(const kf_instance *instance, const char *function, double time, double step)
{
    return kf_answered(instance, KF_ERROR, "%s from t = %.12g s by %.12g s: past the stop time of the experiment, %.12g s",
                       function, time, step, instance->now.stop_time);
}

/* Refuse a step and log the reason. */
static KF_RARE kf_answer refuse_step(const kf_instance *instance, double time, double step)
{
    const kf_state *const s = &instance->now;
    if (s->mode != KF_STEPPING) {
        return kf_answered(instance, KF_ERROR, "doStep before the end of initialization, or after terminate");
    }
    if (isfinite(time + step) && step >= 0.0) {
        return is_past_stop(s, time, step) ? past_stop(instance, "doStep", time, step)
                                           : kf_answered(instance, KF_ERROR,
                                                         "doStep from t = %.17g s: that is before the start at %.17g s", time,
                                                         s->start_time);
    }
    return kf_answered(instance, KF_ERROR, "doStep from t = %g s by %g s: they must be finite, the step at least 0", time, step);
}

/* Return whether a step is possible that is outside start and stop time by no more than rounding. */
static KF_RARE bool is_all_but_inside(const kf_state *s, double time, double step)
{
    return s->mode == KF_STEPPING && isfinite(time + step) && step >= 0.0 && time >= s->start_time - SAME_TIME * step &&
           !is_past_stop(s, time, step);
}

kf_answer kf_step(kf_instance *instance, double time, double step)
{
    kf_state *const s = &instance->now;
    const double end = time + step;
    kf_answer answer = KF_DONE, done;
    if (!(s->mode == KF_STEPPING && step >= 0.0 && time >= s->start_time && end <= s->stop_time) &&
        !is_all_but_inside(s, time, step)) {
        return refuse_step(instance, time, step);
    }
#if KF_TORQUE
    done = step_by_efforts(instance, time, step);
#else
    if (s->driven_by_time) {
        answer = warn_of_inputs(instance);
        done = step_by_time(instance, time, step);
    } else {
        done = step_by_inputs(instance, time, step);
    }
#endif
    if (done == KF_DONE) {
        s->failed = s->terminated = false;
        s->last_time = end;
        return answer;
    }
    return done;
}

/* Modes */

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
        bind(instance);
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
                      "not determine its motion; give a body that it moves a mass or an inertia", kf_driver_names[k < 0 ? 0 : k]);
    }
    commit(s, s->time, 0.0);
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
    if (is_past_stop(s, last, s->time - last)) {
        return past_stop(instance, "completedIntegratorStep", last, s->time - last);
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
    commit(s, s->time, 0.0);
    return warn_of_inputs(instance);
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
