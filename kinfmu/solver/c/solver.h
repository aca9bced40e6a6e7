/* The solver: follows the branch of a mechanism that its anchor lies on. See kinfmu/solver/python/solver.py.
 *
 *     static kf_solver solver;                        zeroed memory, so that equal runs leave equal bytes
 *     kf_pose poses[2];
 *     kf_solver_start(&solver);
 *     kf_solve(&solver, &solver.anchor, u, &poses[0]);
 *     kf_motion(&solver, &poses[0], ud, udd, outputs, rates, accelerations);
 *     kf_solve(&solver, &poses[0], next_u, &poses[1]);    and so on, in turns: what is found is not copied
 *
 * State is in the poses. A trial pose does not affect another one found later from the same
 * start. The singularity map of a pose is kept in the solver, since it is large and rarely changes;
 * the pose refers to it by number. kf_solve keeps what its start refers to, and what it finds; what any other
 * pose refers to may be overwritten. So after kf_solve(s, a, u, b) go on from a (another trial) or from b (it is
 * accepted), and from the anchor at any time; a third pose must be kept together with a copy of its
 * solver.
 *
 * There are no pointers inside: copies of the solver and of the poses, byte by byte, are the whole state, and do the
 * same to the bit wherever they are copied to, in another instance too. Of the solver the first KF_SOLVER_STATE bytes
 * are enough: what follows does not outlive a call. Nothing is allocated, nothing is global: threads may run a solver
 * each.
 */
#ifndef KF_SOLVER_H
#define KF_SOLVER_H

#include "kinfmu.h"

#define KF_MESSAGE 480 /* characters, with the 0 at the end */

#define KF_GOOD(status) ((status) <= KF_BRIDGED) /* the pose holds numbers */

/* The part of a pose of the whole mechanism that belongs to one driver's track: base, singularity map and bridge. */
typedef struct {
    kf_status status;
    int map, bridge, base_bridge;
    bool has_base;
    double base_u, base_z[KF_ROOM(KF_UNKNOWNS)];
} kf_track_pose;

/* A pose that was found. If it is not good, only its status is defined.
 *
 * x1, x2: derivatives of the coordinates with respect to the single driver, as many as `derivatives` counts; low,
 * high: the interval around the pose without windows of bridges; map: number of its singularity map, -1: empty;
 * bridge: that by which the pose is interpolated, or -1. A dead centre has no tangent that the next path could start
 * with: that starts from its base, the last regular pose before it, to which map, low and high then belong.
 */
typedef struct {
    kf_found found;
    double x1[KF_ROOM(KF_COORDINATES)];
    double x2[KF_ROOM(KF_COORDINATES)];
    double low, high;
    double base_u[KF_ROOM(KF_DRIVERS)];
    double base_z[KF_ROOM(KF_UNKNOWNS)];
    kf_status status;
    int derivatives;
    int map, bridge, base_bridge;
    bool has_base;
#if KF_HAS(KF_TRACKS)
    bool has_tracks, is_held;
    kf_track_pose own[KF_ROOM(KF_DRIVERS)];
    bool held[KF_ROOM(KF_BLOCKS)]; /* blocks that are interpolated, and their derivatives, each over its own driver */
    double own1[KF_ROOM(KF_UNKNOWNS)], own2[KF_ROOM(KF_UNKNOWNS)];
#endif
} kf_pose;

#define KF_POSE_U(pose) ((pose)->found.x + KF_COORDINATES - KF_DRIVERS) /* its driver values */

/* Interpolation across a singular point from six regular poses: see kinfmu/solver/python/span.py. */
#define KF_NODES 6
typedef struct {
    double centre, half;
    double u[KF_NODES];
    double z[KF_NODES][KF_ROOM(KF_UNKNOWNS)];
    double zd[KF_NODES][KF_ROOM(KF_UNKNOWNS)];
    double zdd[KF_NODES][KF_ROOM(KF_UNKNOWNS)];
    bool held[KF_ROOM(KF_BLOCKS)];
} kf_span;

/* A polynomial in Newton's form: see kinfmu/solver/python/span.py. */
#define KF_MOST_NODES 4
typedef struct {
    int count; /* of the terms, three a node */
    double coefficients[3 * KF_MOST_NODES], nodes[3 * KF_MOST_NODES];
} kf_hermite;

/* The polynomials of the unknowns through a span's inner nodes, and what they were made from. */
typedef struct {
    double half;
    double z[KF_MOST_NODES][KF_ROOM(KF_UNKNOWNS)];
    double zd[KF_MOST_NODES][KF_ROOM(KF_UNKNOWNS)];
    double zdd[KF_MOST_NODES][KF_ROOM(KF_UNKNOWNS)];
    kf_hermite polynomials[KF_ROOM(KF_UNKNOWNS)];
} kf_inner;

/* A span, moved by whole turns of the driver and of each unknown: see kinfmu/solver/python/bridge.py. */
typedef struct {
    int span; /* its number in the solver */
    double turns;
    double raised[KF_ROOM(KF_UNKNOWNS)];
    double centre, half;
    double u[KF_NODES]; /* of the nodes, moved; the window is between the third and the fourth */
} kf_bridge;

/* Driver values between which a block's determinant was searched for a zero: none is bridged there. */
typedef struct {
    double low, high;
    int block;
} kf_interval;

/* The singular points known so far along one driver: see kinfmu/solver/python/singularity_map.py. */
#define KF_IS_FOLLOWED (KF_DRIVERS == 1 || KF_TRACKS) /* along one driver: there are bridges */
#define KF_INTERVALS (KF_IS_FOLLOWED ? KF_KEPT + KF_BLOCKS : 1) /* at one place there may be one for each block */
typedef struct {
    int bridges, intervals;
    int bridge[KF_KEPT]; /* their numbers in the solver, the latest last */
    kf_interval searched[KF_ROOM(KF_INTERVALS)];
} kf_singularity_map;

/* In use at the same time are the maps of the start, of the current pose and of the last regular one, and a new one.
 * Bridges on later turns share the span of the first; where there are more singular points than KF_SPANS, the last are
 * not bridged. Blocks of several drivers follow the tracks step by step: the maps of the first start are needed too.
 */
#define KF_MAPS (KF_IS_FOLLOWED ? 4 + KF_MIXES : 1)
#define KF_BRIDGES (KF_IS_FOLLOWED ? (3 + KF_MIXES) * KF_KEPT + 1 : 1)
#define KF_SPANS (KF_IS_FOLLOWED ? KF_KEPT + 8 : 1)

/* Maps, bridges and spans along one driver. */
typedef struct {
    kf_singularity_map maps[KF_ROOM(KF_MAPS)];
    kf_bridge bridges[KF_ROOM(KF_BRIDGES)];
    kf_span spans[KF_ROOM(KF_SPANS)];
} kf_pool;

#define KF_POOLS (KF_TRACKS ? KF_DRIVERS : 1)

/* Errors of the unknowns: of z, of the derivatives by rounding, the derivatives given of held blocks, and of u. */
typedef struct {
    double z[KF_ROOM(KF_UNKNOWNS)], first[KF_ROOM(KF_UNKNOWNS)], second[KF_ROOM(KF_UNKNOWNS)];
    double given_first[KF_ROOM(KF_UNKNOWNS)], given_second[KF_ROOM(KF_UNKNOWNS)];
    double missed[3]; /* errors of outputs and their derivatives because lengths miss a change point */
    double u[KF_ROOM(KF_DRIVERS)];
    bool is_given, is_of_laws;
} kf_source;

#define KF_INNERS 2 /* as many as most mechanisms have singular points */

/* Memory of a single call; the polynomials used last are kept, since the next call may use them again. */
typedef struct {
    kf_inner inner[KF_INNERS];
    kf_pose base, poses[4], follow[2], nearby, located;
#if KF_HAS(KF_TRACKS)
    kf_pose track[2];
#endif
#if KF_HAS(KF_MIXES)
    kf_pose whole[4], share[2];
    int origin[KF_ROOM(KF_DRIVERS)]; /* maps of the tracks where a path of several drivers starts: needed until it ends */
#endif
    kf_model ahead;
    kf_source source;
    double rows[2][3][KF_ROOM(KF_OUTPUTS)];
    double z[KF_ROOM(KF_UNKNOWNS)], zd[KF_ROOM(KF_UNKNOWNS)], zdd[KF_ROOM(KF_UNKNOWNS)];
    double determinants[3][KF_ROOM(KF_BLOCKS)]; /* of nodes around a zero */
    double x1[KF_ROOM(KF_COORDINATES)], x2[KF_ROOM(KF_COORDINATES)];
    int live[3]; /* maps that are needed */
    int work;    /* pose solves of the call: predictions that were corrected, and poses evaluated at nodes of bridges */
} kf_scratch;

/* tolerance: residual relative to the size above which a pose is not good (Newton always goes to round-off); most_work:
 * pose solves above which kf_solve fails; anchor: where all paths start; message: the reason of the last failure.
 */
typedef struct {
    kf_model model;
    double tolerance;
    int most_work;
    kf_pose anchor;
    bool unsolvable; /* the parameters have no solution: every pose fails, and the message states why */
    char message[KF_MESSAGE];
    kf_pool pools[KF_ROOM(KF_POOLS)];
    kf_scratch scratch;
} kf_solver;

#define KF_SOLVER_STATE offsetof(kf_solver, scratch)

#define KF_ANY_WORK 0x7fffffff /* most_work: no limit */

/* Start with the parameters of the mechanism, tolerance 1e-9 and any work. */
void kf_solver_start(kf_solver *solver);

/* Set the parameters (KF_PARAMETERS), followed from those of the mechanism with the drivers at rest; the tolerance stays.
 * false: they have no solution, the message states why, and every pose fails with it. Poses found before are invalid.
 */
bool kf_solver_bind(kf_solver *solver, const double *parameters);

/* The pose at driver values u (KF_DRIVERS), followed from the good pose `start`, another one, in a straight line of
 * the driver values. The start stays what it is; derivatives that it has not been asked for yet are added to it. The
 * status is that of the pose; if it is not good, the solver's message states why, in one line.
 */
kf_status kf_solve(kf_solver *solver, kf_pose *start, const double *u, kf_pose *pose);

/* Outputs, their rates and accelerations (KF_OUTPUTS each) at driver speeds ud and accelerations udd (KF_DRIVERS
 * each); NULL: not wanted, and nothing is computed for it (ud and udd may be NULL where nothing needs them).
 */
void kf_motion(const kf_solver *solver, kf_pose *pose, const double *ud, const double *udd, double *outputs,
               double *rates, double *accelerations);

/* Estimated errors of the outputs, their rates and accelerations, the largest of each, in radians and sizes; infinite
 * where they are unknown. See kinfmu/solver/python/estimate.py.
 */
void kf_errors(kf_solver *solver, kf_pose *pose, const double *ud, const double *udd, double errors[3]);

/* The largest difference of two rows of outputs, in radians and sizes; infinite if it is not a number. */
double kf_largest_gap(const double *there, const double *here);

/* The smallest over the blocks of 1 / cond of the equilibrated block, 0 at a singular point, or of |determinant| over
 * the largest that it can be: where a row vanishes, equilibrating hides it.
 */
double kf_margin(const kf_solver *solver, const kf_pose *pose);

#endif
