/* Singularity map: the singular points known so far, and how a survey finds them and bridges them. See
 * kinfmu/solver/python/singularity_map.py.
 *
 * Maps, bridges and spans are in the solver's pools, and poses refer to them by number; -1 is the empty map. They are not
 * changed while a pose that is still needed refers to them, and overwritten afterwards.
 */
#include "internal.h"

/* Keep three maps while a path is followed: those of its start, of the current pose and of the last regular one. */
void kf_keep_maps(kf_solver *solver, int start, int pose, int regular)
{
    solver->scratch.live[0] = start;
    solver->scratch.live[1] = pose;
    solver->scratch.live[2] = regular;
}

static bool is_needed(const kf_solver *solver, int map)
{
    const int *const live = solver->scratch.live;
#if KF_HAS(KF_MIXES)
    if (KF_MIXES && map == solver->scratch.origin[KF_ALONG(solver)]) {
        return true;
    }
#endif
    return map == live[0] || map == live[1] || map == live[2];
}

/* Return the number of a bridge that no needed map holds. */
int kf_spare_bridge(const kf_solver *solver)
{
    bool held[KF_ROOM(KF_BRIDGES)] = {false};
    int i, k;
    for (i = 0; i < KF_MAPS; ++i) {
        for (k = 0; is_needed(solver, i) && k < KF_POOL(solver)->maps[i].bridges; ++k) {
            held[KF_POOL(solver)->maps[i].bridge[k]] = true;
        }
    }
    for (k = 0; k < KF_BRIDGES - 1 && held[k]; ++k) {
    }
    return k; /* three needed maps do not fill the pool */
}

/* Return the number of a span that no needed map holds, other than `other`; -1 if there is none. */
static int spare_span(const kf_solver *solver, int other)
{
    bool held[KF_ROOM(KF_SPANS)] = {false};
    int i, k;
    for (i = 0; i < KF_MAPS; ++i) {
        for (k = 0; is_needed(solver, i) && k < KF_POOL(solver)->maps[i].bridges; ++k) {
            held[KF_POOL(solver)->bridges[KF_POOL(solver)->maps[i].bridge[k]].span] = true;
        }
    }
    for (k = 0; k < KF_SPANS; ++k) {
        if (!held[k] && k != other) {
            return k;
        }
    }
    return -1;
}

/* Return the number of a map to be changed: of a copy, if the map itself is needed. */
static int copied(kf_solver *solver, int map)
{
    int number = 0;
    if (map >= 0 && !is_needed(solver, map)) {
        return map;
    }
    while (number < KF_MAPS - 1 && is_needed(solver, number)) {
        ++number;
    }
    if (map >= 0) {
        KF_POOL(solver)->maps[number] = KF_POOL(solver)->maps[map];
    } else {
        KF_POOL(solver)->maps[number].bridges = KF_POOL(solver)->maps[number].intervals = 0;
    }
    return number;
}

/* Return the limits of the window-free interval around `u`; inside a window it is empty. */
void kf_around(const kf_solver *solver, int map, double u, double *low, double *high)
{
    int k;
    *low = -INFINITY;
    *high = INFINITY;
    for (k = 0; map >= 0 && k < KF_POOL(solver)->maps[map].bridges; ++k) {
        const kf_bridge *const bridge = &KF_POOL(solver)->bridges[KF_POOL(solver)->maps[map].bridge[k]];
        if (kf_covers(bridge, u)) {
            *low = INFINITY;
            *high = -INFINITY;
            return;
        }
        if (bridge->centre < u) {
            *low = fmax(*low, bridge->u[3]);
        } else {
            *high = fmin(*high, bridge->u[2]);
        }
    }
}

/* Return the map with one more bridge, which replaces one of the same span. */
static int with_bridge(kf_solver *solver, int map, int bridge)
{
    const int number = copied(solver, map);
    kf_singularity_map *const made = &KF_POOL(solver)->maps[number];
    int k, count = 0;
    for (k = 0; k < made->bridges; ++k) {
        if (KF_POOL(solver)->bridges[made->bridge[k]].span != KF_POOL(solver)->bridges[bridge].span) {
            made->bridge[count++] = made->bridge[k];
        }
    }
    if (count == KF_KEPT) {
        --count;
        memmove(made->bridge, made->bridge + 1, (size_t)count * sizeof made->bridge[0]);
    }
    made->bridge[count] = bridge;
    made->bridges = count + 1;
    return number;
}

/* Return the map with one more searched interval. */
static int with_interval(kf_solver *solver, int map, kf_interval interval)
{
    const int number = copied(solver, map);
    kf_singularity_map *const made = &KF_POOL(solver)->maps[number];
    if (made->intervals == KF_INTERVALS) {
        --made->intervals;
        memmove(made->searched, made->searched + 1, (KF_INTERVALS - 1) * sizeof made->searched[0]);
    }
    made->searched[made->intervals++] = interval;
    return number;
}

/* Return whether a zero of a block's determinant near `u` need not be searched for. Between its outermost nodes a bridge
 * spans all zeros.
 */
static bool knows(const kf_solver *solver, int map, double u, int block)
{
    int k;
    if (map < 0) {
        return false;
    }
    for (k = 0; k < KF_POOL(solver)->maps[map].bridges; ++k) {
        const kf_bridge *const bridge = &KF_POOL(solver)->bridges[KF_POOL(solver)->maps[map].bridge[k]];
        if (bridge->u[0] <= u && u <= bridge->u[KF_NODES - 1]) {
            return true;
        }
    }
    for (k = 0; k < KF_POOL(solver)->maps[map].intervals; ++k) {
        const kf_interval *const interval = &KF_POOL(solver)->maps[map].searched[k];
        if (interval->block == block && interval->low <= u && u <= interval->high) {
            return true;
        }
    }
    return false;
}

/* Return the bridge whose window holds `here`, else the nearest one towards the target. */
int kf_next_bridge(const kf_solver *solver, int map, double here, double target)
{
    const kf_singularity_map *const along = &KF_POOL(solver)->maps[map];
    double least = INFINITY;
    int k, next = along->bridge[0];
    for (k = 0; k < along->bridges; ++k) {
        const kf_bridge *const bridge = &KF_POOL(solver)->bridges[along->bridge[k]];
        if (kf_covers(bridge, here)) {
            return along->bridge[k];
        }
        if ((bridge->centre > here) == (target > here) && fabs(bridge->centre - here) < least) {
            least = fabs(bridge->centre - here);
            next = along->bridge[k];
        }
    }
    return next;
}

/* Find the driver value where a determinant vanishes on the secant through its values at a and b. */
static bool secant_zero(double a, double of_a, double b, double of_b, double *zero)
{
    const double rise = of_b - of_a;
    *zero = b - of_b * (b - a) / rise;
    return rise != 0.0;
}

/* Find where a block's determinant vanishes, by secants from the near side; false if it does not fall straight.
 *
 * Towards a dead centre it falls like a square root: the secant's zero is about twice as far as the dead centre.
 */
static bool locate(kf_solver *solver, kf_pose *pose, int block, double *zero)
{
    const double least = 0.1 * KF_NARROWEST * kf_reach[KF_ALONG(solver)];
    double step = 0.5 * (*zero - KF_HERE(solver, pose));
    bool is_compared = false; /* the first step says nothing: the estimate may stem from the same two places */
    while (fabs(step) > least) {
        const double here = KF_HERE(solver, pose);
        kf_pose *const ahead = kf_follow_path(solver, pose, here + step);
        double of_here, of_ahead, better, left, change;
        if (ahead == NULL) {
            step *= 0.5;
            is_compared = false;
            continue;
        }
        of_here = pose->found.determinants[block];
        of_ahead = ahead->found.determinants[block];
        if (!secant_zero(here, of_here, KF_HERE(solver, ahead), of_ahead, &better)) {
            return false;
        }
        left = better - KF_HERE(solver, ahead);
        if (left * step <= 0.0) {
            return false;
        }
        change = fabs(better - *zero);
        *zero = better;
        if (is_compared && change <= KF_STRAIGHT * fabs(left) && change <= 0.2 * KF_NARROWEST * kf_reach[KF_ALONG(solver)]) {
            return true;
        }
        KF_ASSIGN(&solver->scratch.located, ahead); /* paths from here may fail */
        pose = &solver->scratch.located;
        is_compared = true;
        step = 0.5 * (better - KF_HERE(solver, pose));
    }
    return false;
}

/* Return whether a block has more rows than unknowns: its determinant is never negative, and falls to zero at a
 * crossing.
 */
static bool is_tall(int block)
{
    return kf_block_rows[block] > kf_block_ends[block] - kf_first_of(block);
}

/* Find poses at 1, 2, 4 half widths on the far side, each extrapolated from the last ones and corrected. before: the last
 * pose on the near side.
 */
static bool cross(kf_solver *solver, kf_span *span, kf_pose *before, double side, int block)
{
    static const double places[KF_NODES] = {-4.0, -2.0, -1.0, 1.0, 2.0, 4.0}; /* in the direction of the crossing */
    static const int order[KF_NODES] = {0, 1, 2, 3, 4, 5};
    double(*const determinants)[KF_ROOM(KF_BLOCKS)] = solver->scratch.determinants; /* before the zero, after, last */
    double *const last = determinants[2];
#if KF_HAS(KF_TRACKS)
    double buffer[KF_DRIVERS];
#endif
    int node, k;
    for (node = 3; node < KF_NODES; ++node) {
        const int first = node == 5 ? 1 : 0, count = node - first;
        const double u = span->centre + side * places[node] * span->half;
        kf_pose *const pose = &solver->scratch.follow[before == &solver->scratch.follow[0]];
        double weights[KF_MOST_NODES][3];
        kf_weights(count, places + first, places[node], weights);
        kf_combined(span, side * span->half, count, order + first, (const double(*)[3])weights, solver->scratch.z);
        kf_fresh(pose, -1, -INFINITY, INFINITY);
        ++solver->scratch.work;
        if (!kf_evaluated(&solver->model, KF_AT(&solver->model, &u, buffer), solver->scratch.z, NULL, &pose->found)
            || pose->found.moved > KF_STEADY * pose->found.margin) {
            return false;
        }
        for (k = 0; node > 3 && k < KF_BLOCKS; ++k) {
            if (pose->found.determinants[k] * last[k] <= 0.0) {
                return false; /* there is another zero next to the one to be bridged */
            }
        }
#if KF_HAS(KF_LAWS)
        if (KF_LAWS && kf_passes_unseen_between(solver, before, pose)) {
            return false;
        }
#endif
        memcpy(last, pose->found.determinants, KF_BLOCKS * sizeof(double));
        if (node == 3) {
            memcpy(determinants[1], last, KF_BLOCKS * sizeof(double));
        }
        kf_span_node(span, node, pose, &solver->model);
        before = pose;
    }
    return determinants[0][block] * determinants[1][block] < 0.0 || is_tall(block); /* else it touches zero without crossing it */
}

/* Build a span of one width over the zero of a block's determinant, from the side of the pose. */
static bool span_over(kf_solver *solver, kf_span *span, kf_pose *pose, int block, double centre, double half)
{
    const double side = centre > KF_HERE(solver, pose) ? 1.0 : -1.0;
    double distance = 4.0;
    int node;
    span->centre = centre;
    span->half = half;
    for (node = 0; node < 3; ++node) {
        pose = kf_follow_path(solver, pose, centre - side * distance * half);
        if (pose == NULL) {
            return false;
        }
        kf_span_node(span, node, pose, &solver->model);
        distance *= 0.5;
    }
    memcpy(solver->scratch.determinants[0], pose->found.determinants, KF_BLOCKS * sizeof(double));
    if (!cross(solver, span, pose, side, block)) {
        return false;
    }
    kf_span_hold(span, solver->scratch.determinants[0], solver->scratch.determinants[1]);
    if (side < 0.0) {
        kf_span_reverse(span);
    }
    return true;
}

/* Build a bridge over the zero of a block's determinant ahead of a regular pose; -1 if none is accepted.
 *
 * zero: a first estimate. Windows shrink until they hold one point and its six nodes, and both widths agree. Then the
 * closing decides: where lengths miss a change point, no narrower window would close. A dead centre gives no bridge:
 * the determinant does not fall to zero straight, the far side cannot be reached.
 */
static int build(kf_solver *solver, kf_pose *pose, int block, double zero)
{
    const double reach = kf_reach[KF_ALONG(solver)];
    double half, apart = KF_AGREED;
    int best = -1;
    if (!locate(solver, pose, block, &zero)) {
        return -1;
    }
    for (half = KF_HALF_WIDTH * reach; half >= KF_NARROWEST * reach && apart > KF_FINE; half *= 0.5) {
        const int number = spare_span(solver, best);
        kf_span *const span = &KF_POOL(solver)->spans[number < 0 ? 0 : number];
        if (number >= 0 && span_over(solver, span, pose, block, zero, half) && kf_span_apart(span) < apart) {
            best = number;
            apart = kf_span_apart(span);
        }
    }
    if (best >= 0) {
        const int number = kf_spare_bridge(solver);
        kf_bridge *const bridge = &KF_POOL(solver)->bridges[number];
        memset(bridge->raised, 0, KF_UNKNOWNS * sizeof(double));
        kf_make_bridge(bridge, solver, best, 0.0);
        if (kf_bridge_closes(solver, bridge, &solver->scratch.follow[0].found)) {
            return number;
        }
    }
    return -1;
}

/* Return a pose at a distance from another, on the side where a block's determinant grows; NULL if there is none. */
static kf_pose *nearby(kf_solver *solver, kf_pose *pose, int block, double distance)
{
    int k;
    for (k = 0; k < 2; ++k) {
        const kf_pose *const other = kf_follow_path(solver, pose, KF_HERE(solver, pose) + (k == 0 ? distance : -distance));
        if (other != NULL && fabs(other->found.determinants[block]) > fabs(pose->found.determinants[block])) {
            KF_ASSIGN(&solver->scratch.nearby, other); /* paths start from it */
            return &solver->scratch.nearby;
        }
    }
    return NULL;
}

/* Return whether the secant through two poses next to each other has all zeros of low determinants far off; block: the
 * first that is low.
 */
static bool is_far_off(const kf_solver *solver, const kf_pose *pose, const kf_pose *trial, int block)
{
    const double here = KF_HERE(solver, trial), from = KF_HERE(solver, pose);
    const double *const after = trial->found.determinants, *const before = pose->found.determinants;
    double zero;
    for (; block < KF_BLOCKS; ++block) {
        if (fabs(after[block]) < KF_REGULAR && !knows(solver, trial->map, here, block)
            && !(secant_zero(from, before[block], here, after[block], &zero)
                 && fabs(zero - here) > KF_FAR_OFF * KF_HALF_WIDTH * kf_reach[KF_ALONG(solver)])) {
            return false;
        }
    }
    return true;
}

/* Return the singularity map with what a trial pose shows: the map itself if that is nothing new.
 *
 * New is a bridge, where the trial comes near a singular point, or a searched interval, where no bridge holds.
 */
int kf_surveyed(kf_solver *solver, kf_pose *pose, kf_pose *trial)
{
    const double here = KF_HERE(solver, trial), reach = kf_reach[KF_ALONG(solver)];
    const double *const determinants = trial->found.determinants;
    int map = trial->map, block = 0, k;
    kf_pose *before = pose;
    while (block < KF_BLOCKS && !(fabs(determinants[block]) < KF_REGULAR && !knows(solver, map, here, block))) {
        ++block;
    }
    if (block == KF_BLOCKS) {
        return map;
    }
    for (k = 0; kf_driver_is_angle[KF_ALONG(solver)] && map >= 0 && k < KF_POOL(solver)->maps[map].bridges; ++k) {
        const int again = kf_moved(solver, KF_POOL(solver)->maps[map].bridge[k], pose, here);
        if (again >= 0) {
            return with_bridge(solver, map, again);
        }
    }
    if (fabs(here - KF_HERE(solver, pose)) <= KF_NEXT_TO * reach) {
        if (is_far_off(solver, pose, trial, block)) {
            return map;
        }
        before = nearby(solver, trial, block, 0.02 * reach);
    }
    for (; before != NULL && block < KF_BLOCKS; ++block) { /* upstream first */
        const double from = KF_HERE(solver, before), of_from = before->found.determinants[block];
        kf_interval searched;
        double zero;
        int bridge;
        if (!(fabs(determinants[block]) < KF_REGULAR) || knows(solver, trial->map, here, block)
            || !secant_zero(from, of_from, here, determinants[block], &zero)
            || fabs(zero - here) > 1.05 * KF_HALF_WIDTH * reach || knows(solver, map, zero, block)) {
            continue;
        }
        bridge = build(solver, before, block, zero);
        searched.block = block;
        if (bridge < 0) {
            searched.low = zero - 2.0 * KF_HALF_WIDTH * reach;
            searched.high = zero + 2.0 * KF_HALF_WIDTH * reach;
        } else if (knows(solver, map, KF_POOL(solver)->bridges[bridge].centre, block)) {
            searched.low = fmin(here, KF_POOL(solver)->bridges[bridge].centre);
            searched.high = fmax(here, KF_POOL(solver)->bridges[bridge].centre);
        } else {
            return with_bridge(solver, map, bridge);
        }
        map = with_interval(solver, map, searched);
    }
    return map;
}
