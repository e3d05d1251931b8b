/* The gateway: speed commands change as they pass, byte by byte; everything else is left alone. */
#include "internal.h"

#include <stddef.h>

#define COMPANION_STREAM 0x201u
#define FRAMES_PER_POLL 8
#define PATIENCE_US 20000u /* how long our own stop waits for the end of a message before it cuts in */
#define PAYLOAD 11u
#define SPEED_BYTES 25u
#define SET_CHASSIS 0x3Fu
#define ID_WORK_MODE 0x19u
#define ID_WHEEL 0x20u
#define ID_SPEED 0x21u
#define ID_FOLLOW 0x22u
#define ID_MOVE 0x25u

void mtm_gateway_init(mtm_gateway *gateway, mtm_shim *shim, const mtm_board *board, uint8_t fill)
{
    static const mtm_duml_head companion = {0xC9, 0xC3, 0, 0, SET_CHASSIS, ID_SPEED};
    mtm_clear(gateway, sizeof *gateway);
    gateway->shim = shim;
    gateway->board = board;
    gateway->head = companion;
    gateway->fill = fill;
}

/* ---- What kind of message this is: 11 bytes say it. ---- */

static uint8_t is_chassis(const uint8_t *message)
{
    return (message[8] & 0x87u) == 0 && message[9] == SET_CHASSIS; /* no acknowledgement, not encrypted */
}

static uint32_t length_of(const uint8_t *message)
{
    return mtm_u16(message + 1) & 1023u;
}

static uint8_t is_speed(const uint8_t *message)
{
    return is_chassis(message) && message[10] == ID_SPEED && length_of(message) == SPEED_BYTES;
}

static uint8_t is_work_mode_off(const uint8_t *message)
{
    return is_chassis(message) && message[10] == ID_WORK_MODE && length_of(message) == PAYLOAD + 3 && message[11] == 0;
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
    const uint32_t start = PAYLOAD + 4 * axis;
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
    for (i = 0; i < PAYLOAD; i++) {
        gateway->sent[i] = gateway->parser.bytes[i];
    }
    gateway->rewriting = 1;
    gateway->changed = 0;
}

/* Byte `at` (11 to 24) of a speed command has arrived and stands in `slot`. */
static void rewrite(mtm_gateway *gateway, uint32_t at, uint8_t *slot)
{
    if (at < SPEED_BYTES - 2) {
        const uint32_t part = (at - PAYLOAD) & 3u;
        if (part == 0 || gateway->slot[part - 1] == NULL) {
            gateway->held_from = (uint8_t)(gateway->queued - 1);
        }
        gateway->slot[part] = slot;
        if (part == 3) {
            finish_value(gateway, (at - PAYLOAD) >> 2);
        }
    } else {
        /* What was wrong with the checksum stays wrong: only the difference that we made is made up for. */
        const uint16_t due = mtm_crc16(gateway->parser.bytes, SPEED_BYTES - 2);
        const uint16_t now = mtm_crc16(gateway->sent, SPEED_BYTES - 2);
        const uint32_t shift = at == SPEED_BYTES - 2 ? 0 : 8;
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

/* A command of our own is wanted now, not at the next tick. */
static void make_due(mtm_gateway *gateway)
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
        make_due(gateway); /* should it have been changed to zero, ours follows it */
        for (axis = 0; axis < MTM_AXES; axis++) {
            gateway->arriving.axis[axis] = mtm_of_wire(axis, mtm_u32(message + PAYLOAD + 4 * axis));
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

/* A byte of the companion's stream has arrived and stands in `slot`, which may still change. */
static void byte_arrived(mtm_gateway *gateway, uint8_t *slot)
{
    mtm_duml_parser *parser = &gateway->parser;
    const uint32_t at = parser->count;
    const uint8_t byte = *slot;
    uint8_t command = 0;
    mtm_duml_push(parser, byte);
    if (at >= PAYLOAD && is_speed(parser->bytes)) {
        if (at == PAYLOAD) {
            begin_command(gateway);
        }
        command = gateway->rewriting;
    }
    if (command) {
        rewrite(gateway, at, slot);
    } else if (at >= PAYLOAD && gateway->shim->stopped && is_other_motion(parser->bytes)) {
        spoil(gateway, at, slot);
    }
    while (mtm_duml_take(parser) != 0) {
        message_passed(gateway);
    }
    if (at == SPEED_BYTES - 1) {
        gateway->rewriting = 0;
    }
}

/* ---- Frames ---- */

static void release(mtm_gateway *gateway)
{
    uint32_t i;
    for (i = 0; i < 4; i++) {
        gateway->slot[i] = NULL;
    }
    gateway->ready = gateway->queued;
}

/* Two or three bytes of a value have come and none has left: they cannot be known before the fourth. */
static uint8_t must_wait(const mtm_gateway *gateway)
{
    const uint32_t at = gateway->parser.count;
    return gateway->rewriting && at < SPEED_BYTES - 2 && ((at - PAYLOAD) & 3u) >= 2 && gateway->slot[1] != NULL;
}

static void frame_arrived(mtm_gateway *gateway, const mtm_frame *frame)
{
    mtm_frame *place = &gateway->queue[gateway->queued++];
    uint32_t i;
    *place = *frame;
    if (place->id == COMPANION_STREAM) {
        for (i = 0; i < place->size; i++) {
            byte_arrived(gateway, &place->data[i]);
        }
    }
    if (must_wait(gateway) && gateway->queued < MTM_QUEUE_FRAMES) {
        gateway->ready = gateway->held_from;
    } else {
        release(gateway);
    }
}

/* Send what may leave; 0 when some of it must be offered again. */
static uint8_t drain(mtm_gateway *gateway)
{
    const mtm_board *board = gateway->board;
    while (gateway->gone < gateway->ready) {
        if (!board->send(board->context, MTM_CONTROLLER, &gateway->queue[gateway->gone])) {
            return 0;
        }
        gateway->gone++;
    }
    if (gateway->gone == gateway->queued) {
        gateway->queued = 0;
        gateway->gone = 0;
        gateway->ready = 0;
    }
    return 1;
}

/* ---- Commands of the gateway's own ---- */

static void inject(mtm_gateway *gateway)
{
    uint8_t message[SPEED_BYTES];
    uint8_t payload[4 * MTM_AXES];
    mtm_velocity out;
    uint32_t i;
    mtm_output(gateway->shim, &out);
    for (i = 0; i < 4 * MTM_AXES; i++) {
        payload[i] = (uint8_t)(mtm_to_wire(i >> 2, out.axis[i >> 2]) >> (8 * (i & 3u)));
    }
    (void)mtm_duml_build(message, &gateway->head, payload, sizeof payload);
    for (i = 0; i < SPEED_BYTES; i++) {
        mtm_frame *frame = &gateway->queue[i >> 3];
        frame->id = COMPANION_STREAM;
        frame->data[i & 7u] = message[i];
        frame->size = (uint8_t)((i & 7u) + 1);
    }
    gateway->queued = (SPEED_BYTES + 7) / 8;
    mtm_count(&gateway->counts.injected);
    release(gateway);
}

/* Forget the message that is arriving: its sender fell silent in it, or a stop cannot wait for its end. */
static void cut_in(mtm_gateway *gateway)
{
    mtm_duml_init(&gateway->parser);
    gateway->rewriting = 0;
    if (gateway->queued > 0) {
        release(gateway);
    }
}

/* Between two messages of the companion, say what is due; to stop, if need be, in the middle of one. */
static void speak(mtm_gateway *gateway)
{
    const mtm_shim *shim = gateway->shim;
    const uint8_t halting = !mtm_guard_fresh(shim);
    if (!shim->stopped && !(gateway->armed && (gateway->fill || halting))) {
        gateway->due = 0;
        gateway->last_tick = shim->tick;
        return;
    }
    if (!gateway->due && shim->tick != gateway->last_tick) {
        make_due(gateway);
    }
    if (gateway->due && halting && shim->last_us - gateway->due_us >= PATIENCE_US) {
        cut_in(gateway);
    }
    if (gateway->due && gateway->parser.count == 0 && gateway->queued == 0) {
        gateway->due = 0;
        gateway->last_tick = shim->tick;
        inject(gateway);
    }
}

static void pass_reverse(mtm_gateway *gateway)
{
    const mtm_board *board = gateway->board;
    uint32_t i;
    for (i = 0; i < FRAMES_PER_POLL; i++) {
        if (!gateway->reverse_full) {
            gateway->reverse_full = board->receive(board->context, MTM_CONTROLLER, &gateway->reverse);
        }
        if (!gateway->reverse_full || !board->send(board->context, MTM_COMPANION, &gateway->reverse)) {
            return;
        }
        gateway->reverse_full = 0;
    }
}

void mtm_gateway_poll(mtm_gateway *gateway)
{
    const mtm_board *board = gateway->board;
    mtm_frame frame;
    uint32_t i;
    mtm_advance(gateway->shim, board->now_us(board->context));
    if (board->stop_pressed(board->context) && !gateway->shim->stopped) {
        mtm_shim_stop(gateway->shim);
        make_due(gateway);
    }
    for (i = 0; i < FRAMES_PER_POLL && drain(gateway); i++) {
        if (!board->receive(board->context, MTM_COMPANION, &frame)) {
            break;
        }
        if (frame.size > 8) {
            mtm_count(&gateway->counts.overlong);
            continue;
        }
        frame_arrived(gateway, &frame);
    }
    if (drain(gateway)) {
        speak(gateway);
        (void)drain(gateway);
    }
    pass_reverse(gateway);
    board->status(board->context, gateway->shim);
}
