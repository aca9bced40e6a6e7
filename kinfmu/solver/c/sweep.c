/* Sweep: the motion at many samples.
 *
 * With several drivers, or where the model has no lanes, each sample is followed from the last good one.
 *
 * With one driver, samples in any order are predicted from segments, corrected side by side in lanes, and checked: residual,
 * determinants, corrections and watches. Samples that fail a check are left for later. Of these, samples in the window of a
 * bridge are interpolated side by side and closed; the others, near a singular point or a limit, are solved one by one.
 */
#include "sweep.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sweeping.h"
#include "internal.h"

kf_sweep *kf_sweep_new(double tolerance)
{
    kf_sweep *sweep = calloc(1, sizeof *sweep);
    if (sweep == NULL) {
        return NULL;
    }
    kf_sweep_start(sweep, tolerance);
    return sweep;
}

void kf_sweep_start(kf_sweep *sweep, double tolerance)
{
    kf_solver_start(&sweep->follower.solver);
    sweep->follower.solver.tolerance = tolerance;
}

void kf_sweep_free(kf_sweep *sweep)
{
    if (sweep != NULL) {
#if KF_HAS_LANES
        kf_segments_free(&sweep->segments);
#endif
        free(sweep->lanes);
        free(sweep->alone.samples);
        free(sweep);
    }
}

bool kf_sweep_bind(kf_sweep *sweep, const double *parameters)
{
    return kf_solver_bind(&sweep->follower.solver, parameters);
}

const char *kf_sweep_message(const kf_sweep *sweep)
{
    return sweep->follower.solver.message;
}

static void put(const kf_table *table, int64_t sample, const double *row)
{
    int k;
    if (table->start != NULL) {
        double *const place = table->start + (ptrdiff_t)sample * table->row;
        for (k = 0; k < KF_OUTPUTS; ++k) {
            place[k * table->column] = row == NULL ? NAN : row[k];
        }
    }
}

void kf_put_gap(kf_job *job, int64_t sample, kf_status status)
{
    int k;
    for (k = 0; k < 3; ++k) {
        put(&job->tables[k], sample, NULL);
    }
    ++job->gaps;
    job->outcomes[sample] = (kf_outcome){(int32_t)status, 0};
    job->residual[sample] = NAN;
    for (k = 0; k < KF_WATCHES; ++k) {
        job->watches[sample * KF_WATCHES + k] = NAN;
    }
}

/* Store why the sample that was solved last failed, if it is the first of its interval. */
static void store_failure(const kf_sweep *sweep, kf_job *job, int64_t sample)
{
    if (sample > 0 && !KF_GOOD((kf_status)job->outcomes[sample - 1].status)) {
        return;
    }
    if (job->failure_count < job->most_failures) {
        job->failures[job->failure_count] = sample;
        memcpy(job->messages + job->failure_count * KF_MESSAGE, sweep->follower.solver.message, KF_MESSAGE);
    }
    ++job->failure_count;
}

/* Return the pose moved by whole turns of the driver, after which the mechanism repeats; a pose that is not good, unchanged. */
static kf_pose *turned(kf_sweep *sweep, kf_pose *pose, const double *u, double turns)
{
    kf_pose *const there = &sweep->raised_pose;
    double z[KF_ROOM(KF_UNKNOWNS)];
    int k;
    if (turns == 0.0 || !KF_GOOD(pose->status)) {
        return pose;
    }
    kf_tangent(&sweep->follower.solver.model, pose);
    *there = *pose;
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        z[k] = kf_turned(pose->found.x[k], turns * sweep->segments.raised[k]);
    }
    kf_evaluated_as_given(&sweep->follower.solver.model, u, z, &there->found);
    there->found.iterations = pose->found.iterations;
    return there;
}

/* Solve one sample: follow the driver value `turns` before its own and move the pose; return true if it is reached. */
static bool solve_alone(kf_sweep *sweep, kf_job *job, int64_t sample, double turns)
{
    double rows[3][KF_ROOM(KF_OUTPUTS)];
    double *wanted[3];
    const double *const u = job->u + sample * KF_DRIVERS;
    const double before = turns == 0.0 ? u[0] : kf_turned(u[0], -turns);
    kf_pose *const pose = turned(sweep, kf_followed(&sweep->follower, turns == 0.0 ? u : &before), u, turns);
    int k;
    if (!KF_GOOD(pose->status)) {
        kf_put_gap(job, sample, pose->status);
        return false;
    }
    for (k = 0; k < 3; ++k) {
        wanted[k] = job->tables[k].start == NULL ? NULL : rows[k];
    }
    kf_motion(&sweep->follower.solver, pose, job->ud + sample * KF_DRIVERS, job->udd + sample * KF_DRIVERS, wanted[0], wanted[1],
              wanted[2]);
    for (k = 0; k < 3; ++k) {
        put(&job->tables[k], sample, wanted[k]);
    }
    job->outcomes[sample] = (kf_outcome){(int32_t)pose->status, pose->found.iterations};
    job->residual[sample] = pose->found.residual;
    if (KF_WATCHES > 0) {
        kf_watches(&sweep->follower.solver.model, &pose->found, job->watches + sample * KF_WATCHES);
    }
    return true;
}

#if KF_HAS_LANES

/* Return whether a job is large enough to be worth segments. */
static bool goes_side_by_side(const kf_sweep *sweep, const kf_job *job)
{
    return job->count >= 2 * KF_LANES && !sweep->follower.solver.unsolvable;
}

/* Keep a sample for later; false if memory ran out. */
bool kf_leave(kf_sweep *sweep, const kf_job *job, int64_t sample)
{
    const double u = isnan(job->u[sample]) ? INFINITY : job->u[sample]; /* NaN comes last in the order */
    kf_list *const list = &sweep->alone;
    double turns;
    if (list->count == list->capacity) {
        const int64_t capacity = 2 * list->capacity + 1024;
        kf_left *const more = realloc(list->samples, (size_t)capacity * sizeof *more);
        if (more == NULL) {
            return false;
        }
        list->samples = more;
        list->capacity = capacity;
    }
    turns = kf_turns_after(&sweep->segments, u);
    list->samples[list->count++] = (kf_left){turns == 0.0 ? u : kf_turned(u, -turns), turns, sample};
    return true;
}

static int in_order(const void *a, const void *b)
{
    const double left = ((const kf_left *)a)->u, right = ((const kf_left *)b)->u;
    return (left > right) - (left < right);
}

/* Solve the samples from..to (excluded) of those that are left, followed from the anchor. Samples beyond one that is
 * outside are outside, too.
 */
static void solve_on_one_side(kf_sweep *sweep, kf_job *job, int64_t from, int64_t to)
{
    const int64_t side = from < to ? 1 : -1;
    bool is_past = false;
    int64_t k;
    kf_restart(&sweep->follower);
    for (k = from; k != to; k += side) {
        const int64_t sample = sweep->alone.samples[k].sample;
        if (is_past) {
            kf_put_gap(job, sample, KF_OUTSIDE);
        } else if (!solve_alone(sweep, job, sample, sweep->alone.samples[k].turns)) {
            is_past = job->outcomes[sample].status == KF_OUTSIDE;
        }
    }
}

/* Sort samples by driver value; return the number of the first one that is not before the anchor. */
static int64_t put_in_order(kf_list *list)
{
    int64_t middle = 0;
    qsort(list->samples, (size_t)list->count, sizeof *list->samples, in_order);
    while (middle < list->count && list->samples[middle].u < kf_anchor_u[0]) {
        ++middle;
    }
    return middle;
}

/* Solve the samples that are left in the order of their driver values: from the anchor up, then from there down. */
static void solve_those_left(kf_sweep *sweep, kf_job *job)
{
    const int64_t middle = put_in_order(&sweep->alone);
    int64_t k;
    solve_on_one_side(sweep, job, middle, sweep->alone.count);
    solve_on_one_side(sweep, job, middle - 1, -1);
    for (k = 0; k < job->count && job->gaps > 0; ++k) { /* again, for the message */
        if (!KF_GOOD((kf_status)job->outcomes[k].status) && (k == 0 || KF_GOOD((kf_status)job->outcomes[k - 1].status))) {
            if (job->failure_count < job->most_failures && solve_alone(sweep, job, k, 0.0)) {
                continue;
            }
            store_failure(sweep, job, k);
        }
    }
}

#endif

bool kf_sweep_run(kf_sweep *sweep, kf_job *job)
{
    int64_t sample = 0;
    kf_restart(&sweep->follower);
    job->failure_count = 0;
    job->side_by_side = job->gaps = 0;
#if KF_HAS_LANES
    if (goes_side_by_side(sweep, job)) {
        if (!kf_lanes_made(sweep) || !kf_segments_lay(&sweep->segments, &sweep->follower, job->count, job->u)) {
            return false;
        }
        sweep->alone.count = 0;
        for (; sample + KF_LANES <= job->count; sample += KF_LANES) {
            if (!kf_side_by_side(sweep, job, sample)) {
                return false;
            }
        }
        if (sample < job->count && kf_takes_again(job)) { /* the last ones, together with some that are solved already */
            if (!kf_side_by_side(sweep, job, job->count - KF_LANES)) {
                return false;
            }
            sample = job->count;
        }
        for (; sample < job->count; ++sample) {
            if (!kf_leave(sweep, job, sample)) {
                return false;
            }
        }
        kf_in_windows(sweep, job);
        job->side_by_side = job->count - sweep->alone.count;
        solve_those_left(sweep, job);
        return true;
    }
#endif
    for (; sample < job->count; ++sample) {
        if (!solve_alone(sweep, job, sample, 0.0)) {
            store_failure(sweep, job, sample);
        }
    }
    return true;
}

bool kf_drive_all(int64_t count, const double *times, const double *parameters, const double *constants, double *u,
                  double *ud, double *udd)
{
    kf_model model;
    char why[KF_MESSAGE];
    int64_t k;
    if (!kf_bind(&model, parameters, why, sizeof why)) {
        return false;
    }
    for (k = 0; k < count; ++k) {
        kf_drive(&model, times[k], constants, u + k * KF_DRIVERS, ud + k * KF_DRIVERS, udd + k * KF_DRIVERS);
    }
    return true;
}

/* Compute margin and error estimates of a good sample. Followed on another path it may not be good, as can happen at a
 * limit: then its margin is 0 and its errors are infinite.
 */
static void diagnose(kf_sweep *sweep, const kf_job *job, int64_t sample, double *margin, double *errors)
{
    kf_pose *const pose = kf_followed(&sweep->follower, job->u + sample * KF_DRIVERS);
    const bool good = KF_GOOD(pose->status);
    double found[3] = {INFINITY, INFINITY, INFINITY};
    if (good) {
        kf_errors(&sweep->follower.solver, pose, job->ud + sample * KF_DRIVERS, job->udd + sample * KF_DRIVERS, found);
    }
    margin[sample] = good ? kf_margin(&sweep->follower.solver, pose) : 0.0;
    memcpy(errors + 3 * sample, found, sizeof found);
}

#if KF_HAS_LANES

/* Diagnose the good samples in the order of their driver values, from the anchor up, then down; false if memory ran out. */
static bool diagnose_in_order(kf_sweep *sweep, const kf_job *job, double *margin, double *errors)
{
    int64_t middle, k;
    for (k = 0; k < job->count; ++k) {
        if (KF_GOOD((kf_status)job->outcomes[k].status) && !kf_leave(sweep, job, k)) {
            return false;
        }
    }
    middle = put_in_order(&sweep->alone);
    for (k = middle; k < sweep->alone.count; ++k) {
        diagnose(sweep, job, sweep->alone.samples[k].sample, margin, errors);
    }
    kf_restart(&sweep->follower);
    for (k = middle - 1; k >= 0; --k) {
        diagnose(sweep, job, sweep->alone.samples[k].sample, margin, errors);
    }
    return true;
}

#endif

bool kf_sweep_diagnose(kf_sweep *sweep, const kf_job *job, double *margin, double *errors)
{
    int64_t k;
    kf_restart(&sweep->follower);
    for (k = 0; k < job->count; ++k) {
        margin[k] = errors[3 * k] = errors[3 * k + 1] = errors[3 * k + 2] = NAN;
    }
#if KF_HAS_LANES
    if (goes_side_by_side(sweep, job)) {
        return diagnose_in_order(sweep, job, margin, errors);
    }
#endif
    for (k = 0; k < job->count; ++k) {
        if (KF_GOOD((kf_status)job->outcomes[k].status)) {
            diagnose(sweep, job, k, margin, errors);
        }
    }
    return true;
}
