/* Streaming: numbers written past the caches, where tables are larger than these and would be fetched only to be overwritten. */
#ifndef KF_STREAM_H
#define KF_STREAM_H

#include <stdint.h>
#include <string.h>

#if defined(__AVX512F__) || defined(__AVX__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#endif

#define KF_LINE 8 /* numbers in a line of the caches */

/* A line of numbers to a place that is aligned to it. */
static inline void kf_stream_line(double *to, const double *from)
{
#if defined(__AVX512F__)
    _mm512_stream_pd(to, _mm512_loadu_pd(from));
#elif defined(__AVX__)
    _mm256_stream_pd(to, _mm256_loadu_pd(from));
    _mm256_stream_pd(to + 4, _mm256_loadu_pd(from + 4));
#elif defined(__SSE2__)
    int k;
    for (k = 0; k < KF_LINE; k += 2) {
        _mm_stream_pd(to + k, _mm_loadu_pd(from + k));
    }
#else
    memcpy(to, from, KF_LINE * sizeof(double));
#endif
}

/* Whole lines are streamed; those that stand in two parts of a column are written through the caches. */
static inline void kf_stream(double *to, const double *from, int count)
{
    const int odd = (int)((uintptr_t)to / sizeof(double) % KF_LINE), head = odd == 0 ? 0 : KF_LINE - odd;
    int i = head < count ? head : count;
    memcpy(to, from, (size_t)i * sizeof(double));
    for (; i + KF_LINE <= count; i += KF_LINE) {
        kf_stream_line(to + i, from + i);
    }
    memcpy(to + i, from + i, (size_t)(count - i) * sizeof(double));
}

/* What was streamed stands before what is written from now on. */
static inline void kf_stream_end(void)
{
#if defined(__AVX512F__) || defined(__AVX__) || defined(__SSE2__)
    _mm_sfence();
#endif
}

#endif
