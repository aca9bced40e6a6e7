/* Extremes and higher derivatives of quantities between samples: the arithmetic of quintic.py, operation by operation. */
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define STEPS 60    /* of a root in its interval */
#define SAME 1e-15  /* of an interval; roots closer than this are equal */
#define VECTOR 32   /* numbers side by side; loops over fewer are unrolled, not laid side by side */

static double polynomial(const double *c, int terms, double s)
{
    double value = c[terms - 1];
    int k;
    for (k = terms - 2; k >= 0; --k) {
        value = value * s + c[k];
    }
    return value;
}

static void derive(const double *c, int terms, double *derived)
{
    int k;
    for (k = 1; k < terms; ++k) {
        derived[k - 1] = c[k] * (double)k;
    }
}

/* A root between two arguments of opposite signs: by Newton, else by halving. */
static double root(const double *c, int terms, double low, double high)
{
    const bool is_rising = polynomial(c, terms, high) > polynomial(c, terms, low);
    double c1[5], s = 0.5 * (low + high);
    int k;
    derive(c, terms, c1);
    for (k = 0; k < STEPS; ++k) {
        const double value = polynomial(c, terms, s), slope = polynomial(c1, terms - 1, s), old = s;
        const double step = s - value / (slope == 0.0 ? INFINITY : slope);
        if ((value < 0.0) == is_rising) {
            low = s;
        } else {
            high = s;
        }
        s = step >= low && step <= high ? step : 0.5 * (low + high);
        if (fabs(s - old) <= SAME) {
            break;
        }
    }
    return s;
}

/* A quantity in one design: value, rate and acceleration at the samples, of which the sign may be changed. */
typedef struct {
    const double *f, *v, *a;
    double sign;
} kf_quantity;

/* The polynomial of interval k, and its slope. */
static void take(const kf_quantity *of, int64_t k, double h, double c[6], double slope[5])
{
    const double f = of->sign * of->f[k], v = of->sign * of->v[k] * h, a = of->sign * of->a[k] * h * h;
    const double df = of->sign * of->f[k + 1] - f - v - 0.5 * a;
    const double dv = of->sign * of->v[k + 1] * h - v - a;
    const double da = of->sign * of->a[k + 1] * h * h - a;
    c[0] = f;
    c[1] = v;
    c[2] = 0.5 * a;
    c[3] = 10.0 * df - 4.0 * dv + 0.5 * da;
    c[4] = -15.0 * df + 7.0 * dv - da;
    c[5] = 6.0 * df - 3.0 * dv + 0.5 * da;
    derive(c, 6, slope);
}

/* Where to cut the interval, so that the slope changes its sign at most once on either side. */
static double cut_of(const double slope[5])
{
    double curve[4];
    if (polynomial(slope, 5, 0.0) * polynomial(slope, 5, 1.0) < 0.0) {
        return 1.0;
    }
    derive(slope, 5, curve);
    return polynomial(curve, 4, 0.0) * polynomial(curve, 4, 1.0) < 0.0 ? root(curve, 4, 0.0, 1.0) : 0.5;
}

/* Where a loop over VECTOR numbers at a time begins, after one at k: the last time it ends with the last number. */
static int64_t following(int64_t k, int64_t count)
{
    return k + 2 * VECTOR <= count || k + VECTOR == count ? k + VECTOR : count - VECTOR;
}

/* The smallest and the largest of some numbers; both NaN if one of them is not finite. */
static void range(const double *numbers, int64_t count, double *low, double *high)
{
    double lows[VECTOR], highs[VECTOR], zeros[VECTOR] = {0.0}, all = 0.0; /* 0 times a number, NaN if it is not finite */
    const int64_t width = count < VECTOR ? count : VECTOR;
    int64_t k, i, half;
    for (i = 0; i < VECTOR; ++i) {
        lows[i] = highs[i] = numbers[0];
    }
    for (k = 0; k + VECTOR <= count; k = following(k, count)) {
        for (i = 0; i < VECTOR; ++i) {
            const double one = numbers[k + i];
            lows[i] = one < lows[i] ? one : lows[i];
            highs[i] = one > highs[i] ? one : highs[i];
            zeros[i] += 0.0 * one;
        }
    }
    for (i = 0; i < width && count < VECTOR; ++i) {
        lows[i] = highs[i] = numbers[i];
        zeros[i] = 0.0 * numbers[i];
    }
    *low = lows[0];
    *high = highs[0];
    for (half = count < VECTOR ? 0 : VECTOR / 2; half >= 8; half /= 2) { /* shorter chains of numbers that wait for each other */
        for (i = 0; i < half; ++i) {
            lows[i] = lows[half + i] < lows[i] ? lows[half + i] : lows[i];
            highs[i] = highs[half + i] > highs[i] ? highs[half + i] : highs[i];
            zeros[i] += zeros[half + i];
        }
    }
    for (i = 0; i < (width == VECTOR ? 8 : width); ++i) {
        *low = lows[i] < *low ? lows[i] : *low;
        *high = highs[i] > *high ? highs[i] : *high;
        all += zeros[i];
    }
    if (all != 0.0) {
        *low = *high = NAN;
    }
}

static bool is_finite(const double *numbers, int64_t count)
{
    double low, high;
    range(numbers, count, &low, &high);
    return low <= high;
}

/* Keep the largest value in one half of interval i, if it exceeds that before; the slope changes its sign once there. */
static void visit(const kf_quantity *of, int64_t i, int half, const double *x, const double *h, double before, double *value,
                  double *at)
{
    double c[6], slope[5], cut, begin, end, s, here;
    take(of, i, h[i], c, slope);
    cut = cut_of(slope);
    begin = half == 0 ? 0.0 : cut;
    end = half == 0 ? cut : 1.0;
    if (!(polynomial(slope, 5, begin) > 0.0 && polynomial(slope, 5, end) < 0.0)) {
        return;
    }
    s = root(slope, 5, begin, end);
    here = polynomial(c, 6, s);
    if (here > before && here >= *value) {
        *value = here;
        *at = x[i] + s * h[i];
    }
}

/* The smallest and the largest number of each design, of a table (designs, count) with a step from design to design. */
void kf_ranges(int64_t designs, int64_t count, const double *table, ptrdiff_t step, double *low, double *high)
{
    int64_t k;
    for (k = 0; k < designs; ++k) {
        range(table + k * step, count, &low[k], &high[k]);
    }
}

/* A weighted sum of the numbers of three samples: k, and those before and after it in `near` and `far`. */
static inline double weighted(const double *w, int64_t n, int64_t k, const double *v, const double *a, double near_change,
                       int64_t near, double far_change, int64_t far)
{
    return w[k] * v[k] + w[n + k] * a[k] + w[2 * n + k] * near_change + w[3 * n + k] * v[near] + w[4 * n + k] * a[near]
        + w[5 * n + k] * far_change + w[6 * n + k] * v[far] + w[7 * n + k] * a[far];
}

/* Third and fourth derivatives, (designs, count) without gaps, with weights (8, count). */
void kf_higher(int64_t designs, int64_t count, bool is_closed, const double *w3, const double *w4, const double *f,
               ptrdiff_t f_step, const double *v, ptrdiff_t v_step, const double *a, ptrdiff_t a_step, double *restrict third,
               double *restrict fourth)
{
    const int64_t last = count - 1;
    int64_t design, k;
    for (design = 0; design < designs; ++design, f += f_step, v += v_step, a += a_step, third += count, fourth += count) {
        const double turn = is_closed ? f[last] - f[0] : 0.0;
        const int64_t before = is_closed ? last - 1 : 2, after = is_closed ? 1 : last - 2;
        const double first[2] = {f[before] - f[0] + -1.0 * turn, f[1] - f[0]};
        const double end[2] = {f[last - 1] - f[last], f[after] - f[last] + turn};
        for (k = 1; k < last; ++k) {
            third[k] = weighted(w3, count, k, v, a, f[k - 1] - f[k], k - 1, f[k + 1] - f[k], k + 1);
            fourth[k] = weighted(w4, count, k, v, a, f[k - 1] - f[k], k - 1, f[k + 1] - f[k], k + 1);
        }
        third[0] = weighted(w3, count, 0, v, a, first[0], before, first[1], 1);
        fourth[0] = weighted(w4, count, 0, v, a, first[0], before, first[1], 1);
        third[last] = weighted(w3, count, last, v, a, end[0], last - 1, end[1], after);
        fourth[last] = weighted(w4, count, last, v, a, end[0], last - 1, end[1], after);
    }
}
