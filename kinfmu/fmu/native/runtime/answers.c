/* Messages to the host, which state why an answer is not OK. They are formatted here, since some hosts show only the format
 * of a message.
 */
#include "instance.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

const char *const kf_categories[3] = {"logStatusWarning", "logStatusDiscard", "logStatusError"};

kf_answer kf_answered(const kf_instance *instance, kf_answer answer, const char *format, ...)
{
    char text[KF_LONGEST];
    const int category = answer == KF_WARN ? 0 : answer == KF_DISCARD ? 1 : 2;
    va_list arguments;
    if (instance->send != NULL && !instance->silent && !(instance->muted >> category & 1u)) {
        va_start(arguments, format);
        vsnprintf(text, sizeof text, format, arguments);
        va_end(arguments);
        instance->send(instance->host, answer, kf_categories[category], text);
    }
    return answer;
}

/* Answer a call in which an array is NULL: Error if it should have elements. */
kf_answer kf_no_array(const kf_instance *instance, size_t count)
{
    return count ? kf_answered(instance, KF_ERROR, "a call with %zu elements has NULL for an array", count) : KF_DONE;
}

/* Switch logging of the categories named on or off; of all if none is named. */
kf_answer kf_set_logging(kf_instance *instance, bool on, size_t count, const char *const *categories)
{
    kf_answer answer = KF_DONE;
    unsigned named = 0;
    size_t k;
    if (count && categories == NULL) {
        return kf_no_array(instance, count);
    }
    for (k = 0; k < count; ++k) {
        int category = 0;
        while (category < 3 && (categories[k] == NULL || strcmp(categories[k], kf_categories[category]) != 0)) {
            ++category;
        }
        if (category < 3) {
            named |= 1u << category;
        } else {
            answer = kf_answered(instance, KF_WARN, "unknown log category '%s'; categories: %s, %s, %s",
                            categories[k] ? categories[k] : "(NULL)", kf_categories[0], kf_categories[1],
                            kf_categories[2]);
        }
    }
    if (!count) {
        instance->silent = !on;
        instance->muted = 0;
    } else if (on) {
        instance->silent = false;
        instance->muted = ~named;
    } else {
        instance->muted |= named;
    }
    return answer;
}
