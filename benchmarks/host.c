/* A host in C: set 1, step, get many, over and over, with nothing in between, or at a rate. Functions of an FMU are handed
 * in.
 */
#define _POSIX_C_SOURCE 200112L
#include <stdbool.h>
#include <stddef.h>
#include <time.h>

typedef int (*set2)(void *, const unsigned *, size_t, const double *);
typedef int (*get2)(void *, const unsigned *, size_t, double *);
typedef int (*step2)(void *, double, double, int);
typedef int (*set3)(void *, const unsigned *, size_t, const double *, size_t);
typedef int (*get3)(void *, const unsigned *, size_t, double *, size_t);
typedef int (*step3)(void *, double, double, bool, bool *, bool *, bool *, double *);

/* Steps from number `first` on, u = t = k * degree; the number of calls that failed. */
int host_run2(void *instance, set2 set, step2 step, get2 get, unsigned input, const unsigned *outputs, size_t count,
              double *values, long first, long steps, double degree)
{
    int failed = 0;
    long k;
    for (k = first; k < first + steps; ++k) {
        const double t = (double)k * degree;
        failed += set(instance, &input, 1, &t) != 0;
        failed += step(instance, t, degree, 1) != 0;
        failed += get(instance, outputs, count, values) != 0;
    }
    return failed;
}

int host_run3(void *instance, set3 set, step3 step, get3 get, unsigned input, const unsigned *outputs, size_t count,
              double *values, long first, long steps, double degree)
{
    bool event, terminate, early;
    double last;
    int failed = 0;
    long k;
    for (k = first; k < first + steps; ++k) {
        const double t = (double)k * degree;
        failed += set(instance, &input, 1, &t, 1) != 0;
        failed += step(instance, t, degree, true, &event, &terminate, &early, &last) != 0;
        failed += get(instance, outputs, count, values, count) != 0;
    }
    return failed;
}

static int nothing(void)
{
    return 0;
}

static int (*volatile const empty)(void) = nothing; /* called, whatever the compiler knows of it */

static long long now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1000000000LL + t.tv_nsec;
}

static void sleep_until(long long at)
{
    struct timespec t;
    t.tv_sec = (time_t)(at / 1000000000LL);
    t.tv_nsec = (long)(at % 1000000000LL);
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL);
}

/* One step every so many nanoseconds, and a call of an empty function: what each takes; the number of calls that failed. */
#define AT_RATE(fmi)                                                                                                   \
    int host_at_rate##fmi(void *instance, set##fmi set, step##fmi step, get##fmi get, unsigned input,                  \
                          const unsigned *outputs, size_t count, double *values, long first, long steps,               \
                          double degree, long period, double *of_step, double *of_empty)                               \
    {                                                                                                                  \
        long long at = now(), begin, between;                                                                          \
        int failed = 0;                                                                                                \
        long k;                                                                                                        \
        for (k = 0; k < steps; ++k) {                                                                                  \
            at += period;                                                                                              \
            sleep_until(at);                                                                                           \
            begin = now();                                                                                             \
            failed += host_run##fmi(instance, set, step, get, input, outputs, count, values, first + k, 1, degree);    \
            between = now();                                                                                           \
            failed += empty();                                                                                         \
            of_empty[k] = (double)(now() - between);                                                                   \
            of_step[k] = (double)(between - begin);                                                                    \
        }                                                                                                              \
        return failed;                                                                                                 \
    }

AT_RATE(2)
AT_RATE(3)
