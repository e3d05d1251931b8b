"""Keeping what was watched, so that it can be decoded: the film as it came, or one table of poses a body."""

import math
import re
import threading
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self, TextIO

from mtm_audit.live.events import Pose
from mtm_onboard.protocol.errors import MtmError

if TYPE_CHECKING:
    from av.container import OutputContainer
    from av.packet import Packet
    from av.video.stream import VideoStream

# Finer than any camera's own, which may be a whole twenty-fifth of a second.
_TICK = Fraction(1, 90_000)
_HEADER = "time_s,x,y,yaw\n"


def new_folder(folder: Path) -> Path:
    """Make the folder to record into; raises MtmError when it exists or cannot be made."""
    try:
        folder.mkdir(parents=True)
    except FileExistsError as error:
        raise MtmError(f"{folder} exists already; choose another folder or remove it first") from error
    except OSError as error:
        raise MtmError(f"cannot make {folder}: {error.strerror}; choose a folder that is writable") from error
    return folder


class FilmRecord:
    """Packets as they came, in Matroska, at times of the watch: `film1.mkv`, and another for each time that the stream
    changes its coding, which no file can hold two of.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        # What is read in a thread may come while the watch ends.
        self._lock, self._is_closed = threading.Lock(), False
        self._output: OutputContainer | None = None
        self._stream: VideoStream | None = None
        self._coding: tuple[object, ...] = ()
        self._last = -math.inf
        self.files: list[Path] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def put(self, packet: "Packet[VideoStream]", shift_s: float) -> None:
        """Write a packet, its times moved by `shift_s`; one without times is left out, and what comes after the end."""
        with self._lock:
            if not self._is_closed:
                self._put(packet, shift_s)

    def close(self) -> None:
        """Finish the file, and take nothing more."""
        with self._lock:
            self._is_closed = True
            self._finish()

    def _put(self, packet: "Packet[VideoStream]", shift_s: float) -> None:
        if packet.dts is None or packet.pts is None or packet.time_base is None:
            return
        self._begin_file_for(packet)
        assert self._output is not None
        assert self._stream is not None
        dts, pts = (round((stamp * packet.time_base + Fraction(shift_s)) / _TICK) for stamp in (packet.dts, packet.pts))
        # After a gap decoding times may reach back before it, and have to rise.
        if dts <= self._last:
            return
        self._last = dts
        packet.time_base, packet.dts, packet.pts = _TICK, dts, pts
        packet.stream = self._stream
        try:
            self._output.mux(packet)
        except OSError as error:
            raise MtmError(f"cannot write {self.files[-1]}: {error.strerror}; make room and watch again") from error

    def _finish(self) -> None:
        if self._output is not None:
            self._output.close()
            self._output = None

    def _begin_file_for(self, packet: "Packet[VideoStream]") -> None:
        stream = packet.stream
        context = stream.codec_context
        coding = (context.name, context.width, context.height, context.extradata)
        if self._output is not None and coding == self._coding:
            return
        import av

        self._finish()
        self.files.append(self._folder / f"film{len(self.files) + 1}.mkv")
        try:
            self._output = av.open(str(self.files[-1]), "w", format="matroska")
            self._stream = self._output.add_stream_from_template(stream)
        except (av.FFmpegError, OSError, ValueError) as error:
            raise MtmError(f"what comes cannot be written to {self.files[-1]} ({error}); leave --record out") from error
        self._coding, self._last = coding, -math.inf


class PoseRecord:
    """One table a body, `<name>.csv`, as decode reads it."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._files: dict[str, TextIO] = {}
        self._taken: set[str] = set()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for file in self._files.values():
            file.close()

    def put(self, pose: Pose) -> None:
        """Write a pose."""
        file = self._files.get(pose.name)
        if file is None:
            # Line by line, so that what was seen is there whatever happens.
            file = self._files[pose.name] = (self._folder / self._file_name(pose.name)).open(
                "w", encoding="utf-8", buffering=1
            )
            file.write(_HEADER)
        file.write(",".join(_cell(value) for value in (pose.time_s, pose.x, pose.y, pose.heading_rad)) + "\n")

    def _file_name(self, name: str) -> str:
        """A file name that no other body has, and that leads into no other folder."""
        plain = re.sub(r"[^\w .()+=@-]", "_", name).strip(" .") or "body"
        number, unique = 1, plain
        while unique.lower() in self._taken:
            number += 1
            unique = f"{plain}-{number}"
        self._taken.add(unique.lower())
        return f"{unique}.csv"


def _cell(value: float) -> str:
    return "" if value != value else repr(value)
