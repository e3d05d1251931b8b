/* mtm_shim: the message of a moving robot, played on the microcontroller between velocity commands and motors.
 *
 * C99, freestanding: no heap, no floating point, no library but the memcpy, memmove and memset that compilers call
 * themselves. Nothing here blocks, and nothing keeps a global.
 * This header is the specification. Velocities are REP-103: x forward, y left, z counter-clockwise from above.
 * Not safe against itself: call everything that takes the same object from one thread or one interrupt level.
 */
#ifndef MTM_SHIM_H
#define MTM_SHIM_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Numbers ------------------------------------------------------------------------------------------------ */

#define MTM_AXES 3
#define MTM_VX 0
#define MTM_VY 1
#define MTM_WZ 2

/* A speed in units of 2^-20 m/s (vx, vy) or 2^-20 rad/s (wz). Magnitudes above MTM_Q20_MAX (1024 m/s) are clamped.
 * MTM_Q20_INVALID stands for "not a number"; a command that holds one is refused whole. */
typedef int32_t mtm_q20;
#define MTM_Q20_ONE 1048576
#define MTM_Q20_MAX 1073741824
#define MTM_Q20_INVALID (-2147483647 - 1)

typedef struct {
    mtm_q20 axis[MTM_AXES];
} mtm_velocity;

/* ---- Image: what is played ---------------------------------------------------------------------------------- */

/* An image is written by `mtm-onboard export`. Everything is little-endian; offsets in bytes:
 *
 *    0  4  "MTMI"
 *    4  2  format version, 1
 *    6  1  axes that have samples: bit 0 vx, bit 1 vy, bit 2 wz; at least one
 *    7  1  flags: bit 0 = starts again from its first message when it ends (fixed schedule); other bits 0
 *    8  4  size of the whole image
 *   12  4  rate in thousandths of a hertz, 1000 to 1000000
 *   16  4  ticks of one message, 1 to 2^20
 *   20  4  messages, 1 to 4096
 *   24  8  number of the first message in its epoch (for the record; 0 when the schedule is fixed)
 *   32  8  epoch (for the record)
 *   40  8  fingerprint of the scheme (for the record; the 16 hexadecimal digits as bytes)
 *   48 24  per axis vx, vy, wz: step u32, limit u32. One unit of a sample is step * 2^-36 m/s or rad/s, so the noise
 *          is round(sample * step / 2^16) in 2^-20; step is 1 to 2^30, 0 when the axis has no samples. The limit
 *          is the largest magnitude of that axis' command with noise, in 2^-20, 1 to 2^30.
 *   72 16  tag: keyed, checked by whoever provisioned the image. The device has no key for it; see the seal.
 *   88     samples, int16: all ticks of the first axis that has samples, then of the next
 *  end-4   CRC-32 (polynomial 0xEDB88320 reflected, start and final exclusive-or 0xFFFFFFFF) of all bytes before it.
 *          This is what the device checks: it finds accidents, not forgeries.
 */
#define MTM_IMAGE_VERSION 1
#define MTM_IMAGE_HEADER_BYTES 88
#define MTM_IMAGE_CRC_BYTES 4

/* A sealed image is an image behind a seal, for a device that has a key of its own, which is not the fleet's:
 *
 *    0  4  "MTMS"
 *    4  2  format version of the seal, 1
 *    6  2  0
 *    8  4  size of seal and image
 *   12  4  channel of the device
 *   16  4  counter: higher for each image that is made for a device
 *   20 12  vx, vy, wz: largest magnitude of the noise in 2^-20, 0 to 2^30; what the samples exceed is cut
 *   32 16  tag: the first bytes of SHAKE-256(device key, 32 bytes || 4 || "seal" || bytes 0 to 31 || image)
 *   48     the image
 *
 * What a device cannot check: without mtm_shim_trust, who made an image, for whom and when; without storage for
 * `counter`, after its power was cut, whether it has played an image before; and never, whether the time is that of the
 * image's slots. */
#define MTM_SEAL_VERSION 1
#define MTM_SEAL_BYTES 48
#define MTM_SEAL_TAG_AT 32
#define MTM_DEVICE_KEY_BYTES 32

typedef enum {
    MTM_OK = 0,
    MTM_BAD_SETTINGS = 1,   /* a setting is outside the range stated beside it */
    MTM_IMAGE_TRUNCATED = 2, /* fewer bytes than a header, or not as many as the header says */
    MTM_IMAGE_FOREIGN = 3,   /* does not begin with "MTMI" */
    MTM_IMAGE_VERSION_UNKNOWN = 4,
    MTM_IMAGE_TOO_LARGE = 5, /* larger than settings.image_bytes_max */
    MTM_IMAGE_CORRUPT = 6,   /* CRC-32 does not match */
    MTM_IMAGE_WRONG_RATE = 7, /* made for another rate than settings.rate_mhz */
    MTM_IMAGE_INVALID = 8,   /* a field is outside its range */
    MTM_IMAGE_BUSY = 9,      /* the image that would be replaced waits for its turn already */
    MTM_IMAGE_UNSEALED = 10, /* the device trusts sealed images alone */
    MTM_IMAGE_FORGED = 11,   /* the seal is not one of the device's key, or something behind it was altered */
    MTM_IMAGE_OTHER_CHANNEL = 12, /* sealed for another device */
    MTM_IMAGE_OLD = 13       /* its counter is not above that of the last image that was taken */
} mtm_result;

/* A checked image. Fields are for reading. */
typedef struct {
    const uint8_t *bytes; /* NULL: no image */
    uint32_t ticks;       /* of all messages together */
    uint32_t step[MTM_AXES];
    mtm_q20 limit[MTM_AXES];
    mtm_q20 noise_limit[MTM_AXES];
    uint32_t offset[MTM_AXES]; /* of the axis' first sample in bytes; 0: no samples */
    uint8_t repeats;
} mtm_image;

/* Check the `size` bytes at `bytes` and describe them in `image`, which is left alone unless MTM_OK is returned.
 * Reads no byte outside the given ones, whatever they hold. Time grows with `size` (CRC): not for the tick. */
mtm_result mtm_image_check(mtm_image *image, const uint8_t *bytes, uint32_t size, uint32_t size_max, uint32_t rate_mhz);

/* ---- Shim: the playing core --------------------------------------------------------------------------------- */

typedef struct {
    uint32_t rate_mhz;        /* ticks per 1000 s: 50 Hz is 50000. 1000 to 1000000 */
    uint32_t image_bytes_max; /* larger images are refused */
    uint32_t hold_ms;         /* age of the last command at which the noise ends and decay begins: 1 to 9999, say 100 */
    uint32_t zero_ms;         /* age at which the output is zero: hold_ms + 1 to 10000, say 250 */
    mtm_q20 limit[MTM_AXES];  /* largest magnitude of a command, 0 to 2^30; an image may lower it until the next one */
} mtm_settings;

/* Events since mtm_shim_init; each stays at its largest value instead of wrapping. */
typedef struct {
    uint32_t base_clamps;     /* axes of base commands cut to their limit */
    uint32_t output_clamps;   /* axes of commands with noise cut to their limit */
    uint32_t refused_commands; /* commands that held MTM_Q20_INVALID */
    uint32_t deadman_trips;   /* times the last command grew older than hold_ms */
    uint32_t missed_ticks;    /* tick numbers that passed between two calls */
    uint32_t clock_faults;    /* times the timer ran backwards */
    uint32_t refused_images;
    uint32_t ended_images;    /* images that ended with none to follow, so that the noise ended too */
} mtm_counts;

/* All state, about 0.3 KB. The fields are for reading, between calls. */
typedef struct {
    mtm_settings settings;
    mtm_counts counts;
    mtm_image active, pending;
    uint32_t position;  /* tick within the active image */
    uint32_t tick;      /* ticks since mtm_shim_init, modulo 2^32 */
    uint32_t phase;     /* fraction of a tick, in 10^-9 */
    uint32_t last_us;
    uint32_t age_us;    /* of the last good command; stays at its largest value */
    mtm_q20 limit[MTM_AXES];
    mtm_velocity base;  /* last good command, limited */
    uint32_t channel, counter; /* see mtm_shim_trust */
    uint8_t device_key[MTM_DEVICE_KEY_BYTES];
    uint8_t started, stopped, trusts;
} mtm_shim;

/* Set everything to rest: no image, no command, output zero. MTM_BAD_SETTINGS leaves `shim` untouched. */
mtm_result mtm_shim_init(mtm_shim *shim, const mtm_settings *settings);

/* From now on take images only that are sealed with this key of 32 bytes for this channel, with a counter above the
 * given one. `shim->counter` is that of the last image taken: a board with storage keeps it, and gives it here when it
 * starts. Without this call every image is taken whose checksum is right, sealed or not. */
void mtm_shim_trust(mtm_shim *shim, const uint8_t *device_key, uint32_t channel, uint32_t counter);

/* Hand over an image, sealed or not. It is checked here and refused before anything of it plays. With nothing playing it begins at
 * the next tick; otherwise at the message boundary where the active image ends; a repeating one ends each time it has
 * played. The bytes must stay unchanged while `active.bytes` or `pending.bytes` points to them, so a board with two
 * buffers fills the one that is neither. A third image is MTM_IMAGE_BUSY. */
mtm_result mtm_shim_offer(mtm_shim *shim, const uint8_t *bytes, uint32_t size);

/* Noise off at once: forget both images. */
void mtm_shim_silence(mtm_shim *shim);

/* One control period. `now_us` is a free-running timer that wraps at 2^32; calls are less than 2^31 us apart.
 * `base` is the newest command, or NULL when none came since the last call; `out` always receives the command for the
 * motors. Tick numbers follow the timer, not the calls: a call that comes late or never shifts nothing. The first
 * sample's tick begins half a period before the call that starts it, so calls at the rate with less than half a period
 * of jitter play every sample once.
 *
 * Order: limit the base, add the noise, limit the sum. Age of the last good command:
 *   below hold_ms     base + noise
 *   below zero_ms     base, fading linearly to zero; no noise
 *   zero_ms and more  zero
 * While stopped: zero. Constant memory, no division by a number that may be zero, every loop bounded.
 *
 * The guard of the companion's program (mtm_onboard/runtime/guard.py) ages and fades commands alike and refuses what
 * is not finite alike, and differs in its limits: it bounds the norm of (vx, vy), where here each axis is bounded by
 * itself and the norm may reach sqrt(2) times the limit; it shortens the noise along its direction, where here the
 * sum of base and noise is cut axis by axis; it bounds the noise in multiples of sigma, where here the image does,
 * and the change of (vx, vy) from tick to tick, which here nothing does; and its stop cannot be released. */
void mtm_shim_tick(mtm_shim *shim, uint32_t now_us, const mtm_velocity *base, mtm_velocity *out);

/* Operator stop: output is zero from the next tick on, until mtm_shim_release and then a new command. The message's
 * clock runs on. */
void mtm_shim_stop(mtm_shim *shim);
void mtm_shim_release(mtm_shim *shim);

/* ---- DJI messages over CAN ---------------------------------------------------------------------------------- */

#define MTM_DUML_MAX_BYTES 1023
#define MTM_DUML_OVERHEAD 13

/* Incremental parser: bytes in, whole messages with good checksums out. Fields are for reading. */
typedef struct {
    uint16_t count; /* bytes of the message that is arriving; its header is good once there are 4 */
    uint16_t taken;
    uint8_t bytes[MTM_DUML_MAX_BYTES];
} mtm_duml_parser;

void mtm_duml_init(mtm_duml_parser *parser);
/* Add one byte. Call mtm_duml_take until it returns 0 before the next. */
void mtm_duml_push(mtm_duml_parser *parser, uint8_t byte);
/* Length of the next whole message, which then stands at parser->bytes until the next call; 0 when there is none. */
uint16_t mtm_duml_take(mtm_duml_parser *parser);

typedef struct {
    uint8_t sender, receiver;
    uint16_t sequence;
    uint8_t attributes, set, id;
} mtm_duml_head;

/* Write a message of `payload_bytes` (0 to 1010) to `message`, which holds payload_bytes + 13. Returns its length, 0
 * when the payload is too long. */
uint16_t mtm_duml_build(uint8_t *message, const mtm_duml_head *head, const uint8_t *payload, uint16_t payload_bytes);

uint8_t mtm_crc8(const uint8_t *bytes, uint32_t size);
uint16_t mtm_crc16(const uint8_t *bytes, uint32_t size);
uint32_t mtm_crc32(const uint8_t *bytes, uint32_t size);

/* IEEE 754 single precision bits to 2^-20, rounded to nearest (halves away from zero), clamped to +-MTM_Q20_MAX;
 * MTM_Q20_INVALID for infinities and NaN. And back, rounded to nearest (halves to even). */
mtm_q20 mtm_q20_of_f32(uint32_t bits);
uint32_t mtm_f32_of_q20(mtm_q20 value);

/* ---- Gateway: between companion and motion controller ------------------------------------------------------- */

#define MTM_COMPANION 0
#define MTM_CONTROLLER 1
#define MTM_QUEUE_FRAMES 8

typedef struct {
    uint32_t id; /* as the board's CAN driver has it, flags included; standard 0x201 is the companion's stream */
    uint8_t size; /* 0 to 8 */
    uint8_t data[8];
} mtm_frame;

/* The hardware, behind five callbacks. None may block. */
typedef struct {
    void *context;                                                        /* given to each callback */
    uint32_t (*now_us)(void *context);                                    /* free-running timer */
    uint8_t (*receive)(void *context, uint8_t side, mtm_frame *frame);    /* 0: nothing has arrived */
    uint8_t (*send)(void *context, uint8_t side, const mtm_frame *frame); /* 0: no room, offered again later */
    uint8_t (*stop_pressed)(void *context);                               /* 1: the operator says stop; latched here */
    void (*status)(void *context, const mtm_shim *shim);                  /* end of every poll: feed the watchdog */
} mtm_board;

/* What the gateway does with the companion's stream (CAN id 0x201). A speed command is set 3F, id 21, 12 bytes of
 * payload, not an acknowledgement, not encrypted.
 *
 * - Every frame leaves as it came, those of an id in order, as soon as it is whole: one frame time of delay, plus the
 *   poll. Only the payload and CRC16 of speed commands change. A value that shares its first byte with the frame
 *   before keeps that byte (the lowest of the mantissa), at a cost of 2^-17 of the value at most; where two or three
 *   bytes would be left behind, which happens only to senders that pack messages without aligning them, the frame
 *   waits for the next.
 * - A command to which nothing is added and nothing limited leaves bit for bit as it came.
 * - A command whose CRC16 is wrong leaves with an equally wrong one and counts for nothing. A command that holds a
 *   NaN or an infinity leaves with the last good values in their place, fading as any stale command does.
 * - When commands stay away for hold_ms, or stop is latched, the gateway sends speed commands itself, one each tick:
 *   fading, then zero, until the companion's next; between two of its messages. Where a frame holds the end of one and
 *   the beginning of another, the beginning waits meanwhile, in a frame of its own, for the frame after it. Only when a
 *   message has begun to leave and does not end within 20 ms is it cut into; the robot then loses it. Not before the
 *   first speed command, nor after wheel speed (3F/20), follow speed (3F/22), position move (3F/25) or work mode 0
 *   (3F/19), unless stop is latched.
 * - While stop is latched the three other motion commands leave with a spoilt CRC16, so that the robot ignores them.
 * - `fill`: send base and noise each tick, between the companion's own messages, so that the waveform keeps its
 *   time when the companion does not.
 * The controller's frames pass untouched. */
typedef struct {
    uint32_t rewritten; /* speed commands that left with other values */
    uint32_t passed;    /* speed commands that left as they came */
    uint32_t late;      /* speed commands found only after a broken message, too late to change */
    uint32_t injected;  /* speed commands of the gateway's own */
    uint32_t spoilt;    /* other motion commands made invalid while stopped */
    uint32_t overlong;  /* frames that claimed more than 8 bytes, dropped */
} mtm_gateway_counts;

typedef struct {
    mtm_shim *shim;
    const mtm_board *board;
    mtm_gateway_counts counts;
    mtm_duml_parser parser;
    mtm_frame queue[MTM_QUEUE_FRAMES], reverse;
    uint8_t *slot[4];  /* where the bytes of the value that is arriving stand in the queue; NULL: sent */
    uint8_t sent[25];  /* the speed command as it leaves */
    mtm_duml_head head; /* of the last speed command */
    mtm_velocity arriving;
    uint32_t last_tick, due_us;
    uint8_t queued, ready, gone, held_from, holds_head, reverse_full, rewriting, changed, armed, fill, due;
} mtm_gateway;

/* `shim` and `board` must outlive the gateway; the shim is ticked by the gateway alone. */
void mtm_gateway_init(mtm_gateway *gateway, mtm_shim *shim, const mtm_board *board, uint8_t fill);

/* One pass of the board's main loop: handles at most 8 frames of each side. Call it at least once each frame time. */
void mtm_gateway_poll(mtm_gateway *gateway);

#ifdef __cplusplus
}
#endif
#endif
