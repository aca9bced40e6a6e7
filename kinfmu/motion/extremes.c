/* Extremes of the quantities of one design, read off its samples as soon as they are solved; see extremes.py.
 *
 * What they are of is a channel: a quantity or a derivative of it, or the size of the velocity or acceleration of a point, in
 * a part of the motion. The arithmetic is that of history.py and samples.py.
 */
#include "quintic.c"

#include <string.h>

#define SAME_POSE 1e-9  /* [rad, sizes]; as in samples.py */
#define SAME_RATE 1e-6  /* of the largest; the same */
#define LEVEL 0.382     /* of the range; as in history.py */
#define REPEATED 1e-6   /* of the range; the same */
#define NO_LENGTH 1e-100 /* as in taylor.py */
#define TURN 6.283185307179586
#define LAST_GOOD 2     /* largest status of a sample with numbers */
#define FOUND 7         /* numbers of a channel: minimum and its place, maximum and its place, first, last, repeats */

/* A part of the motion between two values of the driver. count: of its samples x, h apart; 0: the motion does not reach its
 * ends. Intervals and samples are counted on into the next period: those in which it begins and ends, and where in them, and
 * the first one that is wholly inside.
 */
typedef struct {
    int64_t count, inside, intervals[2];
    double s[2];
    const double *x, *h;
} kf_part;

/* other: column of the second component of a vector; -1: none. parts: if the motion does not go round, and if it does; NULL:
 * all of it. found: (designs, FOUND).
 */
typedef struct {
    int64_t column, other, order, group;
    const kf_part *parts;
    double *found;
} kf_channel;

/* columns: (columns, count) values, rates and accelerations of a design. weights: of third and fourth derivatives, if the
 * motion does not go round, and if it does. members: (groups, columns) columns that go round together, goes_round: (designs,
 * groups) whether they do. worst: status; missing: samples without numbers, and the first of them (designs, 2). ranges:
 * (columns, 3) of the rows; memory: (2 columns + 9, count).
 */
typedef struct {
    double low, high; /* NaN where a number is not finite */
} kf_range;

typedef struct {
    int64_t count, columns, channels, groups;
    const double *x, *h, *rows[3], *weights[2][2];
    const uint8_t *is_angle, *members;
    const kf_channel *channel;
    uint8_t *goes_round;
    int32_t *worst, *missing;
    kf_range (*ranges)[3];
    double *memory;
} kf_extremes;

/* is_known: all numbers are finite. range: of the values. */
typedef struct {
    const double *f, *v, *a;
    bool is_known;
    kf_range range;
} kf_rows;

/* Smallest and largest number, their places, and the same between the samples; NaN if a number is not finite. */
static void both_extremes(const kf_rows *rows, int64_t count, const double *x, const double *h, double found[4])
{
    enum { MOST = 64, AT_ONCE = 32 };
    const double *const f = rows->f, *const v = rows->v, *const a = rows->a;
    int64_t marked[2][MOST], number[2] = {0, 0}, k, i;
    const double ends[2] = {rows->range.low, rows->range.high};
    int side, half;
    if (!rows->is_known) {
        found[0] = found[1] = found[2] = found[3] = NAN;
        return;
    }
    for (k = 0; k + 1 < count; k += AT_ONCE) {
        const int64_t end = k + AT_ONCE < count - 1 ? k + AT_ONCE : count - 1;
        double lows[AT_ONCE], highs[AT_ONCE];
        int64_t any = 0;
        for (i = k; i < end; ++i) {
            const double c0 = h[i] * v[i] * 0.2, c5 = h[i] * v[i + 1] * 0.2, c1 = f[i] + c0, c4 = f[i + 1] - c5;
            const double c2 = c1 + c0 + h[i] * h[i] * a[i] * 0.05, c3 = c4 - c5 + h[i] * h[i] * a[i + 1] * 0.05;
            const double left = c1 > c2 ? c1 : c2, right = c3 > c4 ? c3 : c4;
            const double left_low = c1 < c2 ? c1 : c2, right_low = c3 < c4 ? c3 : c4;
            highs[i - k] = left > right ? left : right;
            lows[i - k] = left_low < right_low ? left_low : right_low;
        }
        for (i = k; i < end; ++i) {
            any |= (lows[i - k] < ends[0]) | (highs[i - k] > ends[1]);
        }
        for (i = k; i < end && any != 0; ++i) {
            for (side = 0; side < 2; ++side) {
                if (side == 0 ? lows[i - k] < ends[0] : highs[i - k] > ends[1]) {
                    if (number[side] < MOST) {
                        marked[side][number[side]] = i;
                    }
                    ++number[side];
                }
            }
        }
    }
    for (side = 0; side < 2; ++side) {
        const kf_quantity of = {f, v, a, side == 0 ? -1.0 : 1.0};
        const int64_t visits = number[side] <= MOST ? number[side] : count - 1; /* too many to list: all are visited */
        double value = of.sign * ends[side];
        for (k = 0; f[k] != ends[side]; ++k) {
        }
        found[2 * side + 1] = x[k];
        for (half = 0; half < 2; ++half) {
            const double before = value;
            for (k = 0; k < visits; ++k) {
                visit(&of, number[side] <= MOST ? marked[side][k] : k, half, x, h, before, &value, &found[2 * side + 1]);
            }
        }
        found[2 * side] = of.sign * value;
    }
}

/* Whether the columns of a group go round: values, rates and accelerations of the last sample are those of the first. */
static bool goes_round(const kf_extremes *of, const uint8_t *members)
{
    bool is_same = true, moves = false;
    int64_t k;
    int order, angle;
    for (order = 0; order < 3 && is_same; ++order) {
        double scales[2] = {1e-300, 1e-300}, apart[2] = {0.0, 0.0};
        for (k = 0; k < of->columns && is_same; ++k) {
            const double *const row = of->rows[order] + k * of->count;
            const double low = of->ranges[k][order].low, high = of->ranges[k][order].high;
            double difference, size;
            if (!members[k]) {
                continue;
            }
            angle = of->is_angle[k];
            is_same = low <= high; /* both are NaN where a sample has no numbers */
            difference = row[of->count - 1] - row[0];
            if (order == 0) {
                moves |= high > low;
                difference -= angle ? TURN * nearbyint(difference / TURN) : 0.0;
            }
            size = order == 0 ? high - low : high > -low ? high : -low;
            scales[angle] = size > scales[angle] ? size : scales[angle];
            apart[angle] = fabs(difference) > apart[angle] ? fabs(difference) : apart[angle];
        }
        for (angle = 0; angle < 2; ++angle) {
            is_same = is_same && apart[angle] <= (order ? SAME_RATE * scales[angle] : SAME_POSE * (angle ? 1.0 : scales[0]));
        }
    }
    return is_same && moves;
}

static bool is_known(const kf_range *range)
{
    return range->low <= range->high;
}

/* Rows and what is known of them. */
static kf_rows looked_at(const double *f, const double *v, const double *a, int64_t count)
{
    kf_rows rows = {f, v, a, false, {NAN, NAN}};
    range(f, count, &rows.range.low, &rows.range.high);
    rows.is_known = is_known(&rows.range) && is_finite(v, count) && is_finite(a, count);
    return rows;
}

/* The smallest and the largest values of quantities, (designs, count) with a step from design to design, and their places:
 * (designs, 4), as both_extremes finds them.
 */
void kf_both_extremes(int64_t designs, int64_t count, const double *x, const double *h, const double *f, ptrdiff_t f_step,
                      const double *v, ptrdiff_t v_step, const double *a, ptrdiff_t a_step, double *found)
{
    int64_t k;
    for (k = 0; k < designs; ++k, f += f_step, v += v_step, a += a_step, found += 4) {
        const kf_rows rows = looked_at(f, v, a, count);
        both_extremes(&rows, count, x, h, found);
    }
}

/* Values, rates and accelerations of a column, or of its first or second derivative, whose own are estimated. */
static kf_rows rows_of(const kf_extremes *of, int64_t column, int64_t order, bool is_closed)
{
    const int64_t n = of->count;
    const kf_range *const ranges = of->ranges[column];
    const double *rows[5];
    kf_rows found;
    int k;
    for (k = 0; k < 3; ++k) {
        rows[k] = of->rows[k] + column * n;
    }
    for (k = 0; k < 2; ++k) {
        rows[3 + k] = of->memory + (2 * column + k) * n;
    }
    if (order > 0) {
        kf_higher(1, n, is_closed, of->weights[is_closed][0], of->weights[is_closed][1], rows[0], 0, rows[1], 0, rows[2], 0,
                  (double *)rows[3], (double *)rows[4]);
    }
    found = (kf_rows){rows[order], rows[order + 1], rows[order + 2], is_known(&ranges[order]), ranges[order]};
    for (k = (int)order + 1; k < order + 3; ++k) {
        found.is_known = found.is_known && (k < 3 ? is_known(&ranges[k]) : is_finite(rows[k], n));
    }
    return found;
}

/* The size of a vector and its derivatives, in the memory after that of the columns. */
static kf_rows size_of(const kf_extremes *of, const kf_rows *x, const kf_rows *y)
{
    double *const f = of->memory + 2 * of->columns * of->count, *const v = f + of->count, *const a = v + of->count;
    int64_t k;
    for (k = 0; k < of->count; ++k) {
        const double square = x->f[k] * x->f[k] + y->f[k] * y->f[k], rate = 2.0 * (x->f[k] * x->v[k] + y->f[k] * y->v[k]);
        const double bend = 2.0 * (x->v[k] * x->v[k] + x->f[k] * x->a[k] + y->v[k] * y->v[k] + y->f[k] * y->a[k]);
        const double root = sqrt(square), slope = 0.5 / (root == 0.0 ? NO_LENGTH : root);
        f[k] = root;
        v[k] = slope * rate;
        a[k] = slope * bend - 2.0 * slope * slope * slope * (rate * rate);
    }
    return looked_at(f, v, a, of->count);
}

/* A number of a sample, counted on into the next period, which is a turn further. */
static double later(const double *row, int64_t count, int64_t k, double turn)
{
    return k < count ? row[k] : row[k - count + 1] + turn;
}

/* Value, rate and acceleration at a place of an interval. */
static void read_at(const kf_rows *rows, int64_t count, int64_t k, double turn, double h, double s, double found[3])
{
    const double f[2] = {later(rows->f, count, k, turn), later(rows->f, count, k + 1, turn)};
    const double v[2] = {later(rows->v, count, k, 0.0), later(rows->v, count, k + 1, 0.0)};
    const double a[2] = {later(rows->a, count, k, 0.0), later(rows->a, count, k + 1, 0.0)};
    const kf_quantity of = {f, v, a, 1.0};
    double c[6], slope[5], bend[4];
    take(&of, 0, h, c, slope);
    derive(slope, 5, bend);
    found[0] = polynomial(c, 6, s);
    found[1] = polynomial(slope, 5, s) / h;
    found[2] = polynomial(bend, 4, s) / (h * h);
}

/* The rows of a part, in the last memory. */
static kf_rows part_of(const kf_extremes *of, const kf_part *part, const kf_rows *rows, bool is_closed)
{
    const int64_t n = of->count, last = part->count - 1, before = n - part->inside, here = before < last - 1 ? before : last - 1;
    const double turn = is_closed ? rows->f[n - 1] - rows->f[0] : 0.0;
    double *const f = of->memory + (2 * of->columns + 3) * n, *to[3] = {f, f + 2 * n, f + 4 * n}, ends[2][3];
    const double *const from[3] = {rows->f, rows->v, rows->a};
    int64_t k;
    int order, side;
    for (side = 0; side < 2; ++side) {
        read_at(rows, n, part->intervals[side], turn, of->h[part->intervals[side] % (n - 1)], part->s[side], ends[side]);
    }
    for (order = 0; order < 3; ++order) {
        if (here > 0) {
            memcpy(to[order] + 1, from[order] + part->inside, (size_t)here * sizeof(double));
        }
        for (k = here > 0 ? here : 0; k < last - 1; ++k) {
            to[order][k + 1] = later(from[order], n, part->inside + k, order == 0 ? turn : 0.0);
        }
        to[order][0] = ends[0][order];
        to[order][last] = ends[1][order];
    }
    return looked_at(to[0], to[1], to[2], part->count);
}

/* How many times a quantity that goes round repeats on the way. See History.repeats. */
static int64_t repeats(const kf_extremes *of, const kf_rows *rows, double low, double high)
{
    const int64_t n = of->count;
    const double *const f = rows->f, least = rows->range.low, most = rows->range.high;
    const double level = low + LEVEL * (high - low), span = of->x[n - 1] - of->x[0];
    int64_t rises = (f[0] >= level) & !(f[n - 2] >= level), count, k, place;
    for (k = 1; k + 1 < n; ++k) {
        rises += (f[k] >= level) & (f[k - 1] < level);
    }
    for (count = rises; count > 1; --count) {
        bool is_same = rises % count == 0;
        for (k = 0, place = 0; k < n && is_same; ++k) {
            double x = of->x[k] + span / (double)count, found[3];
            x = x > of->x[n - 1] ? x - span : x;
            place = x < of->x[place] ? 0 : place;
            while (place < n - 2 && of->x[place + 1] <= x) {
                ++place;
            }
            read_at(rows, n, place, 0.0, of->h[place], (x - of->x[place]) / of->h[place], found);
            is_same = fabs(found[0] - f[k]) <= REPEATED * (most - least);
        }
        if (is_same) {
            return count;
        }
    }
    return 1;
}

/* Read all channels of a design off its samples, which have these statuses. */
void kf_read_extremes(const kf_extremes *of, int64_t design, const int32_t *status)
{
    const int64_t n = of->count;
    uint8_t *const is_closed = of->goes_round + design * of->groups;
    int32_t *const missing = of->missing + 2 * design;
    int32_t worst = 0;
    int64_t k;
    int order;
    for (k = 0; k < n; ++k) {
        worst = status[k] > worst ? status[k] : worst;
    }
    of->worst[design] = worst;
    missing[0] = missing[1] = 0;
    for (k = worst > LAST_GOOD ? n - 1 : -1; k >= 0; --k) {
        if (status[k] > LAST_GOOD) {
            ++missing[0];
            missing[1] = (int32_t)k;
        }
    }
    for (k = 0; k < of->columns; ++k) {
        for (order = 0; order < 3; ++order) {
            range(of->rows[order] + k * n, n, &of->ranges[k][order].low, &of->ranges[k][order].high);
        }
    }
    for (k = 0; k < of->groups; ++k) {
        is_closed[k] = goes_round(of, of->members + k * of->columns);
    }
    for (k = 0; k < of->channels; ++k) {
        const kf_channel *const channel = &of->channel[k];
        const bool closed = is_closed[channel->group] != 0;
        double *const found = channel->found + design * FOUND;
        kf_rows rows = rows_of(of, channel->column, channel->order, closed);
        if (channel->other >= 0) {
            const kf_rows other = rows_of(of, channel->other, channel->order, closed);
            rows = size_of(of, &rows, &other);
        }
        found[4] = rows.f[0];
        found[5] = rows.f[n - 1];
        found[6] = 1.0;
        if (channel->parts == NULL) {
            both_extremes(&rows, n, of->x, of->h, found);
            found[6] = closed ? (double)repeats(of, &rows, found[0], found[2]) : 1.0;
        } else if (channel->parts[closed].count > 0) {
            const kf_part *const part = &channel->parts[closed];
            rows = part_of(of, part, &rows, closed);
            both_extremes(&rows, part->count, part->x, part->h, found);
        } else {
            found[0] = found[1] = found[2] = found[3] = NAN;
        }
    }
}
