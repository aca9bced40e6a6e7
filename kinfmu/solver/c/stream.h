/* Streaming: numbers written past the caches, for tables larger than these, which would be fetched only to be overwritten. */
#ifndef KF_STREAM_H
#define KF_STREAM_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#define KF_LINE 8 /* numbers in a line of the caches */

typedef double kf_line __attribute__((vector_size(64))); /* of plain GCC and Clang: their headers take long to compile */

/* Write a line of numbers to an aligned place. */
static inline void kf_stream_line(double *to, const double *from)
{
#if defined(__clang__)
    kf_line line;
    memcpy(&line, from, sizeof line);
    __builtin_nontemporal_store(line, (kf_line *)(void *)to);
#elif defined(__AVX512F__)
    kf_line line;
    memcpy(&line, from, sizeof line);
    __builtin_ia32_movntpd512(to, line);
#elif defined(__SSE2__)
    int k;
    for (k = 0; k < KF_LINE; k += 2) {
        double pair __attribute__((vector_size(16)));
        memcpy(&pair, from + k, sizeof pair);
        __builtin_ia32_movntpd(to + k, pair);
    }
#else
    memcpy(to, from, KF_LINE * sizeof(double));
#endif
}

/* Write a line of which the first numbers, `odd`, are the end of one line and the others the begin of another. */
static inline void kf_stream_joined(double *to, const double *end, const double *begin, int odd)
{
    double both[2 * KF_LINE];
#if defined(__AVX512F__) && !defined(__clang__) /* in registers: a load of numbers that were just stored waits for them */
    typedef int64_t kf_places __attribute__((vector_size(64)));
    const kf_places places = {8, 9, 10, 11, 12, 13, 14, 15};
    kf_line a, b;
    memcpy(&a, end, sizeof a);
    memcpy(&b, begin, sizeof b);
    a = __builtin_shuffle(a, b, places - odd);
    __builtin_ia32_movntpd512(to, a);
    (void)both;
#else
    memcpy(both, end, KF_LINE * sizeof(double));
    memcpy(both + KF_LINE, begin, KF_LINE * sizeof(double));
    kf_stream_line(to, both + KF_LINE - odd);
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
        kf_stream_joined(to - odd, column->last, from, odd);
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
    __builtin_ia32_sfence();
#endif
}

#endif
