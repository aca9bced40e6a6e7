/* Limits of the drivers, which end a motion under efforts. See kinfmu/solver/python/torque/limits.py.
 *
 * At a limit (a dead centre of a driver) the reduced inertia grows without bound, and u(t) is a parabola that touches the
 * limit: steps could cross its top and return on the same branch, where the mechanism itself would not. So every step in which
 * a speed changes its sign, or a pose is near a singular one, is searched for a pose at a limit.
 */
#include "torque.h"
#include "internal.h"

#include <math.h>
#include <string.h>


static const double beyond[] = KF_TORQUE_BEYOND; /* [rad, sizes] past a limit, where the solver states why it is one */

/* 1 rad, or the size of the mechanism. */
double kf_unit(int driver)
{
    return kf_driver_is_angle[driver] ? 1.0 : kf_size;
}

/* Return whether a motion at u with speeds ud ends there: whether the poses past it are not reached. */
bool kf_ends_at(kf_course *course, double t, const double *u, const double *ud)
{
    double target[KF_DRIVERS], largest = 0.0;
    int k, place;
    kf_follow(course, u); /* if not: from the last good pose */
    for (k = 0; k < KF_DRIVERS; ++k) {
        largest = fmax(largest, fabs(ud[k]) / kf_unit(k));
    }
    for (place = 0; place < 4; ++place) {
        for (k = 0; k < KF_DRIVERS; ++k) {
            target[k] = KF_POSE_U(course->here)[k] + beyond[place] * ud[k] / (largest > 0.0 ? largest : 1.0);
        }
        course->status = kf_solve(&course->instance->now.solver, course->here, target, course->spare);
        if (!KF_GOOD(course->status)) {
            course->reached = t;
            course->is_limit = true;
            return true;
        }
    }
    return false;
}

/* How long the fastest driver goes on with its deceleration; 0 if it does not slow down. */
static double time_to_rest(const kf_end *end)
{
    const double *const ud = end->y + KF_DRIVERS, *const udd = end->f + KF_DRIVERS;
    int k, fastest = 0;
    for (k = 1; k < KF_DRIVERS; ++k) {
        fastest = fabs(ud[k]) > fabs(ud[fastest]) ? k : fastest;
    }
    return ud[fastest] * udd[fastest] < 0.0 ? -ud[fastest] / udd[fastest] : 0.0;
}

/* Driver values within a step, by values, speeds and accelerations at both ends; rates: speeds in their place. */
void kf_within(const kf_end *before, const kf_end *after, double t, double *u, double *rates)
{
    const kf_end *const ends[2] = {before, after};
    const double nodes[2] = {before->t, after->t};
    double samples[2][3], values[3];
    kf_hermite polynomial;
    int k, i;
    for (k = 0; k < KF_DRIVERS; ++k) {
        for (i = 0; i < 2; ++i) {
            samples[i][0] = ends[i]->y[k];
            samples[i][1] = ends[i]->y[KF_DRIVERS + k];
            samples[i][2] = ends[i]->f[KF_DRIVERS + k];
        }
        kf_hermite_through(2, nodes, (const double(*)[3])samples, &polynomial);
        kf_hermite_at(&polynomial, t, values);
        u[k] = values[0];
        rates[k] = values[1];
    }
}

#if KF_DRIVERS == 1
/* When the speed of the only driver changes its sign within a step. */
static double critical_time(kf_course *course, const kf_end *before, const kf_end *after, double low_enough)
{
    double low = before->t, high = after->t, u, rate;
    int k;
    (void)course, (void)low_enough;
    for (k = 0; k < KF_TORQUE_HALVINGS; ++k) {
        const double middle = 0.5 * (low + high);
        kf_within(before, after, middle, &u, &rate);
        if (rate * before->y[1] > 0.0) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return 0.5 * (low + high);
}
#else
/* The determinant at a time within a step; 0 where the pose is not reached. */
static double margin_within(kf_course *course, const kf_end *before, const kf_end *after, double t)
{
    double u[KF_DRIVERS], rates[KF_DRIVERS];
    kf_within(before, after, t, u, rates);
    return kf_follow(course, u) ? course->here->found.margin : 0.0;
}

/* The time of the smallest determinant within a step; NAN if it cannot be as low as `low_enough`, since it is convex. */
static double critical_time(kf_course *course, const kf_end *before, const kf_end *after, double low_enough)
{
    const double length = after->t - before->t;
    double margins[KF_TORQUE_PLACES + 1], low, high, near, far, of_near, of_far;
    int k, place = 0, inner;
    for (k = 0; k <= KF_TORQUE_PLACES; ++k) {
        margins[k] = margin_within(course, before, after, before->t + length * k / KF_TORQUE_PLACES);
        place = margins[k] < margins[place] ? k : place;
    }
    inner = place < 1 ? 1 : place < KF_TORQUE_PLACES ? place : KF_TORQUE_PLACES - 1;
    if (2.0 * margins[inner] - fmax(margins[inner - 1], margins[inner + 1]) > low_enough) {
        return NAN;
    }
    low = before->t + length * (place > 0 ? place - 1 : 0) / KF_TORQUE_PLACES;
    high = before->t + length * (place < KF_TORQUE_PLACES ? place + 1 : KF_TORQUE_PLACES) / KF_TORQUE_PLACES;
    near = high - KF_TORQUE_GOLDEN * (high - low);
    far = low + KF_TORQUE_GOLDEN * (high - low);
    of_near = margin_within(course, before, after, near);
    of_far = margin_within(course, before, after, far);
    for (k = 0; k < KF_TORQUE_SECTIONS; ++k) {
        if (of_near < of_far) {
            high = far;
            far = near;
            of_far = of_near;
            near = high - KF_TORQUE_GOLDEN * (high - low);
            of_near = margin_within(course, before, after, near);
        } else {
            low = near;
            near = far;
            of_near = of_far;
            far = low + KF_TORQUE_GOLDEN * (high - low);
            of_far = margin_within(course, before, after, far);
        }
    }
    return 0.5 * (low + high);
}
#endif

static void take_long_steps(kf_course *course)
{
    course->refined = 0;
    course->longest = course->span;
}

/* Search a step for a limit. A step that may have one is repeated in smaller steps first. */
kf_verdict kf_search_limit(kf_course *course, const kf_end *before, const kf_end *after)
{
    const double *const ud = before->y + KF_DRIVERS;
    const double least = fmin(before->margin, after->margin);
    double u[KF_DRIVERS], rates[KF_DRIVERS], t, margin;
    bool turns = false, is_reached, is_suspect;
    int k;
    if (course->refined && before->t >= course->suspect_until) { /* it had none */
        take_long_steps(course);
    }
    if (after->margin < KF_TORQUE_ARRIVED && !after->is_bridged) {
        return kf_ends_at(course, after->t + time_to_rest(after), after->y, ud) ? KF_ENDS : KF_GOES_ON;
    }
    for (k = 0; k < KF_DRIVERS; ++k) {
        turns = turns || (ud[k] != 0.0 && ud[k] * after->y[KF_DRIVERS + k] <= 0.0);
    }
    if (!turns && (KF_DRIVERS == 1 || least >= KF_TORQUE_NEAR)) {
        return KF_GOES_ON;
    }
    t = critical_time(course, before, after, KF_TORQUE_DIPS * least);
    if (isnan(t)) {
        kf_follow(course, after->y);
        return KF_GOES_ON;
    }
    kf_within(before, after, t, u, rates);
    is_reached = kf_follow(course, u);
    margin = is_reached ? course->here->found.margin : 0.0;
    is_suspect = !is_reached || !(course->here->status == KF_BRIDGED ||
                                  margin > (KF_DRIVERS == 1 ? KF_TORQUE_SUSPECT : KF_TORQUE_DIPS * least));
    if (is_suspect && course->refined < KF_TORQUE_REFINED) {
        ++course->refined;
        course->suspect_until = after->t;
        course->longest = course->size = (after->t - before->t) / KF_TORQUE_SHARE;
        kf_follow(course, before->y);
        return KF_REPEATS;
    }
    if (is_suspect && margin <= sqrt(fmax(KF_TORQUE_TOUCHING * KF_TORQUE_TOUCHING, KF_TORQUE_ERRORS * course->tolerance))) {
        return kf_ends_at(course, t, is_reached ? u : before->y, ud) ? KF_ENDS : KF_GOES_ON;
    }
    if (is_suspect) {
        take_long_steps(course);
    }
    kf_follow(course, after->y);
    return KF_GOES_ON;
}
