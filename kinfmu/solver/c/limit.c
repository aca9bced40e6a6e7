/* Limits: driver values where a path ends, and the messages that state where and why. See kinfmu/solver/python/limit.py.
 *
 * Messages are appended piece by piece and cut at the end of the buffer; numbers as %g of the C locale writes them.
 */
#include "internal.h"

#include <stdarg.h>
#include <stdio.h>

/* Move the limit past the last pose, to where a number vanishes that is `far` at the pose before and `near` at the last. */
static void extrapolate(const kf_pose *before, const kf_pose *pose, double near, double far, kf_limit *limit)
{
    int k;
    for (k = 0; far > near && k < KF_DRIVERS; ++k) {
        limit->u[k] += (KF_POSE_U(pose)[k] - KF_POSE_U(before)[k]) * (near / (far - near));
    }
}

void kf_limit_at(kf_limit *limit, const double *u, int block)
{
    memcpy(limit->u, u, KF_DRIVERS * sizeof *u);
    limit->block = block;
    limit->crosses = false;
    limit->pole = KF_NO_POLE;
}

/* Return where the path ends, just beyond a pose that steps cannot leave.
 *
 * Near a dead centre the tangent grows without bound, and determinant^2 falls linearly along the path: the secant rule
 * on the last two poses gives its zero. Where branches cross the determinant itself falls linearly.
 */
void kf_limit_beyond(kf_solver *solver, const kf_pose *before, kf_pose *pose, const double *direction, kf_limit *limit)
{
    const double *const determinants = pose->found.determinants;
    double near, far, steepest = 0.0;
    int k;
#if KF_HAS(KF_LAWS)
    double lengths[KF_LAWS], longer[KF_LAWS];
    kf_law_positions(&solver->model, &pose->found, lengths);
    kf_law_positions(&solver->model, &before->found, longer);
#endif
    kf_limit_at(limit, KF_POSE_U(pose), KF_BLOCKS > 0 ? 0 : KF_NO_BLOCK);
#if KF_HAS(KF_LAWS)
    for (k = KF_LAW_ARGUMENTS; k < KF_LAW_ARGUMENTS + KF_LAW_LENGTHS; ++k) {
        if (lengths[k] < KF_VANISHING * kf_size) {
            extrapolate(before, pose, lengths[k], longer[k], limit);
            limit->block = KF_NEGATIVE;
            return;
        }
    }
#endif
    if (KF_BLOCKS == 0) {
        return;
    }
    for (k = 1; k < KF_BLOCKS; ++k) {
        limit->block = fabs(determinants[k]) < fabs(determinants[limit->block]) ? k : limit->block;
    }
    if (KF_IS_ONE(solver)) {
        kf_tangent(&solver->model, pose);
    } else {
        KF_VELOCITY(&solver->model, &pose->found, direction, NULL, NULL, pose->x1);
    }
    for (k = kf_first_of(limit->block); k < kf_block_ends[limit->block]; ++k) {
        steepest = fmax(steepest, fabs(pose->x1[k]) / kf_unknown_scales[k]);
    }
    limit->crosses = steepest * (KF_IS_ONE(solver) ? kf_reach[KF_ALONG(solver)] : 1.0) < KF_STEEP;
    near = fabs(determinants[limit->block]);
    far = fabs(before->found.determinants[limit->block]);
    if (!limit->crosses) {
        near *= near;
        far *= far;
    }
    extrapolate(before, pose, near, far, limit);
}

/* Find first and second derivative of the unknowns at a pose on a path. */
static void derivatives_along(kf_solver *solver, kf_pose *pose, const double *direction)
{
    if (KF_IS_ONE(solver)) {
        kf_tangent(&solver->model, pose);
    } else {
        kf_rates_in_time(&solver->model, pose, direction, kf_at_rest);
    }
}

/* Find the pole that lies ahead of a pose within a distance along the path; return false if there is none; least: how far
 * away [sizes] what runs to infinity must be, 0 where no step is left.
 *
 * At the distance x from a pole of order p an unknown length grows like 1 / x^p, as that of a slide whose pin's path
 * becomes parallel to it. There f = z'/z'' = x / (p + 1) (1 + k x^2), and two poses give f and its slope, so x without
 * k. Steps become as short as x^(5/3), and do not pass it.
 */
bool kf_pole_before(kf_solver *solver, kf_pose *before, kf_pose *pose, const double *direction, double distance,
                    double least, kf_limit *limit)
{
    const double unit = KF_IS_ONE(solver) ? kf_reach[KF_ALONG(solver)] : 1.0;
    double between = 0.0, square = 0.0;
    int block, d, k = 0;
    for (d = 0; d < KF_DRIVERS; ++d) {
        between += (KF_POSE_U(pose)[d] - KF_POSE_U(before)[d]) * direction[d];
        square += direction[d] * direction[d];
    }
    between /= square;
    derivatives_along(solver, before, direction);
    derivatives_along(solver, pose, direction);
    for (block = 0; block < KF_BLOCKS; ++block) {
        for (; k < kf_block_ends[block]; ++k) {
            const double scale = kf_unknown_scales[k], first = pose->x1[k], second = pose->x2[k];
            double there, here, slope, order, ahead;
            if (kf_is_outside(&solver->model, block) || kf_unknown_is_angle[k] || before->x2[k] * between == 0.0
                || !(fabs(first) * unit > KF_STEEP * scale && second != 0.0
                     && first * first > least * scale * fabs(second))) {
                continue;
            }
            there = before->x1[k] / before->x2[k];
            here = first / second;
            slope = (here - there) / between;
            order = 0.5 * rint(-2.0 / slope) - 1.0;
            ahead = 1.5 * (there + here) / (2.0 / (order + 1.0) - slope) - 0.5 * between;
            if (KF_STEEPEST_SLOPE < slope && slope < KF_LEAST_SLOPE && 0.0 < KF_AT_POLE * ahead / distance
                && KF_AT_POLE * ahead / distance <= 1.0) {
                kf_limit_at(limit, KF_POSE_U(pose), block);
                limit->pole = k;
                for (d = 0; d < KF_DRIVERS; ++d) {
                    limit->u[d] += ahead * direction[d];
                }
                return true;
            }
        }
    }
    return false;
}

/* Return whether the target lies past the limit in the direction of s. */
bool kf_is_beyond(const double *target, const double *limit, const double *direction, double s)
{
    double sum = 0.0;
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        sum += (target[k] - limit[k]) * direction[k] * s;
    }
    return sum > 0.0;
}

/* Append why a target cannot be reached, in one line. */
void kf_append_limit(char *message, const kf_limit *limit, const double *target, int driver)
{
    int k;
    if (limit->block == KF_TOO_FAR) {
        kf_append_place(message, target, KF_ROUGHLY, driver);
        kf_append(message, " is too far from ");
        kf_append_place(message, limit->u, KF_ROUGHLY, driver);
        kf_append(message, ": more than %d steps on one path", KF_MOST_STEPS);
        return;
    }
    if (!kf_differs(target, limit->u, KF_LOCATED)) {
        kf_append_place(message, target, KF_LOCATED, driver);
        kf_append(message, " cannot be reached: to these digits it is the limit");
    } else {
        kf_append_place(message, target, kf_differs(target, limit->u, KF_ROUGHLY) ? KF_ROUGHLY : KF_LOCATED, driver);
        kf_append(message, " cannot be reached: the limit is ");
        kf_append_place(message, limit->u, KF_LOCATED, driver);
    }
    if (limit->block == KF_NEGATIVE) {
        kf_append(message, "; beyond it a distance would be negative");
    } else if (limit->pole != KF_NO_POLE) {
        kf_append(message, ", where %s runs to infinity", kf_unknown_names[limit->pole]);
    } else {
        kf_append(message, limit->crosses ? ", where branches of " : "; beyond it ");
        kf_append(message, limit->block == KF_NO_BLOCK ? "the joints" : limit->crosses ? "" : "the loop of ");
        for (k = kf_first_of(limit->block); limit->block >= 0 && k < kf_block_ends[limit->block]; ++k) {
            kf_append(message, "%s%s", k == kf_first_of(limit->block) ? "" : ", ", kf_unknown_names[k]);
        }
        kf_append(message, limit->crosses ? " cross" : " cannot close");
    }
    if (limit->crosses && KF_DRIVERS > 1 && driver < 0) {
        kf_append(message, "; the crossing depends on several drivers, so no bridge is built");
    }
    kf_append_rounding(message);
}

void kf_append_rounding(char *message)
{
    if (kf_row_offset > KF_FAR_FROM_ORIGIN) {
        kf_append(message, "; ");
        kf_append_number(message, "%.1e", kf_row_offset);
        kf_append(message, " sizes from the world's origin the rows are rounded to ");
        kf_append_number(message, "%.1e", kf_row_offset * KF_EPS);
        kf_append(message, " sizes");
    }
}

void kf_append(char *message, const char *format, ...)
{
    const size_t length = strlen(message);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message + length, KF_MESSAGE - length, format, arguments);
    va_end(arguments);
}

/* Append a number with a decimal point in every locale. */
void kf_append_number(char *message, const char *format, double value)
{
    char *text = message + strlen(message);
    kf_append(message, format, value == value ? value : fabs(value)); /* a NaN is printed without its sign */
    for (; *text != '\0'; ++text) {
        if (*text == ',') {
            *text = '.';
        }
    }
}

/* Append a number with at most `count` decimals, without zeros at its end. */
static void append_decimals(char *message, int count, double value)
{
    char *const text = message + strlen(message);
    char format[16];
    const bool is_large = !(value > -KF_LARGE && value < KF_LARGE);
    snprintf(format, sizeof format, is_large ? "%%.%dg" : "%%.%df",
             is_large && count > KF_ROUGHLY ? count + KF_MORE : count);
    kf_append_number(message, format, value);
    if (!is_large && strchr(text, '.') != NULL) {
        char *end = text + strlen(text);
        while (end[-1] == '0') {
            --end;
        }
        end -= end[-1] == '.';
        *end = '\0';
    }
    if (strcmp(text, "-0") == 0) {
        strcpy(text, "0");
    }
}

/* Append "crank = 1.047198 rad (60 deg)": driver values, of one driver or of all;
 * digits: decimals of angles, digits of lengths.
 */
void kf_append_place(char *message, const double *u, int digits, int driver)
{
    char format[16];
    int k;
    snprintf(format, sizeof format, "%%.%dg", digits);
    for (k = 0; k < KF_DRIVERS; ++k) {
        if (driver >= 0 && k != driver) {
            continue;
        }
        kf_append(message, "%s%s = ", k > 0 && driver < 0 ? ", " : "", kf_driver_names[k]);
        if (kf_driver_is_angle[k]) {
            append_decimals(message, digits, u[k]);
            kf_append(message, " rad (");
            append_decimals(message, digits - 2, u[k] * KF_DEGREE);
            kf_append(message, " deg)");
        } else {
            kf_append_number(message, format, u[k]);
            kf_append(message, " %s", kf_length_unit);
        }
    }
}

/* Return whether kf_append_place shows a driver of two places with different digits: of an angle, in rad and in degrees. */
bool kf_differs(const double *a, const double *b, int digits)
{
    char format[16];
    int k;
    snprintf(format, sizeof format, "%%.%dg", digits);
    for (k = 0; k < KF_DRIVERS; ++k) {
        char first[KF_MESSAGE] = "", second[KF_MESSAGE] = "";
        if (kf_driver_is_angle[k]) { /* in degrees there are fewer digits */
            append_decimals(first, digits - 2, a[k] * KF_DEGREE);
            append_decimals(second, digits - 2, b[k] * KF_DEGREE);
        } else {
            kf_append_number(first, format, a[k]);
            kf_append_number(second, format, b[k]);
        }
        if (strcmp(first, second) != 0) {
            return true;
        }
    }
    return false;
}

void kf_append_watch(char *message, const kf_model *model, const kf_found *found, const char *about, const char *format)
{
    double watches[KF_ROOM(KF_WATCHES)];
    int k, most = 0;
    kf_watches(model, found, watches);
    for (k = 1; k < KF_WATCHES; ++k) {
        most = fabs(watches[k]) > fabs(watches[most]) ? k : most;
    }
    kf_append(message, "redundant row %s does not close: %s", kf_watch_names[most], about);
    kf_append_number(message, format, fabs(watches[most]) * kf_size);
    kf_append(message, " %s", kf_length_unit);
}
