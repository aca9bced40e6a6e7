/* The motion of the drivers (motion.h) by inputs, or by laws over time. */
#include "drive.h"

#include <math.h>
#include <string.h>

kf_answer kf_begin_motion(kf_instance *instance)
{
    (void)instance;
    return KF_DONE;
}

/* The driver values of the requested pose. */
inline void kf_asked_values(const kf_state *s, double *u)
{
    double ud[KF_DRIVERS], udd[KF_DRIVERS];
    int k;
    if (s->driven_by_time) {
        kf_law(s, s->time, u, ud, udd);
        return;
    }
    for (k = 0; k < KF_DRIVERS; ++k) {
        u[k] = s->real[3 * k];
    }
}

/* Newton always goes to round-off, whatever the tolerance. */
void kf_set_tolerance(kf_instance *instance, double tolerance)
{
    (void)instance;
    (void)tolerance;
}

/* Warn once if inputs were set although time drives. */
static kf_answer warn_of_inputs(kf_instance *instance)
{
    kf_state *const s = &instance->now;
    if (!s->driven_by_time || !s->stray || s->stray_warned) {
        return KF_DONE;
    }
    s->stray_warned = true;
    return kf_answered(instance, KF_WARN, "%s was set, but driven_by_time is true: the law drives, inputs have no effect",
                       kf_name_of(s->stray));
}

/* Move the inputs along their derivatives to the end of a step: Taylor's formula. There is no pose where an input or its
 * rates exceed KF_LARGEST.
 */
static KF_RARE void move_inputs(kf_state *s, double step)
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

/* When inputs drive, the pose at the communication point is committed as a sample. If the inputs move, the pose at the
 * end is committed too, but not as a sample: its inputs are extrapolated, and the host may set others there.
 */
static kf_answer step_by_inputs(kf_instance *instance, double time, double step)
{
    kf_state *const s = &instance->now;
    double kept[3 * KF_DRIVERS];
    bool is_current;
    if (s->ahead) {
        kf_forget(s);
    }
    kf_drop_past_derivatives(s);
    if (!KF_GOOD(kf_ask(instance))) {
        return kf_discarded(instance, time, step, time);
    }
    is_current = s->touched & (time == s->time); /* or inputs are held, or clocks differ: estimates see another time */
    s->known &= KF_GIVEN_PARTS | (0u - (unsigned)is_current); /* no branch: clocks differ by chance, in the last digit */
    s->drive_known &= is_current;
    kf_commit(s, time, step);
    s->time = time + step;
    if (!s->moving) {
        return KF_DONE;
    }
    memcpy(kept, s->real, sizeof kept);
    move_inputs(s, step);
    if (!KF_GOOD(kf_ask(instance))) {
        memcpy(s->real, kept, sizeof kept);
        s->time = time;
        s->ahead = true;
        return kf_discarded(instance, time, step, time + step);
    }
    kf_commit_pose(s);
    kf_end_of_step(s, step);
    s->moving = false;
    return KF_DONE;
}

/* When time drives, the poses at both ends of a step are committed. */
static kf_answer step_by_time(kf_instance *instance, double time, double step)
{
    kf_state *const s = &instance->now;
    const double last = s->samples ? s->history[s->samples - 1].t : 0.0;
    double u[KF_DRIVERS], ud[KF_DRIVERS], udd[KF_DRIVERS];
    kf_forget(s);
    if (s->unbound) {
        kf_bind_parameters(instance);
    }
    if (!s->samples || s->touched || fabs(time - last) > KF_SAME_TIME * step) {
        s->time = time;
        if (!KF_GOOD(kf_ask(instance))) {
            return kf_discarded(instance, time, step, time);
        }
        kf_commit(s, time, step);
    }
    s->time = time + step;
    kf_law(s, s->time, u, ud, udd);
    kf_forget(s);
    kf_solve_at(s, u);
    if (!KF_GOOD(s->status)) {
        return kf_discarded(instance, time, step, s->time);
    }
    kf_commit(s, s->time, step);
    return KF_DONE;
}

kf_answer kf_move(kf_instance *instance, double time, double step)
{
    kf_answer warning, answer;
    if (!instance->now.driven_by_time) {
        return step_by_inputs(instance, time, step);
    }
    warning = warn_of_inputs(instance);
    answer = step_by_time(instance, time, step);
    return answer == KF_DONE ? warning : answer;
}

kf_answer kf_accept_step(kf_instance *instance)
{
    return warn_of_inputs(instance);
}

void kf_time_changed(kf_state *s)
{
    if (s->driven_by_time) {
        kf_forget(s);
    } else {
        s->known &= ~KF_FORCE_PARTS; /* loads may depend on time */
    }
}

const double *kf_constants_of_jumps(const kf_state *s)
{
    return s->driven_by_time ? KF_REAL(s, KF_PART_CONSTANTS) : NULL;
}

/* The effective driver values: those requested, even where they are unreachable. */
kf_answer kf_read_drivers(kf_instance *instance, unsigned parts)
{
    kf_state *const s = &instance->now;
    double *const driven = KF_REAL(s, KF_PART_DRIVEN);
    double u[KF_DRIVERS], ud[KF_DRIVERS], udd[KF_DRIVERS];
    int k;
    if (!(parts & KF_BIT(KF_PART_DRIVEN))) {
        return KF_DONE;
    }
    kf_asked_drive(s, u, ud, udd);
    for (k = 0; k < KF_DRIVERS; ++k) {
        driven[3 * k] = u[k];
        driven[3 * k + 1] = ud[k];
        driven[3 * k + 2] = udd[k];
    }
    return KF_DONE;
}

/* Inputs come first among the variables, a driver's value, speed and acceleration. */
inline bool kf_set_input(kf_state *s, unsigned k, double value)
{
    if (k >= 3 * KF_DRIVERS || !(fabs(value) <= KF_LARGEST)) {
        return false;
    }
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
    return true;
}

/* Efforts of external loads move no driver. */
void kf_efforts_changed(kf_state *s)
{
    s->known &= ~KF_FORCE_PARTS;
}

void kf_derivative_set(kf_state *s, int place, int order, double value)
{
    s->orders[place] = order > s->orders[place] ? (unsigned char)order : s->orders[place];
    s->wired[place] = s->wired[place] || (place % 3 != 0 && value != 0.0);
    kf_find_rate_sources(s);
    kf_forget_motion(s);
    s->stray = (unsigned)place + 1;
}

/* Derivatives of inputs hold for one step. */
inline void kf_drop_past_derivatives(kf_state *s)
{
    if (s->ended && !s->moving) {
        kf_drop_input_derivatives(s);
    }
}

static kf_answer no_states(const kf_instance *instance, size_t count)
{
    return count ? kf_answered(instance, KF_ERROR, KF_NO_STATES) : KF_DONE;
}

kf_answer kf_set_states(kf_instance *instance, const double *states, size_t count)
{
    (void)states;
    return no_states(instance, count);
}

kf_answer kf_get_states(kf_instance *instance, double *states, size_t count)
{
    (void)states;
    return no_states(instance, count);
}

kf_answer kf_get_state_derivatives(kf_instance *instance, double *derivatives, size_t count)
{
    (void)derivatives;
    return no_states(instance, count);
}

/* Return how the drivers move with the inputs; estimated rates follow the values that they are estimated from. */
static void direction_of_inputs(kf_state *s, const double *seed, kf_direction *direction)
{
    kf_sample still[KF_SAMPLES];
    double dv[KF_DRIVERS], da[KF_DRIVERS], u[KF_DRIVERS], t;
    const bool has_inputs = s->model_exchange || s->rates != KF_RATES_ESTIMATED; /* of rates that are used */
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        direction->du[k] = seed[3 * k];
        direction->dv[k] = has_inputs ? seed[3 * k + 1] : 0.0;
        direction->da[k] = has_inputs ? seed[3 * k + 2] : 0.0;
    }
    if (s->model_exchange || (s->ended && !s->touched)) { /* no estimates, or they come from samples alone */
        return;
    }
    memcpy(still, s->history, sizeof still);
    for (k = 0; k < s->samples; ++k) {
        memset(still[k].u, 0, sizeof still[k].u);
    }
    kf_moment(s, &t, u);
    kf_estimated_rates(still, s->samples, t, direction->du, dv, da);
    for (k = 0; k < KF_DRIVERS; ++k) {
        direction->dv[k] += s->sources[3 * k + 1] ? 0.0 : dv[k];
        direction->da[k] += s->sources[3 * k + 2] ? 0.0 : da[k];
    }
}

/* Return how the drivers move with time and with the constants of their laws, by differences of the laws. */
static void direction_of_time(kf_state *s, const double *seed, double time_seed, kf_direction *direction)
{
    const double *const constants = KF_REAL(s, KF_PART_CONSTANTS);
    double moved[KF_ROOM(KF_CONSTANTS)], u[KF_DRIVERS], ud[KF_DRIVERS], udd[KF_DRIVERS], fastest, h;
    int k, j, sign;
    fastest = fabs(time_seed);
    for (k = 0; k < KF_CONSTANTS; ++k) {
        fastest = fmax(fastest, fabs(seed[k]) / (constants[k] != 0.0 ? fabs(constants[k]) : 1.0));
    }
    if (fastest == 0.0) {
        return;
    }
    h = KF_TRIAL / fastest;
    for (j = 1; j <= 3; ++j) {
        for (sign = -1; sign <= 1; sign += 2) {
            const double weight = sign * kf_sixth_order[j - 1] / h;
            for (k = 0; k < KF_CONSTANTS; ++k) {
                moved[k] = constants[k] + sign * j * h * seed[k];
            }
            kf_drive(&s->solver.model, s->time + sign * j * h * time_seed, moved, u, ud, udd);
            for (k = 0; k < KF_DRIVERS; ++k) {
                direction->du[k] += weight * u[k];
                direction->dv[k] += weight * ud[k];
                direction->da[k] += weight * udd[k];
            }
        }
    }
}

kf_answer kf_direction_of_drivers(kf_instance *instance, const double *seed, double time_seed, kf_direction *direction)
{
    kf_state *const s = &instance->now;
    if (s->driven_by_time) {
        direction_of_time(s, seed + kf_part_first[KF_PART_CONSTANTS], time_seed, direction);
    } else {
        direction_of_inputs(s, seed, direction);
    }
    return KF_DONE;
}

/* Laws may depend on parameters, too. */
bool kf_drive_of_trial(kf_instance *instance, kf_solver *other, kf_pose *pose, double *u, double *ud, double *udd)
{
    const kf_state *const s = &instance->now;
    (void)pose;
    if (s->driven_by_time) {
        kf_drive(&other->model, s->time, KF_REAL(s, KF_PART_CONSTANTS), u, ud, udd);
    }
    return true;
}
