/* What models call and no other file has as a function, under the names by which they call it. */
#include <stddef.h>
#include <stdio.h>

#include "sincos.h"

#define CALLED(name) __attribute__((export_name(#name)))

CALLED(kf_sin) double called_sin(double x)
{
    return kf_sin(x);
}

CALLED(kf_cos) double called_cos(double x)
{
    return kf_cos(x);
}

CALLED(kf_sincos) void called_sincos(double x, double *sine, double *cosine)
{
    kf_sincos(x, sine, cosine);
}

CALLED(kf_atan2) double called_atan2(double y, double x)
{
    return kf_atan2(y, x);
}

/* A message with one number. */
CALLED(snprintf) int called_snprintf(char *text, size_t size, const char *format, double number)
{
    return snprintf(text, size, format, number);
}
