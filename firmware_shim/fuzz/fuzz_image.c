/* libFuzzer on the image loader: whatever is taken must play without a fault, and nothing read outside the image. */
#include "mtm_shim.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#define ROOM 65536u

static void put_u32(uint8_t *bytes, uint32_t value)
{
    bytes[0] = (uint8_t)value;
    bytes[1] = (uint8_t)(value >> 8);
    bytes[2] = (uint8_t)(value >> 16);
    bytes[3] = (uint8_t)(value >> 24);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const mtm_settings settings = {50000, ROOM, 100, 250, {MTM_Q20_MAX, MTM_Q20_ONE, 0}};
    mtm_shim shim;
    mtm_velocity out;
    uint8_t *image;
    uint32_t now_us = 0;
    size_t i;
    if (size < 1) {
        return 0;
    }
    /* A copy of exactly that size, so that the sanitizer sees a byte too far. Half of the inputs get a right size and
     * checksum, or hardly any would come past them. */
    image = malloc(size);
    memcpy(image, data + 1, size - 1);
    size--;
    if ((data[0] & 1) && size >= MTM_IMAGE_HEADER_BYTES + MTM_IMAGE_CRC_BYTES) {
        put_u32(image + 8, (uint32_t)size);
        put_u32(image + size - 4, mtm_crc32(image, (uint32_t)size - 4));
    }
    (void)mtm_shim_init(&shim, &settings);
    if (mtm_shim_offer(&shim, image, (uint32_t)size) == MTM_OK) {
        for (i = 0; i < 64; i++) {
            const mtm_velocity base = {{(mtm_q20)(data[i % size] << 23), -(mtm_q20)(i << 24), MTM_Q20_MAX}};
            uint32_t axis;
            now_us += (uint32_t)data[(i * 7) % size] << (data[0] >> 3);
            mtm_shim_tick(&shim, now_us, i & 4 ? NULL : &base, &out);
            for (axis = 0; axis < MTM_AXES; axis++) {
                if (out.axis[axis] > settings.limit[axis] || out.axis[axis] < -settings.limit[axis]) {
                    abort();
                }
            }
            if (i == 20) {
                (void)mtm_shim_offer(&shim, image, (uint32_t)size);
            }
        }
    }
    free(image);
    return 0;
}
