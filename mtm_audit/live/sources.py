"""What can be watched, by the name that a person gives."""

import re
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import SplitResult, urlsplit, urlunsplit

from mtm_audit.ingest.load import is_video
from mtm_audit.live.events import Event
from mtm_audit.live.films import Address, FilmSource
from mtm_audit.live.growing import growing_poses
from mtm_audit.live.poses import udp_poses
from mtm_audit.live.record import FilmRecord
from mtm_audit.model.picture import Pixels
from mtm_onboard.protocol.errors import MtmError

_STREAMS = ("rtsp", "rtsps", "http", "https", "tcp", "srt")
_OPTIONS = {"rtsp": {"rtsp_transport": "tcp"}, "rtsps": {"rtsp_transport": "tcp"}}


@dataclass(frozen=True)
class Source:
    """`shown` is how it is told to people. A film, or else poses; `is_live` when it goes on whether watched or not."""

    shown: str
    target: Address | Path | tuple[str, int]
    is_film: bool
    is_live: bool

    def events(self, pixels: Pixels, record: FilmRecord | None = None) -> Iterator[Event]:
        """What it shows, frames as `pixels`; `record` keeps a film. Raises MtmError as the source does."""
        if self.is_film:
            assert not isinstance(self.target, tuple)
            return FilmSource(self.target, pixels, record).events()
        if isinstance(self.target, Path):
            return growing_poses(self.target)
        assert isinstance(self.target, tuple)
        return udp_poses(*self.target, self.shown)


def source_of(name: str) -> Source:
    """The source of that name: `udp://HOST:PORT` for poses, an address, a camera's device or a file.

    Raises MtmError when it is none of these.
    """
    scheme = re.match(r"([A-Za-z][A-Za-z0-9+.-]*)://", name)
    if scheme is None:
        return _of_path(Path(name))
    kind, parts = scheme.group(1).lower(), _parts(name)
    if kind == "udp":
        if not parts.hostname or parts.port is None:
            raise MtmError(f"{name} names no address and port to receive at; write udp://127.0.0.1:5005")
        return Source(name, (parts.hostname, parts.port), is_film=False, is_live=True)
    if kind not in _STREAMS:
        raise MtmError(f"{kind}:// cannot be watched; name a file, a camera such as /dev/video0, udp://HOST:PORT for "
                       f"poses, or a stream of {', '.join(_STREAMS)}")  # fmt: skip
    shown = without_password(parts)
    return Source(shown, Address(name, shown, None, _OPTIONS.get(kind, {})), is_film=True, is_live=True)


def without_password(parts: SplitResult) -> str:
    """The address as it may be shown: without user and password, and what follows a question mark."""
    host = parts.netloc.rpartition("@")[2]
    return urlunsplit((parts.scheme, host, parts.path, "", ""))


def _parts(name: str) -> SplitResult:
    try:
        parts = urlsplit(name)
        _ = parts.port
    except ValueError as error:
        raise MtmError(f"the address to watch cannot be read ({error}); write it like rtsp://camera.local/stream"
                       ) from error  # fmt: skip
    return parts


def _of_path(path: Path) -> Source:
    try:
        is_device = stat.S_ISCHR(path.stat().st_mode)
    except (OSError, ValueError):
        is_device = False
    if is_device:
        return Source(str(path), Address(str(path), str(path), "v4l2"), is_film=True, is_live=True)
    return Source(str(path), path, is_film=is_video(path), is_live=False)
