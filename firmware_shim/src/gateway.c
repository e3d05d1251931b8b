/* The gateway: frames in, frames out in the same order, and commands of its own when the companion's stay away. */
#include "internal.h"

#include <stddef.h>

#define COMPANION_STREAM 0x201u
#define FRAMES_PER_POLL 8
#define PATIENCE_US 20000u /* how long our own stop waits for the end of a message before it cuts in */

void mtm_gateway_init(mtm_gateway *gateway, mtm_shim *shim, const mtm_board *board, uint8_t fill)
{
    static const mtm_duml_head companion = {0xC9, 0xC3, 0, 0, MTM_SET_CHASSIS, MTM_ID_SPEED};
    mtm_clear(gateway, sizeof *gateway);
    gateway->shim = shim;
    gateway->board = board;
    gateway->head = companion;
    gateway->fill = fill;
}

/* ---- Frames ---- */

static void release(mtm_gateway *gateway)
{
    uint32_t i;
    for (i = 0; i < 4; i++) {
        gateway->slot[i] = NULL;
    }
    gateway->ready = gateway->queued;
    gateway->holds_head = 0;
}

/* Whether commands of the gateway's own are wanted, to stop or to fill. */
static uint8_t speaks(const mtm_gateway *gateway)
{
    const mtm_shim *shim = gateway->shim;
    return shim->stopped || (gateway->armed && (gateway->fill || !mtm_guard_fresh(shim)));
}

/* The last frame ends one message and begins another: keep the beginning, in a frame of its own, until more of it
 * comes, so that a command of ours has its place between the two. At most 7 bytes: none of them is of a value. */
static void hold_head(mtm_gateway *gateway)
{
    const uint32_t size = gateway->parser.count;
    mtm_frame *end = &gateway->queue[gateway->queued - 1];
    mtm_frame *head = end + 1;
    uint32_t i;
    head->id = end->id;
    head->size = (uint8_t)size;
    end->size = (uint8_t)(end->size - size);
    for (i = 0; i < size; i++) {
        head->data[i] = end->data[end->size + i];
    }
    release(gateway);
    gateway->queued++;
    gateway->holds_head = 1;
}

/* A frame that is none of the stream does not wait for a held beginning, which stays the last in the queue. */
static void overtake(mtm_gateway *gateway)
{
    mtm_frame *last = &gateway->queue[gateway->queued - 1];
    const mtm_frame head = last[-1];
    last[-1] = *last;
    *last = head;
    gateway->ready++;
}

/* Two or three bytes of a value have come and none has left: they cannot be known before the fourth. */
static uint8_t must_wait(const mtm_gateway *gateway)
{
    const uint32_t at = gateway->parser.count;
    return gateway->rewriting && at < MTM_SPEED_BYTES - 2 && ((at - MTM_PAYLOAD) & 3u) >= 2 && gateway->slot[1] != NULL;
}

static void frame_arrived(mtm_gateway *gateway, const mtm_frame *frame)
{
    mtm_frame *place = &gateway->queue[gateway->queued++];
    uint32_t i;
    *place = *frame;
    if (place->id == COMPANION_STREAM) {
        for (i = 0; i < place->size; i++) {
            mtm_byte_arrived(gateway, &place->data[i]);
        }
    }
    if (gateway->queued == MTM_QUEUE_FRAMES) {
        release(gateway);
    } else if (must_wait(gateway)) {
        gateway->ready = gateway->held_from;
        gateway->holds_head = 0;
    } else if (place->id != COMPANION_STREAM && gateway->holds_head) {
        overtake(gateway);
    } else if (place->id == COMPANION_STREAM && gateway->parser.count > 0 && gateway->parser.count < place->size &&
               speaks(gateway)) {
        hold_head(gateway);
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
    if (gateway->gone == gateway->queued || gateway->holds_head) {
        /* All has left, but for a held beginning. */
        gateway->queue[0] = gateway->queue[gateway->gone & (MTM_QUEUE_FRAMES - 1)];
        gateway->queued = (uint8_t)(gateway->queued - gateway->gone);
        gateway->gone = 0;
        gateway->ready = 0;
    }
    return 1;
}

/* ---- Commands of the gateway's own ---- */

#define INJECTED_FRAMES ((MTM_SPEED_BYTES + 7) / 8)

/* Between two messages: what waits, if anything, is the held beginning of the next. */
static uint8_t between_messages(const mtm_gateway *gateway)
{
    if (gateway->queued == 0) {
        return gateway->parser.count == 0;
    }
    return gateway->holds_head && gateway->queued == 1;
}

/* Put a command of the gateway's own before the held beginning, if there is one. */
static void inject(mtm_gateway *gateway)
{
    uint8_t message[MTM_SPEED_BYTES];
    uint8_t payload[4 * MTM_AXES];
    mtm_velocity out;
    uint32_t i;
    gateway->queue[INJECTED_FRAMES] = gateway->queue[0];
    mtm_output(gateway->shim, &out);
    for (i = 0; i < 4 * MTM_AXES; i++) {
        payload[i] = (uint8_t)(mtm_to_wire(i >> 2, out.axis[i >> 2]) >> (8 * (i & 3u)));
    }
    (void)mtm_duml_build(message, &gateway->head, payload, sizeof payload);
    for (i = 0; i < MTM_SPEED_BYTES; i++) {
        mtm_frame *frame = &gateway->queue[i >> 3];
        frame->id = COMPANION_STREAM;
        frame->data[i & 7u] = message[i];
        frame->size = (uint8_t)((i & 7u) + 1);
    }
    gateway->ready = INJECTED_FRAMES;
    gateway->queued = (uint8_t)(gateway->queued + INJECTED_FRAMES);
    mtm_count(&gateway->counts.injected);
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
    if (!speaks(gateway)) {
        gateway->due = 0;
        gateway->last_tick = shim->tick;
        return;
    }
    if (!gateway->due && shim->tick != gateway->last_tick) {
        mtm_make_due(gateway);
    }
    if (gateway->due && halting && !between_messages(gateway) && shim->last_us - gateway->due_us >= PATIENCE_US) {
        cut_in(gateway);
    }
    if (gateway->due && between_messages(gateway)) {
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
        mtm_make_due(gateway);
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
