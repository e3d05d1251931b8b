/* The image: checked whole before anything of it plays. */
#include "internal.h"

#include <stddef.h>

void mtm_clear(void *object, uint32_t size)
{
    uint8_t *byte = object;
    while (size-- > 0) {
        *byte++ = 0;
    }
}

uint16_t mtm_u16(const uint8_t *bytes)
{
    return (uint16_t)(bytes[0] | (uint16_t)(bytes[1] << 8));
}

uint32_t mtm_u32(const uint8_t *bytes)
{
    return mtm_u16(bytes) | (uint32_t)mtm_u16(bytes + 2) << 16;
}

uint32_t mtm_crc32(const uint8_t *bytes, uint32_t size)
{
    /* Half a byte at a time: 64 bytes of table instead of 1024. */
    static const uint32_t table[16] = {
        0x00000000u, 0x1DB71064u, 0x3B6E20C8u, 0x26D930ACu, 0x76DC4190u, 0x6B6B51F4u, 0x4DB26158u, 0x5005713Cu,
        0xEDB88320u, 0xF00F9344u, 0xD6D6A3E8u, 0xCB61B38Cu, 0x9B64C2B0u, 0x86D3D2D4u, 0xA00AE278u, 0xBDBDF21Cu,
    };
    uint32_t crc = 0xFFFFFFFFu;
    uint32_t i;
    for (i = 0; i < size; i++) {
        crc ^= bytes[i];
        crc = (crc >> 4) ^ table[crc & 15u];
        crc = (crc >> 4) ^ table[crc & 15u];
    }
    return ~crc;
}

/* Describe axis by axis; 0 when a field is outside its range. Returns the number of axes with samples. */
static uint32_t read_axes(mtm_image *image, const uint8_t *bytes)
{
    const uint32_t mask = bytes[6];
    uint32_t used = 0;
    uint32_t axis;
    for (axis = 0; axis < MTM_AXES; axis++) {
        const uint32_t step = mtm_u32(bytes + 48 + 8 * axis);
        const uint32_t limit = mtm_u32(bytes + 52 + 8 * axis);
        const uint32_t present = (mask >> axis) & 1u;
        if (step > MTM_Q20_MAX || (step != 0) != present || limit == 0 || limit > MTM_Q20_MAX) {
            return 0;
        }
        image->step[axis] = step;
        image->limit[axis] = (mtm_q20)limit;
        image->noise_limit[axis] = MTM_Q20_MAX;
        image->offset[axis] = present ? MTM_IMAGE_HEADER_BYTES + 2 * used * image->ticks : 0;
        used += present;
    }
    return mask >> MTM_AXES ? 0 : used;
}

static mtm_result read_fields(mtm_image *image, const uint8_t *bytes, uint32_t size)
{
    const uint32_t message_ticks = mtm_u32(bytes + 16);
    const uint32_t messages = mtm_u32(bytes + 20);
    uint64_t expected;
    uint32_t used;
    if (message_ticks < 1 || message_ticks > 1u << 20 || messages < 1 || messages > 4096 || bytes[7] > 1) {
        return MTM_IMAGE_INVALID;
    }
    if ((uint64_t)message_ticks * messages > size) {
        return MTM_IMAGE_INVALID; /* and from here on the ticks fit in 32 bits */
    }
    image->bytes = bytes;
    image->ticks = message_ticks * messages;
    image->repeats = bytes[7];
    used = read_axes(image, bytes);
    expected = MTM_IMAGE_HEADER_BYTES + (uint64_t)image->ticks * 2 * used + MTM_IMAGE_CRC_BYTES;
    return used > 0 && expected == size ? MTM_OK : MTM_IMAGE_INVALID;
}

mtm_result mtm_image_check(mtm_image *image, const uint8_t *bytes, uint32_t size, uint32_t size_max, uint32_t rate_mhz)
{
    mtm_image found;
    mtm_result result;
    if (bytes == NULL || size < MTM_IMAGE_HEADER_BYTES + MTM_IMAGE_CRC_BYTES) {
        return MTM_IMAGE_TRUNCATED;
    }
    if (mtm_u32(bytes) != 0x494D544Du) {
        return MTM_IMAGE_FOREIGN;
    }
    if (mtm_u16(bytes + 4) != MTM_IMAGE_VERSION) {
        return MTM_IMAGE_VERSION_UNKNOWN;
    }
    if (size > size_max || mtm_u32(bytes + 8) > size_max) {
        return MTM_IMAGE_TOO_LARGE;
    }
    if (mtm_u32(bytes + 8) != size) {
        return MTM_IMAGE_TRUNCATED;
    }
    if (mtm_crc32(bytes, size - MTM_IMAGE_CRC_BYTES) != mtm_u32(bytes + size - MTM_IMAGE_CRC_BYTES)) {
        return MTM_IMAGE_CORRUPT;
    }
    if (mtm_u32(bytes + 12) != rate_mhz) {
        return MTM_IMAGE_WRONG_RATE;
    }
    result = read_fields(&found, bytes, size);
    if (result == MTM_OK) {
        *image = found;
    }
    return result;
}
