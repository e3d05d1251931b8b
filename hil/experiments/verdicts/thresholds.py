"""One recording's verdicts at several thresholds."""

from collections.abc import Sequence
from dataclasses import replace

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.decoding import Decoding
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.decoding.verdict import judged
from mtm_audit.model.track import Track
from mtm_onboard.protocol import Key

THRESHOLDS = (0.1, 0.01, 1e-4)


def decode_at(
    tracks: Sequence[Track], key: Key, settings: DecodeSettings, thresholds: Sequence[float] = THRESHOLDS
) -> list[Decoding]:
    """The decoding of a plain message at each threshold, as `decode_tracks` gives it.

    It is decoded once, at the strictest, and judged at the others; and decoded anew only where another threshold could
    have led to another association: which tracks are exchanged on trial follows from which symbols are in doubt.
    """
    strictest = decode_tracks(tracks, key, replace(settings, threshold=min(thresholds)))
    return [_at(threshold, strictest, tracks, key, settings) for threshold in thresholds]


def _at(threshold: float, strictest: Decoding, tracks: Sequence[Track], key: Key, settings: DecodeSettings) -> Decoding:
    again = judged(strictest, threshold)
    kept = not any(channel.exchanged for channel in strictest.channels)
    if len(tracks) == 1 or (kept and again.uncertain in ((), strictest.uncertain)):
        return again
    return decode_tracks(tracks, key, replace(settings, threshold=threshold))
