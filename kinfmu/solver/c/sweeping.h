/* Declarations shared by the files of a sweep, and by no others. */
#ifndef KF_SWEEPING_H
#define KF_SWEEPING_H

#include "segments.h"
#include "stream.h"
#include "sweep.h"

/* A sample left for later; u: its driver value less `turns` turns. */
typedef struct {
    double u, turns;
    int64_t sample;
} kf_left;

typedef struct {
    kf_left *samples;
    int64_t count, capacity;
} kf_list;

struct kf_sweep {
    kf_follower follower;
    kf_pose raised_pose;
    kf_segments segments;
    kf_lanes *lanes;
    kf_list alone;
    kf_column columns[2 + 3 * KF_ROOM(KF_OUTPUTS)];
};

/* sweep.c */
void kf_put_gap(kf_job *job, int64_t sample, kf_status status);
bool kf_leave(kf_sweep *sweep, const kf_job *job, int64_t sample);

/* side_by_side.c */
bool kf_lanes_made(kf_sweep *sweep);
bool kf_side_by_side(kf_sweep *sweep, kf_job *job, int64_t start);

/* Return whether samples may be solved twice. */
bool kf_takes_again(const kf_job *job);
void kf_in_windows(kf_sweep *sweep, kf_job *job);

#endif
