/* What the source files share beside the public header. */
#ifndef MTM_INTERNAL_H
#define MTM_INTERNAL_H

#include "mtm_shim.h"

#define MTM_GAIN_ONE 256u

/* Zero bytes; a pointer of zero bytes is taken to be NULL. */
void mtm_clear(void *object, uint32_t size);
uint16_t mtm_u16(const uint8_t *bytes);
uint32_t mtm_u32(const uint8_t *bytes);

/* seal.c: as mtm_image_check, for a sealed image. */
mtm_result mtm_seal_check(mtm_image *image, const uint8_t *bytes, uint32_t size, const mtm_shim *shim);

/* guard.c */
void mtm_count(uint32_t *counter);
mtm_q20 mtm_limited(mtm_q20 value, mtm_q20 limit, uint32_t *clamps);
mtm_q20 mtm_faded(mtm_q20 value, uint32_t gain);
uint8_t mtm_settings_good(const mtm_settings *settings);
void mtm_guard_age(mtm_shim *shim, uint32_t elapsed_us);
void mtm_guard_accept(mtm_shim *shim, const mtm_velocity *base);
uint8_t mtm_guard_fresh(const mtm_shim *shim);
uint32_t mtm_guard_gain(const mtm_shim *shim);

/* play.c */
void mtm_advance(mtm_shim *shim, uint32_t now_us);
mtm_q20 mtm_noise(const mtm_shim *shim, uint32_t axis);
mtm_q20 mtm_with_noise(mtm_shim *shim, uint32_t axis, mtm_q20 base);
void mtm_output(mtm_shim *shim, mtm_velocity *out);

/* wire.c: one value of a speed command, between the wire's frame and units and ours. */
mtm_q20 mtm_of_wire(uint32_t axis, uint32_t bits);
uint32_t mtm_to_wire(uint32_t axis, mtm_q20 value);
uint32_t mtm_f32_with_low_byte(uint32_t bits, uint8_t low);

/* rewrite.c */
#define MTM_PAYLOAD 11u
#define MTM_SPEED_BYTES 25u
#define MTM_SET_CHASSIS 0x3Fu
#define MTM_ID_SPEED 0x21u
/* A byte of the companion's stream has arrived and stands in `slot`, in the queue's last frame; it may still change. */
void mtm_byte_arrived(mtm_gateway *gateway, uint8_t *slot);
/* A command of the gateway's own is wanted now, not at the next tick. */
void mtm_make_due(mtm_gateway *gateway);

#endif
