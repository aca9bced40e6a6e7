/* Driver values and rates: by the law, by inputs, or estimated from samples of the inputs if the host wires no rates.
 *
 *     a = 2 (d2 - d1) / (t2 - t0),   v = d2 + (d2 - d1) (t2 - t1) / (t2 - t0),   d1, d2 the two slopes
 *
 * See kinfmu/fmu/slave/estimated_rates.py and kinfmu/solver/python/estimate.py.
 */
#include "drive.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* A rate beyond KF_LARGEST, from samples at almost the same time, is no estimate. */
static double usable(double rate)
{
    return fabs(rate) <= KF_LARGEST ? rate : 0.0;
}

void kf_estimated_rates(const kf_sample *samples, int count, double t, const double *u, double *ud, double *udd)
{
    int k;
    while (count && samples[count - 1].t >= t) {
        --count;
    }
    for (k = 0; k < KF_DRIVERS; ++k) {
        ud[k] = udd[k] = 0.0;
        if (count) {
            const kf_sample *const last = &samples[count - 1];
            const double h2 = t - last->t, d2 = (u[k] - last->u[k]) / h2;
            ud[k] = d2;
            if (count > 1) {
                const kf_sample *const first = last - 1;
                const double bend = d2 - (last->u[k] - first->u[k]) / (last->t - first->t), share = 1.0 / (t - first->t);
                udd[k] = bend * (2.0 * share);
                ud[k] = d2 + bend * (h2 * share);
            }
            if (!(fabs(ud[k]) + fabs(udd[k]) <= KF_LARGEST)) {
                ud[k] = usable(ud[k]);
                udd[k] = usable(udd[k]);
            }
        }
    }
}

/* Error estimates of estimated rates that hold `ahead` seconds after the last sample (t, u): the term that one more sample
 * adds, and the rounding of the differences. An acceleration from three samples has no estimate, nor has any rate from two:
 * infinite.
 */
static void errors_of_estimated_rates(const kf_sample *samples, int count, double t, const double *u, double ahead,
                                      double *of_ud, double *of_udd)
{
    int k, i, order;
    while (count && samples[count - 1].t >= t) {
        --count;
    }
    for (k = 0; k < KF_DRIVERS; ++k) {
        double times[KF_SAMPLES], column[KF_SAMPLES], leading[KF_SAMPLES];
        double largest = fabs(u[k]);
        int known = count < KF_SAMPLES - 1 ? count : KF_SAMPLES - 1;
        times[0] = t;
        column[0] = leading[0] = u[k];
        for (i = 1; i <= known; ++i) {
            times[i] = samples[count - i].t;
            column[i] = samples[count - i].u[k];
            largest = fmax(largest, fabs(column[i]));
        }
        for (order = 1; order <= known; ++order) { /* divided differences */
            for (i = 0; i <= known - order; ++i) {
                column[i] = (column[i] - column[i + 1]) / (times[i] - times[i + order]);
            }
            leading[order] = column[0];
        }
        of_ud[k] = of_udd[k] = INFINITY;
        if (known > 1) {
            const double h2 = t - times[1], h1 = t - times[2], rounding = DBL_EPSILON * largest;
            const double e2 = h2 + ahead, e1 = h1 + ahead;
            of_ud[k] = fabs(leading[2]) * (e2 + ahead);
            if (known > 2) { /* derivatives of c (x - t) (x - t1) (x - t2) at x = t + ahead */
                of_ud[k] = KF_UNSURE * fabs(leading[3]) * (e2 * e1 + ahead * (e2 + e1));
                of_udd[k] = 2.0 * KF_UNSURE * fabs(leading[3]) * (e2 + e1 + ahead) + 4.0 * rounding / (h2 * h1);
            }
            of_ud[k] += 2.0 * rounding / h2 * (1.0 + 2.0 * ahead / h1);
            of_ud[k] = of_ud[k] < INFINITY ? of_ud[k] : INFINITY; /* NaN counts as unknown */
            of_udd[k] = of_udd[k] < INFINITY ? of_udd[k] : INFINITY;
        }
    }
}

/* Find the source of the speed (order 1) and the acceleration (order 2) of each driver, by the parameter `rates`. By
 * default inputs come first, then the derivatives that the host gave of inputs of lower order, then estimates. Model
 * exchange does not estimate.
 */
KF_RARE void kf_find_rate_sources(kf_state *s)
{
    const bool all = s->model_exchange || s->rates == KF_RATES_WIRED;
    int k, order, count = 0;
    memset(s->sources, all ? KF_RATE_INPUT : KF_RATE_ESTIMATED, sizeof s->sources);
    s->given = all ? KF_ALL_RATES : KF_NO_RATES;
    if (all || s->rates == KF_RATES_ESTIMATED) {
        return;
    }
    for (k = 0; k < KF_DRIVERS; ++k) {
        for (order = 1; order <= 2; ++order) {
            kf_rate_source source = s->orders[3 * k] >= order ? KF_RATE_OF_VALUE : KF_RATE_ESTIMATED;
            if (order == 2 && s->wired[3 * k + 1] && s->orders[3 * k + 1]) {
                source = KF_RATE_OF_SPEED;
            }
            source = s->wired[3 * k + order] ? KF_RATE_INPUT : source;
            s->sources[3 * k + order] = (unsigned char)source;
            count += source != KF_RATE_ESTIMATED;
        }
    }
    s->given = count == 0 ? KF_NO_RATES : count < 2 * KF_DRIVERS ? KF_SOME_RATES : KF_ALL_RATES;
}

/* The rate of place 3 k + order: an input, a derivative of one, or the estimate. */
static double chosen(const kf_state *s, const double *inputs, int place, int order, double estimate)
{
    switch (s->sources[place]) {
    case KF_RATE_INPUT:
        return inputs[place];
    case KF_RATE_OF_VALUE:
        return s->input_rates[place - order][order - 1];
    case KF_RATE_OF_SPEED:
        return s->input_rates[place - 1][0];
    default:
        return estimate;
    }
}

/* ud, udd: what is given, over the estimates in them. */
static void choose(const kf_state *s, const double *inputs, double *ud, double *udd)
{
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        ud[k] = chosen(s, inputs, 3 * k + 1, 1, ud[k]);
        udd[k] = chosen(s, inputs, 3 * k + 2, 2, udd[k]);
    }
}

/* ud, udd at time t: the inputs, with estimates for rates that are not given. */
static void by_inputs(const kf_state *s, const double *inputs, double t, const double *u, double *ud, double *udd)
{
    if (s->given != KF_ALL_RATES) {
        kf_estimated_rates(s->history, s->samples, t, u, ud, udd);
    }
    if (s->given != KF_NO_RATES) {
        choose(s, inputs, ud, udd);
    }
}

/* The end of a step that followed derivatives of inputs: they move to its end, and the rates there are found. Rates
 * that are not given follow the parabola through the last samples: the inputs at the end are extrapolated and add no
 * information.
 */
void kf_end_of_step(kf_state *s, double step)
{
    const kf_sample *const last = &s->history[s->samples - 1];
    int k;
    for (k = 0; k < 3 * KF_DRIVERS; ++k) {
        double *const rates = s->input_rates[k];
        rates[0] += step * (rates[1] + 0.5 * step * rates[2]);
        rates[1] += step * rates[2];
    }
    kf_estimated_rates(s->history, s->samples, last->t, last->u, s->ended_ud, s->ended_udd);
    for (k = 0; k < KF_DRIVERS; ++k) {
        s->ended_ud[k] = usable(s->ended_ud[k] + step * s->ended_udd[k]);
    }
    choose(s, s->real, s->ended_ud, s->ended_udd);
    s->ended = true;
    s->ended_step = step;
}

/* Derivatives of inputs hold for one step. */
KF_RARE void kf_drop_input_derivatives(kf_state *s)
{
    memset(s->orders, 0, sizeof s->orders);
    memset(s->input_rates, 0, sizeof s->input_rates);
    kf_find_rate_sources(s);
}

/* u, ud, udd at the end of a step that followed derivatives of inputs. */
static void ended_drive(const kf_state *s, double *u, double *ud, double *udd)
{
    memcpy(u, s->committed_u, sizeof s->committed_u);
    memcpy(ud, s->ended_ud, sizeof s->ended_ud);
    memcpy(udd, s->ended_udd, sizeof s->ended_udd);
}

/* u, ud, udd by the laws at time t; where rates are beyond KF_LARGEST, u is NaN, which has no pose. */
void kf_law(const kf_state *s, double t, double *u, double *ud, double *udd)
{
    int k;
    kf_drive(&s->solver.model, t, KF_REAL(s, KF_PART_CONSTANTS), u, ud, udd);
    for (k = 0; k < KF_DRIVERS; ++k) {
        if (!(fabs(ud[k]) <= KF_LARGEST && fabs(udd[k]) <= KF_LARGEST)) {
            u[k] = NAN;
        }
    }
}

/* u, ud, udd of the requested pose. */
void kf_asked_drive(kf_state *s, double *u, double *ud, double *udd)
{
    if (s->driven_by_time) {
        kf_drive(&s->solver.model, s->time, KF_REAL(s, KF_PART_CONSTANTS), u, ud, udd);
    } else if (s->ended && !s->touched) {
        ended_drive(s, u, ud, udd);
    } else {
        double t;
        kf_moment(s, &t, u);
        by_inputs(s, s->real, t, u, ud, udd);
    }
}

/* u, ud, udd of the last commit, from which the last good values come; at rest before the first. */
void kf_committed_drive(const kf_state *s, double *u, double *ud, double *udd)
{
    const kf_sample *const last = s->samples ? &s->history[s->samples - 1] : NULL;
    if (last == NULL) {
        memcpy(u, s->committed_u, sizeof s->committed_u);
        memset(ud, 0, KF_DRIVERS * sizeof *ud);
        memset(udd, 0, KF_DRIVERS * sizeof *udd);
    } else if (s->driven_by_time) {
        kf_drive(&s->solver.model, last->t, KF_REAL(s, KF_PART_CONSTANTS), u, ud, udd);
    } else if (s->ended) {
        ended_drive(s, u, ud, udd);
    } else {
        memcpy(u, last->u, sizeof last->u);
        by_inputs(s, s->committed_inputs, last->t, u, ud, udd);
    }
}

/* Add to the errors of qd and qdd those of estimated rates; infinite if unknown. */
void kf_add_rate_errors(kf_state *s, double errors[3])
{
    kf_pose *const pose = kf_shown(s);
    double rates[2][KF_ROOM(KF_OUTPUTS)], accelerations[2][KF_ROOM(KF_OUTPUTS)];
    double of_ud[KF_DRIVERS], of_udd[KF_DRIVERS], u[KF_DRIVERS], t, ahead;
    int k;
    if (!KF_GOOD(s->status) || s->driven_by_time || s->model_exchange) {
        return;
    }
    ahead = kf_moment(s, &t, u);
    errors_of_estimated_rates(s->history, s->samples, t, u, ahead, of_ud, of_udd);
    kf_motion(&s->solver, pose, s->ud, s->udd, NULL, rates[0], accelerations[0]);
    for (k = 0; k < KF_DRIVERS; ++k) {
        const double ud = s->ud[k], udd = s->udd[k];
        of_ud[k] = s->sources[3 * k + 1] ? 0.0 : of_ud[k];
        of_udd[k] = s->sources[3 * k + 2] ? 0.0 : of_udd[k];
        if (isinf(of_ud[k])) {
            errors[1] = errors[2] = INFINITY;
            return;
        }
        s->ud[k] = ud + of_ud[k];
        kf_motion(&s->solver, pose, s->ud, s->udd, NULL, rates[1], accelerations[1]);
        s->ud[k] = ud;
        errors[1] += kf_largest_gap(rates[1], rates[0]);
        errors[2] += kf_largest_gap(accelerations[1], accelerations[0]);
        if (isinf(of_udd[k])) {
            errors[2] = INFINITY;
            continue;
        }
        s->udd[k] = udd + of_udd[k];
        kf_motion(&s->solver, pose, s->ud, s->udd, NULL, NULL, accelerations[1]);
        s->udd[k] = udd;
        errors[2] += kf_largest_gap(accelerations[1], accelerations[0]);
    }
}
