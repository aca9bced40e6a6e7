/* The model and the solver of a mechanism in C99: libm only, no allocation, no global state.
 *
 * model.c is generated from the plan of a mechanism, sizes.h with it; all other files are the same for every
 * mechanism. Names and methods are those of the Python run time (kinfmu/solver/python), file by file; its constants and
 * statuses are generated into constants.h: each is described where Python defines it.
 */
#ifndef KINFMU_H
#define KINFMU_H

#include <stdbool.h>
#include <stddef.h>

#include "constants.h"
#include "curve.h"
#include "sizes.h"

#ifndef KF_ROOM /* pages define these: they know the sizes at run time (kinfmu/page/solver/page_sizes.h) */
#define KF_ROOM(n) ((n) > 0 ? (n) : 1) /* arrays without elements are no C */
#define KF_HAS(n) (n)                  /* whether there is code for what some models do not have */
#define KF_ASSIGN(to, from) (*(to) = *(from)) /* of poses */
#endif

/* Compiler hints: functions that are rarely called, and the function most samples go through, to be inlined as a whole. */
#if defined(__GNUC__)
#define KF_RARE __attribute__((cold))
#define KF_WHOLE __attribute__((flatten))
#else
#define KF_RARE
#define KF_WHOLE
#endif

/* Inputs of the formulas other than the pose: the parameters, and what depends on them alone. */
typedef struct {
    double parameters[KF_ROOM(KF_PARAMETERS)];
    double derived[KF_ROOM(KF_DERIVED)];
#if KF_HAS(KF_TRACKS)
    int track; /* 0: the whole model; else the number of a driver, from 1, with the blocks that depend on it alone; or
                * KF_MIXED: the blocks that depend on several drivers */
    bool outside[KF_ROOM(KF_BLOCKS)]; /* all other blocks */
    double along[KF_ROOM(KF_DRIVERS)], rest[KF_ROOM(KF_DRIVERS)]; /* speeds of the drivers, and their values */
    double kept[KF_ROOM(KF_UNKNOWNS)]; /* unknowns of those blocks */
#if KF_HAS(KF_MIXES)
    double slopes[KF_ROOM(KF_UNKNOWNS)]; /* their derivatives on the path, for KF_MIXED; all others rest */
#endif
#endif
} kf_model;

/* A pose: x holds the unknowns first, then the coordinates that are given outright, then the driver values.
 *
 * determinants: one for each block, 1 far from singular; margin: the smallest of their sizes; residual: the largest
 * length of a block's residuals, relative to the size; moved: the largest correction of the prediction, in radians and
 * sizes; watch: the largest residual of the watches (redundant rows, which are not solved but monitored); hold:
 * numbers of the position stage that rates use.
 */
typedef struct {
    double x[KF_ROOM(KF_COORDINATES)];
    double hold[KF_ROOM(KF_HOLD)];
    double determinants[KF_ROOM(KF_BLOCKS)];
    double margin, residual, moved, watch;
    int iterations;
} kf_found;

/* Squared residuals of the blocks after Newton, relative to the size: the largest, the sum, that of the block that failed,
 * and that at which Newton may end; and the number of corrections.
 */
typedef struct {
    double largest, total, failed, enough;
    int iterations;
} kf_newton;

/* The model: generated. The rates x1 end with the drivers' speeds, as x ends with their values, and the accelerations x2
 * with theirs. held: one flag for each block, NULL for none: the block's unknowns are given, not solved for.
 */
extern const double kf_size;       /* of the mechanism, in its unit of length */
extern const double kf_offset;     /* from the world's origin, in sizes */
extern const double kf_row_offset; /* of numbers in rows, in sizes */
extern const double kf_anchor_u[KF_ROOM(KF_DRIVERS)];
extern const double kf_anchor_z[KF_ROOM(KF_UNKNOWNS)];
extern const double kf_unknown_scales[KF_ROOM(KF_UNKNOWNS)];
#if KF_HAS(KF_TRACKS)
extern const int kf_block_drivers[KF_ROOM(KF_BLOCKS)]; /* the driver that each block depends on; KF_MIXED: several */
#endif
extern const double kf_reach[KF_ROOM(KF_DRIVERS)]; /* change that counts as a step of 1 */
extern const int kf_block_ends[KF_ROOM(KF_BLOCKS)]; /* last unknown + 1 of each block */
extern const int kf_block_rows[KF_ROOM(KF_BLOCKS)]; /* residuals of each block */
extern const double kf_row_scales[KF_ROOM(KF_ROWS)]; /* of the residuals, block after block */
extern const double kf_determinant_factors[KF_ROOM(KF_BLOCKS)]; /* 1 / determinant far from singular */
extern const int kf_distance_drivers[KF_ROOM(KF_DISTANCES)]; /* those that drive a distance: d.d - u^2 */
extern const int kf_distance_blocks[KF_ROOM(KF_DISTANCES)];  /* where their rows are */
extern const int kf_distance_rows[KF_ROOM(KF_DISTANCES)];
extern const double kf_distance_scales[KF_ROOM(KF_DISTANCES)]; /* of these rows */
#if KF_HAS(KF_LAWS) /* motions that steps monitor: arguments of laws, lengths, coordinates that laws give; see trusted_step.py */
extern const double kf_law_turns[KF_ROOM(KF_LAW_ARGUMENTS)]; /* 0 if the argument does not jump back */
extern const double kf_law_units[KF_ROOM(KF_LAWS)];
#endif
extern const double kf_parameters_written[KF_ROOM(KF_PARAMETERS)];
extern const bool kf_parameter_is_angle[KF_ROOM(KF_PARAMETERS)];
extern const double kf_constants_written[KF_ROOM(KF_CONSTANTS)]; /* of the laws */

extern const char kf_name[];
extern const char kf_length_unit[];
extern const char *const kf_driver_names[KF_ROOM(KF_DRIVERS)];
extern const bool kf_driver_is_angle[KF_ROOM(KF_DRIVERS)];
extern const char *const kf_unknown_names[KF_ROOM(KF_UNKNOWNS)];
extern const bool kf_unknown_is_angle[KF_ROOM(KF_UNKNOWNS)];
extern const bool kf_output_is_angle[KF_ROOM(KF_OUTPUTS)];
extern const char *const kf_watch_names[KF_ROOM(KF_WATCHES)];
extern const char *const kf_parameter_names[KF_ROOM(KF_PARAMETERS)];
extern const char *const kf_block_row_names[KF_ROOM(KF_BLOCKS)]; /* "Q.x, Q.y" */

/* Indices in x, x1, x2 of outputs that are coordinates; -1: a formula. */
extern const int kf_outputs_places[KF_ROOM(KF_OUTPUTS)];
extern const int kf_rates_places[KF_ROOM(KF_OUTPUTS)];
extern const int kf_accelerations_places[KF_ROOM(KF_OUTPUTS)];

bool kf_bind(kf_model *model, const double *parameters, char *why, size_t size);
void kf_drive(const kf_model *model, double time, const double *constants, double *u, double *ud, double *udd);
bool kf_is_outside(const kf_model *model, int block); /* whether a block is outside the track that is followed */
int kf_solve_blocks(const kf_model *model, const double *z, const bool *held, kf_found *found,
                    kf_newton *newton); /* x of all blocks from what x predicts; -1, or the block that failed */
void kf_velocity(const kf_model *model, const kf_found *found, const double *ud, const double *given, const bool *held,
                 double *x1);
void kf_acceleration(const kf_model *model, const kf_found *found, const double *udd, const double *x1,
                     const double *given, const bool *held, double *x2);
void kf_outputs(const kf_model *model, const kf_found *found, double *outputs);
void kf_output_rates(const kf_model *model, const kf_found *found, const double *x1, double v, double *rates);
void kf_output_accelerations(const kf_model *model, const kf_found *found, const double *x1, const double *x2,
                             double v, double a, double *accelerations);
void kf_watches(const kf_model *model, const kf_found *found, double *watches);
#if KF_HAS(KF_LAWS)
void kf_law_positions(const kf_model *model, const kf_found *found, double *positions);
void kf_law_rates(const kf_model *model, const kf_found *found, const double *x1, double *rates);
void kf_law_accelerations(const kf_model *model, const kf_found *found, const double *x1, const double *x2,
                          double *accelerations);
void kf_law_steps(const kf_model *model, const double *arguments, double *steps); /* the fewest up to each argument */
void kf_law_slopes(const kf_model *model, double *slopes); /* bounds of their slopes */
void kf_law_added(const kf_model *model, double *added); /* bounds of the numbers that laws add to their arguments */
#endif
void kf_fixed(const kf_model *model, double *fixed);
void kf_jacobian(const kf_model *model, const kf_found *found, int block, double *jacobian); /* row after row */
void kf_residuals(const kf_model *model, const kf_found *found, int block, double *residuals); /* relative to the size */

/* Unknowns z + s zd + s^2 zdd / 2, corrected: -1, or the block that failed, with its residual in `found`. */
int kf_position(const kf_model *model, const double *u, const double *z, const double *zd, const double *zdd, double s,
                const bool *held, kf_found *found);

/* Small dense linear algebra: blocks of three unknowns and more, and least squares. */
#define KF_LU_ROOM(k) ((k) * (k) + 2 * (k))
#define KF_QR_ROOM(m, k) (2 * (m) * (k))
bool kf_lu(int k, const double *matrix, double *factors, double *determinant);
void kf_lu_solve(int k, const double *factors, const double *right, double *x);
bool kf_qr(int m, int k, const double *matrix, double *factors, double *determinant);
void kf_qr_solve(int m, int k, const double *factors, const double *right, double *x);
/* solutions.c, of stages of forces. */
void kf_solutions(int m, int k, int columns, const double *a, const double *b, double *factors, double *x);
double kf_row_part(int k, const double *matrix, const double *usual);
double kf_column_part(int m, int k, const double *matrix, const double *usual);
double kf_unclosed(int m, int k, const double *matrix, const double *right, double damping);
double kf_orientation(int m, int k, const double *a, const double *b);
double kf_reciprocal_condition(int m, int k, double *matrix);

#endif
