"""Between a message and the symbols on the channels: plain numbers, and frames with a check and a code."""

from mtm_onboard.protocol.framing.frame import Frame, decode_frame, encode_frame
from mtm_onboard.protocol.framing.framing import Framing
from mtm_onboard.protocol.framing.order import frame_order
from mtm_onboard.protocol.framing.payload import Payload
from mtm_onboard.protocol.framing.symbols import (
    channel_symbols,
    check_symbols,
    number_of_symbols,
    payload_bits,
    symbols_of_number,
)

__all__ = [
    "Frame",
    "Framing",
    "Payload",
    "channel_symbols",
    "check_symbols",
    "decode_frame",
    "encode_frame",
    "frame_order",
    "number_of_symbols",
    "payload_bits",
    "symbols_of_number",
]
