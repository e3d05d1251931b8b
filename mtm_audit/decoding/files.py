"""From files to a decoding, in one call."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.decoding import Decoding
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.decoding.speeds import at_speed, played
from mtm_audit.ingest.recording import read_recording, recording_files
from mtm_audit.model.lens import Lens
from mtm_audit.readers.logs.options import ReadOptions
from mtm_onboard.protocol.key import Key, load_key


def decode(
    paths: str | Path | Sequence[str | Path],
    key: Key | str | Path,
    *,
    tracker: str = "aruco",
    reference: Sequence[str] = (),
    settings: DecodeSettings | None = None,
    reading: ReadOptions | None = None,
    frame_rate_hz: float | None = None,
    speed: float = 1.0,
    lens: Lens | None = None,
) -> Decoding:
    """The decoding of one recording: a video, pictures, logs or motion-capture files, or a folder of them.

    `key` is a key or its file; `tracker` and `reference`, tracks that stand still, are asked of films alone, as
    `mtm-audit decode` asks for them, and `reading` of logs. A recording that says when it was made is believed unless
    `settings.at` says otherwise. `frame_rate_hz` replaces the times of a film, and the recording is played `speed`
    times as fast as its times say. `lens` is that of a film's camera, as `read_lens` reads it. Raises MtmError, with
    one sentence that says what to do, when a file cannot be used or nothing in it can be read.
    """
    named = [paths] if isinstance(paths, str | Path) else paths
    opened = key if isinstance(key, Key) else load_key(Path(key))
    asked = DecodeSettings() if settings is None else settings
    files, kind = recording_files([Path(path) for path in named])
    recording = read_recording(
        files, kind, tracker, options=reading, frame_rate_hz=frame_rate_hz, reference=reference, lens=lens
    )
    timed = asked if asked.at is not None else replace(asked, at=recording.at)
    tracks = recording.tracks
    return decode_tracks(played(tracks, speed), opened, at_speed(timed, tracks, speed))
