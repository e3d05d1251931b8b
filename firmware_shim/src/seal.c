/* The seal: that an image was made for this device, is newer than the last one, and is whole. */
#include "internal.h"

#include <stddef.h>

#define RATE 136u /* bytes of SHAKE-256 between two permutations */
#define ROUNDS 24u

static uint64_t turned(uint64_t lane, uint32_t bits)
{
    return bits == 0 ? lane : lane << bits | lane >> (64u - bits);
}

/* Keccak-f[1600], as FIPS 202 has it. */
static void permute(uint64_t *state)
{
    static const uint8_t turns[24] = {
        1, 3, 6, 10, 15, 21, 28, 36, 45, 55, 2, 14, 27, 41, 56, 8, 25, 43, 62, 18, 39, 61, 20, 44,
    };
    static const uint8_t places[24] = {
        10, 7, 11, 17, 18, 3, 5, 16, 8, 21, 24, 4, 15, 23, 19, 13, 12, 2, 20, 14, 22, 9, 6, 1,
    };
    uint32_t feedback = 1;
    uint32_t round;
    for (round = 0; round < ROUNDS; round++) {
        uint64_t column[5], carried;
        uint32_t x, y, bit;
        for (x = 0; x < 5; x++) {
            column[x] = state[x] ^ state[x + 5] ^ state[x + 10] ^ state[x + 15] ^ state[x + 20];
        }
        for (x = 0; x < 5; x++) {
            const uint64_t parity = column[(x + 4) % 5] ^ turned(column[(x + 1) % 5], 1);
            for (y = 0; y < 25; y += 5) {
                state[x + y] ^= parity;
            }
        }
        carried = state[1];
        for (x = 0; x < 24; x++) {
            const uint64_t next = state[places[x]];
            state[places[x]] = turned(carried, turns[x]);
            carried = next;
        }
        for (y = 0; y < 25; y += 5) {
            for (x = 0; x < 5; x++) {
                column[x] = state[y + x];
            }
            for (x = 0; x < 5; x++) {
                state[y + x] = column[x] ^ (~column[(x + 1) % 5] & column[(x + 2) % 5]);
            }
        }
        /* The round's constant has a bit at 2^bit - 1 where the feedback register says so. */
        for (bit = 0; bit < 7; bit++) {
            if (feedback & 1u) {
                state[0] ^= (uint64_t)1 << ((1u << bit) - 1u);
            }
            feedback = ((feedback << 1) ^ ((feedback >> 7) * 0x71u)) & 0xFFu;
        }
    }
}

typedef struct {
    uint64_t state[25];
    uint32_t used;
} sponge;

static void absorb(sponge *into, const uint8_t *bytes, uint32_t size)
{
    uint32_t i;
    for (i = 0; i < size; i++) {
        into->state[into->used >> 3] ^= (uint64_t)bytes[i] << (8u * (into->used & 7u));
        if (++into->used == RATE) {
            permute(into->state);
            into->used = 0;
        }
    }
}

/* Whether the seal's tag is that of the device's key; takes as long for a wrong one as for a right one. */
static uint8_t tag_good(const uint8_t *bytes, uint32_t size, const uint8_t *device_key)
{
    static const uint8_t label[5] = {4, 's', 'e', 'a', 'l'};
    sponge own;
    uint32_t different = 0;
    uint32_t i;
    mtm_clear(&own, sizeof own);
    absorb(&own, device_key, MTM_DEVICE_KEY_BYTES);
    absorb(&own, label, sizeof label);
    absorb(&own, bytes, MTM_SEAL_TAG_AT);
    absorb(&own, bytes + MTM_SEAL_BYTES, size - MTM_SEAL_BYTES);
    own.state[own.used >> 3] ^= (uint64_t)0x1F << (8u * (own.used & 7u));
    own.state[(RATE - 1) >> 3] ^= (uint64_t)0x80 << 56;
    permute(own.state);
    for (i = 0; i < MTM_SEAL_BYTES - MTM_SEAL_TAG_AT; i++) {
        different |= (uint32_t)((own.state[i >> 3] >> (8u * (i & 7u))) & 0xFFu) ^ bytes[MTM_SEAL_TAG_AT + i];
    }
    return different == 0;
}

mtm_result mtm_seal_check(mtm_image *image, const uint8_t *bytes, uint32_t size, const mtm_shim *shim)
{
    mtm_image found;
    mtm_result result;
    uint32_t axis;
    if (size < MTM_SEAL_BYTES) {
        return MTM_IMAGE_TRUNCATED;
    }
    if (mtm_u16(bytes + 4) != MTM_SEAL_VERSION) {
        return MTM_IMAGE_VERSION_UNKNOWN;
    }
    if (size > shim->settings.image_bytes_max) {
        return MTM_IMAGE_TOO_LARGE;
    }
    if (mtm_u16(bytes + 6) != 0 || mtm_u32(bytes + 8) != size) {
        return MTM_IMAGE_TRUNCATED;
    }
    if (shim->trusts) {
        if (!tag_good(bytes, size, shim->device_key)) {
            return MTM_IMAGE_FORGED;
        }
        if (mtm_u32(bytes + 12) != shim->channel) {
            return MTM_IMAGE_OTHER_CHANNEL;
        }
        if (mtm_u32(bytes + 16) <= shim->counter) {
            return MTM_IMAGE_OLD;
        }
    }
    result = mtm_image_check(&found, bytes + MTM_SEAL_BYTES, size - MTM_SEAL_BYTES, shim->settings.image_bytes_max,
                             shim->settings.rate_mhz);
    for (axis = 0; axis < MTM_AXES && result == MTM_OK; axis++) {
        const uint32_t most = mtm_u32(bytes + 20 + 4 * axis);
        if (most > MTM_Q20_MAX) {
            result = MTM_IMAGE_INVALID;
        }
        found.noise_limit[axis] = (mtm_q20)most;
    }
    if (result == MTM_OK) {
        *image = found;
    }
    return result;
}

void mtm_shim_trust(mtm_shim *shim, const uint8_t *device_key, uint32_t channel, uint32_t counter)
{
    uint32_t i;
    for (i = 0; i < MTM_DEVICE_KEY_BYTES; i++) {
        shim->device_key[i] = device_key[i];
    }
    shim->channel = channel;
    shim->counter = counter;
    shim->trusts = 1;
}
