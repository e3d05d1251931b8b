"""MAVLink 2 messages to bytes and back, signed if a key is given; pymavlink does it, and is imported when used."""

from collections.abc import Callable
from typing import Any

from mtm_onboard.links.mavlink_signing import signing_timestamp
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.installing import install_command


def dialect() -> Any:
    """The module of MAVLink's common messages; raises MtmError when pymavlink is missing."""
    try:
        from pymavlink.dialects.v20 import common
    except ImportError:
        raise MtmError(
            f"MAVLink needs pymavlink, which is not installed; install it with: {install_command('mavlink')}"
        ) from None
    return common


class MavlinkCodec:
    """One end of a link, as system `system_id` and component `component_id`.

    With a `signing_key` everything sent is signed, and what comes unsigned, wrongly signed or replayed is refused and
    counted in `refused_signatures`; other damage is counted in `bad_frames`. `timestamp` gives the signature's time.
    Encoding and decoding may happen in two threads, each in one.
    """

    def __init__(
        self,
        system_id: int,
        component_id: int,
        signing_key: bytes | None = None,
        timestamp: Callable[[], int] = signing_timestamp,
    ) -> None:
        self.messages = dialect()
        self.bad_frames = 0
        self.refused_signatures = 0
        self._timestamp = timestamp
        self._is_signed = signing_key is not None
        self._encoder = self.messages.MAVLink(None, system_id, component_id)
        self._decoder = self.messages.MAVLink(None)
        self._decoder.robust_parsing = True
        if signing_key is not None:
            self._encoder.signing.sign_outgoing = True
            self._encoder.signing.secret_key = self._decoder.signing.secret_key = signing_key
            self._check_signature = self._decoder.check_signature
            self._decoder.check_signature = self._signature_is_good

    def encode(self, message: Any) -> bytes:
        """One frame, numbered and signed."""
        encoder = self._encoder
        if self._is_signed:
            # Never behind the clock, nor behind what the other end was seen to count.
            signing = encoder.signing
            signing.timestamp = max(signing.timestamp, self._timestamp(), self._decoder.signing.timestamp)
        frame: bytes = message.pack(encoder)
        encoder.seq = (encoder.seq + 1) % 256
        return frame

    def decode(self, data: bytes) -> list[Any]:
        """Every message that `data` completes; what is damaged, refused or unknown is left out."""
        decoder = self._decoder
        if self._is_signed:
            decoder.signing.timestamp = max(decoder.signing.timestamp, self._timestamp())
        found = []
        message = decoder.parse_char(data)
        while message is not None:
            kind = message.get_type()
            if kind == "BAD_DATA":
                is_refused = message.reason == "Invalid signature"
                self.refused_signatures += is_refused
                self.bad_frames += not is_refused
            elif not kind.startswith("UNKNOWN_"):
                found.append(message)
            message = decoder.parse_char(b"")
        # pymavlink keeps what it has read until nothing is left over, which on a busy line may be never.
        del decoder.buf[: decoder.buf_index]
        decoder.buf_index = 0
        return found

    def _signature_is_good(self, frame: bytearray, system_id: int, component_id: int) -> bool:
        """The check that pymavlink makes, after which a forged frame has not moved its stream's time on.

        Otherwise one forged frame from the far future would have every true one refused as a replay.
        """
        streams = dict(self._decoder.signing.stream_timestamps)
        is_good: bool = self._check_signature(frame, system_id, component_id)
        if not is_good:
            self._decoder.signing.stream_timestamps = streams
        return is_good
