/* Sweep: the motion at many samples. */
#ifndef KF_SWEEP_H
#define KF_SWEEP_H

#include <stdint.h>

#include "solver.h"

/* A table of count samples by outputs; sample i, output j is at start[i * row + j * column]. start NULL: not wanted. */
typedef struct {
    double *start;
    ptrdiff_t row, column;
} kf_table;

/* How a sample was solved: its kf_status, and Newton's iterations. */
typedef struct {
    int32_t status, iterations;
} kf_outcome;

/* Samples to be solved and the tables to be filled.
 *
 * u, ud, udd: (count, KF_DRIVERS); tables: values, rates, accelerations; outcomes, residual: (count); watches:
 * (count, KF_WATCHES). Unreachable samples are NaN. failures: the first sample of each unreachable interval,
 * up to most_failures of them, with the messages (most_failures, KF_MESSAGE).
 */
typedef struct {
    int64_t count;
    const double *u, *ud, *udd;
    kf_table tables[3];
    kf_outcome *outcomes;
    double *residual, *watches;
    int64_t most_failures, failure_count;
    int64_t *failures;
    char *messages;
    int64_t side_by_side; /* how many samples went through lanes */
    int64_t gaps;         /* how many are NaN */
} kf_job;

/* Memory for a sweep, to be freed by kf_sweep_free; NULL if memory ran out. */
typedef struct kf_sweep kf_sweep;
kf_sweep *kf_sweep_new(double tolerance);
void kf_sweep_free(kf_sweep *sweep);

/* Reset: the parameters of the mechanism, and nothing known of its path. */
void kf_sweep_start(kf_sweep *sweep, double tolerance);

/* Set the parameters, followed from those of the mechanism; false: no solution, kf_sweep_message states why. */
bool kf_sweep_bind(kf_sweep *sweep, const double *parameters);
const char *kf_sweep_message(const kf_sweep *sweep);

/* Solve all samples of a job; false if memory ran out. */
bool kf_sweep_run(kf_sweep *sweep, kf_job *job);

/* Fill margin (count) and errors (count, 3) of a job that was run: NaN where a sample is not good; false if memory ran out. */
bool kf_sweep_diagnose(kf_sweep *sweep, const kf_job *job, double *margin, double *errors);

/* Compute driver values, speeds and accelerations (count, KF_DRIVERS) by the laws at times [s]; false if the parameters have
 * no solution.
 */
bool kf_drive_all(int64_t count, const double *times, const double *parameters, const double *constants, double *u,
                  double *ud, double *udd);

#endif
