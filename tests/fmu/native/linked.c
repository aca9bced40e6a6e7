/* FMUs of both versions linked into one program: each answers by its own functions. */
#include <stdio.h>

#define FMI2_FUNCTION_PREFIX first_
#include "fmi2Functions.h"

fmi2Component second_fmi2Instantiate(fmi2String, fmi2Type, fmi2String, fmi2String, const fmi2CallbackFunctions *, fmi2Boolean,
                                     fmi2Boolean);
fmi2Status second_fmi2SetReal(fmi2Component, const fmi2ValueReference *, size_t, const fmi2Real *);
fmi2Status second_fmi2GetReal(fmi2Component, const fmi2ValueReference *, size_t, fmi2Real *);
void second_fmi2FreeInstance(fmi2Component);

#define FMI3_FUNCTION_PREFIX third_
#include "fmi3Functions.h"

int main(void)
{
    const unsigned input = 1, output = 4; /* the driver's value, and the first output */
    const double angles[3] = {0.5, 5.5, 0.75};
    double found[3] = {0.0, 0.0, 0.0};
    void *const first = fmi2Instantiate("a", fmi2CoSimulation, "{first}", NULL, NULL, 0, 0);
    void *const second = second_fmi2Instantiate("b", fmi2CoSimulation, "{second}", NULL, NULL, 0, 0);
    void *const third = fmi3InstantiateCoSimulation("c", "{third}", NULL, 0, 0, 0, 0, NULL, 0, NULL, NULL, NULL);
    int failed = !first || !second || !third;
    failed += failed || fmi2SetReal(first, &input, 1, &angles[0]) || fmi2GetReal(first, &output, 1, &found[0]);
    failed += failed || second_fmi2SetReal(second, &input, 1, &angles[1]) || second_fmi2GetReal(second, &output, 1, &found[1]);
    failed += failed || fmi3SetFloat64(third, &input, 1, &angles[2], 1) || fmi3GetFloat64(third, &output, 1, &found[2], 1);
    printf("%d %.17g %.17g %.17g\n", failed, found[0], found[1], found[2]);
    fmi2FreeInstance(first);
    second_fmi2FreeInstance(second);
    fmi3FreeInstance(third);
    return failed;
}
