"""Reed-Solomon parity over GF(2 ** m): all that a robot needs, which sends and never corrects.

Correcting is a library's (reedsolo), and this must agree with it; Debian has no package of one, and a robot's computer
runs on what Debian has.
"""

from collections.abc import Sequence
from functools import lru_cache

# Primitive polynomials of GF(2 ** m), the usual ones with the fewest terms; that of m = 8 is also QR code's.
PRIMITIVE_POLYNOMIALS = {
    2: 0x7, 3: 0xB, 4: 0x13, 5: 0x25, 6: 0x43, 7: 0x89, 8: 0x11D, 9: 0x211, 10: 0x409, 11: 0x805, 12: 0x1053,
    13: 0x201B, 14: 0x4443, 15: 0x8003, 16: 0x1100B,
}  # fmt: skip


def parity_of(data: Sequence[int], parity: int, field_bits: int) -> list[int]:
    """The `parity` symbols that make `data` a codeword: the remainder of data * x ** parity by the generator.

    The generator polynomial has the roots alpha ** 0 to alpha ** (parity - 1), alpha being the field's element 2.
    """
    powers, logarithms = _tables(field_bits)
    # Leading coefficient left out: it is one.
    generator = _generator(parity, field_bits)
    remainder = [0] * parity
    for symbol in data:
        feedback = symbol ^ remainder[0]
        remainder = [*remainder[1:], 0]
        if feedback:
            shift = logarithms[feedback]
            for place, coefficient in enumerate(generator):
                remainder[place] ^= powers[shift + logarithms[coefficient]]
    return remainder


@lru_cache(maxsize=4)
def _generator(parity: int, field_bits: int) -> tuple[int, ...]:
    """Coefficients of the generator polynomial, highest power first, without the leading one.

    None is zero: the generator is a codeword, and those of `parity` symbols differ in more places than that.
    """
    powers, logarithms = _tables(field_bits)
    generator = [1]
    for root in range(parity):
        # Times (x + alpha ** root).
        product = [*generator, 0]
        for place, coefficient in enumerate(generator):
            product[place + 1] ^= powers[logarithms[coefficient] + root]
        generator = product
    return tuple(generator[1:])


@lru_cache(maxsize=4)
def _tables(field_bits: int) -> tuple[list[int], list[int]]:
    """Powers of alpha, twice around so that sums of two logarithms need no modulus, and logarithms (0 has none)."""
    size = 1 << field_bits
    powers, logarithms = [0] * (2 * size), [0] * size
    value = 1
    for exponent in range(size - 1):
        powers[exponent] = powers[exponent + size - 1] = value
        logarithms[value] = exponent
        value <<= 1
        if value & size:
            value ^= PRIMITIVE_POLYNOMIALS[field_bits]
    return powers, logarithms
