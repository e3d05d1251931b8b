"""Films that are being shot: a camera, a network stream, or a file that grows, as frames with times of the watch."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mtm_audit.live.events import Event, Notice
from mtm_audit.live.growing import PATIENCE_S, GrowingFile
from mtm_audit.live.record import FilmRecord
from mtm_audit.live.timeline import Timeline
from mtm_audit.model.picture import Frame, Pixels
from mtm_audit.readers.video.clock import WITHOUT_TIMES
from mtm_audit.readers.video.opened import decoding_errors, film_of
from mtm_audit.readers.video.pixels import image_of
from mtm_onboard.protocol.errors import MtmError

if TYPE_CHECKING:
    from av import VideoFrame
    from av.container import InputContainer
    from av.packet import Packet
    from av.video.stream import VideoStream

_OPEN_S, _READ_S = 10.0, 5.0
_FIRST_WAIT_S, _LONGEST_WAIT_S = 0.5, 30.0
# Pictures of these come without times, and the library makes some up.
_ARRIVING = WITHOUT_TIMES | {"mpjpeg"}
# What an address may lead to; a stream that names files of this machine is not followed.
_PROTOCOLS = "tcp,udp,rtp,rtsp,http,https,httpproxy,tls,crypto,srt"


@dataclass(frozen=True)
class Address:
    """What the library opens; `shown` is how it is told to people, without a password."""

    url: str
    shown: str
    format: str | None = None
    options: dict[str, str] = field(default_factory=dict)


@dataclass
class _Connection:
    """How far one connection came."""

    pictures: int = 0
    begun: bool = False


@dataclass
class FilmSource:
    """Frames of `pixels` from an address that may drop, or from a file that may grow, for as long as they come.

    A dropped connection is opened again, after pauses that double up to half a minute; what was missed stays unseen.
    `record` keeps every packet. Raises MtmError when the first connection cannot be made, or holds no film.
    """

    address: Address | Path
    pixels: Pixels
    record: FilmRecord | None = None
    patience_s: float = PATIENCE_S
    clock: Callable[[], float] = time.monotonic
    sleep: Callable[[float], None] = time.sleep
    timeline: Timeline = field(init=False)

    def __post_init__(self) -> None:
        self.timeline = Timeline(is_live=isinstance(self.address, Address))

    def events(self) -> Iterator[Event]:
        """All frames, and what there is to say."""
        if isinstance(self.address, Path):
            with GrowingFile(self.address, self.patience_s, self.sleep) as file:
                yield from self._frames(_opened(file, str(self.address), None, {}), str(self.address), _Connection())
            return
        yield from self._connections(self.address)

    def _connections(self, address: Address) -> Iterator[Event]:
        wait_s, is_first, is_told = _FIRST_WAIT_S, True, False
        while True:
            connection = _Connection()
            try:
                container = _opened(address.url, address.shown, address.format, _options(address))
                if is_told:
                    yield Notice(f"{address.shown} is back")
                    is_told = False
                yield from self._frames(container, address.shown, connection)
            except MtmError:
                if is_first:
                    raise
            if is_first and not connection.pictures:
                raise MtmError(f"{address.shown} shows no picture that can be decoded; check what it sends")
            if connection.pictures:
                wait_s = _FIRST_WAIT_S
            if not is_told:
                yield Notice(f"{address.shown} has dropped; it is opened again until it is back")
                is_told = True
            is_first = False
            self.sleep(wait_s)
            wait_s = min(2.0 * wait_s, _LONGEST_WAIT_S)
            self.timeline.begin_connection()

    def _frames(self, container: "InputContainer", shown: str, connection: _Connection) -> Iterator[Event]:
        """The frames of one connection, up to its end or the first damage that the decoder does not get over."""
        with container:
            stream = film_of(shown, container)
            stream.codec_context.thread_count = 1
            # What the decoder patches up looks plausible and is wrong.
            stream.codec_context.options = {"err_detect": "explode"}
            is_stamped = container.format.name not in _ARRIVING
            if not is_stamped:
                yield Notice(f"{shown} states no times; pictures are taken to be made when they arrive")
            try:
                for packet in container.demux(stream):
                    yield from self._decoded(packet, connection, is_stamped)
            except decoding_errors() as error:
                if isinstance(self.address, Path):
                    yield Notice(f"{shown} cannot be read further ({error}); what comes after is unseen")

    def _decoded(self, packet: "Packet[VideoStream]", connection: _Connection, is_stamped: bool) -> Iterator[Event]:
        connection.begun = connection.begun or packet.is_keyframe
        if not connection.begun:
            return
        now_s = self.clock()
        stamp = packet.pts if packet.pts is not None else packet.dts
        shift_s = None
        if stamp is not None and packet.time_base is not None:
            stamp_s = float(stamp * packet.time_base)
            shift_s = self.timeline.offset_s(stamp_s if is_stamped else now_s, now_s)
            shift_s += 0.0 if is_stamped else now_s - stamp_s
        pictures = self._pictures(packet, connection)
        if self.record is not None and packet.size and shift_s is not None:
            self.record.put(packet, shift_s)
        for picture in pictures:
            connection.pictures += 1
            time_s = self.timeline.time_s(picture.time if is_stamped else None, now_s)
            if time_s is not None:
                yield Frame(time_s, image_of(picture, self.pixels))

    def _pictures(self, packet: "Packet[VideoStream]", connection: _Connection) -> list["VideoFrame"]:
        """What comes out of the decoder; after damage on the way nothing, until a picture that needs no other."""
        try:
            pictures = packet.decode()
        except decoding_errors():
            if isinstance(self.address, Path):
                raise
            connection.begun = False
            return []
        whole = [picture for picture in pictures if not picture.is_corrupt]
        connection.begun = connection.begun and len(whole) == len(pictures)
        return whole


def _options(address: Address) -> dict[str, str]:
    return address.options if address.format is not None else {"protocol_whitelist": _PROTOCOLS, **address.options}


def _opened(source: Any, shown: str, container_format: str | None, options: dict[str, str]) -> "InputContainer":
    import av

    try:
        timeout = (_OPEN_S, _READ_S) if isinstance(source, str) else None
        container: InputContainer = av.open(source, format=container_format, options=options, timeout=timeout)
    except decoding_errors() as error:
        raise MtmError(f"cannot watch {shown}: {_reason(error)}; check that it is there and sends a film") from error
    return container


def _reason(error: Exception) -> str:
    return str(getattr(error, "strerror", None) or "it is no film that can be read")
