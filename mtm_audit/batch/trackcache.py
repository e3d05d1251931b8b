"""Tracks of films that were read before, in a folder, so that another key does not read the film again.

An entry is found by what the files hold, their names, how they are read, and the code that reads them. It begins with
the SHA-256 of its rest, so that a damaged one is noticed and made anew, and it appears whole or not at all. What was
used longest ago goes when the entries together are larger than `MOST_BYTES`.
"""

import hashlib
import io
import json
import os
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.recording import Recording
from mtm_audit.model.track import Track
from mtm_onboard.protocol.atomicfile import replacing
from mtm_onboard.protocol.errors import MtmError

# Some ten thousand minutes of film with four robots.
MOST_BYTES = 4 << 30
_SUFFIX = ".tracks"
_DIGEST_BYTES = 32


def usual_folder() -> Path:
    """Where the system's users keep what can be made anew."""
    named = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(named) if os.path.isabs(named) else Path.home() / ".cache") / "mtm" / "tracks"


@dataclass(frozen=True)
class TrackCache:
    """The entries in `folder`; what cannot be written there is read anew each time."""

    folder: Path
    most_bytes: int = MOST_BYTES

    def check(self) -> None:
        """Make the folder; raises MtmError when that is not possible, or it cannot be written."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        except OSError as error:
            raise MtmError(f"cannot make {self.folder}: {error.strerror}; name another folder with --cache") from error
        if not os.access(self.folder, os.W_OK | os.X_OK):
            raise MtmError(f"the folder {self.folder} is not yours to write; name another with --cache")

    def find(self, name: str, files: Sequence[Path]) -> Recording | None:
        """The film of that name as it was read, with `files` for its paths; None when it has to be read."""
        path = self._path(name)
        try:
            entry = path.read_bytes()
        except OSError:
            return None
        digest, content = entry[:_DIGEST_BYTES], entry[_DIGEST_BYTES:]
        if hashlib.sha256(content).digest() != digest:
            return None
        # The oldest go first, by when they were used.
        with suppress(OSError):
            os.utime(path)
        return _unpacked(content, files)

    def keep(self, name: str, recording: Recording) -> None:
        """Store a film under that name, and let go of what was used longest ago."""
        content = _packed(recording)
        with suppress(OSError, MtmError):
            self.folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            with replacing(self._path(name), mode=0o600) as temporary:
                temporary.write_bytes(hashlib.sha256(content).digest() + content)
            self._prune()

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}{_SUFFIX}"

    def _prune(self) -> None:
        kept_bytes = 0
        with os.scandir(self.folder) as entries:
            found = [(entry.stat(), entry.path) for entry in entries if entry.name.endswith(_SUFFIX)]
        for status, path in sorted(found, key=lambda item: -item[0].st_mtime_ns):
            kept_bytes += status.st_size
            if kept_bytes > self.most_bytes:
                Path(path).unlink(missing_ok=True)


def _packed(recording: Recording) -> bytes:
    described = {
        "tracks": [
            {"name": track.name, "axes": track.axes, "unit": track.unit, "extent_px": _plain(track.extent_px)}
            for track in recording.tracks
        ],
        "warnings": [_without_places(warning, recording.paths) for warning in recording.warnings],
        "at": None if recording.at is None else [recording.at.unix_s, recording.at.error_s],
    }
    arrays: dict[str, Any] = {"described": np.frombuffer(json.dumps(described).encode(), dtype=np.uint8)}
    for number, track in enumerate(recording.tracks):
        arrays |= {
            f"times{number}": track.times_s,
            f"positions{number}": track.positions,
            f"valid{number}": track.valid,
        }
        if track.headings_rad is not None:
            arrays[f"headings{number}"] = track.headings_rad
    packed = io.BytesIO()
    np.savez(packed, **arrays)
    return packed.getvalue()


def _plain(number: float | None) -> float | None:
    return None if number is None else float(number)


def _unpacked(content: bytes, files: Sequence[Path]) -> Recording:
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        described = json.loads(arrays["described"].tobytes())
        tracks = tuple(
            Track(
                name=track["name"],
                times_s=arrays[f"times{number}"],
                positions=arrays[f"positions{number}"],
                valid=arrays[f"valid{number}"],
                axes=tuple(track["axes"]),
                unit=track["unit"],
                headings_rad=arrays.get(f"headings{number}"),
                extent_px=track["extent_px"],
            )
            for number, track in enumerate(described["tracks"])
        )
    warnings = tuple(_with_places(warning, files) for warning in described["warnings"])
    at = None if described["at"] is None else RecordedAt(*described["at"])
    return Recording(tuple(files), "video", tracks, warnings, at)


def _without_places(warning: str, files: Sequence[Path]) -> str:
    """The sentence with a mark for each file's path, since the next time the same file may lie elsewhere."""
    for number, file in sorted(enumerate(files), key=lambda item: -len(str(item[1]))):
        warning = warning.replace(str(file), f"\0{number}\0")
    return warning


def _with_places(warning: str, files: Sequence[Path]) -> str:
    for number, file in enumerate(files):
        warning = warning.replace(f"\0{number}\0", str(file))
    return warning
