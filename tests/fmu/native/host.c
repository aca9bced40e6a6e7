/* A host that goes through the life of an instance: set, step, get, derivatives, states, failures. FMI is 2 or 3. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TOKEN "{00000000-0000-0000-0000-000000000000}"

#if FMI == 2
#include "fmi2Functions.h"
#define CALL(name) fmi2##name
#define GET(c, r, n, v) fmi2GetReal(c, r, n, v)
#define SET(c, r, n, v) fmi2SetReal(c, r, n, v)
#define DERIVE(c, u, nu, k, nk, s, v) fmi2GetDirectionalDerivative(c, u, nu, k, nk, s, v)
#define STATE(name) fmi2##name##FMUstate
#define SIZE fmi2SerializedFMUstateSize
#define DESERIALIZE fmi2DeSerializeFMUstate
typedef fmi2Component instance;

static void print_message(fmi2ComponentEnvironment e, fmi2String n, fmi2Status s, fmi2String c, fmi2String m, ...)
{
    (void)e;
    (void)n;
    (void)s;
    (void)c;
    printf("%s\n", m);
}

static instance start(const char *token)
{
    static fmi2CallbackFunctions callbacks;
    callbacks.logger = print_message;
    return fmi2Instantiate("it", fmi2CoSimulation, token, NULL, &callbacks, 0, 1);
}

static int enter(instance c)
{
    return fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0) | fmi2EnterInitializationMode(c);
}

static int step(instance c, double t, double h)
{
    return fmi2DoStep(c, t, h, 1);
}
#else
#include "fmi3Functions.h"
#define CALL(name) fmi3##name
#define GET(c, r, n, v) fmi3GetFloat64(c, r, n, v, n)
#define SET(c, r, n, v) fmi3SetFloat64(c, r, n, v, n)
#define DERIVE(c, u, nu, k, nk, s, v) fmi3GetDirectionalDerivative(c, u, nu, k, nk, s, nk, v, nu)
#define STATE(name) fmi3##name##FMUState
#define SIZE fmi3SerializedFMUStateSize
#define DESERIALIZE fmi3DeserializeFMUState
typedef fmi3Instance instance;

static void print_message(fmi3InstanceEnvironment e, fmi3Status s, fmi3String c, fmi3String m)
{
    (void)e;
    (void)s;
    (void)c;
    printf("%s\n", m);
}

static instance start(const char *token)
{
    return fmi3InstantiateCoSimulation("it", token, NULL, 0, 1, 0, 0, NULL, 0, NULL, print_message, NULL);
}

static int enter(instance c)
{
    return fmi3EnterInitializationMode(c, 0, 0.0, 0.0, 0, 0.0);
}

static int step(instance c, double t, double h)
{
    bool event, terminate, early;
    double last;
    return fmi3DoStep(c, t, h, 1, &event, &terminate, &early, &last);
}
#endif

#define CHECK(condition)                                                                                               \
    if (!(condition)) {                                                                                                \
        fprintf(stderr, "line %d\n", __LINE__);                                                                        \
        exit(1);                                                                                                       \
    }

int main(void)
{
    unsigned outputs[OUTPUTS] = {OUTPUT_REFERENCES}, input = INPUT, parameter = (unsigned)(PARAMETER);
    double values[OUTPUTS], others[OUTPUTS], begin, u, one = 1.0, nan_value = NAN, known;
    void *state = NULL, *again = NULL;
    unsigned char *bytes;
    size_t size = 0;
    instance c;
    int k;
    CHECK(start("{wrong}") == NULL)
    c = start(TOKEN);
    CHECK(c != NULL)
    CHECK(enter(c) == 0)
    if (PARAMETER >= 0) {
        CHECK(GET(c, &parameter, 1, &known) == 0)
        known *= 1.01;
        CHECK(SET(c, &parameter, 1, &known) == 0)
        CHECK(DERIVE(c, outputs, OUTPUTS, &parameter, 1, &one, values) == 0)
    }
    CHECK(CALL(ExitInitializationMode)(c) == 0)
    CHECK(GET(c, &input, 1, &begin) == 0)
    for (k = 0; k < 400; ++k) { /* to and fro, where it goes and where it does not */
        u = begin + AMPLITUDE * sin(0.05 * k);
        CHECK(SET(c, &input, 1, &u) == 0)
        if (step(c, 0.01 * k, 0.01) == 0) {
            CHECK(GET(c, outputs, OUTPUTS, values) == 0)
        } else {
            GET(c, outputs, OUTPUTS, values);
        }
        if (k % 50 == 0) {
            DERIVE(c, outputs, OUTPUTS, &input, 1, &one, others);
        }
    }
    CHECK(SET(c, &input, 1, &begin) == 0)
    CHECK(STATE(Get)(c, &state) == 0)
    CHECK(GET(c, outputs, OUTPUTS, values) == 0)
    CHECK(SIZE(c, state, &size) == 0)
    bytes = malloc(size);
    CHECK(STATE(Serialize)(c, state, (void *)bytes, size) == 0)
    CHECK(SET(c, &input, 1, &nan_value) != 0)
    CHECK(DESERIALIZE(c, (void *)bytes, size, &again) == 0)
    CHECK(STATE(Set)(c, again) == 0)
    CHECK(GET(c, outputs, OUTPUTS, others) == 0)
    CHECK(memcmp(values, others, sizeof values) == 0)
    CHECK(STATE(Free)(c, &state) == 0 && state == NULL)
    CHECK(STATE(Free)(c, &again) == 0 && again == NULL)
    free(bytes);
    CHECK(CALL(Terminate)(c) == 0)
    CALL(FreeInstance)(c);
    return 0;
}
