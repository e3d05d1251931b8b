"""What a picture or a report is about: recording, key and dates in one line."""

import time
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from mtm_audit.decoding.decoding import Decoding
from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.recording import Recording


def subject_line(recording: Recording, decoding: Decoding, drawn: datetime) -> str:
    """Recording, key, when it was recorded where that is known, and when the picture was drawn."""
    at = decoding.settings.at or recording.at
    return " · ".join(
        [
            f"recording {files_named(recording.paths)}",
            f"key {decoding.key_id} (scheme {decoding.scheme.name}, {decoding.scheme.fingerprint})",
            f"recorded {_begun(at, recording)}" if at is not None else "recorded at an unknown time",
            f"drawn {dated(drawn)}",
        ]
    )


def files_named(paths: Sequence[Path]) -> str:
    """One file by its name, several by their folder."""
    first, *others = paths
    return first.name if not others else f"{first.parent.name or first.parent}/ ({len(paths)} files)"


def dated(when: datetime) -> str:
    """Date, time and zone, such as 2026-01-31 12:00:00 +01:00."""
    return when.isoformat(sep=" ", timespec="seconds").replace("+", " +")


def now() -> datetime:
    """The present moment with the machine's zone."""
    return datetime.fromtimestamp(time.time(), UTC).astimezone()


def _begun(at: RecordedAt, recording: Recording) -> str:
    """When the first observation was made; `at` is when the recording's own clock stood at zero."""
    first_s = min(float(track.times_s[0]) for track in recording.tracks)
    return f"{datetime.fromtimestamp(at.unix_s + first_s, UTC):%Y-%m-%d %H:%M:%S} UTC"
