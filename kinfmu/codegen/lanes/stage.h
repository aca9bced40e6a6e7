/* Stage: formulas of many results, for many samples side by side.
 *
 * A generated file defines KF_GIVEN, KF_VALUES and KF_RESULTS and includes this one. Its function fills a block of results
 * from a block of given numbers and of values in between, which have places after KF_GIVEN copies of given numbers.
 */
#ifndef KF_STAGE_H
#define KF_STAGE_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "stream.h"
#include "vectors.h"

#define KF_BLOCK 64 /* samples: the results of most mechanisms then stay in the second cache */
#define KF_EACH(i) KF_SIDE_BY_SIDE for (i = 0; i < KF_BLOCK; ++i)

typedef double kf_numbers[KF_BLOCK]; /* one for each sample */

/* Samples of a stage. step: between the given numbers of two samples, 0 if it is one number for all. pitch: of the rows of
 * results, which are aligned to cache lines. places: rows of the results in order. is_large: larger than the caches.
 * is_checked: whether all results are finite is wanted.
 */
typedef struct {
    int64_t count;
    const double *const *given;
    const int64_t *step;
    double *results;
    int64_t pitch;
    bool is_large;
    bool is_checked;
} kf_stage;

/* Exchange a and b in the samples of the mask. */
static inline void kf_exchange(const double *mask, double *a, double *b)
{
    int i;
    KF_EACH (i) {
        const double of_a = a[i], of_b = b[i];
        a[i] = mask[i] > 0.0 ? of_b : of_a;
        b[i] = mask[i] > 0.0 ? of_a : of_b;
    }
}

/* a -= factor b */
static inline void kf_take(const double *factor, const double *b, double *a)
{
    int i;
    KF_EACH (i) {
        a[i] -= factor[i] * b[i];
    }
}

/* J x = b for columns b, which become x: elimination with row pivots, rows scaled to a largest entry of 1.
 *
 * j: row after row. b: column after column. A row moves up when its entry is larger than the pivot so far.
 */
static inline void kf_solutions(int size, int columns, kf_numbers *j, kf_numbers *b)
{
    kf_numbers factor;
    int i, c, row, m, n;
    for (row = 0; row < size; ++row) {
        KF_EACH (i) {
            factor[i] = 0.0;
        }
        for (m = 0; m < size; ++m) {
            KF_EACH (i) {
                const double entry = fabs(j[row * size + m][i]);
                factor[i] = entry > factor[i] ? entry : factor[i];
            }
        }
        for (m = 0; m < size; ++m) {
            KF_EACH (i) {
                j[row * size + m][i] /= factor[i];
            }
        }
        for (n = 0; n < columns; ++n) {
            KF_EACH (i) {
                b[n * size + row][i] /= factor[i];
            }
        }
    }
    for (c = 0; c < size; ++c) {
        const double *const pivot = j[c * size + c];
        for (row = c + 1; row < size; ++row) {
            KF_EACH (i) {
                factor[i] = fabs(j[row * size + c][i]) > fabs(pivot[i]) ? 1.0 : 0.0;
            }
            for (m = c; m < size; ++m) {
                kf_exchange(factor, j[c * size + m], j[row * size + m]);
            }
            for (n = 0; n < columns; ++n) {
                kf_exchange(factor, b[n * size + c], b[n * size + row]);
            }
        }
        for (row = c + 1; row < size; ++row) {
            KF_EACH (i) {
                factor[i] = j[row * size + c][i] / pivot[i];
            }
            for (m = c + 1; m < size; ++m) {
                kf_take(factor, j[c * size + m], j[row * size + m]);
            }
            for (n = 0; n < columns; ++n) {
                kf_take(factor, b[n * size + c], b[n * size + row]);
            }
        }
    }
    for (n = 0; n < columns; ++n) {
        for (row = size - 1; row >= 0; --row) {
            double *const x = b[n * size + row];
            const double *const pivot = j[row * size + row];
            for (m = row + 1; m < size; ++m) {
                kf_take(j[row * size + m], b[n * size + m], x);
            }
            KF_EACH (i) {
                x[i] /= pivot[i];
            }
        }
    }
}

/* Find the given numbers of a block: where they are, or in x as copies; samples after the last one repeat it. */
static inline void kf_find(const kf_stage *stage, int64_t first, int count, kf_numbers *x, const double **given)
{
    int k, i;
    for (k = 0; k < KF_GIVEN; ++k) {
        const int64_t step = stage->step[k];
        const double *const from = stage->given[k] + step * first;
        given[k] = x[k];
        if (step == 1 && count == KF_BLOCK) {
            given[k] = from;
        } else if (step != 0 || first == 0) { /* one number for all is copied once */
            for (i = 0; i < KF_BLOCK; ++i) {
                x[k][i] = from[step * (i < count ? i : count - 1)];
            }
        }
    }
}

/* Write the results of a block to their rows. */
static inline void kf_scatter(const kf_stage *stage, double *const *rows, int count, kf_numbers *found)
{
    int k, i;
    for (k = 0; k < KF_RESULTS; ++k) {
        if (stage->is_large && count == KF_BLOCK) {
            for (i = 0; i < KF_BLOCK; i += KF_LINE) {
                kf_stream_line(rows[k] + i, found[k] + i);
            }
        } else {
            memcpy(rows[k], found[k], (size_t)count * sizeof(double));
        }
    }
}

/* Fill the results of a stage: 1, or 0 if it is to be checked and some are not finite; -1: no memory is left.
 *
 * fill: from given numbers and values in between, to results. Whole blocks are written where they belong.
 */
static inline int kf_fill(
    const kf_stage *stage, const int *places, void (*fill)(const double **given, kf_numbers *x, double **results))
{
    const size_t line = KF_LINE * sizeof(double);
    void *const memory = malloc((KF_VALUES + KF_RESULTS) * sizeof(kf_numbers) + line);
    const double *given[KF_GIVEN + 1];
    double *rows[KF_RESULTS + 1], *results[KF_RESULTS + 1];
    kf_numbers *x, *found;
    kf_numbers zero; /* NaN where a result is not finite */
    double sum = 0.0;
    int64_t s;
    int i, k;
    if (memory == NULL) {
        return -1;
    }
    x = (kf_numbers *)(((uintptr_t)memory + line - 1) / line * line);
    found = x + KF_VALUES;
    memset(zero, 0, sizeof zero);
    for (s = 0; s < stage->count; s += KF_BLOCK) {
        const int count = stage->count - s < KF_BLOCK ? (int)(stage->count - s) : KF_BLOCK;
        const bool is_direct = count == KF_BLOCK && !stage->is_large;
        for (k = 0; k < KF_RESULTS; ++k) {
            rows[k] = stage->results + places[k] * stage->pitch + s;
            results[k] = is_direct ? rows[k] : found[k];
        }
        kf_find(stage, s, count, x, given);
        fill(given, x, results);
        for (k = 0; k < KF_RESULTS && stage->is_checked; ++k) {
            const double *const result = results[k];
            KF_EACH (i) {
                zero[i] += 0.0 * result[i];
            }
        }
        if (!is_direct) {
            kf_scatter(stage, rows, count, found);
        }
    }
    if (stage->is_large) {
        kf_stream_end();
    }
    for (i = 0; i < KF_BLOCK; ++i) {
        sum += zero[i];
    }
    free(memory);
    return sum == 0.0;
}

#endif
