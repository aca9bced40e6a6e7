/* Walks about: short steps, jumps and special places, trials that are dropped, poses at limits, other parameters.
 *
 * Memory is not zeroed: nothing may depend on what is in it. A copy of the state in another instance must do the same.
 * Prints how many poses had which status.
 */
#include "solver.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static unsigned long long seed = 88172645463325252ULL;

static double drawn(double low, double high)
{
    seed ^= seed << 13;
    seed ^= seed >> 7;
    seed ^= seed << 17;
    return low + (high - low) * ((double)(seed >> 11) / 9007199254740992.0);
}

static void draw(const double *from, double *u)
{
    const double kind = drawn(0.0, 1.0);
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        u[k] = from[k] + kf_reach[k] * drawn(-0.1, 0.2);
        if (kind > 0.7) {
            u[k] = kf_anchor_u[k] + kf_reach[k] * drawn(-9.0, 9.0);
        } else if (kind > 0.4 && kf_driver_is_angle[k]) {
            u[k] = 1.5707963267948966 * floor(drawn(-8.0, 9.0)) + (kind > 0.55 ? drawn(-1e-6, 1e-6) : 0.0);
        }
    }
}

typedef struct {
    double rows[3][KF_OUTPUTS], errors[3], margin;
} numbers;

static void read_numbers(kf_solver *solver, kf_pose *pose, numbers *all)
{
    double ud[KF_DRIVERS], udd[KF_DRIVERS];
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        ud[k] = 0.7;
        udd[k] = -0.3;
    }
    kf_motion(solver, pose, ud, udd, all->rows[0], all->rows[1], all->rows[2]);
    kf_errors(solver, pose, ud, udd, all->errors);
    all->margin = kf_margin(solver, pose);
}

static void walk(kf_solver *solver, kf_solver *other, int turns, int *counts)
{
    kf_pose *const poses = malloc(3 * sizeof *poses);
    kf_pose *good = &solver->anchor, *found = &poses[0];
    numbers *const all = malloc(2 * sizeof *all);
    double u[KF_DRIVERS];
    int k;
    while (turns-- > 0) {
        draw(KF_POSE_U(good), u);
        if (turns % 3 == 0) {
            kf_solve(solver, good, u, found);
            draw(KF_POSE_U(good), u);
        }
        if (turns % 7 == 0) {
            kf_pose *const start = good == &solver->anchor ? &other->anchor : &poses[2];
            const kf_status status = kf_solve(solver, good, u, found);
            memcpy(other, solver, KF_SOLVER_STATE);
            if (start == &poses[2]) {
                memcpy(start, good, sizeof *start);
            }
            if (KF_GOOD(status)) {
                kf_pose *const again = malloc(sizeof *again);
                if (kf_solve(other, start, u, again) != status) {
                    abort();
                }
                read_numbers(solver, found, &all[0]);
                read_numbers(other, again, &all[1]);
                if (memcmp(&all[0], &all[1], sizeof all[0]) != 0) {
                    abort();
                }
                free(again);
            }
        }
        k = (int)kf_solve(solver, good, u, found);
        ++counts[k];
        if (KF_GOOD(k)) {
            read_numbers(solver, found, &all[0]);
            good = found;
            found = found == &poses[0] ? &poses[1] : &poses[0];
        } else if (solver->message[0] == '\0' || strlen(solver->message) >= KF_MESSAGE) {
            abort();
        }
    }
    free(all);
    free(poses);
}

int main(void)
{
    static const double factors[] = {1.0, 1.02, 0.97, 9.0, -1.0, 0.0};
    kf_solver *const solver = malloc(sizeof *solver), *const other = malloc(sizeof *other);
    double parameters[KF_ROOM(KF_PARAMETERS)];
    int counts[KF_NOT_CONVERGED + 1] = {0}, k, changed;
    kf_solver_start(solver);
    kf_solver_start(other);
    walk(solver, other, 400, counts);
    for (changed = 0; changed < KF_PARAMETERS; ++changed) {
        for (k = 0; k < (int)(sizeof factors / sizeof factors[0]); ++k) {
            memcpy(parameters, kf_parameters_written, sizeof parameters);
            parameters[changed] *= factors[k];
            if (kf_solver_bind(solver, parameters) == (solver->message[0] != '\0')) {
                abort();
            }
            walk(solver, other, 30, counts);
        }
    }
    free(other);
    free(solver);
    for (k = 0; k <= KF_NOT_CONVERGED; ++k) {
        printf("%d ", counts[k]);
    }
    return 0;
}
