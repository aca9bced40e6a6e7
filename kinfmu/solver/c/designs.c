/* Designs: the motion of a mechanism with many sets of parameters. See designs.h. */
#include "designs.h"

#include <math.h>
#include <string.h>

#include "sweeping.h"
#include "internal.h"

#define LARGEST_RATE 1e100 /* [per s, per s^2] of drivers: squares of much larger numbers are infinite */

bool kf_sweep_starts(kf_sweep *sweep, const double *constants, double time)
{
    double u[KF_ROOM(KF_DRIVERS)], ud[KF_ROOM(KF_DRIVERS)], udd[KF_ROOM(KF_DRIVERS)];
    kf_drive(&sweep->follower.solver.model, time, constants, u, ud, udd);
    kf_restart(&sweep->follower);
    return KF_GOOD(kf_followed(&sweep->follower, u)->status);
}

/* Compute driver values at the times of a design; NaN where a rate is too large. */
static void drive(const kf_model *model, const double *times, const double *constants, kf_job *job)
{
    double *const u = (double *)job->u, *const ud = (double *)job->ud, *const udd = (double *)job->udd;
    const int64_t numbers = job->count * KF_DRIVERS;
    int64_t k;
    for (k = 0; k < job->count; ++k) {
        kf_drive(model, times[k], constants, u + k * KF_DRIVERS, ud + k * KF_DRIVERS, udd + k * KF_DRIVERS);
    }
    for (k = 0; k < numbers; ++k) {
        if (!(fabs(ud[k]) <= LARGEST_RATE && fabs(udd[k]) <= LARGEST_RATE)) {
            u[k] = NAN;
        }
    }
}

/* Fill the tables of a design that is not reached with NaN. */
static void leave_out(kf_job *job)
{
    int64_t sample;
    for (sample = 0; sample < job->count; ++sample) {
        kf_put_gap(job, sample, KF_INCONSISTENT);
    }
}

bool kf_designs_run(kf_sweep *sweep, const kf_designs *designs)
{
    int64_t k;
    int order;
    bool is_done = true;
#if KF_HAS_LANES
    sweep->segments.has_end = designs->read != NULL; /* else samples are those of kf_sweep_run, to the bit */
#endif
    for (k = 0; k < designs->count && is_done; ++k) {
        const double *const constants = designs->constants + k * designs->constant_step;
        char *const message = designs->messages + k * KF_MESSAGE;
        int32_t *const status = designs->status + k * designs->status_step;
        int64_t failure, sample;
        kf_job job = designs->samples;
        if (designs->times == NULL) {
            job.u += k * designs->drive_step;
            job.ud += k * designs->drive_step;
            job.udd += k * designs->drive_step;
        }
        for (order = 0; order < 3; ++order) {
            job.tables[order].start += job.tables[order].start == NULL ? 0 : k * designs->table_step[order];
        }
        job.most_failures = 1;
        job.failures = &failure;
        job.messages = message;
        message[0] = '\0';
        designs->reached[k] = KF_REACHED;
        if (!kf_sweep_bind(sweep, designs->parameters + k * KF_PARAMETERS)) {
            designs->reached[k] = KF_NO_SOLUTION;
        } else if (designs->times != NULL && !kf_sweep_starts(sweep, constants, designs->start)) {
            designs->reached[k] = KF_NO_START;
        }
        if (designs->reached[k] != KF_REACHED) {
            memcpy(message, kf_sweep_message(sweep), KF_MESSAGE);
            leave_out(&job);
        } else {
            if (designs->times != NULL) {
                drive(&sweep->follower.solver.model, designs->times, constants, &job);
            }
            is_done = kf_sweep_run(sweep, &job);
        }
        for (sample = 0; sample < job.count; ++sample) {
            status[sample] = job.outcomes[sample].status;
        }
        if (designs->read != NULL) {
            designs->read(designs->context, k, status);
        }
    }
#if KF_HAS_LANES
    sweep->segments.has_end = false;
#endif
    return is_done;
}
