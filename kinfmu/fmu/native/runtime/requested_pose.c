/* Poses: the one that is requested, and the one that is committed, from which all others are followed. */
#include "instance.h"

#include <math.h>
#include <string.h>

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
        kf_drop_past_derivatives(s);
        kf_forget_motion(s);
    }
}

KF_RARE kf_answer kf_bind_parameters(kf_instance *instance)
{
    kf_state *const s = &instance->now;
    s->unbound = false;
    s->unsolvable = !kf_solver_bind(&s->solver, KF_REAL(s, KF_PART_PARAMETERS));
    s->committed = s->asked = 0;
    s->poses[0] = s->solver.anchor;
    s->committed_status = KF_INCONSISTENT; /* no pose of a solve: the solver has not judged its anchor yet */
    memcpy(s->committed_u, KF_POSE_U(&s->poses[0]), sizeof s->committed_u);
    s->samples = 0;
    kf_forget(s);
    return s->unsolvable ? kf_answered(instance, KF_ERROR, "%s", s->solver.message) : KF_DONE;
}

/* Solve at driver values u from the committed pose, into poses[asked]. */
inline void kf_solve_at(kf_state *s, const double *u)
{
    s->solver.tolerance = *KF_REAL(s, KF_PART_TOLERANCE);
    if (KF_GOOD(s->committed_status) && memcmp(u, s->committed_u, sizeof s->committed_u) == 0) {
        s->asked = s->committed;
        s->status = s->committed_status;
        s->work = 0;
    } else {
        s->asked = !s->committed;
        s->solver.most_work = s->most_work && s->mode > KF_INITIALIZATION ? s->most_work : KF_ANY_WORK;
        s->status = kf_solve(&s->solver, &s->poses[s->committed], u, &s->poses[s->asked]);
        s->work = s->solver.scratch.work;
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
    double u[KF_DRIVERS];
    if (s->unbound) {
        kf_bind_parameters(instance);
    }
    kf_asked_values(s, u);
    kf_solve_at(s, u);
    return s->status;
}

inline kf_pose *kf_shown(kf_state *s)
{
    return &s->poses[KF_GOOD(s->status) ? s->asked : s->committed];
}

/* Commit the requested pose: all others are followed from it. */
void kf_commit_pose(kf_state *s)
{
    memcpy(s->committed_u, KF_POSE_U(&s->poses[s->asked]), sizeof s->committed_u);
    memcpy(s->committed_inputs, s->real, sizeof s->committed_inputs);
    memcpy(s->committed_efforts, KF_REAL(s, KF_PART_LOADS), KF_LOADS * sizeof *s->committed_efforts);
    s->committed = s->asked;
    s->committed_status = s->status;
    s->touched = false;
}

/* Commit as a sample at time t; step: size of the step that begins or ends at t, 0 if there is none. */
void kf_commit(kf_state *s, double t, double step)
{
    kf_sample *sample;
    const double *const u = KF_POSE_U(&s->poses[s->asked]);
    const double same = t - KF_SAME_TIME * step - KF_ROUNDING * fabs(t);
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
    kf_commit_pose(s);
}

/* The time and u of the sample that rates are estimated at, and how many seconds later they hold: 0, but a step at the end
 * of a step that followed derivatives of inputs. Extrapolated values are not samples.
 */
double kf_moment(const kf_state *s, double *t, double *u)
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
        if (s->ended) {
            return s->ended_step;
        }
    }
    return 0.0;
}

/* u, ud, udd of the pose shown. */
void kf_find_drive(kf_state *s)
{
    if (!s->drive_known) {
        s->drive_known = true;
        if (KF_GOOD(s->status)) {
            kf_asked_drive(s, s->u, s->ud, s->udd);
        } else {
            kf_committed_drive(s, s->u, s->ud, s->udd);
        }
    }
}

/* Many hosts cannot record an infinity. */
void kf_bound_errors(double errors[3])
{
    int order;
    for (order = 0; order < 3; ++order) {
        errors[order] = errors[order] < KF_UNKNOWN_ERROR ? errors[order] : KF_UNKNOWN_ERROR;
    }
}

/* Estimated errors of q, qd, qdd of the pose shown. */
void kf_find_errors(kf_state *s, double errors[3])
{
    kf_find_drive(s);
    kf_errors(&s->solver, kf_shown(s), s->ud, s->udd, errors);
    kf_add_rate_errors(s, errors);
    kf_bound_errors(errors);
}
