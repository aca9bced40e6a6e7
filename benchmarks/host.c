/* A host in C: set 1, step, get many, over and over, with nothing in between. Functions of an FMU are handed in. */
#include <stdbool.h>
#include <stddef.h>

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
