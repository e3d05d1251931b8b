"""A framed message in words: what it says, and what its check does and does not prove."""

from datetime import UTC, datetime

from mtm_audit.decoding.decoding import Decoding
from mtm_audit.decoding.frames import Delivered
from mtm_onboard.protocol.framing import Payload
from mtm_onboard.protocol.slots import slot_start_unix_s

# A motion seen later than this after its slot is told as a possible relay; cameras, plants and clocks that are kept by
# the network are together less late.
RELAY_S = 1.0


def payload_text(payload: Payload) -> str:
    """The payload as a reader sees it: a number, hexadecimal bytes, or text in quotes."""
    if isinstance(payload, bytes):
        return f"bytes {payload.hex(' ')}"
    return f'text "{payload}"' if isinstance(payload, str) else f"message {payload}"


def frame_sentences(decoding: Decoding, *, authenticates: bool = True) -> tuple[str, ...]:
    """What was delivered when, and what follows from its check; nothing for plain messages or without a message.

    `authenticates` False leaves out what a tag would prove: what the verdict rests on is not enough for that.
    """
    if decoding.verdict != "decoded" or not decoding.frames:
        return ()
    earlier = [
        f"Before it: {_said(frame)}, from {frame.start_s:.1f} to {frame.end_s:.1f} s."
        for frame in decoding.frames[:-1]
        if frame.message.payload is not None
    ]
    proof = (proof_sentence(decoding),) if authenticates or decoding.frames[-1].message.check != "tag" else ()
    return (*earlier, *proof)


def proof_sentence(decoding: Decoding) -> str:
    """What the last message's check proves, and what not."""
    message = decoding.frames[-1].message
    chance = f"a wrong message passes with a probability below {message.false_acceptance:.1g}"
    if message.check == "none":
        return f"No check: the frame is the likeliest one, with probability {message.posterior:.4f}."
    if message.check == "crc":
        return f"Its {message.check_bits}-bit CRC holds ({chance}). It shows no more than that nothing was misread."
    proof = f"Authenticated: its {message.check_bits}-bit tag holds ({chance}), so whoever made this motion had the key"
    if decoding.scheme.schedule == "rolling":
        return (
            f"{proof}, and made it for the time slot that began at {slot_time(decoding)}. It does not prove who held "
            "the key, nor that the recording's time is right."
        )
    return (
        f"Its {message.check_bits}-bit tag holds ({chance}), so whoever wrote this message had the key. It does not "
        "prove who held the key, nor when it was sent, nor by which robot."
    )


def slot_time(decoding: Decoding) -> str:
    """When the last message's first slot began, in UTC."""
    unix_s = slot_start_unix_s(decoding.frames[-1].slots[0], decoding.scheme)
    return datetime.fromtimestamp(unix_s, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")


def late_s(decoding: Decoding) -> float | None:
    """How long after its slot the motion was seen, by the recording's time as given; below zero before it.

    None under the fixed schedule, without a message and without a time.
    """
    at, scheme = decoding.settings.at, decoding.scheme
    onsets_s = [item.reading.timing.onset_s for item in decoding.channels if item.reading is not None]
    if scheme.schedule == "fixed" or at is None or decoding.verdict == "absent":
        return None
    nominal_s = slot_start_unix_s(decoding.start.first_slot, scheme) - at.unix_s
    return sorted(onset_s - nominal_s for onset_s in onsets_s)[len(onsets_s) // 2]


def clock_sentence(decoding: Decoding) -> str | None:
    """How far the recording's clock was from the robot's, and what else that may be; None where `late_s` is."""
    off_s = late_s(decoding)
    if off_s is None:
        return None
    way = "behind" if off_s < 0.0 else "ahead of"
    apart = f"By the robot's clock the recording's time, as given, is {abs(off_s):.2f} s {way} UTC."
    if off_s < RELAY_S:
        return apart
    return (
        f"{apart} Or it could be a relay of {off_s:.0f} s: a motion that was seen in its time and played again so much "
        f"later reads the same. Where both clocks are known to be synchronised, --at-error 2 rules out longer ones."
    )


def _said(frame: Delivered) -> str:
    payload = frame.message.payload
    return "nothing" if payload is None else payload_text(payload)
