/* FMI 2.0, co-simulation and model exchange: all functions of the standard, over instance.h. */
#include "instance.h"

#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

typedef struct {
    kf_instance common; /* first: a pointer to one is a pointer to the other */
    char *name;
    fmi2CallbackLogger logger;
    fmi2ComponentEnvironment environment;
} instance2;

/* In FMI 2.0 a message is a format, in which `#r1#` is replaced by a variable: % and # of the text are doubled. */
static void send(const void *host, kf_answer answer, const char *category, const char *message)
{
    const instance2 *const instance = host;
    char text[2 * KF_LONGEST];
    size_t n = 0;
    for (; *message; ++message) {
        text[n++] = *message;
        if (*message == '%' || *message == '#') {
            text[n++] = *message;
        }
    }
    text[n] = '\0';
    instance->logger(instance->environment, instance->name, (fmi2Status)answer, category, text);
}

static kf_instance *common(fmi2Component c)
{
    return c ? &((instance2 *)c)->common : NULL;
}

#define FMI(name) fmi2##name
#define VALUE_COUNT
#define CHECKED kf_check(common(c), references, values, count)
#define fmi2FMUState fmi2FMUstate /* names that FMI 3.0 writes otherwise */
#define fmi2GetFMUState fmi2GetFMUstate
#define fmi2SetFMUState fmi2SetFMUstate
#define fmi2FreeFMUState fmi2FreeFMUstate
#define fmi2SerializedFMUStateSize fmi2SerializedFMUstateSize
#define fmi2SerializeFMUState fmi2SerializeFMUstate
#define fmi2DeserializeFMUState fmi2DeSerializeFMUstate
#define fmi2GetContinuousStateDerivatives fmi2GetDerivatives
#include "fmi_both.h"

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

/* Resources are not read, so any path is accepted; memory comes from the C library. There are no debug messages, so
 * `loggingOn` has no effect: all messages sent state why a status is not OK.
 */
fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID, fmi2String fmuResourceLocation,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean loggingOn)
{
    const char *const name = instanceName ? instanceName : kf_name;
    const fmi2CallbackLogger logger = functions ? functions->logger : NULL;
    const fmi2ComponentEnvironment environment = functions ? functions->componentEnvironment : NULL;
    instance2 *instance;
    if (!kf_token_fits(fmuGUID)) {
        if (logger) {
            logger(environment, name, fmi2Error, kf_categories[2], "the guid is not that of this FMU, " KF_TOKEN);
        }
        return NULL;
    }
    instance = calloc(1, sizeof *instance + strlen(name) + 1);
    if (instance == NULL) {
        return NULL;
    }
    instance->name = (char *)(instance + 1);
    memcpy(instance->name, name, strlen(name) + 1);
    instance->logger = logger;
    instance->environment = environment;
    instance->common.send = logger ? send : NULL;
    instance->common.host = instance;
    kf_start(&instance->common, fmuType == fmi2ModelExchange);
    return instance;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    if (c && toleranceDefined) {
        kf_set_tolerance(common(c), tolerance);
    }
    return c ? (fmi2Status)kf_set_experiment(common(c), startTime, stopTimeDefined != fmi2False, stopTime) : fmi2Error;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    return c ? (fmi2Status)kf_enter_initialization(common(c)) : fmi2Error;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    return (fmi2Status)kf_get_real(common(c), vr, nvr, value);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    return (fmi2Status)kf_set_real(common(c), vr, nvr, value);
}

GET_COUNTS(fmi2GetInteger, fmi2Integer, "Integer")
SET_COUNTS(fmi2SetInteger, fmi2Integer, "Integer")

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String value[])
{
    const kf_answer answer = kf_check(common(c), vr, value, nvr);
    return (fmi2Status)(answer == KF_DONE && nvr ? kf_not_settable(common(c), vr[0], "String") : answer);
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[])
{
    kf_answer answer = kf_check(common(c), vUnknown_ref, dvUnknown, nUnknown);
    if (answer == KF_DONE) {
        answer = kf_check(common(c), vKnown_ref, dvKnown, nKnown);
    }
    if (answer == KF_DONE) {
        answer = kf_directional(common(c), vUnknown_ref, nUnknown, vKnown_ref, nKnown, dvKnown, dvUnknown);
    }
    return (fmi2Status)answer;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *eventInfo)
{
    if (c == NULL || eventInfo == NULL) {
        return fmi2Error;
    }
    memset(eventInfo, 0, sizeof *eventInfo);
    eventInfo->nextEventTimeDefined = kf_next_event(common(c), &eventInfo->nextEventTime) ? fmi2True : fmi2False;
    return fmi2OK;
}

/* Co-simulation. */

OUTPUT_DERIVATIVES(fmi2GetRealOutputDerivatives, fmi2Integer)

FOR_EACH(fmi2SetRealInputDerivatives, answer = orders ? kf_set_input_derivative(common(c), references[k], orders[k], values[k])
                                                      : kf_no_array(common(c), count),
         const fmi2Integer orders[], const fmi2Real values[])

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    return c ? (fmi2Status)kf_step(common(c), currentCommunicationPoint, communicationStepSize) : fmi2Error;
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    return unsupported(c, "cancelStep: steps are done when doStep returns");
}

/* Steps are never pending: the status is that of the last one. */

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value)
{
    return c ? fmi2Discard : fmi2Error;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value)
{
    if (c == NULL || value == NULL || s != fmi2LastSuccessfulTime) {
        return c && value ? fmi2Discard : fmi2Error;
    }
    *value = common(c)->now.last_time;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value)
{
    return c ? fmi2Discard : fmi2Error;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value)
{
    if (c == NULL || value == NULL || s != fmi2Terminated) {
        return c && value ? fmi2Discard : fmi2Error;
    }
    *value = common(c)->now.terminated ? fmi2True : fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value)
{
    return c ? fmi2Discard : fmi2Error;
}
