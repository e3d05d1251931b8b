"""How the things in a film move, and the camera."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from mtm_audit.model.picture import Frame
from mtm_audit.model.pictured import Pictured
from mtm_audit.model.track import Floats, Track
from mtm_audit.tracking.background import BackgroundFollower
from mtm_audit.tracking.background_path import background_path
from mtm_audit.tracking.gather import steady
from mtm_audit.tracking.registry import tracker
from mtm_audit.tracking.stabilise import stabilised_tracks

# Messages lie above half a hertz, so nothing of them is left in means over two seconds.
_SLOW_S = 2.0
# A thing that goes no farther, and hardly trembles, stands still.
_STILL_PX, _STILL_FAST_PX = 3.0, 0.3


@dataclass(frozen=True, kw_only=True)
class Motion:
    """How one thing moves, the camera's motion taken out.

    `seen` is the share of the pictures that show it; `travel_px` the larger side of the box that its middle stays in,
    and `fast_px` the rms about its means over two seconds, in each direction: what is faster than half a hertz, and the
    turns of its path.
    """

    name: str
    seen: float
    travel_px: float
    fast_px: float
    has_heading: bool

    @property
    def is_still(self) -> bool:
        """Whether it stands still, as markers on the floor do."""
        return self.travel_px < _STILL_PX and self.fast_px < _STILL_FAST_PX


@dataclass(frozen=True)
class CameraMotion:
    """Whether the camera moves: `rms_px` in each direction, and what was said of it; None where nothing tells."""

    rms_px: float | None
    sentence: str

    @property
    def moves(self) -> bool:
        """Whether it moves by more than can be told."""
        return self.rms_px is not None and self.rms_px > 0.0


_STANDS = "stands still, or moves by no more than can be told"
_UNKNOWN = "nothing in the pictures tells whether it moves"


def tracked_motion(
    frames: Iterable[Frame],
    tracker_name: str,
    warn: Callable[[str], None],
    progress: Callable[[int], None] | None = None,
) -> tuple[tuple[Motion, ...], CameraMotion]:
    """The motion of what the named tracker follows, and the camera's; raises MtmError as the tracker does."""
    kept: list[Pictured] = []
    said: list[str] = []
    tracks = stabilised_tracks(tracker(tracker_name, warn), frames, (), said.append, progress, kept.append)
    raw = kept[0].tracks
    camera = CameraMotion(0.0, _STANDS)
    if any(own is not before for own, before in zip(tracks, raw, strict=True)):
        shifts_px = [_rms(own.positions - before.positions) for own, before in zip(tracks, raw, strict=True)]
        camera = CameraMotion(float(np.sqrt(np.mean(np.square(shifts_px)))), said[0] if said else "moves")
    return tuple(_motion(track) for track in tracks), camera


def camera_motion(frames: Iterable[Frame], progress: Callable[[int], None] | None = None) -> CameraMotion:
    """The camera's motion by the background alone."""
    seen = BackgroundFollower()
    for frame in steady(frames, progress):
        seen.look(frame)
    path = background_path(seen, (), flipped=False)
    if path is None:
        return CameraMotion(None, _UNKNOWN)
    middle = _resting(np.array(seen.times_s), seen.size)
    if path.is_still(middle):
        return CameraMotion(0.0, _STANDS)
    moved_px = path.motion_px(middle)
    return CameraMotion(moved_px, f"the camera moved by {moved_px:.2g} px rms, by {path.source}")


def _resting(times_s: Floats, size: tuple[int, int]) -> list[Track]:
    """A thing in the middle of the picture that does not move."""
    places = np.tile([(size[0] - 1) / 2, (size[1] - 1) / 2], (len(times_s), 1))
    return [Track("middle", times_s, places, np.ones(len(times_s), dtype=np.bool_), unit="px")]


def _motion(track: Track) -> Motion:
    seen = track.positions[track.valid]
    return Motion(
        name=track.name,
        seen=float(np.mean(track.valid)),
        travel_px=float(np.ptp(seen, axis=0).max()) if len(seen) else 0.0,
        fast_px=_fast_px(track.times_s[track.valid], seen),
        has_heading=track.headings_rad is not None and bool(np.isfinite(track.headings_rad).any()),
    )


def _fast_px(times_s: Floats, positions: Floats) -> float:
    """The rms of positions about their mean over two seconds around each."""
    if len(times_s) < 3:
        return 0.0
    first = np.searchsorted(times_s, times_s - _SLOW_S / 2)
    last = np.searchsorted(times_s, times_s + _SLOW_S / 2, side="right")
    # At the ends there is more to one side, and a steady drive would look like motion.
    whole = (times_s - times_s[0] >= _SLOW_S / 2) & (times_s[-1] - times_s >= _SLOW_S / 2)
    if not whole.any():
        return _rms(_without_drift(times_s, positions))
    sums = np.concatenate([np.zeros((1, positions.shape[1])), np.cumsum(positions - positions[0], axis=0)])
    slow = positions[0] + (sums[last] - sums[first]) / (last - first)[:, None]
    return _rms((positions - slow)[whole])


def _without_drift(times_s: Floats, positions: Floats) -> Floats:
    fitted = np.polynomial.polynomial.polyfit(times_s - times_s[0], positions, 1)
    return np.asarray(positions - np.polynomial.polynomial.polyval(times_s - times_s[0], fitted).T)


def _rms(offsets: Floats) -> float:
    known = offsets[np.isfinite(offsets).all(axis=1)]
    return float(np.sqrt(np.mean(np.var(known, axis=0)))) if len(known) else 0.0


def moving(motions: Sequence[Motion]) -> tuple[Motion, ...]:
    """Those that do not stand still."""
    return tuple(motion for motion in motions if not motion.is_still)
