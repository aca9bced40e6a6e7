/* Breaks of laws over a quantity of the pose, such as a cam's dwell, within a step.
 * See kinfmu/solver/python/torque/law_breaks.py.
 *
 * A step across a break of the law, which moves by g(q), has the order of neither side. So it ends shortly before the break,
 * and a short Taylor step leads just past it:
 *
 *     u + ud h + 1/2 udd h^2,   ud + udd h        with udd before the break; |g| grows by WINDOW at most
 */
#include "torque.h"
#include "internal.h"

#include <math.h>
#include <stddef.h>

#if KF_LAWS

/* The first break in a step: where its law's numbers begin, the change of g to it, and that in the whole step. */
typedef struct {
    int place;
    double away, moved, window, past;
} crossing;

/* Numbers of the laws at the last good pose. */
void kf_find_laws(const kf_course *course, double *numbers)
{
    const kf_pose *const pose = course->here;
    kf_laws(0.0, KF_POSE_U(pose), NULL, NULL, pose->found.x, NULL, NULL, NULL, course->loads,
            course->instance->now.solver.model.parameters, numbers);
}

/* The change of a law's argument; one that jumps back after a turn changes by less than half of it. */
static double moved_by(const double *before, const double *after, int place)
{
    const double change = after[place] - before[place], turn = before[place + 1];
    return turn > 0.0 ? change - turn * floor(change / turn + 0.5) : change;
}

static bool first_crossing(const double *before, const double *after, crossing *found)
{
    double least = INFINITY;
    int law, k, place = 0;
    for (law = 0; law < KF_LAWS; ++law) {
        const double moved = moved_by(before, after, place), unit = before[place + 2], period = before[place + 3];
        for (k = 0; k < kf_law_breaks[law] && moved != 0.0; ++k) {
            double away = before[place + KF_TORQUE_HEAD + k] - before[place], share;
            if (period > 0.0) {
                away -= period * (moved > 0.0 ? floor(away / period) : ceil(away / period));
            }
            share = away / moved;
            if (share > 0.0 && share <= 1.0 && share < least) {
                least = share;
                found->place = place;
                found->away = away;
                found->moved = moved;
                found->window = KF_TORQUE_WINDOW * unit;
                found->past = KF_TORQUE_PAST * unit + KF_TORQUE_ROUNDED_G * fabs(before[place]);
            }
        }
        place += KF_TORQUE_HEAD + kf_law_breaks[law];
    }
    return least < INFINITY;
}

/* The change of g from the start of a step to driver values; false: they are not reached. */
static bool moved_to(kf_course *course, const kf_end *before, int place, const double *u, double *moved)
{
    double numbers[KF_LAW_NUMBERS];
    if (!kf_follow(course, u)) {
        return false;
    }
    kf_find_laws(course, numbers);
    *moved = moved_by(before->laws, numbers, place);
    return true;
}

/* The time within a step at which it has to end, in the window before the break; false: not found.
 *
 * The secant's end that stays is given half its weight (Illinois), so that both ends close in.
 */
static bool landing(kf_course *course, const crossing *at, const kf_end *before, const kf_end *after, double *t)
{
    const double target = at->away - (at->moved > 0.0 ? 0.5 : -0.5) * at->window;
    double low = before->t, high = after->t, of_low = -target, of_high = at->moved - target;
    double u[KF_DRIVERS], rates[KF_DRIVERS], error;
    int k, stayed = 0;
    for (k = 0; k < KF_TORQUE_TRIALS; ++k) {
        *t = high - of_high * (high - low) / (of_high - of_low);
        kf_within(before, after, *t, u, rates);
        if (!moved_to(course, before, at->place, u, &error)) {
            return false;
        }
        error -= target;
        if (fabs(error) <= 0.3 * at->window) {
            return *t > before->t && *t < after->t;
        }
        if (error * of_high > 0.0) {
            high = *t;
            of_high = error;
            of_low *= stayed < 0 ? 0.5 : 1.0;
            stayed = -1;
        } else {
            low = *t;
            of_low = error;
            of_high *= stayed > 0 ? 0.5 : 1.0;
            stayed = 1;
        }
    }
    return false;
}

/* Values and speeds of the drivers after a short step. */
static void leap(const kf_end *from, double h, double *y)
{
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        const double speed = from->y[KF_DRIVERS + k], acceleration = from->f[KF_DRIVERS + k];
        y[k] = from->y[k] + h * (speed + 0.5 * h * acceleration);
        y[KF_DRIVERS + k] = speed + h * acceleration;
    }
}

/* Find the short step that ends just past the break; false: it would be too long. */
static bool hop(kf_course *course, const crossing *at, const kf_end *from, double last, kf_end *to)
{
    const double side = at->moved > 0.0 ? 1.0 : -1.0;
    double fastest = 0.0, longest, h;
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        fastest = fmax(fastest, fabs(from->y[KF_DRIVERS + k]) / kf_unit(k));
    }
    longest = fastest > 0.0 ? fmin(KF_TORQUE_LONGEST / fastest, last - from->t) : 0.0;
    h = 0.1 * longest;
    for (k = 0; k < KF_TORQUE_TRIALS && h > 0.0 && h <= longest; ++k) {
        double y[KF_NUMBERS], moved, past;
        leap(from, h, y);
        if (!moved_to(course, from, at->place, y, &moved) || !(side * moved > 0.0)) {
            return false;
        }
        past = side * (moved - at->away);
        if (past > 0.0 && past <= 4.0 * at->past) {
            to->t = from->t + h;
            leap(from, h, to->y);
            return true;
        }
        h *= (at->away + 2.0 * side * at->past) / moved;
    }
    return false;
}

/* Search a step for a break: it is taken, or repeated up to that, or a short one past it is taken in its place. */
kf_verdict kf_search_break(kf_course *course, const kf_end *before, kf_end *after, double last)
{
    crossing at;
    double t;
    if (!first_crossing(before->laws, after->laws, &at)) {
        course->cuts = 0;
        return KF_GOES_ON;
    }
    if (fabs(at.away) <= at.window) {
        if (hop(course, &at, before, last, after)) {
            course->size = course->cuts ? course->uncut : course->size;
            course->cuts = 0;
            return KF_HOPS;
        }
    } else if (course->cuts < KF_TORQUE_CUTS && landing(course, &at, before, after, &t)) {
        course->uncut = course->cuts++ ? course->uncut : after->t - before->t;
        course->size = t - before->t;
        kf_follow(course, before->y);
        return KF_REPEATS;
    }
    kf_follow(course, after->y);
    return KF_GOES_ON;
}
#endif
