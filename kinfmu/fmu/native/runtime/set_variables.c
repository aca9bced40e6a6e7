/* Setting variables: inputs, parameters, constants of laws, states and efforts. */
#include "instance.h"

#include <math.h>
#include <string.h>

static KF_RARE kf_answer set_other(kf_instance *instance, unsigned reference, double value)
{
    kf_state *const s = &instance->now;
    const unsigned place = KF_PLACE(reference);
    const int part = place < KF_REALS ? kf_part_of[place] : KF_PARTS;
    const char *const name = kf_name_of(reference);
#if KF_TORQUE
    if (instance->updating && part != KF_PART_EFFORTS &&
        !(part == KF_PART_LOADS && place < (unsigned)(kf_part_first[part] + KF_LOAD_INPUTS))) {
        return kf_answered(instance, KF_ERROR, "%s cannot be set during a step; efforts and external loads can", name);
    }
    if (part == KF_PART_STATES && place % 3 == 2) { /* an acceleration is no state */
        return kf_not_settable(instance, reference, KF_REAL_WORD);
    }
#endif
#if KF_FORCES
    if (part == KF_PART_LOADS && fabs(value) <= KF_LARGEST && (value > 0.0 || !kf_real_is_positive[place])) {
        s->real[place] = value;
        kf_touch(s);
        if (s->ahead) {
            kf_forget(s);
        }
        s->known &= ~KF_FORCE_PARTS;
#if KF_TORQUE
        kf_forget_motion(s);
#endif
        return KF_DONE;
    }
    if (part != KF_PART_LOADS)
#endif
#if KF_TORQUE
    if (part != KF_PART_EFFORTS)
#endif
    if (part != KF_PART_INPUTS && part != KF_PART_CONSTANTS && part != KF_PART_PARAMETERS && part != KF_PART_TOLERANCE) {
        return kf_not_settable(instance, reference, KF_REAL_WORD);
    }
    if (!isfinite(value)) {
        return kf_answered(instance, KF_ERROR, "%s = %g is not a finite number; %.17g stays", name, value, s->real[place]);
    }
    if (fabs(value) > KF_LARGEST) {
        return kf_answered(instance, KF_ERROR, "%s = %g is too large: at most %g is taken; %.17g stays", name, value, KF_LARGEST,
                           s->real[place]);
    }
#if KF_TORQUE
    if (part == KF_PART_EFFORTS) {
        if (s->ahead) {
            kf_forget(s);
        }
        s->real[place] = value;
        kf_touch(s);
        kf_forget_motion(s);
        return KF_DONE;
    }
    if (part == KF_PART_STATES && s->mode > KF_INITIALIZATION) {
        return kf_answered(instance, KF_ERROR, "%s = %.17g comes too late: it is a state, which the FMU integrates once it is "
                      "initialized", name, value);
    }
    if (part == KF_PART_TOLERANCE && (int)place > kf_part_first[part] && !(value >= 1e-13 && value <= 1e-4)) {
        return kf_answered(instance, KF_ERROR, "%s = %g must be 1e-13 to 0.0001; %.17g stays", name, value, s->real[place]);
    }
#endif
    if (kf_real_is_positive[place] && !(value > 0.0)) {
        return kf_answered(instance, KF_ERROR, "%s = %.17g must be positive; %.17g stays", name, value, s->real[place]);
    }
    if (part == KF_PART_PARAMETERS) {
        if (s->mode > KF_INITIALIZATION) {
            return kf_answered(instance, KF_ERROR, "%s = %.17g comes too late: it is fixed once the FMU is initialized", name,
                          value);
        }
        s->unbound = true;
    }
    s->real[place] = value;
    kf_touch(s);
    kf_forget(s);
    return KF_DONE;
}

#if !KF_TORQUE
/* Input number k, the value finite. */
static void set_input(kf_state *s, unsigned k, double value)
{
    if (s->ahead) {
        kf_forget(s);
    }
    if (value != s->real[k]) {
        s->real[k] = value;
        s->stray = k + 1;
        if (k % 3 == 0) {
            kf_forget(s);
        } else {
            if (value != 0.0 && !s->wired[k]) {
                s->wired[k] = true;
                kf_find_rate_sources(s);
            }
            kf_forget_motion(s);
        }
    }
    kf_touch(s);
}
#endif

/* Refuse to set: an array is NULL, or the instance is terminated. */
static KF_RARE kf_answer set_nothing(const kf_instance *instance, const unsigned *references, size_t count,
                                     const double *values)
{
    const kf_answer answer = kf_check(instance, references, values, count);
    return answer == KF_DONE && instance->now.mode == KF_TERMINATED
               ? kf_answered(instance, KF_ERROR, "nothing can be set after terminate")
               : answer;
}

kf_answer kf_set_real(kf_instance *instance, const unsigned *references, size_t count, const double *values)
{
    kf_state *const s = &instance->now;
    size_t k;
    if (instance == NULL || references == NULL || values == NULL || s->mode == KF_TERMINATED) {
        return set_nothing(instance, references, count, values);
    }
    for (k = 0; k < count; ++k) {
        const unsigned place = KF_PLACE(references[k]);
        const double value = values[k];
#if KF_TORQUE
        (void)s;
        (void)place;
        {
#else
        if (place < 3 * KF_DRIVERS && fabs(value) <= KF_LARGEST) { /* inputs come first */
            set_input(s, place, value);
        } else {
#endif
            const kf_answer answer = set_other(instance, references[k], value);
            if (answer != KF_DONE) {
                return answer;
            }
        }
    }
    return KF_DONE;
}

/* The parameter `rates`. */
kf_answer kf_set_count(kf_instance *instance, unsigned reference, const char *type, long long value)
{
    kf_state *const s = &instance->now;
    if (reference != KF_RATES || strcmp(type, KF_ENUMERATION_WORD) != 0) {
        return kf_not_settable(instance, reference, type);
    }
    if (value != KF_RATES_AUTO && value != KF_RATES_ESTIMATED && value != KF_RATES_WIRED) {
        return kf_answered(instance, KF_ERROR, "rates = %lld must be %d (auto), %d (estimated) or %d (wired); %d stays", value,
                           KF_RATES_AUTO, KF_RATES_ESTIMATED, KF_RATES_WIRED, s->rates);
    }
    if (value != s->rates) {
        if (s->mode > KF_INITIALIZATION) {
            return kf_answered(instance, KF_ERROR, "rates = %lld comes too late: it is fixed once the FMU is initialized", value);
        }
        s->rates = (int)value;
        kf_find_rate_sources(s);
        kf_forget_motion(s);
    }
    return KF_DONE;
}

kf_answer kf_set_boolean(kf_instance *instance, unsigned reference, bool value)
{
    kf_state *const s = &instance->now;
    if (reference != KF_DRIVEN_BY_TIME) {
        return kf_not_settable(instance, reference, "Boolean");
    }
    if (value != s->driven_by_time) {
        if (s->mode > KF_INITIALIZATION) {
            return kf_answered(instance, KF_ERROR, "driven_by_time = %s comes too late: it is fixed once the FMU is initialized",
                          value ? "true" : "false");
        }
        s->driven_by_time = value;
        kf_forget(s);
    }
    return KF_DONE;
}
