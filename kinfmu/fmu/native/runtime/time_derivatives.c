/* Derivatives with respect to time: of outputs, which a host reads; of inputs, which are followed in a step. */
#include "instance.h"

#include <math.h>

/* Read the derivative of an output: of positions orders 1 and 2, of rates order 1. */
kf_answer kf_output_derivative(kf_instance *instance, unsigned reference, int order, double *value)
{
    const unsigned place = KF_PLACE(reference);
    const int part = place < KF_REALS ? kf_part_of[place] : KF_PARTS;
    int wanted;
    kf_answer answer;
    if ((part != KF_PART_VALUES && part != KF_PART_RATES) || order < 1 || order > KF_PART_ACCELERATIONS - part) {
        return kf_answered(instance, KF_ERROR, "%s (value reference %u) has no derivative of order %d: positions have 1 and 2, "
                      "rates 1", kf_name_of(reference), reference, order);
    }
    wanted = part + order;
    answer = kf_read(instance, KF_BIT(wanted));
    *value = instance->now.real[kf_part_first[wanted] - kf_part_first[part] + (int)place];
    return answer;
}

/* Set the derivative of an input, which the input follows during the next step. */
kf_answer kf_set_input_derivative(kf_instance *instance, unsigned reference, int order, double value)
{
    kf_state *const s = &instance->now;
    const char *const name = kf_name_of(reference);
    const unsigned place = KF_PLACE(reference);
#if KF_TORQUE
    const int part = place < KF_REALS ? kf_part_of[place] : KF_PARTS;
    const int number = place < KF_REALS ? (int)place - kf_part_first[part] : 0;
    if (part != KF_PART_EFFORTS && !(part == KF_PART_LOADS && number < KF_LOAD_INPUTS)) {
#else
    if (place >= 3 * KF_DRIVERS) {
#endif
        return kf_not_settable(instance, reference, KF_REAL_WORD);
    }
    if (s->model_exchange) {
        return kf_answered(instance, KF_ERROR, "setRealInputDerivatives: this instance is for model exchange, which has no steps");
    }
    if (order < 1 || order > KF_INPUT_ORDERS || !(fabs(value) <= KF_LARGEST)) {
        return kf_answered(instance, KF_ERROR, "%s: derivative of order %d = %g; orders 1 to %d and numbers up to %g are taken",
                      name, order, value, KF_INPUT_ORDERS, KF_LARGEST);
    }
    if (s->ahead) {
        kf_forget(s);
    }
    kf_touch(s);
#if KF_TORQUE
    (part == KF_PART_EFFORTS ? s->effort_rates : s->load_rates)[number][order - 1] = value;
    s->moving = true;
#else
    s->input_rates[place][order - 1] = value;
    s->orders[place] = order > s->orders[place] ? (unsigned char)order : s->orders[place];
    s->wired[place] = s->wired[place] || (place % 3 != 0 && value != 0.0);
    kf_find_rate_sources(s);
    kf_forget_motion(s);
    s->moving = true;
    s->stray = place + 1;
#endif
    return KF_DONE;
}

#if !KF_TORQUE
/* Move the inputs along their derivatives to the end of a step: Taylor's formula. There is no pose where an input or its
 * rates exceed KF_LARGEST.
 */
KF_RARE void kf_move_inputs(kf_state *s, double step)
{
    bool usable = true;
    int k, order;
    for (k = 0; k < 3 * KF_DRIVERS; ++k) {
        const double *const rates = s->input_rates[k];
        double term = 1.0;
        for (order = 0; order < KF_INPUT_ORDERS; ++order) {
            term *= step / (order + 1);
            s->real[k] += rates[order] * term;
        }
        usable = usable && fabs(s->real[k]) <= KF_LARGEST &&
                 fabs(rates[0]) + step * (fabs(rates[1]) + 0.5 * step * fabs(rates[2])) <= KF_LARGEST &&
                 fabs(rates[1]) + step * fabs(rates[2]) <= KF_LARGEST;
    }
    s->real[0] = usable ? s->real[0] : NAN;
    kf_forget(s);
}
#endif
