/* Sweep: the motion at many samples.
 *
 * With several drivers, or where the model has no lanes, each sample is followed from the last good one. With one driver
 * samples are predicted from segments, in whatever order they come, corrected side by side in lanes, and checked: residual,
 * determinants, corrections and rows set aside. What fails a check is left for later: samples in the window of a bridge are
 * read from it side by side too, and closed; what then is left, beside a singular point or a limit, is solved as if it were
 * alone.
 */
#include "sweep.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "segments.h"
#include "stream.h"
#include "way.h"

#define SURE 0.05       /* determinant from which samples may be solved side by side: it leaves nine digits of qdd */
#define MOST_MOVED 1e-3 /* correction beyond which one does not arrive, nor rotations do */
#define CLOSED 1e-30    /* squared residual of what has arrived, for angles of some radians */
#define BRIDGED 1e-24   /* squared residual of what closes in a window */

#define MOST_CACHED 4000000 /* [bytes] of tables up to which they go through the caches */

/* A sample that is left for later: at driver value u, `turns` before where it lies. */
typedef struct {
    double u, turns;
    int64_t sample;
} kf_left;

typedef struct {
    kf_left *samples;
    int64_t count, room;
} kf_list;

struct kf_sweep {
    kf_follower follower;
    kf_pose raised_pose;
    kf_segments segments;
    kf_lanes *lanes;
    kf_list alone;
};

kf_sweep *kf_sweep_new(double tolerance)
{
    kf_sweep *sweep = calloc(1, sizeof *sweep);
    if (sweep == NULL) {
        return NULL;
    }
    kf_solver_start(&sweep->follower.solver);
    sweep->follower.solver.tolerance = tolerance;
    return sweep;
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

static void put_gap(kf_job *job, int64_t sample, kf_status status)
{
    int k;
    for (k = 0; k < 3; ++k) {
        put(&job->tables[k], sample, NULL);
    }
    job->status[sample] = status;
    job->iterations[sample] = 0;
    job->residual[sample] = NAN;
    for (k = 0; k < KF_WATCHES; ++k) {
        job->watches[sample * KF_WATCHES + k] = NAN;
    }
}

/* Why a sample failed, if it is the first of its stretch: it was the last one to be solved. */
static void tell_failure(const kf_sweep *sweep, kf_job *job, int64_t sample)
{
    if (sample > 0 && !KF_GOOD((kf_status)job->status[sample - 1])) {
        return;
    }
    if (job->failure_count < job->most_failures) {
        job->failures[job->failure_count] = sample;
        memcpy(job->messages + job->failure_count * KF_MESSAGE, sweep->follower.solver.message, KF_MESSAGE);
    }
    ++job->failure_count;
}

/* The pose whole turns of the driver on, where the mechanism repeats; a pose that is not good as it is. */
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

/* Solve a sample of its own, `turns` before where it lies: true if it can be reached. */
static bool solve_alone(kf_sweep *sweep, kf_job *job, int64_t sample, double turns)
{
    double rows[3][KF_ROOM(KF_OUTPUTS)];
    double *wanted[3];
    const double *const u = job->u + sample * KF_DRIVERS;
    const double before = turns == 0.0 ? u[0] : kf_turned(u[0], -turns);
    kf_pose *const pose = turned(sweep, kf_followed(&sweep->follower, turns == 0.0 ? u : &before), u, turns);
    int k;
    if (!KF_GOOD(pose->status)) {
        put_gap(job, sample, pose->status);
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
    job->status[sample] = pose->status;
    job->iterations[sample] = pose->found.iterations;
    job->residual[sample] = pose->found.residual;
    if (KF_WATCHES > 0) {
        kf_watches(&sweep->follower.solver.model, &pose->found, job->watches + sample * KF_WATCHES);
    }
    return true;
}

#if KF_HAS_LANES

/* Room for lanes; false if there is no memory. */
static bool make_lanes(kf_sweep *sweep)
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

/* Keep a sample for later; false if memory ran out. */
static bool leave(kf_list *list, double u, double turns, int64_t sample)
{
    if (list->count == list->room) {
        const int64_t room = 2 * list->room + 1024;
        kf_left *const more = realloc(list->samples, (size_t)room * sizeof *more);
        if (more == NULL) {
            return false;
        }
        list->samples = more;
        list->room = room;
    }
    list->samples[list->count++] = (kf_left){u, turns, sample};
    return true;
}

static bool leave_sample(kf_sweep *sweep, kf_job *job, int64_t sample)
{
    const double u = job->u[sample];
    double turns;
    if (!isfinite(u)) { /* no place in the order */
        put_gap(job, sample, KF_OUTSIDE);
        return true;
    }
    turns = kf_turns_after(&sweep->segments, u);
    return leave(&sweep->alone, turns == 0.0 ? u : kf_turned(u, -turns), turns, sample);
}

/* Numbers of eight bytes to their place in the caller's arrays. */
static void write(void *to, const void *from, int count, bool streams)
{
    if (streams) {
        kf_stream(to, from, count);
    } else {
        memcpy(to, from, (size_t)count * sizeof(double));
    }
}

/* Numbers that lanes will need soon, on their way from memory. */
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

/* Where an output of lanes stands. */
static const double *standing(const kf_lanes *lanes, int order, int output)
{
    static const int *const places[3] = {kf_outputs_places, kf_rates_places, kf_accelerations_places};
    const int place = places[order][output];
    return place < 0 ? lanes->outputs[order][output] : order == 0 ? lanes->x[place] : order == 1 ? lanes->x1[place]
                                                                                                 : lanes->x2[place];
}

/* Fill KF_LANES rows of a table, if it is wanted. */
static void fill(kf_lanes *lanes, int order, const kf_table *table, int64_t start, bool streams)
{
    double *const rows = lanes->rows;
    double *to;
    int i, k;
    if (table->start == NULL) {
        return;
    }
    to = table->start + (ptrdiff_t)start * table->row;
    if (table->column == 1 && table->row == KF_OUTPUTS) {
        for (k = 0; k < KF_OUTPUTS; ++k) {
            const double *const from = standing(lanes, order, k);
            for (i = 0; i < KF_LANES; ++i) {
                rows[i * KF_OUTPUTS + k] = from[i];
            }
        }
        write(to, rows, KF_LANES * KF_OUTPUTS, streams);
        return;
    }
    for (k = 0; k < KF_OUTPUTS; ++k, to += table->column) {
        const double *const from = standing(lanes, order, k);
        if (table->row == 1) {
            write(to, from, KF_LANES, streams);
            continue;
        }
        for (i = 0; i < KF_LANES; ++i) {
            to[i * table->row] = from[i];
        }
    }
}

static bool has_motion(const kf_job *job)
{
    return job->tables[1].start != NULL || job->tables[2].start != NULL;
}

/* Correct and check what is predicted at driver values u: how many passes it took. alone[i]: in doubt. */
static int correct(kf_sweep *sweep, const double *u, int32_t *alone)
{
    const double per_square = 1.0 / (kf_reach[0] * kf_reach[0]);
    kf_lanes *const lanes = sweep->lanes;
    int i, k, passes;
    for (passes = 1;; ++passes) {
        int open = 0;
        kf_lanes_position(&sweep->follower.solver.model, lanes, NULL);
        KF_SIDE_BY_SIDE
        for (i = 0; i < KF_LANES; ++i) {
            const double margin = lanes->margin[i], moved = lanes->moved[i];
            const bool is_trusted = (margin >= SURE) & (KF_TRUST * moved <= margin) & (moved <= MOST_MOVED);
            const bool has_arrived = lanes->error[i] <= CLOSED * (1.0 + u[i] * u[i] * per_square);
            open += is_trusted & !has_arrived & !alone[i];
            alone[i] |= !(is_trusted & (has_arrived | (passes == 1)));
        }
        if (open == 0 || passes == 2) {
            return passes;
        }
        for (k = 0; k < KF_UNKNOWNS; ++k) { /* once more for all if one of them has not arrived */
            memcpy(lanes->z[k], lanes->x[k], sizeof lanes->x[k]);
        }
    }
}

/* KF_LANES samples from `start` on; false if memory ran out. */
static bool solve_side_by_side(kf_sweep *sweep, kf_job *job, int64_t start)
{
    const double tolerance = sweep->follower.solver.tolerance;
    kf_lanes *const lanes = sweep->lanes;
    const double *const u = job->u + start;
    const bool streams = job->count * (int64_t)sizeof(double) * (3 * KF_OUTPUTS) > MOST_CACHED;
    int64_t status[KF_LANES], iterations[KF_LANES];
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
        status[i] = KF_OK;
        iterations[i] = passes;
        residual[i] = sqrt(lanes->error[i]);
    }
    write(job->status + start, status, KF_LANES, streams);
    write(job->iterations + start, iterations, KF_LANES, streams);
    write(job->residual + start, residual, KF_LANES, streams);
    for (k = 0; k < KF_WATCHES; ++k) {
        for (i = 0; i < KF_LANES; ++i) {
            const double watch = lanes->watches[k][i];
            job->watches[(start + i) * KF_WATCHES + k] = watch;
            alone[i] |= !(fabs(watch) <= tolerance);
        }
    }
    fill(lanes, 0, &job->tables[0], start, streams);
    if (has_motion(job)) {
        memcpy(lanes->x1[KF_COORDINATES - 1], job->ud + start, sizeof lanes->x1[0]);
        memcpy(lanes->x2[KF_COORDINATES - 1], job->udd + start, sizeof lanes->x2[0]);
        if (start + 2 * KF_LANES <= job->count) {
            fetch(job->ud + start + KF_LANES);
            fetch(job->udd + start + KF_LANES);
        }
        kf_lanes_motion(&sweep->follower.solver.model, lanes, NULL);
        fill(lanes, 1, &job->tables[1], start, streams);
        fill(lanes, 2, &job->tables[2], start, streams);
    }
    for (i = 0; i < KF_LANES; ++i) {
        left += alone[i];
    }
    for (i = 0; i < KF_LANES && left > 0; ++i) {
        if (alone[i] && !leave_sample(sweep, job, start + i)) {
            return false;
        }
    }
    return true;
}

/* Samples in a window, KF_LANES at most; those that do not close are kept for later. */
static void solve_in_window(kf_sweep *sweep, kf_job *job, const kf_window *window, const kf_left *samples, int count)
{
    const double per_square = 1.0 / (kf_reach[0] * kf_reach[0]);
    const kf_model *const model = &sweep->follower.solver.model;
    const double tolerance = sweep->follower.solver.tolerance;
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
        bool is_good = error <= BRIDGED * (1.0 + u[i] * u[i] * per_square) && margin >= SURE && KF_TRUST * moved <= margin
            && moved <= MOST_MOVED;
        for (k = 0; k < KF_WATCHES; ++k) {
            is_good = is_good && fabs(lanes->watches[k][i]) <= tolerance;
        }
        if (!is_good) {
            sweep->alone.samples[sweep->alone.count++] = samples[i]; /* where it or one before it stood */
            continue;
        }
        for (order = 0; order < 3; ++order) {
            const kf_table *const table = &job->tables[order];
            for (j = 0; j < KF_OUTPUTS && table->start != NULL; ++j) {
                table->start[(ptrdiff_t)sample * table->row + j * table->column] = standing(lanes, order, j)[i];
            }
        }
        job->status[sample] = KF_BRIDGED;
        job->iterations[sample] = 1;
        job->residual[sample] = sqrt(error);
        for (k = 0; k < KF_WATCHES; ++k) {
            job->watches[sample * KF_WATCHES + k] = lanes->watches[k][i];
        }
    }
}

/* Those of the samples left that lie in windows of bridges, side by side. */
static void solve_in_windows(kf_sweep *sweep, kf_job *job)
{
    static const int fewest = KF_VECTOR; /* below, they are solved alone as fast */
    kf_list *const alone = &sweep->alone;
    kf_left batch[KF_LANES];
    int number, count;
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
        for (k = 0; k < count && count < fewest; ++k) {
            alone->samples[alone->count++] = batch[k];
        }
        if (count >= fewest) {
            solve_in_window(sweep, job, window, batch, count);
        }
    }
}

static int in_order(const void *a, const void *b)
{
    const double left = ((const kf_left *)a)->u, right = ((const kf_left *)b)->u;
    return (left > right) - (left < right);
}

/* Samples from..to (excluded) of those that are left, followed from the anchor. What lies behind a sample that cannot be
 * reached cannot be reached either.
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
            put_gap(job, sample, KF_OUTSIDE);
        } else if (!solve_alone(sweep, job, sample, sweep->alone.samples[k].turns)) {
            is_past = job->status[sample] == KF_OUTSIDE;
        }
    }
}

/* Those that are left, in the order of their driver values: from the anchor up, and from there down. */
static void solve_those_left(kf_sweep *sweep, kf_job *job)
{
    int64_t middle = 0, k;
    qsort(sweep->alone.samples, (size_t)sweep->alone.count, sizeof *sweep->alone.samples, in_order);
    while (middle < sweep->alone.count && sweep->alone.samples[middle].u < kf_anchor_u[0]) {
        ++middle;
    }
    solve_on_one_side(sweep, job, middle, sweep->alone.count);
    solve_on_one_side(sweep, job, middle - 1, -1);
    for (k = 0; k < job->count; ++k) { /* again, for the message */
        if (!KF_GOOD((kf_status)job->status[k]) && (k == 0 || KF_GOOD((kf_status)job->status[k - 1]))) {
            if (job->failure_count < job->most_failures && solve_alone(sweep, job, k, 0.0)) {
                continue;
            }
            tell_failure(sweep, job, k);
        }
    }
}

#endif

bool kf_sweep_run(kf_sweep *sweep, kf_job *job)
{
    int64_t sample = 0;
    kf_restart(&sweep->follower);
    job->failure_count = 0;
    job->side_by_side = 0;
#if KF_HAS_LANES
    if (job->count >= 4 * KF_LANES && !sweep->follower.solver.stuck) {
        if (!make_lanes(sweep) || !kf_segments_lay(&sweep->segments, &sweep->follower, job->count, job->u)) {
            return false;
        }
        sweep->alone.count = 0;
        for (; sample + KF_LANES <= job->count; sample += KF_LANES) {
            if (!solve_side_by_side(sweep, job, sample)) {
                return false;
            }
        }
        for (; sample < job->count; ++sample) {
            if (!leave_sample(sweep, job, sample)) {
                return false;
            }
        }
        kf_stream_end();
        solve_in_windows(sweep, job);
        job->side_by_side = job->count - sweep->alone.count;
        solve_those_left(sweep, job);
        return true;
    }
#endif
    for (; sample < job->count; ++sample) {
        if (!solve_alone(sweep, job, sample, 0.0)) {
            tell_failure(sweep, job, sample);
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

void kf_sweep_diagnose(kf_sweep *sweep, const kf_job *job, double *margin, double *errors)
{
    int64_t sample;
    kf_restart(&sweep->follower);
    for (sample = 0; sample < job->count; ++sample) {
        kf_pose *const pose = kf_followed(&sweep->follower, job->u + sample * KF_DRIVERS);
        double found[3] = {NAN, NAN, NAN};
        const bool good = KF_GOOD(pose->status);
        if (margin != NULL) {
            margin[sample] = good ? kf_margin(&sweep->follower.solver, pose) : NAN;
        }
        if (errors != NULL) {
            if (good) {
                kf_errors(&sweep->follower.solver, pose, job->ud + sample * KF_DRIVERS, job->udd + sample * KF_DRIVERS, found);
            }
            memcpy(errors + 3 * sample, found, sizeof found);
        }
    }
}
