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

/* What reads a design as soon as it is solved. context: its own; status: (samples.count) values of kf_status. */
typedef void kf_design_reader(const void *context, int64_t design, const int32_t *status);

/* Designs to be solved at `samples.count` samples each, and the tables to be filled.
 *
 * count: of the designs. parameters: (count, KF_PARAMETERS).
 *
 * What moves them is one of two:
 * - driver values: samples.u, ud and udd of the first design; those of the next one begin drive_step numbers later (0: all
 *   designs share them). times is NULL.
 * - the laws: times (samples.count), and constants of the first design; those of the next one begin constant_step numbers
 *   later. The laws start at the time `start`. Each design overwrites samples.u, ud and udd.
 *
 * samples: its tables are those of the first design; those of the next one begin table_step[order] numbers later. Each
 * design overwrites its outcomes, residual and watches. Failures of samples are not collected.
 *
 * status: (samples.count) values of kf_status of the first design; those of the next one begin status_step numbers later.
 * reached: (count) values of kf_reached. messages: (count, KF_MESSAGE), why a design, or else its first sample without
 * numbers, is not reached; empty if all are. read: NULL for none; with it steps may be 0, and all designs share tables.
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
    int32_t *status, *reached;
    ptrdiff_t status_step;
    char *messages;
    kf_design_reader *read;
    const void *context;
} kf_designs;

/* Return whether the laws start at a pose that can be reached with the parameters set. */
bool kf_sweep_starts(kf_sweep *sweep, const double *constants, double time);

/* Solve all designs; false if memory ran out. */
bool kf_designs_run(kf_sweep *sweep, const kf_designs *designs);

#endif
