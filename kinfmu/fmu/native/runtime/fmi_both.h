/* Functions that FMI 2.0 and FMI 3.0 define in the same way. fmi2.c and fmi3.c include this file, after
 *
 *     FMI(name)             the name in that version: fmi2##name or fmi3##name
 *     VALUE_COUNT           of lists of values: `, size_t value_count` in FMI 3.0, else nothing
 *     CHECKED               kf_answer of `references`, `count`, `values` and, in FMI 3.0, `value_count`
 */
#if defined(__GNUC__) /* FMI gives the signatures; many functions need only some of their arguments */
#pragma GCC diagnostic ignored "-Wunused-parameter"
#elif defined(_MSC_VER)
#pragma warning(disable : 4100)
#endif

static FMI(Status) unsupported(void *c, const char *what)
{
    return c ? (FMI(Status))kf_answered(common(c), KF_ERROR, "%s", what) : FMI(Error);
}

/* Define a function that makes `call` for each number k of a list of variables, until an answer is not Done. After the list
 * it has the parameters given: `values`, which `call` reads or writes, last.
 */
#define FOR_EACH(function, call, ...)                                                                                  \
    FMI(Status) function(void *c, const FMI(ValueReference) references[], size_t count, __VA_ARGS__ VALUE_COUNT)       \
    {                                                                                                                  \
        kf_answer answer = CHECKED;                                                                                    \
        size_t k;                                                                                                      \
        for (k = 0; answer == KF_DONE && k < count; ++k) {                                                             \
            call;                                                                                                      \
        }                                                                                                              \
        return (FMI(Status))answer;                                                                                    \
    }

#define GET_COUNTS(function, type, word)                                                                               \
    FOR_EACH(function, {                                                                                               \
        long long number = 0;                                                                                          \
        answer = kf_get_count(common(c), references[k], word, &number);                                                \
        values[k] = (type)number;                                                                                      \
    }, type values[])

#define SET_COUNTS(function, type, word)                                                                               \
    FOR_EACH(function, answer = kf_set_count(common(c), references[k], word, values[k]), const type values[])

FOR_EACH(FMI(GetBoolean), {
    bool flag = false;
    answer = kf_get_boolean(common(c), references[k], &flag);
    values[k] = flag;
}, FMI(Boolean) values[])

FOR_EACH(FMI(SetBoolean), answer = kf_set_boolean(common(c), references[k], values[k]), const FMI(Boolean) values[])

FOR_EACH(FMI(GetString), answer = kf_get_string(common(c), references[k], &values[k]), FMI(String) values[])

#define OUTPUT_DERIVATIVES(function, order_type)                                                                       \
    FOR_EACH(function, answer = orders ? kf_output_derivative(common(c), references[k], orders[k], &values[k])         \
                                       : kf_no_array(common(c), count), const order_type orders[], double values[])

FMI(Status) FMI(SetDebugLogging)(void *c, FMI(Boolean) loggingOn, size_t nCategories, const FMI(String) categories[])
{
    return c ? (FMI(Status))kf_set_logging(common(c), loggingOn, nCategories, categories) : FMI(Error);
}

/* Life cycle */

void FMI(FreeInstance)(void *c)
{
    free(c);
}

FMI(Status) FMI(ExitInitializationMode)(void *c)
{
    return c ? (FMI(Status))kf_exit_initialization(common(c)) : FMI(Error);
}

FMI(Status) FMI(Terminate)(void *c)
{
    return c ? (FMI(Status))kf_enter(common(c), KF_TERMINATED, KF_TERMINATE) : FMI(Error);
}

FMI(Status) FMI(Reset)(void *c)
{
    if (c == NULL) {
        return FMI(Error);
    }
    kf_start(common(c), common(c)->now.model_exchange);
    return FMI(OK);
}

/* States */

FMI(Status) FMI(GetFMUState)(void *c, FMI(FMUState) *state)
{
    return c ? (FMI(Status))kf_copy_state(common(c), state) : FMI(Error);
}

FMI(Status) FMI(SetFMUState)(void *c, FMI(FMUState) state)
{
    return c ? (FMI(Status))kf_restore_state(common(c), state) : FMI(Error);
}

FMI(Status) FMI(FreeFMUState)(void *c, FMI(FMUState) *state)
{
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return FMI(OK);
}

FMI(Status) FMI(SerializedFMUStateSize)(void *c, FMI(FMUState) state, size_t *size)
{
    if (c == NULL || size == NULL) {
        return FMI(Error);
    }
    *size = kf_serialized_size();
    return FMI(OK);
}

FMI(Status) FMI(SerializeFMUState)(void *c, FMI(FMUState) state, FMI(Byte) bytes[], size_t size)
{
    return c ? (FMI(Status))kf_serialize(common(c), state, (unsigned char *)bytes, size) : FMI(Error);
}

FMI(Status) FMI(DeserializeFMUState)(void *c, const FMI(Byte) bytes[], size_t size, FMI(FMUState) *state)
{
    return c ? (FMI(Status))kf_deserialize(common(c), (const unsigned char *)bytes, size, state) : FMI(Error);
}

/* Model exchange: value and speed of each driver are states if efforts drive; events are jumps of laws over time and changes
 * of status.
 */

FMI(Status) FMI(EnterEventMode)(void *c)
{
    return c ? (FMI(Status))kf_enter_events(common(c)) : FMI(Error);
}

FMI(Status) FMI(EnterContinuousTimeMode)(void *c)
{
    return c ? (FMI(Status))kf_enter(common(c), KF_CONTINUOUS, KF_ENTER_CONTINUOUS) : FMI(Error);
}

static void put(FMI(Boolean) *place, bool value)
{
    if (place) {
        *place = value;
    }
}

FMI(Status) FMI(CompletedIntegratorStep)(void *c, FMI(Boolean) noSetFMUStatePriorToCurrentPoint,
                                         FMI(Boolean) *enterEventMode, FMI(Boolean) *terminateSimulation)
{
    bool wants_event = false;
    const kf_answer answer = c ? kf_complete_integrator_step(common(c), &wants_event) : KF_ERROR;
    put(enterEventMode, wants_event);
    put(terminateSimulation, c && common(c)->now.terminated);
    return (FMI(Status))answer;
}

FMI(Status) FMI(SetTime)(void *c, double time)
{
    return c ? (FMI(Status))kf_set_time(common(c), time) : FMI(Error);
}

FMI(Status) FMI(SetContinuousStates)(void *c, const double states[], size_t count)
{
    return c ? (FMI(Status))kf_set_states(common(c), states, count) : FMI(Error);
}

FMI(Status) FMI(GetContinuousStates)(void *c, double states[], size_t count)
{
    return c ? (FMI(Status))kf_get_states(common(c), states, count) : FMI(Error);
}

FMI(Status) FMI(GetContinuousStateDerivatives)(void *c, double derivatives[], size_t count)
{
    return c ? (FMI(Status))kf_get_state_derivatives(common(c), derivatives, count) : FMI(Error);
}

FMI(Status) FMI(GetNominalsOfContinuousStates)(void *c, double nominals[], size_t count)
{
    size_t k;
    if (c == NULL || count != KF_STATES || (count && nominals == NULL)) {
        return unsupported(c, KF_STATES ? "there are two continuous states for each driver" : KF_NO_STATES);
    }
    for (k = 0; k < count; ++k) {
        nominals[k] = kf_driver_is_angle[k / 2] ? 1.0 : kf_size;
    }
    return FMI(OK);
}

FMI(Status) FMI(GetEventIndicators)(void *c, double indicators[], size_t count)
{
    return count == 0 && c ? FMI(OK) : unsupported(c, KF_STATES ? "there are no event indicators" : KF_NO_STATES);
}
