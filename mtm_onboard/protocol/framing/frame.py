"""Frames: a payload with its number and check, written in the L symbols of a message."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.framing.check import check_value
from mtm_onboard.protocol.framing.code import decode_symbols, encode_symbols
from mtm_onboard.protocol.framing.framing import Framing, layout_of
from mtm_onboard.protocol.framing.payload import Payload, bits_of_payload, payload_of_bits
from mtm_onboard.protocol.framing.symbols import number_of_symbols, symbols_of_number
from mtm_onboard.protocol.tag_key import TagKey

if TYPE_CHECKING:
    from mtm_onboard.protocol.scheme import Scheme


@dataclass(frozen=True)
class Frame:
    """What a frame says: its payload, and the message's number modulo 2 ** number_bits (0 where it is not carried)."""

    payload: Payload
    number: int


def encode_frame(
    payload: Payload, scheme: Scheme, secret: bytes | TagKey, *, number: int = 0, epoch: int = 0
) -> tuple[int, ...]:
    """The L symbols of a message, in frame order; a scheme without framing writes a plain number.

    `number` counts messages from 0 and is carried modulo 2 ** number_bits; `epoch` enters the check alone. Raises
    MtmError when the payload is not one that the scheme carries.
    """
    framing = scheme.framing
    if framing is None:
        if isinstance(payload, bool) or not isinstance(payload, int):
            raise MtmError("this scheme's messages are plain numbers; give a number, or a key made with a framing")
        return symbols_of_number(payload, scheme)
    layout = layout_of(framing, scheme.alphabet_size, scheme.message_symbols)
    return encode_symbols([frame_data(payload, framing, secret, number, epoch)], layout)[0]


def decode_frame(symbols: Sequence[int | None], scheme: Scheme, secret: bytes | TagKey, *, epoch: int = 0) -> Frame:
    """The frame in L symbols given in frame order, None where one was not seen.

    Raises MtmError when too many are wrong or missing, and when they spell no frame or its check does not hold.
    """
    framing = scheme.framing
    if len(symbols) != scheme.message_symbols:
        raise MtmError(f"{len(symbols)} symbols given, but a message of this scheme has {scheme.message_symbols}")
    if framing is None:
        number = None if None in symbols else number_of_symbols([s for s in symbols if s is not None], scheme)
        if number is None:
            raise MtmError("the symbols spell no message of this scheme; read them again")
        return Frame(number, 0)
    data = decode_symbols(symbols, layout_of(framing, scheme.alphabet_size, scheme.message_symbols))
    frame = frame_of_data(data, framing, secret, epoch)
    if frame is None:
        raise MtmError("the symbols spell no frame of this key and epoch; read them again, or name the right epoch")
    return frame


def frame_data(payload: Payload, framing: Framing, secret: bytes | TagKey, number: int, epoch: int) -> int:
    """A frame's `data_bits` as one number: number, length field, payload, check, most significant bit first."""
    if number < 0:
        raise MtmError(f"the message's number is {number}; count from 0")
    carried = number % (1 << framing.number_bits)
    body = bits_of_payload(payload, framing)
    check = check_value(carried, body, framing, secret, epoch)
    return (carried << (framing.length_bits + framing.payload_bits) | body) << framing.check_bits | check


def frame_of_data(data: int, framing: Framing, secret: bytes | TagKey, epoch: int) -> Frame | None:
    """The inverse of `frame_data`; None when the check does not hold or no payload is written so."""
    content, check = data >> framing.check_bits, data & ((1 << framing.check_bits) - 1)
    width = framing.length_bits + framing.payload_bits
    number, body = content >> width, content & ((1 << width) - 1)
    payload = payload_of_bits(body, framing)
    if payload is None or check_value(number, body, framing, secret, epoch) != check:
        return None
    return Frame(payload, number)
