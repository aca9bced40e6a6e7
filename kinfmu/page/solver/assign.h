/* Assignment of poses as far as a model uses their arrays, most of which are much longer than its sizes. */
#ifndef KF_ASSIGN_H
#define KF_ASSIGN_H

#include "solver.h"

#include <string.h>

#define ASSIGN(to, from, count) memcpy(to, from, (size_t)(count) * sizeof *(from))

static inline void assign_found(kf_found *to, const kf_found *from)
{
    ASSIGN(to->x, from->x, KF_COORDINATES);
    ASSIGN(to->hold, from->hold, KF_HOLD);
    ASSIGN(to->determinants, from->determinants, KF_BLOCKS);
    memcpy(&to->margin, &from->margin, sizeof *to - offsetof(kf_found, margin));
}

static inline void assign_track(kf_track_pose *to, const kf_track_pose *from)
{
    memcpy(to, from, offsetof(kf_track_pose, base_z));
    ASSIGN(to->base_z, from->base_z, KF_UNKNOWNS);
}

static void assign_pose(kf_pose *to, const kf_pose *from)
{
    int k;
    assign_found(&to->found, &from->found);
    ASSIGN(to->x1, from->x1, KF_COORDINATES);
    ASSIGN(to->x2, from->x2, KF_COORDINATES);
    memcpy(&to->low, &from->low, offsetof(kf_pose, base_z) - offsetof(kf_pose, low));
    ASSIGN(to->base_z, from->base_z, KF_UNKNOWNS);
    memcpy(&to->status, &from->status, offsetof(kf_pose, own) - offsetof(kf_pose, status));
    for (k = 0; KF_TRACKS && k < KF_DRIVERS; ++k) {
        assign_track(&to->own[k], &from->own[k]);
    }
    ASSIGN(to->held, from->held, KF_BLOCKS);
    ASSIGN(to->own1, from->own1, KF_UNKNOWNS);
    ASSIGN(to->own2, from->own2, KF_UNKNOWNS);
}

#undef ASSIGN

#endif
