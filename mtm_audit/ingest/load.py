"""Any recording into tracks."""

from collections.abc import Callable, Sequence
from pathlib import Path

from mtm_audit.model.track import Track
from mtm_audit.readers.motion_capture import read_motion_capture
from mtm_audit.readers.text import check_readable
from mtm_audit.readers.video import read_frames
from mtm_audit.tracking.registry import tracker
from mtm_onboard.protocol.errors import MtmError

VIDEO_SUFFIXES = frozenset({".mp4", ".mov", ".m4v", ".mkv", ".webm", ".avi", ".mpg", ".mpeg", ".ts"})
# What these follow is no place in a picture, or is in a picture that a simulator drew.
_NO_CAMERA = frozenset({"arms", "football", "brightness"})


def is_video(path: Path) -> bool:
    """By its suffix, or else by its content: text is motion capture, anything else is video.

    Raises MtmError when the file is missing, empty or a folder.
    """
    check_readable(path)
    if path.suffix.lower() in VIDEO_SUFFIXES:
        return True
    with path.open("rb") as file:
        start = file.read(4096)
    return b"\0" in start


def load_tracks(
    path: Path,
    tracker_name: str = "aruco",
    warn: Callable[[str], None] | None = None,
    progress: Callable[[int], None] | None = None,
    reference: Sequence[str] = (),
) -> list[Track]:
    """Read one recording: a video through the named tracker, or a motion-capture file as it is.

    The camera's own motion is taken out, by the tracks that `reference` names or by what is found to stand still.
    `warn` receives one sentence for each thing that is wrong but leaves something to use; `progress` the number of
    frames tracked so far. Raises MtmError when the recording cannot be used.
    """
    if not is_video(path):
        return [read_motion_capture(path)]
    chosen = tracker(tracker_name, warn)
    frames = read_frames(path, chosen.pixels, warn)
    if tracker_name.partition(":")[0] in _NO_CAMERA:
        if reference:
            raise MtmError(f"the tracker {tracker_name} measures nothing against a reference; leave out --reference")
        return chosen.track(frames, progress)
    from mtm_audit.tracking.stabilise import stabilised_tracks

    return stabilised_tracks(chosen, frames, reference, warn, progress)
