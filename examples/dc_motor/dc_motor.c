/* A DC motor with an inertia of its own, as an FMU for co-simulation (FMI 2.0).

       torque = k (voltage - k speed) / resistance
       (inertia + load_inertia) acceleration = torque - load_torque

   The inputs are held during a step, and the equation is then linear: the step is its exact solution, stable for every
   step size. The inductance of the winding is left out, and so is friction. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

enum { VOLTAGE, LOAD_TORQUE, LOAD_INERTIA, ANGLE, SPEED, ACCELERATION, TORQUE, CURRENT,
       INERTIA, TORQUE_CONSTANT, RESISTANCE, INITIAL_ANGLE, INITIAL_SPEED, COUNT };

static const char *const NAMES[COUNT] = {
    "voltage", "load_torque", "load_inertia", "angle", "speed", "acceleration", "torque", "current",
    "inertia", "torque_constant", "resistance", "initial_angle", "initial_speed"};
static const double STARTS[COUNT] = {
    [VOLTAGE] = 640.0, [INERTIA] = 1.1, [TORQUE_CONSTANT] = 80.0, [RESISTANCE] = 32.0};

typedef struct {
    double values[COUNT];
    int initialized;
} State;

typedef struct {
    State state;
    const fmi2CallbackFunctions *callbacks;
    char name[128];
} Motor;

static void message(const Motor *motor, fmi2Status status, const char *text) {
    if (motor->callbacks && motor->callbacks->logger) {
        motor->callbacks->logger(motor->callbacks->componentEnvironment, motor->name, status, "motor", text);
    }
}

static fmi2Status refuse(const Motor *motor, const char *name, const char *why) {
    char text[256];
    snprintf(text, sizeof text, "%s %s", name, why);
    message(motor, fmi2Error, text);
    return fmi2Error;
}

/* Compute the outputs that follow from states and inputs. */
static void update(double *v) {
    v[CURRENT] = (v[VOLTAGE] - v[TORQUE_CONSTANT] * v[SPEED]) / v[RESISTANCE];
    v[TORQUE] = v[TORQUE_CONSTANT] * v[CURRENT];
    v[ACCELERATION] = (v[TORQUE] - v[LOAD_TORQUE]) / (v[INERTIA] + v[LOAD_INERTIA]);
}

static void start(State *state) {
    memcpy(state->values, STARTS, sizeof STARTS);
    state->initialized = 0;
    update(state->values);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    (void)resources, (void)visible, (void)logging;
    Motor *motor = calloc(1, sizeof *motor);
    if (!motor) return NULL;
    motor->callbacks = callbacks;
    snprintf(motor->name, sizeof motor->name, "%s", name ? name : "");
    if (type != fmi2CoSimulation || !token || strcmp(token, TOKEN) != 0) {
        message(motor, fmi2Error, type == fmi2CoSimulation ? "the guid is not that of this FMU" : "co-simulation only");
        free(motor);
        return NULL;
    }
    start(&motor->state);
    return motor;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start_time,
                               fmi2Boolean has_stop, fmi2Real stop) {
    (void)c, (void)has_tolerance, (void)tolerance, (void)start_time, (void)has_stop, (void)stop;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return (void)c, fmi2OK; }

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    Motor *motor = c;
    motor->state.initialized = 1;
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c) { return (void)c, fmi2OK; }

fmi2Status fmi2Reset(fmi2Component c) {
    start(&((Motor *)c)->state);
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference references[], size_t count, fmi2Real values[]) {
    Motor *motor = c;
    for (size_t k = 0; k < count; k++) {
        if (references[k] >= COUNT) return refuse(motor, "fmi2GetReal:", "unknown value reference");
        values[k] = motor->state.values[references[k]];
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference references[], size_t count, const fmi2Real values[]) {
    Motor *motor = c;
    double *v = motor->state.values;
    for (size_t k = 0; k < count; k++) {
        const fmi2ValueReference place = references[k];
        if (place >= COUNT) return refuse(motor, "fmi2SetReal:", "unknown value reference");
        const int is_input = place <= LOAD_INERTIA, is_parameter = place >= INERTIA;
        const int is_positive = place == INERTIA || place == TORQUE_CONSTANT || place == RESISTANCE;
        if (!is_input && !is_parameter) return refuse(motor, NAMES[place], "is an output and cannot be set");
        if (is_parameter && motor->state.initialized) return refuse(motor, NAMES[place], "is fixed after initialization");
        if (!isfinite(values[k])) return refuse(motor, NAMES[place], "must be a finite number");
        if (is_positive && values[k] <= 0.0) return refuse(motor, NAMES[place], "must be positive");
        if (place == LOAD_INERTIA && values[k] < 0.0) return refuse(motor, NAMES[place], "must not be negative");
        v[place] = values[k];
        if (place == INITIAL_ANGLE) v[ANGLE] = values[k];
        if (place == INITIAL_SPEED) v[SPEED] = values[k];
    }
    update(v);
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real h, fmi2Boolean no_set_before) {
    (void)time, (void)no_set_before;
    Motor *motor = c;
    if (!(h > 0.0) || !isfinite(h)) return refuse(motor, "fmi2DoStep:", "the step size must be positive");
    double *v = motor->state.values;
    const double k = v[TORQUE_CONSTANT], inertia = v[INERTIA] + v[LOAD_INERTIA];
    const double a = (k * v[VOLTAGE] / v[RESISTANCE] - v[LOAD_TORQUE]) / inertia;   /* speed' = a - x / h speed */
    const double x = k * k / (v[RESISTANCE] * inertia) * h;
    const double mean = -expm1(-x) / x;                                             /* of exp(-x t / h) over the step */
    const double mean2 = x < 1e-3 ? 0.5 - x / 6.0 + x * x / 24.0 : (1.0 - mean) / x;
    v[ANGLE] += h * (mean * v[SPEED] + h * mean2 * a);
    v[SPEED] = exp(-x) * v[SPEED] + h * mean * a;
    update(v);
    return fmi2OK;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (!*state && !(*state = malloc(sizeof(State)))) return fmi2Error;
    memcpy(*state, &((Motor *)c)->state, sizeof(State));
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    memcpy(&((Motor *)c)->state, state, sizeof(State));
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

/* All other functions of the standard: hosts look them up, and the model description declares them as unsupported. */
#define UNSUPPORTED(name, ...) \
    fmi2Status name(fmi2Component c, __VA_ARGS__) { return refuse(c, #name, "is not supported"); }
#define NONE(name, value) \
    fmi2Status name(fmi2Component c, const fmi2ValueReference r[], size_t n, value v[]) \
    { return (void)r, (void)v, n ? refuse(c, #name ":", "the motor has only Real variables") : fmi2OK; }

NONE(fmi2GetInteger, fmi2Integer)
NONE(fmi2GetBoolean, fmi2Boolean)
NONE(fmi2GetString, fmi2String)
NONE(fmi2SetInteger, const fmi2Integer)
NONE(fmi2SetBoolean, const fmi2Boolean)
NONE(fmi2SetString, const fmi2String)

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[])
{ return (void)c, (void)on, (void)n, (void)categories, fmi2OK; }
UNSUPPORTED(fmi2SerializedFMUstateSize, fmi2FMUstate s, size_t *n)
UNSUPPORTED(fmi2SerializeFMUstate, fmi2FMUstate s, fmi2Byte b[], size_t n)
UNSUPPORTED(fmi2DeSerializeFMUstate, const fmi2Byte b[], size_t n, fmi2FMUstate *s)
UNSUPPORTED(fmi2GetDirectionalDerivative, const fmi2ValueReference u[], size_t nu, const fmi2ValueReference k[],
            size_t nk, const fmi2Real dk[], fmi2Real du[])
UNSUPPORTED(fmi2SetRealInputDerivatives, const fmi2ValueReference r[], size_t n, const fmi2Integer o[],
            const fmi2Real v[])
UNSUPPORTED(fmi2GetRealOutputDerivatives, const fmi2ValueReference r[], size_t n, const fmi2Integer o[], fmi2Real v[])
fmi2Status fmi2CancelStep(fmi2Component c) { return refuse(c, "fmi2CancelStep", "is not supported"); }
UNSUPPORTED(fmi2GetStatus, const fmi2StatusKind k, fmi2Status *v)
UNSUPPORTED(fmi2GetRealStatus, const fmi2StatusKind k, fmi2Real *v)
UNSUPPORTED(fmi2GetIntegerStatus, const fmi2StatusKind k, fmi2Integer *v)
UNSUPPORTED(fmi2GetBooleanStatus, const fmi2StatusKind k, fmi2Boolean *v)
UNSUPPORTED(fmi2GetStringStatus, const fmi2StatusKind k, fmi2String *v)
