/* Messages: appended piece by piece and cut at the end of the buffer; numbers as %g of the C locale writes them. */
#include "internal.h"

#include <stdarg.h>
#include <stdio.h>

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
