/* libFuzzer on the CAN parser and the gateway: frames of any content at any time, on lines that fill up. What must
 * hold: no fault, and as many frames leave for the controller as came for it and were injected. */
#include "mtm_shim.h"

#include <stddef.h>
#include <stdlib.h>

static struct {
    const uint8_t *data;
    size_t size, at;
    uint32_t now_us, received, sent;
    uint8_t open, stop;
} line;

static uint8_t next(void)
{
    return line.at < line.size ? line.data[line.at++] : 0;
}

static uint32_t now(void *context)
{
    (void)context;
    return line.now_us;
}

static uint8_t receive(void *context, uint8_t side, mtm_frame *frame)
{
    uint8_t kind;
    uint32_t i;
    (void)context;
    if (side != MTM_COMPANION || line.at >= line.size) {
        return 0;
    }
    kind = next();
    if (kind == 0xFF) {
        return 0;
    }
    frame->id = kind & 0x40 ? 0x202 : 0x201;
    frame->size = kind & 15u;
    for (i = 0; i < 8; i++) {
        frame->data[i] = i < frame->size ? next() : 0;
    }
    line.received += frame->size <= 8 ? frame->size : 0;
    return 1;
}

static uint8_t send(void *context, uint8_t side, const mtm_frame *frame)
{
    (void)context;
    if (side != MTM_CONTROLLER || frame->size > 8) {
        abort();
    }
    line.open = (uint8_t)(line.open * 5u + 1u);
    if (line.stop & 2 && line.open & 4) {
        return 0;
    }
    line.sent += frame->size;
    return 1;
}

static uint8_t stop_pressed(void *context)
{
    (void)context;
    return line.stop & 1;
}

static void status(void *context, const mtm_shim *shim)
{
    (void)context;
    (void)shim;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const mtm_board board = {NULL, now, receive, send, stop_pressed, status};
    const mtm_settings settings = {50000, 65536, 100, 250, {MTM_Q20_ONE, MTM_Q20_ONE, MTM_Q20_ONE}};
    mtm_shim shim;
    mtm_gateway *gateway = malloc(sizeof *gateway);
    uint32_t idle;
    line.data = data;
    line.size = size;
    line.at = 0;
    line.now_us = line.received = line.sent = 0;
    line.stop = 0;
    (void)mtm_shim_init(&shim, &settings);
    mtm_gateway_init(gateway, &shim, &board, (uint8_t)(size & 1));
    while (line.at < line.size) {
        const uint8_t step = next();
        line.now_us += (uint32_t)(step >> 2) << 9;
        line.stop = step & 3u;
        if (step == 0xFC) {
            mtm_shim_release(&shim);
        }
        mtm_gateway_poll(gateway);
    }
    line.stop = 0;
    mtm_shim_release(&shim);
    for (idle = 0; idle < 400; idle++) { /* long enough for whatever waits to be let go */
        line.now_us += 1000;
        mtm_gateway_poll(gateway);
    }
    if (gateway->queued == gateway->gone && line.sent != line.received + 25 * gateway->counts.injected) {
        abort();
    }
    free(gateway);
    return 0;
}
