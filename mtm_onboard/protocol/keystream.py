"""The one keyed generator: named streams of bytes, and nothing else that is random in a waveform."""

import hashlib
import struct
from collections.abc import Iterable

SECRET_BYTES = 32


def stream(secret: bytes, label: str, integers: tuple[int, ...], size: int) -> bytes:
    """Return `size` bytes of SHAKE-256(secret[32] || len(label) u8 || label || each integer as u64 little-endian).

    Raises ValueError when the secret is not 32 bytes, the label not 1-255 ASCII characters, or an integer
    does not fit in 64 bits.
    """
    return streams(secret, label, [integers], size)


def streams(secret: bytes, label: str, many: Iterable[tuple[int, ...]], size: int) -> bytes:
    """Return the streams of each tuple of integers, `size` bytes each, one after the other; raises as `stream`."""
    if len(secret) != SECRET_BYTES:
        raise ValueError(f"a secret has {SECRET_BYTES} bytes, not {len(secret)}")
    name = label.encode("ascii")
    if not 1 <= len(name) <= 255:
        raise ValueError(f"a stream's label has 1 to 255 characters, not {len(name)}")
    head = secret + bytes([len(name)]) + name
    return b"".join([hashlib.shake_256(head + _words(integers)).digest(size) for integers in many])


def _words(integers: tuple[int, ...]) -> bytes:
    try:
        return struct.pack(f"<{len(integers)}Q", *integers)
    except struct.error as error:
        raise ValueError(f"a stream's integers are unsigned 64-bit, not {integers}") from error
