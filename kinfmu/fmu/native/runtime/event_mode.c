/* Events: jumps of laws over time, which are announced. With event mode in co-simulation, steps end at them: before event mode
 * all variables have their values before the jump, in it those after the jump. A step to the end of a motion ends there.
 */
#include "instance.h"

#include <math.h>

#define HALVINGS 30 /* of a step, to the end of a motion */

/* Return the first time later than `from` that is, in spite of rounding, on one side of a jump (-1: before it, 1: after it);
 * infinite if there is none. width: between both sides.
 */
static double side_of_jump(const kf_state *s, double from, double side, double *width)
{
    const double *const constants = kf_constants_of_jumps(s);
    double jumps[KF_ROOM(KF_JUMPS)], periods[KF_ROOM(KF_JUMPS)], next = INFINITY;
    int k, n;
    *width = 0.0;
    if (constants == NULL) {
        return INFINITY;
    }
    kf_jumps(&s->solver.model, constants, jumps, periods);
    for (k = 0; k < KF_JUMPS; ++k) {
        const double past = periods[k] > 0.0 ? floor((from - jumps[k]) / periods[k]) : 0.0;
        for (n = 0; n < (periods[k] > 0.0 ? 3 : 1); ++n) {
            const double at = jumps[k] + (past + n) * periods[k];
            const double shift = KF_JUST_AFTER * (fabs(jumps[k]) + fabs(at) + periods[k]);
            if (at + side * shift > from && at + side * shift < next) {
                next = at + side * shift;
                *width = 2.0 * shift;
            }
        }
    }
    return next;
}

/* Return the next time at which a driver's value, speed or acceleration jumps. */
bool kf_next_event(const kf_instance *instance, double *time)
{
    double width;
    *time = side_of_jump(&instance->now, instance->now.time, 1.0, &width);
    return *time < INFINITY;
}

/* Enter event mode; in co-simulation, from one side of a jump to the other. */
kf_answer kf_enter_events(kf_instance *instance)
{
    kf_state *const s = &instance->now;
    double after, width;
    if (!instance->has_event_mode) {
        return kf_enter(instance, KF_EVENTS, KF_ENTER_EVENTS);
    }
    if (kf_enter(instance, KF_EVENTS_OF_STEPS, KF_ENTER_EVENTS_OF_STEPS) != KF_DONE) {
        return KF_ERROR;
    }
    after = side_of_jump(s, s->time, 1.0, &width);
    if (after - 1.5 * width <= s->time) {
        s->time = after;
        kf_time_changed(s);
    }
    return KF_DONE;
}

/* Go on by smaller steps from where a whole one is impossible: to the end of the motion, if there is one. Return false if none
 * is possible; then all is as after the whole step.
 */
static bool step_by_parts(kf_instance *instance, double time, double step)
{
    kf_state *const s = &instance->now;
    const bool is_silent = instance->silent, terminated = s->terminated;
    double reached = time, part = step;
    int k;
    instance->silent = true;
    for (k = 0; k <= HALVINGS; ++k) {
        part *= k < HALVINGS ? 0.5 : 1.0;
        reached = kf_move(instance, reached, part) < KF_DISCARD ? s->time : reached;
    }
    if (reached > time) {
        s->failed = false;
        s->terminated = reached < time + step - KF_SAME_TIME * step;
        s->time = s->last_time = reached;
        kf_forget(s);
        kf_ask(instance);
    } else {
        kf_step(instance, time, step);
        s->terminated = terminated;
    }
    instance->silent = is_silent;
    return reached > time;
}

/* Step to the next event, or shortly before an event by the whole step. */
kf_answer kf_step_to_event(kf_instance *instance, double time, double step, bool *has_event, bool *is_early)
{
    kf_state *const s = &instance->now;
    const kf_status status = s->committed_status;
    const double slack = KF_SAME_TIME * step, end = time + step;
    double width;
    const double before = side_of_jump(s, fmax(time, fmin(s->time, time + slack)), -1.0, &width), after = before + width;
    const bool is_inside = after + slack < end, stops = is_inside && instance->returns_early;
    kf_answer answer;
    step = stops ? after - time : step;
    answer = kf_step(instance, time, step);
    if (answer == KF_DISCARD && instance->returns_early && (KF_STATES || s->driven_by_time) &&
        step_by_parts(instance, time, step)) {
        answer = KF_DONE;
    }
    if (answer >= KF_DISCARD) {
        return answer;
    }
    if (s->terminated) {
        *is_early = true;
        return kf_answered(instance, KF_WARN, "the step ends at t = %.12g s, before this limit", s->time);
    }
    *has_event = KF_GOOD(status) && s->committed_status != status;
    if (s->time < time + step - slack) { /* at a break of a law that is no jump over time */
        s->last_time = s->time;
        *has_event = *is_early = true;
    } else if (stops || (!is_inside && before - slack <= end)) {
        *has_event = true;
        *is_early = stops;
        s->time = before;
        kf_time_changed(s);
    }
    return answer;
}
