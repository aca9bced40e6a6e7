/* Streaming: numbers written past the caches, for tables larger than these, which would be fetched only to be overwritten. */
#ifndef KF_STREAM_H
#define KF_STREAM_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#if defined(__SSE2__)
#include <emmintrin.h> /* small: that of AVX takes longer to compile than the file that needs it */
#endif

#define KF_LINE 8 /* numbers in a line of the caches */

/* Write a line of numbers to an aligned place. */
static inline void kf_stream_line(double *to, const double *from)
{
#if defined(__SSE2__)
    int k;
    for (k = 0; k < KF_LINE; k += 2) {
        _mm_stream_pd(to + k, _mm_loadu_pd(from + k));
    }
#else
    memcpy(to, from, KF_LINE * sizeof(double));
#endif
}

/* A column that is streamed piece after piece: its last numbers, of which less than a line is still to be written. */
typedef struct {
    double last[KF_LINE];
} kf_column;

/* How many numbers of its cache line are before `to`. */
static inline int kf_odd(const void *to)
{
    return (int)((uintptr_t)to / sizeof(double) % KF_LINE);
}

/* Write the next piece of a column in whole lines, the first with what the last piece left. count: of whole lines too. */
static inline void kf_stream(kf_column *column, double *to, const double *from, int count, bool is_first)
{
    const int odd = kf_odd(to), lead = odd == 0 ? 0 : KF_LINE - odd;
    int i;
    if (odd > 0 && is_first) {
        memcpy(to, from, (size_t)lead * sizeof(double));
    } else if (odd > 0) {
        double both[2 * KF_LINE];
        memcpy(both, column->last, sizeof column->last);
        memcpy(both + KF_LINE, from, sizeof column->last);
        kf_stream_line(to - odd, both + KF_LINE - odd);
    }
    for (i = lead; i + KF_LINE <= count; i += KF_LINE) {
        kf_stream_line(to + i, from + i);
    }
    memcpy(column->last, from + count - KF_LINE, sizeof column->last);
}

/* Write what the last piece left, up to the place of the next one. */
static inline void kf_stream_rest(const kf_column *column, void *to)
{
    const int odd = kf_odd(to);
    memcpy((double *)to - odd, column->last + KF_LINE - odd, (size_t)odd * sizeof(double));
}

/* Order the streamed writes before all later ones. */
static inline void kf_stream_end(void)
{
#if defined(__SSE2__)
    _mm_sfence();
#endif
}

#endif
