/* Accelerations of the drivers under efforts:
 *
 *     J(u) udd = T - bias(u, ud)        u: driver values, T: efforts, J: reduced inertia
 *
 * J and the bias efforts come from one motion with accelerations of 0 and from the rates at unit speeds, which on a bridge
 * are interpolated where the blocks are singular.
 */
#include "torque.h"
#include "internal.h"

#include <math.h>
#include <string.h>

#define FOUND (KF_DRIVERS + KF_DRIVERS * (KF_DRIVERS + 1) / 2)

static const double resting[KF_DRIVERS];

/* Compute bias efforts, then the upper triangle of the reduced inertia, row by row (FOUND), at a good pose. */
static void find_inertia(const kf_solver *solver, kf_pose *pose, double t, const double *ud, const double *loads, double *found)
{
    const kf_model *const model = &solver->model;
    const double *const u = KF_POSE_U(pose);
    int k;
#if KF_DRIVERS == 1
    double zd[KF_ROOM(KF_UNKNOWNS)], zdd[KF_ROOM(KF_UNKNOWNS)];
    kf_tangent(model, pose);
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        zd[k] = pose->x1[k] * ud[0];
        zdd[k] = pose->x2[k] * (ud[0] * ud[0]);
    }
    kf_inertia(t, u, ud, resting, pose->found.x, zd, zdd, pose->x1, loads, model->parameters, found);
#else
    double slopes[KF_ROOM(KF_DRIVERS * KF_UNKNOWNS)], unit[KF_DRIVERS];
    for (k = 0; k < KF_DRIVERS; ++k) {
        memset(unit, 0, sizeof unit);
        unit[k] = 1.0;
        kf_rates_in_time(model, pose, unit, NULL);
        memcpy(slopes + k * KF_UNKNOWNS, pose->x1, KF_UNKNOWNS * sizeof *slopes);
    }
    kf_rates_in_time(model, pose, ud, resting);
    kf_inertia(t, u, ud, resting, pose->found.x, pose->x1, pose->x2, slopes, loads, model->parameters, found);
#endif
}

/* Compute the accelerations of the drivers (KF_DRIVERS) at a good pose; false if the reduced inertia does not determine them. */
bool kf_accelerations(const kf_solver *solver, kf_pose *pose, double t, const double *ud, const double *efforts,
                      const double *loads, double *udd)
{
    double found[FOUND];
#if KF_DRIVERS == 1
    find_inertia(solver, pose, t, ud, loads, found);
    udd[0] = (efforts[0] - found[0]) / found[1] / kf_in_si[0];
    return found[1] > 0.0 && isfinite(udd[0]);
#else
    double *rows[KF_DRIVERS];
    int i, j, k;
    bool good = true;
    find_inertia(solver, pose, t, ud, loads, found);
    for (k = 0; k < KF_DRIVERS; ++k) {
        rows[k] = k == 0 ? found + KF_DRIVERS : rows[k - 1] + KF_DRIVERS - k + 1; /* from the diagonal on */
        udd[k] = efforts[k] - found[k];
    }
    for (k = 0; k < KF_DRIVERS; ++k) { /* L D L^T */
        if (!(rows[k][0] > 0.0)) {
            return false;
        }
        for (j = 1; j < KF_DRIVERS - k; ++j) {
            const double ratio = rows[k][j] / rows[k][0];
            for (i = j; i < KF_DRIVERS - k; ++i) {
                rows[k + j][i - j] -= ratio * rows[k][i];
            }
            udd[k + j] -= ratio * udd[k];
        }
    }
    for (k = KF_DRIVERS - 1; k >= 0; --k) {
        for (j = 1; j < KF_DRIVERS - k; ++j) {
            udd[k] -= rows[k][j] * udd[k + j];
        }
        udd[k] /= rows[k][0];
    }
    for (k = 0; k < KF_DRIVERS; ++k) {
        udd[k] /= kf_in_si[k];
        good = good && isfinite(udd[k]);
    }
    return good;
#endif
}

/* Return the first driver without reduced inertia at a good pose, or 0. */
int kf_massless(const kf_solver *solver, kf_pose *pose, double t, const double *ud, const double *loads)
{
    double found[FOUND];
    int k, place = KF_DRIVERS; /* of the diagonal */
    find_inertia(solver, pose, t, ud, loads, found);
    for (k = 0; k < KF_DRIVERS; ++k) {
        if (!(found[place] > 0.0)) {
            return k;
        }
        place += KF_DRIVERS - k;
    }
    return 0;
}
