"""Mutations of valid traffic, as a bad cable, a full buffer or an experimenting client produce them."""

import random
from collections.abc import Callable
from dataclasses import dataclass

_MAX_MESSAGES = 3
_MAX_DAMAGES = 3
_MAX_BITS = 8
_MAX_INSERTED = 40
# Lengths and counts near a boundary, which random bytes rarely hit.
_BOUNDARY_VALUES = (0, 1, 12, 13, 127, 128, 254, 255)


@dataclass(frozen=True)
class Traffic:
    """Valid messages of one direction of a wire.

    `starts` are the bytes that begin a message, `lengths_at` the offsets of its length. `seal` makes, from a valid
    message, one with other content and correct checksums; None where the format has no checksum.
    """

    messages: tuple[bytes, ...]
    starts: bytes
    lengths_at: tuple[int, ...]
    seal: Callable[[random.Random, bytes], bytes] | None = None


def damaged(draw: random.Random, traffic: Traffic) -> tuple[bytes, list[bytes]]:
    """One to three messages with up to three kinds of damage, and those among them that `seal` made before that."""
    messages = draw.choices(traffic.messages, k=draw.randint(1, _MAX_MESSAGES))
    sealed: list[bytes] = []
    if traffic.seal is not None and draw.random() < 0.2:
        messages[0] = traffic.seal(draw, messages[0])
        sealed.append(messages[0])
    data = bytearray().join(messages)
    for _ in range(draw.randint(0, _MAX_DAMAGES)):
        if data:
            draw.choice(_DAMAGES)(draw, data, traffic)
    return bytes(data), sealed


def _flip(draw: random.Random, data: bytearray, _traffic: Traffic) -> None:
    for _ in range(draw.randint(1, _MAX_BITS)):
        data[draw.randrange(len(data))] ^= 1 << draw.randrange(8)


def _overwrite(draw: random.Random, data: bytearray, _traffic: Traffic) -> None:
    for _ in range(draw.randint(1, 4)):
        data[draw.randrange(len(data))] = draw.randrange(256)


def _truncate(draw: random.Random, data: bytearray, _traffic: Traffic) -> None:
    cut = draw.randrange(len(data))
    if draw.random() < 0.5:
        del data[:cut]
    else:
        del data[cut:]


def _delete(draw: random.Random, data: bytearray, _traffic: Traffic) -> None:
    begin, end = _span(draw, data)
    del data[begin:end]


def _duplicate(draw: random.Random, data: bytearray, _traffic: Traffic) -> None:
    begin, end = _span(draw, data)
    data[end:end] = data[begin:end]


def _swap(draw: random.Random, data: bytearray, _traffic: Traffic) -> None:
    """Exchange two neighbouring frames of eight bytes."""
    begin = 8 * draw.randrange((len(data) + 7) // 8)
    data[begin : begin + 16] = data[begin + 8 : begin + 16] + data[begin : begin + 8]


def _splice(draw: random.Random, data: bytearray, traffic: Traffic) -> None:
    other = draw.choice(traffic.messages)
    data[draw.randrange(len(data)) :] = other[draw.randrange(len(other)) :]


def _insert(draw: random.Random, data: bytearray, traffic: Traffic) -> None:
    place, count = draw.randrange(len(data) + 1), draw.randint(1, _MAX_INSERTED)
    data[place:place] = draw.choice((draw.randbytes(count), traffic.starts, bytes(count)))


def _change_length(draw: random.Random, data: bytearray, traffic: Traffic) -> None:
    if not traffic.lengths_at:
        # Text has no lengths; change a digit.
        digits = [place for place, letter in enumerate(data) if 48 <= letter < 58]
        if digits:
            data[draw.choice(digits)] = draw.choice(b"0123456789.-exX ")
        return
    place = draw.choice(traffic.lengths_at)
    if place < len(data):
        data[place] = draw.choice((draw.randrange(256), draw.choice(_BOUNDARY_VALUES), (data[place] + 1) % 256))


def _span(draw: random.Random, data: bytearray) -> tuple[int, int]:
    begin = draw.randrange(len(data))
    return begin, min(len(data), begin + draw.randint(1, _MAX_INSERTED))


_DAMAGES: tuple[Callable[[random.Random, bytearray, Traffic], None], ...] = (
    _flip, _overwrite, _truncate, _delete, _duplicate, _swap, _splice, _insert, _change_length,
)  # fmt: skip
