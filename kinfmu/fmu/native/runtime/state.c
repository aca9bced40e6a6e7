/* States: copies of the data of an instance.
 *
 * Serialized: the FMU's token, so that no other FMU accepts it; a checksum, since the behaviour of a solver with changed
 * bytes is undefined; and the copy.
 */
#include "instance.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static const char token[] = KF_TOKEN;

#define COPY_BEGINS (sizeof token + sizeof(uint64_t))

/* FNV-1a of 64 bits: each change of a single byte changes it. */
static uint64_t checksum(const unsigned char *bytes)
{
    uint64_t sum = 14695981039346656037u;
    size_t k;
    for (k = 0; k < KF_STATE_SIZE; ++k) {
        sum = (sum ^ bytes[k]) * 1099511628211u;
    }
    return sum;
}

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
    if (((const kf_state *)state)->model_exchange != instance->now.model_exchange) {
        return kf_answered(instance, KF_ERROR, "setFMUState: the state is of an instance for %s, this one is for %s",
                           instance->now.model_exchange ? "co-simulation" : "model exchange",
                           instance->now.model_exchange ? "model exchange" : "co-simulation");
    }
    memcpy(&instance->now, state, KF_STATE_SIZE);
    if (instance->now.mode == KF_EVENTS_OF_STEPS && !instance->has_event_mode) {
        instance->now.mode = KF_STEPPING;
    }
    return KF_DONE;
}

size_t kf_serialized_size(void)
{
    return COPY_BEGINS + KF_STATE_SIZE;
}

kf_answer kf_serialize(kf_instance *instance, const void *state, unsigned char *bytes, size_t size)
{
    uint64_t sum;
    if (state == NULL || bytes == NULL || size < kf_serialized_size()) {
        return kf_answered(instance, KF_ERROR, "serializeFMUState: a state and room for %zu bytes are needed",
                      kf_serialized_size());
    }
    memcpy(bytes, token, sizeof token);
    memcpy(bytes + COPY_BEGINS, state, KF_STATE_SIZE);
    sum = checksum(bytes + COPY_BEGINS);
    memcpy(bytes + sizeof token, &sum, sizeof sum);
    return KF_DONE;
}

kf_answer kf_deserialize(kf_instance *instance, const unsigned char *bytes, size_t size, void **state)
{
    uint64_t sum;
    if (bytes == NULL || state == NULL || size != kf_serialized_size() || memcmp(bytes, token, sizeof token) != 0) {
        return kf_answered(instance, KF_ERROR, "deserializeFMUState: these %zu bytes are not a state of this FMU (%s), which "
                      "has %zu", bytes ? size : 0, token, kf_serialized_size());
    }
    memcpy(&sum, bytes + sizeof token, sizeof sum);
    if (sum != checksum(bytes + COPY_BEGINS)) {
        return kf_answered(instance, KF_ERROR, "deserializeFMUState: the state is damaged, its checksum does not fit");
    }
    if (*state == NULL) {
        *state = malloc(KF_STATE_SIZE);
    }
    if (*state == NULL) {
        return kf_answered(instance, KF_ERROR, "deserializeFMUState: out of memory");
    }
    memcpy(*state, bytes + COPY_BEGINS, KF_STATE_SIZE);
    return KF_DONE;
}
