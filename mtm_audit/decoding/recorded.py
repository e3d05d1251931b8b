"""From a recording to a decoding: when it was made, at which speed it is played, and how its film is coded."""

from dataclasses import replace

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.decoding import Decoding
from mtm_audit.decoding.readings import Progress
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.decoding.speeds import at_speed, decode_at_speeds, played
from mtm_audit.ingest.films import film_compression
from mtm_audit.model.recording import Recording
from mtm_onboard.protocol.key import Key


def decode_recording(
    recording: Recording, key: Key, settings: DecodeSettings, speed: float | None, progress: Progress | None = None
) -> tuple[Recording, Decoding]:
    """The recording at the speed at which it was decoded, and its decoding; `speed` None searches for it.

    A film that was not decoded comes with its compression, which is what may have kept the message from being read.
    Raises MtmError as `decode_tracks` does.
    """
    given = settings.at
    # What a person says of the recording's time comes before what the file says.
    timed = replace(settings, at=recording.at if given is None else recording.begun_at(given))
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
