/* The same vectors on every machine: host builds, sanitizers, and a Cortex-M4 in qemu. */
#include "mtm_shim.h"
#include "port.h"

#include <stddef.h>

struct step {
    uint32_t now_us;
    uint8_t has_base;
    mtm_velocity base;
    mtm_velocity expected;
};

struct playing {
    const uint8_t *image;
    uint32_t size, rate_mhz;
    const struct step *steps;
    uint32_t count;
};

struct reference {
    const uint8_t *image;
    uint32_t size, rate_mhz, axis;
    int32_t bound_q21;
    const int32_t *samples_q21;
    uint32_t count;
};

#include "vectors.h"

#define COUNT(array) ((uint32_t)(sizeof(array) / sizeof(array)[0]))
#define WIDE (20 * MTM_Q20_ONE)

static uint32_t failures;
static uint32_t worst_tick, worst_poll, worst_tick_stack, worst_poll_stack, overhead;
static uint32_t worst_message;
static uint64_t all_ticks;
static uint32_t tick_calls;

static void say_number(const char *what, uint32_t number)
{
    char digits[12];
    uint32_t at = sizeof digits;
    digits[--at] = 0;
    digits[--at] = '\n';
    do {
        digits[--at] = (char)('0' + number % 10);
        number /= 10;
    } while (number > 0);
    port_say(what);
    port_say(digits + at);
}

static void expect(int holds, const char *what, uint32_t number)
{
    if (!holds) {
        failures++;
        port_say("FAILED: ");
        say_number(what, number);
    }
}

static void begin(mtm_shim *shim, uint32_t rate_mhz)
{
    const mtm_settings settings = {rate_mhz, 1u << 20, 100, 250, {WIDE, WIDE, WIDE}};
    expect(mtm_shim_init(shim, &settings) == MTM_OK, "settings", rate_mhz);
}

static void tick(mtm_shim *shim, uint32_t now_us, const mtm_velocity *base, mtm_velocity *out)
{
    uint32_t before;
    uint32_t taken;
    uint32_t stack;
    port_stack_paint();
    before = port_instructions();
    mtm_shim_tick(shim, now_us, base, out);
    taken = port_instructions() - before;
    stack = port_stack_used();
    taken = taken > overhead ? taken - overhead : 0;
    if (taken < 1000000) { /* not across the counter's wrap */
        worst_tick = taken > worst_tick ? taken : worst_tick;
        all_ticks += taken;
        tick_calls++;
    }
    worst_tick_stack = stack > worst_tick_stack ? stack : worst_tick_stack;
}

static void test_playing(void)
{
    mtm_shim shim;
    mtm_velocity out;
    uint32_t i, step, axis;
    for (i = 0; i < COUNT(playing); i++) {
        begin(&shim, playing[i].rate_mhz);
        expect(mtm_shim_offer(&shim, playing[i].image, playing[i].size) == MTM_OK, "image", i);
        for (step = 0; step < playing[i].count; step++) {
            const struct step *given = &playing[i].steps[step];
            tick(&shim, given->now_us, given->has_base ? &given->base : NULL, &out);
            for (axis = 0; axis < MTM_AXES; axis++) {
                expect(out.axis[axis] == given->expected.axis[axis], "output of image", i);
            }
        }
    }
}

static void test_references(void)
{
    static const mtm_velocity rest = {{0, 0, 0}};
    mtm_shim shim;
    mtm_velocity out;
    uint32_t i, at;
    for (i = 0; i < COUNT(references); i++) {
        const struct reference *given = &references[i];
        begin(&shim, given->rate_mhz);
        expect(mtm_shim_offer(&shim, given->image, given->size) == MTM_OK, "reference image", i);
        for (at = 0; at < given->count; at++) {
            int32_t error;
            tick(&shim, (uint32_t)((uint64_t)at * 1000000000u / given->rate_mhz), &rest, &out);
            error = 2 * out.axis[given->axis] - given->samples_q21[at];
            expect(error <= given->bound_q21 && error >= -given->bound_q21, "reference waveform", i);
        }
    }
}

/* The most work that one tick can have: every bit of the timer's step set, the next image begun late on all axes,
 * and every value cut twice. */
static void test_worst_case(void)
{
    static const mtm_velocity fast = {{MTM_Q20_MAX, -MTM_Q20_MAX, MTM_Q20_MAX}};
    mtm_shim shim;
    mtm_velocity out;
    uint32_t i;
    for (i = 0; i < COUNT(playing); i++) {
        uint32_t elapsed_us = 0x7FFFFFFFu;
        for (; elapsed_us > 0; elapsed_us >>= 1) {
            begin(&shim, playing[i].rate_mhz);
            (void)mtm_shim_offer(&shim, playing[i].image, playing[i].size);
            tick(&shim, 0, &fast, &out);
            (void)mtm_shim_offer(&shim, playing[i].image, playing[i].size);
            tick(&shim, elapsed_us, &fast, &out);
            tick(&shim, elapsed_us + 150000, NULL, &out);
        }
    }
}

static void test_messages(void)
{
    mtm_duml_parser parser;
    uint8_t message[MTM_DUML_MAX_BYTES];
    uint32_t found = 0;
    uint32_t start = 0;
    uint32_t i, k;
    mtm_duml_init(&parser);
    for (i = 0; i < sizeof duml_stream; i++) {
        uint16_t length;
        mtm_duml_push(&parser, duml_stream[i]);
        length = mtm_duml_take(&parser);
        if (length > 0) {
            const uint8_t *got = parser.bytes;
            const mtm_duml_head head = {got[4], got[5], (uint16_t)(got[6] | got[7] << 8), got[8], got[9], got[10]};
            const uint16_t payload_bytes = (uint16_t)(length - MTM_DUML_OVERHEAD);
            expect(mtm_duml_build(message, &head, got + 11, payload_bytes) == length, "length of message", found);
            for (k = 0; k < length; k++) {
                expect(message[k] == duml_stream[start + k], "message", found);
            }
            start += length;
            found++;
        }
    }
    expect(found == DUML_MESSAGES, "messages found", found);
}

/* The most work that one byte can cause: it completes a message with a wrong checksum that is made of headers, each of
 * which promises a message that ends here too. */
static void test_worst_message(void)
{
    static mtm_duml_parser parser;
    uint8_t header[4] = {0x55, 0, 0, 0};
    uint32_t before = 0;
    uint32_t at;
    mtm_duml_init(&parser);
    for (at = 0; at < MTM_DUML_MAX_BYTES; at++) {
        const uint32_t length = MTM_DUML_MAX_BYTES - (at & ~3u);
        header[1] = (uint8_t)length;
        header[2] = (uint8_t)(4u | length >> 8);
        header[3] = mtm_crc8(header, 3);
        mtm_duml_push(&parser, header[at & 3u]);
        before = port_instructions();
        expect(mtm_duml_take(&parser) == 0, "message of headers", at);
    }
    worst_message = port_instructions() - before;
    expect(parser.count < MTM_DUML_OVERHEAD, "bytes left of it", parser.count);
}

/* ---- A board in memory ---- */

static struct {
    uint32_t now_us, given, taken;
} line;

static uint32_t board_now(void *context)
{
    (void)context;
    return line.now_us;
}

static uint8_t board_receive(void *context, uint8_t side, mtm_frame *frame)
{
    (void)context;
    if (side != MTM_COMPANION || line.given == 0) {
        return 0;
    }
    *frame = gateway_in[line.given - 1];
    line.given = 0;
    return 1;
}

static uint8_t board_send(void *context, uint8_t side, const mtm_frame *frame)
{
    const mtm_frame *due = &gateway_out[line.taken < COUNT(gateway_out) ? line.taken : 0];
    uint32_t i;
    (void)context;
    expect(side == MTM_CONTROLLER && frame->id == due->id && frame->size == due->size, "frame", line.taken);
    for (i = 0; i < frame->size; i++) {
        expect(frame->data[i] == due->data[i], "byte of frame", line.taken);
    }
    line.taken++;
    return 1;
}

static uint8_t board_stop(void *context)
{
    (void)context;
    return 0;
}

static void board_status(void *context, const mtm_shim *shim)
{
    (void)context;
    (void)shim;
}

static void poll(mtm_gateway *gateway)
{
    uint32_t before;
    uint32_t taken;
    uint32_t stack;
    port_stack_paint();
    before = port_instructions();
    mtm_gateway_poll(gateway);
    taken = port_instructions() - before;
    stack = port_stack_used();
    taken = taken > overhead ? taken - overhead : 0;
    worst_poll = taken < 1000000 && taken > worst_poll ? taken : worst_poll;
    worst_poll_stack = stack > worst_poll_stack ? stack : worst_poll_stack;
}

static void test_gateway(void)
{
    static const mtm_board board = {NULL, board_now, board_receive, board_send, board_stop, board_status};
    static mtm_gateway gateway;
    mtm_shim shim;
    uint32_t i;
    line.now_us = 1000000;
    begin(&shim, 50000);
    expect(mtm_shim_offer(&shim, gateway_image, sizeof gateway_image) == MTM_OK, "gateway image", 0);
    mtm_gateway_init(&gateway, &shim, &board, 0);
    for (i = 0; i < COUNT(gateway_in); i++) {
        line.given = i + 1;
        poll(&gateway);
        line.now_us += 130;
    }
    for (i = 0; i < 300; i++) {
        line.now_us += 1000;
        poll(&gateway);
    }
    expect(line.taken == COUNT(gateway_out), "frames sent", line.taken);
}

int main(void)
{
    const uint32_t before = port_instructions();
    uint32_t mean;
    overhead = port_instructions() - before;
    expect(port_counter_is_right(), "instruction counter", 0);
    test_playing();
    test_references();
    mean = tick_calls > 0 ? (uint32_t)all_ticks / tick_calls : 0;
    test_worst_case();
    test_messages();
    test_worst_message();
    test_gateway();
    if (worst_tick > 0) {
        say_number("instructions per tick, mean: ", mean);
        say_number("instructions per tick, worst: ", worst_tick);
        say_number("instructions per gateway poll with one frame, worst: ", worst_poll);
        say_number("instructions to give up 1023 bytes made of headers: ", worst_message);
        say_number("stack of a tick, bytes: ", worst_tick_stack);
        say_number("stack of a gateway poll, bytes: ", worst_poll_stack);
        say_number("state of the playing core, bytes: ", sizeof(mtm_shim));
        say_number("state of the gateway, bytes: ", sizeof(mtm_gateway));
        expect(worst_tick <= 2000, "instructions per tick", worst_tick);
        expect(worst_tick_stack + sizeof(mtm_shim) <= 2048, "memory of the playing core", worst_tick_stack);
    }
    port_say(failures == 0 ? "all vectors agree\n" : "vectors differ\n");
    return failures == 0 ? 0 : 1;
}
