/* Steps of co-simulation: which are possible, and what becomes of those that fail. motion.h takes them. */
#include "instance.h"

#include <math.h>
#include <string.h>

/* Answer a step past the stop time of the experiment by more than rounding. */
bool kf_is_past_stop(const kf_state *s, double time, double step)
{
    return time + step - s->stop_time > KF_LATE * step + 2.0 * KF_ROUNDING * fabs(s->stop_time);
}

KF_RARE kf_answer kf_past_stop(const kf_instance *instance, const char *function, double time, double step)
{
    return kf_answered(instance, KF_ERROR, "%s from t = %.12g s by %.12g s: past the stop time of the experiment, %.12g s",
                       function, time, step, instance->now.stop_time);
}

/* Answer a step that is impossible. If the host requests it again from the same point and no smaller, it is impossible
 * again, and the host is asked to stop.
 */
KF_RARE kf_answer kf_discarded(kf_instance *instance, double time, double step, double at)
{
    kf_state *const s = &instance->now;
    s->terminated = s->failed && s->failed_time == time && step >= s->failed_step;
    s->failed = true;
    s->failed_time = time;
    s->failed_step = step;
    s->last_time = time;
    return kf_answered(instance, KF_DISCARD, "at t = %g s: %s", at, s->message);
}

/* Refuse a step and log the reason. */
static KF_RARE kf_answer refuse_step(const kf_instance *instance, double time, double step)
{
    const kf_state *const s = &instance->now;
    if (kf_possible(instance, KF_DO_STEP) != KF_DONE) {
        return KF_ERROR;
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
    return s->mode == KF_STEPPING && kf_rounds_to_nearest() && isfinite(time + step) && step >= 0.0 &&
           time >= s->start_time - KF_SAME_TIME * step && !kf_is_past_stop(s, time, step);
}

kf_answer kf_step(kf_instance *instance, double time, double step)
{
    kf_state *const s = &instance->now;
    const double end = time + step;
    kf_answer answer;
    if (!(s->mode == KF_STEPPING && kf_rounds_to_nearest() && step >= 0.0 && time >= s->start_time && end <= s->stop_time) &&
        !is_all_but_inside(s, time, step)) {
        return refuse_step(instance, time, step);
    }
    answer = kf_move(instance, time, step);
    if (answer < KF_DISCARD) {
        s->failed = s->terminated = false;
        s->last_time = end;
    }
    return answer;
}
