"""The pictures of a video in the order in which they are shown."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mtm_audit.model.picture import Frame, Pixels
from mtm_audit.readers.video.clock import Clock, clock_of
from mtm_audit.readers.video.header import announced_duration_s
from mtm_audit.readers.video.opened import decoding_errors, opened_video
from mtm_audit.readers.video.orientation import Orientation, orientation_of
from mtm_audit.readers.video.pixels import image_of
from mtm_onboard.protocol.errors import MtmError

if TYPE_CHECKING:
    from av import VideoFrame
    from av.container import InputContainer
    from av.packet import Packet
    from av.video.stream import VideoStream

# What muxers round, and a last picture that is shown longer than it says.
_END_SLACK_S = 0.5


@dataclass
class _Progress:
    """How far the decoder came, and what kept it from the end."""

    end_s: float = -math.inf
    damage: str | None = None


def read_frames(
    path: Path,
    pixels: Pixels = "gray",
    warn: Callable[[str], None] | None = None,
    frame_rate_hz: float | None = None,
) -> Iterator[Frame]:
    """Decode a video lazily, in order of presentation and turned as players turn it, with the time stamps of the file.

    `frame_rate_hz` replaces those by even ones.

    A file that breaks off or turns corrupt yields the frames before the break, then calls `warn` with one sentence.
    What the container leaves out on purpose is no damage. Frames without a time that comes after the one before are
    left out and counted in a warning. Images are views of the decoder's memory and must not be written to. Raises
    MtmError when the file is missing, empty, a folder, no video, states no times where it must, or not one frame of it
    can be decoded.
    """
    say = warn or (lambda sentence: None)
    decoded = untimed = 0
    last_s = -math.inf
    progress = _Progress()
    orientation: Orientation | None = None
    with opened_video(path) as (container, stream):
        clock = clock_of(path, container, stream, frame_rate_hz, say)
        for picture in _pictures(container, stream, clock, progress):
            if orientation is None:
                orientation = _orientation(path, picture, say)
            decoded += 1
            time_s = clock.time_s(picture)
            if time_s is None or time_s <= last_s:
                untimed += 1
                continue
            last_s = time_s
            yield Frame(last_s, orientation.shown(image_of(picture, pixels)))
        if progress.damage is None:
            progress.damage = _missing_end(container, stream, progress.end_s)
    if not decoded:
        raise MtmError(f"{path} holds no picture that can be decoded; copy it again or record it anew")
    if progress.damage is not None:
        used = f"only the {decoded} frames before that are used"
        say(f"{path} is damaged after {last_s:.3f} s ({progress.damage}); {used}")
    if untimed:
        say(f"{untimed} frames of {path} have no time stamp that comes after the one before; they are left out")


def _pictures(
    container: "InputContainer", stream: "VideoStream", clock: Clock, progress: _Progress
) -> Iterator["VideoFrame"]:
    """All pictures up to the end or to the first damage, from the first one that needs no other."""
    begun = False
    try:
        for packet in container.demux(stream):
            begun = begun or packet.is_keyframe
            if not begun:
                continue
            clock.enter(packet)
            progress.end_s = max(progress.end_s, _end_s(packet))
            for picture in packet.decode():
                if picture.is_corrupt:
                    progress.damage = "a frame is corrupt"
                    return
                yield picture
    except decoding_errors() as error:
        progress.damage = str(error)


def _end_s(packet: "Packet[VideoStream]") -> float:
    """When the packet's picture ends, by the file; minus infinity when it does not say."""
    stamps = [stamp for stamp in (packet.pts, packet.dts) if stamp is not None]
    if not packet.size or not stamps or packet.time_base is None:
        return -math.inf
    return float((max(stamps) + (packet.duration or 0)) * packet.time_base)


def _missing_end(container: "InputContainer", stream: "VideoStream", end_s: float) -> str | None:
    """That the stream is shorter than its header says; None when it is not, or says nothing.

    Announced frames are no measure: what an edit list hides and what a camera skipped count among them.
    """
    announced_s = announced_duration_s(stream)
    if container.format.name == "avi" and stream.frames and stream.average_rate:
        # A cut AVI has lost its index, and its duration is then guessed from what is left.
        announced_s = float(stream.frames / stream.average_rate)
    if announced_s is None or not math.isfinite(end_s):
        return None
    start_s = float(stream.start_time * stream.time_base) if stream.start_time and stream.time_base else 0.0
    missing_s = start_s + announced_s - end_s
    return f"the last {missing_s:.1f} s of {announced_s:.1f} s are missing" if missing_s > _END_SLACK_S else None


def _orientation(path: Path, picture: "VideoFrame", say: Callable[[str], None]) -> Orientation:
    found = orientation_of(picture)
    if found is None:
        say(f"{path} asks players to turn it by an odd angle; it is read unturned")
    return found or Orientation()
