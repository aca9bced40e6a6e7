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
    const int number = kf_followed(KF_PLACE(reference));
    if (number < 0) {
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
    s->input_rates[number][order - 1] = value;
    s->moving = true;
    kf_derivative_set(s, number, order, value);
    return KF_DONE;
}
