/* The least that an FMU of a parallelogram four-bar can do: closed forms of q, qd, qdd, written by hand.
 *
 * Value references: 1 crank angle, 2 crank speed, then five outputs, their rates and accelerations. FMI is 2 or 3.
 */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#define OUTPUTS 5
#define VARIABLES (2 + 3 * OUTPUTS)

typedef struct {
    double values[VARIABLES];
    double time;
} fmu;

static void compute(fmu *m)
{
    const double phi = m->values[0], w = m->values[1], s = sin(phi), c = cos(phi);
    const double q[OUTPUTS] = {phi, 1.0 + c, s, 0.0, phi};
    const double qd[OUTPUTS] = {w, -s * w, c * w, 0.0, w};
    const double qdd[OUTPUTS] = {0.0, -c * w * w, -s * w * w, 0.0, 0.0};
    memcpy(m->values + 2, q, sizeof q);
    memcpy(m->values + 2 + OUTPUTS, qd, sizeof qd);
    memcpy(m->values + 2 + 2 * OUTPUTS, qdd, sizeof qdd);
}

static int get(fmu *m, const unsigned *references, size_t count, double *values)
{
    size_t k;
    compute(m);
    for (k = 0; k < count; ++k) {
        if (references[k] - 1u >= VARIABLES) {
            return 3;
        }
        values[k] = m->values[(size_t)references[k] - 1];
    }
    return 0;
}

static int set(fmu *m, const unsigned *references, size_t count, const double *values)
{
    size_t k;
    for (k = 0; k < count; ++k) {
        if (references[k] - 1u > 1 || !isfinite(values[k])) {
            return 3;
        }
        m->values[(size_t)references[k] - 1] = values[k];
    }
    return 0;
}

static int step(fmu *m, double time, double length)
{
    if (!(length >= 0.0)) {
        return 3;
    }
    m->time = time + length;
    compute(m);
    return 0;
}

fmu *instantiate(void);
fmu *instantiate(void)
{
    fmu *const m = calloc(1, sizeof(fmu));
    if (m) {
        m->values[1] = 1.0;
    }
    return m;
}

#if FMI == 2
int fmi2SetReal(void *m, const unsigned *references, size_t count, const double *values);
int fmi2SetReal(void *m, const unsigned *references, size_t count, const double *values)
{
    return set(m, references, count, values);
}
int fmi2GetReal(void *m, const unsigned *references, size_t count, double *values);
int fmi2GetReal(void *m, const unsigned *references, size_t count, double *values)
{
    return get(m, references, count, values);
}
int fmi2DoStep(void *m, double time, double length, int keep);
int fmi2DoStep(void *m, double time, double length, int keep)
{
    (void)keep;
    return step(m, time, length);
}
#else
int fmi3SetFloat64(void *m, const unsigned *references, size_t count, const double *values, size_t capacity);
int fmi3SetFloat64(void *m, const unsigned *references, size_t count, const double *values, size_t capacity)
{
    return capacity < count ? 3 : set(m, references, count, values);
}
int fmi3GetFloat64(void *m, const unsigned *references, size_t count, double *values, size_t capacity);
int fmi3GetFloat64(void *m, const unsigned *references, size_t count, double *values, size_t capacity)
{
    return capacity < count ? 3 : get(m, references, count, values);
}
int fmi3DoStep(void *m, double time, double length, bool keep, bool *event, bool *terminate, bool *early, double *last);
int fmi3DoStep(void *m, double time, double length, bool keep, bool *event, bool *terminate, bool *early, double *last)
{
    (void)keep;
    *event = *terminate = *early = false;
    *last = time + length;
    return step(m, time, length);
}
#endif
