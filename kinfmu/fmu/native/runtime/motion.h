/* The motion of the drivers, as the instance asks for it. An FMU has one of two: motion_by_inputs.c, by inputs or laws over
 * time, or motion_by_efforts.c, by integration under efforts.
 */
#ifndef KF_MOTION_H
#define KF_MOTION_H

/* A direction of the drivers. */
typedef struct {
    double du[KF_DRIVERS], dv[KF_DRIVERS], da[KF_DRIVERS];
} kf_direction;

/* Life: the end of initialization, and steps. */
kf_answer kf_begin_motion(kf_instance *instance);
void kf_set_tolerance(kf_instance *instance, double tolerance); /* of the host, for co-simulation */
kf_answer kf_move(kf_instance *instance, double time, double step);
kf_answer kf_accept_step(kf_instance *instance); /* in model exchange; `terminated` is set if the motion ends */
void kf_time_changed(kf_state *state);
const double *kf_constants_of_jumps(const kf_state *state); /* of laws over time; NULL if none has an effect */

/* Values, speeds and accelerations of the drivers: of the requested pose, of the committed one; udd may be NaN. */
void kf_asked_values(const kf_state *state, double *u);
void kf_asked_drive(kf_state *state, double *u, double *ud, double *udd);
void kf_committed_drive(const kf_state *state, double *u, double *ud, double *udd);
void kf_find_rate_sources(kf_state *state);
void kf_add_rate_errors(kf_state *state, double errors[3]);
kf_answer kf_read_drivers(kf_instance *instance, unsigned parts); /* their variables; refuses accelerations that are NaN */

/* Inputs: `kf_set_input` returns false for a variable or a value that the general way sets or refuses. */
bool kf_set_input(kf_state *state, unsigned place, double value);
void kf_efforts_changed(kf_state *state);
void kf_derivative_set(kf_state *state, int number, int order, double value);
void kf_drop_past_derivatives(kf_state *state);

/* States of model exchange. */
kf_answer kf_set_states(kf_instance *instance, const double *states, size_t count);
kf_answer kf_get_states(kf_instance *instance, double *states, size_t count);
kf_answer kf_get_state_derivatives(kf_instance *instance, double *derivatives, size_t count);

/* Directional derivatives: how the drivers move along a direction of the known variables; the drive of a trial with other
 * parameters.
 */
kf_answer kf_direction_of_drivers(kf_instance *instance, const double *seed, double time_seed, kf_direction *direction);
bool kf_drive_of_trial(kf_instance *instance, kf_solver *other, kf_pose *pose, double *u, double *ud, double *udd);

#endif
