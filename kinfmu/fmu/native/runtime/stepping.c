/* Steps of co-simulation: driven by inputs, by time or by efforts. */
#include "instance.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define LATE 1e-3 /* of a step: a sum of a million steps may end this late */

/* Warn once if inputs were set although time drives. */
kf_answer kf_warn_of_inputs(kf_instance *instance)
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
bool kf_is_past_stop(const kf_state *s, double time, double step)
{
    return time + step - s->stop_time > LATE * step + 4.0 * DBL_EPSILON * fabs(s->stop_time);
}

KF_RARE kf_answer kf_past_stop(const kf_instance *instance, const char *function, double time, double step)
{
    return kf_answered(instance, KF_ERROR, "%s from t = %.12g s by %.12g s: past the stop time of the experiment, %.12g s",
                       function, time, step, instance->now.stop_time);
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
    kf_commit(s, time, step);
    if (!kf_integrate(instance, time + step, &reached)) {
        return discard(instance, time, step, reached);
    }
    kf_find_drive(s);
    kf_commit(s, s->time, step);
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
    kf_commit(s, time, step);
    s->time = time + step;
    if (!s->moving) {
        return KF_DONE;
    }
    memcpy(kept, s->real, sizeof kept);
    kf_move_inputs(s, step);
    if (!KF_GOOD(kf_ask(instance))) {
        memcpy(s->real, kept, sizeof kept);
        s->time = time;
        s->ahead = true;
        return discard(instance, time, step, time + step);
    }
    kf_commit_pose(s);
    kf_end_of_step(s, step);
    s->moving = false;
    return KF_DONE;
}

/* When time drives, the poses at both ends of a step are committed. */
static kf_answer step_by_time(kf_instance *instance, double time, double step)
{
    kf_state *const s = &instance->now;
    const double last = s->samples ? s->history[s->samples - 1].t : 0.0;
    double u[KF_DRIVERS], ud[KF_DRIVERS], udd[KF_DRIVERS];
    kf_forget(s);
    if (s->unbound) {
        kf_bind_parameters(instance);
    }
    if (!s->samples || s->touched || fabs(time - last) > KF_SAME_TIME * step) {
        s->time = time;
        if (!KF_GOOD(kf_ask(instance))) {
            return discard(instance, time, step, time);
        }
        kf_commit(s, time, step);
    }
    s->time = time + step;
    kf_law(s, s->time, u, ud, udd);
    kf_forget(s);
    kf_solve_at(s, u);
    if (!KF_GOOD(s->status)) {
        return discard(instance, time, step, s->time);
    }
    kf_commit(s, s->time, step);
    return KF_DONE;
}
#endif

/* Refuse a step and log the reason. */
static KF_RARE kf_answer refuse_step(const kf_instance *instance, double time, double step)
{
    const kf_state *const s = &instance->now;
    if (s->mode != KF_STEPPING) {
        return kf_answered(instance, KF_ERROR, "doStep before the end of initialization, or after terminate");
    }
    if (isfinite(time + step) && step >= 0.0) {
        return kf_is_past_stop(s, time, step) ? kf_past_stop(instance, "doStep", time, step)
                                           : kf_answered(instance, KF_ERROR,
                                                         "doStep from t = %.17g s: that is before the start at %.17g s", time,
                                                         s->start_time);
    }
    return kf_answered(instance, KF_ERROR, "doStep from t = %g s by %g s: they must be finite, the step at least 0", time, step);
}

/* Return whether a step is possible that is outside start and stop time by no more than rounding. */
static KF_RARE bool is_all_but_inside(const kf_state *s, double time, double step)
{
    return s->mode == KF_STEPPING && isfinite(time + step) && step >= 0.0 && time >= s->start_time - KF_SAME_TIME * step &&
           !kf_is_past_stop(s, time, step);
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
        answer = kf_warn_of_inputs(instance);
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
