/* Pose: an assembled pose of a mechanism at given driver values. See kinfmu/solver/python/pose.py. */
#include "internal.h"

const double kf_alone[KF_ROOM(KF_DRIVERS)] = {1.0};
const double kf_at_rest[KF_REST] = {0.0};

/* Reset all that a pose holds besides what was found, with this singularity map. */
inline void kf_fresh(kf_pose *pose, int map, double low, double high)
{
    pose->low = low;
    pose->high = high;
    pose->status = KF_OK;
    pose->derivatives = 0;
    pose->map = map;
    pose->bridge = -1;
    pose->has_base = false;
#if KF_HAS(KF_TRACKS)
    pose->has_tracks = pose->is_held = false;
#endif
}

/* Call kf_position at given unknowns; held blocks are not solved for. With s = -0.0 and zero rates z stays as it is, to the
 * bit.
 */
bool kf_evaluated(const kf_model *model, const double *u, const double *z, const bool *held, kf_found *found)
{
    return kf_position(model, u, z, kf_at_rest, kf_at_rest, -0.0, held, found) < 0;
}

/* The same with all blocks held. */
bool kf_evaluated_as_given(const kf_model *model, const double *u, const double *z, kf_found *found)
{
    bool all[KF_ROOM(KF_BLOCKS)];
    memset(all, 1, sizeof all);
    return kf_evaluated(model, u, z, all, found);
}

/* Form first and second derivative of all coordinates with respect to the only driver. */
inline void kf_tangent(const kf_model *model, kf_pose *pose)
{
    if (pose->derivatives < 1) {
        KF_VELOCITY(model, &pose->found, KF_SPEEDS(model), NULL, NULL, pose->x1);
    }
    if (pose->derivatives < 2) {
        KF_ACCELERATION(model, &pose->found, kf_at_rest, pose->x1, NULL, NULL, pose->x2);
        pose->derivatives = 2;
    }
}

#if KF_HAS(KF_TRACKS)

/* Restrict the model to a track, the blocks that depend on one driver alone. All others stay as in the anchor. */
void kf_enter_track(kf_solver *solver, int driver)
{
    kf_model *const model = &solver->model;
    int k;
    model->track = driver + 1;
    for (k = 0; k < KF_BLOCKS; ++k) {
        model->outside[k] = kf_block_drivers[k] != driver;
    }
    memcpy(model->kept, solver->anchor.found.x, sizeof model->kept);
    for (k = 0; k < KF_DRIVERS; ++k) {
        model->along[k] = k == driver ? 1.0 : 0.0;
        model->rest[k] = kf_anchor_u[k];
    }
}

#if KF_HAS(KF_MIXES)

/* Restrict the model to the blocks that depend on several drivers, while all others are at unknowns z and move: slopes are
 * their derivatives along the path of the drivers, second derivatives are 0.
 */
void kf_enter_mixed(kf_solver *solver, const double *z, const double *slopes)
{
    kf_model *const model = &solver->model;
    int k;
    model->track = KF_MIXED;
    for (k = 0; k < KF_BLOCKS; ++k) {
        model->outside[k] = kf_block_drivers[k] != KF_MIXED;
    }
    memcpy(model->kept, z, KF_UNKNOWNS * sizeof *z);
    memcpy(model->slopes, slopes, KF_UNKNOWNS * sizeof *slopes);
}

#endif

/* Return to the whole model. */
void kf_leave_track(kf_solver *solver)
{
    solver->model.track = 0;
}

/* Return driver values of which one is given and the others rest. */
const double *kf_driven_at(const kf_model *model, const double *value, double *buffer)
{
    memcpy(buffer, model->rest, KF_DRIVERS * sizeof(double));
    buffer[KF_ALONG_OF(model)] = *value;
    return buffer;
}

/* Blocks whose unknowns are given: those that are held, and those outside a track. */
static const bool *given_blocks(const kf_model *model, const bool *held, bool *buffer)
{
    int k;
    for (k = 0; k < KF_BLOCKS; ++k) {
        buffer[k] = model->outside[k] || (held != NULL && held[k]);
    }
    return buffer;
}

/* Derivatives of the unknowns outside a track: they are 0, except for blocks that depend on several drivers. */
static const double *slopes_of(const kf_model *model)
{
#if KF_HAS(KF_MIXES)
    if (model->track == KF_MIXED) {
        return model->slopes;
    }
#endif
    (void)model;
    return kf_at_rest;
}

/* Return the derivatives given of the unknowns. */
static const double *given_rates(const kf_model *model, const double *outside, const double *given, double *buffer)
{
    int block, k = 0;
    for (block = 0; block < KF_BLOCKS; ++block) {
        for (; k < kf_block_ends[block]; ++k) {
            buffer[k] = model->outside[block] ? outside[k] : given == NULL ? 0.0 : given[k];
        }
    }
    return buffer;
}

void kf_rates(const kf_model *model, const kf_found *found, const double *ud, const double *given, const bool *held,
              double *x1)
{
    bool blocks[KF_ROOM(KF_BLOCKS)];
    double rates[KF_ROOM(KF_UNKNOWNS)];
    if (model->track != 0) {
        held = given_blocks(model, held, blocks);
        given = given_rates(model, slopes_of(model), given, rates);
    }
    kf_velocity(model, found, ud, given, held, x1);
}

void kf_second_rates(const kf_model *model, const kf_found *found, const double *udd, const double *x1,
                     const double *given, const bool *held, double *x2)
{
    bool blocks[KF_ROOM(KF_BLOCKS)];
    double rates[KF_ROOM(KF_UNKNOWNS)];
    if (model->track != 0) {
        held = given_blocks(model, held, blocks);
        given = given_rates(model, kf_at_rest, given, rates);
    }
    kf_acceleration(model, found, udd, x1, given, held, x2);
}

#endif
