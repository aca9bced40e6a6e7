/* A random host of an FMU: all functions of FMI 2.0 or 3.0 in every state, with arguments of every kind.
 *
 *     driver SEED CALLS THREADS
 *
 * It is linked with the FMU's sources and compiled under sanitizers. It checks itself what a host relies on: an answer is
 * never Fatal; what was read with OK is finite; changed states, NULL arrays, wrong counts and steps that are none are
 * refused; messages are one line and no formats; a reset instance is as a fresh one; a call takes no longer than SLOWEST;
 * the same calls give the same answers next to another thread. Exit status 1 and one line on standard error if not.
 */
#define _POSIX_C_SOURCE 200809L
#include <float.h>
#include <math.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "interface.h"
#include "sizes.h"

#if FMI == 2
#include "fmi2Functions.h"
#define CALL(name) fmi2##name
typedef fmi2Component component;
typedef fmi2FMUstate state;
#else
#include "fmi3Functions.h"
#define CALL(name) fmi3##name
typedef fmi3Instance component;
typedef fmi3FMUState state;
#endif

#if TORQUE /* efforts are inputs; value and speed of the drivers are continuous states */
#define FIRST_INPUT (1u + (unsigned)kf_part_first[KF_PART_EFFORTS])
#define INPUTS KF_DRIVERS
#else
#define FIRST_INPUT 1u
#define INPUTS (3 * KF_DRIVERS)
#endif

#define INSTANCES 3
#define STATES 2
#define SLOWEST 20.0 /* [s], under sanitizers and next to other programs */
enum { OK, WARNING, DISCARD, ERROR, FATAL };

typedef struct {
    component c;
    bool model_exchange, running, has_events;
    double t;
    state states[STATES];
} slot;

typedef struct {
    uint64_t seed, random, seen;
    long calls, call;
    const char *doing;
    slot slots[INSTANCES];
} host;

static void fail(const host *h, const char *format, ...)
{
    va_list arguments;
    fprintf(stderr, "finding: seed %llu, call %ld, %s: ", (unsigned long long)h->seed, h->call, h->doing);
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fprintf(stderr, "\n");
    fflush(stderr);
    _Exit(1);
}

/* Chance */

static uint64_t draw(host *h)
{
    h->random ^= h->random << 13;
    h->random ^= h->random >> 7;
    h->random ^= h->random << 17;
    return h->random;
}

static unsigned below(host *h, unsigned n)
{
    return (unsigned)((draw(h) >> 20) % n);
}

static bool one_in(host *h, unsigned n)
{
    return below(h, n) == 0;
}

static double uniform(host *h, double low, double high)
{
    return low + (high - low) * ((double)(draw(h) >> 11) * 0x1p-53);
}

static double odd_number(host *h)
{
    static const double odd[] = {0.0, -0.0, NAN, INFINITY, -INFINITY, 5e-324, -5e-324, 2.2e-308, DBL_MAX, -DBL_MAX, 1e300, -1e22,
                                 1e15, 1e-300, -1.0, 1e9, 3.141592653589793, 6.283185307179586, 1e-9, 0.1};
    return odd[below(h, sizeof odd / sizeof *odd)];
}

static double number(host *h)
{
    return one_in(h, 6) ? odd_number(h) : uniform(h, -7.0, 7.0);
}

static unsigned reference(host *h)
{
    static const unsigned odd[] = {0u, KF_VARIABLES, KF_VARIABLES + 1u, 0xffffffffu, 0x80000000u, 0x7fffffffu, KF_REALS,
                                   KF_REALS + 1u, KF_REALS + 2u, KF_STATUS, KF_ITERATIONS, KF_DRIVEN_BY_TIME, KF_MESSAGE_TEXT,
                                   KF_TIME};
    if (one_in(h, 12)) {
        return one_in(h, 4) ? (unsigned)draw(h) : odd[below(h, sizeof odd / sizeof *odd)];
    }
    return 1u + below(h, KF_VARIABLES);
}

/* Arguments: arrays of exactly as many elements as are announced, or NULL */

static void *array_of(size_t count, size_t size)
{
    void *const made = calloc(count ? count : 1, size);
    if (made == NULL) {
        _Exit(2);
    }
    return count ? made : (free(made), malloc(0));
}

static size_t a_count(host *h)
{
    return one_in(h, 10) ? 0 : one_in(h, 20) ? 150 : 1 + below(h, 6);
}

static unsigned *references(host *h, size_t n)
{
    unsigned *const made = array_of(n, sizeof *made);
    size_t k;
    const unsigned first = 1u + below(h, KF_REALS);
    const bool in_order = one_in(h, 2); /* what most hosts ask for: neighbours that are there */
    for (k = 0; k < n; ++k) {
        made[k] = in_order ? 1u + (first + (unsigned)k) % KF_REALS : reference(h);
    }
    return made;
}

static double *numbers(host *h, size_t n)
{
    double *const made = array_of(n, sizeof *made);
    size_t k;
    for (k = 0; k < n; ++k) {
        made[k] = number(h);
    }
    return made;
}

static void *or_null(host *h, void *array, bool *is_null)
{
    if (one_in(h, 40)) {
        *is_null = true;
        return NULL;
    }
    return array;
}

static size_t other_count(host *h, size_t n, bool *is_wrong)
{
    const size_t other = FMI == 3 && one_in(h, 40) ? (one_in(h, 2) ? n + 1 : SIZE_MAX) : n;
    *is_wrong = *is_wrong || other != n;
    return other;
}

/* Answers */

static void note(host *h, const void *bytes, size_t size)
{
    const unsigned char *const b = bytes;
    size_t k;
    for (k = 0; k < size; ++k) {
        h->seen = (h->seen ^ b[k]) * 1099511628211u;
    }
}

static int answered(host *h, int answer)
{
    note(h, &answer, sizeof answer);
    if (answer < OK || answer > ERROR) {
        fail(h, "the answer is %d", answer);
    }
    return answer;
}

static int refused(host *h, int answer, bool must_be)
{
    if (must_be && answered(h, answer) != ERROR) {
        fail(h, "wrong arguments are answered with %d", answer);
    }
    return answered(h, answer);
}

static void heard(const host *h, const char *message)
{
    size_t k;
    if (message == NULL || !*message || strlen(message) > 2000 || strchr(message, '\n')) {
        fail(h, "a message is empty, too long or has several lines");
    }
    for (k = 0; FMI == 2 && message[k]; ++k) {
        if (message[k] == '%' && message[++k] != '%') {
            fail(h, "a message is a format: %s", message);
        }
    }
}

#if FMI == 2
static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                   fmi2String message, ...)
{
    (void)name;
    (void)status;
    (void)category;
    heard(environment, message);
}
#else
static void logger(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)status;
    (void)category;
    heard(environment, message);
}
#endif

/* Life */

static component made(host *h, bool model_exchange, bool has_events, const char *token)
{
    const bool quiet = one_in(h, 8);
#if FMI == 2
    (void)has_events;
    const fmi2CallbackFunctions callbacks = {logger, NULL, NULL, NULL, h};
    const fmi2CallbackFunctions silent = {NULL, NULL, NULL, NULL, NULL};
    return fmi2Instantiate(one_in(h, 9) ? NULL : "%n%s", model_exchange ? fmi2ModelExchange : fmi2CoSimulation, token,
                           one_in(h, 2) ? NULL : "file:///%n", !quiet ? &callbacks : one_in(h, 2) ? &silent : NULL,
                           (int)below(h, 2), (int)below(h, 2));
#else
    const fmi3LogMessageCallback log = quiet ? NULL : logger;
    if (model_exchange) {
        return fmi3InstantiateModelExchange(one_in(h, 9) ? NULL : "%n", token, NULL, false, true, h, log);
    }
    return fmi3InstantiateCoSimulation(one_in(h, 9) ? NULL : "%n", token, NULL, false, true, has_events, h->seed % 2, NULL, 0,
                                       h, log, NULL);
#endif
}

static int enter(host *h, slot *s, double t, bool stops)
{
#if FMI == 2
    const int answer = fmi2SetupExperiment(s->c, one_in(h, 2), number(h), t, stops, t + number(h));
    return answer == OK ? (int)fmi2EnterInitializationMode(s->c) : answer;
#else
    return fmi3EnterInitializationMode(s->c, one_in(h, 2), number(h), t, stops, t + number(h));
#endif
}

static int set_inputs(slot *s, const double *values)
{
    unsigned list[INPUTS];
    unsigned k;
    for (k = 0; k < INPUTS; ++k) {
        list[k] = FIRST_INPUT + k;
    }
#if FMI == 2
    return fmi2SetReal(s->c, list, INPUTS, values);
#else
    return fmi3SetFloat64(s->c, list, INPUTS, values, INPUTS);
#endif
}

static int get_all(component c, double *values)
{
    unsigned list[KF_REALS];
    unsigned k;
    for (k = 0; k < KF_REALS; ++k) {
        list[k] = 1u + k;
    }
#if FMI == 2
    return fmi2GetReal(c, list, KF_REALS, values);
#else
    return fmi3GetFloat64(c, list, KF_REALS, values, KF_REALS);
#endif
}

static int step(slot *s, double t, double size)
{
#if FMI == 2
    return fmi2DoStep(s->c, t, size, fmi2True);
#else
    bool event = true, stop = true, early = true;
    double last;
    const int answer = fmi3DoStep(s->c, t, size, true, &event, &stop, &early, &last);
    if (answer < DISCARD && event && fmi3EnterEventMode(s->c) == OK) {
        fmi3UpdateDiscreteStates(s->c, &early, &stop, NULL, NULL, &event, &last);
        fmi3EnterStepMode(s->c);
    }
    return answer;
#endif
}

static void begin(host *h, slot *s)
{
    const double t = one_in(h, 10) ? number(h) : one_in(h, 2) ? 0.0 : uniform(h, -1.0, 1.0);
    if (answered(h, enter(h, s, t, one_in(h, 9))) == OK) {
        s->t = t;
        s->running = answered(h, CALL(ExitInitializationMode)(s->c)) == OK;
        if (s->running && s->model_exchange) {
            answered(h, CALL(EnterContinuousTimeMode)(s->c));
        }
#if FMI == 3
        if (s->running && s->has_events) {
            answered(h, fmi3EnterStepMode(s->c));
        }
#endif
    }
}

static void free_state(host *h, slot *s, unsigned k)
{
#if FMI == 2
    answered(h, fmi2FreeFMUstate(s->c, &s->states[k]));
#else
    answered(h, fmi3FreeFMUState(s->c, &s->states[k]));
#endif
    if (s->states[k] != NULL) {
        fail(h, "a freed state is not NULL");
    }
}

static void end(host *h, slot *s)
{
    unsigned k;
    for (k = 0; s->c && k < STATES; ++k) {
        free_state(h, s, k);
    }
    CALL(FreeInstance)(s->c);
    memset(s, 0, sizeof *s);
}

static void create(host *h, slot *s)
{
    end(h, s);
    if (one_in(h, 20) && made(h, one_in(h, 2), one_in(h, 2), one_in(h, 2) ? NULL : "%n{other}") != NULL) {
        fail(h, "a wrong token is taken");
    }
    s->model_exchange = one_in(h, 3);
    s->has_events = FMI == 3 && !s->model_exchange && one_in(h, 2);
    s->c = made(h, s->model_exchange, s->has_events, KF_TOKEN);
    if (s->c == NULL) {
        fail(h, "there is no instance");
    }
    if (!one_in(h, 5)) {
        begin(h, s);
    }
}

/* What a reset instance answers is what a fresh one does. */
static void check_reset(host *h, slot *s)
{
    slot fresh = {0};
    double of_reset[KF_REALS], of_fresh[KF_REALS], inputs[INPUTS];
    slot *const both[2] = {s, &fresh};
    uint64_t random;
    int k, i;
    fresh.model_exchange = s->model_exchange;
    fresh.c = made(h, s->model_exchange, s->has_events, KF_TOKEN);
    answered(h, CALL(Reset)(s->c));
    s->running = false;
    memset(inputs, 0, sizeof inputs);
    inputs[0] = uniform(h, -3.0, 3.0);
    random = h->random;
    for (k = 0; k < 2; ++k) {
        h->random = random; /* the same tolerance for both */
        enter(h, both[k], 0.0, false);
        CALL(ExitInitializationMode)(both[k]->c);
#if FMI == 3
        if (s->has_events) {
            fmi3EnterStepMode(both[k]->c);
        }
#endif
        for (i = 0; i < 3; ++i) {
            set_inputs(both[k], inputs);
            step(both[k], 0.1 * i, 0.1);
        }
    }
    if (get_all(s->c, of_reset) != get_all(fresh.c, of_fresh) || memcmp(of_reset, of_fresh, sizeof of_fresh) != 0) {
        fail(h, "a reset instance is not as a fresh one");
    }
    end(h, &fresh);
    create(h, s);
}

/* Calls */

static void get_real(host *h, slot *s)
{
    const size_t n = a_count(h);
    bool wrong = false;
    unsigned *const r = references(h, n);
    double *const v = array_of(n, sizeof *v);
    unsigned *const given = or_null(h, r, &wrong);
    double *const into = or_null(h, v, &wrong);
    size_t k;
    int answer;
    wrong = wrong && n;
#if FMI == 2
    answer = fmi2GetReal(s->c, given, n, into);
#else
    answer = fmi3GetFloat64(s->c, given, n, into, other_count(h, n, &wrong));
#endif
    refused(h, answer, wrong);
    for (k = 0; answer == OK && k < n; ++k) {
        if (!isfinite(v[k])) {
            fail(h, "value reference %u is %g with OK", r[k], v[k]);
        }
        note(h, &v[k], sizeof v[k]);
    }
    free(r);
    free(v);
}

static void set_real(host *h, slot *s)
{
    const size_t n = a_count(h);
    bool wrong = false;
    unsigned *const r = references(h, n);
    double *const v = numbers(h, n);
    unsigned *const given = or_null(h, r, &wrong);
    double *const values = or_null(h, v, &wrong);
    int answer;
    wrong = wrong && n;
#if FMI == 2
    answer = fmi2SetReal(s->c, given, n, values);
#else
    answer = fmi3SetFloat64(s->c, given, n, values, other_count(h, n, &wrong));
#endif
    refused(h, answer, wrong);
    free(r);
    free(v);
}

#if TORQUE
static void continuous_states(host *h, slot *s)
{
    const size_t n = 2 * KF_DRIVERS, other = one_in(h, 2) ? n + 1 : one_in(h, 2) ? 0 : SIZE_MAX;
    double *const values = numbers(h, n), *const into = array_of(n, sizeof *into);
    size_t k;
    int answer;
    refused(h, CALL(SetContinuousStates)(s->c, values, other), true);
    refused(h, CALL(SetContinuousStates)(s->c, NULL, n), true);
    refused(h, CALL(GetContinuousStates)(s->c, into, other), true);
    refused(h, CALL(GetContinuousStates)(s->c, NULL, n), true);
    refused(h, CALL(GetNominalsOfContinuousStates)(s->c, NULL, n), true);
    refused(h, CALL(GetNominalsOfContinuousStates)(s->c, into, other), true);
    answered(h, CALL(GetNominalsOfContinuousStates)(s->c, into, n));
    for (k = 0; k < n; ++k) {
        if (!(into[k] > 0.0 && isfinite(into[k]))) {
            fail(h, "the nominal value of state %zu is %g", k, into[k]);
        }
    }
    answered(h, CALL(SetContinuousStates)(s->c, values, n));
    answered(h, CALL(GetContinuousStates)(s->c, into, n));
    note(h, into, n * sizeof *into);
#if FMI == 2
    refused(h, fmi2GetDerivatives(s->c, NULL, n), true);
    refused(h, fmi2GetDerivatives(s->c, into, other), true);
    answer = answered(h, fmi2GetDerivatives(s->c, into, n));
#else
    refused(h, fmi3GetContinuousStateDerivatives(s->c, NULL, n), true);
    refused(h, fmi3GetContinuousStateDerivatives(s->c, into, other), true);
    answer = answered(h, fmi3GetContinuousStateDerivatives(s->c, into, n));
#endif
    for (k = 0; answer == OK && k < n; ++k) {
        if (!isfinite(into[k])) {
            fail(h, "the derivative of state %zu is %g with OK", k, into[k]);
        }
    }
    free(values);
    free(into);
}
#endif

static void drive(host *h, slot *s)
{
    double values[INPUTS];
    bool wrong = false;
    unsigned k;
    for (k = 0; k < INPUTS; ++k) {
        values[k] = one_in(h, 30) ? odd_number(h) : uniform(h, -4.0, 4.0);
        wrong = wrong || !(fabs(values[k]) <= 1e100);
    }
    refused(h, set_inputs(s, values), wrong);
}

static void read_all(host *h, slot *s)
{
    double *const values = array_of(KF_REALS, sizeof *values);
    unsigned k;
    if (answered(h, get_all(s->c, values)) == OK) {
        for (k = 0; k < KF_REALS; ++k) {
            if (!isfinite(values[k])) {
                fail(h, "value reference %u is %g with OK", k + 1, values[k]);
            }
        }
        note(h, values, KF_REALS * sizeof *values);
    }
    free(values);
}

static void do_step(host *h, slot *s)
{
    const double usual = h->seed % 4 == 3 ? 1e-200 : 0.3; /* no time at all, or some */
    double t = s->t, size = one_in(h, 8) ? 0.0 : uniform(h, 0.0, usual);
    int answer;
    if (one_in(h, 16)) {
        t = one_in(h, 2) ? odd_number(h) : number(h);
    }
    if (one_in(h, 16)) {
        size = one_in(h, 2) ? odd_number(h) : number(h);
    }
    answer = step(s, t, size);
    refused(h, answer, s->model_exchange || !s->running || !isfinite(t + size) || size < 0.0);
    if (answer == OK || answer == WARNING) {
        s->t = t + size;
    }
}

/* Integer, Boolean, String and all other types. */
#if FMI == 2
#define TYPED(word, most)                                                                                              \
    do {                                                                                                               \
        fmi2##word *const v = array_of(n, sizeof *v);                                                                  \
        size_t k;                                                                                                      \
        for (k = 0; (most) && k < n; ++k) {                                                                            \
            v[k] = (fmi2##word)(intptr_t)below(h, (most) + 1u);                                                        \
        }                                                                                                              \
        void *const into = or_null(h, v, &wrong);                                                                      \
        answer = gets ? fmi2Get##word(s->c, given, n, into) : fmi2Set##word(s->c, given, n, into);                     \
        free(v);                                                                                                       \
    } while (0)
#else
#define TYPED(word, most)                                                                                              \
    do {                                                                                                               \
        fmi3##word *const v = array_of(n, sizeof *v);                                                                  \
        size_t k;                                                                                                      \
        for (k = 0; (most) && k < n; ++k) {                                                                            \
            v[k] = (fmi3##word)(intptr_t)below(h, (most) + 1u);                                                        \
        }                                                                                                              \
        void *const into = or_null(h, v, &wrong);                                                                      \
        const size_t nv = other_count(h, n, &miscounted);                                                              \
        answer = gets ? fmi3Get##word(s->c, given, n, into, nv) : fmi3Set##word(s->c, given, n, into, nv);             \
        free(v);                                                                                                       \
    } while (0)
#endif

static void typed(host *h, slot *s)
{
    static const unsigned special[] = {KF_STATUS, KF_ITERATIONS, KF_DRIVEN_BY_TIME, KF_MESSAGE_TEXT, KF_RATES, KF_SOLVER_OK};
    const size_t n = a_count(h);
    bool wrong = false, miscounted = false;
    (void)miscounted;
    unsigned *const r = references(h, n);
    unsigned *const given = or_null(h, r, &wrong);
    const bool gets = !one_in(h, 3);
    int answer = OK;
    if (n == 1) {
        *r = special[below(h, 6)];
    }
#if FMI == 2
    switch (below(h, 3)) {
    case 0: TYPED(Integer, 5); break;
    case 1: TYPED(Boolean, 1); break;
    default: TYPED(String, 0); break;
    }
#else
    switch (below(h, 12)) {
    case 0: TYPED(Float32, 5); break;
    case 1: TYPED(Int8, 5); break;
    case 2: TYPED(UInt8, 5); break;
    case 3: TYPED(Int16, 5); break;
    case 4: TYPED(UInt16, 5); break;
    case 5: TYPED(Int32, 5); break;
    case 6: TYPED(UInt32, 5); break;
    case 7: TYPED(Int64, 5); break;
    case 8: TYPED(UInt64, 5); break;
    case 9: TYPED(Boolean, 1); break;
    case 10: TYPED(String, 0); break;
    default: {
        double intervals[1];
        fmi3UInt64 counters[1];
        fmi3IntervalQualifier qualifiers[1];
        answer = n ? ERROR : OK;
#define NOT(call) ((int)fmi3##call != answer)
        if (NOT(GetClock(s->c, given, n, NULL)) || NOT(SetClock(s->c, given, n, NULL)) ||
            NOT(GetBinary(s->c, given, n, NULL, NULL, n)) || NOT(SetBinary(s->c, given, n, NULL, NULL, n)) ||
            NOT(GetIntervalDecimal(s->c, given, n, intervals, qualifiers)) ||
            NOT(GetIntervalFraction(s->c, given, n, counters, counters, qualifiers)) ||
            NOT(GetShiftDecimal(s->c, given, n, intervals)) ||
            NOT(GetShiftFraction(s->c, given, n, counters, counters)) ||
            NOT(SetIntervalDecimal(s->c, given, n, intervals)) ||
            NOT(SetIntervalFraction(s->c, given, n, counters, counters)) ||
            NOT(SetShiftDecimal(s->c, given, n, intervals)) ||
            NOT(SetShiftFraction(s->c, given, n, counters, counters))) {
            fail(h, "there are no clocks and no binaries");
        }
        break;
    }
    }
#endif
    refused(h, answer, wrong && n);
    free(r);
}

static void directional(host *h, slot *s)
{
    const size_t n = a_count(h) % 8, m = a_count(h) % 8;
    bool wrong_u = false, wrong_k = false, miscounted = false;
    (void)miscounted;
    unsigned *const unknowns = references(h, n), *const knowns = references(h, m);
    double *const seed = numbers(h, m), *const slope = array_of(n, sizeof *slope);
    unsigned *const given_u = or_null(h, unknowns, &wrong_u), *const given_k = or_null(h, knowns, &wrong_k);
    size_t k;
    int answer;
    for (k = 0; k < m && !one_in(h, 6); ++k) {
        knowns[k] = one_in(h, 2) ? FIRST_INPUT + below(h, INPUTS) : 1u + below(h, 3 * KF_DRIVERS);
    }
#if FMI == 2
    answer = fmi2GetDirectionalDerivative(s->c, given_u, n, given_k, m, or_null(h, seed, &wrong_k), or_null(h, slope, &wrong_u));
#else
    answer = fmi3GetDirectionalDerivative(s->c, given_u, n, given_k, m, or_null(h, seed, &wrong_k),
                                          other_count(h, m, &miscounted), or_null(h, slope, &wrong_u),
                                          other_count(h, n, &miscounted));
#endif
    refused(h, answer, (wrong_u && n) || (wrong_k && m) || miscounted);
    if (answer == OK) {
        note(h, slope, n * sizeof *slope);
    }
    free(unknowns);
    free(knowns);
    free(seed);
    free(slope);
}

#if FMI == 3
static void adjoint(host *h, slot *s)
{
    const size_t n = a_count(h) % 8, m = a_count(h) % 8;
    bool wrong_u = false, wrong_k = false, miscounted = false;
    unsigned *const unknowns = references(h, n), *const knowns = references(h, m);
    double *const seed = numbers(h, n), *const slope = array_of(m, sizeof *slope);
    unsigned *const given_u = or_null(h, unknowns, &wrong_u), *const given_k = or_null(h, knowns, &wrong_k);
    size_t k;
    int answer;
    for (k = 0; k < m && !one_in(h, 6); ++k) {
        knowns[k] = one_in(h, 2) ? FIRST_INPUT + below(h, INPUTS) : 1u + below(h, 3 * KF_DRIVERS);
    }
    answer = fmi3GetAdjointDerivative(s->c, given_u, n, given_k, m, or_null(h, seed, &wrong_u),
                                      other_count(h, n, &miscounted), or_null(h, slope, &wrong_k),
                                      other_count(h, m, &miscounted));
    refused(h, answer, (wrong_u && n) || (wrong_k && m) || miscounted);
    if (answer == OK) {
        note(h, slope, m * sizeof *slope);
    }
    free(unknowns);
    free(knowns);
    free(seed);
    free(slope);
}
#endif

static int an_order(host *h)
{
    static const int odd[] = {0, -1, 4, 2147483647, -2147483647 - 1};
    return one_in(h, 5) ? odd[below(h, 5)] : 1 + (int)below(h, 3);
}

static void derivatives(host *h, slot *s)
{
    const size_t n = a_count(h) % 8;
    bool wrong = false, sets = FMI == 2 && one_in(h, 2);
    unsigned *const r = references(h, n);
    double *const v = numbers(h, n);
    int *const orders = array_of(n, sizeof *orders);
    unsigned *const given = or_null(h, r, &wrong);
    size_t k;
    int answer;
    for (k = 0; k < n; ++k) {
        orders[k] = an_order(h);
        if (sets && !one_in(h, 5)) {
            r[k] = FIRST_INPUT + below(h, INPUTS);
        }
    }
#if FMI == 2
    if (sets) {
        answer = fmi2SetRealInputDerivatives(s->c, given, n, or_null(h, orders, &wrong), or_null(h, v, &wrong));
    } else {
        answer = fmi2GetRealOutputDerivatives(s->c, given, n, or_null(h, orders, &wrong), or_null(h, v, &wrong));
    }
    wrong = wrong && n;
#else
    {
        int *const given_orders = or_null(h, orders, &wrong);
        double *const into = or_null(h, v, &wrong);
        wrong = wrong && n;
        answer = fmi3GetOutputDerivatives(s->c, given, n, given_orders, into, other_count(h, n, &wrong));
    }
#endif
    refused(h, answer, wrong);
    free(r);
    free(v);
    free(orders);
}

static void states(host *h, slot *s)
{
    const unsigned k = below(h, STATES);
    state *const one = &s->states[k];
    slot *const other = &h->slots[below(h, INSTANCES)];
    unsigned char *bytes;
    size_t size = 0, given;
    state copy = NULL;
    int answer;
#if FMI == 2
#define GET(c, to) fmi2GetFMUstate(c, to)
#define SET(c, from) fmi2SetFMUstate(c, from)
#define FREE(c, what) fmi2FreeFMUstate(c, what)
#define SIZE(c, of, to) fmi2SerializedFMUstateSize(c, of, to)
#define WRITE(c, of, to, size) fmi2SerializeFMUstate(c, of, (fmi2Byte *)(to), size)
#define READ(c, from, size, to) fmi2DeSerializeFMUstate(c, (const fmi2Byte *)(from), size, to)
#else
#define GET(c, to) fmi3GetFMUState(c, to)
#define SET(c, from) fmi3SetFMUState(c, from)
#define FREE(c, what) fmi3FreeFMUState(c, what)
#define SIZE(c, of, to) fmi3SerializedFMUStateSize(c, of, to)
#define WRITE(c, of, to, size) fmi3SerializeFMUState(c, of, to, size)
#define READ(c, from, size, to) fmi3DeserializeFMUState(c, from, size, to)
#endif
    switch (below(h, 8)) {
    case 0:
        refused(h, GET(s->c, NULL), true);
        refused(h, SET(s->c, NULL), true);
        refused(h, SIZE(s->c, *one, NULL), true);
        refused(h, WRITE(s->c, NULL, NULL, 0), true);
        refused(h, READ(s->c, NULL, 100, &copy), true);
        return;
    case 1:
    case 2:
        answered(h, GET(s->c, one));
        return;
    case 3:
        free_state(h, s, k);
        return;
    case 4:
        if (*one != NULL && answered(h, SET(s->c, *one)) == OK) {
            s->running = false; /* as it was then: not known here */
            create(h, s);
        }
        return;
    default: break;
    }
    if (*one == NULL) {
        answered(h, GET(s->c, one));
    }
    answered(h, SIZE(s->c, *one, &size));
    bytes = array_of(size + 1, 1);
    refused(h, WRITE(s->c, *one, bytes, size - 1), true);
    answered(h, WRITE(s->c, *one, bytes, size));
    given = one_in(h, 4) ? (one_in(h, 2) ? size + 1 : below(h, (unsigned)size)) : size;
    if (one_in(h, 2)) {
        unsigned flips = 1 + below(h, 3);
        while (flips--) {
            bytes[below(h, (unsigned)size)] ^= (unsigned char)(1u + below(h, 255));
        }
        answer = READ(other->c, bytes, given, &copy);
        if (answer != ERROR) { /* two changes may have cancelled */
            unsigned char *const whole = array_of(size, 1);
            WRITE(s->c, *one, whole, size);
            if (given != size || memcmp(whole, bytes, size) != 0) {
                fail(h, "a damaged state is taken");
            }
            free(whole);
        }
    } else {
        refused(h, answer = READ(other->c, bytes, given, &copy), given != size);
        if (answer == OK) {
            double before[KF_REALS], after[KF_REALS];
            const bool back = SET(s->c, *one) == OK;
            const int was = (int)get_all(s->c, before);
            refused(h, answer = SET(other->c, copy), s->model_exchange != other->model_exchange);
            if (answer == OK) {
                const int is = get_all(other->c, after);
                if (!back || was != is || memcmp(before, after, sizeof after) != 0) {
                    fail(h, "a state restored elsewhere does not show the same");
                }
            }
            create(h, s); /* its mode is that of the state, which is not known here */
            create(h, other);
        }
    }
    /* of any instance; NULL is no error */
    answered(h, FREE(s->c, &copy));
    free(bytes);
    if (s->c == NULL) {
        create(h, s);
    }
}

static void logging(host *h, slot *s)
{
    static const char *const names[] = {"logStatusError", "%n%n%s%s", "#r1#", "", NULL, "logAll", "logStatusDiscard"};
    const char *given[3];
    const size_t n = below(h, 4);
    size_t k;
    bool wrong = false;
    const char **list = given;
    for (k = 0; k < n; ++k) {
        given[k] = names[below(h, sizeof names / sizeof *names)];
    }
    if (n && one_in(h, 10)) {
        list = NULL;
        wrong = true;
    }
    refused(h, CALL(SetDebugLogging)(s->c, one_in(h, 3) ? 0 : 1, n, list), wrong);
}

/* Modes, and whatever takes few arguments. */
static void modes(host *h, slot *s)
{
    double numbers_of[2] = {number(h), number(h)};
    size_t count = 7;
    (void)count;
    (void)numbers_of;
    switch (below(h, 16)) {
    case 0: begin(h, s); break;
    case 1:
        if (answered(h, enter(h, s, number(h), one_in(h, 9))) == OK) {
            s->t = 0.0;
        }
        break;
    case 2: s->running = answered(h, CALL(ExitInitializationMode)(s->c)) == OK || s->running; break;
    case 3:
        if (one_in(h, 4) && answered(h, CALL(Terminate)(s->c)) == OK) {
            s->running = false;
        }
        break;
    case 4:
        answered(h, CALL(Reset)(s->c));
        s->running = false;
        break;
    case 5: answered(h, CALL(EnterEventMode)(s->c)); break;
    case 6: answered(h, CALL(EnterContinuousTimeMode)(s->c)); break;
    case 7: {
        const double t = one_in(h, 3) ? number(h) : s->t + uniform(h, 0.0, 0.1);
        refused(h, CALL(SetTime)(s->c, t), !s->model_exchange || !isfinite(t));
        break;
    }
#if FMI == 2
    case 8:
    case 9: {
        fmi2Boolean event, stop;
        answered(h, fmi2CompletedIntegratorStep(s->c, 1, one_in(h, 5) ? NULL : &event, one_in(h, 5) ? NULL : &stop));
        break;
    }
    case 10: {
        fmi2EventInfo info;
        refused(h, fmi2NewDiscreteStates(s->c, NULL), true);
        answered(h, fmi2NewDiscreteStates(s->c, &info));
        break;
    }
    case 11:
#if TORQUE
        continuous_states(h, s);
#else
        refused(h, fmi2SetContinuousStates(s->c, numbers_of, 2), true);
        refused(h, fmi2GetDerivatives(s->c, NULL, 1), true);
        answered(h, fmi2GetContinuousStates(s->c, NULL, 0));
        answered(h, fmi2GetNominalsOfContinuousStates(s->c, numbers_of, 0));
#endif
        refused(h, fmi2GetEventIndicators(s->c, NULL, SIZE_MAX), true);
        break;
    case 12: {
        fmi2Status status;
        fmi2Real time;
        fmi2Integer integer;
        fmi2Boolean boolean;
        fmi2String string;
        const fmi2StatusKind kind = (fmi2StatusKind)below(h, 5);
        answered(h, fmi2GetStatus(s->c, kind, one_in(h, 9) ? NULL : &status));
        answered(h, fmi2GetRealStatus(s->c, kind, one_in(h, 9) ? NULL : &time));
        answered(h, fmi2GetIntegerStatus(s->c, kind, one_in(h, 9) ? NULL : &integer));
        answered(h, fmi2GetBooleanStatus(s->c, kind, one_in(h, 9) ? NULL : &boolean));
        answered(h, fmi2GetStringStatus(s->c, kind, one_in(h, 9) ? NULL : &string));
        break;
    }
    case 13: refused(h, fmi2CancelStep(s->c), true); break;
#else
    case 8:
    case 9: {
        bool event, stop;
        answered(h, fmi3CompletedIntegratorStep(s->c, true, one_in(h, 5) ? NULL : &event, one_in(h, 5) ? NULL : &stop));
        break;
    }
    case 10: {
        bool flag;
        double time;
        answered(h, fmi3EvaluateDiscreteStates(s->c));
        answered(h, fmi3UpdateDiscreteStates(s->c, &flag, &flag, one_in(h, 3) ? NULL : &flag, &flag, &flag,
                                             one_in(h, 3) ? NULL : &time));
        break;
    }
    case 11:
#if TORQUE
        continuous_states(h, s);
#else
        refused(h, fmi3SetContinuousStates(s->c, numbers_of, 2), true);
        refused(h, fmi3GetContinuousStateDerivatives(s->c, NULL, 1), true);
        answered(h, fmi3GetContinuousStates(s->c, NULL, 0));
        answered(h, fmi3GetNominalsOfContinuousStates(s->c, numbers_of, 0));
#endif
        refused(h, fmi3GetEventIndicators(s->c, NULL, SIZE_MAX), true);
        answered(h, fmi3GetNumberOfEventIndicators(s->c, one_in(h, 3) ? NULL : &count));
        answered(h, fmi3GetNumberOfContinuousStates(s->c, one_in(h, 3) ? NULL : &count));
        break;
    case 12:
        answered(h, fmi3GetNumberOfVariableDependencies(s->c, reference(h), NULL));
        answered(h, fmi3GetVariableDependencies(s->c, reference(h), NULL, NULL, NULL, NULL, 3));
        adjoint(h, s);
        answered(h, fmi3ActivateModelPartition(s->c, reference(h), number(h)));
        answered(h, fmi3EnterConfigurationMode(s->c));
        answered(h, fmi3ExitConfigurationMode(s->c));
        break;
    case 13: refused(h, fmi3EnterStepMode(s->c), !s->has_events); break;
#endif
    case 14: check_reset(h, s); break;
    default: create(h, s); break;
    }
}

static const struct {
    const char *name;
    void (*call)(host *, slot *);
    unsigned weight;
} calls[] = {
    {"doStep", do_step, 8}, {"inputs", drive, 8}, {"all outputs", read_all, 4}, {"getReal", get_real, 4},
    {"setReal", set_real, 3}, {"other types", typed, 3}, {"directional derivatives", directional, 2},
    {"derivatives of inputs and outputs", derivatives, 2}, {"states", states, 3}, {"logging", logging, 1}, {"modes", modes, 4},
#if TORQUE
    {"continuous states", continuous_states, 2},
#endif
};

static double now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static void *run(void *given)
{
    host *const h = given;
    unsigned total = 0, k;
    h->random = (h->seed + 1) * 0x9e3779b97f4a7c15u;
    h->doing = "start";
    for (k = 0; k < sizeof calls / sizeof *calls; ++k) {
        total += calls[k].weight;
    }
    for (k = 0; k < INSTANCES; ++k) {
        create(h, &h->slots[k]);
    }
    for (h->call = 0; h->call < h->calls; ++h->call) {
        slot *const s = &h->slots[below(h, INSTANCES)];
        unsigned ticket = below(h, total);
        double began;
        for (k = 0; ticket >= calls[k].weight; ++k) {
            ticket -= calls[k].weight;
        }
        h->doing = calls[k].name;
        began = now();
        calls[k].call(h, s);
        if (now() - began > SLOWEST) {
            fail(h, "the call takes %.0f s", now() - began);
        }
    }
    for (k = 0; k < INSTANCES; ++k) {
        end(h, &h->slots[k]);
    }
    return NULL;
}

int main(int count, char **arguments)
{
    const uint64_t seed = count > 1 ? strtoull(arguments[1], NULL, 10) : 0;
    const long calls_wanted = count > 2 ? atol(arguments[2]) : 1000;
    host alone[2] = {{0}}, parallel[2] = {{0}};
    pthread_t threads[2];
    int k;
    for (k = 0; k < 2; ++k) {
        alone[k].seed = parallel[k].seed = seed + 1000003u * (unsigned)k;
        alone[k].calls = parallel[k].calls = calls_wanted;
    }
    if (count <= 3 || atoi(arguments[3]) < 2) {
        run(&alone[0]);
        return 0;
    }
    for (k = 0; k < 2; ++k) {
        if (pthread_create(&threads[k], NULL, run, &parallel[k]) != 0) {
            return 2;
        }
    }
    for (k = 0; k < 2; ++k) {
        pthread_join(threads[k], NULL);
        run(&alone[k]);
        if (alone[k].seen != parallel[k].seen) {
            fail(&parallel[k], "next to another thread the answers differ");
        }
    }
    return 0;
}
