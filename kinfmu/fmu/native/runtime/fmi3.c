/* FMI 3.0, co-simulation and model exchange: all functions of the standard, over instance.h. */
#include "instance.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

typedef struct {
    kf_instance common; /* first: a pointer to one is a pointer to the other */
    fmi3LogMessageCallback logger;
    fmi3InstanceEnvironment environment;
    fmi3IntermediateUpdateCallback update;
} instance3;

static void send(const void *host, kf_answer answer, const char *category, const char *message)
{
    const instance3 *const instance = host;
    instance->logger(instance->environment, (fmi3Status)answer, category, message);
}

/* Ask the host for the inputs at a time in its step, if it named some of them as intermediate variables. */
static void update(const void *host, double time)
{
    const instance3 *const instance = host;
    fmi3Boolean returns = fmi3False;
    fmi3Float64 at = time;
    instance->update(instance->environment, time, fmi3True, fmi3False, fmi3False, fmi3False, &returns, &at);
}

static kf_instance *common(fmi3Instance instance)
{
    return instance ? &((instance3 *)instance)->common : NULL;
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

#define FMI(name) fmi3##name
#define VALUE_COUNT , size_t value_count
#define CHECKED check(c, references, count, values, value_count)
#include "fmi_both.h"

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

/* Resources are not read, so any path is accepted. There are no debug messages, so `loggingOn` has no effect: all messages
 * sent state why a status is not OK.
 */
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
    fmi3Instance instance = instantiate(instantiationToken, instanceEnvironment, logMessage, NULL, false);
    if (instance && eventModeUsed) {
        common(instance)->has_event_mode = true;
        common(instance)->returns_early = earlyReturnAllowed;
    }
    if (instance && intermediateUpdate && nRequiredIntermediateVariables) {
        ((instance3 *)instance)->update = intermediateUpdate;
        common(instance)->update = update;
    }
    return instance;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken,
                                               fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                               fmi3InstanceEnvironment instanceEnvironment,
                                               fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
                                               fmi3LockPreemptionCallback lockPreemption,
                                               fmi3UnlockPreemptionCallback unlockPreemption)
{
    return instantiate(instantiationToken, instanceEnvironment, logMessage,
                       "this FMU is for co-simulation and model exchange, not for scheduled execution", false);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    if (instance == NULL) {
        return fmi3Error;
    }
    if (toleranceDefined) {
        kf_set_tolerance(common(instance), tolerance);
    }
    if (kf_set_experiment(common(instance), startTime, stopTimeDefined, stopTime) != KF_DONE) {
        return fmi3Error;
    }
    return (fmi3Status)kf_enter_initialization(common(instance));
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

/* solver.status and rates are enumerations, which FMI 3.0 gets as Int64; solver.iterations and so on are Int32. */
GET_COUNTS(fmi3GetInt32, fmi3Int32, "Int32")
SET_COUNTS(fmi3SetInt32, fmi3Int32, "Int32")
GET_COUNTS(fmi3GetInt64, fmi3Int64, "Int64")
SET_COUNTS(fmi3SetInt64, fmi3Int64, "Int64")

/* Answer a call for variables of a type that no variable has, or none that can be set. */
static fmi3Status none(fmi3Instance instance, const fmi3ValueReference *references, size_t count, const char *type,
                       kf_answer (*refuse)(const kf_instance *, unsigned, const char *))
{
    const kf_answer answer = kf_check(common(instance), references, references, count);
    return (fmi3Status)(answer == KF_DONE && count ? refuse(common(instance), references[0], type) : answer);
}

/* Define a function for such a type, which has the parameters given after the list of variables. */
#define NONE(function, refuse, type, ...)                                                                              \
    fmi3Status function(fmi3Instance instance, const fmi3ValueReference references[], size_t count, __VA_ARGS__)       \
    {                                                                                                                  \
        return none(instance, references, count, type, refuse);                                                        \
    }

NONE(fmi3GetFloat32, kf_not_a, "Float32", fmi3Float32 values[], size_t value_count)
NONE(fmi3GetInt8, kf_not_a, "Int8", fmi3Int8 values[], size_t value_count)
NONE(fmi3GetUInt8, kf_not_a, "UInt8", fmi3UInt8 values[], size_t value_count)
NONE(fmi3GetInt16, kf_not_a, "Int16", fmi3Int16 values[], size_t value_count)
NONE(fmi3GetUInt16, kf_not_a, "UInt16", fmi3UInt16 values[], size_t value_count)
NONE(fmi3GetUInt32, kf_not_a, "UInt32", fmi3UInt32 values[], size_t value_count)
NONE(fmi3GetUInt64, kf_not_a, "UInt64", fmi3UInt64 values[], size_t value_count)
NONE(fmi3GetBinary, kf_not_a, "Binary", size_t sizes[], fmi3Binary values[], size_t value_count)
NONE(fmi3GetClock, kf_not_a, "Clock", fmi3Clock values[])
NONE(fmi3SetFloat32, kf_not_settable, "Float32", const fmi3Float32 values[], size_t value_count)
NONE(fmi3SetInt8, kf_not_settable, "Int8", const fmi3Int8 values[], size_t value_count)
NONE(fmi3SetUInt8, kf_not_settable, "UInt8", const fmi3UInt8 values[], size_t value_count)
NONE(fmi3SetInt16, kf_not_settable, "Int16", const fmi3Int16 values[], size_t value_count)
NONE(fmi3SetUInt16, kf_not_settable, "UInt16", const fmi3UInt16 values[], size_t value_count)
NONE(fmi3SetUInt32, kf_not_settable, "UInt32", const fmi3UInt32 values[], size_t value_count)
NONE(fmi3SetUInt64, kf_not_settable, "UInt64", const fmi3UInt64 values[], size_t value_count)
NONE(fmi3SetString, kf_not_settable, "String", const fmi3String values[], size_t value_count)
NONE(fmi3SetBinary, kf_not_settable, "Binary", const size_t sizes[], const fmi3Binary values[], size_t value_count)
NONE(fmi3SetClock, kf_not_settable, "Clock", const fmi3Clock values[])
NONE(fmi3GetIntervalDecimal, kf_not_a, "Clock", fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
NONE(fmi3GetIntervalFraction, kf_not_a, "Clock", fmi3UInt64 counters[], fmi3UInt64 resolutions[],
     fmi3IntervalQualifier qualifiers[])
NONE(fmi3GetShiftDecimal, kf_not_a, "Clock", fmi3Float64 shifts[])
NONE(fmi3GetShiftFraction, kf_not_a, "Clock", fmi3UInt64 counters[], fmi3UInt64 resolutions[])
NONE(fmi3SetIntervalDecimal, kf_not_a, "Clock", const fmi3Float64 intervals[])
NONE(fmi3SetIntervalFraction, kf_not_a, "Clock", const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
NONE(fmi3SetShiftDecimal, kf_not_a, "Clock", const fmi3Float64 shifts[])
NONE(fmi3SetShiftFraction, kf_not_a, "Clock", const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference valueReference,
                                               size_t *nDependencies)
{
    return unsupported(instance, "getNumberOfVariableDependencies: dependencies are those in the model description");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent,
                                       size_t elementIndicesOfDependent[], fmi3ValueReference independents[],
                                       size_t elementIndicesOfIndependents[], fmi3DependencyKind dependencyKinds[],
                                       size_t nDependencies)
{
    return unsupported(instance, "getVariableDependencies: dependencies are those in the model description");
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

/* sensitivity = seed J, a column of J at a time: the directional derivatives of all unknowns along one known. */
static kf_answer adjoint(kf_instance *instance, const unsigned *unknowns, size_t unknown_count, const unsigned *knowns,
                         size_t known_count, const double *seed, double *sensitivity)
{
    const double one = 1.0;
    double *const column = unknown_count < SIZE_MAX / sizeof *column ? malloc((unknown_count + 1) * sizeof *column) : NULL;
    kf_answer answer = column == NULL ? kf_answered(instance, KF_ERROR, "getAdjointDerivative: out of memory") : KF_DONE;
    size_t k, j;
    for (j = 0; answer == KF_DONE && j < unknown_count; ++j) {
        if (!isfinite(seed[j])) {
            answer = kf_answered(instance, KF_ERROR, "no adjoint derivative of %s (value reference %u) by %g",
                                 kf_name_of(unknowns[j]), unknowns[j], seed[j]);
        }
    }
    for (k = 0; answer == KF_DONE && k < known_count; ++k) {
        answer = kf_directional(instance, unknowns, unknown_count, &knowns[k], 1, &one, column);
        sensitivity[k] = 0.0;
        for (j = 0; answer == KF_DONE && j < unknown_count; ++j) {
            sensitivity[k] += seed[j] * column[j];
        }
    }
    free(column);
    return answer;
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                    size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
{
    kf_answer answer = check(instance, unknowns, nUnknowns, seed, nSeed);
    if (answer == KF_DONE) {
        answer = check(instance, knowns, nKnowns, sensitivity, nSensitivity);
    }
    if (answer == KF_DONE) {
        answer = adjoint(common(instance), unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity);
    }
    return (fmi3Status)answer;
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance)
{
    return unsupported(instance, "enterConfigurationMode: there are no structural parameters");
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance)
{
    return unsupported(instance, "exitConfigurationMode: there are no structural parameters");
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clockReference, fmi3Float64 activationTime)
{
    return unsupported(instance, "activateModelPartition: this FMU is not for scheduled execution");
}

/* Events are jumps of laws over time and changes of status: event_mode.c. */

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance)
{
    return instance ? fmi3OK : fmi3Error;
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
    *nContinuousStates = KF_STATES;
    return fmi3OK;
}

/* Co-simulation. */

fmi3Status fmi3EnterStepMode(fmi3Instance instance)
{
    return instance ? (fmi3Status)kf_enter(common(instance), KF_STEPPING, KF_ENTER_STEPS) : fmi3Error;
}

OUTPUT_DERIVATIVES(fmi3GetOutputDerivatives, fmi3Int32)

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    bool has_event = false, is_early = false;
    kf_answer answer;
    if (instance == NULL) {
        return fmi3Error;
    }
    answer = common(instance)->has_event_mode
                 ? kf_step_to_event(common(instance), currentCommunicationPoint, communicationStepSize, &has_event, &is_early)
                 : kf_step(common(instance), currentCommunicationPoint, communicationStepSize);
    put(eventHandlingNeeded, has_event);
    put(terminateSimulation, common(instance)->now.terminated);
    put(earlyReturn, is_early);
    if (lastSuccessfulTime) {
        *lastSuccessfulTime = common(instance)->now.last_time;
    }
    return (fmi3Status)answer;
}
