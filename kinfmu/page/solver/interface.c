/* What a page calls: one mechanism with its parameters, the pose that is shown, and sweeps that leave it.
 *
 * Numbers are exchanged in arrays, whose places kf_page_place returns; they stay where they are. Every function works on
 * these arrays, so that a call from JavaScript passes no memory.
 */
#include "instance.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "follower.h"
#include "internal.h"

#define LARGEST_RATE 1e100   /* of drivers; squares of much larger numbers are infinite */
#define LARGEST_NUMBER 1e30  /* of parameters: as mechanism files have them */
#define CLOSED 1e-10         /* gap of rows that close, relative to the size */
#define TURN 6.283185307179586
#define SAME 1e-6            /* difference of poses of one branch, in radians and sizes */
#define NEAR 0.1             /* the same, at singular poses, from which no branch can be followed */
#define SHORTEST 1e-13       /* step between parameters that are followed from the pose shown */

/* What became of parameters to bind; the order is that of web/engine.js. */
typedef enum { REFUSED, BOUND, UNREACHED, OTHER_BRANCH } binding;

/* The pose shown, and another solver with the same parameters: for sweeps, and for parameters that may have no solution. */
static kf_follower followers[2];
static int shown;
#define SPEEDS (drive + KF_DRIVERS)
#define ACCELERATIONS (drive + 2 * KF_DRIVERS)

static const char *message = "";
static char refusal[KF_MESSAGE];

#define PARAMETERS_BOUND offsetof(kf_solver, pools) /* of a follower that restarts: its anchor refers to no pool */
#define SETTINGS (KF_ROOM(KF_PARAMETERS) + KF_ROOM(KF_CONSTANTS))
static double settings[SETTINGS]; /* asked for: parameters, then constants of the laws */
static double bound[SETTINGS];
static double drive[3 * KF_ROOM(KF_DRIVERS)]; /* values, then speeds, then accelerations */
static double motion[3 * KF_ROOM(KF_OUTPUTS)], swept[3 * KF_ROOM(KF_OUTPUTS)];
static double errors[3], fixed[KF_ROOM(KF_FIXED)], points[2 * KF_ROOM(KF_POINTS)];
static double forces[KF_ROOM(KF_FORCES)], efforts[KF_ROOM(KF_LOADS)], reactions[KF_ROOM(KF_REACTIONS)];

/* The arrays, in the order that web/engine.js gives their numbers. */
double *kf_page_place(int which)
{
    double *const places[] = {settings, bound, drive,  motion, swept,
                              errors,   fixed, points, forces, efforts, reactions};
    return places[which];
}

int kf_page_length(int which)
{
    const int lengths[] = {KF_PARAMETERS + KF_CONSTANTS, KF_PARAMETERS + KF_CONSTANTS, 3 * KF_DRIVERS,
                                  3 * KF_OUTPUTS, 3 * KF_OUTPUTS, 3, KF_FIXED, 2 * KF_POINTS,
                                  KF_FORCES, KF_LOADS, KF_REACTIONS};
    return lengths[which];
}

const char *kf_page_message(void)
{
    return message;
}

static kf_pose *pose_of(kf_follower *follower)
{
    return follower->started ? &follower->poses[follower->here] : &follower->solver.anchor;
}

/* Compute driver values at a time; NaN where a rate is too large. */
static void drive_at(const kf_model *model, const double *constants, double time, double *values)
{
    int k;
    kf_drive(model, time, constants, values, values + KF_DRIVERS, values + 2 * KF_DRIVERS);
    for (k = 0; k < KF_DRIVERS; ++k) {
        if (!(fabs(values[KF_DRIVERS + k]) <= LARGEST_RATE && fabs(values[2 * KF_DRIVERS + k]) <= LARGEST_RATE)) {
            values[k] = NAN;
        }
    }
}

/* Return whether the settings are numbers that the mechanism accepts; else write why they are not. */
static bool is_accepted(void)
{
    int k;
    refusal[0] = '\0';
    for (k = 0; k < KF_PARAMETERS + KF_CONSTANTS; ++k) {
        const char *const name = k < KF_PARAMETERS ? kf_parameter_names[k] : kf_constant_names[k - KF_PARAMETERS];
        const bool is_positive = k >= KF_PARAMETERS && kf_constant_is_positive[k - KF_PARAMETERS];
        if (!(fabs(settings[k]) <= LARGEST_NUMBER)) {
            snprintf(refusal, sizeof refusal, "%s = %.6g must be a number of at most %g", name, settings[k],
                     LARGEST_NUMBER);
            return false;
        }
        if (is_positive && !(settings[k] > 0.0)) {
            snprintf(refusal, sizeof refusal, "%s = %.15g must be positive", name, settings[k]);
            return false;
        }
    }
    return true;
}

/* Return whether the laws start at a pose that can be reached, if they start elsewhere than in the file. */
static bool starts(kf_follower *follower)
{
    const kf_model *const model = &follower->solver.model;
    double there[3 * KF_ROOM(KF_DRIVERS)], written[3 * KF_ROOM(KF_DRIVERS)];
    bool is_elsewhere = false;
    int k;
    for (k = 0; k < KF_PARAMETERS; ++k) {
        is_elsewhere = is_elsewhere || settings[k] != kf_parameters_written[k];
    }
    kf_drive(model, KF_START, settings + KF_PARAMETERS, there, there + KF_DRIVERS, there + 2 * KF_DRIVERS);
    kf_drive(model, KF_START, kf_constants_written, written, written + KF_DRIVERS, written + 2 * KF_DRIVERS);
    for (k = 0; k < KF_DRIVERS; ++k) {
        is_elsewhere = is_elsewhere || there[k] != written[k];
    }
    return !is_elsewhere || KF_GOOD(kf_followed(follower, there)->status);
}

/* Return the largest difference of two poses with the same parameters, in radians and sizes, without whole turns. */
static double apart(const kf_solver *solver, kf_pose *here, kf_pose *there)
{
    double largest = 0.0;
    int k;
    kf_motion(solver, here, NULL, NULL, swept, NULL, NULL);
    kf_motion(solver, there, NULL, NULL, swept + KF_OUTPUTS, NULL, NULL);
    for (k = 0; k < KF_OUTPUTS; ++k) {
        double gap = swept[k] - swept[KF_OUTPUTS + k];
        gap = kf_output_is_angle[k] ? gap - TURN * floor(gap / TURN + 0.5) : gap / kf_size;
        largest = fmax(largest, fabs(gap));
    }
    return largest;
}

/* Return whether a determinant has another sign: branches that cross nearby come as close as any tolerance. */
static bool is_across(const kf_pose *here, const kf_pose *there)
{
    int k;
    for (k = 0; k < KF_BLOCKS; ++k) {
        if (here->found.determinants[k] * there->found.determinants[k] < 0.0) {
            return true;
        }
    }
    return false;
}

/* Bind the settings to a follower with those bound now; if the pose shown is to stay on its branch, go to it.
 *
 * That branch is followed from the pose shown with the drivers at rest, from the values bound to the settings. The new
 * pose itself is that of the mechanism with these values, as everywhere: followed from the start of its laws.
 */
static binding bound_by(kf_follower *next, bool stays)
{
    static kf_pose expected;
    kf_pose *const from = pose_of(&followers[shown]), *pose;
    double u[KF_DRIVERS];
    kf_continuation path;
    bool is_known;
    memcpy(u, KF_POSE_U(from), sizeof u);
    KF_ASSIGN(&expected, from);
    is_known = stays && kf_continued(&next->solver, bound, settings, u, SHORTEST, &expected, &path);
    if (!kf_solver_bind(&next->solver, settings) || !starts(next)) {
        return REFUSED;
    }
    if (!stays) {
        kf_restart(next);
        return BOUND;
    }
    pose = kf_followed(next, u);
    if (!KF_GOOD(pose->status)) {
        return UNREACHED;
    }
    if (is_known ? apart(&next->solver, &expected, pose) > SAME || is_across(&expected, pose)
                 : from->found.margin > KF_UNDECIDED || apart(&next->solver, from, pose) > NEAR) {
        return OTHER_BRANCH;
    }
    return BOUND;
}

/* Take over the follower whose parameters are set, and set those of the other one to the same. */
static void show(int number)
{
    shown = number;
    memcpy(&followers[1 - number].solver, &followers[number].solver, PARAMETERS_BOUND);
    kf_restart(&followers[1 - number]);
}

static void read_model(void)
{
    const kf_model *const model = &followers[shown].solver.model;
    kf_fixed(model, fixed);
    kf_points(model, points);
}

void kf_page_start(void)
{
    kf_solver_start(&followers[0].solver);
    memcpy(settings, kf_parameters_written, KF_PARAMETERS * sizeof(double));
    memcpy(settings + KF_PARAMETERS, kf_constants_written, KF_CONSTANTS * sizeof(double));
    memcpy(bound, settings, sizeof bound);
    kf_restart(&followers[0]);
    show(0);
    read_model();
}

/* Set the parameters to the settings; if they have no solution, those bound before stay, and so does the pose.
 *
 * stays: the pose has the driver values shown and lies on the branch shown, or the settings are refused; otherwise the
 * next pose is followed from the start.
 */
int kf_page_bind(bool stays)
{
    kf_follower *const next = &followers[1 - shown];
    binding found = REFUSED;
    refusal[0] = '\0';
    message = refusal;
    if (is_accepted()) {
        kf_restart(next);
        found = bound_by(next, stays);
        if (found == BOUND) {
            show(1 - shown);
            memcpy(bound, settings, sizeof bound);
            read_model();
            message = "";
            return BOUND;
        }
        memcpy(refusal, next->solver.message, sizeof refusal);
        memcpy(&next->solver, &followers[shown].solver, PARAMETERS_BOUND);
        kf_restart(next);
    }
    memcpy(settings, bound, sizeof bound);
    return found;
}

/* Append "row AB" or "rows C.x, C.y" and what they do, in the form of the verb for one or for several. */
static void append_rows(int block, const char *of_one, const char *of_several)
{
    const bool is_one = kf_block_rows[block] == 1;
    kf_append(refusal, "%s %s %s", is_one ? "row" : "rows", kf_block_row_names[block], is_one ? of_one : of_several);
}

/* Write which rows do not close with the settings at the driver values, near the last good pose, and their smallest gap.
 *
 * Returns whether there is a gap: otherwise rows are named that close at a pose of another branch, or, for settings that
 * no mechanism has, nothing.
 */
bool kf_page_gap(void)
{
    kf_pose *const pose = pose_of(&followers[shown]);
    kf_solver *const solver = &followers[1 - shown].solver;
    kf_model *const model = &solver->scratch.ahead;
    kf_found *const found = &solver->scratch.follow[0].found;
    double z[KF_ROOM(KF_UNKNOWNS)];
    char why[KF_MESSAGE];
    bool has_gap = false;
    int k, weakest = 0;
    refusal[0] = '\0';
    message = refusal;
    memcpy(z, pose->found.x, KF_UNKNOWNS * sizeof(double));
    if (kf_bind(model, settings, why, sizeof why)) {
        for (k = 0; k < KF_BLOCKS && !has_gap; ++k) {
            const double gap = kf_gap(solver, model, k, drive, z);
            weakest = fabs(pose->found.determinants[k]) < fabs(pose->found.determinants[weakest]) ? k : weakest;
            if (gap > CLOSED) {
                has_gap = true;
                append_rows(k, "does not close: gap ", "do not close: gap ");
                kf_append_number(refusal, "%.4g", gap * kf_size);
                kf_append(refusal, " %s", kf_length_unit);
            }
        }
        if (!has_gap && kf_evaluated_as_given(model, drive, z, found) && found->watch > solver->tolerance) {
            has_gap = true;
            kf_append_watch(refusal, model, found, "gap ", "%.4g");
        } else if (!has_gap && KF_BLOCKS > 0) {
            append_rows(weakest, "closes", "close");
            kf_append(refusal, " on another branch only");
        }
    }
    memcpy(settings, bound, sizeof bound);
    return has_gap;
}

/* Compute the driver values at a time, by the laws. */
void kf_page_drive(double time)
{
    drive_at(&followers[shown].solver.model, bound + KF_PARAMETERS, time, drive);
}

/* Follow the branch again from where it is known. */
void kf_page_restart(void)
{
    kf_restart(&followers[shown]);
    kf_page_drive(KF_START);
}

/* Go on to the driver values; a pose that is not good leaves the one before and its numbers. */
int kf_page_at(void)
{
    kf_follower *const follower = &followers[shown];
    kf_pose *const pose = kf_followed(follower, drive);
    if (KF_GOOD(pose->status)) {
        kf_motion(&follower->solver, pose, SPEEDS, ACCELERATIONS, motion, motion + KF_OUTPUTS, motion + 2 * KF_OUTPUTS);
        message = "";
    } else {
        message = follower->solver.message;
    }
    return (int)pose->status;
}

double kf_page_margin(void)
{
    return kf_margin(&followers[shown].solver, pose_of(&followers[shown]));
}

void kf_page_errors(void)
{
    kf_errors(&followers[shown].solver, pose_of(&followers[shown]), SPEEDS, ACCELERATIONS, errors);
}

/* Compute the forces of a pose with the drive and the efforts, at a time of the laws of loads, or its reactions. */
static void find_forces(kf_follower *follower, double time, bool are_reactions)
{
    const kf_model *const model = &follower->solver.model;
    kf_pose *const pose = pose_of(follower);
    double zd[KF_ROOM(KF_UNKNOWNS)], zdd[KF_ROOM(KF_UNKNOWNS)], slopes[KF_ROOM(KF_DRIVERS) * KF_ROOM(KF_UNKNOWNS)];
    const double *const x = pose->found.x, *const p = model->parameters, *const ud = SPEEDS, *const udd = ACCELERATIONS;
    int k;
    if (KF_FORCES == 0) {
        return;
    }
    if (KF_DRIVERS == 1) {
        kf_tangent(model, pose);
        for (k = 0; k < KF_UNKNOWNS; ++k) {
            slopes[k] = pose->x1[k];
            zd[k] = slopes[k] * ud[0];
            zdd[k] = pose->x2[k] * (ud[0] * ud[0]) + slopes[k] * udd[0];
        }
    } else {
        for (k = 0; k < KF_DRIVERS; ++k) {
            double unit[KF_ROOM(KF_DRIVERS)] = {0.0};
            unit[k] = 1.0;
            kf_rates_in_time(model, pose, unit, NULL);
            memcpy(slopes + k * KF_UNKNOWNS, pose->x1, KF_UNKNOWNS * sizeof *slopes);
        }
        kf_rates_in_time(model, pose, ud, udd);
        memcpy(zd, pose->x1, KF_UNKNOWNS * sizeof *zd);
        memcpy(zdd, pose->x2, KF_UNKNOWNS * sizeof *zdd);
    }
    if (!are_reactions) {
        kf_forces(time, drive, ud, udd, x, zd, zdd, slopes, efforts, p, forces);
        return;
    }
    kf_reactions(time, drive, ud, udd, x, zd, zdd, slopes, efforts, p, reactions);
    for (k = 0; pose->status == KF_BRIDGED && k < KF_OF_JOINTS; ++k) {
        reactions[k] = NAN; /* the blocks do not give them there */
    }
    kf_shaking(time, drive, ud, udd, x, zd, zdd, slopes, efforts, p, reactions + KF_OF_JOINTS);
}

void kf_page_forces(double time)
{
    find_forces(&followers[shown], time, false);
}

void kf_page_reactions(double time)
{
    find_forces(&followers[shown], time, true);
}

/* Begin a sweep: it starts where the branch is known, and leaves the pose shown. */
void kf_page_sweep(void)
{
    kf_restart(&followers[1 - shown]);
}

/* Compute one sample of a sweep at the driver values, at a time of the laws of loads.
 *
 * orders: 1 positions alone, 2 with rates, 3 with accelerations, 4 with forces.
 */
int kf_page_sample(int orders, double time)
{
    kf_follower *const follower = &followers[1 - shown];
    kf_pose *const pose = kf_followed(follower, drive);
    if (KF_GOOD(pose->status)) {
        kf_motion(&follower->solver, pose, SPEEDS, ACCELERATIONS, swept, orders > 1 ? swept + KF_OUTPUTS : NULL,
                  orders > 2 ? swept + 2 * KF_OUTPUTS : NULL);
        if (orders > 3) {
            find_forces(follower, time, false);
        }
    }
    return (int)pose->status;
}
