/* DJI's message: 55, length and version, CRC8, sender, receiver, sequence, attributes, set, id, payload, CRC16.
 * Layout and checksums as in DJI's open SDK. */
#include "internal.h"

#define START 0x55u
#define VERSION_BITS 0x04u

uint8_t mtm_crc8(const uint8_t *bytes, uint32_t size)
{
    /* Reflected polynomial 0x8C, half a byte at a time. */
    static const uint8_t table[16] = {0x00, 0x9D, 0x23, 0xBE, 0x46, 0xDB, 0x65, 0xF8,
                                      0x8C, 0x11, 0xAF, 0x32, 0xCA, 0x57, 0xE9, 0x74};
    uint8_t crc = 0x77;
    uint32_t i;
    for (i = 0; i < size; i++) {
        crc = (uint8_t)(crc ^ bytes[i]);
        crc = (uint8_t)((crc >> 4) ^ table[crc & 15]);
        crc = (uint8_t)((crc >> 4) ^ table[crc & 15]);
    }
    return crc;
}

uint16_t mtm_crc16(const uint8_t *bytes, uint32_t size)
{
    /* Reflected polynomial 0x8408, half a byte at a time. */
    static const uint16_t table[16] = {0x0000, 0x1081, 0x2102, 0x3183, 0x4204, 0x5285, 0x6306, 0x7387,
                                       0x8408, 0x9489, 0xA50A, 0xB58B, 0xC60C, 0xD68D, 0xE70E, 0xF78F};
    uint16_t crc = 0x3692;
    uint32_t i;
    for (i = 0; i < size; i++) {
        crc = (uint16_t)(crc ^ bytes[i]);
        crc = (uint16_t)((crc >> 4) ^ table[crc & 15]);
        crc = (uint16_t)((crc >> 4) ^ table[crc & 15]);
    }
    return crc;
}

void mtm_duml_init(mtm_duml_parser *parser)
{
    parser->count = 0;
    parser->taken = 0;
}

/* Forget the first `size` bytes. */
static void drop(mtm_duml_parser *parser, uint32_t size)
{
    uint32_t i;
    for (i = size; i < parser->count; i++) {
        parser->bytes[i - size] = parser->bytes[i];
    }
    parser->count = (uint16_t)(parser->count - size);
}

static uint32_t stated_length(const uint8_t *bytes)
{
    return mtm_u16(bytes + 1) & 1023u;
}

/* 0: no message begins here; 1: one may, and needs more bytes; 2: a whole one does. */
static uint32_t look(const uint8_t *bytes, uint32_t count)
{
    if (bytes[0] != START) {
        return 0;
    }
    if (count < 4) {
        return 1;
    }
    if ((bytes[2] & 0xFCu) != VERSION_BITS || stated_length(bytes) < MTM_DUML_OVERHEAD ||
        mtm_crc8(bytes, 3) != bytes[3]) {
        return 0;
    }
    if (count < stated_length(bytes)) {
        return 1;
    }
    return mtm_crc16(bytes, stated_length(bytes) - 2) == mtm_u16(bytes + stated_length(bytes) - 2) ? 2 : 0;
}

void mtm_duml_push(mtm_duml_parser *parser, uint8_t byte)
{
    if (parser->count < MTM_DUML_MAX_BYTES) { /* always so when every message was taken */
        parser->bytes[parser->count++] = byte;
    }
}

uint16_t mtm_duml_take(mtm_duml_parser *parser)
{
    uint32_t from = parser->taken;
    uint32_t found = 0;
    while (from < parser->count) {
        found = look(parser->bytes + from, parser->count - from);
        if (found != 0) {
            break;
        }
        from++;
    }
    drop(parser, from);
    parser->taken = found == 2 ? (uint16_t)stated_length(parser->bytes) : 0;
    return parser->taken;
}

uint16_t mtm_duml_build(uint8_t *message, const mtm_duml_head *head, const uint8_t *payload, uint16_t payload_bytes)
{
    const uint32_t size = (uint32_t)payload_bytes + MTM_DUML_OVERHEAD;
    uint16_t crc;
    uint32_t i;
    if (size > MTM_DUML_MAX_BYTES) {
        return 0;
    }
    message[0] = START;
    message[1] = (uint8_t)size;
    message[2] = (uint8_t)(VERSION_BITS | size >> 8);
    message[3] = mtm_crc8(message, 3);
    message[4] = head->sender;
    message[5] = head->receiver;
    message[6] = (uint8_t)head->sequence;
    message[7] = (uint8_t)(head->sequence >> 8);
    message[8] = head->attributes;
    message[9] = head->set;
    message[10] = head->id;
    for (i = 0; i < payload_bytes; i++) {
        message[11 + i] = payload[i];
    }
    crc = mtm_crc16(message, size - 2);
    message[size - 2] = (uint8_t)crc;
    message[size - 1] = (uint8_t)(crc >> 8);
    return (uint16_t)size;
}
