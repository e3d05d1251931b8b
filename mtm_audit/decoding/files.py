"""From files to a decoding, in one call."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.decoding import Decoding
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.ingest.recording import read_recording, recording_files
from mtm_onboard.protocol.key import Key, load_key


def decode(
    paths: str | Path | Sequence[str | Path],
    key: Key | str | Path,
    *,
    tracker: str = "aruco",
    reference: Sequence[str] = (),
    settings: DecodeSettings | None = None,
) -> Decoding:
    """The decoding of one recording: a video, motion-capture files, or a folder of them.

    `key` is a key or its file; `tracker` and `reference`, tracks that stand still, are asked of videos alone, as
    `mtm-audit decode` asks for them. A recording that says when it was made is believed unless `settings.at` says
    otherwise. Raises MtmError, with one sentence that says what to do, when a file cannot be used or nothing in it can
    be read.
    """
    named = [paths] if isinstance(paths, str | Path) else paths
    opened = key if isinstance(key, Key) else load_key(Path(key))
    asked = DecodeSettings() if settings is None else settings
    files, kind = recording_files([Path(path) for path in named])
    recording = read_recording(files, kind, tracker, reference=reference)
    return decode_tracks(recording.tracks, opened, asked if asked.at is not None else replace(asked, at=recording.at))
