/* Road: what is known of the singular points on the way of a single driver. See kinfmu/solver/python/road.py.
 *
 * Roads, bridges and spans are values in the solver's pools: never changed once a pose knows of them, overwritten when
 * no pose that still counts does. Number -1 is the road on which nothing is known.
 */
#include "way.h"

/* Tell which roads are needed while a way is gone: of its start, of the pose under way and of the last regular one. */
void kf_needed(kf_solver *solver, int start, int pose, int regular)
{
    solver->scratch.live[0] = start;
    solver->scratch.live[1] = pose;
    solver->scratch.live[2] = regular;
}

static bool is_needed(const kf_solver *solver, int road)
{
    const int *const live = solver->scratch.live;
#if KF_MIXES
    if (road == solver->scratch.origin[KF_ALONG(solver)]) {
        return true;
    }
#endif
    return road == live[0] || road == live[1] || road == live[2];
}

/* A bridge that no needed road holds. */
int kf_spare_bridge(const kf_solver *solver)
{
    bool held[KF_BRIDGES] = {false};
    int i, k;
    for (i = 0; i < KF_ROADS; ++i) {
        for (k = 0; is_needed(solver, i) && k < KF_MAP(solver)->roads[i].bridges; ++k) {
            held[KF_MAP(solver)->roads[i].bridge[k]] = true;
        }
    }
    for (k = 0; k < KF_BRIDGES - 1 && held[k]; ++k) {
    }
    return k; /* three needed roads do not fill the pool */
}

/* A span that no needed road holds, and not `other`; -1 if there is none. */
int kf_spare_span(const kf_solver *solver, int other)
{
    bool held[KF_SPANS] = {false};
    int i, k;
    for (i = 0; i < KF_ROADS; ++i) {
        for (k = 0; is_needed(solver, i) && k < KF_MAP(solver)->roads[i].bridges; ++k) {
            held[KF_MAP(solver)->bridges[KF_MAP(solver)->roads[i].bridge[k]].span] = true;
        }
    }
    for (k = 0; k < KF_SPANS; ++k) {
        if (!held[k] && k != other) {
            return k;
        }
    }
    return -1;
}

/* A road to be changed: a copy, if it is needed as it is. */
static int copied(kf_solver *solver, int road)
{
    int number = 0;
    if (road >= 0 && !is_needed(solver, road)) {
        return road;
    }
    while (number < KF_ROADS - 1 && is_needed(solver, number)) {
        ++number;
    }
    if (road >= 0) {
        KF_MAP(solver)->roads[number] = KF_MAP(solver)->roads[road];
    } else {
        KF_MAP(solver)->roads[number].bridges = KF_MAP(solver)->roads[number].stretches = 0;
    }
    return number;
}

/* The stretch around a driver value that has no window, empty inside one. */
void kf_stretch(const kf_solver *solver, int road, double u, double *low, double *high)
{
    int k;
    *low = -INFINITY;
    *high = INFINITY;
    for (k = 0; road >= 0 && k < KF_MAP(solver)->roads[road].bridges; ++k) {
        const kf_bridge *const bridge = &KF_MAP(solver)->bridges[KF_MAP(solver)->roads[road].bridge[k]];
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

/* The road with one more bridge; one of the same span makes way for it. */
int kf_with_bridge(kf_solver *solver, int road, int bridge)
{
    const int number = copied(solver, road);
    kf_road *const made = &KF_MAP(solver)->roads[number];
    int k, count = 0;
    for (k = 0; k < made->bridges; ++k) {
        if (KF_MAP(solver)->bridges[made->bridge[k]].span != KF_MAP(solver)->bridges[bridge].span) {
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

/* The road with one more searched stretch. */
int kf_with_searched(kf_solver *solver, int road, kf_searched stretch)
{
    const int number = copied(solver, road);
    kf_road *const made = &KF_MAP(solver)->roads[number];
    if (made->stretches == KF_SEARCHED) {
        --made->stretches;
        memmove(made->searched, made->searched + 1, (KF_SEARCHED - 1) * sizeof made->searched[0]);
    }
    made->searched[made->stretches++] = stretch;
    return number;
}

/* True if a block's zero near a driver value need not be sought. Between the outermost nodes of a bridge there is no
 * other than those it spans.
 */
bool kf_knows(const kf_solver *solver, int road, double u, int block)
{
    int k;
    if (road < 0) {
        return false;
    }
    for (k = 0; k < KF_MAP(solver)->roads[road].bridges; ++k) {
        const kf_bridge *const bridge = &KF_MAP(solver)->bridges[KF_MAP(solver)->roads[road].bridge[k]];
        if (bridge->u[0] <= u && u <= bridge->u[KF_NODES - 1]) {
            return true;
        }
    }
    for (k = 0; k < KF_MAP(solver)->roads[road].stretches; ++k) {
        const kf_searched *const stretch = &KF_MAP(solver)->roads[road].searched[k];
        if (stretch->block == block && stretch->low <= u && u <= stretch->high) {
            return true;
        }
    }
    return false;
}

/* The bridge whose window holds `here`, or the one that ends the stretch around it on the target's side. */
int kf_next_bridge(const kf_solver *solver, int road, double here, double target)
{
    const kf_road *const along = &KF_MAP(solver)->roads[road];
    double least = INFINITY;
    int k, next = along->bridge[0];
    for (k = 0; k < along->bridges; ++k) {
        const kf_bridge *const bridge = &KF_MAP(solver)->bridges[along->bridge[k]];
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
