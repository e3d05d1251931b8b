"""From a recording to a decoding: when it was made, at which speed it is played, and how its film is coded."""

from dataclasses import replace

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.decoding import Decoding
from mtm_audit.decoding.readings import Progress
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.decoding.speeds import at_speed, decode_at_speeds, played
from mtm_audit.decoding.together import Recorded
from mtm_audit.ingest.films import film_compression
from mtm_audit.model.recording import Recording
from mtm_onboard.protocol.key import Key


def recorded_of(recording: Recording, settings: DecodeSettings, speed: float) -> Recorded:
    """The recording, played at `speed`, for a decode together with others."""
    timed = _timed(recording, settings)
    return Recorded(played(recording.tracks, speed), at_speed(timed, recording.tracks, speed))


def _timed(recording: Recording, settings: DecodeSettings) -> DecodeSettings:
    """The settings with the time of the recording; what a person says of it comes before what the file says."""
    given = settings.at
    return replace(settings, at=recording.at if given is None else recording.begun_at(given))


def decode_recording(
    recording: Recording, key: Key, settings: DecodeSettings, speed: float | None, progress: Progress | None = None
) -> tuple[Recording, Decoding]:
    """The recording at the speed at which it was decoded, and its decoding; `speed` None searches for it.

    A film that was not decoded comes with its compression, which is what may have kept the message from being read.
    Raises MtmError as `decode_tracks` does.
    """
    timed = _timed(recording, settings)
    tracks = recording.tracks
    if speed is None:
        found, decoding = decode_at_speeds(tracks, key, timed, progress)
    else:
        found = speed
        decoding = decode_tracks(played(tracks, speed), key, at_speed(timed, tracks, speed), progress)
    lost = recording.kind == "video" and decoding.verdict != "decoded"
    shown = replace(
        recording,
        tracks=played(tracks, found),
        speed=found,
        speed_searched=speed is None,
        compression=film_compression(recording.paths) if lost else None,
    )
    return shown, decoding
