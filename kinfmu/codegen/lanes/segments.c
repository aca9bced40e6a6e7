/* Segments: polynomials of the motion between nodes. See segments.h. */
#include "segments.h"

#include <stdlib.h>

#include "internal.h"

#define TURN 6.283185307179586
#define HIGH 6.2831853069365025     /* [rad]; 2 pi to 32 bits, as in bridge.c */
#define LOW 2.430840202602477e-10   /* [rad]; the rest */
#define SAME 1e-9         /* difference of poses that are a turn apart */
#define SURE 0.05         /* determinant from which nodes count as regular */
#define MOST_MEMORY 1e8   /* [bytes] for segments on either side of the anchor */
#define AT_ONCE 4096     /* driver values that are looked at together */
#define ROUNDED 1e-12    /* of a segment */
#define STEEP 0.78        /* [rad]; up to here sines and cosines are turned by polynomials */

#if KF_HAS_LANES

#if KF_LAWS
#define MOST_STEPS 64   /* through laws in a segment: with more, its samples are solved alone */
#define UNEXAMINED 2.0  /* steps through a law between poses at which a segment was examined */
#define APART 0.1       /* [rad, sizes] of a segment from such a pose; farther off lie other branches and whole turns */

static void law_steps(const kf_model *model, const kf_pose *pose, double *steps)
{
    double positions[KF_LAWS];
    kf_law_positions(model, &pose->found, positions);
    kf_law_steps(model, positions, steps);
}

/* Return the most steps of a path through a law between two poses. */
static double steps_between(const double *a, const double *b)
{
    double most = 0.0;
    int k;
    for (k = 0; k < KF_LAW_ARGUMENTS; ++k) {
        most = fmax(most, fabs(b[k] - a[k]));
    }
    return most;
}

/* Return whether a segment was not too coarse for the laws: compare it with poses at as many places as laws have steps.
 *
 * steps: of a path through the laws at the end of the segment, from where the follower goes back; through: in the segment.
 */
static bool sees_laws(const kf_segments *segments, kf_follower *follower, const kf_segment *segment, double end,
                      const double *steps, double through)
{
    const int count = through <= MOST_STEPS ? (int)ceil(through) : 0;
    double before[KF_ROOM(KF_LAW_ARGUMENTS)], here[KF_ROOM(KF_LAW_ARGUMENTS)];
    int i, j, k;
    memcpy(before, steps, sizeof before);
    for (i = 1; through > UNEXAMINED && i <= count; ++i) {
        const double u = end + 2.0 * (segment->centre - end) * i / count, x = (u - segment->centre) * 2.0 / segments->width;
        const kf_pose *const pose = kf_followed(follower, &u);
        if (!KF_GOOD(pose->status)) {
            return false;
        }
        law_steps(&follower->solver.model, pose, here);
        if (!(steps_between(before, here) <= UNEXAMINED)) {
            return false;
        }
        memcpy(before, here, sizeof before);
        for (k = 0; k < KF_UNKNOWNS; ++k) {
            double value = 0.0;
            for (j = KF_TERMS - 2; j >= 0; --j) {
                value = (value + segment->c[j][k]) * x;
            }
            if (!(fabs(segment->base[k] + value - pose->found.x[k]) <= APART * kf_unknown_scales[k])) {
                return false;
            }
        }
    }
    return through <= MOST_STEPS;
}
#endif

typedef struct {
    bool is_good;
#if KF_LAWS
    double steps[KF_ROOM(KF_LAW_ARGUMENTS)];
#endif
    double z[KF_ROOM(KF_UNKNOWNS)], zd[KF_ROOM(KF_UNKNOWNS)], zdd[KF_ROOM(KF_UNKNOWNS)];
} kf_node;

/* The driver value of a node; every other node is the centre of a segment. */
static double node_place(const kf_segments *segments, int64_t number)
{
    return kf_anchor_u[0] + (double)number * (0.5 * segments->width);
}

/* The polynomial of a bridge's window: that of kf_span_read, in powers of x. */
static void read_bridge(kf_window *window, const kf_bridge *bridge, const kf_span *span)
{
    static const double places[4] = {-2.0, -1.0, 1.0, 2.0};
    const double half = span->half;
    int i, j, k;
    window->low = bridge->u[2];
    window->high = bridge->u[3];
    window->centre = bridge->centre;
    window->half = half;
    memcpy(window->held, span->held, sizeof window->held);
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        const double from = span->z[2][k];
        double samples[4][3], powers[KF_WINDOW_TERMS] = {0.0};
        kf_hermite polynomial;
        for (i = 0; i < 4; ++i) {
            samples[i][0] = span->z[i + 1][k] - from;
            samples[i][1] = span->zd[i + 1][k] * half;
            samples[i][2] = span->zdd[i + 1][k] * half * half;
        }
        kf_hermite_through(4, places, (const double(*)[3])samples, &polynomial);
        for (i = KF_WINDOW_TERMS - 1; i >= 0; --i) { /* times x - node, plus the next coefficient */
            for (j = KF_WINDOW_TERMS - 1; j > 0; --j) {
                powers[j] = powers[j - 1] - polynomial.nodes[i] * powers[j];
            }
            powers[0] = polynomial.coefficients[i] - polynomial.nodes[i] * powers[0];
        }
        window->base[k] = kf_turned(from + powers[0], bridge->turns == 0.0 ? 0.0 : bridge->raised[k]);
        for (j = 1; j < KF_WINDOW_TERMS; ++j) {
            window->c[j - 1][k] = powers[j];
        }
    }
}

/* Add the windows of the bridges on the path of a pose. */
static void collect(kf_segments *segments, const kf_solver *solver, const kf_pose *pose)
{
    const kf_singularity_map *const map = &KF_POOL(solver)->maps[pose->map < 0 ? 0 : pose->map];
    int i, k;
    for (k = 0; pose->map >= 0 && k < map->bridges && segments->window_count < KF_WINDOWS; ++k) {
        const kf_bridge *const bridge = &KF_POOL(solver)->bridges[map->bridge[k]];
        for (i = 0; i < segments->window_count && segments->windows[i].centre != bridge->centre; ++i) {
        }
        if (i == segments->window_count) {
            read_bridge(&segments->windows[i], bridge, &KF_POOL(solver)->spans[bridge->span]);
            ++segments->window_count;
        }
    }
}

static bool take_node(kf_segments *segments, kf_follower *follower, int64_t number, kf_node *node)
{
    const double u = node_place(segments, number);
    kf_pose *const pose = kf_followed(follower, &u);
    if (!KF_GOOD(pose->status)) {
        return false;
    }
    collect(segments, &follower->solver, pose);
    node->is_good = pose->status == KF_OK && pose->found.margin >= SURE;
#if KF_LAWS
    law_steps(&follower->solver.model, pose, node->steps);
#endif
    if (node->is_good) {
        kf_tangent(&follower->solver.model, pose);
        memcpy(node->z, pose->found.x, sizeof node->z);
        memcpy(node->zd, pose->x1, sizeof node->zd);
        memcpy(node->zdd, pose->x2, sizeof node->zdd);
    }
    return true;
}

/* The polynomial of degree 8 through value, slope and curvature at x = -1, 0, 1; past a change point the motion is as smooth
 * as elsewhere. half: of the width.
 *
 * before, after and so on: value, slope and curvature at either end that the terms from the third on must add; odd, even:
 * the parts of them that odd and even powers give.
 */
static void join(const kf_node *a, const kf_node *middle, const kf_node *b, double centre, double half, kf_segment *segment)
{
    double(*const c)[KF_ROOM(KF_UNKNOWNS)] = segment->c;
    int j, k;
    segment->is_plain = a->is_good && middle->is_good && b->is_good;
    segment->centre = centre;
    kf_sincos(centre, &segment->sine[KF_UNKNOWNS], &segment->cosine[KF_UNKNOWNS]);
    for (k = 0; k < KF_UNKNOWNS && segment->is_plain; ++k) {
        const double z = middle->z[k], v = middle->zd[k] * half, w = 0.5 * middle->zdd[k] * half * half;
        const double before = a->z[k] - z + v - w, after = b->z[k] - z - v - w;
        const double slope_before = a->zd[k] * half - v + 2.0 * w, slope_after = b->zd[k] * half - v - 2.0 * w;
        const double curve_before = a->zdd[k] * half * half - 2.0 * w, curve_after = b->zdd[k] * half * half - 2.0 * w;
        const double odd = 0.5 * (after - before), even = 0.5 * (after + before);
        const double odd_slope = 0.5 * (slope_after + slope_before), even_slope = 0.5 * (slope_after - slope_before);
        const double odd_curve = 0.5 * (curve_after - curve_before), even_curve = 0.5 * (curve_after + curve_before);
        double most = 0.0;
        segment->base[k] = z;
        kf_sincos(z, &segment->sine[k], &segment->cosine[k]);
        c[0][k] = v;
        c[1][k] = w;
        c[6][k] = (odd_curve - 7.0 * odd_slope + 15.0 * odd) / 8.0;
        c[4][k] = (odd_slope - 3.0 * odd) / 2.0 - 2.0 * c[6][k];
        c[2][k] = odd - c[4][k] - c[6][k];
        c[7][k] = (even_curve - 9.0 * even_slope + 24.0 * even) / 8.0;
        c[5][k] = (even_slope - 4.0 * even) / 2.0 - 2.0 * c[7][k];
        c[3][k] = even - c[5][k] - c[7][k];
        for (j = 0; j < KF_TERMS - 1; ++j) {
            most += fabs(c[j][k]);
        }
        segment->is_steep[k] = !(most <= STEEP);
    }
}

/* Follow nodes from the anchor in one direction, up to segment `last` or as far as poses can be reached; return
 * whether all can.
 * nodes: an array of four; afterwards its first and last items are the first and last nodes.
 */
static bool lay(kf_segments *segments, kf_follower *follower, int64_t last, kf_node nodes[4])
{
    const int64_t side = last >= 0 ? 1 : -1;
    int64_t number;
    kf_restart(follower);
    if (!take_node(segments, follower, 0, &nodes[0])) {
        return false;
    }
    nodes[3] = nodes[0];
    for (number = 0; number != last; number += side) {
        kf_segment *const segment = &segments->segments[(side > 0 ? number : number - 1) - segments->first];
        nodes[1] = nodes[3];
        if (!take_node(segments, follower, 2 * number + side, &nodes[2])
            || !take_node(segments, follower, 2 * number + 2 * side, &nodes[3])) {
            return false;
        }
        join(&nodes[side > 0 ? 1 : 3], &nodes[2], &nodes[side > 0 ? 3 : 1], node_place(segments, 2 * number + side),
             0.5 * segments->width, segment);
#if KF_LAWS
        segment->is_plain = segment->is_plain
            && sees_laws(segments, follower, segment, node_place(segments, 2 * number + 2 * side), nodes[3].steps,
                         steps_between(nodes[1].steps, nodes[2].steps) + steps_between(nodes[2].steps, nodes[3].steps));
#endif
    }
    return true;
}

static bool allocate(kf_segments *segments, int64_t first, int64_t last)
{
    segments->first = first;
    segments->count = last - first;
    segments->window_count = 0;
    free(segments->segments);
    segments->segments = calloc((size_t)segments->count, sizeof *segments->segments);
    return segments->segments != NULL;
}

/* Return whether the mechanism repeats after a turn of the driver, apart from whole turns of its angles. */
static bool is_repeated(kf_segments *segments, const kf_node *a, const kf_node *b)
{
    int k;
    if (!a->is_good || !b->is_good) {
        return false;
    }
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        const double turns = kf_unknown_is_angle[k] ? rint((b->z[k] - a->z[k]) / TURN) : 0.0;
        const double scale = kf_unknown_scales[k];
        segments->raised[k] = turns;
        if (!(fabs(b->z[k] - a->z[k] - turns * TURN) <= SAME * scale)
            || !(fabs(b->zd[k] - a->zd[k]) <= 1e3 * SAME * scale)) {
            return false;
        }
    }
    return true;
}

/* Extend a range by driver values; NaN is left out. */
static void extend(int64_t count, const double *u, double *low, double *high)
{
    double lows[KF_VECTOR], highs[KF_VECTOR];
    int64_t k;
    int i;
    for (i = 0; i < KF_VECTOR; ++i) {
        lows[i] = *low;
        highs[i] = *high;
    }
    for (k = 0; k + KF_VECTOR <= count; k += KF_VECTOR) {
        for (i = 0; i < KF_VECTOR; ++i) {
            lows[i] = u[k + i] < lows[i] ? u[k + i] : lows[i];
            highs[i] = u[k + i] > highs[i] ? u[k + i] : highs[i];
        }
    }
    for (; k < count; ++k) {
        lows[0] = u[k] < lows[0] ? u[k] : lows[0];
        highs[0] = u[k] > highs[0] ? u[k] : highs[0];
    }
    *low = lows[0];
    *high = highs[0];
    for (i = 1; i < KF_VECTOR; ++i) {
        *low = lows[i] < *low ? lows[i] : *low;
        *high = highs[i] > *high ? highs[i] : *high;
    }
}

#if KF_LOOKS_UP

/* Store the segments of a turn number by number; not if an angle is steep in one of them. */
static void list_segments(kf_segments *segments)
{
    int i, j, k;
    segments->is_listed = segments->repeats;
    for (i = 0; i < KF_SEGMENTS && segments->is_listed; ++i) {
        const kf_segment *const segment = &segments->segments[i];
        segments->listed_driver[0][i] = segment->centre;
        segments->listed_driver[1][i] = segment->sine[KF_UNKNOWNS];
        segments->listed_driver[2][i] = segment->cosine[KF_UNKNOWNS];
        segments->is_plain = (i == 0 || segments->is_plain) && segment->is_plain;
        for (k = 0; k < KF_UNKNOWNS; ++k) {
            double(*const to)[KF_SEGMENTS] = segments->listed[k];
            for (j = 0; j < KF_TERMS - 1; ++j) {
                to[j][i] = segment->c[j][k];
            }
            to[KF_TERMS - 1][i] = segment->base[k];
            to[KF_TERMS][i] = segment->sine[k];
            to[KF_TERMS + 1][i] = segment->cosine[k];
            segments->is_listed = segments->is_listed && !segment->is_steep[k];
        }
    }
}

#endif

bool kf_segments_lay(kf_segments *segments, kf_follower *follower, int64_t count, const double *u)
{
    const double width = TURN / KF_SEGMENTS * kf_reach[0];
    const double most = fmin(floor(MOST_MEMORY / sizeof *segments->segments), KF_FARTHEST * kf_reach[0] / width);
    kf_node *const nodes = malloc(4 * sizeof *nodes);
    const double begin = kf_anchor_u[0];
    double low = begin, high = begin;
    int64_t seen = 0;
    bool done = nodes != NULL, is_long = false;
    segments->width = width;
    segments->repeats = false;
    while (seen < count && done && !segments->repeats) { /* as a rule the first values show that there is more than a turn */
        const int64_t more = KF_REPEATS && kf_driver_is_angle[0] && !is_long && count - seen > AT_ONCE ? AT_ONCE : count - seen;
        extend(more, u + seen, &low, &high);
        seen += more;
        if (!is_long && (high - begin) / width - (low - begin) / width > KF_SEGMENTS) {
            is_long = true;
            segments->repeats = KF_REPEATS && kf_driver_is_angle[0] && allocate(segments, 0, KF_SEGMENTS)
                && lay(segments, follower, KF_SEGMENTS, nodes) && is_repeated(segments, &nodes[0], &nodes[3]);
        }
    }
    if (done && !segments->repeats) {
        low = (low - begin) / width;
        high = (high - begin) / width;
        low = floor(fmax(low, -most));
        high = ceil(fmin(high, most));
        done = allocate(segments, (int64_t)low, (int64_t)(high > low ? high : low + 1.0));
        if (done) {
            lay(segments, follower, (int64_t)high, nodes);
            lay(segments, follower, (int64_t)low, nodes);
        }
    }
#if KF_LOOKS_UP
    list_segments(segments);
#endif
    kf_restart(follower);
    free(nodes);
    return done;
}

void kf_segments_free(kf_segments *segments)
{
    free(segments->segments);
}

double kf_turns_after(const kf_segments *segments, double u)
{
    return segments->repeats && fabs(u) < KF_FARTHEST * kf_reach[0] ? floor((u - kf_anchor_u[0]) / TURN) : 0.0;
}

/* Predict lanes from..to (excluded), all in one segment, KF_VECTOR at a time; lanes past the last one are overwritten. */
static void predict_within(const kf_segments *segments, const kf_segment *segment, double turns, const double *u, int from,
                           int to, kf_lanes *lanes)
{
    const double per_half = 2.0 / segments->width, high = turns * HIGH, low = turns * LOW, centre = segment->centre;
    const double of_centre[2] = {segment->sine[KF_UNKNOWNS], segment->cosine[KF_UNKNOWNS]};
    double x[KF_LANES + KF_VECTOR], step[KF_VECTOR];
    int at, i, k;
    for (at = from; at < to; at += KF_VECTOR) {
        double *const sine = lanes->angles[0][KF_UNKNOWNS] + at, *const cosine = lanes->angles[1][KF_UNKNOWNS] + at;
        KF_SIDE_BY_SIDE
        for (i = 0; i < KF_VECTOR; ++i) {
            step[i] = u[at + i] - high - centre - low;
            x[at - from + i] = step[i] * per_half;
            if (kf_driver_is_angle[0]) {
                kf_turn(step[i], of_centre[0], of_centre[1], &sine[i], &cosine[i]);
            }
        }
    }
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        const double c0 = segment->c[0][k], c1 = segment->c[1][k], c2 = segment->c[2][k], c3 = segment->c[3][k];
        const double c4 = segment->c[4][k], c5 = segment->c[5][k], c6 = segment->c[6][k], c7 = segment->c[7][k];
        const double base = turns == 0.0 ? segment->base[k] : kf_turned(segment->base[k], turns * segments->raised[k]);
        const double s = segment->sine[k], c = segment->cosine[k];
        const bool is_turned = kf_unknown_is_angle[k] && !segment->is_steep[k];
        double *const z = lanes->z[k], *const sine = lanes->angles[0][k], *const cosine = lanes->angles[1][k];
        for (at = from; at < to; at += KF_VECTOR) {
            KF_SIDE_BY_SIDE
            for (i = 0; i < KF_VECTOR; ++i) {
                const double p = x[at - from + i];
                step[i] = p * KF_FMA(p, KF_FMA(p, KF_FMA(p, KF_FMA(p, KF_FMA(p, KF_FMA(p, KF_FMA(p, c7, c6), c5), c4), c3),
                    c2), c1), c0);
                z[at + i] = base + step[i];
            }
            if (is_turned) {
                KF_SIDE_BY_SIDE
                for (i = 0; i < KF_VECTOR; ++i) {
                    kf_turn(step[i], s, c, &sine[at + i], &cosine[at + i]);
                }
            } else if (kf_unknown_is_angle[k]) {
                KF_SIDE_BY_SIDE
                for (i = 0; i < KF_VECTOR; ++i) {
                    kf_sincos_lane(z[at + i], &sine[at + i], &cosine[at + i]);
                }
            }
        }
    }
}

#if KF_LOOKS_UP

#define MOST_PIECES 5 /* of lanes in one segment; with more, looking up is faster */

typedef double kf_numbers __attribute__((vector_size(64)));
typedef int64_t kf_places __attribute__((vector_size(64)));

/* Look up the numbers of KF_VECTOR segments. */
static inline void look_up(const double *table, kf_places segment, double *numbers)
{
    kf_numbers low, high;
    memcpy(&low, table, sizeof low);
    memcpy(&high, table + KF_VECTOR, sizeof high);
    low = __builtin_shuffle(low, high, segment);
    memcpy(numbers, &low, sizeof low);
}

/* Predict all lanes, each in its segment; number: of the segment, counted over all turns. As predict_within does it. */
static void predict_listed(const kf_segments *segments, const double *u, const double *number, kf_lanes *lanes, int32_t *alone)
{
    const double per_half = 2.0 / segments->width;
    double of[KF_TERMS + 2][KF_VECTOR], turns[KF_LANES], x[KF_VECTOR], step[KF_VECTOR];
    int64_t segment[KF_LANES];
    int at, i, j, k;
    KF_SIDE_BY_SIDE
    for (i = 0; i < KF_LANES; ++i) {
        turns[i] = __builtin_floor(number[i] / KF_SEGMENTS);
        segment[i] = (int64_t)(number[i] - KF_SEGMENTS * turns[i]);
    }
    for (i = 0; i < KF_LANES && !segments->is_plain; ++i) {
        alone[i] |= !segments->segments[segment[i]].is_plain;
    }
    for (at = 0; at < KF_LANES; at += KF_VECTOR) {
        double *sine = lanes->angles[0][KF_UNKNOWNS] + at, *cosine = lanes->angles[1][KF_UNKNOWNS] + at;
        kf_numbers whole;
        kf_places places;
        memcpy(&places, segment + at, sizeof places);
        memcpy(&whole, turns + at, sizeof whole);
        for (j = 0; j < 3; ++j) {
            look_up(segments->listed_driver[j], places, of[j]);
        }
        KF_SIDE_BY_SIDE
        for (i = 0; i < KF_VECTOR; ++i) {
            step[i] = u[at + i] - turns[at + i] * HIGH - of[0][i] - turns[at + i] * LOW;
            x[i] = step[i] * per_half;
            kf_turn(step[i], of[1][i], of[2][i], &sine[i], &cosine[i]);
        }
        for (k = 0; k < KF_UNKNOWNS; ++k) {
            const kf_numbers raised = whole * segments->raised[k];
            double *const z = lanes->z[k] + at;
            kf_numbers base;
            kf_places chosen = whole == 0.0;
            for (j = 0; j < KF_TERMS + 2; ++j) {
                look_up(segments->listed[k][j], places, of[j]);
            }
            memcpy(&base, of[KF_TERMS - 1], sizeof base);
            chosen = ((kf_places)base & chosen) | ((kf_places)(base + raised * HIGH + raised * LOW) & ~chosen);
            memcpy(of[KF_TERMS - 1], &chosen, sizeof chosen);
            sine = lanes->angles[0][k] + at;
            cosine = lanes->angles[1][k] + at;
            KF_SIDE_BY_SIDE
            for (i = 0; i < KF_VECTOR; ++i) {
                const double p = x[i];
                step[i] = p * KF_FMA(p, KF_FMA(p, KF_FMA(p, KF_FMA(p, KF_FMA(p, KF_FMA(p, KF_FMA(p, of[7][i], of[6][i]),
                    of[5][i]), of[4][i]), of[3][i]), of[2][i]), of[1][i]), of[0][i]);
                z[i] = of[KF_TERMS - 1][i] + step[i];
                if (kf_unknown_is_angle[k]) {
                    kf_turn(step[i], of[KF_TERMS][i], of[KF_TERMS + 1][i], &sine[i], &cosine[i]);
                }
            }
        }
    }
}

#endif

void kf_predict(const kf_segments *segments, const double *u, kf_lanes *lanes, int32_t *alone)
{
    const double begin = kf_anchor_u[0] + (double)segments->first * segments->width;
    const double per_width = 1.0 / segments->width, farthest = KF_FARTHEST * kf_reach[0];
    const double last = segments->repeats ? INFINITY : (double)segments->count;
    const double least = segments->repeats ? -INFINITY : 0.0;
    const double end = segments->has_end ? last + ROUNDED : -INFINITY;
    double own[KF_LANES + KF_VECTOR], number[KF_LANES + 1];
    uint64_t bits[KF_LANES], ends = 0; /* bits of the last lanes of pieces: lanes in one segment, one after another */
    int from = 0, i;
    KF_SIDE_BY_SIDE
    for (i = 0; i < KF_LANES; ++i) {
        const double exact = (u[i] - begin) * per_width, place = __builtin_floor(exact);
        const bool is_before = place < last, is_end = exact <= end;
        const bool is_within = (place >= least) & (is_before | is_end) & (fabs(u[i]) < farthest);
        own[i] = u[i];
        alone[i] = !is_within;
        bits[i] = (uint64_t)1 << i;
        number[i] = !is_within ? 0.0 : is_before ? place : last - 1.0;
    }
    for (i = KF_LANES; i < KF_LANES + KF_VECTOR; ++i) {
        own[i] = 0.0;
    }
    number[KF_LANES] = NAN;
    for (i = 0; i < KF_LANES; ++i) {
        ends |= number[i] == number[i + 1] ? 0 : bits[i];
    }
#if KF_LOOKS_UP
    if (segments->is_listed && __builtin_popcountll(ends) > MOST_PIECES) {
        predict_listed(segments, u, number, lanes, alone);
        return;
    }
#endif
    for (; ends != 0; ends &= ends - 1) {
        const int end = __builtin_ctzll(ends) + 1;
        const double turns = segments->repeats ? floor(number[from] / KF_SEGMENTS) : 0.0;
        const kf_segment *const segment = &segments->segments[(int64_t)(number[from] - KF_SEGMENTS * turns)];
        for (i = from; i < end && !segment->is_plain; ++i) {
            alone[i] = 1;
        }
        predict_within(segments, segment, turns, own, from, end, lanes);
        from = end;
    }
}

void kf_window_read(const kf_segments *segments, const kf_window *window, const double *u, const double *turns,
                    kf_lanes *lanes)
{
    const double *const ud = lanes->x1[KF_COORDINATES - 1], *const udd = lanes->x2[KF_COORDINATES - 1];
    const double per_half = 1.0 / window->half;
    int i, j, k;
    for (i = 0; i < KF_LANES; ++i) {
        kf_sincos_lane(u[i], &lanes->angles[0][KF_UNKNOWNS][i], &lanes->angles[1][KF_UNKNOWNS][i]);
    }
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        KF_SIDE_BY_SIDE
        for (i = 0; i < KF_LANES; ++i) {
            const double x = (u[i] - window->centre) * per_half;
            double z = 0.0, zd = 0.0, zdd = 0.0;
            for (j = KF_WINDOW_TERMS - 2; j >= 0; --j) {
                zdd = zdd * x + 2.0 * zd;
                zd = zd * x + z;
                z = z * x + window->c[j][k];
            }
            zdd = zdd * x + 2.0 * zd;
            zd = (zd * x + z) * per_half;
            zdd *= per_half * per_half;
            z = window->base[k] + z * x;
            kf_sincos_lane(z, &lanes->angles[0][k][i], &lanes->angles[1][k][i]);
            z += turns[i] * segments->raised[k] * HIGH + turns[i] * segments->raised[k] * LOW;
            lanes->z[k][i] = z;
            lanes->x[k][i] = z;
            lanes->x1[k][i] = zd * ud[i];
            lanes->x2[k][i] = zdd * ud[i] * ud[i] + zd * udd[i];
        }
    }
}

#endif
