"""The key to decode with: from a key file, or from a public anchor and a disclosed day's key."""

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from mtm_audit.decoding.decoding import Decoding
from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.recording import Recording
from mtm_audit.model.stage import stage
from mtm_audit.reporting.basis import Basis, Disclosure, basis_of
from mtm_onboard.protocol.disclosure import load_anchor, load_disclosed
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.key import Key, load_key
from mtm_onboard.protocol.revocation import RevocationList


@dataclass(frozen=True)
class KeySource:
    """A key file, or else a public anchor and a disclosed day's key."""

    key: Path | None
    anchor: Path | None = None
    disclosed: Path | None = None


@dataclass(frozen=True)
class OpenedKey:
    """A key, and since when it may be public where it was disclosed."""

    key: Key
    public_from: datetime | None

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader should know of the key itself."""
        return () if self.key.warning is None else (self.key.warning,)

    def check_before_public(self, at: RecordedAt | None) -> None:
        """Raises MtmError, in the stage "verdict", when a film was made after the key was public."""
        if self.public_from is None or at is None or at.unix_s < self.public_from.timestamp():
            return
        with stage("verdict"):
            raise MtmError(
                f"the film is from after {self.public_from:%Y-%m-%d %H:%M} UTC, when the disclosed key was public: by "
                "then everybody could make such a motion, so it proves nothing; verify films of the disclosed day"
            )

    def basis(self, recording: Recording, decoding: Decoding, *, stated: bool) -> Basis:
        """What the verdict rests on; `stated` when a person says when the recording was made."""
        disclosure = None
        if self.public_from is not None:
            written = datetime.fromtimestamp(max(path.stat().st_mtime for path in recording.paths), UTC)
            disclosure = Disclosure(self.public_from, stated, written)
        return basis_of(decoding, self.key.holding.grant, disclosure)


def opened_key(source: KeySource, revoked: RevocationList) -> OpenedKey:
    """The key; raises MtmError when it may not be used, or is not that of its day in the anchor's chain."""
    if source.key is not None:
        key = load_key(source.key)
        revoked.check(key)
        if (grant := key.holding.grant) is not None:
            grant.check_unexpired(datetime.now(UTC).timestamp())
        return OpenedKey(key, None)
    assert source.anchor is not None
    assert source.disclosed is not None
    anchor = load_anchor(source.anchor)
    key = load_disclosed(source.disclosed, anchor)
    grant = key.holding.grant
    assert grant is not None
    return OpenedKey(key, anchor.disclosed_from(grant.first_day))
