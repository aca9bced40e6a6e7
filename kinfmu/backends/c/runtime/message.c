/* Messages: put together piece by piece, cut where they would not fit; numbers as %g of the C locale writes them. */
#include "way.h"

#include <stdarg.h>
#include <stdio.h>

void kf_say(char *message, const char *format, ...)
{
    const size_t length = strlen(message);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message + length, KF_MESSAGE - length, format, arguments);
    va_end(arguments);
}

/* A number, with a point whatever the locale says. */
void kf_say_number(char *message, const char *format, double value)
{
    char *written = message + strlen(message);
    kf_say(message, format, value);
    for (; *written != '\0'; ++written) {
        if (*written == ',') {
            *written = '.';
        }
    }
}

/* "crank = 1.0472 rad (60 deg)": driver values. */
void kf_say_place(char *message, const double *u)
{
    int k;
    for (k = 0; k < KF_DRIVERS; ++k) {
        kf_say(message, "%s%s = ", k > 0 ? ", " : "", kf_driver_names[k]);
        kf_say_number(message, "%.12g", u[k]);
        kf_say(message, " %s", kf_driver_is_angle[k] ? "rad" : kf_length_unit);
        if (kf_driver_is_angle[k]) {
            kf_say(message, " (");
            kf_say_number(message, "%.10g", u[k] * 57.29577951308232);
            kf_say(message, " deg)");
        }
    }
}
