/* Designs: the motion of a mechanism with many sets of parameters. */
#ifndef KF_DESIGNS_H
#define KF_DESIGNS_H

#include "sweep.h"

/* How a design was reached from the parameters as written. */
typedef enum {
    KF_REACHED = 0,     /* its samples are in the tables */
    KF_NO_SOLUTION = 1, /* continuation ends before its parameters */
    KF_NO_START = 2     /* the laws start at a pose that is not reached */
} kf_reached;

/* Designs to be solved at `samples.count` samples each, and the tables to be filled.
 *
 * parameters: (count, KF_PARAMETERS). The drivers follow given values, samples.u, ud and udd, equal for all designs, or
 * with drive_step numbers from one design to the next; or, with times (samples.count), the laws with constants, of which
 * there are constant_step from one design to the next; then u, ud and udd are only memory, overwritten by each design, and
 * `start` is the time at which the laws start.
 *
 * samples: tables, outcomes, residual and watches of the first design; those of the next follow after table_step[order]
 * numbers and directly. No failures of samples are collected.
 * reached: (count); messages: (count, KF_MESSAGE), why a design or its first unreachable sample is not reached, else empty.
 */
typedef struct {
    int64_t count;
    const double *parameters;
    ptrdiff_t drive_step;
    const double *times, *constants;
    ptrdiff_t constant_step;
    double start;
    kf_job samples;
    ptrdiff_t table_step[3];
    int32_t *reached;
    char *messages;
} kf_designs;

/* Return whether the laws start at a pose that can be reached with the parameters set. */
bool kf_sweep_starts(kf_sweep *sweep, const double *constants, double time);

/* Solve all designs; false if memory ran out. */
bool kf_designs_run(kf_sweep *sweep, const kf_designs *designs);

#endif
