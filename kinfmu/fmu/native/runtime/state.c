/* States: a copy of what an instance knows. Serialized ones carry the FMU's token: they fit no other one. */
#include "instance.h"

#include <stdlib.h>
#include <string.h>

static const char token[] = KF_TOKEN;

kf_answer kf_copy_state(kf_instance *instance, void **state)
{
    if (state == NULL) {
        return kf_answered(instance, KF_ERROR, "getFMUState: no place to put the state is given");
    }
    if (*state == NULL) {
        *state = malloc(KF_STATE_SIZE);
    }
    if (*state == NULL) {
        return kf_answered(instance, KF_ERROR, "getFMUState: out of memory");
    }
    memcpy(*state, &instance->now, KF_STATE_SIZE);
    return KF_DONE;
}

kf_answer kf_restore_state(kf_instance *instance, const void *state)
{
    if (state == NULL) {
        return kf_answered(instance, KF_ERROR, "setFMUState: there is no state");
    }
    memcpy(&instance->now, state, KF_STATE_SIZE);
    return KF_DONE;
}

size_t kf_serialized_size(void)
{
    return sizeof token + KF_STATE_SIZE;
}

kf_answer kf_serialize(kf_instance *instance, const void *state, unsigned char *bytes, size_t size)
{
    if (state == NULL || bytes == NULL || size < kf_serialized_size()) {
        return kf_answered(instance, KF_ERROR, "serializeFMUState: a state and room for %zu bytes are needed",
                      kf_serialized_size());
    }
    memcpy(bytes, token, sizeof token);
    memcpy(bytes + sizeof token, state, KF_STATE_SIZE);
    return KF_DONE;
}

kf_answer kf_deserialize(kf_instance *instance, const unsigned char *bytes, size_t size, void **state)
{
    if (bytes == NULL || state == NULL || size != kf_serialized_size() || memcmp(bytes, token, sizeof token) != 0) {
        return kf_answered(instance, KF_ERROR, "deserializeFMUState: these bytes are not a state of this FMU (%s)", token);
    }
    if (*state == NULL) {
        *state = malloc(KF_STATE_SIZE);
    }
    if (*state == NULL) {
        return kf_answered(instance, KF_ERROR, "deserializeFMUState: out of memory");
    }
    memcpy(*state, bytes + sizeof token, KF_STATE_SIZE);
    return KF_DONE;
}
