/* Follower: a solver that starts each path from the last good pose. */
#include "follower.h"

kf_pose *kf_followed(kf_follower *follower, const double *u)
{
    kf_pose *const start = follower->started ? &follower->poses[follower->here] : &follower->solver.anchor;
    const int next = follower->started ? 1 - follower->here : 0;
    kf_pose *const pose = &follower->poses[next];
    if (KF_GOOD(kf_solve(&follower->solver, start, u, pose))) {
        follower->here = next;
        follower->started = true;
    }
    return pose;
}

void kf_restart(kf_follower *follower)
{
    follower->started = false;
}
