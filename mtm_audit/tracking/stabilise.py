"""Taking the camera's own motion out of tracks: by markers that stand still, or else by the background."""

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from mtm_audit.model.lens import Lens
from mtm_audit.model.picture import Frame
from mtm_audit.model.pictured import Pictured
from mtm_audit.model.track import Floats, Track
from mtm_audit.tracking.background import BackgroundFollower
from mtm_audit.tracking.background_path import background_path
from mtm_audit.tracking.camera_path import CameraPath
from mtm_audit.tracking.gather import Progress
from mtm_audit.tracking.lens import check_fits, straightened_background, straightened_track
from mtm_audit.tracking.reference import FOR_HOMOGRAPHY, chosen_tracks, reference_path, still_tracks
from mtm_audit.tracking.registry import Tracker, in_picture, is_flipped

# What stands still for the background may move by so much of the camera's motion, or so many pixels.
AGREEING, AGREEING_PX = 0.1, 0.3
MOST_NAMED = 3  # of the stretches in which the camera's motion is unknown
LEAST_KNOWN = 0.8  # of the frames; a path of which less is known is not taken out
LEAST_WHOLE = 0.98  # of the frames must show enough of it


def stabilised_tracks(
    tracker: Tracker,
    frames: Iterable[Frame],
    reference: Sequence[str] = (),
    warn: Callable[[str], None] | None = None,
    progress: Progress | None = None,
    keep: Callable[[Pictured], None] | None = None,
    lens: Lens | None = None,
) -> list[Track]:
    """The tracker's tracks as a camera that stood still would have shown them; `warn` hears what was taken out.

    `keep` receives them as the pictures show them. What the `lens` distorts is straightened first.

    `reference` names tracks that stand still. Without any, those that keep their distances are the reference when
    there are enough of them, and otherwise what is behind the robots. The motion of a camera that moved by no more
    than can be told is left alone. Raises MtmError as the tracker does, and when a reference does not exist,
    or the lens is of pictures of another size.
    """
    seen = BackgroundFollower(is_needed=not reference)
    tracks = tracker.track(_looked_at(frames, seen, lens), progress)
    if keep is not None:
        keep(Pictured(tuple(tracks), seen.size, is_flipped(tracker)))
    return without_camera(tracks, seen, reference, is_flipped(tracker), warn, lens)


def without_camera(
    tracks: list[Track],
    seen: BackgroundFollower,
    reference: Sequence[str] = (),
    flipped: bool = False,
    warn: Callable[[str], None] | None = None,
    lens: Lens | None = None,
) -> list[Track]:
    """Tracks with the camera's own motion taken out, as far as the background `seen` beside them tells it.

    They are of mirrored pictures when `flipped`; the rest is as `stabilised_tracks` has it.
    """
    if any(track.unit != "px" for track in tracks):
        return tracks
    told = warn or (lambda sentence: None)
    if lens is not None:
        tracks, seen = _straightened(tracks, lens, flipped, told), straightened_background(seen, lens)
    path = _path(seen, tracks, reference, flipped, told)
    if path is None or path.is_still(tracks):
        return tracks
    told(f"the camera moved by {path.motion_px(tracks):.2g} px rms; that was taken out by {path.source}")
    if path.known < 1.0:
        told(_unknown(path, tracks[0].times_s))
    return [path.applied(track) for track in tracks]


def _straightened(tracks: list[Track], lens: Lens, flipped: bool, warn: Callable[[str], None]) -> list[Track]:
    straight = [straightened_track(track, lens, flipped=flipped) for track in tracks]
    seen, reached = (sum(int(track.valid.sum()) for track in some) for some in (tracks, straight))
    if reached < seen:
        warn(
            f"{lens.name} does not reach {1.0 - reached / seen:.1%} of the places that were seen, so that they are "
            "left out; calibrate with a board that reaches the picture's corners"
        )
    return straight


def unstabilised_tracks(
    tracker: Tracker,
    frames: Iterable[Frame],
    progress: Progress | None = None,
    keep: Callable[[Pictured], None] | None = None,
) -> list[Track]:
    """The tracker's tracks as they are; `keep` receives them where the pictures show them."""
    seen = BackgroundFollower(is_needed=False)
    tracks = tracker.track(_looked_at(frames, seen), progress)
    if keep is not None:
        keep(Pictured(tuple(in_picture(tracker, tracks)), seen.size, is_flipped(tracker)))
    return tracks


def _path(
    seen: BackgroundFollower,
    tracks: Sequence[Track],
    reference: Sequence[str],
    flipped: bool,
    warn: Callable[[str], None],
) -> CameraPath | None:
    if reference:
        return reference_path(chosen_tracks(tracks, reference), seen.size)
    background = background_path(seen, tracks, flipped)
    if background is not None and background.is_still(tracks):
        return background if background.known >= LEAST_KNOWN else None
    still = still_tracks(tracks, seen.size)
    if background is None or background.known < LEAST_KNOWN:
        if background is not None and not still:
            warn(
                f"the camera moved, and how is known in only {background.known:.0%} of the frames, so that it is not "
                "taken out; keep what stands still in the picture, or name what does with --reference"
            )
        return reference_path(still, seen.size) if still else None
    agreeing_px = max(AGREEING * background.motion_px(tracks), AGREEING_PX)
    agreeing = [track for track in still if _rms_px(background.applied(track)) < agreeing_px]
    # A path that now and then rests on fewer things leaps whenever one comes or goes.
    enough = np.sum([track.valid for track in agreeing], axis=0) >= FOR_HOMOGRAPHY
    return reference_path(agreeing, seen.size) if np.mean(enough) > LEAST_WHOLE else background


def _unknown(path: CameraPath, times_s: Floats) -> str:
    """That nothing is used of stretches in which the camera's motion is unknown, the longest of them named."""
    stretches = path.unknown_s(times_s)
    longest = sorted(stretches, key=lambda stretch: stretch[0] - stretch[1])[:MOST_NAMED]
    named = ", ".join(f"{first:.1f} to {last:.1f} s" for first, last in sorted(longest))
    return (
        f"how the camera moved is not known in {1.0 - path.known:.1%} of the frames "
        f"({named}{' and elsewhere' if len(stretches) > len(longest) else ''}): nothing is used of them; keep what "
        "stands still in the picture, or name what does with --reference"
    )


def _rms_px(track: Track) -> float:
    seen = track.positions[track.valid]
    return float(np.sqrt(np.mean(np.var(seen, axis=0)))) if len(seen) else np.inf


def _looked_at(frames: Iterable[Frame], seen: BackgroundFollower, lens: Lens | None = None) -> Iterator[Frame]:
    for frame in frames:
        if lens is not None:
            check_fits(frame, lens)
        seen.look(frame)
        yield frame
