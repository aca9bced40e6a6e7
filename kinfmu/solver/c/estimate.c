/* Estimated errors of a pose's outputs: what rounding, conditioning and interpolation leave of their digits.
 *
 * Every solved block is a source. Its rows are known to a few roundings of their terms, so its unknowns z to
 *
 *     |dz| = |J^-1| R (2 eps (1 + offset) + residual + eps |z|)        R: scales of the rows, in lengths
 *
 * which moves all blocks that come after it. Of laws with short rises, the roundings of their arguments are a source like
 * those of the driver values. The effect on outputs and rates is computed, not estimated: position,
 * velocity and acceleration are formed again at the moved pose. See kinfmu/solver/python/estimate.py.
 */
#include "internal.h"

/* Speeds and accelerations of the drivers (with one driver: 1 and 0), and the blocks held; the largest derivatives, in
 * radians and sizes.
 */
typedef struct {
    const double *ud, *udd;
    const bool *held;
    double speed, curve;
} kf_driven;

/* Return how a pose is driven, and form its derivatives. */
static kf_driven drive_of(kf_solver *solver, kf_pose *pose, const double *ud, const double *udd)
{
    const bool one = KF_IS_ONE(solver);
    kf_driven drive;
    drive.ud = one ? KF_SPEEDS(&solver->model) : ud;
    drive.udd = one ? kf_at_rest : udd;
    drive.held = pose->bridge < 0 ? NULL : KF_POOL(solver)->spans[KF_POOL(solver)->bridges[pose->bridge].span].held;
    if (one) {
        kf_tangent(&solver->model, pose);
    } else {
        drive.held = kf_rates_in_time(&solver->model, pose, ud, udd);
    }
    drive.speed = kf_larger(kf_larger(0.0, KF_UNKNOWNS, pose->x1, kf_unknown_scales), KF_DRIVERS, drive.ud, kf_reach);
    drive.curve = kf_larger(drive.speed * drive.speed, KF_UNKNOWNS, pose->x2, kf_unknown_scales);
    drive.curve = kf_larger(drive.curve, KF_DRIVERS, drive.udd, kf_reach);
    return drive;
}

/* Form the source of one block. */
static void make_source(kf_solver *solver, const kf_pose *pose, const kf_driven *drive, int block, double weight)
{
    kf_source *const source = &solver->scratch.source;
    double *const given = source->given_first, *const all_of = solver->scratch.x1; /* of the unknowns */
    const double *rows = kf_row_scales;
    const double c = kf_known_to(&pose->found, block), of_rates = weight * KF_ROUNDINGS * KF_EPS * (1.0 + kf_row_offset);
    bool held[KF_ROOM(KF_BLOCKS)];
    int k;
    for (k = 0; k < KF_BLOCKS; ++k) {
        held[k] = k == block || (drive->held != NULL && drive->held[k]);
        rows += k < block ? kf_block_rows[k] : 0;
    }
    memset(given, 0, KF_UNKNOWNS * sizeof(double));
    kf_worst_case_step(&solver->model, &pose->found, block, rows, given + kf_first_of(block));
    KF_VELOCITY(&solver->model, &pose->found, kf_at_rest, given, held, all_of);
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        source->z[k] = weight * c * all_of[k];
        source->first[k] = of_rates * drive->speed * all_of[k];
        source->second[k] = of_rates * drive->curve * all_of[k];
    }
    source->missed[0] = source->missed[1] = source->missed[2] = 0.0;
    source->is_given = source->is_of_laws = false;
}

/* Return how well the arguments of steep laws are known, in radians and sizes; 0 without such laws. */
static double rounding_of_laws(const kf_solver *solver, const kf_pose *pose)
{
#if KF_HAS(KF_LAWS)
    double slopes[KF_ROOM(KF_LAW_ARGUMENTS)], added[KF_ROOM(KF_LAW_ARGUMENTS)], here[KF_ROOM(KF_LAWS)], largest = -1.0;
    int k;
    if (KF_LAW_ARGUMENTS == 0) {
        return 0.0;
    }
    kf_law_slopes(&solver->model, slopes);
    kf_law_added(&solver->model, added);
    kf_law_positions(&solver->model, &pose->found, here);
    for (k = 0; k < KF_LAW_ARGUMENTS; ++k) {
        if (slopes[k] * kf_law_units[k] > KF_STEEP_LAW) {
            largest = fmax(largest, (fabs(here[k]) + added[k]) / kf_law_units[k]);
        }
    }
    return largest < 0.0 ? 0.0 : KF_ROUNDINGS * KF_EPS * (1.0 + largest);
#else
    (void)solver;
    (void)pose;
    return 0.0;
#endif
}

/* Form the source of steep laws: the motion where the drivers are moved by the rounding of the arguments. */
static void make_source_of_laws(kf_solver *solver, const kf_pose *pose, const kf_driven *drive, double moved)
{
    kf_source *const source = &solver->scratch.source;
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        source->u[k] = KF_ALONG(solver) < 0 || k == KF_ALONG(solver) ? moved * kf_reach[k] : 0.0;
    }
    memset(source->first, 0, KF_UNKNOWNS * sizeof(double));
    memset(source->second, 0, KF_UNKNOWNS * sizeof(double));
    if (KF_IS_ONE(solver)) {
        for (k = 0; k < KF_UNKNOWNS; ++k) {
            source->z[k] = source->u[KF_ALONG(solver)] * pose->x1[k];
        }
    } else {
        KF_VELOCITY(&solver->model, &pose->found, source->u, source->first, drive->held, source->z);
    }
    source->missed[0] = source->missed[1] = source->missed[2] = 0.0;
    source->is_given = false;
    source->is_of_laws = true;
}

/* Move `there` by `more` away from `here`, so that two errors cannot cancel by chance. */
static void add(const double *there, const double *here, const double *more, double *to)
{
    double along = 0.0, sign;
    int k;
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        along += (there[k] - here[k]) * more[k];
    }
    sign = along >= 0.0 ? 1.0 : -1.0;
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        to[k] = there[k] + sign * more[k];
    }
}

/* Form the pose moved by a source, with its derivatives. */
static bool move(kf_solver *solver, const kf_pose *pose, const kf_driven *drive, kf_pose *there)
{
    const kf_model *const model = &solver->model;
    const kf_source *const source = &solver->scratch.source;
    const double *const here = KF_POSE_U(pose);
    double *const z = solver->scratch.x1;
    double moved[KF_DRIVERS];
    bool all[KF_ROOM(KF_BLOCKS)];
    int k;
    memset(all, 1, sizeof all);
    for (k = 0; source->is_of_laws && k < KF_DRIVERS; ++k) {
        moved[k] = here[k] + source->u[k];
    }
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        z[k] = pose->found.x[k] + source->z[k];
    }
    if (!kf_evaluated(model, source->is_of_laws ? moved : here, z, all, &there->found)) {
        return false;
    }
    KF_VELOCITY(model, &there->found, drive->ud, source->is_given ? source->given_first : pose->x1, drive->held,
                there->x1);
    add(there->x1, pose->x1, source->first, z);
    KF_VELOCITY(model, &there->found, drive->ud, z, all, there->x1);
    KF_ACCELERATION(model, &there->found, drive->udd, there->x1, source->is_given ? source->given_second : pose->x2,
                    drive->held, there->x2);
    add(there->x2, pose->x2, source->second, z);
    KF_ACCELERATION(model, &there->found, drive->udd, there->x1, z, all, there->x2);
    return true;
}

/* Form the error of a bridge's node in each unknown: of z, half z' and half^2 z'' together. `rounding` keeps the larger of
 * it and its own value.
 */
static bool round_node(kf_solver *solver, const kf_span *span, int place, double *rounding)
{
    kf_pose *const node = &solver->scratch.poses[1], *const there = &solver->scratch.poses[2];
    double *const squares = solver->scratch.zd;
    const double half = span->half;
    int worst[KF_MOST_SOURCES], count, i, k;
    double weight, rounded;
    kf_driven drive;
    kf_fresh(node, -1, -INFINITY, INFINITY);
#if KF_HAS(KF_TRACKS)
    double buffer[KF_DRIVERS];
#endif
    if (!kf_evaluated_as_given(&solver->model, KF_AT(&solver->model, &span->u[place], buffer), span->z[place], &node->found)) {
        return false;
    }
    drive = drive_of(solver, node, KF_SPEEDS(&solver->model), kf_at_rest);
    count = kf_worst_blocks(&solver->model, &node->found, NULL, worst, &weight);
    rounded = rounding_of_laws(solver, node);
    memset(squares, 0, KF_UNKNOWNS * sizeof(double));
    for (i = rounded > 0.0 ? -2 : 0; i < count; ++i) {
        if (i < 0) {
            make_source_of_laws(solver, node, &drive, i == -2 ? -rounded : rounded);
        } else {
            make_source(solver, node, &drive, worst[i], weight);
        }
        if (!move(solver, node, &drive, there)) {
            return false;
        }
        for (k = 0; k < KF_UNKNOWNS; ++k) {
            const double one = fabs(solver->scratch.source.z[k]) + half * fabs(there->x1[k] - node->x1[k])
                               + half * half * fabs(there->x2[k] - node->x2[k]);
            squares[k] += one * one;
        }
    }
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        rounding[k] = fmax(rounding[k], sqrt(squares[k]));
    }
    return count >= 0;
}

static double away(double gap, double by)
{
    return gap >= 0.0 ? gap + by : gap - by;
}

/* The steepest slope of an unknown over the only driver, both in radians and sizes. */
static double steepest(const kf_solver *solver, const kf_pose *pose)
{
    (void)solver; /* without tracks the only driver is the first */
    return kf_larger(0.0, KF_UNKNOWNS, pose->x1, kf_unknown_scales) * kf_reach[KF_ALONG(solver)];
}

/* Form the source of a bridge: the difference of its two widths, and the errors of its nearest nodes. */
static bool make_source_of_bridge(kf_solver *solver, const kf_pose *pose, const kf_driven *drive)
{
    kf_scratch *const scratch = &solver->scratch;
    kf_source *const source = &scratch->source;
    const kf_span *const span = &KF_POOL(solver)->spans[KF_POOL(solver)->bridges[pose->bridge].span];
    double *const rounding = scratch->x2; /* of the unknowns */
    const double half = span->half;
    int k;
    memset(rounding, 0, KF_UNKNOWNS * sizeof(double));
    if (!round_node(solver, span, 2, rounding) || !round_node(solver, span, 3, rounding)) {
        return false;
    }
    kf_bridge_missed(solver, pose, steepest(solver, pose), source->missed);
    kf_bridge_difference(solver, pose->bridge, KF_HERE(solver, pose), scratch->z, scratch->zd, scratch->zdd);
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        scratch->z[k] = away(scratch->z[k], rounding[k]);
        source->given_first[k] = pose->x1[k] + away(scratch->zd[k], 1.0 / half * rounding[k]);
        source->given_second[k] = pose->x2[k] + away(scratch->zdd[k], 1.0 / (half * half) * rounding[k]);
        source->first[k] = source->second[k] = 0.0;
    }
    KF_VELOCITY(&solver->model, &pose->found, kf_at_rest, scratch->z, drive->held, scratch->x1);
    memcpy(source->z, scratch->x1, KF_UNKNOWNS * sizeof(double));
    source->is_given = true;
    source->is_of_laws = false;
    return true;
}

#if KF_HAS(KF_TRACKS)

/* Form the source of the bridge of one track, in time. */
static bool make_source_of_track(kf_solver *solver, const kf_pose *pose, const kf_driven *drive, int driver)
{
    kf_source *const source = &solver->scratch.source;
    const double v = drive->ud[driver], a = drive->udd[driver];
    kf_pose *own;
    bool is_made;
    int block, k = 0;
    kf_enter_track(solver, driver);
    own = kf_on_track(solver, pose, driver);
    {
        const kf_driven along = drive_of(solver, own, KF_SPEEDS(&solver->model), kf_at_rest);
        is_made = make_source_of_bridge(solver, own, &along);
        source->missed[1] *= fabs(v) / kf_reach[driver];
        source->missed[2] *= v / kf_reach[driver] * (v / kf_reach[driver]);
    }
    kf_leave_track(solver);
    for (block = 0; block < KF_BLOCKS; ++block) {
        const bool is_own = kf_block_drivers[block] == driver;
        for (; k < kf_block_ends[block]; ++k) {
            const double one = is_own ? source->given_first[k] - own->x1[k] : 0.0;
            const double two = is_own ? source->given_second[k] - own->x2[k] : 0.0;
            source->z[k] = is_own ? source->z[k] : 0.0;
            source->given_first[k] = pose->x1[k] + v * one;
            source->given_second[k] = pose->x2[k] + (v * v * two + a * one);
        }
    }
#if KF_HAS(KF_MIXES)
    if (KF_MIXES) {
        bool of_tracks[KF_BLOCKS];
        for (block = 0; block < KF_BLOCKS; ++block) {
            of_tracks[block] = kf_block_drivers[block] != KF_MIXED;
        }
        KF_VELOCITY(&solver->model, &pose->found, kf_at_rest, source->z, of_tracks, solver->scratch.x1);
        memcpy(source->z, solver->scratch.x1, sizeof source->z);
    }
#endif
    return is_made;
}

#endif

double kf_largest_gap(const double *there, const double *here)
{
    double largest = 0.0;
    int k;
    for (k = 0; k < KF_OUTPUTS; ++k) {
        const double gap = fabs(there[k] - here[k]) / (kf_output_is_angle[k] ? 1.0 : kf_size);
        if (gap != gap) {
            return INFINITY;
        }
        largest = fmax(largest, gap);
    }
    return largest;
}

/* Return whether a determinant changes by half of its size to a pose that rounding cannot distinguish.
 *
 * So close to a singular point the rates have no bound.
 */
static bool is_singular_between(const kf_pose *pose, const kf_pose *there, const bool *held)
{
    int k;
    for (k = 0; k < KF_BLOCKS; ++k) {
        const double a = pose->found.determinants[k], b = there->found.determinants[k];
        if (!(held != NULL && held[k]) && fabs(b - a) > KF_UNBOUNDED * fabs(a)) {
            return true;
        }
    }
    return false;
}

/* Squares of the changes of the outputs by all sources; false if unknown. lost: set if rates are unknown. */
static bool tried(kf_solver *solver, kf_pose *pose, const double *ud, const double *udd, const kf_driven *drive,
                  double squares[3], bool *lost)
{
    kf_pose *const there = &solver->scratch.poses[0];
    double(*const rows)[3][KF_ROOM(KF_OUTPUTS)] = solver->scratch.rows;
    int worst[KF_MOST_SOURCES], i, order;
    double weight, missed[3];
    const int count = kf_worst_blocks(&solver->model, &pose->found, drive->held, worst, &weight);
    const int most = pose->bridge >= 0 ? 1 : KF_TRACKS ? KF_DRIVERS : 0;
    const double rounded = rounding_of_laws(solver, pose);
    kf_outputs_of(&solver->model, pose, ud, udd, rows[0][0], rows[0][1], rows[0][2]);
    for (i = rounded > 0.0 ? -2 : 0; i < count + most; ++i) {
        if (i < 0) { /* at a break of a law its two sides differ */
            make_source_of_laws(solver, pose, drive, i == -2 ? -rounded : rounded);
        } else if (i < count) {
            make_source(solver, pose, drive, worst[i], weight);
#if KF_HAS(KF_TRACKS)
        } else if (!KF_IS_ONE(solver)) {
            if (!pose->has_tracks || pose->own[i - count].bridge < 0) {
                continue;
            }
            if (!make_source_of_track(solver, pose, drive, i - count)) {
                return false;
            }
#endif
        } else if (!make_source_of_bridge(solver, pose, drive)) {
            return false;
        }
        if (!move(solver, pose, drive, there)) {
            return false;
        }
        kf_outputs_of(&solver->model, there, ud, udd, rows[1][0], rows[1][1], rows[1][2]);
        memcpy(missed, solver->scratch.source.missed, sizeof missed);
        if (KF_DRIVERS == 1) {
            missed[1] *= fabs(ud[0]) / kf_reach[0];
            missed[2] *= ud[0] / kf_reach[0] * (ud[0] / kf_reach[0]);
        }
        for (order = 0; order < 3; ++order) {
            const double gap = kf_largest_gap(rows[1][order], rows[0][order]);
            squares[order] += gap * gap + missed[order] * missed[order];
        }
        *lost = *lost || is_singular_between(pose, there, drive->held);
    }
    return count >= 0 && squares[0] + squares[1] + squares[2] < INFINITY;
}

/* Return whether branches cross without a bridge: to which branch the rates belong is unknown. */
static bool is_at_a_crossing(const kf_solver *solver, const kf_pose *pose, const kf_driven *drive)
{
    (void)solver;
    return KF_IS_ONE(solver) && pose->bridge < 0 && pose->found.margin < KF_UNDECIDED
        && drive->speed * kf_reach[KF_ALONG(solver)] < KF_STEEP;
}

/* Return the same of one of the tracks. */
static bool is_a_track_at_a_crossing(kf_solver *solver, const kf_pose *pose)
{
    bool is_there = false;
#if KF_HAS(KF_TRACKS)
    int driver;
    for (driver = 0; pose->has_tracks && pose->found.margin < KF_UNDECIDED && driver < KF_DRIVERS; ++driver) {
        kf_pose *own;
        kf_enter_track(solver, driver);
        own = kf_on_track(solver, pose, driver);
        if (own->found.margin < KF_UNDECIDED) {
            const kf_driven along = drive_of(solver, own, KF_SPEEDS(&solver->model), kf_at_rest);
            is_there = is_there || is_at_a_crossing(solver, own, &along);
        }
        kf_leave_track(solver);
    }
#else
    (void)solver;
    (void)pose;
#endif
    return is_there;
}

void kf_errors(kf_solver *solver, kf_pose *pose, const double *ud, const double *udd, double errors[3])
{
    const kf_driven drive = drive_of(solver, pose, ud, udd);
    bool lost = false;
    double squares[3] = {0.0, 0.0, 0.0}, largest = 0.0, speed = drive.speed, curve = drive.curve;
    const double *const outputs = solver->scratch.rows[0][0];
    const double zeros[KF_ROOM(KF_OUTPUTS)] = {0.0};
    int k;
    if (KF_DRIVERS == 1) {
        const double r = kf_reach[KF_ALONG(solver)], v = fabs(ud[0]) / r, a = fabs(udd[0]) / r;
        speed = drive.speed * r * v;
        curve = drive.curve * r * r * v * v + drive.speed * r * a;
    }
    if (!tried(solver, pose, ud, udd, &drive, squares, &lost)) {
        errors[0] = errors[1] = errors[2] = INFINITY;
        return;
    }
    for (k = 0; k < KF_OUTPUTS; ++k) {
        largest = kf_output_is_angle[k] ? fmax(largest, fabs(outputs[k])) : largest;
    }
    speed = fmax(speed, kf_largest_gap(solver->scratch.rows[0][1], zeros));
    curve = fmax(curve, kf_largest_gap(solver->scratch.rows[0][2], zeros));
    errors[0] = KF_EPS * (1.0 + largest + kf_offset) + sqrt(squares[0]);
    errors[1] = KF_ROUNDINGS * KF_EPS * speed + sqrt(squares[1]);
    errors[2] = KF_ROUNDINGS * KF_EPS * curve + sqrt(squares[2]);
    if (lost || is_at_a_crossing(solver, pose, &drive) || is_a_track_at_a_crossing(solver, pose)) {
        errors[1] = errors[2] = INFINITY;
    }
}
