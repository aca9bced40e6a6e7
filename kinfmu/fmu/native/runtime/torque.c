/* Motion of the drivers under efforts:
 *
 *     J(u) udd = T - bias(u, ud)        u: driver values, T: efforts, J: reduced inertia
 *
 * See equation_of_motion.c for the accelerations. Steps are of order 8 with error estimates of orders 5 and 3: Hairer,
 * Norsett, Wanner: Solving Ordinary Differential Equations I, section II.10.
 */
#include "torque.h"
#include "dormand_prince.h"
#include "internal.h"

#include <math.h>
#include <stdio.h>
#include <string.h>


/* Follow the last good pose to u; if it is not reached, that one stays. */
bool kf_follow(kf_course *course, const double *u)
{
    kf_pose *const found = course->spare;
    if (!KF_GOOD(kf_solve(&course->instance->now.solver, course->here, u, found))) {
        return false;
    }
    course->spare = course->here;
    course->here = found;
    return true;
}

/* Compute efforts and external loads at a time after the start of a step of the host, by their derivatives: Taylor's formula. */
void kf_move_efforts(const kf_state *s, double after, double *efforts, double *loads)
{
    const double *const given = s->real;
    int k, order;
    memcpy(efforts, given + kf_part_first[KF_PART_EFFORTS], KF_DRIVERS * sizeof *efforts);
    memcpy(loads, given + kf_part_first[KF_PART_LOADS], KF_LOADS * sizeof *loads);
    for (k = 0; s->moving && k < KF_DRIVERS + KF_LOAD_INPUTS; ++k) {
        const double *const rates = s->input_rates[k];
        double *const value = k < KF_DRIVERS ? &efforts[k] : &loads[k - KF_DRIVERS];
        double term = 1.0;
        for (order = 0; order < KF_INPUT_ORDERS; ++order) {
            term *= after / (order + 1);
            *value += rates[order] * term;
        }
    }
}

/* Compute f, the derivative of a state y at t; false if the pose is not reached. */
static bool derive(kf_course *course, double t, const double *y, double *f)
{
    const double at = fmin(fmax(t, course->low), course->high);
    if (course->instance->update) {
        course->instance->updating = true;
        course->instance->update(course->instance->host, t);
        course->instance->updating = false;
    }
    if (course->instance->now.moving || course->instance->update) {
        kf_move_efforts(&course->instance->now, t - course->start, course->efforts, course->loads);
    }
    memcpy(f, y + KF_DRIVERS, KF_DRIVERS * sizeof *f);
    return kf_follow(course, y) && kf_accelerations(&course->instance->now.solver, course->here, at, y + KF_DRIVERS,
                                                    course->efforts, course->loads, f + KF_DRIVERS);
}

static bool complete(kf_course *course, kf_end *end)
{
    if (!derive(course, end->t, end->y, end->f)) {
        return false;
    }
    end->margin = course->here->found.margin;
    end->is_bridged = course->here->status == KF_BRIDGED;
#if KF_LAWS
    kf_find_laws(course, end->laws);
#endif
    return true;
}

/* Try a step of size h to `to`, whose time is given. Return its error relative to the tolerance, infinite if a pose is not
 * reached.
 */
static double attempt(kf_course *course, const kf_end *from, double h, kf_end *to)
{
    double k[KF_STAGES][KF_NUMBERS], y[KF_NUMBERS], fifth = 0.0, third = 0.0, error;
    int stage, i, j;
    memcpy(k[0], from->f, sizeof k[0]);
    for (stage = 1; stage < KF_STAGES; ++stage) {
        for (i = 0; i < KF_NUMBERS; ++i) {
            double sum = 0.0;
            for (j = 0; j < stage; ++j) {
                sum += kf_dp_a[stage * KF_STAGES + j] * k[j][i];
            }
            y[i] = from->y[i] + h * sum;
        }
        if (!derive(course, from->t + kf_dp_c[stage] * h, y, k[stage])) {
            return INFINITY;
        }
    }
    for (i = 0; i < KF_NUMBERS; ++i) {
        const int driver = i % KF_DRIVERS;
        double sum = 0.0, of_fifth = 0.0, of_third = 0.0, scale = kf_reach[driver];
        for (j = 0; j < KF_STAGES; ++j) {
            sum += kf_dp_b[j] * k[j][i];
            of_fifth += kf_dp_e5[j] * k[j][i];
            of_third += kf_dp_e3[j] * k[j][i];
        }
        to->y[i] = from->y[i] + h * sum;
        if (i >= KF_DRIVERS) {
            scale = fmax(scale, fmax(fabs(from->y[i]), fabs(to->y[i])));
        }
        of_fifth /= scale;
        of_third /= scale;
        fifth += of_fifth * of_fifth;
        third += of_third * of_third;
    }
    error = fifth + 0.01 * third;
    error = error > 0.0 ? h * fifth / sqrt(error * KF_NUMBERS) / course->tolerance : 0.0;
    return error < 1.0 && !complete(course, to) ? INFINITY : error;
}

/* Return the size of a step in which no driver moves by more than `share` of its kf_reach, by its speed and acceleration. */
static double size_for(const kf_end *at, double share)
{
    double fastest = 0.0;
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        const double acceleration = fabs(at->f[KF_DRIVERS + k]);
        const double reach = share * kf_reach[k];
        fastest = fmax(fastest, fabs(at->y[KF_DRIVERS + k]) / reach + sqrt(acceleration / reach));
    }
    return fastest > 0.0 ? 1.0 / fastest : INFINITY;
}

static bool fail(kf_course *course, const kf_end *at)
{
    if (!kf_ends_at(course, at->t, at->y, at->y + KF_DRIVERS)) {
        course->status = KF_NOT_CONVERGED;
        course->reached = at->t;
    }
    return false;
}

/* Step to the end of a span without jumps, or past a break if steps end there; false if the motion ends before. */
static bool advance(kf_course *course, kf_end *at, double last)
{
    while (at->t < last) {
        const double least = KF_TORQUE_LEAST * fmax(fabs(at->t), fabs(last));
        const double asked = fmin(fmin(course->size, course->longest), size_for(at, KF_TORQUE_STEEP));
        double h = asked, error, grown;
        bool refused = false, is_last, is_past_break = false;
        kf_end to;
        if (++course->steps > KF_TORQUE_MOST) {
            return fail(course, at);
        }
        for (;;) {
            is_last = h >= last - at->t - least;
            h = is_last ? last - at->t : h;
            to.t = is_last ? last : at->t + h;
            error = attempt(course, at, h, &to);
            if (error < 1.0) {
                break;
            }
            refused = true;
            h *= error < INFINITY ? fmax(KF_TORQUE_SHRINKS, KF_TORQUE_SAFETY * pow(error, -1.0 / KF_TORQUE_ORDER)) : KF_TORQUE_SHRINKS;
            if (!(h > least)) {
                return fail(course, at);
            }
        }
        grown = h * (error > 0.0 ? fmin(KF_TORQUE_GROWS, KF_TORQUE_SAFETY * pow(error, -1.0 / KF_TORQUE_ORDER)) : KF_TORQUE_GROWS);
        course->size = refused ? fmin(h, grown) : is_last ? fmax(grown, course->size) : grown;
#if KF_LAWS
        switch (kf_search_break(course, at, &to, last)) {
        case KF_REPEATS:
            continue;
        case KF_HOPS:
            if (!complete(course, &to)) {
                return fail(course, at);
            }
            is_past_break = true;
            break;
        default:
            break;
        }
#endif
        switch (kf_search_limit(course, at, &to)) {
        case KF_ENDS:
            return false;
        case KF_REPEATS:
            break;
        default:
            *at = to;
            if (is_past_break && course->instance->returns_early) {
                return true;
            }
        }
    }
    return true;
}

/* Write into the state's message why a motion ended early. */
static void explain(kf_state *s, const kf_course *course)
{
    const char *const why = course->is_limit ? "the motion ends at a limit"
                            : course->steps > KF_TORQUE_MOST ? "the motion needs too many steps; take a larger integrator.tolerance"
                                                   : "the motion cannot be integrated";
    const char *const reason = course->is_limit ? s->solver.message : "the reduced inertia is singular, or a number is not finite";
    if (course->steps > KF_TORQUE_MOST) {
        snprintf(s->message, sizeof s->message, "%s", why);
    } else {
        snprintf(s->message, sizeof s->message, "%s: %.*s", why, (int)(sizeof s->message - 80), reason);
    }
}

/* Integrate the states from the present time to `end`, or past a break, if steps end there. If the motion ends before, at
 * `reached`, states and pose stay, the status is that of the poses past its end, and the message states why.
 */
bool kf_integrate(kf_instance *instance, double end, double *reached)
{
    kf_state *const s = &instance->now;
    const double start = s->time;
    double given[KF_DRIVERS + KF_LOADS]; /* efforts and loads at the start */
    kf_course course;
    kf_end at;
    int k;
    memset(&course, 0, sizeof course);
    instance->track[0] = *kf_shown(s);
    course.instance = instance;
    course.here = &instance->track[0];
    course.spare = &instance->track[1];
    course.start = start;
    kf_move_efforts(s, 0.0, course.efforts, course.loads);
    memcpy(given, course.efforts, sizeof course.efforts);
    memcpy(given + KF_DRIVERS, course.loads, KF_LOADS * sizeof *given);
    course.tolerance = KF_REAL(s, KF_PART_TOLERANCE)[1];
    course.size = s->step_size;
    at.t = start;
    for (k = 0; k < KF_DRIVERS; ++k) {
        at.y[k] = s->real[3 * k];
        at.y[KF_DRIVERS + k] = s->real[3 * k + 1];
    }
    while (at.t < end) {
        double jump, last = end, inside;
        bool done;
        s->time = at.t;
        if (kf_next_event(instance, &jump)) {
            last = fmin(last, jump);
        }
        inside = fmin(KF_TORQUE_DETERMINED * (last - at.t) + KF_TORQUE_ROUNDED * (fabs(at.t) + fabs(last)), 0.25 * (last - at.t));
        course.low = at.t + inside;
        course.high = last - inside;
        course.longest = course.span = last - at.t;
        course.refined = 0;
        done = complete(&course, &at);
        if (done) {
            course.size = course.size > 0.0 ? course.size : size_for(&at, KF_TORQUE_FIRST);
            done = advance(&course, &at, last);
        } else {
            fail(&course, &at);
        }
        if (!done) {
            *reached = course.reached;
            explain(s, &course);
            memcpy(KF_REAL(s, KF_PART_EFFORTS), given, sizeof course.efforts);
            memcpy(KF_REAL(s, KF_PART_LOADS), given + KF_DRIVERS, KF_LOADS * sizeof *given);
            s->time = start;
            kf_follow(&course, s->committed_u); /* maps of the committed pose may have been overwritten */
            s->poses[s->committed] = *course.here;
            s->asked = !s->committed;
            s->status = course.status;
            s->solved = s->ahead = true;
            kf_forget_motion(s);
            return false;
        }
        end = at.t < last ? at.t : end;
    }
    s->time = end;
    if (s->moving) { /* inputs stay at the values that they reached, and their derivatives hold for one step */
        kf_move_efforts(s, end - start, course.efforts, course.loads);
        memcpy(KF_REAL(s, KF_PART_EFFORTS), course.efforts, sizeof course.efforts);
        memcpy(KF_REAL(s, KF_PART_LOADS), course.loads, KF_LOADS * sizeof *course.loads);
        memset(s->input_rates, 0, sizeof s->input_rates);
        s->moving = false;
    }
    s->step_size = course.size < INFINITY ? course.size : 0.0;
    for (k = 0; k < KF_DRIVERS; ++k) {
        s->real[3 * k] = at.y[k];
        s->real[3 * k + 1] = at.y[KF_DRIVERS + k];
    }
    s->asked = !s->committed;
    s->poses[s->asked] = *course.here;
    s->status = course.here->status;
    s->message[0] = '\0';
    s->solved = true;
    kf_forget_motion(s);
    return true;
}

/* Return whether a host's step, from the committed states, passes a limit; then the status is that past it. In most steps no
 * speed changes its sign far from singular poses, and there is nothing to integrate.
 */
bool kf_passes_limit(kf_instance *instance, double *reached)
{
    kf_state *const s = &instance->now;
    const double now = s->time, last = s->samples ? s->history[s->samples - 1].t : now;
    double kept[3 * KF_DRIVERS];
    const double margin = fmin(s->poses[s->committed].found.margin, kf_shown(s)->found.margin);
    bool turns = false, passes;
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        turns = turns || s->committed_inputs[3 * k + 1] * s->real[3 * k + 1] < 0.0;
    }
    if (!(last < now) || !(turns || (KF_DRIVERS > 1 && margin < 0.1) || margin < 1e-3)) {
        return false;
    }
    memcpy(kept, s->real, sizeof kept);
    memcpy(s->real, s->committed_inputs, sizeof kept);
    s->asked = s->committed;
    s->time = last;
    passes = !kf_integrate(instance, now, reached);
    s->time = now;
    memcpy(s->real, kept, sizeof kept);
    if (!passes) {
        kf_forget(s);
        kf_ask(instance);
    }
    return passes;
}
