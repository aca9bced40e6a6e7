/* Forces of a pose: outputs of mechanisms with masses or loads. The stages are generated, a part and a file each. */
#include "instance.h"
#include "internal.h"

#include <math.h>
#include <string.h>

/* The stages in `parts`. Blocks do not give reactions of poses that are interpolated across a singular point. */
static void evaluate(unsigned parts, double t, const double *const drive[3], const double *z, const double *zd,
                     const double *zdd, const double *slopes, const double *efforts, const double *parameters,
                     bool is_bridged, double *row)
{
#if KF_STAGE_FORCES + KF_STAGE_REACTIONS + KF_STAGE_SHAKING == 0 /* efforts drive, and no force is an output */
    (void)parts, (void)t, (void)drive, (void)z, (void)zd, (void)zdd, (void)slopes, (void)efforts, (void)parameters;
    (void)row;
#endif
#if KF_STAGE_FORCES
    if (parts & KF_BIT(KF_PART_FORCES)) {
        kf_forces(t, drive[0], drive[1], drive[2], z, zd, zdd, slopes, efforts, parameters,
                  row + kf_part_first[KF_PART_FORCES]);
    }
#endif
#if KF_STAGE_REACTIONS
    if (parts & KF_BIT(KF_PART_REACTIONS)) {
        double *const reactions = row + kf_part_first[KF_PART_REACTIONS];
        int k;
        kf_reactions(t, drive[0], drive[1], drive[2], z, zd, zdd, slopes, efforts, parameters, reactions);
        for (k = 0; is_bridged && k < KF_STAGE_REACTIONS; ++k) {
            reactions[k] = NAN;
        }
    }
#else
    (void)is_bridged;
#endif
#if KF_STAGE_SHAKING
    if (parts & KF_BIT(KF_PART_SHAKING)) {
        kf_shaking(t, drive[0], drive[1], drive[2], z, zd, zdd, slopes, efforts, parameters,
                   row + kf_part_first[KF_PART_SHAKING]);
    }
#endif
}

/* Forces of a good pose at time t, driver values, speeds and accelerations, in a row of all Real variables.
 *
 * parts: those that are wanted; efforts: of external loads.
 */
void kf_forces_at(const kf_solver *solver, kf_pose *pose, double t, const double *const drive[3], const double *efforts,
                  unsigned parts, double *row)
{
    const bool is_bridged = pose->status == KF_BRIDGED;
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
    evaluate(parts, t, drive, pose->found.x, zd, zdd, pose->x1, efforts, model->parameters, is_bridged, row);
#else
    double slopes[KF_ROOM(KF_DRIVERS * KF_UNKNOWNS)], unit[KF_DRIVERS];
    int k;
    for (k = 0; k < KF_DRIVERS && (parts & KF_BIT(KF_PART_FORCES)); ++k) { /* no other stage reads slopes */
        memset(unit, 0, sizeof unit);
        unit[k] = 1.0;
        kf_rates_in_time(model, pose, unit, NULL);
        memcpy(slopes + k * KF_UNKNOWNS, pose->x1, KF_UNKNOWNS * sizeof *slopes);
    }
    kf_rates_in_time(model, pose, ud, udd);
    evaluate(parts, t, drive, pose->found.x, pose->x1, pose->x2, slopes, efforts, model->parameters, is_bridged, row);
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

void kf_read_forces(kf_state *s, unsigned parts)
{
    const double *drive[3], *efforts;
    double t;
    kf_find_drive(s);
    drive[0] = s->u;
    drive[1] = s->ud;
    drive[2] = s->udd;
    t = shown_at(s, &efforts);
    kf_forces_at(&s->solver, kf_shown(s), t, drive, efforts, parts, s->real);
}

/* Warn of loads whose ends are in the same place: they have no direction, so that forces in `parts` have no value. */
void kf_warn_of_meeting(kf_instance *instance, unsigned parts)
{
#if KF_MEETING
    kf_state *const s = &instance->now;
    double distances[KF_MEETING];
    const double *efforts;
    const double t = shown_at(s, &efforts);
    bool is_known = true;
    int part, k;
    for (part = KF_PART_FORCES; part <= KF_PART_SHAKING; ++part) {
        for (k = kf_part_first[part]; (parts >> part & 1u) && k < kf_part_first[part + 1]; ++k) {
            is_known = is_known && !isnan(s->real[k]);
        }
    }
    if (is_known) {
        return;
    }
    kf_distances(t, s->u, s->ud, s->udd, kf_shown(s)->found.x, NULL, NULL, NULL, efforts,
                 s->solver.model.parameters, distances);
    for (k = 0; k < KF_MEETING; ++k) {
        if (distances[k] == 0.0) {
            kf_answered(instance, KF_WARN, "%s", kf_meeting[k]);
        }
    }
#else
    (void)instance, (void)parts;
#endif
}

/* Forces of another pose, at the time and the loads of the one shown. */
void kf_forces_of_trial(kf_state *s, const kf_solver *solver, kf_pose *pose, const double *const drive[3],
                        unsigned parts, double *row)
{
    const double *efforts;
    const double t = shown_at(s, &efforts);
    kf_forces_at(solver, pose, t, drive, efforts, parts, row);
}

/* The step of differences along loads: at most `longest`, and short where constants of laws change, in which forces are
 * not polynomials.
 */
double kf_step_along_laws(const double *loads, const double *seed, double longest)
{
    double h = longest;
    int k;
    for (k = KF_LOAD_INPUTS; k < KF_LOADS; ++k) {
        if (seed[k] != 0.0) {
            h = fmin(h, 2e-3 * (loads[k] != 0.0 ? fabs(loads[k]) : 1.0) / fabs(seed[k]));
        }
    }
    return h;
}

/* Add the derivatives of the forces of the pose shown along speeds dv, accelerations da, loads and time, at a pose that stays.
 *
 * Forces are polynomials of at most the third degree in all but time: the differences are exact but for rounding.
 */
void kf_add_force_slopes(kf_state *s, const double *dv, const double *da, const double *loads, double dt,
                         unsigned parts, double *slope)
{
    double ud[KF_DRIVERS], udd[KF_DRIVERS], moved[KF_ROOM(KF_LOADS)], trial[KF_REALS];
    const double *drive[3], *efforts;
    const double t = shown_at(s, &efforts), h = kf_step_along_laws(efforts, loads, dt != 0.0 ? 2e-3 / fabs(dt) : 1.0);
    int j, k, part, sign;
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
            kf_forces_at(&s->solver, kf_shown(s), t + by * dt, drive, moved, parts, trial);
            for (part = KF_PART_FORCES; part <= KF_PART_SHAKING; ++part) {
                for (k = kf_part_first[part]; (parts >> part & 1u) && k < kf_part_first[part + 1]; ++k) {
                    slope[k] += sign * kf_sixth_order[j - 1] / h * trial[k];
                }
            }
        }
    }
}
