/* What the interface reads and calls of a mechanism, besides its model. */
#ifndef KF_INSTANCE_H
#define KF_INSTANCE_H

#include "kinfmu.h"

extern const int size_points, size_forces, size_reactions, size_of_joints, size_loads;

#define KF_POINTS size_points
#define KF_FORCES size_forces
#define KF_REACTIONS size_reactions
#define KF_OF_JOINTS size_of_joints
#define KF_LOADS size_loads

#define KF_MOST_KF_POINTS 4096
#define KF_MOST_KF_FORCES 256
#define KF_MOST_KF_REACTIONS 2048
#define KF_MOST_KF_OF_JOINTS 2048
#define KF_MOST_KF_LOADS 256

extern const double kf_start; /* [s] of the laws */
extern const char *const kf_constant_names[KF_ROOM(KF_CONSTANTS)];
extern const bool kf_constant_is_positive[KF_ROOM(KF_CONSTANTS)];
#define KF_START kf_start

void kf_points(const kf_model *model, double *points); /* x, y of all points in their bodies */
void kf_forces(double time, const double *u, const double *ud, const double *udd, const double *z, const double *zd,
               const double *zdd, const double *slopes, const double *efforts, const double *parameters, double *forces);
void kf_reactions(double time, const double *u, const double *ud, const double *udd, const double *z, const double *zd,
                  const double *zdd, const double *slopes, const double *efforts, const double *parameters, double *forces);
void kf_shaking(double time, const double *u, const double *ud, const double *udd, const double *z, const double *zd,
                const double *zdd, const double *slopes, const double *efforts, const double *parameters, double *forces);

#endif
