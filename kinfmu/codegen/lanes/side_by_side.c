/* Side by side: the samples of a sweep in lanes, predicted and corrected, or read from the windows of bridges. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sweeping.h"
#include "internal.h"

#define SURE 0.05           /* determinant from which lanes may solve samples: nine digits of qdd remain */
#define MOST_MOVED 1e-3     /* largest correction for which one Newton step and the rotations suffice */
#define CLOSED 1e-30        /* squared residual of a closed pose, for angles of some radians */
#define ONE_TURN 40.0       /* [rad^2, sizes^2]; a turn, squared: beyond it CLOSED grows no further in the first pass */
#define SETTLED 1e-7        /* second correction up to which the residual is rounding of large angles */
#define BRIDGED 1e-24       /* squared residual of a closed pose in a window */
#define MOST_CACHED 4000000 /* [bytes] largest tables written through the caches */
#define FEWEST 8            /* samples in a window from which lanes are used */

#if KF_HAS_LANES

/* Allocate the lanes; false if there is no memory. */
bool kf_lanes_made(kf_sweep *sweep)
{
    kf_lanes *const lanes = sweep->lanes = sweep->lanes == NULL ? calloc(1, sizeof *lanes) : sweep->lanes;
    int k;
    for (k = 0; lanes != NULL && k < KF_COORDINATES; ++k) {
        const int angle = kf_lane_angles[k];
        lanes->sine[k] = angle < 0 ? NULL : lanes->angles[0][angle];
        lanes->cosine[k] = angle < 0 ? NULL : lanes->angles[1][angle];
    }
    return lanes != NULL;
}

/* The streamed column of an output: after outcomes and residuals. */
static kf_column *column_of(kf_sweep *sweep, int order, int output)
{
    return &sweep->columns[2 + order * KF_OUTPUTS + output];
}

/* Write numbers of eight bytes to the caller's arrays; column: NULL to write through the caches. */
static void write(kf_column *column, void *to, const void *from, int count, bool is_first)
{
    if (column != NULL) {
        kf_stream(column, to, from, count, is_first);
    } else {
        memcpy(to, from, (size_t)count * sizeof(double));
    }
}

/* True for a table of samples one after another without gaps. */
static bool is_by_samples(const kf_table *table)
{
    return table->column == 1 && table->row == KF_OUTPUTS;
}

/* Prefetch numbers that lanes will need soon. */
static void fetch(const double *from)
{
#if defined(__GNUC__)
    int i;
    for (i = 0; i < KF_LANES; i += KF_LINE) {
        __builtin_prefetch(from + i);
    }
#else
    (void)from;
#endif
}

/* The lanes of an output. */
static const double *output_lanes(const kf_lanes *lanes, int order, int output)
{
    static const int *const places[3] = {kf_outputs_places, kf_rates_places, kf_accelerations_places};
    const int place = places[order][output];
    return place < 0 ? lanes->outputs[order][output] : order == 0 ? lanes->x[place] : order == 1 ? lanes->x1[place]
                                                                                                 : lanes->x2[place];
}

/* Fill KF_LANES rows of a table, if it is wanted. */
static void fill(kf_sweep *sweep, const kf_job *job, int order, int64_t start, bool streams)
{
    const kf_table *const table = &job->tables[order];
    kf_lanes *const lanes = sweep->lanes;
    double *const rows = lanes->rows;
    double *to;
    int i, k;
    if (table->start == NULL) {
        return;
    }
    to = table->start + (ptrdiff_t)start * table->row;
    if (is_by_samples(table)) {
        for (k = 0; k < KF_OUTPUTS; ++k) {
            const double *const from = output_lanes(lanes, order, k);
            for (i = 0; i < KF_LANES; ++i) {
                rows[i * KF_OUTPUTS + k] = from[i];
            }
        }
        write(streams ? column_of(sweep, order, 0) : NULL, to, rows, KF_LANES * KF_OUTPUTS, start == 0);
        return;
    }
    for (k = 0; k < KF_OUTPUTS; ++k, to += table->column) {
        const double *const from = output_lanes(lanes, order, k);
        if (table->row == 1) {
            write(streams ? column_of(sweep, order, k) : NULL, to, from, KF_LANES, start == 0);
            continue;
        }
        for (i = 0; i < KF_LANES; ++i) {
            to[i * table->row] = from[i];
        }
    }
}

/* True if tables are larger than the caches, and aligned so that numbers may be streamed to them. */
static bool does_stream(const kf_job *job)
{
    bool is_aligned = true;
    int k;
    for (k = 0; k < 3; ++k) {
        is_aligned = is_aligned && (uintptr_t)job->tables[k].start % sizeof(double) == 0;
    }
    return is_aligned && job->count * (int64_t)sizeof(double) * (3 * KF_OUTPUTS) > MOST_CACHED;
}

/* Return whether samples may be solved twice: not if numbers are streamed, which goes in one direction. */
bool kf_takes_again(const kf_job *job)
{
    return !does_stream(job);
}

/* Complete what was streamed, up to sample `end`. */
static void finish(kf_sweep *sweep, const kf_job *job, int64_t end)
{
    int k, order;
    if (end == 0 || !does_stream(job)) {
        return;
    }
    kf_stream_rest(&sweep->columns[0], job->outcomes + end);
    kf_stream_rest(&sweep->columns[1], job->residual + end);
    for (order = 0; order < 3; ++order) {
        const kf_table *const table = &job->tables[order];
        const int columns = is_by_samples(table) ? 1 : table->row == 1 ? KF_OUTPUTS : 0;
        for (k = 0; table->start != NULL && k < columns; ++k) {
            kf_stream_rest(column_of(sweep, order, k), table->start + (ptrdiff_t)end * table->row + k * table->column);
        }
    }
    kf_stream_end();
}

static bool has_motion(const kf_job *job)
{
    return job->tables[1].start != NULL || job->tables[2].start != NULL;
}

/* The largest squared residual, for every driver value. */
static double square_of_tolerance(const kf_sweep *sweep)
{
    const double tolerance = sweep->follower.solver.tolerance;
    return tolerance * tolerance;
}

/* Correct and check the predictions at driver values u; returns the number of passes. alone[i]: for the solver. */
static int correct(kf_sweep *sweep, const double *u, int32_t *alone)
{
    const double per_square = 1.0 / (kf_reach[0] * kf_reach[0]);
    const double most = square_of_tolerance(sweep);
    const bool may_settle = !sweep->segments.repeats;
    kf_lanes *const lanes = sweep->lanes;
    int i, k, passes;
    for (passes = 1;; ++passes) {
        int open = 0;
        kf_lanes_position(&sweep->follower.solver.model, lanes, NULL);
        KF_SIDE_BY_SIDE
        for (i = 0; i < KF_LANES; ++i) {
            const double margin = lanes->margin[i], moved = lanes->moved[i];
            const bool is_trusted = (margin >= SURE) & (KF_TRUST * moved <= margin) & (moved <= MOST_MOVED);
            const double error = lanes->error[i], far = u[i] * u[i] * per_square;
            const bool has_closed = error <= CLOSED * (1.0 + (far < ONE_TURN ? far : ONE_TURN));
            const bool is_settled = may_settle & (passes == 2) & (moved <= SETTLED) & (error <= CLOSED * (1.0 + far));
            const bool has_arrived = (has_closed | is_settled) & (error <= most);
            open += is_trusted & !has_arrived & !alone[i];
            alone[i] |= !(is_trusted & (has_arrived | (passes == 1)));
        }
        if (open == 0 || passes == 2) {
            return passes;
        }
        for (k = 0; k < KF_UNKNOWNS; ++k) { /* once more for all if one has not converged */
            memcpy(lanes->z[k], lanes->x[k], sizeof lanes->x[k]);
        }
    }
}

/* Square root to seven digits, of numbers below 1e8 and not below 1e-60: enough for a residual, and much cheaper. */
static double root(double square)
{
    return (double)sqrtf((float)(square * 1267650600228229401496703205376.0)) * 8.8817841970012523e-16; /* 2^100, 2^-50 */
}

/* KF_LANES samples from `start` on; false if memory ran out. */
bool kf_side_by_side(kf_sweep *sweep, kf_job *job, int64_t start)
{
    const double tolerance = sweep->follower.solver.tolerance;
    kf_lanes *const lanes = sweep->lanes;
    const double *const u = job->u + start;
    const bool streams = does_stream(job);
    kf_outcome outcomes[KF_LANES];
    double residual[KF_LANES];
    int32_t alone[KF_LANES];
    int i, k, passes, left = 0;
    if (start + 2 * KF_LANES <= job->count) {
        fetch(u + KF_LANES);
    }
    memcpy(lanes->x[KF_COORDINATES - 1], u, sizeof lanes->x[0]);
    kf_predict(&sweep->segments, u, lanes, alone);
    passes = correct(sweep, u, alone);
    KF_SIDE_BY_SIDE
    for (i = 0; i < KF_LANES; ++i) {
        outcomes[i] = (kf_outcome){KF_OK, passes};
        residual[i] = root(lanes->error[i]);
    }
    write(streams ? &sweep->columns[0] : NULL, job->outcomes + start, outcomes, KF_LANES, start == 0);
    write(streams ? &sweep->columns[1] : NULL, job->residual + start, residual, KF_LANES, start == 0);
    for (k = 0; k < KF_WATCHES; ++k) {
        for (i = 0; i < KF_LANES; ++i) {
            const double watch = lanes->watches[k][i];
            job->watches[(start + i) * KF_WATCHES + k] = watch;
            alone[i] |= !(fabs(watch) <= tolerance);
        }
    }
    fill(sweep, job, 0, start, streams);
    if (has_motion(job)) {
        memcpy(lanes->x1[KF_COORDINATES - 1], job->ud + start, sizeof lanes->x1[0]);
        memcpy(lanes->x2[KF_COORDINATES - 1], job->udd + start, sizeof lanes->x2[0]);
        if (start + 2 * KF_LANES <= job->count) {
            fetch(job->ud + start + KF_LANES);
            fetch(job->udd + start + KF_LANES);
        }
        kf_lanes_motion(&sweep->follower.solver.model, lanes, NULL);
        fill(sweep, job, 1, start, streams);
        fill(sweep, job, 2, start, streams);
    }
    for (i = 0; i < KF_LANES; ++i) {
        left += alone[i];
    }
    for (i = 0; i < KF_LANES && left > 0; ++i) {
        if (alone[i] && !kf_leave(sweep, job, start + i)) {
            return false;
        }
    }
    return true;
}

/* Solve samples in a window, KF_LANES at most; those that do not close are left for later. */
static void solve_in_window(kf_sweep *sweep, kf_job *job, const kf_window *window, const kf_left *samples, int count)
{
    const double per_square = 1.0 / (kf_reach[0] * kf_reach[0]);
    const kf_model *const model = &sweep->follower.solver.model;
    const double tolerance = sweep->follower.solver.tolerance, most = square_of_tolerance(sweep);
    kf_lanes *const lanes = sweep->lanes;
    double u[KF_LANES], turns[KF_LANES];
    int i, j, k, order;
    for (i = 0; i < KF_LANES; ++i) {
        const kf_left *const one = &samples[i < count ? i : 0];
        u[i] = one->u;
        turns[i] = one->turns;
        lanes->x[KF_COORDINATES - 1][i] = job->u[one->sample];
        lanes->x1[KF_COORDINATES - 1][i] = job->ud[one->sample];
        lanes->x2[KF_COORDINATES - 1][i] = job->udd[one->sample];
    }
    kf_window_read(&sweep->segments, window, u, turns, lanes);
    kf_lanes_position(model, lanes, window->held);
    if (has_motion(job)) {
        kf_lanes_motion(model, lanes, window->held);
    }
    for (i = 0; i < count; ++i) {
        const int64_t sample = samples[i].sample;
        const double error = lanes->error[i], margin = lanes->margin[i], moved = lanes->moved[i];
        bool is_good = error <= BRIDGED * (1.0 + u[i] * u[i] * per_square) && error <= most && margin >= SURE
            && KF_TRUST * moved <= margin && moved <= MOST_MOVED;
        for (k = 0; k < KF_WATCHES; ++k) {
            is_good = is_good && fabs(lanes->watches[k][i]) <= tolerance;
        }
        if (!is_good) {
            sweep->alone.samples[sweep->alone.count++] = samples[i]; /* in its own place or an earlier one */
            continue;
        }
        for (order = 0; order < 3; ++order) {
            const kf_table *const table = &job->tables[order];
            for (j = 0; j < KF_OUTPUTS && table->start != NULL; ++j) {
                table->start[(ptrdiff_t)sample * table->row + j * table->column] = output_lanes(lanes, order, j)[i];
            }
        }
        job->outcomes[sample] = (kf_outcome){KF_BRIDGED, 1};
        job->residual[sample] = sqrt(error);
        for (k = 0; k < KF_WATCHES; ++k) {
            job->watches[sample * KF_WATCHES + k] = lanes->watches[k][i];
        }
    }
}

/* Solve in lanes the samples left that lie in windows of bridges. */
void kf_in_windows(kf_sweep *sweep, kf_job *job)
{
    kf_list *const alone = &sweep->alone;
    kf_left batch[KF_LANES];
    int number, count;
    finish(sweep, job, job->count / KF_LANES * KF_LANES);
    for (number = 0; number < sweep->segments.window_count; ++number) {
        const kf_window *const window = &sweep->segments.windows[number];
        const int64_t left = alone->count;
        int64_t k;
        count = 0;
        alone->count = 0;
        for (k = 0; k < left; ++k) {
            const kf_left one = alone->samples[k];
            if (window->low < one.u && one.u < window->high) {
                batch[count++] = one;
            } else {
                alone->samples[alone->count++] = one;
            }
            if (count == KF_LANES) {
                solve_in_window(sweep, job, window, batch, count);
                count = 0;
            }
        }
        for (k = 0; k < count && count < FEWEST; ++k) {
            alone->samples[alone->count++] = batch[k];
        }
        if (count >= FEWEST) {
            solve_in_window(sweep, job, window, batch, count);
        }
    }
}

#endif
