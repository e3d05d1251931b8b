"""The image: one channel's message as a microcontroller plays it, without the secret.

Layout, units and limits are stated in firmware_shim/include/mtm_shim.h. Samples are int16 in units of
`step` * 2**-36 m/s (rad/s for wz): what the device adds is sigma * x[t] to within half a unit and half of 2**-20.
"""

import hashlib
import hmac
import math
import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mtm_onboard.model.velocity import AXES
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.keystream import stream
from mtm_onboard.protocol.scheme import Channel, Scheme

VERSION = 1
ONE = 1 << 20
"""Units of a command in 1 m/s or 1 rad/s."""
TAG_BYTES = 16
MAX_MESSAGES = 4096
MAX_Q20 = 1 << 30

# How the file begins.
IMAGE_MAGIC = b"MTMI"
_HEADER = struct.Struct("<4sHBBIIIIQQ8s6I16s")
_CRC = struct.Struct("<I")
_STEP_ONE = 1 << 36
_SHORTEST_STEP = 1 << 17  # two units of a command, so that rounding stays within one step
_SAMPLE_MAX = 32_767
_MAX_MESSAGE_TICKS = 1 << 20
_RATES_MHZ = (1000, 1_000_000)


@dataclass(frozen=True, eq=False, kw_only=True)
class Image:
    """Samples (axes played, ticks), int16, of `messages` messages from number `first_message` on.

    `steps` and `limits_q20` have one entry each for vx, vy, wz; a step is 0 on an axis without samples. `tag` is
    `image_tag` of the rest, or zeros.
    """

    rate_mhz: int
    message_ticks: int
    messages: int
    first_message: int
    epoch: int
    fingerprint: str
    repeats: bool
    steps: tuple[int, int, int]
    limits_q20: tuple[int, int, int]
    samples: NDArray[np.int16]
    tag: bytes = bytes(TAG_BYTES)


def channel_image(
    codebook: Codebook,
    channel_name: str,
    symbols: Sequence[int],
    *,
    limits: tuple[float, float, float],
    repeat: bool = True,
    first_message: int = 0,
    messages: int = 1,
) -> Image:
    """The channel's own `symbols` as an image, untagged; `limits` in m/s, m/s, rad/s.

    There are l_c symbols, or l_c for each message where these differ.

    Under the fixed schedule the image is one message, again and again when `repeat` is set. Under the rolling
    schedule it is `messages` messages from number `first_message` on, each window with its own waveform, and ends.
    Raises MtmError for what cannot be played or does not fit the format.
    """
    scheme = codebook.scheme
    channel = scheme.channel(channel_name)
    _check_message(scheme, channel, symbols, first_message, messages)
    windows = range(first_message * channel.symbols, (first_message + messages) * channel.symbols)
    parts = [
        codebook.samples(channel, window, [symbols[place % len(symbols)]])[0] for place, window in enumerate(windows)
    ]
    noise = np.array(channel.sigmas)[:, None] * np.concatenate(parts, axis=1)
    # The format has the axes in the order vx, vy, wz, a channel in any.
    order = sorted(range(len(channel.axes)), key=lambda row: AXES.index(channel.axes[row]))
    samples = np.empty(noise.shape, np.int16)
    steps = [0, 0, 0]
    for place, row in enumerate(order):
        step = _step(float(np.max(np.abs(noise[row]))), channel)
        samples[place] = np.clip(np.rint(noise[row] * (_STEP_ONE / step)), -_SAMPLE_MAX, _SAMPLE_MAX)
        steps[AXES.index(channel.axes[row])] = step
    return Image(
        rate_mhz=_rate_mhz(scheme.rate_hz),
        message_ticks=scheme.message_ticks,
        messages=messages,
        first_message=first_message,
        epoch=scheme.epoch,
        fingerprint=scheme.fingerprint,
        repeats=repeat and scheme.schedule == "fixed",
        steps=(steps[0], steps[1], steps[2]),
        limits_q20=(_limit_q20(limits[0]), _limit_q20(limits[1]), _limit_q20(limits[2])),
        samples=samples,
    )


def image_bytes(image: Image) -> bytes:
    """The image as the device reads it, CRC-32 included."""
    axes = sum(1 << axis for axis, step in enumerate(image.steps) if step)
    records = (number for pair in zip(image.steps, image.limits_q20, strict=True) for number in pair)
    size = _HEADER.size + image.samples.size * 2 + _CRC.size
    header = _HEADER.pack(
        IMAGE_MAGIC, VERSION, axes, image.repeats, size, image.rate_mhz, image.message_ticks, image.messages,
        image.first_message, image.epoch, bytes.fromhex(image.fingerprint), *records, image.tag,
    )  # fmt: skip
    content = header + image.samples.astype("<i2").tobytes()
    return content + _CRC.pack(zlib.crc32(content))


def parse_image(data: bytes) -> Image:
    """The image in `data`; raises MtmError when it is cut off, altered, of another version or not an image."""
    if len(data) < _HEADER.size + _CRC.size or data[: len(IMAGE_MAGIC)] != IMAGE_MAGIC:
        raise MtmError("this is not an image, or only its beginning; export it again")
    fields = _HEADER.unpack_from(data)
    _, version, axes, flags, size, rate_mhz, message_ticks, messages, first_message, epoch, fingerprint = fields[:11]
    if version != VERSION:
        raise MtmError(f"the image is of version {version}, this program reads {VERSION}; export it again")
    content = data[: -_CRC.size]
    if size != len(data) or _CRC.unpack(data[-_CRC.size :]) != (zlib.crc32(content),):
        raise MtmError("the image is cut off or altered; export it again")
    samples = np.frombuffer(content, "<i2", offset=_HEADER.size)
    rows = axes.bit_count()
    steps, limits = fields[11:17:2], fields[12:17:2]
    if not 1 <= axes <= 7 or flags > 1 or samples.size != rows * message_ticks * messages:
        raise MtmError("the image's fields contradict each other; export it again")
    return Image(
        rate_mhz=rate_mhz,
        message_ticks=message_ticks,
        messages=messages,
        first_message=first_message,
        epoch=epoch,
        fingerprint=fingerprint.hex(),
        repeats=bool(flags),
        steps=steps,
        limits_q20=limits,
        samples=samples.astype(np.int16).reshape(rows, -1),
        tag=fields[17],
    )


def tagged(image: Image, secret: bytes) -> Image:
    """The same image with the tag that only a holder of the secret can compute."""
    return replace(image, tag=_tag(image, secret))


def tag_is_good(image: Image, secret: bytes) -> bool:
    """True when the image was tagged with this secret and holds what it held then."""
    return hmac.compare_digest(image.tag, _tag(image, secret))


def _tag(image: Image, secret: bytes) -> bytes:
    """Stream "image" at the four 64-bit words of SHA-256 over the image with zeros for its tag."""
    digest = hashlib.sha256(image_bytes(replace(image, tag=bytes(TAG_BYTES)))).digest()
    return stream(secret, "image", struct.unpack("<4Q", digest), TAG_BYTES)


def _check_message(scheme: Scheme, channel: Channel, symbols: Sequence[int], first_message: int, messages: int) -> None:
    foreign = [axis for axis in channel.axes if axis not in AXES]
    if foreign:
        raise MtmError(
            f"channel {channel.name!r} has the axis {foreign[0]!r}, but an image plays only {', '.join(AXES)}; "
            "choose a channel with those"
        )
    if not 1 <= messages <= MAX_MESSAGES:
        raise MtmError(f"an image holds 1 to {MAX_MESSAGES} messages, not {messages}; export several images")
    if len(symbols) not in (channel.symbols, messages * channel.symbols):
        raise MtmError(
            f"channel {channel.name!r} sends {channel.symbols} symbols a message, not {len(symbols)}; "
            "give this channel's own part of the message"
        )
    if scheme.message_ticks > _MAX_MESSAGE_TICKS:
        raise MtmError(f"a message of {scheme.message_ticks} ticks is too long for an image; {_MAX_MESSAGE_TICKS} fit")
    if first_message < 0:
        raise MtmError(f"the first message is {first_message}; messages are counted from 0")
    if scheme.schedule == "fixed" and (messages, first_message) != (1, 0):
        raise MtmError("under the fixed schedule every message is the same; export one, and the device repeats it")


def _step(peak: float, channel: Channel) -> int:
    step = max(math.ceil(peak * _STEP_ONE / _SAMPLE_MAX), _SHORTEST_STEP)
    if step > MAX_Q20:
        raise MtmError(f"the noise of channel {channel.name!r} reaches {peak:.3g}, and 500 is the most; lower sigma")
    return step


def _rate_mhz(rate_hz: float) -> int:
    rate_mhz = round(rate_hz * 1000)
    if not math.isclose(rate_mhz, rate_hz * 1000, rel_tol=1e-9) or not _RATES_MHZ[0] <= rate_mhz <= _RATES_MHZ[1]:
        raise MtmError(f"the device's clock plays 1 to 1000 Hz in steps of 0.001 Hz, not {rate_hz}; change rate_hz")
    return rate_mhz


def _limit_q20(limit: float) -> int:
    if not math.isfinite(limit) or not 1 <= round(limit * ONE) <= MAX_Q20:
        raise MtmError(f"the limit {limit} is not usable; give a number above zero and at most {MAX_Q20 // ONE}")
    return round(limit * ONE)
