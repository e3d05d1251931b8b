"""A message's payload as a whole number of bits: an integer, bytes or text."""

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.framing.framing import Framing

Payload = int | bytes | str


def bits_of_payload(payload: Payload, framing: Framing) -> int:
    """Length field and payload as one number, most significant bit first: length_bits + payload_bits wide.

    Bytes and text (as UTF-8) come with their length less one and are padded with zero bytes. Raises MtmError when the
    payload is of another kind than the framing's, empty, too long, or text that cannot be printed.
    """
    if framing.payload == "integer":
        return _bits_of_integer(payload, framing)
    content = _bytes_of_text(payload) if framing.payload == "text" else payload
    if not isinstance(content, bytes):
        raise MtmError(f"this scheme's messages are bytes, not {_kind(payload)}; give bytes")
    most = framing.payload_bits // 8
    if not 1 <= len(content) <= most:
        size = f"{len(content)} bytes long" if content else "empty"
        raise MtmError(f"the message is {size}; this scheme carries 1 to {most} bytes")
    return (len(content) - 1) << framing.payload_bits | int.from_bytes(content.ljust(most, b"\0"), "big")


def payload_of_bits(bits: int, framing: Framing) -> Payload | None:
    """The inverse of `bits_of_payload`; None when no payload is written so."""
    if framing.payload == "integer":
        return bits
    most = framing.payload_bits // 8
    length = (bits >> framing.payload_bits) + 1
    padded = (bits & ((1 << framing.payload_bits) - 1)).to_bytes(most, "big")
    if length > most or any(padded[length:]):
        return None
    if framing.payload == "bytes":
        return padded[:length]
    try:
        text = padded[:length].decode("utf-8")
    except UnicodeDecodeError:
        return None
    return text if text.isprintable() else None


def _bits_of_integer(payload: Payload, framing: Framing) -> int:
    if isinstance(payload, bool) or not isinstance(payload, int):
        raise MtmError(f"this scheme's messages are whole numbers, not {_kind(payload)}; give a number")
    limit = 1 << framing.payload_bits
    if not 0 <= payload < limit:
        raise MtmError(
            f"the message {payload} does not fit: this scheme carries {framing.payload_bits} bits, 0 to {limit - 1}"
        )
    return payload


def _bytes_of_text(payload: Payload) -> bytes:
    if not isinstance(payload, str):
        raise MtmError(f"this scheme's messages are text, not {_kind(payload)}; give text")
    # Text goes to terminals and reports as it is, so it must not hold what controls them. Lone surrogates, which
    # UTF-8 cannot encode, are not printable either.
    if not payload.isprintable():
        raise MtmError("the message holds characters that cannot be printed; leave them out, or use bytes")
    return payload.encode("utf-8")


def _kind(payload: object) -> str:
    names: dict[type, str] = {int: "a number", bytes: "bytes", str: "text"}
    return names.get(type(payload), type(payload).__name__)
