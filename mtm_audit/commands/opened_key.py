"""The key to decode with: from a key file, from a public anchor and a disclosed day's key, or from an anchor alone."""

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from mtm_audit.decoding.decoding import Decoding
from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.recording import Recording
from mtm_audit.model.stage import stage
from mtm_audit.reporting.basis import Basis, Disclosure, basis_of
from mtm_onboard.protocol.disclosure import Anchor, load_anchor, load_disclosed
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.holding import day_of_epoch
from mtm_onboard.protocol.key import Key, load_key
from mtm_onboard.protocol.public_channel import carried_key, public_key
from mtm_onboard.protocol.revocation import RevocationList
from mtm_onboard.protocol.slots import epoch_of_slot


@dataclass(frozen=True)
class KeySource:
    """A key file, or else a public anchor: with a disclosed day's key, or alone for its public channel."""

    key: Path | None
    anchor: Path | None = None
    disclosed: Path | None = None


@dataclass(frozen=True)
class OpenedKey:
    """A key, and since when it may be public where it was disclosed; `anchor` is the public channel's."""

    key: Key
    public_from: datetime | None
    anchor: Anchor | None = None

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

    def carried(self, decoding: Decoding) -> Key | None:
        """The disclosed key that was read on the public channel; None on another and where nothing is decoded.

        Raises MtmError, in the stage "verdict", when what was read is no key of the anchor's chain.
        """
        if self.anchor is None or decoding.verdict != "decoded":
            return None
        with stage("verdict"):
            if not isinstance(decoding.message, bytes):
                raise TypeError("the public channel's messages are bytes")
            epoch = epoch_of_slot(decoding.frames[-1].slots[1], decoding.scheme)[0]
            return carried_key(self.anchor, decoding.message, day_of_epoch(epoch, decoding.scheme))

    def basis(self, recording: Recording, decoding: Decoding, carried: Key | None, *, stated: bool) -> Basis:
        """What the verdict rests on; `stated` when a person says when the recording was made."""
        disclosure = None
        if self.public_from is not None:
            written = datetime.fromtimestamp(max(path.stat().st_mtime for path in recording.paths), UTC)
            disclosure = Disclosure(self.public_from, stated, written)
        return basis_of(decoding, self.key.holding.grant, disclosure, carried)


def opened_key(source: KeySource, revoked: RevocationList) -> OpenedKey:
    """The key; raises MtmError when it may not be used, or is not that of its day in the anchor's chain."""
    if source.key is not None:
        key = load_key(source.key)
        revoked.check(key)
        if (grant := key.holding.grant) is not None:
            grant.check_unexpired(datetime.now(UTC).timestamp())
        return OpenedKey(key, None)
    assert source.anchor is not None
    anchor = load_anchor(source.anchor)
    if source.disclosed is None:
        return OpenedKey(public_key(anchor), None, anchor)
    key = load_disclosed(source.disclosed, anchor)
    grant = key.holding.grant
    assert grant is not None
    return OpenedKey(key, anchor.disclosed_from(grant.first_day))
