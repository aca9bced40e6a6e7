/* Motion of the drivers under efforts: see motion_by_efforts.c, torque.c, equation_of_motion.c and limits.c. */
#ifndef KF_TORQUE_H
#define KF_TORQUE_H

#include "instance.h"
#include "efforts.h"

#define KF_NUMBERS (2 * KF_DRIVERS) /* values, then speeds */

/* One end of a step: time, state, its derivative, and how near its pose is to a singular one. */
typedef struct {
    double t, y[KF_NUMBERS], f[KF_NUMBERS], margin;
    bool is_bridged;
#if KF_LAWS
    double laws[KF_LAW_NUMBERS]; /* arguments and breaks of the laws of joints */
#endif
} kf_end;

/* A motion while it is integrated.
 *
 * start: of the step of the host, from which efforts and external loads move by their derivatives, if it gave some.
 * here: the last good pose, from which the next is followed; low, high: times at which laws are read, inside a span
 * without jumps; size: of the next step; longest: of all steps; refined: how often the present step was divided to search it
 * for a limit, which may be before `suspect_until`; cuts: how often it was shortened to end before a break, from `uncut`; status and message of the solver, and `reached`: the time of its end.
 */
typedef struct {
    kf_instance *instance;
    kf_pose *here, *spare;
    double start, efforts[KF_DRIVERS], loads[KF_ROOM(KF_LOADS)];
    double tolerance, low, high, span, size, longest, suspect_until, reached;
    int refined, steps;
#if KF_LAWS
    double uncut;
    int cuts;
#endif
    kf_status status;
    bool is_limit;
} kf_course;

typedef enum { KF_GOES_ON, KF_REPEATS, KF_HOPS, KF_ENDS } kf_verdict;

extern const double kf_in_si[KF_DRIVERS]; /* generated: units of the drivers */
kf_stage kf_inertia; /* generated: bias efforts, then the reduced inertia's upper triangle, row by row */
bool kf_accelerations(const kf_solver *solver, kf_pose *pose, double t, const double *ud, const double *efforts,
                      const double *loads, double *udd);
int kf_massless(const kf_solver *solver, kf_pose *pose, double t, const double *ud, const double *loads);
bool kf_integrate(kf_instance *instance, double end, double *reached);
bool kf_passes_limit(kf_instance *instance, double *reached);
bool kf_follow(kf_course *course, const double *u);
kf_verdict kf_search_limit(kf_course *course, const kf_end *before, const kf_end *after);
bool kf_ends_at(kf_course *course, double t, const double *u, const double *ud);
void kf_within(const kf_end *before, const kf_end *after, double t, double *u, double *rates);
double kf_unit(int driver);
#if KF_LAWS
void kf_laws(double time, const double *u, const double *ud, const double *udd, const double *z, const double *zd,
             const double *zdd, const double *slopes, const double *efforts, const double *parameters,
             double *forces); /* generated */
void kf_find_laws(const kf_course *course, double *numbers);
kf_verdict kf_search_break(kf_course *course, const kf_end *before, kf_end *after, double last);
#endif

#endif
