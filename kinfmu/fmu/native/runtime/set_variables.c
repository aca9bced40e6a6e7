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
    if (instance->updating && kf_followed(place) < 0) {
        return kf_answered(instance, KF_ERROR, "%s cannot be set during a step; efforts and external loads can", name);
    }
    if (!kf_is_given(place)) {
        return kf_not_settable(instance, reference, KF_REAL_WORD);
    }
    if (!isfinite(value)) {
        return kf_answered(instance, KF_ERROR, "%s = %g is not a finite number; %.17g stays", name, value, s->real[place]);
    }
    if (fabs(value) > KF_LARGEST) {
        return kf_answered(instance, KF_ERROR, "%s = %g is too large: at most %g is taken; %.17g stays", name, value, KF_LARGEST,
                           s->real[place]);
    }
    if (part == KF_PART_TOLERANCE && (int)place > kf_part_first[part] && !(value >= 1e-13 && value <= 1e-4)) {
        return kf_answered(instance, KF_ERROR, "%s = %g must be 1e-13 to 0.0001; %.17g stays", name, value, s->real[place]);
    }
    if (kf_real_is_positive[place] && !(value > 0.0)) {
        return kf_answered(instance, KF_ERROR, "%s = %.17g must be positive; %.17g stays", name, value, s->real[place]);
    }
    if ((part == KF_PART_PARAMETERS || part == KF_PART_INPUTS) && s->mode > KF_INITIALIZATION) {
        return kf_answered(instance, KF_ERROR, "%s = %.17g comes too late: it is %s", name, value,
                           part == KF_PART_PARAMETERS ? "fixed once the FMU is initialized"
                                                      : "a state, which the FMU integrates once it is initialized");
    }
    s->real[place] = value;
    kf_touch(s);
    if (part == KF_PART_LOADS || part == KF_PART_MOVERS) { /* they move no pose */
        if (s->ahead) {
            kf_forget(s);
        }
        kf_efforts_changed(s);
        return KF_DONE;
    }
    s->unbound = s->unbound || part == KF_PART_PARAMETERS;
    kf_forget(s);
    return KF_DONE;
}

/* Refuse to set: an array is NULL, the instance is terminated, or numbers are not rounded to nearest. */
static KF_RARE kf_answer set_nothing(const kf_instance *instance, const unsigned *references, size_t count,
                                     const double *values)
{
    const kf_answer answer = kf_check(instance, references, values, count);
    return answer == KF_DONE ? kf_possible(instance, KF_SET_VARIABLES) : answer;
}

kf_answer kf_set_real(kf_instance *instance, const unsigned *references, size_t count, const double *values)
{
    kf_state *const s = &instance->now;
    size_t k;
    if (instance == NULL || references == NULL || values == NULL || s->mode == KF_TERMINATED || !kf_rounds_to_nearest()) {
        return set_nothing(instance, references, count, values);
    }
    for (k = 0; k < count; ++k) {
        if (!kf_set_input(s, KF_PLACE(references[k]), values[k])) {
            const kf_answer answer = set_other(instance, references[k], values[k]);
            if (answer != KF_DONE) {
                return answer;
            }
        }
    }
    return KF_DONE;
}

/* The parameter `solver.most_work`. */
static kf_answer set_most_work(kf_instance *instance, long long value)
{
    kf_state *const s = &instance->now;
    if (value < 0) {
        return kf_answered(instance, KF_ERROR, "solver.most_work = %lld must be at least 0; %d stays", value, s->most_work);
    }
    if (value != s->most_work && s->mode > KF_INITIALIZATION) {
        return kf_answered(instance, KF_ERROR,
                           "solver.most_work = %lld comes too late: it is fixed once the FMU is initialized", value);
    }
    s->most_work = (int)value;
    return KF_DONE;
}

/* The parameters `rates` and `solver.most_work`. */
kf_answer kf_set_count(kf_instance *instance, unsigned reference, const char *type, long long value)
{
    kf_state *const s = &instance->now;
    if (reference == KF_MOST_WORK && strcmp(type, KF_ITERATIONS_WORD) == 0) {
        return set_most_work(instance, value);
    }
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
