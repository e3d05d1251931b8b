/* Playing: from the timer to the tick, from the tick to the sample, from the sample to the command. */
#include "internal.h"

#include <stddef.h>

#define TICK 1000000000u /* one tick, in microseconds times thousandths of a hertz */
#define HALF_A_TICK (TICK / 2)
#define CLOCK_BITS 31 /* a longer step of the timer counts as backwards */

mtm_result mtm_shim_init(mtm_shim *shim, const mtm_settings *settings)
{
    uint32_t axis;
    if (!mtm_settings_good(settings)) {
        return MTM_BAD_SETTINGS;
    }
    mtm_clear(shim, sizeof *shim);
    shim->settings = *settings;
    shim->age_us = UINT32_MAX;
    shim->phase = HALF_A_TICK;
    for (axis = 0; axis < MTM_AXES; axis++) {
        shim->limit[axis] = settings->limit[axis];
    }
    return MTM_OK;
}

mtm_result mtm_shim_offer(mtm_shim *shim, const uint8_t *bytes, uint32_t size)
{
    mtm_result result = MTM_IMAGE_BUSY;
    if (shim->pending.bytes == NULL) {
        if (bytes != NULL && size >= 4 && mtm_u32(bytes) == 0x534D544Du) {
            result = mtm_seal_check(&shim->pending, bytes, size, shim);
            if (result == MTM_OK) {
                shim->counter = mtm_u32(bytes + 16);
            }
        } else if (shim->trusts) {
            result = MTM_IMAGE_UNSEALED;
        } else {
            result =
                mtm_image_check(&shim->pending, bytes, size, shim->settings.image_bytes_max, shim->settings.rate_mhz);
        }
    }
    if (result != MTM_OK) {
        mtm_count(&shim->counts.refused_images);
    }
    return result;
}

void mtm_shim_silence(mtm_shim *shim)
{
    shim->active.bytes = NULL;
    shim->pending.bytes = NULL;
}

/* The pending image takes its turn, `position` ticks after its beginning. */
static void begin_pending(mtm_shim *shim, uint32_t position)
{
    uint32_t axis;
    shim->active = shim->pending;
    shim->pending.bytes = NULL;
    shim->position = position;
    for (axis = 0; axis < MTM_AXES; axis++) {
        const mtm_q20 own = shim->settings.limit[axis];
        const mtm_q20 asked = shim->active.limit[axis];
        shim->limit[axis] = asked < own ? asked : own;
        shim->base.axis[axis] = mtm_limited(shim->base.axis[axis], shim->limit[axis], &shim->counts.base_clamps);
    }
}

/* Whole ticks in `elapsed` (at most 2^51), long division by shifts: 64-bit division needs a library here. */
static uint32_t whole_ticks(uint64_t elapsed, uint32_t *phase)
{
    uint32_t ticks = 0;
    uint32_t bit = 22;
    while (bit-- > 0) {
        const uint64_t part = (uint64_t)TICK << bit;
        if (elapsed >= part) {
            elapsed -= part;
            ticks |= 1u << bit;
        }
    }
    *phase = (uint32_t)elapsed;
    return ticks;
}

static void move_on(mtm_shim *shim, uint32_t ticks)
{
    const uint32_t room = UINT32_MAX - shim->position;
    shim->position += ticks < room ? ticks : room;
    if (shim->position >= shim->active.ticks && shim->active.bytes != NULL) {
        if (shim->pending.bytes != NULL) {
            begin_pending(shim, shim->position - shim->active.ticks);
        }
        if (shim->active.repeats) {
            shim->position %= shim->active.ticks;
        } else if (shim->position >= shim->active.ticks) {
            mtm_count(&shim->counts.ended_images);
            shim->active.bytes = NULL;
        }
    }
}

void mtm_advance(mtm_shim *shim, uint32_t now_us)
{
    uint32_t elapsed_us = shim->started ? now_us - shim->last_us : 0;
    uint32_t ticks;
    if (elapsed_us >> CLOCK_BITS) {
        mtm_count(&shim->counts.clock_faults);
        elapsed_us = 0;
    }
    shim->started = 1;
    shim->last_us = now_us;
    mtm_guard_age(shim, elapsed_us);
    ticks = whole_ticks((uint64_t)elapsed_us * shim->settings.rate_mhz + shim->phase, &shim->phase);
    shim->tick += ticks;
    if (ticks > 1) {
        const uint32_t missed = ticks - 1;
        const uint32_t room = UINT32_MAX - shim->counts.missed_ticks;
        shim->counts.missed_ticks += missed < room ? missed : room;
    }
    move_on(shim, ticks);
    if (shim->active.bytes == NULL && shim->pending.bytes != NULL) {
        begin_pending(shim, 0);
        shim->phase = HALF_A_TICK;
    }
}

mtm_q20 mtm_noise(const mtm_shim *shim, uint32_t axis)
{
    const mtm_image *image = &shim->active;
    uint32_t sample;
    uint32_t size;
    if (image->bytes == NULL || image->offset[axis] == 0) {
        return 0;
    }
    sample = mtm_u16(image->bytes + image->offset[axis] + 2 * shim->position);
    size = sample & 0x8000u ? 0x10000u - sample : sample;
    size = (uint32_t)(((uint64_t)size * image->step[axis] + 0x8000u) >> 16); /* 2^29 at most */
    if (size > (uint32_t)image->noise_limit[axis]) {
        size = (uint32_t)image->noise_limit[axis];
    }
    return sample & 0x8000u ? -(mtm_q20)size : (mtm_q20)size;
}

mtm_q20 mtm_with_noise(mtm_shim *shim, uint32_t axis, mtm_q20 base)
{
    const mtm_q20 sum = base + mtm_noise(shim, axis); /* 2^30 + 2^29 at most */
    return mtm_limited(sum, shim->limit[axis], &shim->counts.output_clamps);
}

void mtm_output(mtm_shim *shim, mtm_velocity *out)
{
    const uint32_t gain = mtm_guard_gain(shim);
    uint32_t axis;
    for (axis = 0; axis < MTM_AXES; axis++) {
        const mtm_q20 base = shim->base.axis[axis];
        out->axis[axis] = mtm_guard_fresh(shim) ? mtm_with_noise(shim, axis, base) : mtm_faded(base, gain);
    }
}

void mtm_shim_tick(mtm_shim *shim, uint32_t now_us, const mtm_velocity *base, mtm_velocity *out)
{
    mtm_advance(shim, now_us);
    if (base != NULL) {
        mtm_guard_accept(shim, base);
    }
    mtm_output(shim, out);
}
