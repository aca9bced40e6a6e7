/* Vectors: loops that compilers lay side by side in the vector registers of the processor. */
#ifndef KF_VECTORS_H
#define KF_VECTORS_H

#include "sincos.h"

#if defined(__clang__)
#define KF_SIDE_BY_SIDE _Pragma("clang loop vectorize(enable)")
#elif defined(__GNUC__)
#define KF_SIDE_BY_SIDE _Pragma("GCC ivdep")
#else
#define KF_SIDE_BY_SIDE
#endif

static inline double kf_sin_lane(double x)
{
    double sine, cosine;
    kf_sincos_lane(x, &sine, &cosine);
    return sine;
}

static inline double kf_cos_lane(double x)
{
    double sine, cosine;
    kf_sincos_lane(x, &sine, &cosine);
    return cosine;
}

#endif
