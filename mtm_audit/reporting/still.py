"""One picture of a film, to draw tracks over."""

from contextlib import suppress
from dataclasses import dataclass
from itertools import islice

import numpy as np

from mtm_audit.ingest.films import film_frames
from mtm_audit.model.picture import Frame, Image
from mtm_audit.model.recording import Recording
from mtm_audit.tracking.region import Region, parse_region
from mtm_audit.tracking.registry import is_flipped, tracker
from mtm_onboard.protocol.errors import MtmError

# A picture in which all are in sight is looked for among so many.
_MOST_LOOKED_AT = 300
_WITH_REGION = ("flow", "brightness")
_WIDEST_PX, _QUALITY = 960, 80


@dataclass(frozen=True)
class Still:
    """A picture `image` (height, width, 3) in the order blue, green, red, at `time_s` of the recording.

    `mirrored` where the tracks are of its mirror.
    """

    image: Image
    time_s: float
    mirrored: bool = False

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        return self.image.shape[1], self.image.shape[0]

    def jpeg(self) -> bytes:
        """The picture as its tracks see it, no wider than a page needs."""
        import cv2

        image = self.image[:, ::-1] if self.mirrored else self.image
        width, height = self.size_px
        if width > _WIDEST_PX:
            small = (_WIDEST_PX, max(1, round(height * _WIDEST_PX / width)))
            image = np.asarray(cv2.resize(image, small, interpolation=cv2.INTER_AREA), dtype=np.uint8)
        _, coded = cv2.imencode(".jpg", np.ascontiguousarray(image), [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
        return coded.tobytes()


def still_of(recording: Recording, tracker_name: str | None = None) -> Still | None:
    """The first picture in which most tracks are in sight; None for what is no film of tracks in its pixels.

    With the tracker's name it is known whether it read the picture's mirror. None as well when the film cannot be read
    any more: a picture without a background is better than none.
    """
    if recording.kind != "video" or any(track.unit != "px" for track in recording.tracks):
        return None
    seen = np.sum([track.valid[:_MOST_LOOKED_AT] for track in recording.tracks], axis=0)
    number = int(np.argmax(seen))
    # A film that states no times was read at a rate that was given.
    for frame_rate_hz in (None, recording.frame_rate_hz):
        with suppress(MtmError, OSError):
            frames = film_frames(recording.paths, "bgr", lambda warning: None, frame_rate_hz)
            frame = next(islice(frames, number, None), None)
            if frame is not None:
                mirrored = tracker_name is not None and _mirrored(frame, tracker_name)
                return Still(frame.image.copy(), float(recording.tracks[0].times_s[number]), mirrored)
    return None


def region_of(tracker_name: str) -> Region | None:
    """The region in which a tracker looks, None for those that look everywhere."""
    kind, _, choice = tracker_name.partition(":")
    parts = choice.split(",")
    if kind not in _WITH_REGION or len(parts) < 4:
        return None
    return parse_region(",".join(parts[:4]))


def _mirrored(frame: Frame, tracker_name: str) -> bool:
    """Whether the tracker reads the mirror of a picture; only one that may do so is asked."""
    chosen = tracker(tracker_name)
    if not hasattr(chosen, "flipped"):
        return False
    import cv2

    gray = np.asarray(cv2.cvtColor(frame.image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    with suppress(MtmError):
        chosen.track([Frame(frame.time_s, gray)])
    return is_flipped(chosen)
