/* Forces of a pose: outputs of mechanisms with masses or loads. The stage itself is generated: forces.c. */
#include "instance.h"
#include "internal.h"

#include <math.h>
#include <string.h>

/* Forces of a good pose at time t, driver values, speeds and accelerations; efforts: of external loads. */
void kf_forces_at(const kf_solver *solver, kf_pose *pose, double t, const double *const drive[3], const double *efforts,
                  double *forces)
{
    const kf_model *const model = &solver->model;
    const double *const ud = drive[1], *const udd = drive[2];
#if KF_DRIVERS == 1
    double zd[KF_ROOM(KF_UNKNOWNS)], zdd[KF_ROOM(KF_UNKNOWNS)];
    int k;
    kf_tangent(model, pose);
    for (k = 0; k < KF_UNKNOWNS; ++k) {
        zd[k] = pose->x1[k] * ud[0];
        zdd[k] = pose->x2[k] * (ud[0] * ud[0]) + pose->x1[k] * udd[0];
    }
    kf_forces(t, drive[0], ud, udd, pose->found.x, zd, zdd, pose->x1, efforts, model->parameters, forces);
#else
    double slopes[KF_ROOM(KF_DRIVERS * KF_UNKNOWNS)], unit[KF_DRIVERS];
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        memset(unit, 0, sizeof unit);
        unit[k] = 1.0;
        kf_rates_in_time(model, pose, unit, NULL);
        memcpy(slopes + k * KF_UNKNOWNS, pose->x1, KF_UNKNOWNS * sizeof *slopes);
    }
    kf_rates_in_time(model, pose, ud, udd);
    kf_forces(t, drive[0], ud, udd, pose->found.x, pose->x1, pose->x2, slopes, efforts, model->parameters, forces);
#endif
}

/* The time and the external loads of the pose shown. */
static double shown_at(const kf_state *s, const double **efforts)
{
    double u[KF_DRIVERS], t = s->time;
    if (!KF_GOOD(s->status)) {
        *efforts = s->committed_efforts;
        return s->samples ? s->history[s->samples - 1].t : t;
    }
    *efforts = KF_REAL(s, KF_PART_LOADS);
    if (!s->model_exchange && !s->driven_by_time) {
        kf_moment(s, &t, u);
    }
    return t;
}

void kf_read_forces(kf_state *s)
{
    const double *drive[3], *efforts;
    double t;
    kf_find_drive(s);
    drive[0] = s->u;
    drive[1] = s->ud;
    drive[2] = s->udd;
    t = shown_at(s, &efforts);
    kf_forces_at(&s->solver, kf_shown(s), t, drive, efforts, KF_REAL(s, KF_PART_FORCES));
}

/* Forces of another pose, at the time and the loads of the one shown. */
void kf_forces_of_trial(kf_state *s, const kf_solver *solver, kf_pose *pose, const double *const drive[3],
                        double *forces)
{
    const double *efforts;
    const double t = shown_at(s, &efforts);
    kf_forces_at(solver, pose, t, drive, efforts, forces);
}

/* Add the derivatives of the forces of the pose shown along speeds dv, accelerations da, loads and time, at a pose that stays.
 *
 * Forces are polynomials of at most the third degree in all but time: the differences are exact but for rounding.
 */
void kf_add_force_slopes(kf_state *s, const double *dv, const double *da, const double *loads, double dt, double *slope)
{
    static const double weights[3] = {45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0};
    const int count = kf_part_first[KF_PART_FORCES + 1] - kf_part_first[KF_PART_FORCES];
    double ud[KF_DRIVERS], udd[KF_DRIVERS], moved[KF_ROOM(KF_LOADS)], trial[KF_REALS];
    const double *drive[3], *efforts;
    const double t = shown_at(s, &efforts), h = dt != 0.0 ? 2e-3 / fabs(dt) : 1.0;
    int j, k, sign;
    drive[0] = s->u;
    drive[1] = ud;
    drive[2] = udd;
    for (j = 1; j <= 3; ++j) {
        for (sign = -1; sign <= 1; sign += 2) {
            const double by = sign * j * h;
            for (k = 0; k < KF_DRIVERS; ++k) {
                ud[k] = s->ud[k] + by * dv[k];
                udd[k] = s->udd[k] + by * da[k];
            }
            for (k = 0; k < KF_LOADS; ++k) {
                moved[k] = efforts[k] + by * loads[k];
            }
            kf_forces_at(&s->solver, kf_shown(s), t + by * dt, drive, moved, trial);
            for (k = 0; k < count; ++k) {
                slope[k] += sign * weights[j - 1] / h * trial[k];
            }
        }
    }
}
