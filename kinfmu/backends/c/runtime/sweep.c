/* Sweep: the motion at many samples.
 *
 * With several drivers, or where the model has no lanes, each sample is followed from the last good one. With one driver
 * the motion is a function of the driver value, as far as the branch of the anchor reaches. So poses at equal distances,
 * the nodes, are followed from the anchor once; between two regular ones every sample is predicted by the quintic through
 * both, in whatever order samples come, corrected side by side in lanes, and checked: residual, determinants, corrections
 * and rows set aside. What fails a check, or lies beside a singular point or a limit, is solved as if it were alone.
 *
 * Where the driver is an angle, all angles stand in sines and cosines, and the mechanism is after one turn as it was but
 * for whole turns of its angles, the nodes of one turn serve all.
 */
#include "sweep.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "lanes.h"
#include "way.h"

#define NODES 32             /* in a turn */
#define TURN 6.283185307179586
#define SPACING (TURN / NODES) /* [rad, sizes]: predictions are off by 1e-8 or so */
#define SAME 1e-9            /* difference of poses that are a turn apart */
#define SURE 0.05         /* determinant from which samples may be solved side by side: it leaves nine digits of qdd */
#define MOST_MOVED 1e-3      /* correction beyond which two of them do not arrive, nor rotations do */
#define CLOSED 1e-30         /* squared residual of what has arrived, for angles of some radians */
#define FARTHEST 1e5         /* [rad, sizes]: beyond, the rounding of the angle is lost in lanes */
#define MOST_MEMORY 1e8      /* [bytes] for nodes on either side of the anchor */

/* The quintics of the unknowns between a node and the next. */
typedef struct {
    bool plain;
    double c[6][KF_ROOM(KF_UNKNOWNS)];
} kf_interval;

/* A sample that is to be solved alone: at driver value u, `turns` before where it lies. */
typedef struct {
    double u, turns;
    int64_t sample;
} kf_left;

struct kf_sweep {
    kf_solver solver;
    kf_pose poses[2]; /* the last good one, and one to be tried */
    kf_pose raised_pose;
    int here;
    bool started;
    kf_lanes *lanes;
    kf_interval *intervals; /* from `first` on, in steps of `spacing` from the anchor */
    int64_t first, intervals_count;
    double spacing;
    bool repeats; /* every turn of the driver: the intervals are those of one turn */
    double raised[KF_ROOM(KF_UNKNOWNS)]; /* by how many turns the unknowns grow in one */
    kf_left *alone;
    int64_t alone_count, alone_room;
};

kf_sweep *kf_sweep_new(double tolerance)
{
    kf_sweep *sweep = calloc(1, sizeof *sweep);
    if (sweep == NULL) {
        return NULL;
    }
    kf_solver_start(&sweep->solver);
    sweep->solver.tolerance = tolerance;
    sweep->spacing = SPACING * kf_reach[0];
    return sweep;
}

void kf_sweep_free(kf_sweep *sweep)
{
    if (sweep != NULL) {
        free(sweep->intervals);
        free(sweep->lanes);
        free(sweep->alone);
        free(sweep);
    }
}

bool kf_sweep_bind(kf_sweep *sweep, const double *parameters)
{
    return kf_solver_bind(&sweep->solver, parameters);
}

const char *kf_sweep_message(const kf_sweep *sweep)
{
    return sweep->solver.message;
}

/* The last good pose. */
static kf_pose *here(kf_sweep *sweep)
{
    return sweep->started ? &sweep->poses[sweep->here] : &sweep->solver.anchor;
}

/* Solve at driver values from the last good pose; the pose found is the last good one from now on, if it is good. */
static kf_pose *followed(kf_sweep *sweep, const double *u)
{
    const int next = sweep->started ? 1 - sweep->here : 0;
    kf_pose *pose = &sweep->poses[next];
    if (KF_GOOD(kf_solve(&sweep->solver, here(sweep), u, pose))) {
        sweep->here = next;
        sweep->started = true;
    }
    return pose;
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
        memcpy(job->messages + job->failure_count * KF_MESSAGE, sweep->solver.message, KF_MESSAGE);
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
    kf_tangent(&sweep->solver.model, pose);
    *there = *pose;
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        z[k] = kf_turned(pose->found.x[k], turns * sweep->raised[k]);
    }
    kf_evaluated_as_given(&sweep->solver.model, u, z, &there->found);
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
    kf_pose *const pose = turned(sweep, followed(sweep, turns == 0.0 ? u : &before), u, turns);
    int k;
    if (!KF_GOOD(pose->status)) {
        put_gap(job, sample, pose->status);
        return false;
    }
    for (k = 0; k < 3; ++k) {
        wanted[k] = job->tables[k].start == NULL ? NULL : rows[k];
    }
    kf_motion(&sweep->solver, pose, job->ud + sample * KF_DRIVERS, job->udd + sample * KF_DRIVERS, wanted[0], wanted[1],
              wanted[2]);
    for (k = 0; k < 3; ++k) {
        put(&job->tables[k], sample, wanted[k]);
    }
    job->status[sample] = pose->status;
    job->iterations[sample] = pose->found.iterations;
    job->residual[sample] = pose->found.residual;
    if (KF_WATCHES > 0) {
        kf_watches(&sweep->solver.model, &pose->found, job->watches + sample * KF_WATCHES);
    }
    return true;
}

#if KF_HAS_LANES

typedef struct {
    bool good;
    double margin;
    double z[KF_ROOM(KF_UNKNOWNS)], zd[KF_ROOM(KF_UNKNOWNS)], zdd[KF_ROOM(KF_UNKNOWNS)];
} kf_node;

static double node_place(const kf_sweep *sweep, int64_t number)
{
    return kf_anchor_u[0] + (double)number * sweep->spacing;
}

static bool take_node(kf_sweep *sweep, int64_t number, kf_node *node)
{
    const double u = node_place(sweep, number);
    kf_pose *const pose = followed(sweep, &u);
    if (!KF_GOOD(pose->status)) {
        node->good = false;
        return false;
    }
    node->good = pose->status == KF_OK && pose->found.margin >= SURE;
    if (node->good) {
        kf_tangent(&sweep->solver.model, pose);
        memcpy(node->z, pose->found.x, KF_UNKNOWNS * sizeof(double));
        memcpy(node->zd, pose->x1, KF_UNKNOWNS * sizeof(double));
        memcpy(node->zdd, pose->x2, KF_UNKNOWNS * sizeof(double));
    }
    return true;
}

/* The quintic through value, slope and curvature at both ends, in powers of x from 0 to 1. Past a change point the motion
 * is as smooth as elsewhere.
 */
static void join(const kf_node *a, const kf_node *b, double h, kf_interval *interval)
{
    int k;
    interval->plain = a->good && b->good;
    for (k = 0; k < KF_UNKNOWNS && interval->plain; ++k) {
        const double p = a->z[k], v = a->zd[k] * h, c = 0.5 * a->zdd[k] * h * h;
        const double rest = b->z[k] - p - v - c; /* what the cubic and higher terms are to give, and their derivatives */
        const double slope = b->zd[k] * h - v - 2.0 * c;
        const double curve = b->zdd[k] * h * h - 2.0 * c;
        interval->c[0][k] = p;
        interval->c[1][k] = v;
        interval->c[2][k] = c;
        interval->c[3][k] = 10.0 * rest - 4.0 * slope + 0.5 * curve;
        interval->c[4][k] = -15.0 * rest + 7.0 * slope - curve;
        interval->c[5][k] = 6.0 * rest - 3.0 * slope + 0.5 * curve;
    }
}

/* Follow nodes from the anchor in one direction, up to number `last` or as far as poses can be reached: true if all can.
 * nodes: the first and the last one.
 */
static bool lay(kf_sweep *sweep, int64_t last, kf_node nodes[3])
{
    const int64_t side = last >= 0 ? 1 : -1;
    int64_t number;
    sweep->started = false; /* from the anchor */
    if (!take_node(sweep, 0, &nodes[0])) {
        return false;
    }
    nodes[1] = nodes[0];
    for (number = 0; number != last; number += side) {
        kf_interval *const interval = &sweep->intervals[(side > 0 ? number : number - 1) - sweep->first];
        if (!take_node(sweep, number + side, &nodes[2])) {
            return false;
        }
        join(side > 0 ? &nodes[1] : &nodes[2], side > 0 ? &nodes[2] : &nodes[1], sweep->spacing, interval);
        nodes[1] = nodes[2];
    }
    return true;
}

static bool make_room(kf_sweep *sweep, int64_t first, int64_t last)
{
    sweep->first = first;
    sweep->intervals_count = last - first;
    free(sweep->intervals);
    sweep->intervals = calloc((size_t)sweep->intervals_count, sizeof *sweep->intervals);
    return sweep->intervals != NULL;
}

/* True if the mechanism is after a turn of the driver as it was before, but for whole turns of its angles. */
static bool is_repeated(kf_sweep *sweep, const kf_node *a, const kf_node *b)
{
    int k;
    if (!a->good || !b->good) {
        return false;
    }
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        const double turns = kf_unknown_is_angle[k] ? rint((b->z[k] - a->z[k]) / TURN) : 0.0;
        const double scale = kf_unknown_scales[k];
        sweep->raised[k] = turns;
        if (!(fabs(b->z[k] - a->z[k] - turns * TURN) <= SAME * scale)
            || !(fabs(b->zd[k] - a->zd[k]) <= 1e3 * SAME * scale)) {
            return false;
        }
    }
    return true;
}

static bool lay_nodes(kf_sweep *sweep, const kf_job *job)
{
    const double most = fmin(floor(MOST_MEMORY / sizeof *sweep->intervals), FARTHEST * kf_reach[0] / sweep->spacing);
    kf_node *nodes = malloc(3 * sizeof *nodes);
    double low = 0.0, high = 0.0;
    bool done = nodes != NULL;
    int64_t k;
    if (sweep->lanes == NULL) {
        sweep->lanes = calloc(1, sizeof *sweep->lanes);
    }
    for (k = 0; k < job->count; ++k) {
        const double place = (job->u[k] - kf_anchor_u[0]) / sweep->spacing;
        low = place < low ? place : low;
        high = place > high ? place : high;
    }
    sweep->repeats = KF_REPEATS && kf_driver_is_angle[0] && high - low > NODES && done && make_room(sweep, 0, NODES)
        && lay(sweep, NODES, nodes) && is_repeated(sweep, &nodes[0], &nodes[1]);
    if (done && !sweep->repeats) {
        low = floor(fmax(low, -most));
        high = ceil(fmin(high, most));
        done = make_room(sweep, (int64_t)low, (int64_t)(high > low ? high : low + 1.0));
        if (done) {
            lay(sweep, (int64_t)high, nodes);
            lay(sweep, (int64_t)low, nodes);
        }
    }
    sweep->started = false;
    free(nodes);
    return done && sweep->lanes != NULL;
}

/* Predictions of the samples from `start` on; alone[i]: not to be solved side by side. */
static void predict(const kf_sweep *sweep, const kf_job *job, int64_t start, int32_t *alone)
{
    kf_lanes *const lanes = sweep->lanes;
    const double per_spacing = 1.0 / sweep->spacing;
    const double begin = node_place(sweep, sweep->first);
    const double last = (double)sweep->intervals_count;
    const double per_turn = sweep->repeats ? 1.0 / NODES : 0.0;
    const double *const u = job->u + start;
    double *const own = lanes->x[KF_COORDINATES - 1];
    double x[KF_LANES], turns[KF_LANES];
    int32_t number[KF_LANES];
    int i, k, from, to;
    memcpy(own, u, KF_LANES * sizeof(double));
    memcpy(lanes->x1[KF_COORDINATES - 1], job->ud + start, KF_LANES * sizeof(double));
    memcpy(lanes->x2[KF_COORDINATES - 1], job->udd + start, KF_LANES * sizeof(double));
    KF_SIDE_BY_SIDE
    for (i = 0; i < KF_LANES; ++i) {
        double place = (own[i] - begin) * per_spacing;
        turns[i] = __builtin_floor(place * per_turn);
        place -= NODES * turns[i];
        alone[i] = !((place >= 0.0) & (place < last) & (fabs(own[i]) < FARTHEST * kf_reach[0]));
        place = alone[i] ? 0.0 : place;
        number[i] = (int32_t)place;
        x[i] = place - (double)number[i];
    }
    for (from = 0; from < KF_LANES; from = to) {
        const kf_interval *const interval = &sweep->intervals[number[from]];
        for (to = from + 1; to < KF_LANES && number[to] == number[from]; ++to) {
        }
        for (i = from; i < to && !interval->plain; ++i) {
            alone[i] = 1;
        }
        for (k = 0; k < KF_UNKNOWNS; ++k) {
            const double c0 = interval->c[0][k], c1 = interval->c[1][k], c2 = interval->c[2][k];
            const double c3 = interval->c[3][k], c4 = interval->c[4][k], c5 = interval->c[5][k];
            const double raised = sweep->repeats ? sweep->raised[k] * TURN : 0.0;
            double *const z = lanes->x[k];
            KF_SIDE_BY_SIDE
            for (i = from; i < to; ++i) {
                z[i] = turns[i] * raised + (c0 + x[i] * (c1 + x[i] * (c2 + x[i] * (c3 + x[i] * (c4 + x[i] * c5)))));
            }
        }
    }
}

/* Keep a sample for later; false if memory ran out. */
static bool leave(kf_sweep *sweep, kf_job *job, int64_t sample)
{
    const double u = job->u[sample];
    kf_left *one;
    if (!isfinite(u)) { /* no place in the order */
        put_gap(job, sample, KF_OUTSIDE);
        return true;
    }
    if (sweep->alone_count == sweep->alone_room) {
        const int64_t room = 2 * sweep->alone_room + 1024;
        kf_left *const more = realloc(sweep->alone, (size_t)room * sizeof *more);
        if (more == NULL) {
            return false;
        }
        sweep->alone = more;
        sweep->alone_room = room;
    }
    one = &sweep->alone[sweep->alone_count++];
    one->turns = sweep->repeats && fabs(u) < FARTHEST * kf_reach[0] ? floor((u - kf_anchor_u[0]) / TURN) : 0.0;
    one->u = one->turns == 0.0 ? u : kf_turned(u, -one->turns);
    one->sample = sample;
    return true;
}

/* Let the outputs of one order go where they are wanted; a table by samples is filled by `copy` afterwards. */
static void point(const kf_table *table, int64_t start, const int *places, double **list, double **formulas,
                  double (*rooms)[KF_LANES], double (*formula_rooms)[KF_LANES])
{
    int k;
    for (k = 0; k < KF_COORDINATES; ++k) {
        list[k] = rooms[k];
    }
    for (k = 0; k < KF_OUTPUTS; ++k) {
        double *const column = table->row == 1 && table->start != NULL ? table->start + start + k * table->column : NULL;
        formulas[k] = formula_rooms[k];
        if (places[k] < 0 && column != NULL) {
            formulas[k] = column;
        } else if (column != NULL && list[places[k]] == rooms[places[k]]) {
            list[places[k]] = column;
        }
    }
}

static void copy(const kf_table *table, int64_t start, const int *places, double *const *list, double *const *formulas)
{
    int i, k;
    for (k = 0; k < KF_OUTPUTS && table->start != NULL; ++k) {
        const double *const from = places[k] >= 0 ? list[places[k]] : formulas[k];
        double *const to = table->start + (ptrdiff_t)start * table->row + k * table->column;
        for (i = 0; i < KF_LANES && from != to; ++i) {
            to[i * table->row] = from[i];
        }
    }
}

/* KF_LANES samples from `start` on; false if memory ran out. */
static bool solve_side_by_side(kf_sweep *sweep, kf_job *job, int64_t start)
{
    const bool full = job->tables[1].start != NULL || job->tables[2].start != NULL;
    const double tolerance = sweep->solver.tolerance;
    kf_lanes *const lanes = sweep->lanes;
    const double *const u = job->u + start;
    const double per_square = 1.0 / (kf_reach[0] * kf_reach[0]);
    int32_t alone[KF_LANES];
    int i, k, passes, open = 0, left = 0;
    point(&job->tables[0], start, kf_outputs_places, lanes->x, lanes->outputs[0], lanes->coordinate_rooms[0],
          lanes->output_rooms[0]);
    point(&job->tables[1], start, kf_rates_places, lanes->x1, lanes->outputs[1], lanes->coordinate_rooms[1],
          lanes->output_rooms[1]);
    point(&job->tables[2], start, kf_accelerations_places, lanes->x2, lanes->outputs[2], lanes->coordinate_rooms[2],
          lanes->output_rooms[2]);
    predict(sweep, job, start, alone);
    for (passes = 1; passes <= 2; ++passes) { /* once more for all if one of them has not arrived */
        kf_lanes_solve(&sweep->solver.model, lanes, full);
        open = 0;
        KF_SIDE_BY_SIDE
        for (i = 0; i < KF_LANES; ++i) {
            const double margin = lanes->margin[i], moved = lanes->moved[i];
            alone[i] |= !((margin >= SURE) & (KF_TRUST * moved <= margin) & (moved <= MOST_MOVED));
            open += !(alone[i] | (lanes->error[i] <= CLOSED * (1.0 + u[i] * u[i] * per_square)));
        }
        if (open == 0) {
            break;
        }
    }
    KF_SIDE_BY_SIDE
    for (i = 0; i < KF_LANES; ++i) {
        alone[i] |= !(lanes->error[i] <= CLOSED * (1.0 + u[i] * u[i] * per_square));
        job->status[start + i] = KF_OK;
        job->iterations[start + i] = open == 0 ? passes : passes - 1;
        job->residual[start + i] = sqrt(lanes->error[i]);
    }
    for (k = 0; k < KF_WATCHES; ++k) {
        for (i = 0; i < KF_LANES; ++i) {
            const double watch = lanes->watches[k][i];
            job->watches[(start + i) * KF_WATCHES + k] = watch;
            alone[i] |= !(fabs(watch) <= tolerance);
        }
    }
    copy(&job->tables[0], start, kf_outputs_places, lanes->x, lanes->outputs[0]);
    copy(&job->tables[1], start, kf_rates_places, lanes->x1, lanes->outputs[1]);
    copy(&job->tables[2], start, kf_accelerations_places, lanes->x2, lanes->outputs[2]);
    for (i = 0; i < KF_LANES; ++i) {
        left += alone[i];
    }
    for (i = 0; i < KF_LANES && left > 0; ++i) {
        if (alone[i] && !leave(sweep, job, start + i)) {
            return false;
        }
    }
    return true;
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
    sweep->started = false;
    for (k = from; k != to; k += side) {
        const int64_t sample = sweep->alone[k].sample;
        if (is_past) {
            put_gap(job, sample, KF_OUTSIDE);
        } else if (!solve_alone(sweep, job, sample, sweep->alone[k].turns)) {
            is_past = job->status[sample] == KF_OUTSIDE;
        }
    }
}

/* Those that are left, in the order of their driver values: from the anchor up, and from there down. */
static void solve_those_left(kf_sweep *sweep, kf_job *job)
{
    int64_t middle = 0, k;
    qsort(sweep->alone, (size_t)sweep->alone_count, sizeof *sweep->alone, in_order);
    while (middle < sweep->alone_count && sweep->alone[middle].u < kf_anchor_u[0]) {
        ++middle;
    }
    solve_on_one_side(sweep, job, middle, sweep->alone_count);
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
    sweep->started = false;
    job->failure_count = 0;
    job->side_by_side = 0;
#if KF_HAS_LANES
    if (job->count >= 4 * KF_LANES && !sweep->solver.stuck) {
        if (!lay_nodes(sweep, job)) {
            return false;
        }
        sweep->alone_count = 0;
        for (; sample + KF_LANES <= job->count; sample += KF_LANES) {
            if (!solve_side_by_side(sweep, job, sample)) {
                return false;
            }
        }
        for (; sample < job->count; ++sample) {
            if (!leave(sweep, job, sample)) {
                return false;
            }
        }
        job->side_by_side = job->count - sweep->alone_count;
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
    sweep->started = false;
    for (sample = 0; sample < job->count; ++sample) {
        kf_pose *const pose = followed(sweep, job->u + sample * KF_DRIVERS);
        double found[3] = {NAN, NAN, NAN};
        const bool good = KF_GOOD(pose->status);
        if (margin != NULL) {
            margin[sample] = good ? kf_margin(&sweep->solver, pose) : NAN;
        }
        if (errors != NULL) {
            if (good) {
                kf_errors(&sweep->solver, pose, job->ud + sample * KF_DRIVERS, job->udd + sample * KF_DRIVERS, found);
            }
            memcpy(errors + 3 * sample, found, sizeof found);
        }
    }
}
