"""The seal of an image: for one device, newer than the last, and with a limit for the noise. See mtm_shim.h."""

import hashlib
import hmac
import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass

from mtm_onboard.firmware.image import MAX_Q20, ONE, Image, image_bytes, parse_image
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.keystream import SECRET_BYTES

VERSION = 1
# How a sealed image begins.
SEAL_MAGIC = b"MTMS"
_HEADER = struct.Struct("<4sHHIII3I")
_TAG_BYTES = 16
_LABEL = b"\x04seal"
_LARGEST = (1 << 32) - 1


@dataclass(frozen=True, kw_only=True)
class Seal:
    """What a seal says: the device's channel, the image's counter, and the largest noise in 2**-20 on vx, vy, wz."""

    channel: int
    counter: int
    noise_limits_q20: tuple[int, int, int]


def seal_of(channel: int, counter: int, noise_limits: Sequence[float]) -> Seal:
    """A seal; the limits are in m/s, m/s, rad/s. Raises MtmError for numbers that do not fit."""
    for name, value in (("device channel", channel), ("counter", counter)):
        if not 0 <= value <= _LARGEST:
            raise MtmError(f"the {name} is {value}; choose 0 to {_LARGEST}")
    if counter == 0:
        raise MtmError("the counter is 0, above which no image's is; count from 1")
    return Seal(channel=channel, counter=counter, noise_limits_q20=_limits_q20(noise_limits))


def sealed(image: Image, seal: Seal, device_key: bytes) -> bytes:
    """The image behind its seal, as the device takes it; raises MtmError for a key of another length."""
    content = image_bytes(image)
    size = _HEADER.size + _TAG_BYTES + len(content)
    header = _HEADER.pack(SEAL_MAGIC, VERSION, 0, size, seal.channel, seal.counter, *seal.noise_limits_q20)
    return header + _tag(header, content, device_key) + content


def parse_sealed(data: bytes, device_key: bytes) -> tuple[Seal, Image]:
    """Seal and image; raises MtmError when the seal is not one of the device's key or the image is none."""
    begin = _HEADER.size + _TAG_BYTES
    if len(data) < begin or data[: len(SEAL_MAGIC)] != SEAL_MAGIC:
        raise MtmError("this is no sealed image, or only its beginning; export it again")
    _, version, nothing, size, channel, counter, *limits = _HEADER.unpack_from(data)
    if version != VERSION:
        raise MtmError(f"the seal is of version {version}, this program reads {VERSION}; export it again")
    content = data[begin:]
    tag = _tag(data[: _HEADER.size], content, device_key)
    if nothing or size != len(data) or not hmac.compare_digest(tag, data[_HEADER.size : begin]):
        raise MtmError("the seal is not one of this device's key, or something behind it was altered; export it again")
    seal = Seal(channel=channel, counter=counter, noise_limits_q20=(limits[0], limits[1], limits[2]))
    return seal, parse_image(content)


def _tag(header: bytes, content: bytes, device_key: bytes) -> bytes:
    if len(device_key) != SECRET_BYTES:
        raise MtmError(f"a device key has {SECRET_BYTES} bytes, not {len(device_key)}; make one with device-key")
    return hashlib.shake_256(device_key + _LABEL + header + content).digest(_TAG_BYTES)


def _limits_q20(limits: Sequence[float]) -> tuple[int, int, int]:
    for limit in limits:
        if not math.isfinite(limit) or not 0 <= round(limit * ONE) <= MAX_Q20:
            raise MtmError(f"the noise limit {limit} is not usable; give a number from 0 to {MAX_Q20 // ONE}")
    first, second, third = (round(limit * ONE) for limit in limits)
    return first, second, third
