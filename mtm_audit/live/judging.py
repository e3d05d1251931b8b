"""One look: what the tracks of a watch up to an instant say under the key, the look itself paid for."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mtm_audit.decoding.assignment import assign_tracks
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.decoding import Decoding
from mtm_audit.decoding.leaps import without_leaps
from mtm_audit.decoding.paid import paid_for
from mtm_audit.decoding.readings import usable_glimpses
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.decoding.start import start_of
from mtm_audit.decoding.views import view_strengths
from mtm_audit.detectors import make_detector
from mtm_audit.live.looks import Look
from mtm_audit.model.lens import Lens
from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.track import Track
from mtm_audit.tracking.background import BackgroundFollower
from mtm_audit.tracking.ground_plane import from_above
from mtm_audit.tracking.stabilise import without_camera
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.key import Key

# A glance, for clocks that are near their rate, must show this part of what the look needs to be worth the whole.
_WORTH_LOOKING = 0.5
# So many looks at most are left at a glance, so that a clock that is far off is found as well.
WHOLE_EVERY = 8


@dataclass(frozen=True)
class Seen:
    """What a watch had seen when it was looked at; `background` tells how the camera moved, None without one.

    Tracks of mirrored pictures are `flipped`, and `reference` names those that stand still. `at` is when the watch's
    own clock stood at zero, None where the settings of the decode say so. `lens` is what showed the tracks.
    """

    tracks: tuple[Track, ...]
    background: BackgroundFollower | None = None
    flipped: bool = False
    reference: tuple[str, ...] = ()
    at: RecordedAt | None = None
    lens: Lens | None = None


@dataclass(frozen=True)
class Judged:
    """What a look gave: `decoding`, paid for; None where a glance showed too little for more, or with a `refusal`.

    `tracks` are those that were read, the camera's motion taken out, and `warnings` say what was done to them.
    `cost_s` is how long it took.
    """

    look: Look
    decoding: Decoding | None
    tracks: tuple[Track, ...] = ()
    refusal: str | None = None
    warnings: tuple[str, ...] = ()
    cost_s: float = field(default=0.0, compare=False)


def judge(look: Look, seen: Seen, key: Key, settings: DecodeSettings) -> Judged:
    """Decode what was seen as any recording is, and pay for the look.

    Only "absent" follows from a glance, so that leaving the rest out makes no verdict wrong.
    """
    begun_s = time.perf_counter()
    return replace(_judged(look, seen, key, settings), cost_s=time.perf_counter() - begun_s)


def _judged(look: Look, seen: Seen, key: Key, settings: DecodeSettings) -> Judged:
    if seen.at is not None:
        settings = replace(settings, at=seen.at)
    warnings: list[str] = []
    tracks = list(seen.tracks)
    try:
        if seen.background is not None:
            tracks = without_camera(tracks, seen.background, seen.reference, seen.flipped, warnings.append, seen.lens)
            tracks = from_above(tracks, seen.background.size, seen.lens, warnings.append, flipped=seen.flipped)
        if look.number % WHOLE_EVERY and not _is_worth_looking(look, tracks, key, settings):
            return Judged(look, None, tuple(tracks), None, tuple(warnings))
        decoding = paid_for(decode_tracks(tracks, key, settings), look.choices)
    except MtmError as refusal:
        return Judged(look, None, tuple(tracks), str(refusal), tuple(warnings))
    return Judged(look, decoding, tuple(tracks), None, tuple(warnings))


def _is_worth_looking(look: Look, tracks: Sequence[Track], key: Key, settings: DecodeSettings) -> bool:
    """Whether the search for usual clocks shows enough; always where names leave open which track is which."""
    scheme = key.scheme
    assignment = assign_tracks(scheme, tracks, settings.assignment)
    if assignment.unsettled:
        return True
    start = start_of(scheme, tracks, settings.onset_s, settings.at)
    detector, codebooks = make_detector(settings.detector, settings.profile), [key.codebook(start.first_slot)]
    total = 0.0
    for channel in scheme.channels:
        (glimpse,), _ = usable_glimpses([without_leaps(assignment.settled[channel.body]).track], scheme.rate_hz)
        strengths = view_strengths(detector, codebooks, [channel], [glimpse], start.onset, usual_rates=True)
        total += max(0.0, float(np.nan_to_num(strengths[0, 0, 0])))
    return total >= _WORTH_LOOKING * math.log(look.choices / settings.threshold)
