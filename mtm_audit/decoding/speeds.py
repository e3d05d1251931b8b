"""Recordings whose clock ran at another speed than the robot's: slow motion, time lapse, a wrong frame rate."""

import math
from collections.abc import Sequence
from dataclasses import replace

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.decoding import Decoding
from mtm_audit.decoding.paid import paid_for, worth
from mtm_audit.decoding.readings import Progress, part_of
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.model.track import Track
from mtm_onboard.protocol.errors import MtmError, WrongValueError
from mtm_onboard.protocol.key import Key

# Cameras film slow motion and time lapse at powers of two and at 120, 60, 50, 25 or 24 frames a second shown at 24, 25
# or 30. The likeliest come first, since the search ends with the first message that is decoded.
SPEEDS = (1.0, 4.0, 2.0, 0.5, 8.0, 0.25, 1.2, 5 / 6, 1.5, 2 / 3, 2.4, 5.0, 2.5, 0.4, 0.125)
# Clocks are better than this, and neighbouring speeds farther apart.
_CLOCK_ERROR = 0.02


def check_speed(speed: float) -> None:
    """Raise MtmError unless something can be played that many times as fast."""
    if not (math.isfinite(speed) and speed > 0.0):
        raise WrongValueError(f"a recording cannot be played {speed} times as fast; give a number above zero")


def played(tracks: Sequence[Track], speed: float) -> tuple[Track, ...]:
    """The tracks played `speed` times as fast, their first instant where it was: 4 for 120 frames shown at 30.

    Raises MtmError when that is no speed.
    """
    check_speed(speed)
    begin_s = _begin_s(tracks)
    return tuple(replace(track, times_s=begin_s + (track.times_s - begin_s) / speed) for track in tracks)


def at_speed(settings: DecodeSettings, tracks: Sequence[Track], speed: float) -> DecodeSettings:
    """The settings for what `played` gives of the tracks: an onset is meant in the recording's own time."""
    if settings.onset_s is None:
        return settings
    begin_s = _begin_s(tracks)
    return replace(settings, onset_s=begin_s + (settings.onset_s - begin_s) / speed)


def decode_at_speeds(
    tracks: Sequence[Track],
    key: Key,
    settings: DecodeSettings,
    progress: Progress | None = None,
    speeds: Sequence[float] = SPEEDS,
) -> tuple[float, Decoding]:
    """The speed that suits the recording best, and its decoding, with the search paid for.

    All speeds have the same prior, so each one's e-values are divided by their number, for the message and for each
    symbol; checks of frames count that many times. Whatever is decoded is wrong with the threshold's probability at
    most. The search ends at the first speed that decodes with the robot's clock near its rate: a decode finds clocks
    that are a fifth off, and another speed then suits better. Raises MtmError when the recording can be read at none.
    """
    best: tuple[float, Decoding] | None = None
    refusal: MtmError | None = None
    for number, speed in enumerate(speeds):
        shown = part_of(progress, "speed", number, len(speeds))
        try:
            found = decode_tracks(played(tracks, speed), key, at_speed(settings, tracks, speed), shown)
        except MtmError as error:
            refusal = refusal or error
            continue
        paid = paid_for(found, len(speeds))
        if best is None or worth(paid) > worth(best[1]):
            best = speed, paid
        if _settles(paid):
            break
    if best is None:
        raise refusal or MtmError("there is no speed to try; name at least one")
    return best


def _settles(decoding: Decoding) -> bool:
    """Whether it is decoded, and no clock that was read is far from the scheme's rate."""
    nominal_hz = decoding.scheme.rate_hz
    rates_hz = [channel.reading.timing.rate_hz for channel in decoding.channels if channel.reading is not None]
    return decoding.verdict == "decoded" and all(abs(rate / nominal_hz - 1.0) <= _CLOCK_ERROR for rate in rates_hz)


def _begin_s(tracks: Sequence[Track]) -> float:
    return min((float(track.times_s[0]) for track in tracks if len(track.times_s)), default=0.0)
