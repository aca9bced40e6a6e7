/* Declarations that the files of the solver share, and what is built on it: lanes, FMUs, pages. */
#ifndef KF_INTERNAL_H
#define KF_INTERNAL_H

#include "solver.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Blocks of models with several drivers that depend on one driver alone are followed along it: a track.
 * KF_ALONG: the number of the driver; KF_SPEEDS: those of the drivers then; KF_AT: values of all drivers of which one is
 * given.
 */
#if KF_HAS(KF_TRACKS)
#define KF_ALONG_OF(model) ((model)->track - KF_TRACKS)
#define KF_SPEEDS(model) (KF_TRACKS ? (model)->along : kf_alone)
void kf_enter_track(kf_solver *solver, int driver);
void kf_enter_mixed(kf_solver *solver, const double *z, const double *slopes);
void kf_leave_track(kf_solver *solver);
const double *kf_driven_at(const kf_model *model, const double *value, double *buffer);
void kf_rates(const kf_model *model, const kf_found *found, const double *ud, const double *given, const bool *held,
              double *x1);
void kf_second_rates(const kf_model *model, const kf_found *found, const double *udd, const double *x1,
                     const double *given, const bool *held, double *x2);
#define KF_AT(model, value, buffer) (KF_TRACKS ? kf_driven_at(model, value, buffer) : (value))
#define KF_IS_ON_A_TRACK(block) (KF_TRACKS && kf_block_drivers[block] != KF_MIXED)
#define KF_VELOCITY kf_rates
#define KF_ACCELERATION kf_second_rates
#else
#define KF_ALONG_OF(model) 0
#define KF_SPEEDS(model) kf_alone
#define KF_VELOCITY kf_velocity
#define KF_ACCELERATION kf_acceleration
#define KF_AT(model, value, buffer) (value)
#define KF_IS_ON_A_TRACK(block) ((void)(block), false)
#endif
#define KF_IS_ONE(solver) (KF_DRIVERS == 1 || (KF_TRACKS && KF_ALONG(solver) >= 0)) /* derivatives are over a driver */
#define KF_NAMED_DRIVER(solver) (KF_TRACKS ? KF_ALONG(solver) : -1) /* the driver that messages name; -1: all */
#define KF_ALONG(solver) KF_ALONG_OF(&(solver)->model)
#define KF_HERE(solver, pose) (KF_POSE_U(pose)[KF_ALONG(solver)])
#define KF_POOL(solver) (&(solver)->pools[KF_ALONG(solver)])

/* Return whether a call needed more pose solves than it may take: trusted steps fail from there on. */
static inline bool kf_is_overworked(const kf_solver *solver)
{
    return solver->scratch.work > solver->most_work;
}

/* pose.c */
#define KF_REST (KF_ROOM(KF_DRIVERS) > KF_ROOM(KF_UNKNOWNS) ? KF_ROOM(KF_DRIVERS) : KF_ROOM(KF_UNKNOWNS))
extern const double kf_alone[KF_ROOM(KF_DRIVERS)]; /* the direction of a single driver: derivatives are with respect to it */
extern const double kf_at_rest[KF_REST];
void kf_fresh(kf_pose *pose, int map, double low, double high);
bool kf_evaluated(const kf_model *model, const double *u, const double *z, const bool *held, kf_found *found);
bool kf_evaluated_as_given(const kf_model *model, const double *u, const double *z, kf_found *found);
void kf_tangent(const kf_model *model, kf_pose *pose);

/* span.c */
void kf_hermite_through(int count, const double *nodes, const double samples[][3], kf_hermite *polynomial);
void kf_hermite_at(const kf_hermite *polynomial, double x, double values[3]);
void kf_weights(int count, const double *nodes, double x, double weights[][3]);

void kf_span_node(kf_span *span, int place, kf_pose *node, const kf_model *model);
void kf_span_reverse(kf_span *span);
void kf_span_hold(kf_span *span, const double *before, const double *after);
void kf_combined(const kf_span *span, double half, int count, const int *nodes, const double weights[][3],
                 double *z);
double kf_span_apart(const kf_span *span);
void kf_span_middle(const kf_span *span, double *z);
void kf_span_read(const kf_span *span, kf_inner *inner, double x, double *z, double *zd, double *zdd);
void kf_span_difference(const kf_span *span, kf_inner *inner, double x, double *z, double *zd, double *zdd);

/* bridge.c */
double kf_turned(double angle, double turns);
double kf_whole_turns(double angle);
void kf_make_bridge(kf_bridge *bridge, const kf_solver *solver, int span, double turns);
bool kf_bridge_closes(kf_solver *solver, const kf_bridge *bridge, kf_found *found);
bool kf_covers(const kf_bridge *bridge, double u);
bool kf_bridge_pose(kf_solver *solver, int number, const double *u, kf_pose *pose);
bool kf_bridge_exit(kf_solver *solver, int number, double target, kf_pose *pose);
void kf_bridge_missed(kf_solver *solver, const kf_pose *pose, double slope, double missed[3]);
void kf_bridge_difference(kf_solver *solver, int number, double u, double *z, double *zd, double *zdd);
int kf_moved(kf_solver *solver, int number, kf_pose *pose, double u);

/* singularity_map.c */
void kf_around(const kf_solver *solver, int map, double u, double *low, double *high);
int kf_next_bridge(const kf_solver *solver, int map, double here, double target);
int kf_spare_bridge(const kf_solver *solver);
KF_RARE int kf_surveyed(kf_solver *solver, kf_pose *pose, kf_pose *trial);
void kf_keep_maps(kf_solver *solver, int start, int pose, int regular);

/* limit.c */
typedef struct {
    double u[KF_ROOM(KF_DRIVERS)];
    int block;
    bool crosses; /* another branch crosses there and no bridge holds: the motion does not turn back */
    int pole;     /* the unknown that runs to infinity there, or KF_NO_POLE */
} kf_limit;
/* Make a limit at driver values. */
void kf_limit_at(kf_limit *limit, const double *u, int block);
bool kf_pole_before(kf_solver *solver, kf_pose *before, kf_pose *pose, const double *direction, double distance,
                    double least, kf_limit *limit);
void kf_limit_beyond(kf_solver *solver, const kf_pose *before, kf_pose *pose, const double *direction, kf_limit *limit);
bool kf_is_beyond(const double *target, const double *limit, const double *direction, double s);
void kf_append_limit(char *message, const kf_limit *limit, const double *target, int driver);
void kf_append_rounding(char *message); /* of rows tied to the world's origin, far from it */
void kf_append(char *message, const char *format, ...);
void kf_append_number(char *message, const char *format, double value);
void kf_append_place(char *message, const double *u, int digits, int driver); /* -1: all of them */
bool kf_differs(const double *a, const double *b, int digits);
/* Append the redundant row with the largest gap; about, format: of the gap. */
void kf_append_watch(char *message, const kf_model *model, const kf_found *found, const char *about,
                     const char *format);

/* advance.c
 *
 * A straight path of the driver values, as far as it has been followed in trusted steps. pose: the last trusted one,
 * before: the one before it, regular: the last one away from singular points; places: of four poses; distance: what is
 * left to the target; length: of the next step; most_steps: 0 where the target is too far; iterations: of Newton, of all
 * steps; end: the pose at the target, NULL where the path ends at the limit before it.
 */
typedef struct {
    kf_pose *places, *pose, *before, *regular, *end;
    const double *target;
    double direction[KF_ROOM(KF_DRIVERS)], u[KF_ROOM(KF_DRIVERS)];
    double distance, length, longest, margin;
    int most_steps, iterations;
    bool is_limited, is_ended;
    kf_limit limit;
} kf_path;

/* Start a path along one driver, or along all if it is below 0. */
void kf_path_init(kf_path *path, kf_pose *start, const double *target, int driver, kf_pose *places);

/* Return a place for one more pose that holds none of those needed. */
kf_pose *kf_path_spare(const kf_path *path);

/* Find the next step; return the driver values at its end, which are the target in the last one. */
const double *kf_path_ahead(kf_path *path, double *s);

/* Go on from a trusted pose with longer steps, or end there if it is at the target. */
void kf_path_accept(kf_path *path, kf_pose *trial, double s, double margin);

/* Go on with shorter steps; return whether they are so short that the path's limit is needed. */
bool kf_path_shorten(kf_path *path, double s);

/* End at the limit if no step is left or if the target lies beyond it. */
void kf_path_limit(kf_path *path, double s);

/* Return the pose at the target, with the iterations of the whole path, or NULL and the limit before it.
 *
 * A dead centre has no tangent that the next path could start with: that starts from the last regular pose.
 */
kf_pose *kf_path_terminate(kf_path *path, kf_limit *limit);

KF_RARE kf_pose *kf_advance(kf_solver *solver, kf_pose *start, int map, const double *target, kf_limit *limit);

/* trusted_step.c */
bool kf_trusted_step(kf_solver *solver, kf_pose *pose, const double *direction, double s, const double *u,
                     kf_pose *trial);
#if KF_HAS(KF_LAWS)
bool kf_passes_unseen_between(kf_solver *solver, kf_pose *pose, const kf_pose *trial);
#endif
bool kf_keeps_branch(kf_solver *solver, kf_pose *pose, kf_pose *trial, const double *direction, double s);
kf_pose *kf_follow_path(kf_solver *solver, kf_pose *start, double u);

/* Return direction and length of a straight path of several drivers, measured by the one with most to go. */
static inline double kf_straight_path(const double *start, const double *target, double *direction)
{
    double length = 0.0;
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        length = fmax(length, fabs((target[k] - start[k]) / kf_reach[k]));
    }
    for (k = 0; k < KF_DRIVERS; ++k) {
        direction[k] = (target[k] - start[k]) / length;
    }
    return length;
}

/* tracks.c */
#if KF_HAS(KF_TRACKS)
kf_pose *kf_on_track(kf_solver *solver, const kf_pose *whole, int driver);
#endif
const bool *kf_rates_in_time(const kf_model *model, kf_pose *pose, const double *ud, const double *udd);
#if KF_HAS(KF_MIXES)
KF_RARE kf_status kf_advance_mixed(kf_solver *solver, kf_pose *start, const double *target, kf_pose *pose);
#endif

/* worst_case_step.c */
bool kf_worst_case_step(const kf_model *model, const kf_found *found, int block, const double *rows, double *step);
double kf_known_to(const kf_found *found, int block);
int kf_worst_blocks(const kf_model *model, const kf_found *found, const bool *held, int *worst, double *weight);
double kf_larger(double most, int count, const double *values, const double *scales);
int kf_first_of(int block);

/* solver.c */
KF_RARE kf_status kf_failed(kf_pose *pose, kf_status status);
bool kf_is_refused(kf_solver *solver, const double *u, int driver, bool mixed);
kf_status kf_checked(kf_solver *solver, kf_pose *pose);
KF_RARE kf_status kf_overworked(kf_solver *solver, const double *u, kf_pose *pose);
#if KF_HAS(KF_TRACKS)
kf_status kf_solve_along(kf_solver *solver, kf_pose *start, const double *u, kf_pose *pose);
#endif
void kf_outputs_of(const kf_model *model, const kf_pose *pose, const double *ud, const double *udd, double *outputs,
                   double *rates, double *accelerations);

/* continuation.c */

/* Return the smallest length of a block's residuals near z, relative to the size (Levenberg-Marquardt), and put the
 * unknowns that give it into z; 0 if nothing can be evaluated there.
 */
double kf_gap(kf_solver *solver, const kf_model *model, int block, const double *u, double *z);

/* How a continuation went: its steps, and the block that failed last, -1 without one. */
typedef struct {
    int steps, block;
} kf_continuation;

/* Follow a good pose at driver values u from parameters to others in a straight line; `pose` and the solver's model
 * are then those reached. shortest: step, as a part of the line, at which it gives up. Return whether that is the end.
 */
bool kf_continued(kf_solver *solver, const double *from, const double *to, const double *u, double shortest,
                  kf_pose *pose, kf_continuation *path);

#endif
