/* Follower: a solver that starts each path from the last good pose. */
#ifndef KF_FOLLOWER_H
#define KF_FOLLOWER_H

#include "solver.h"

/* poses: the last good one, if any was found since the start, and one to be tried. */
typedef struct {
    kf_solver solver;
    kf_pose poses[2];
    int here;
    bool started;
} kf_follower;

/* Solve at driver values from the last good pose, or from the anchor; a good pose found becomes the
 * last good one.
 */
kf_pose *kf_followed(kf_follower *follower, const double *u);

/* Start again from the anchor. */
void kf_restart(kf_follower *follower);

#endif
