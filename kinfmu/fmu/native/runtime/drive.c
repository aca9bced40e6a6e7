/* What drives: the law, the inputs, or rates estimated from samples of the inputs, for hosts that wire no rates.
 *
 *     a = 2 (d2 - d1) / (t2 - t0),   v = d2 + (d2 - d1) (t2 - t1) / (t2 - t0),   d1, d2 the two slopes
 *
 * See kinfmu/fmu/estimated_rates.py and kinfmu/solver/estimate.py.
 */
#include "instance.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define UNSURE 2.0 /* what one term more says may change by this much over the step */

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
        }
    }
}

/* How far estimated rates may be off: what one sample more says otherwise, and what differences take of the digits of u.
 * Of an acceleration from three samples nothing is known, nor of anything from two: infinite.
 */
void kf_errors_of_estimated_rates(const kf_sample *samples, int count, double t, const double *u, double *of_ud,
                                  double *of_udd)
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
            of_ud[k] = fabs(leading[2]) * h2;
            if (known > 2) {
                of_ud[k] = UNSURE * fabs(leading[3]) * h2 * h1;
                of_udd[k] = 2.0 * UNSURE * fabs(leading[3]) * (h2 + h1) + 4.0 * rounding / (h2 * h1);
            }
            of_ud[k] += 2.0 * rounding / h2;
        }
    }
}

/* The time and u of what the inputs ask for. */
void kf_moment(const kf_state *s, double *t, double *u)
{
    int k;
    if (s->touched || !s->samples) {
        *t = s->time;
        for (k = 0; k < KF_DRIVERS; ++k) {
            u[k] = s->real[3 * k];
        }
    } else { /* nothing set since the commit: still the committed sample, at the time of its step */
        *t = s->history[s->samples - 1].t;
        memcpy(u, s->history[s->samples - 1].u, KF_DRIVERS * sizeof *u);
    }
}

/* ud, udd at time t: the inputs, with estimates for rates that are not wired. Model exchange does not estimate. */
static void by_inputs(const kf_state *s, const double *inputs, double t, const double *u, double *ud, double *udd)
{
    int k;
    bool all = s->model_exchange;
    for (k = 0; !all && k < KF_DRIVERS && s->wired[3 * k + 1] && s->wired[3 * k + 2]; ++k) {
        all = k == KF_DRIVERS - 1;
    }
    if (!all) {
        kf_estimated_rates(s->history, s->samples, t, u, ud, udd);
    }
    for (k = 0; k < KF_DRIVERS; ++k) {
        ud[k] = all || s->wired[3 * k + 1] ? inputs[3 * k + 1] : ud[k];
        udd[k] = all || s->wired[3 * k + 2] ? inputs[3 * k + 2] : udd[k];
    }
}

/* u, ud, udd of what is asked for. */
void kf_asked_drive(const kf_state *s, double *u, double *ud, double *udd)
{
    if (s->driven_by_time) {
        kf_drive(&s->solver.model, s->time, KF_REAL(s, KF_PART_CONSTANTS), u, ud, udd);
    } else {
        double t;
        kf_moment(s, &t, u);
        by_inputs(s, s->real, t, u, ud, udd);
    }
}

/* u, ud, udd of the last commit, where the last good values stem from; at rest before the first. */
static void committed_drive(const kf_state *s, double *u, double *ud, double *udd)
{
    const kf_sample *const last = s->samples ? &s->history[s->samples - 1] : NULL;
    if (last == NULL) {
        memcpy(u, s->committed_u, sizeof s->committed_u);
        memset(ud, 0, KF_DRIVERS * sizeof *ud);
        memset(udd, 0, KF_DRIVERS * sizeof *udd);
    } else if (s->driven_by_time) {
        kf_drive(&s->solver.model, last->t, KF_REAL(s, KF_PART_CONSTANTS), u, ud, udd);
    } else {
        memcpy(u, last->u, sizeof last->u);
        by_inputs(s, s->committed_inputs, last->t, u, ud, udd);
    }
}

/* u, ud, udd of what is shown. */
void kf_find_drive(kf_state *s)
{
    if (!s->drive_known) {
        s->drive_known = true;
        if (KF_GOOD(s->status)) {
            kf_asked_drive(s, s->u, s->ud, s->udd);
        } else {
            committed_drive(s, s->u, s->ud, s->udd);
        }
    }
}

/* The largest difference of two rows of outputs, in radians and sizes. */
static double largest_gap(const double *there, const double *here)
{
    double largest = 0.0;
    int k;
    for (k = 0; k < KF_OUTPUTS; ++k) {
        const double gap = fabs(there[k] - here[k]) / (kf_output_is_angle[k] ? 1.0 : KF_SIZE);
        if (isnan(gap)) {
            return INFINITY;
        }
        largest = fmax(largest, gap);
    }
    return largest;
}

/* Estimated errors of q, qd, qdd of what is shown, with what estimated rates are off by. */
void kf_find_errors(kf_state *s, double errors[3])
{
    kf_pose *const pose = kf_shown(s);
    double rates[2][KF_ROOM(KF_OUTPUTS)], accelerations[2][KF_ROOM(KF_OUTPUTS)];
    double of_ud[KF_DRIVERS], of_udd[KF_DRIVERS], u[KF_DRIVERS], t;
    int k;
    kf_find_drive(s);
    kf_errors(&s->solver, pose, s->ud, s->udd, errors);
    if (!KF_GOOD(s->status) || s->driven_by_time || s->model_exchange) {
        return;
    }
    kf_moment(s, &t, u);
    kf_errors_of_estimated_rates(s->history, s->samples, t, u, of_ud, of_udd);
    kf_motion(&s->solver, pose, s->ud, s->udd, NULL, rates[0], accelerations[0]);
    for (k = 0; k < KF_DRIVERS; ++k) {
        const double ud = s->ud[k], udd = s->udd[k];
        of_ud[k] = s->wired[3 * k + 1] ? 0.0 : of_ud[k];
        of_udd[k] = s->wired[3 * k + 2] ? 0.0 : of_udd[k];
        if (isinf(of_ud[k])) {
            errors[1] = errors[2] = INFINITY;
            return;
        }
        s->ud[k] = ud + of_ud[k];
        kf_motion(&s->solver, pose, s->ud, s->udd, NULL, rates[1], accelerations[1]);
        s->ud[k] = ud;
        errors[1] += largest_gap(rates[1], rates[0]);
        errors[2] += largest_gap(accelerations[1], accelerations[0]);
        if (isinf(of_udd[k])) {
            errors[2] = INFINITY;
            continue;
        }
        s->udd[k] = udd + of_udd[k];
        kf_motion(&s->solver, pose, s->ud, s->udd, NULL, NULL, accelerations[1]);
        s->udd[k] = udd;
        errors[2] += largest_gap(accelerations[1], accelerations[0]);
    }
}
