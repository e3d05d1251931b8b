"""Any recording into tracks."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from mtm_audit.model.lens import Lens
from mtm_audit.model.picture import Frame
from mtm_audit.model.pictured import Pictured
from mtm_audit.model.track import Track
from mtm_audit.readers.logs.opening import opening_of
from mtm_audit.readers.logs.registry import check_foreign, format_of, read_log
from mtm_audit.readers.text import check_readable
from mtm_audit.readers.video import read_frames
from mtm_audit.tracking.registry import tracker
from mtm_onboard.protocol.errors import MtmError

VIDEO_SUFFIXES = frozenset(
    {".264", ".265", ".3gp", ".avi", ".h264", ".h265", ".hevc", ".ivf", ".m2ts", ".m4v", ".mjpeg", ".mjpg", ".mkv"}
    | {".mov", ".mp4", ".mpeg", ".mpg", ".mts", ".mxf", ".obu", ".ogv", ".ts", ".vob", ".webm", ".wmv", ".y4m"}
)
# What these follow is no place in a picture, or is in a picture that a simulator drew.
_NO_CAMERA = frozenset({"arms", "football", "brightness"})


def is_video(path: Path) -> bool:
    """By its suffix, or else by its content: what is neither text nor a known log is video.

    Raises MtmError when the file is missing, empty or a folder, or of a format that is known not to be read.
    """
    check_readable(path)
    if path.suffix.lower() in VIDEO_SUFFIXES:
        return True
    opening = opening_of(path)
    if opening.is_text or format_of(opening) is not None:
        return False
    check_foreign(opening)
    return True


def load_tracks(
    path: Path,
    tracker_name: str = "aruco",
    warn: Callable[[str], None] | None = None,
    progress: Callable[[int], None] | None = None,
    reference: Sequence[str] = (),
    lens: Lens | None = None,
) -> list[Track]:
    """Read one recording: a video through the named tracker, or a log or motion-capture file as it is.

    What the `lens` of a film distorts is straightened. The camera's own motion is taken out, by the tracks that
    `reference` names or by what is found to stand still. `warn` receives one sentence for each thing that is wrong but
    leaves something to use; `progress` the number of frames tracked so far. Raises MtmError when the recording cannot
    be used.
    """
    if not is_video(path):
        return list(read_log(path, warn=warn).tracks)
    pixels = tracker(tracker_name).pixels
    return tracked(read_frames(path, pixels, warn), tracker_name, reference, warn, progress, lens=lens)


def tracked(
    frames: Iterable[Frame],
    tracker_name: str,
    reference: Sequence[str] = (),
    warn: Callable[[str], None] | None = None,
    progress: Callable[[int], None] | None = None,
    keep: Callable[[Pictured], None] | None = None,
    lens: Lens | None = None,
) -> list[Track]:
    """The tracks in frames, the camera's own motion taken out; `keep` receives them with it. See `load_tracks`.

    What the `lens` distorts is straightened, and markers are told as seen from above; raises MtmError when the lens is
    of pictures of another size.
    """
    from mtm_audit.tracking.ground_plane import from_above
    from mtm_audit.tracking.stabilise import stabilised_tracks, unstabilised_tracks

    chosen = tracker(tracker_name, warn)
    if tracker_name.partition(":")[0] in _NO_CAMERA:
        if reference:
            raise MtmError(f"the tracker {tracker_name} measures nothing against a reference; leave out --reference")
        if lens is not None:
            raise MtmError(f"the tracker {tracker_name} reads what no lens showed; leave out --camera")
        return unstabilised_tracks(chosen, frames, progress, keep)
    kept: list[Pictured] = []
    tracks = stabilised_tracks(chosen, frames, reference, warn, progress, kept.append, lens)
    if keep is not None:
        keep(kept[0])
    return from_above(tracks, kept[0].size, lens, warn, flipped=kept[0].flipped)
