/* Pose: an assembled pose of a mechanism at given driver values. See kinfmu/solver/pose.py. */
#include "way.h"

const double kf_alone[KF_DRIVERS] = {1.0};
const double kf_at_rest[KF_DRIVERS > KF_UNKNOWNS ? KF_DRIVERS : KF_ROOM(KF_UNKNOWNS)] = {0.0};

/* A pose just found: nothing is known of it but its road. */
inline void kf_fresh(kf_pose *pose, int road, double low, double high)
{
    pose->low = low;
    pose->high = high;
    pose->status = KF_OK;
    pose->derivatives = 0;
    pose->road = road;
    pose->bridge = -1;
    pose->has_base = false;
}

/* What kf_position gives for unknowns that are known: held blocks are not solved for. s = -0.0 at rest leaves z as it
 * is, to the bit.
 */
bool kf_evaluated(const kf_model *model, const double *u, const double *z, const bool *held, kf_found *found)
{
    return kf_position(model, u, z, kf_at_rest, kf_at_rest, -0.0, held, found) < 0;
}

/* The same where nothing is solved for. */
bool kf_evaluated_as_given(const kf_model *model, const double *u, const double *z, kf_found *found)
{
    bool all[KF_ROOM(KF_BLOCKS)];
    memset(all, 1, sizeof all);
    return kf_evaluated(model, u, z, all, found);
}

/* First and second derivative of all coordinates with respect to the only driver. */
inline void kf_tangent(const kf_model *model, kf_pose *pose)
{
    if (pose->derivatives < 1) {
        kf_velocity(model, &pose->found, kf_alone, NULL, NULL, pose->x1);
    }
    if (pose->derivatives < 2) {
        kf_acceleration(model, &pose->found, kf_at_rest, pose->x1, NULL, NULL, pose->x2);
        pose->derivatives = 2;
    }
}
