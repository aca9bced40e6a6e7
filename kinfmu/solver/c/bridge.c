/* Bridges: interpolation across singular points from both sides, accepted only if the interpolated pose closes. See
 * kinfmu/solver/python/bridge.py.
 */
#include "internal.h"

/* Return angle + turns * 2 pi [rad], rounded about once. */
double kf_turned(double angle, double turns)
{
    return angle + turns * KF_HIGH + turns * KF_LOW;
}

/* Return the whole number of turns nearest to an angle [rad]. */
double kf_whole_turns(double angle)
{
    return nearbyint(angle / KF_TURN);
}

/* Return whether u is inside the window, where the bridge is used. */
bool kf_covers(const kf_bridge *bridge, double u)
{
    return bridge->u[2] < u && u < bridge->u[3];
}

/* Move unknowns by the turns of a bridge; `to` may be `z`. */
static void turn_on(const kf_bridge *bridge, const double *z, double *to)
{
    int k;
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        to[k] = bridge->turns != 0.0 ? kf_turned(z[k], bridge->raised[k]) : z[k];
    }
}

/* Return the place of a driver value on the span: x = (u - centre) / half. */
static double place(const kf_bridge *bridge, const kf_span *span, double u)
{
    return (kf_turned(u, -bridge->turns) - span->centre) / bridge->half;
}

/* Return the place where the inner polynomials of a bridge's span are cached; others may have overwritten them. */
static kf_inner *inner_of(kf_solver *solver, const kf_bridge *bridge)
{
    return &solver->scratch.inner[bridge->span % KF_INNERS];
}

/* Make the bridge of a span moved by whole turns; `raised` holds the turns of the unknowns. */
void kf_make_bridge(kf_bridge *bridge, const kf_solver *solver, int span, double turns)
{
    const kf_span *const from = &KF_POOL(solver)->spans[span];
    int k;
    bridge->span = span;
    bridge->turns = turns;
    bridge->centre = kf_turned(from->centre, turns);
    bridge->half = from->half;
    for (k = 0; k < KF_NODES; ++k) {
        bridge->u[k] = kf_turned(from->u[k], turns);
    }
}

/* Find the pose at a node. */
static bool at_node(kf_solver *solver, const kf_bridge *bridge, int node, kf_pose *pose)
{
    const double *const z = KF_POOL(solver)->spans[bridge->span].z[node];
    double *const there = solver->scratch.z;
    const double *u;
#if KF_HAS(KF_TRACKS)
    double buffer[KF_DRIVERS];
#endif
    u = KF_AT(&solver->model, &bridge->u[node], buffer);
    kf_fresh(pose, -1, -INFINITY, INFINITY);
    ++solver->scratch.work;
    if (bridge->turns == 0.0) { /* as it was found */
        return kf_evaluated_as_given(&solver->model, u, z, &pose->found);
    }
    turn_on(bridge, z, there);
    return kf_evaluated(&solver->model, u, there, NULL, &pose->found);
}

/* Find the farthest node on the target's side that does not lie beyond the target. */
bool kf_bridge_exit(kf_solver *solver, int number, double target, kf_pose *pose)
{
    const kf_bridge *const bridge = &KF_POOL(solver)->bridges[number];
    const int near = target > bridge->centre ? 3 : 2, far = target > bridge->centre ? 4 : 1;
    const bool passed = fabs(target - bridge->centre) >= fabs(bridge->u[far] - bridge->centre);
    return at_node(solver, bridge, passed ? far : near, pose);
}

/* Find the interpolated pose inside the window; regular blocks are solved from it. */
bool kf_bridge_pose(kf_solver *solver, int number, const double *u, kf_pose *pose)
{
    const kf_model *const model = &solver->model;
    const kf_bridge *const bridge = &KF_POOL(solver)->bridges[number];
    const kf_span *const span = &KF_POOL(solver)->spans[bridge->span];
    double *const z = solver->scratch.z, *const zd = solver->scratch.zd, *const zdd = solver->scratch.zdd;
    kf_span_read(span, inner_of(solver, bridge), place(bridge, span, u[KF_ALONG(solver)]), z, zd, zdd);
    turn_on(bridge, z, z);
    kf_fresh(pose, -1, INFINITY, -INFINITY);
    ++solver->scratch.work;
    if (!kf_evaluated(model, u, z, span->held, &pose->found)) {
        return false;
    }
    pose->bridge = number;
    pose->status = KF_BRIDGED;
    KF_VELOCITY(model, &pose->found, KF_SPEEDS(model), zd, span->held, pose->x1);
    KF_ACCELERATION(model, &pose->found, kf_at_rest, pose->x1, zdd, span->held, pose->x2);
    pose->derivatives = 2;
    return true;
}

/* Find the interpolated pose at the centre, and the largest of the driver value and the unknowns, in radians and sizes. */
static bool find_middle(kf_solver *solver, const kf_bridge *bridge, kf_found *found, double *size)
{
    const kf_span *const span = &KF_POOL(solver)->spans[bridge->span];
    double *const z = solver->scratch.z;
#if KF_HAS(KF_TRACKS)
    double buffer[KF_DRIVERS];
#endif
    double largest = fmax(kf_row_offset, fabs(bridge->centre) / kf_reach[KF_ALONG(solver)]);
    int block, k = 0;
    kf_span_middle(span, z);
    turn_on(bridge, z, z);
    for (block = 0; block < KF_BLOCKS; ++block) {
        for (; k < kf_block_ends[block]; ++k) {
            largest = kf_is_outside(&solver->model, block) ? largest : fmax(largest, fabs(z[k]) / kf_unknown_scales[k]);
        }
    }
    *size = largest;
    ++solver->scratch.work;
    return kf_evaluated(&solver->model, KF_AT(&solver->model, &bridge->centre, buffer), z, span->held, found);
}

/* Return whether a driven distance that passes 0 in the window closes as a length: d.d - u^2 always does.
 *
 * Two points that pass each other at a distance d give this row a residual of d^2.
 */
static bool keeps_distances(const kf_solver *solver, const kf_bridge *bridge, const kf_found *found)
{
    double residuals[KF_ROOM(KF_LARGEST_BLOCK)];
    int k;
    for (k = 0; k < KF_DISTANCES && bridge->u[2] < 0.0 && 0.0 < bridge->u[3]; ++k) {
        if (kf_distance_drivers[k] == KF_ALONG(solver) && !kf_is_outside(&solver->model, kf_distance_blocks[k])) {
            const double u = bridge->centre;
            double squared;
            kf_residuals(&solver->model, found, kf_distance_blocks[k], residuals);
            squared = residuals[kf_distance_rows[k]] * kf_distance_scales[k] + u * u;
            if (fabs(sqrt(fmax(squared, 0.0)) - fabs(u)) > KF_CLOSED * kf_size) {
                return false;
            }
        }
    }
    return true;
}

/* Return whether the interpolated pose at the centre closes, up to what rounding leaves of large angles. */
bool kf_bridge_closes(kf_solver *solver, const kf_bridge *bridge, kf_found *found)
{
    double largest;
    return find_middle(solver, bridge, found, &largest) && found->residual <= KF_CLOSED + 4.0 * KF_EPS * largest
           && keeps_distances(solver, bridge, found);
}

/* Return by how much lengths miss the change point, relative to the size; 0 within rounding.
 *
 * That is the residual at the centre that no change of the unknowns removes: of J dz = -r, damped, the part outside the
 * columns of J.
 */
static double miss(kf_solver *solver, const kf_bridge *bridge)
{
    kf_found *const found = &solver->scratch.poses[1].found;
    const bool *const held = KF_POOL(solver)->spans[bridge->span].held;
    double jacobian[KF_ROOM(KF_LARGEST_BLOCK)], right[KF_ROOM(KF_LARGEST_BLOCK)], largest, left = 0.0;
    const double *rows = kf_row_scales;
    int block, i, k;
    if (!find_middle(solver, bridge, found, &largest)) {
        return 0.0;
    }
    for (block = 0; block < KF_BLOCKS; ++block) {
        const int first = kf_first_of(block), columns = kf_block_ends[block] - first, m = kf_block_rows[block];
        if (held[block]) {
            kf_jacobian(&solver->model, found, block, jacobian);
            kf_residuals(&solver->model, found, block, right);
            for (i = 0; i < m; ++i) {
                for (k = 0; k < columns; ++k) {
                    jacobian[i * columns + k] *= kf_unknown_scales[first + k] / rows[i];
                }
            }
            left = fmax(left, kf_unclosed(m, columns, jacobian, right, KF_DAMPING));
        }
        rows += m;
    }
    return fmax(0.0, left - KF_NOISE * KF_EPS * (1.0 + largest));
}

/* Return what the miss may do to unknowns and their derivatives over the driver, in radians and sizes.
 *
 * Where lengths miss a change point by m, crossing branches separate: by sqrt(m) at the crossing, by m / x at the distance
 * x from it. Their determinant is linear in x, so it gives x more exactly than the window's centre. slope: of the steepest
 * unknown.
 */
void kf_bridge_missed(kf_solver *solver, const kf_pose *pose, double slope, double missed[3])
{
    const kf_bridge *const bridge = &KF_POOL(solver)->bridges[pose->bridge];
    const bool *const held = KF_POOL(solver)->spans[bridge->span].held;
    kf_pose *const before = &solver->scratch.poses[1], *const after = &solver->scratch.poses[2];
    const double e = 2.0 * sqrt(miss(solver, bridge));
    double part = INFINITY, w;
    int k;
    missed[0] = missed[1] = missed[2] = 0.0;
    if (e == 0.0 || !at_node(solver, bridge, 2, before) || !at_node(solver, bridge, 3, after)) {
        return;
    }
    for (k = 0; k < KF_BLOCKS; ++k) {
        const double sides = fabs(before->found.determinants[k]) + fabs(after->found.determinants[k]);
        part = held[k] ? fmin(part, 2.0 * fabs(pose->found.determinants[k]) / sides) : part;
    }
    w = e + part * bridge->half / kf_reach[KF_ALONG(solver)];
    missed[0] = e * e / w;
    missed[1] = 2.0 * fmax(1.0, slope) * (e / w) * (e / w);
    missed[2] = 8.0 * e * e / (w * w * w);
}

/* Return the difference of the wider span and the one used, in z and its two derivatives: the error estimate. */
void kf_bridge_difference(kf_solver *solver, int number, double u, double *z, double *zd, double *zdd)
{
    const kf_bridge *const bridge = &KF_POOL(solver)->bridges[number];
    const kf_span *const span = &KF_POOL(solver)->spans[bridge->span];
    kf_span_difference(span, inner_of(solver, bridge), place(bridge, span, u), z, zd, zdd);
}

/* Return the bridge moved by whole turns, if u lies between its moved nodes and the mechanism repeats, else -1.
 *
 * It repeats if the node next to the pose, reached from it, is the node of the span except for whole turns of angles, and
 * if the moved bridge closes. So a bridge of another branch, or of a mechanism with a screw, is not moved.
 */
int kf_moved(kf_solver *solver, int number, kf_pose *pose, double u)
{
    const kf_bridge *const bridge = &KF_POOL(solver)->bridges[number];
    const kf_span *const span = &KF_POOL(solver)->spans[bridge->span];
    const double turns = kf_whole_turns(u - span->centre), there = kf_turned(u, -turns);
    const double here = kf_turned(KF_HERE(solver, pose), -turns);
    const int first = here > span->centre ? 3 : 0;
    const int made = kf_spare_bridge(solver);
    kf_bridge *const other = &KF_POOL(solver)->bridges[made];
    const kf_pose *arrived;
    int node = first, k;
    if (turns == bridge->turns || !(span->u[0] <= there && there <= span->u[KF_NODES - 1])) {
        return -1;
    }
    for (k = first; k < first + 3; ++k) {
        node = fabs(span->u[k] - here) < fabs(span->u[node] - here) ? k : node;
    }
    arrived = kf_follow_path(solver, pose, kf_turned(span->u[node], turns));
    if (arrived == NULL) {
        return -1;
    }
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        const double a = arrived->found.x[k], b = span->z[node][k];
        other->raised[k] = kf_unknown_is_angle[k] ? kf_whole_turns(a - b) : 0.0;
        if (!(fabs(a - kf_turned(b, other->raised[k])) <= KF_AGREED * kf_unknown_scales[k])) {
            return -1;
        }
    }
    kf_make_bridge(other, solver, bridge->span, turns);
    for (k = 0; turns != 0.0 && k < KF_NODES; ++k) {
        kf_pose *const follow = solver->scratch.follow;
        if (!at_node(solver, other, k, &follow[k % 2])) {
            return -1;
        }
#if KF_HAS(KF_LAWS)
        if (KF_LAWS && k > 0 && kf_passes_unseen_between(solver, &follow[(k - 1) % 2], &follow[k % 2])) {
            return -1;
        }
#endif
    }
    return kf_bridge_closes(solver, other, &solver->scratch.follow[0].found) ? made : -1;
}
