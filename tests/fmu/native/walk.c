/* A host that loads the library of an FMU, steps it through a turn of its input by degrees and prints all outputs.
 *
 *     walk LIBRARY TOKEN FIRST COUNT      value references of the outputs; FMI is 2 or 3
 *
 * For Windows and for the rest.
 */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#ifdef _WIN32
#include <windows.h>
#define OPEN(path) (void *)LoadLibraryA(path)
#define FIND(library, name) (void *)GetProcAddress((HMODULE)(library), name)
#else
#include <dlfcn.h>
#define OPEN(path) dlopen(path, RTLD_NOW)
#define FIND(library, name) dlsym(library, name)
#endif

#define DEGREE 0.017453292519943295

typedef void *(*create2)(const char *, int, const char *, const char *, const void *, int, int);
typedef void *(*create3)(const char *, const char *, const char *, bool, bool, bool, bool, const unsigned *, size_t, void *,
                         void *, void *);
typedef int (*enter2)(void *);
typedef int (*enter3)(void *, bool, double, double, bool, double);
typedef int (*set2)(void *, const unsigned *, size_t, const double *);
typedef int (*set3)(void *, const unsigned *, size_t, const double *, size_t);
typedef int (*step2)(void *, double, double, int);
typedef int (*step3)(void *, double, double, bool, bool *, bool *, bool *, double *);
typedef int (*get2)(void *, const unsigned *, size_t, double *);
typedef int (*get3)(void *, const unsigned *, size_t, double *, size_t);

static void *found(void *library, const char *name)
{
    void *const function = FIND(library, name);
    if (function == NULL) {
        printf("%s is missing\n", name);
        exit(1);
    }
    return function;
}

static void must(int status, const char *what, int k)
{
    if (status != 0) {
        printf("%s answers %d at step %d\n", what, status, k);
        exit(1);
    }
}

int main(int count_of_arguments, char **arguments)
{
    void *const library = count_of_arguments == 5 ? OPEN(arguments[1]) : NULL;
    const unsigned input = 1, first = library ? (unsigned)atoi(arguments[3]) : 0;
    const size_t count = library ? (size_t)atoi(arguments[4]) : 0;
    unsigned *const outputs = malloc((count + 1) * sizeof *outputs);
    double *const values = malloc((count + 1) * sizeof *values);
    void *instance;
    size_t i;
    int k;
    if (library == NULL || outputs == NULL || values == NULL) {
        printf("the library does not load\n");
        return 1;
    }
    for (i = 0; i < count; ++i) {
        outputs[i] = first + (unsigned)i;
    }
#if FMI == 2
    instance = ((create2)found(library, "fmi2Instantiate"))("it", 1, arguments[2], NULL, NULL, 0, 0);
    must(instance == NULL, "instantiate", 0);
    must(((enter2)found(library, "fmi2EnterInitializationMode"))(instance), "enterInitializationMode", 0);
    must(((enter2)found(library, "fmi2ExitInitializationMode"))(instance), "exitInitializationMode", 0);
#else
    instance = ((create3)found(library, "fmi3InstantiateCoSimulation"))("it", arguments[2], NULL, false, false, false, false,
                                                                       NULL, 0, NULL, NULL, NULL);
    must(instance == NULL, "instantiate", 0);
    must(((enter3)found(library, "fmi3EnterInitializationMode"))(instance, false, 0.0, 0.0, false, 0.0),
         "enterInitializationMode", 0);
    must(((enter2)found(library, "fmi3ExitInitializationMode"))(instance), "exitInitializationMode", 0);
#endif
    for (k = 0; k <= 360; ++k) {
        const double t = k * DEGREE;
#if FMI == 2
        must(((set2)found(library, "fmi2SetReal"))(instance, &input, 1, &t), "set", k);
        must(((step2)found(library, "fmi2DoStep"))(instance, t, DEGREE, 1), "doStep", k);
        must(((get2)found(library, "fmi2GetReal"))(instance, outputs, count, values), "get", k);
#else
        bool event, terminate, early;
        double last;
        must(((set3)found(library, "fmi3SetFloat64"))(instance, &input, 1, &t, 1), "set", k);
        must(((step3)found(library, "fmi3DoStep"))(instance, t, DEGREE, true, &event, &terminate, &early, &last), "doStep", k);
        must(((get3)found(library, "fmi3GetFloat64"))(instance, outputs, count, values, count), "get", k);
#endif
        for (i = 0; i < count; ++i) {
            printf("%.17g ", values[i]);
        }
        printf("\n");
    }
    return 0;
}
