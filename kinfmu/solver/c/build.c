/* Build: a bridge over a singular point ahead of a regular pose. See kinfmu/solver/python/build.py. */
#include "internal.h"

/* Find the driver value where a determinant vanishes on the secant through its values at a and b. */
bool kf_secant_zero(double a, double of_a, double b, double of_b, double *zero)
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
        if (!kf_secant_zero(here, of_here, KF_HERE(solver, ahead), of_ahead, &better)) {
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
        solver->scratch.located = *ahead; /* paths from here may fail */
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
#if KF_TRACKS
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
        if (!kf_evaluated(&solver->model, KF_AT(&solver->model, &u, buffer), solver->scratch.z, NULL, &pose->found)
            || pose->found.moved > KF_STEADY * pose->found.margin) {
            return false;
        }
        for (k = 0; node > 3 && k < KF_BLOCKS; ++k) {
            if (pose->found.determinants[k] * last[k] <= 0.0) {
                return false; /* there is another zero next to the one to be bridged */
            }
        }
#if KF_LAWS
        if (kf_passes_unseen_between(solver, before, pose)) {
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
int kf_build(kf_solver *solver, kf_pose *pose, int block, double zero)
{
    const double reach = kf_reach[KF_ALONG(solver)];
    double half, apart = KF_AGREED;
    int best = -1;
    if (!locate(solver, pose, block, &zero)) {
        return -1;
    }
    for (half = KF_HALF_WIDTH * reach; half >= KF_NARROWEST * reach && apart > KF_FINE; half *= 0.5) {
        const int number = kf_spare_span(solver, best);
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
