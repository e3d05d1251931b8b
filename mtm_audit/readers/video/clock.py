"""When each picture of a video was taken: as the file states it, or assumed."""

import math
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from mtm_onboard.protocol.errors import MtmError

if TYPE_CHECKING:
    from av import VideoFrame
    from av.container import InputContainer
    from av.packet import Packet
    from av.video.stream import VideoStream

# Streams without a container have no times, and the library says 25 pictures a second of all of them.
WITHOUT_TIMES = frozenset(
    {
        "av1",
        "cavsvideo",
        "dirac",
        "evc",
        "h261",
        "h263",
        "h264",
        "hevc",
        "m4v",
        "mjpeg",
        "mpegvideo",
        "obu",
        "vc1",
        "vvc",
    }
)


class Clock(Protocol):
    """Sees every packet before it is decoded, then every picture that comes out."""

    def enter(self, packet: "Packet[VideoStream]") -> None:
        """Note a packet that goes into the decoder."""
        ...

    def time_s(self, picture: "VideoFrame") -> float | None:
        """When the next picture was taken; None when nothing says so."""
        ...


class StatedClock:
    """The presentation times of the file."""

    def enter(self, packet: "Packet[VideoStream]") -> None:
        """Nothing: each picture carries its time."""

    def time_s(self, picture: "VideoFrame") -> float | None:
        """The picture's own time."""
        return picture.time


class OrderClock:
    """The times of packets in the order of the file, given to pictures in the order in which they are shown.

    For AVI, which knows the order of decoding alone: with B-frames the presentation times made up for it run
    backwards. An encoder that reorders pictures by `reordered` places gives packet k + `reordered` the place of picture
    k, so that what a camera skipped stays empty where it was skipped. The first picture has the file's first time.
    """

    def __init__(self, reordered: int) -> None:
        self._waiting: deque[float] = deque()
        self._ahead = reordered
        self._entered = 0
        self._first_s = self._offset_s = self._last_s = 0.0
        self._step_s = math.inf

    def enter(self, packet: "Packet[VideoStream]") -> None:
        """Note the packet's place in the file."""
        stamp = packet.pts if packet.dts is None else packet.dts
        if not packet.size or stamp is None or packet.time_base is None:
            return
        place_s = float(stamp * packet.time_base)
        if self._entered == 0:
            self._first_s = place_s
        elif place_s > self._last_s:
            self._step_s = min(self._step_s, place_s - self._last_s)
        if self._entered == self._ahead:
            self._offset_s = place_s - self._first_s
        self._last_s = place_s
        self._entered += 1
        if self._entered > self._ahead:
            self._waiting.append(place_s)

    def time_s(self, picture: "VideoFrame") -> float | None:
        """The earliest place that no picture has yet; after the last one, where the next would be."""
        if not self._waiting:
            self._last_s += self._step_s
            return self._last_s - self._offset_s if math.isfinite(self._last_s) else picture.time
        return self._waiting.popleft() - self._offset_s


class EvenClock:
    """So many pictures a second from zero on, whatever the file says; raises MtmError when that is no rate."""

    def __init__(self, rate_hz: float) -> None:
        if not (math.isfinite(rate_hz) and rate_hz > 0.0):
            raise MtmError(f"a film of {rate_hz} pictures a second cannot be; give a number above zero")
        self._rate_hz = rate_hz
        self._count = 0

    def enter(self, packet: "Packet[VideoStream]") -> None:
        """Nothing: pictures are counted when they come out."""

    def time_s(self, picture: "VideoFrame") -> float | None:
        """The picture's number divided by the rate."""
        self._count += 1
        return (self._count - 1) / self._rate_hz


def clock_of(
    path: Path,
    container: "InputContainer",
    stream: "VideoStream",
    frame_rate_hz: float | None,
    warn: Callable[[str], None],
) -> Clock:
    """The clock for a file, even at `frame_rate_hz` unless that is None; where times are assumed `warn` is told.

    Raises MtmError when nothing says how many pictures a second a stream without times has.
    """
    if frame_rate_hz is not None:
        return EvenClock(frame_rate_hz)
    if container.format.name == "avi":
        return OrderClock(stream.codec_context.reorder_depth)
    if container.format.name not in WITHOUT_TIMES:
        return StatedClock()
    stated = stream.codec_context.framerate
    if not stated:
        raise MtmError(
            f"{path} is a bare stream that states neither times nor a rate; say with --frame-rate how many pictures a "
            "second the camera took"
        )
    warn(
        f"{path} is a bare stream without times; its pictures are taken to be even, at the {float(stated):.6g} a "
        "second that it states (--frame-rate says otherwise)"
    )
    return EvenClock(float(stated))
