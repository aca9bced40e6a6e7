/* Singularity map: the singular points known so far along one driver, and the bridges over them. See
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
#if KF_MIXES
    if (map == solver->scratch.origin[KF_ALONG(solver)]) {
        return true;
    }
#endif
    return map == live[0] || map == live[1] || map == live[2];
}

/* Return the number of a bridge that no needed map holds. */
int kf_spare_bridge(const kf_solver *solver)
{
    bool held[KF_BRIDGES] = {false};
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
int kf_spare_span(const kf_solver *solver, int other)
{
    bool held[KF_SPANS] = {false};
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
int kf_with_bridge(kf_solver *solver, int map, int bridge)
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
int kf_with_interval(kf_solver *solver, int map, kf_interval interval)
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
bool kf_knows(const kf_solver *solver, int map, double u, int block)
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
