/* Between the wire's IEEE single precision, in DJI's signs (y right, z clockwise, degrees), and our integers. */
#include "internal.h"

#define RAD_PER_DEG_Q30 18740330 /* pi / 180 */
#define DEG_PER_RAD_Q24 961263669 /* 180 / pi */

/* value * factor / 2^bits, rounded to nearest (halves away from zero), clamped to +-MTM_Q20_MAX. */
static mtm_q20 scaled(mtm_q20 value, uint32_t factor, uint32_t bits)
{
    const uint64_t size = (uint32_t)(value < 0 ? -value : value);
    const uint64_t product = (size * factor + ((uint64_t)1 << (bits - 1))) >> bits;
    const mtm_q20 result = product > MTM_Q20_MAX ? MTM_Q20_MAX : (mtm_q20)product;
    return value < 0 ? -result : result;
}

mtm_q20 mtm_q20_of_f32(uint32_t bits)
{
    const uint32_t exponent = (bits >> 23) & 255u;
    const uint32_t mantissa = (bits & 0x7FFFFFu) | 0x800000u; /* times 2^(exponent - 150) m/s, or 2^(exponent - 130) */
    uint32_t size = MTM_Q20_MAX;
    if (exponent == 255) {
        return MTM_Q20_INVALID;
    }
    if (exponent < 130 - 24) {
        size = 0; /* less than half a unit, denormals too */
    } else if (exponent < 130) {
        const uint32_t shift = 130 - exponent;
        size = (mantissa + (1u << (shift - 1))) >> shift;
    } else if (exponent < 137) {
        size = mantissa << (exponent - 130);
    }
    return bits >> 31 ? -(mtm_q20)size : (mtm_q20)size;
}

uint32_t mtm_f32_of_q20(mtm_q20 value)
{
    const uint32_t sign = value < 0 ? 0x80000000u : 0;
    uint32_t size = value < 0 ? 0u - (uint32_t)value : (uint32_t)value;
    uint32_t exponent = 127 + 31 - 20; /* of a number whose highest bit is bit 31 */
    uint32_t kept;
    uint32_t cut;
    if (size == 0) {
        return 0;
    }
    while (size < 0x80000000u) { /* at most 31 times */
        size <<= 1;
        exponent--;
    }
    kept = size >> 8;
    cut = size & 255u;
    if (cut > 128 || (cut == 128 && (kept & 1u))) {
        kept++; /* a carry out of the mantissa runs into the exponent, as it should */
    }
    return sign | ((exponent << 23) + (kept - 0x800000u));
}

mtm_q20 mtm_of_wire(uint32_t axis, uint32_t bits)
{
    const mtm_q20 value = mtm_q20_of_f32(bits);
    if (axis == MTM_VX || value == MTM_Q20_INVALID) {
        return value;
    }
    return axis == MTM_VY ? -value : -scaled(value, RAD_PER_DEG_Q30, 30);
}

uint32_t mtm_to_wire(uint32_t axis, mtm_q20 value)
{
    if (axis == MTM_VX) {
        return mtm_f32_of_q20(value);
    }
    return mtm_f32_of_q20(axis == MTM_VY ? -value : -scaled(value, DEG_PER_RAD_Q24, 24));
}

uint32_t mtm_f32_with_low_byte(uint32_t bits, uint8_t low)
{
    /* Magnitude and bit pattern rise together, so the nearest pattern with that byte is the nearest number. */
    const uint32_t size = bits & 0x7FFFFFFFu;
    const uint32_t sign = bits & 0x80000000u;
    const uint32_t have = size & 255u;
    uint32_t near = (size & ~255u) | low;
    if (low > have + 128u && near >= 256u) {
        near -= 256u;
    } else if (have > low + 128u) {
        near += 256u;
    }
    return sign | near;
}
