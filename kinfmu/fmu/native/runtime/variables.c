/* Getting variables by their value references. Setting them: set_variables.c. */
#include "instance.h"

#include <math.h>
#include <string.h>

#if defined(__GNUC__) && !defined(__clang__) && __GNUC__ >= 8
#define KF_UNROLLED _Pragma("GCC unroll 4") /* lists are short, and most of the work of a get */
#else
#define KF_UNROLLED
#endif

const char *kf_name_of(unsigned reference)
{
    return KF_PLACE(reference) < KF_VARIABLES ? kf_variable_names[KF_PLACE(reference)] : "an unknown variable";
}

static KF_RARE kf_answer refused(const kf_instance *instance, unsigned reference, const char *type, const char *suffix)
{
    return KF_PLACE(reference) < KF_VARIABLES
               ? kf_answered(instance, KF_ERROR, "%s (value reference %u) is not a %s variable%s", kf_name_of(reference),
                             reference, type, suffix)
               : kf_answered(instance, KF_ERROR, "value reference %u is not a variable of this FMU", reference);
}

kf_answer kf_not_a(const kf_instance *instance, unsigned reference, const char *type)
{
    return refused(instance, reference, type, "");
}

kf_answer kf_not_settable(const kf_instance *instance, unsigned reference, const char *type)
{
    return refused(instance, reference, type, " that can be set");
}

/* Compute positions, rates and accelerations together if more than one is wanted: common terms are computed once. */
static KF_WHOLE void read_motion(kf_state *s, unsigned parts)
{
    double *const values = parts & KF_BIT(KF_PART_VALUES) ? KF_REAL(s, KF_PART_VALUES) : NULL;
    double *const rates = parts & KF_BIT(KF_PART_RATES) ? KF_REAL(s, KF_PART_RATES) : NULL;
    double *const accelerations = parts & KF_BIT(KF_PART_ACCELERATIONS) ? KF_REAL(s, KF_PART_ACCELERATIONS) : NULL;
    if (rates || accelerations) {
        kf_find_drive(s);
    }
    kf_motion(&s->solver, kf_shown(s), s->ud, s->udd, values, rates, accelerations);
}

/* Bring parts (a bit each) up to date; Discard if their pose is unreachable: then they keep the last good values. */
kf_answer kf_read(kf_instance *instance, unsigned parts)
{
    const unsigned motion = KF_BIT(KF_PART_VALUES) | KF_BIT(KF_PART_RATES) | KF_BIT(KF_PART_ACCELERATIONS);
    kf_state *const s = &instance->now;
    const unsigned missing = parts & ~s->known;
    if (instance->updating && missing) {
        return kf_answered(instance, KF_ERROR, "nothing can be read during a step");
    }
    if (missing) {
        kf_ask(instance);
        if (kf_read_drivers(instance, missing) != KF_DONE) {
            return KF_DISCARD;
        }
        if (missing & motion) {
            read_motion(s, missing);
        }
        if (missing & ~motion) {
            if (missing & KF_BIT(KF_PART_RESIDUAL)) {
                *KF_REAL(s, KF_PART_RESIDUAL) = kf_shown(s)->found.residual;
            }
            if (missing & KF_BIT(KF_PART_MARGIN)) {
                *KF_REAL(s, KF_PART_MARGIN) = kf_margin(&s->solver, kf_shown(s));
            }
            if (missing & KF_BIT(KF_PART_ERRORS)) {
                kf_find_errors(s, KF_REAL(s, KF_PART_ERRORS));
            }
            if (missing & KF_FORCE_PARTS) {
                kf_read_forces(s, missing);
                kf_warn_of_meeting(instance, missing);
            }
            if (missing & KF_BIT(KF_PART_WATCH)) {
                kf_watches(&s->solver.model, &kf_shown(s)->found, KF_REAL(s, KF_PART_WATCH));
            }
            if (missing & KF_BIT(KF_PART_FIXED)) {
                kf_fixed(&s->solver.model, KF_REAL(s, KF_PART_FIXED));
            }
        }
        s->known |= missing;
    }
    if ((parts & KF_POSE_PARTS) && !KF_GOOD(s->status)) {
        if (missing & KF_POSE_PARTS) {
            kf_answered(instance, KF_DISCARD, "at t = %g s: %s", s->time, s->message);
        }
        return KF_DISCARD;
    }
    return KF_DONE;
}

/* Read a list that holds the time or variables that are not Real. */
static KF_RARE kf_answer get_unusual(kf_instance *instance, const unsigned *references, size_t count, double *values)
{
    kf_answer answer = KF_DONE;
    size_t k;
    for (k = 0; answer <= KF_DISCARD && k < count; ++k) {
        if (references[k] == KF_TIME) {
            values[k] = instance->now.time;
        } else if (KF_PLACE(references[k]) < KF_REALS) {
            const kf_answer one = kf_get_real(instance, &references[k], 1, &values[k]);
            answer = one > answer ? one : answer;
        } else {
            answer = kf_not_a(instance, references[k], KF_REAL_WORD);
        }
    }
    return answer;
}

/* The parts that variables belong to, a bit each. */
static unsigned parts_of(kf_list *list, const unsigned *references, size_t count)
{
    unsigned parts = 0;
    size_t k;
    if (count == list->count && count && memcmp(references, list->references, count * sizeof *references) == 0) {
        return list->parts;
    }
    for (k = 0; k < count; ++k) {
        const unsigned place = KF_PLACE(references[k]);
        parts |= kf_bit_of[place < KF_VARIABLES ? place : KF_VARIABLES];
    }
    if (count && count <= KF_LISTED) {
        list->count = count;
        list->parts = parts;
        memcpy(list->references, references, count * sizeof *references);
    }
    return parts;
}

kf_answer kf_get_real(kf_instance *instance, const unsigned *references, size_t count, double *values)
{
    const double *real;
    unsigned parts;
    kf_answer answer = KF_DONE;
    size_t k;
    if (instance == NULL || references == NULL || values == NULL) {
        return kf_check(instance, references, values, count);
    }
    real = instance->now.real;
    parts = parts_of(&instance->list, references, count);
    if (parts & KF_NOT_REAL) {
        return get_unusual(instance, references, count, values);
    }
    if (parts & ~instance->now.known || !KF_GOOD(instance->now.status)) {
        answer = kf_read(instance, parts);
    }
    KF_UNROLLED
    for (k = 0; k < count; ++k) {
        values[k] = real[(size_t)references[k] - 1];
    }
    return answer;
}

kf_answer kf_get_count(kf_instance *instance, unsigned reference, const char *type, long long *value)
{
    kf_state *const s = &instance->now;
    if (reference == KF_STATUS && strcmp(type, KF_ENUMERATION_WORD) == 0) {
        *value = kf_holds(s) ? s->held_status : kf_ask(instance);
    } else if (reference == KF_RATES && strcmp(type, KF_ENUMERATION_WORD) == 0) {
        *value = s->rates;
    } else if (reference == KF_ITERATIONS && strcmp(type, KF_ITERATIONS_WORD) == 0) {
        kf_ask(instance);
        *value = kf_holds(s) ? s->held_iterations : kf_shown(s)->found.iterations;
    } else if (reference == KF_WORK && strcmp(type, KF_ITERATIONS_WORD) == 0) {
        kf_ask(instance);
        *value = kf_holds(s) ? s->held_work : s->work;
    } else if (reference == KF_MOST_WORK && strcmp(type, KF_ITERATIONS_WORD) == 0) {
        *value = s->most_work;
    } else {
        return kf_not_a(instance, reference, type);
    }
    return KF_DONE;
}

kf_answer kf_get_boolean(kf_instance *instance, unsigned reference, bool *value)
{
    kf_state *const s = &instance->now;
    if (reference == KF_SOLVER_OK) {
        *value = KF_GOOD(kf_holds(s) ? s->held_status : kf_ask(instance));
    } else if (reference == KF_DRIVEN_BY_TIME) {
        *value = s->driven_by_time;
    } else {
        return kf_not_a(instance, reference, "Boolean");
    }
    return KF_DONE;
}

/* The text stays valid until the next call. */
kf_answer kf_get_string(kf_instance *instance, unsigned reference, const char **value)
{
    if (reference != KF_MESSAGE_TEXT) {
        return kf_not_a(instance, reference, "String");
    }
    kf_ask(instance);
    *value = kf_holds(&instance->now) ? instance->now.held_message : instance->now.message;
    return KF_DONE;
}
