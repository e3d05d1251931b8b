/* One speed command on its way through the gateway, changed byte by byte; and what other messages mean to it. */
#include "internal.h"

#include <stddef.h>

#define ID_WORK_MODE 0x19u
#define ID_WHEEL 0x20u
#define ID_FOLLOW 0x22u
#define ID_MOVE 0x25u

/* ---- What kind of message this is: 11 bytes say it. ---- */

static uint8_t is_chassis(const uint8_t *message)
{
    return (message[8] & 0x87u) == 0 && message[9] == MTM_SET_CHASSIS; /* no acknowledgement, not encrypted */
}

static uint32_t length_of(const uint8_t *message)
{
    return mtm_u16(message + 1) & 1023u;
}

static uint8_t is_speed(const uint8_t *message)
{
    return is_chassis(message) && message[10] == MTM_ID_SPEED && length_of(message) == MTM_SPEED_BYTES;
}

static uint8_t is_work_mode_off(const uint8_t *message)
{
    return is_chassis(message) && message[10] == ID_WORK_MODE && length_of(message) == MTM_PAYLOAD + 3 &&
           message[11] == 0;
}

static uint8_t is_other_motion(const uint8_t *message)
{
    const uint8_t id = message[10];
    return is_chassis(message) && (id == ID_WHEEL || id == ID_FOLLOW || id == ID_MOVE);
}

/* ---- One speed command on its way through ---- */

/* What leaves in the place of one arriving value. */
static uint32_t rewritten_bits(mtm_gateway *gateway, uint32_t axis, uint32_t bits)
{
    mtm_shim *shim = gateway->shim;
    const mtm_q20 base = mtm_of_wire(axis, bits);
    uint32_t clamps = 0; /* counted when the whole command proves good */
    mtm_q20 out;
    gateway->arriving.axis[axis] = base;
    if (shim->stopped) {
        out = 0;
    } else if (base == MTM_Q20_INVALID) {
        out = mtm_faded(shim->base.axis[axis], mtm_guard_gain(shim));
    } else {
        out = mtm_with_noise(shim, axis, mtm_limited(base, shim->limit[axis], &clamps));
    }
    return out == base ? bits : mtm_to_wire(axis, out);
}

/* The value whose last byte has arrived: decide it, and put its bytes where they stand. */
static void finish_value(mtm_gateway *gateway, uint32_t axis)
{
    const uint32_t start = MTM_PAYLOAD + 4 * axis;
    const uint8_t *arrived = gateway->parser.bytes + start;
    const uint32_t before = mtm_u32(arrived);
    uint32_t after = rewritten_bits(gateway, axis, before);
    uint32_t i;
    if (gateway->slot[0] == NULL) {
        after = mtm_f32_with_low_byte(after, arrived[0]);
    }
    /* Where more than the first byte is gone (a full queue), what left and `sent` differ: the CRC16 will be wrong,
     * and the robot ignores a command that could not be changed. */
    for (i = 0; i < 4; i++) {
        gateway->sent[start + i] = (uint8_t)(after >> (8 * i));
        if (gateway->slot[i] != NULL) {
            *gateway->slot[i] = gateway->sent[start + i];
        }
    }
    if (after != before) {
        gateway->changed = 1;
    }
}

static void begin_command(mtm_gateway *gateway)
{
    uint32_t i;
    for (i = 0; i < MTM_PAYLOAD; i++) {
        gateway->sent[i] = gateway->parser.bytes[i];
    }
    gateway->rewriting = 1;
    gateway->changed = 0;
}

/* Byte `at` (11 to 24) of a speed command has arrived and stands in `slot`. */
static void rewrite(mtm_gateway *gateway, uint32_t at, uint8_t *slot)
{
    if (at < MTM_SPEED_BYTES - 2) {
        const uint32_t part = (at - MTM_PAYLOAD) & 3u;
        if (part == 0 || gateway->slot[part - 1] == NULL) {
            gateway->held_from = (uint8_t)(gateway->queued - 1);
        }
        gateway->slot[part] = slot;
        if (part == 3) {
            finish_value(gateway, (at - MTM_PAYLOAD) >> 2);
        }
    } else {
        /* What was wrong with the checksum stays wrong: only the difference that we made is made up for. */
        const uint16_t due = mtm_crc16(gateway->parser.bytes, MTM_SPEED_BYTES - 2);
        const uint16_t now = mtm_crc16(gateway->sent, MTM_SPEED_BYTES - 2);
        const uint32_t shift = at == MTM_SPEED_BYTES - 2 ? 0 : 8;
        *slot = (uint8_t)(*slot ^ ((due ^ now) >> shift));
    }
}

/* Byte `at` of another motion command has arrived while stopped: its checksum becomes the opposite of the right one. */
static void spoil(mtm_gateway *gateway, uint32_t at, uint8_t *slot)
{
    const uint32_t length = length_of(gateway->parser.bytes);
    if (at + 2 >= length) {
        *slot = (uint8_t)~(mtm_crc16(gateway->parser.bytes, length - 2) >> (at + 2 == length ? 0 : 8));
    }
    if (at + 1 == length) {
        mtm_count(&gateway->counts.spoilt);
    }
}

/* ---- Whole messages ---- */

void mtm_make_due(mtm_gateway *gateway)
{
    gateway->due = 1;
    gateway->due_us = gateway->shim->last_us;
}

static void command_passed(mtm_gateway *gateway)
{
    const uint8_t *message = gateway->parser.bytes;
    uint32_t axis;
    if (gateway->rewriting) {
        mtm_count(gateway->changed ? &gateway->counts.rewritten : &gateway->counts.passed);
    } else {
        mtm_count(&gateway->counts.late);
        mtm_make_due(gateway); /* should it have been changed to zero, ours follows it */
        for (axis = 0; axis < MTM_AXES; axis++) {
            gateway->arriving.axis[axis] = mtm_of_wire(axis, mtm_u32(message + MTM_PAYLOAD + 4 * axis));
        }
    }
    gateway->head.sender = message[4];
    gateway->head.receiver = message[5];
    gateway->head.sequence = mtm_u16(message + 6);
    gateway->head.attributes = message[8];
    gateway->armed = 1;
    mtm_guard_accept(gateway->shim, &gateway->arriving);
}

static void message_passed(mtm_gateway *gateway)
{
    const uint8_t *message = gateway->parser.bytes;
    if (is_speed(message)) {
        command_passed(gateway);
    } else if (is_other_motion(message) || is_work_mode_off(message)) {
        gateway->armed = 0;
    }
}

void mtm_byte_arrived(mtm_gateway *gateway, uint8_t *slot)
{
    mtm_duml_parser *parser = &gateway->parser;
    const uint32_t at = parser->count;
    const uint8_t byte = *slot;
    uint8_t command = 0;
    mtm_duml_push(parser, byte);
    if (at >= MTM_PAYLOAD && is_speed(parser->bytes)) {
        if (at == MTM_PAYLOAD) {
            begin_command(gateway);
        }
        command = gateway->rewriting;
    }
    if (command) {
        rewrite(gateway, at, slot);
    } else if (at >= MTM_PAYLOAD && gateway->shim->stopped && is_other_motion(parser->bytes)) {
        spoil(gateway, at, slot);
    }
    while (mtm_duml_take(parser) != 0) {
        message_passed(gateway);
    }
    if (at == MTM_SPEED_BYTES - 1) {
        gateway->rewriting = 0;
    }
}
