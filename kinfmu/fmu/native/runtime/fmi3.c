/* FMI 3.0, co-simulation and model exchange: all functions of the standard, over instance.h. */
#include "instance.h"

#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

typedef struct {
    kf_instance common; /* first: a pointer to one is a pointer to the other */
    fmi3LogMessageCallback logger;
    fmi3InstanceEnvironment environment;
} instance3;

static void send(const void *host, kf_answer answer, const char *category, const char *message)
{
    const instance3 *const instance = host;
    instance->logger(instance->environment, (fmi3Status)answer, category, message);
}

static kf_instance *common(fmi3Instance instance)
{
    return instance ? &((instance3 *)instance)->common : NULL;
}

static fmi3Status unsupported(fmi3Instance instance, const char *what)
{
    return instance ? (fmi3Status)kf_answered(common(instance), KF_ERROR, "%s", what) : fmi3Error;
}

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories, const fmi3String categories[])
{
    return instance ? (fmi3Status)kf_set_logging(common(instance), loggingOn, nCategories, categories) : fmi3Error;
}

/* Resources are not read, so any path is accepted. */
static fmi3Instance instantiate(const char *token, fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
                                const char *refusal, bool model_exchange)
{
    instance3 *instance = NULL;
    if (refusal == NULL && !kf_token_fits(token)) {
        refusal = "the instantiation token is not that of this FMU, " KF_TOKEN;
    }
    if (refusal == NULL) {
        instance = calloc(1, sizeof *instance);
        refusal = "out of memory";
    }
    if (instance == NULL) {
        if (logger) {
            logger(environment, fmi3Error, kf_categories[2], refusal);
        }
        return NULL;
    }
    instance->logger = logger;
    instance->environment = environment;
    instance->common.send = logger ? send : NULL;
    instance->common.host = instance;
    kf_start(&instance->common, model_exchange);
    return instance;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
                                          fmi3Boolean visible, fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage)
{
    (void)instanceName;
    (void)resourcePath;
    (void)visible;
    (void)loggingOn; /* there are no debug messages: all messages sent state why a status is not OK */
    return instantiate(instantiationToken, instanceEnvironment, logMessage, NULL, true);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
                                         fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
                                         fmi3Boolean earlyReturnAllowed,
                                         const fmi3ValueReference requiredIntermediateVariables[],
                                         size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment,
                                         fmi3LogMessageCallback logMessage,
                                         fmi3IntermediateUpdateCallback intermediateUpdate)
{
    (void)instanceName;
    (void)resourcePath;
    (void)visible;
    (void)loggingOn;
    (void)earlyReturnAllowed; /* nothing happens inside a step */
    (void)requiredIntermediateVariables;
    (void)nRequiredIntermediateVariables;
    (void)intermediateUpdate;
    return instantiate(instantiationToken, instanceEnvironment, logMessage,
                       eventModeUsed ? "this FMU has no event mode in co-simulation" : NULL, false);
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken,
                                               fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                               fmi3InstanceEnvironment instanceEnvironment,
                                               fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
                                               fmi3LockPreemptionCallback lockPreemption,
                                               fmi3UnlockPreemptionCallback unlockPreemption)
{
    (void)instanceName;
    (void)resourcePath;
    (void)visible;
    (void)loggingOn;
    (void)clockUpdate;
    (void)lockPreemption;
    (void)unlockPreemption;
    return instantiate(instantiationToken, instanceEnvironment, logMessage,
                       "this FMU is for co-simulation and model exchange, not for scheduled execution", false);
}

void fmi3FreeInstance(fmi3Instance instance)
{
    free(instance);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    (void)toleranceDefined; /* Newton always goes to round-off, whatever the tolerance */
    (void)tolerance;
    if (instance == NULL) {
        return fmi3Error;
    }
    if (kf_set_experiment(common(instance), startTime, stopTimeDefined, stopTime) != KF_DONE) {
        return fmi3Error;
    }
    return (fmi3Status)kf_enter_initialization(common(instance));
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    return instance ? (fmi3Status)kf_exit_initialization(common(instance)) : fmi3Error;
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    return instance ? (fmi3Status)kf_enter(common(instance), KF_EVENTS, "enterEventMode") : fmi3Error;
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    return instance ? (fmi3Status)kf_enter(common(instance), KF_TERMINATED, "terminate") : fmi3Error;
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    if (instance == NULL) {
        return fmi3Error;
    }
    kf_start(common(instance), common(instance)->now.model_exchange);
    return fmi3OK;
}

static KF_RARE kf_answer wrong_count(fmi3Instance instance, size_t references, size_t values)
{
    return instance == NULL ? KF_ERROR
                            : kf_answered(common(instance), KF_ERROR,
                                          "%zu value references, but %zu values: every variable is a scalar", references, values);
}

/* Every variable is a scalar: as many values as references. */
static kf_answer check(fmi3Instance instance, const void *references, size_t count, const void *values, size_t value_count)
{
    return count == value_count ? kf_check(common(instance), references, values, count)
                                : wrong_count(instance, count, value_count);
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues)
{
    return (fmi3Status)(nValueReferences == nValues
                            ? kf_get_real(common(instance), valueReferences, nValueReferences, values)
                            : wrong_count(instance, nValueReferences, nValues));
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues)
{
    return (fmi3Status)(nValueReferences == nValues
                            ? kf_set_real(common(instance), valueReferences, nValueReferences, values)
                            : wrong_count(instance, nValueReferences, nValues));
}

/* solver.status and rates are enumerations, which FMI 3.0 gets as Int64; solver.iterations is an Int32. */
#define GET_COUNT(word)                                                                                                \
    fmi3Status fmi3Get##word(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,  \
                             fmi3##word values[], size_t nValues)                                                       \
    {                                                                                                                  \
        kf_answer answer = check(instance, valueReferences, nValueReferences, values, nValues);                        \
        size_t k;                                                                                                      \
        for (k = 0; answer == KF_DONE && k < nValueReferences; ++k) {                                                  \
            long long number = 0;                                                                                      \
            answer = kf_get_count(common(instance), valueReferences[k], #word, &number);                               \
            values[k] = (fmi3##word)number;                                                                            \
        }                                                                                                              \
        return (fmi3Status)answer;                                                                                     \
    }

GET_COUNT(Int32)
GET_COUNT(Int64)

fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Boolean values[], size_t nValues)
{
    kf_answer answer = check(instance, valueReferences, nValueReferences, values, nValues);
    size_t k;
    for (k = 0; answer == KF_DONE && k < nValueReferences; ++k) {
        answer = kf_get_boolean(common(instance), valueReferences[k], &values[k]);
    }
    return (fmi3Status)answer;
}

fmi3Status fmi3SetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Boolean values[], size_t nValues)
{
    kf_answer answer = check(instance, valueReferences, nValueReferences, values, nValues);
    size_t k;
    for (k = 0; answer == KF_DONE && k < nValueReferences; ++k) {
        answer = kf_set_boolean(common(instance), valueReferences[k], values[k]);
    }
    return (fmi3Status)answer;
}

fmi3Status fmi3GetString(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         fmi3String values[], size_t nValues)
{
    kf_answer answer = check(instance, valueReferences, nValueReferences, values, nValues);
    size_t k;
    for (k = 0; answer == KF_DONE && k < nValueReferences; ++k) {
        answer = kf_get_string(common(instance), valueReferences[k], &values[k]);
    }
    return (fmi3Status)answer;
}

fmi3Status fmi3SetInt64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        const fmi3Int64 values[], size_t nValues)
{
    kf_answer answer = check(instance, valueReferences, nValueReferences, values, nValues);
    size_t k;
    for (k = 0; answer == KF_DONE && k < nValueReferences; ++k) {
        answer = kf_set_count(common(instance), valueReferences[k], "Int64", values[k]);
    }
    return (fmi3Status)answer;
}

/* Types that no variable has, or none that can be set. */
static fmi3Status none_to_get(fmi3Instance instance, const fmi3ValueReference *references, size_t count, const char *type)
{
    const kf_answer answer = kf_check(common(instance), references, references, count);
    return (fmi3Status)(answer == KF_DONE && count ? kf_not_a(common(instance), references[0], type) : answer);
}

static fmi3Status none_to_set(fmi3Instance instance, const fmi3ValueReference *references, size_t count, const char *type)
{
    const kf_answer answer = kf_check(common(instance), references, references, count);
    return (fmi3Status)(answer == KF_DONE && count ? kf_not_settable(common(instance), references[0], type) : answer);
}

#define NONE_TO_GET(word)                                                                                              \
    fmi3Status fmi3Get##word(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,  \
                             fmi3##word values[], size_t nValues)                                                       \
    {                                                                                                                  \
        (void)values;                                                                                                  \
        (void)nValues;                                                                                                 \
        return none_to_get(instance, valueReferences, nValueReferences, #word);                                        \
    }

#define NONE_TO_SET(word)                                                                                              \
    fmi3Status fmi3Set##word(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,  \
                             const fmi3##word values[], size_t nValues)                                                 \
    {                                                                                                                  \
        (void)values;                                                                                                  \
        (void)nValues;                                                                                                 \
        return none_to_set(instance, valueReferences, nValueReferences, #word);                                        \
    }

NONE_TO_GET(Float32)
NONE_TO_GET(Int8)
NONE_TO_GET(UInt8)
NONE_TO_GET(Int16)
NONE_TO_GET(UInt16)
NONE_TO_GET(UInt32)
NONE_TO_GET(UInt64)
NONE_TO_SET(Float32)
NONE_TO_SET(Int8)
NONE_TO_SET(UInt8)
NONE_TO_SET(Int16)
NONE_TO_SET(UInt16)
NONE_TO_SET(Int32)
NONE_TO_SET(UInt32)
NONE_TO_SET(UInt64)
NONE_TO_SET(String)

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         size_t valueSizes[], fmi3Binary values[], size_t nValues)
{
    (void)valueSizes;
    (void)values;
    (void)nValues;
    return none_to_get(instance, valueReferences, nValueReferences, "Binary");
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         const size_t valueSizes[], const fmi3Binary values[], size_t nValues)
{
    (void)valueSizes;
    (void)values;
    (void)nValues;
    return none_to_set(instance, valueReferences, nValueReferences, "Binary");
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3Clock values[])
{
    (void)values;
    return none_to_get(instance, valueReferences, nValueReferences, "Clock");
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        const fmi3Clock values[])
{
    (void)values;
    return none_to_set(instance, valueReferences, nValueReferences, "Clock");
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference valueReference,
                                               size_t *nDependencies)
{
    (void)valueReference;
    (void)nDependencies;
    return unsupported(instance, "getNumberOfVariableDependencies: dependencies are those in the model description");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent,
                                       size_t elementIndicesOfDependent[], fmi3ValueReference independents[],
                                       size_t elementIndicesOfIndependents[], fmi3DependencyKind dependencyKinds[],
                                       size_t nDependencies)
{
    (void)dependent;
    (void)elementIndicesOfDependent;
    (void)independents;
    (void)elementIndicesOfIndependents;
    (void)dependencyKinds;
    (void)nDependencies;
    return unsupported(instance, "getVariableDependencies: dependencies are those in the model description");
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    return instance ? (fmi3Status)kf_copy_state(common(instance), FMUState) : fmi3Error;
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState)
{
    return instance ? (fmi3Status)kf_restore_state(common(instance), FMUState) : fmi3Error;
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    (void)instance;
    if (FMUState != NULL) {
        free(*FMUState);
        *FMUState = NULL;
    }
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size)
{
    (void)FMUState;
    if (instance == NULL || size == NULL) {
        return fmi3Error;
    }
    *size = kf_serialized_size();
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[], size_t size)
{
    return instance ? (fmi3Status)kf_serialize(common(instance), FMUState, serializedState, size) : fmi3Error;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
                                   fmi3FMUState *FMUState)
{
    return instance ? (fmi3Status)kf_deserialize(common(instance), serializedState, size, FMUState) : fmi3Error;
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                        const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                        size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
{
    kf_answer answer = check(instance, unknowns, nUnknowns, sensitivity, nSensitivity);
    if (answer == KF_DONE) {
        answer = check(instance, knowns, nKnowns, seed, nSeed);
    }
    if (answer == KF_DONE) {
        answer = kf_directional(common(instance), unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity);
    }
    return (fmi3Status)answer;
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                    size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
{
    (void)unknowns;
    (void)nUnknowns;
    (void)knowns;
    (void)nKnowns;
    (void)seed;
    (void)nSeed;
    (void)sensitivity;
    (void)nSensitivity;
    return unsupported(instance, "getAdjointDerivative: there are none; getDirectionalDerivative has the others");
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance)
{
    return unsupported(instance, "enterConfigurationMode: there are no structural parameters");
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance)
{
    return unsupported(instance, "exitConfigurationMode: there are no structural parameters");
}

/* Clocks: there are none. */

static fmi3Status no_clock(fmi3Instance instance, const fmi3ValueReference *references, size_t count)
{
    return none_to_get(instance, references, count, "Clock");
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                  fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
{
    (void)intervals;
    (void)qualifiers;
    return no_clock(instance, valueReferences, nValueReferences);
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                   size_t nValueReferences, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                   fmi3IntervalQualifier qualifiers[])
{
    (void)counters;
    (void)resolutions;
    (void)qualifiers;
    return no_clock(instance, valueReferences, nValueReferences);
}

fmi3Status fmi3GetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                               fmi3Float64 shifts[])
{
    (void)shifts;
    return no_clock(instance, valueReferences, nValueReferences);
}

fmi3Status fmi3GetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                fmi3UInt64 counters[], fmi3UInt64 resolutions[])
{
    (void)counters;
    (void)resolutions;
    return no_clock(instance, valueReferences, nValueReferences);
}

fmi3Status fmi3SetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                  const fmi3Float64 intervals[])
{
    (void)intervals;
    return no_clock(instance, valueReferences, nValueReferences);
}

fmi3Status fmi3SetIntervalFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                   size_t nValueReferences, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
{
    (void)counters;
    (void)resolutions;
    return no_clock(instance, valueReferences, nValueReferences);
}

fmi3Status fmi3SetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                               const fmi3Float64 shifts[])
{
    (void)shifts;
    return no_clock(instance, valueReferences, nValueReferences);
}

fmi3Status fmi3SetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
{
    (void)counters;
    (void)resolutions;
    return no_clock(instance, valueReferences, nValueReferences);
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clockReference, fmi3Float64 activationTime)
{
    (void)clockReference;
    (void)activationTime;
    return unsupported(instance, "activateModelPartition: this FMU is not for scheduled execution");
}

/* Events are jumps of drivers over time and changes of status; there are no continuous states. */

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance)
{
    return instance ? fmi3OK : fmi3Error;
}

static void put(fmi3Boolean *place, fmi3Boolean value)
{
    if (place) {
        *place = value;
    }
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime)
{
    double time = 0.0;
    bool has_event;
    put(discreteStatesNeedUpdate, fmi3False);
    put(terminateSimulation, fmi3False);
    put(nominalsOfContinuousStatesChanged, fmi3False);
    put(valuesOfContinuousStatesChanged, fmi3False);
    has_event = instance && kf_next_event(common(instance), &time);
    put(nextEventTimeDefined, has_event);
    if (nextEventTime) {
        *nextEventTime = has_event ? time : 0.0;
    }
    return instance ? fmi3OK : fmi3Error;
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance)
{
    return instance ? (fmi3Status)kf_enter(common(instance), KF_CONTINUOUS, "enterContinuousTimeMode") : fmi3Error;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation)
{
    bool wants_event = false;
    const kf_answer answer = instance ? kf_complete_integrator_step(common(instance), &wants_event) : KF_ERROR;
    (void)noSetFMUStatePriorToCurrentPoint;
    put(enterEventMode, wants_event);
    put(terminateSimulation, fmi3False);
    return (fmi3Status)answer;
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
    return instance ? (fmi3Status)kf_set_time(common(instance), time) : fmi3Error;
}

static fmi3Status no_states(fmi3Instance instance, size_t count)
{
    return count == 0 && instance ? fmi3OK
                                  : unsupported(instance, "there are no continuous states and no event indicators");
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[], size_t nContinuousStates)
{
    (void)continuousStates;
    return no_states(instance, nContinuousStates);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[], size_t nContinuousStates)
{
    (void)derivatives;
    return no_states(instance, nContinuousStates);
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[], size_t nEventIndicators)
{
    (void)eventIndicators;
    return no_states(instance, nEventIndicators);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[], size_t nContinuousStates)
{
    (void)continuousStates;
    return no_states(instance, nContinuousStates);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[], size_t nContinuousStates)
{
    (void)nominals;
    return no_states(instance, nContinuousStates);
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators)
{
    if (instance == NULL || nEventIndicators == NULL) {
        return fmi3Error;
    }
    *nEventIndicators = 0;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates)
{
    if (instance == NULL || nContinuousStates == NULL) {
        return fmi3Error;
    }
    *nContinuousStates = 0;
    return fmi3OK;
}

/* Co-simulation. */

fmi3Status fmi3EnterStepMode(fmi3Instance instance)
{
    return unsupported(instance, "enterStepMode: this FMU has no event mode in co-simulation");
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                    size_t nValueReferences, const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues)
{
    kf_answer answer = check(instance, valueReferences, nValueReferences, values, nValues);
    size_t k;
    if (answer == KF_DONE && nValueReferences && orders == NULL) {
        answer = kf_no_array(common(instance), nValueReferences);
    }
    for (k = 0; answer == KF_DONE && k < nValueReferences; ++k) {
        answer = kf_output_derivative(common(instance), valueReferences[k], orders[k], &values[k]);
    }
    return (fmi3Status)answer;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    kf_answer answer;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (instance == NULL) {
        return fmi3Error;
    }
    answer = kf_step(common(instance), currentCommunicationPoint, communicationStepSize);
    put(eventHandlingNeeded, fmi3False);
    put(terminateSimulation, common(instance)->now.terminated);
    put(earlyReturn, fmi3False);
    if (lastSuccessfulTime) {
        *lastSuccessfulTime = common(instance)->now.last_time;
    }
    return (fmi3Status)answer;
}
