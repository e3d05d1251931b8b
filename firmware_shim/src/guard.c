/* Guard and limits: what may reach the motors, and when nothing may. */
#include "internal.h"

#include <stddef.h>

void mtm_count(uint32_t *counter)
{
    if (*counter != UINT32_MAX) {
        ++*counter;
    }
}

mtm_q20 mtm_limited(mtm_q20 value, mtm_q20 limit, uint32_t *clamps)
{
    if (value > limit) {
        mtm_count(clamps);
        return limit;
    }
    if (value < -limit) {
        mtm_count(clamps);
        return -limit;
    }
    return value;
}

mtm_q20 mtm_faded(mtm_q20 value, uint32_t gain)
{
    return (mtm_q20)((int64_t)value * gain / (int32_t)MTM_GAIN_ONE);
}

uint8_t mtm_settings_good(const mtm_settings *settings)
{
    uint32_t axis;
    if (settings->rate_mhz < 1000 || settings->rate_mhz > 1000000) {
        return 0;
    }
    if (settings->hold_ms < 1 || settings->zero_ms <= settings->hold_ms || settings->zero_ms > 10000) {
        return 0;
    }
    for (axis = 0; axis < MTM_AXES; axis++) {
        if (settings->limit[axis] < 0 || settings->limit[axis] > MTM_Q20_MAX) {
            return 0;
        }
    }
    return 1;
}

void mtm_guard_age(mtm_shim *shim, uint32_t elapsed_us)
{
    const uint32_t hold_us = shim->settings.hold_ms * 1000;
    const uint32_t before_us = shim->age_us;
    shim->age_us = elapsed_us > UINT32_MAX - before_us ? UINT32_MAX : before_us + elapsed_us;
    if (before_us < hold_us && shim->age_us >= hold_us) {
        mtm_count(&shim->counts.deadman_trips);
    }
}

void mtm_guard_accept(mtm_shim *shim, const mtm_velocity *base)
{
    uint32_t axis;
    for (axis = 0; axis < MTM_AXES; axis++) {
        if (base->axis[axis] == MTM_Q20_INVALID) {
            mtm_count(&shim->counts.refused_commands);
            return;
        }
    }
    for (axis = 0; axis < MTM_AXES; axis++) {
        shim->base.axis[axis] = mtm_limited(base->axis[axis], shim->limit[axis], &shim->counts.base_clamps);
    }
    shim->age_us = 0;
}

uint8_t mtm_guard_fresh(const mtm_shim *shim)
{
    return !shim->stopped && shim->age_us < shim->settings.hold_ms * 1000;
}

uint32_t mtm_guard_gain(const mtm_shim *shim)
{
    const uint32_t hold_us = shim->settings.hold_ms * 1000;
    const uint32_t zero_us = shim->settings.zero_ms * 1000;
    if (shim->stopped || shim->age_us >= zero_us) {
        return 0;
    }
    if (shim->age_us < hold_us) {
        return MTM_GAIN_ONE;
    }
    /* The settings keep zero above hold, and both low enough for the product to fit. */
    return (zero_us - shim->age_us) * MTM_GAIN_ONE / (zero_us - hold_us);
}

void mtm_shim_stop(mtm_shim *shim)
{
    shim->stopped = 1;
}

void mtm_shim_release(mtm_shim *shim)
{
    if (shim->stopped) {
        shim->stopped = 0;
        shim->age_us = UINT32_MAX; /* what was commanded before the stop moves nothing after it */
    }
}
