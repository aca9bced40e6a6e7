/* A host that steps and gets between two marks on its output: no memory may be asked for in between. FMI is 2 or 3.
 *
 * It moves the input to and fro, past what the mechanism can reach, so that steps are discarded, too. For glibc, whose
 * functions for memory are replaced here.
 */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <unistd.h>

#define TOKEN "{00000000-0000-0000-0000-000000000000}"
#define STEPS 5000

#if FMI == 2
#include "fmi2Functions.h"
#define GET(c, r, n, v) fmi2GetReal(c, r, n, v)
#define SET(c, r, n, v) fmi2SetReal(c, r, n, v)
#define COUNT(c, r, v) fmi2GetInteger(c, r, 1, v)
#define STEP(c, t, h) fmi2DoStep(c, t, h, 1)
#define LEAVE(c) fmi2ExitInitializationMode(c)
typedef fmi2Component instance;
typedef fmi2Integer count;

static instance start(void)
{
    instance c = fmi2Instantiate("it", fmi2CoSimulation, TOKEN, NULL, NULL, 0, 0);
    return c != NULL && fmi2EnterInitializationMode(c) == 0 ? c : NULL;
}
#else
#include "fmi3Functions.h"
#define GET(c, r, n, v) fmi3GetFloat64(c, r, n, v, n)
#define SET(c, r, n, v) fmi3SetFloat64(c, r, n, v, n)
#define COUNT(c, r, v) fmi3GetInt32(c, r, 1, v, 1)
#define STEP(c, t, h) fmi3DoStep(c, t, h, 1, &event, &terminate, &early, &last)
#define LEAVE(c) fmi3ExitInitializationMode(c)
typedef fmi3Instance instance;
typedef fmi3Int32 count;

static bool event, terminate, early;
static double last;

static instance start(void)
{
    instance c = fmi3InstantiateCoSimulation("it", TOKEN, NULL, 0, 0, 0, 0, NULL, 0, NULL, NULL, NULL);
    return c != NULL && fmi3EnterInitializationMode(c, 0, 0.0, 0.0, 0, 0.0) == 0 ? c : NULL;
}
#endif

extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t count, size_t size);
extern void *__libc_realloc(void *block, size_t size);
extern void __libc_free(void *block);

static int is_stepping;

static void none_in_a_step(void)
{
    if (is_stepping) {
        is_stepping = 0;
        abort();
    }
}

void *malloc(size_t size)
{
    none_in_a_step();
    return __libc_malloc(size);
}

void *calloc(size_t number, size_t size)
{
    none_in_a_step();
    return __libc_calloc(number, size);
}

void *realloc(void *block, size_t size)
{
    none_in_a_step();
    return __libc_realloc(block, size);
}

void free(void *block)
{
    none_in_a_step();
    __libc_free(block);
}

int main(void)
{
    const unsigned outputs[OUTPUTS] = {OUTPUT_REFERENCES}, input = INPUT, work = WORK;
    double values[OUTPUTS], begin, u;
    int k, discarded = 0;
    count most = 0, one;
    instance c = start();
    if (c == NULL || LEAVE(c) != 0 || GET(c, &input, 1, &begin) != 0) {
        return 1;
    }
    is_stepping = 1;
    if (write(1, "begin\n", 6) != 6) {
        return 1;
    }
    for (k = 0; k < STEPS; ++k) {
        u = begin + AMPLITUDE * sin(0.002 * k) + 0.01 * sin(0.3 * k);
        if (SET(c, &input, 1, &u) != 0) {
            return 1;
        }
        discarded += STEP(c, 0.01 * k, 0.01) != 0;
        GET(c, outputs, OUTPUTS, values);
        if (COUNT(c, &work, &one) != 0) {
            return 1;
        }
        most = one > most ? one : most;
    }
    if (write(1, "end\n", 4) != 4) {
        return 1;
    }
    is_stepping = 0;
    return most < 1 || (discarded == 0) != REACHES_ALL;
}
