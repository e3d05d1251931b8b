"""What a batch asks of every recording, in a form that travels to other processes and machines without any secret."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from mtm_audit.batch.fingerprint import decoding_fingerprint
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.model.lens import Lens
from mtm_audit.readers.logs.options import ReadOptions
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.key import Key, load_key
from mtm_onboard.protocol.revocation import RevocationList

_DIGITS = 16


@dataclass(frozen=True)
class KeyFile:
    """A key by its file: `name` as it was given, `path` absolute, and the SHA-256 of what it held at the start."""

    name: str
    path: Path
    sha256: str

    def load(self) -> Key:
        """The key; raises MtmError when the file is missing here, or is not the one that the batch began with."""
        if _sha256(self.path) != self.sha256:
            raise MtmError(
                f"the key file {self.path} here is not the one that the batch began with; copy that one here"
            )
        return load_key(self.path)


def named_keys(paths: Sequence[Path], revoked: RevocationList) -> tuple[KeyFile, ...]:
    """The keys in files; raises MtmError when one may not be used, or is named twice, which would be paid for twice."""
    keys = tuple(_named_key(path, revoked) for path in paths)
    for place, key in enumerate(keys):
        twice = next((other.name for other in keys[:place] if other.sha256 == key.sha256), None)
        if twice is not None:
            raise MtmError(f"{twice} and {key.name} hold the same key; name it once")
    return keys


def _named_key(path: Path, revoked: RevocationList) -> KeyFile:
    key = load_key(path)
    try:
        revoked.check(key)
        if (grant := key.holding.grant) is not None:
            grant.check_unexpired(datetime.now(UTC).timestamp())
    except MtmError as error:
        raise MtmError(f"{path}: {error}") from error
    return KeyFile(str(path), path.absolute(), _sha256(path))


def _sha256(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise MtmError(f"cannot read the key file {path}: {error.strerror}; each machine needs it there") from error


@dataclass(frozen=True, kw_only=True)
class Plan:
    """How each recording is read and decoded, and under which keys.

    `speed` None searches for it, as in a decode; `lens` is that of all films. `cache` is where tracks are kept, None
    the usual folder of whichever machine reads them. `code` is the state of the program that made the plan.
    """

    keys: tuple[KeyFile, ...]
    settings: DecodeSettings
    tracker: str = "aruco"
    reference: tuple[str, ...] = ()
    reading: ReadOptions = field(default_factory=ReadOptions)
    frame_rate_hz: float | None = None
    speed: float | None = 1.0
    lens: Lens | None = None
    cache: Path | None = None
    code: str = field(default_factory=decoding_fingerprint)

    @property
    def run(self) -> str:
        """Sixteen hexadecimal digits that differ when anything differs which rows depend on beside the recording."""
        asked = {name: value for name, value in asdict(self).items() if name not in ("keys", "cache")}
        text = json.dumps([asked, [(key.name, key.sha256) for key in self.keys]], sort_keys=True, default=_plain)
        return hashlib.sha256(text.encode()).hexdigest()[:_DIGITS]


def _plain(value: Any) -> Any:
    """What JSON has no form for."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    return dict(value) if isinstance(value, Mapping) else str(value)
