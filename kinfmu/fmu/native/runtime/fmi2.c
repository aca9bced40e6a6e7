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

static fmi2Status unsupported(fmi2Component c, const char *what)
{
    return c ? (fmi2Status)kf_answered(common(c), KF_ERROR, "%s", what) : fmi2Error;
}

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories, const fmi2String categories[])
{
    return c ? (fmi2Status)kf_set_logging(common(c), loggingOn != fmi2False, nCategories, categories) : fmi2Error;
}

/* Resources are not read, so any path is accepted; memory comes from the C library. */
fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID, fmi2String fmuResourceLocation,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean loggingOn)
{
    const char *const name = instanceName ? instanceName : kf_name;
    const fmi2CallbackLogger logger = functions ? functions->logger : NULL;
    const fmi2ComponentEnvironment environment = functions ? functions->componentEnvironment : NULL;
    instance2 *instance;
    (void)fmuResourceLocation;
    (void)visible;
    (void)loggingOn; /* there are no debug messages: all messages sent state why a status is not OK */
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

void fmi2FreeInstance(fmi2Component c)
{
    free(c);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    (void)toleranceDefined; /* Newton always goes to round-off, whatever the tolerance */
    (void)tolerance;
    return c ? (fmi2Status)kf_set_experiment(common(c), startTime, stopTimeDefined != fmi2False, stopTime) : fmi2Error;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    return c ? (fmi2Status)kf_enter_initialization(common(c)) : fmi2Error;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    return c ? (fmi2Status)kf_exit_initialization(common(c)) : fmi2Error;
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    return c ? (fmi2Status)kf_enter(common(c), KF_TERMINATED, "terminate") : fmi2Error;
}

fmi2Status fmi2Reset(fmi2Component c)
{
    if (c == NULL) {
        return fmi2Error;
    }
    kf_start(common(c), common(c)->now.model_exchange);
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    return (fmi2Status)kf_get_real(common(c), vr, nvr, value);
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[])
{
    kf_answer answer = kf_check(common(c), vr, value, nvr);
    size_t k;
    for (k = 0; answer == KF_DONE && k < nvr; ++k) {
        long long number = 0;
        answer = kf_get_count(common(c), vr[k], "Integer", &number);
        value[k] = (fmi2Integer)number;
    }
    return (fmi2Status)answer;
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[])
{
    kf_answer answer = kf_check(common(c), vr, value, nvr);
    size_t k;
    for (k = 0; answer == KF_DONE && k < nvr; ++k) {
        bool flag = false;
        answer = kf_get_boolean(common(c), vr[k], &flag);
        value[k] = flag ? fmi2True : fmi2False;
    }
    return (fmi2Status)answer;
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[])
{
    kf_answer answer = kf_check(common(c), vr, value, nvr);
    size_t k;
    for (k = 0; answer == KF_DONE && k < nvr; ++k) {
        answer = kf_get_string(common(c), vr[k], &value[k]);
    }
    return (fmi2Status)answer;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    return (fmi2Status)kf_set_real(common(c), vr, nvr, value);
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[])
{
    kf_answer answer = kf_check(common(c), vr, value, nvr);
    size_t k;
    for (k = 0; answer == KF_DONE && k < nvr; ++k) {
        answer = kf_set_count(common(c), vr[k], "Integer", value[k]);
    }
    return (fmi2Status)answer;
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[])
{
    kf_answer answer = kf_check(common(c), vr, value, nvr);
    size_t k;
    for (k = 0; answer == KF_DONE && k < nvr; ++k) {
        answer = kf_set_boolean(common(c), vr[k], value[k] != fmi2False);
    }
    return (fmi2Status)answer;
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String value[])
{
    const kf_answer answer = kf_check(common(c), vr, value, nvr);
    return (fmi2Status)(answer == KF_DONE && nvr ? kf_not_settable(common(c), vr[0], "String") : answer);
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    return c ? (fmi2Status)kf_copy_state(common(c), FMUstate) : fmi2Error;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate)
{
    return c ? (fmi2Status)kf_restore_state(common(c), FMUstate) : fmi2Error;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    (void)c;
    if (FMUstate != NULL) {
        free(*FMUstate);
        *FMUstate = NULL;
    }
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size)
{
    (void)FMUstate;
    if (c == NULL || size == NULL) {
        return fmi2Error;
    }
    *size = kf_serialized_size();
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size)
{
    return c ? (fmi2Status)kf_serialize(common(c), FMUstate, (unsigned char *)serializedState, size) : fmi2Error;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size, fmi2FMUstate *FMUstate)
{
    return c ? (fmi2Status)kf_deserialize(common(c), (const unsigned char *)serializedState, size, FMUstate) : fmi2Error;
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

/* Model exchange: there are no continuous states; events are jumps of drivers over time and changes of status. */

fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    return c ? (fmi2Status)kf_enter(common(c), KF_EVENTS, "enterEventMode") : fmi2Error;
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

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    return c ? (fmi2Status)kf_enter(common(c), KF_CONTINUOUS, "enterContinuousTimeMode") : fmi2Error;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi2Boolean *enterEventMode, fmi2Boolean *terminateSimulation)
{
    bool wants_event = false;
    const kf_answer answer = c ? kf_complete_integrator_step(common(c), &wants_event) : KF_ERROR;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (enterEventMode) {
        *enterEventMode = wants_event ? fmi2True : fmi2False;
    }
    if (terminateSimulation) {
        *terminateSimulation = fmi2False;
    }
    return (fmi2Status)answer;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    return c ? (fmi2Status)kf_set_time(common(c), time) : fmi2Error;
}

static fmi2Status no_states(fmi2Component c, size_t count)
{
    return count == 0 && c ? fmi2OK : unsupported(c, "there are no continuous states and no event indicators");
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx)
{
    (void)x;
    return no_states(c, nx);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx)
{
    (void)derivatives;
    return no_states(c, nx);
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real eventIndicators[], size_t ni)
{
    (void)eventIndicators;
    return no_states(c, ni);
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx)
{
    (void)x;
    return no_states(c, nx);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x_nominal[], size_t nx)
{
    (void)x_nominal;
    return no_states(c, nx);
}

/* Co-simulation. */

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[],
                                       const fmi2Real value[])
{
    kf_answer answer = kf_check(common(c), vr, value, nvr);
    size_t k;
    if (answer == KF_DONE && nvr && order == NULL) {
        answer = kf_no_array(common(c), nvr);
    }
    for (k = 0; answer == KF_DONE && k < nvr; ++k) {
        answer = kf_set_input_derivative(common(c), vr[k], order[k], value[k]);
    }
    return (fmi2Status)answer;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[],
                                        fmi2Real value[])
{
    kf_answer answer = kf_check(common(c), vr, value, nvr);
    size_t k;
    if (answer == KF_DONE && nvr && order == NULL) {
        answer = kf_no_array(common(c), nvr);
    }
    for (k = 0; answer == KF_DONE && k < nvr; ++k) {
        answer = kf_output_derivative(common(c), vr[k], order[k], &value[k]);
    }
    return (fmi2Status)answer;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    return c ? (fmi2Status)kf_step(common(c), currentCommunicationPoint, communicationStepSize) : fmi2Error;
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    return unsupported(c, "cancelStep: steps are done when doStep returns");
}

/* Steps are never pending: the status is that of the last one. */

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value)
{
    (void)s;
    (void)value;
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
    (void)s;
    (void)value;
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
    (void)s;
    (void)value;
    return c ? fmi2Discard : fmi2Error;
}
