"""The check that a frame carries: a cyclic redundancy check, or a tag that only the key's holders can make."""

from mtm_onboard.protocol.framing.framing import CRC_POLYNOMIALS, Framing
from mtm_onboard.protocol.tag_key import TagKey, tag_key_of

_WORD = 64
_WORD_MASK = (1 << _WORD) - 1


def check_value(number: int, body: int, framing: Framing, secret: bytes | TagKey, epoch: int) -> int:
    """The `check_bits` wide check of a frame's number and of its `body`, length field and payload as one number.

    A tag is `TagKey.tag` of epoch, number and the body's 64-bit words, most significant first; a bare secret is that of
    version 1.
    A CRC runs over the epoch as 64 bits, the number as `number_bits` and the body, most significant bit first. The
    body has the same width in every frame of a scheme, so no two bodies share their words.
    """
    width = framing.length_bits + framing.payload_bits
    if framing.check == "none":
        return 0
    if framing.check == "crc":
        content = (epoch << framing.number_bits | number) << width | body
        return crc(content, _WORD + framing.number_bits + width, framing.check_bits)
    words = tuple(body >> shift & _WORD_MASK for shift in reversed(range(0, width, _WORD)))
    return tag_key_of(secret).tag(epoch, number, words, framing.check_bits)


def crc(value: int, width: int, check_bits: int) -> int:
    """The cyclic redundancy check of a number's `width` bits, most significant first, from a register of ones."""
    polynomial, top = CRC_POLYNOMIALS[check_bits], check_bits - 1
    mask = register = (1 << check_bits) - 1
    for shift in reversed(range(width)):
        feedback = (register >> top ^ value >> shift) & 1
        register = register << 1 & mask ^ (polynomial if feedback else 0)
    return register
