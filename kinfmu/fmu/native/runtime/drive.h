/* Driver values and rates by laws and by inputs: see drive.c. */
#ifndef KF_DRIVE_H
#define KF_DRIVE_H

#include "instance.h"

void kf_law(const kf_state *state, double t, double *u, double *ud, double *udd);
void kf_estimated_rates(const kf_sample *samples, int count, double t, const double *u, double *ud, double *udd);
void kf_end_of_step(kf_state *state, double step);
void kf_drop_input_derivatives(kf_state *state);

#endif
